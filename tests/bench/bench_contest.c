/* SPDX-License-Identifier: MIT */
#include "tests/bench/bench_contest.h"

#include "base/clock.h"

#include <epoxy/gl.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Two distances are of one surface. Rounding is near 1e-6 of the distance, and more where a ray grazes; a wrong
 * surface is off by more than a thousandth of what is seen in any scene here. */
#define DISTANCE_TOLERANCE 1e-4f
#define DISTANCE_OF_DIAGONAL 1e-6f
#define VISIBILITY_TOLERANCE                                                                                      \
    0.02f /* tolerance of the transmittance: two unorm 8-bit steps a channel, twice tinted */
#define DISAGREEMENT_MAX 1e-4
/* A hair's breadth: of the diagonal, and as a turn in radians; some ten roundings of a position. */
#define NUDGE 2e-6f
#define NUDGES 10u
#define WARM_UP_NS UINT64_C(50000000)
#define EXAMINED_MAX                                                                                              \
    20000u /* disagreeing rays that are looked at for edges; beyond it the run has failed anyway */

struct bench_contender *bench_contest_add(struct bench_contest *contest, struct tracer *tracer, enum bench_way way)
{
    struct bench_contender *added = &contest->contenders[contest->contender_count++];
    *added = (struct bench_contender){.name = tracer->impl->name, .tracer = tracer, .way = way};
    return added;
}

/* Any-hit waves have a visibility and nothing else. */
static bool fits(const struct bench_contender *contender, enum bench_wave_kind kind)
{
    return contender->way == BENCH_INTERFACE || !bench_wave_facts[kind].is_any;
}

/* ---- one run ---- */

static bool upload(struct bench_contest *contest, const struct bench_wave *wave, struct error *error)
{
    const bool is_any = bench_wave_facts[wave->kind].is_any;
    return gpu_buffer_upload(contest->device, &contest->ray_buffer, wave->rays,
                             wave->ray_count * sizeof(struct ray), error) &&
           gpu_buffer_reserve(contest->device, &contest->answer_buffer,
                              wave->ray_count * (is_any ? sizeof(uint32_t) : sizeof(struct hit)), error);
}

static bool run_tracer(struct bench_contest *contest, struct tracer *tracer, bool intersections_only,
                       const struct bench_wave *wave, struct error *error)
{
    const struct bench_wave_fact *fact = &bench_wave_facts[wave->kind];
    const struct wave on_device = {.kind = fact->is_any ? WAVE_ANY : WAVE_CLOSEST,
                                   .ray_count = wave->ray_count,
                                   .rays = &contest->ray_buffer,
                                   .hits = &contest->answer_buffer,
                                   .visibility = &contest->answer_buffer,
                                   .shared_origin = fact->shared_origin};
    struct gpu_scene *gpu = &contest->scene->gpu;
    bool ok = intersections_only ? tracer_intersect(tracer, gpu, &on_device, error)
                                 : tracer_trace(tracer, gpu, &on_device, error);
    return ok;
}

struct run_time {
    uint64_t host_ns, device_ns; /* device: 0: it has no clock */
};

static bool run_once(struct bench_contest *contest, const struct bench_contender *contender,
                     const struct bench_wave *wave, struct run_time *time, struct error *error)
{
    const bool has_clock = contest->device->facts.time_stamp_bits > 0;
    GLuint stamps[2];
    GLuint64 stamps_ns[2] = {0};
    glGenQueries(2, stamps);
    const uint64_t start_ns = clock_now_ns();
    if (has_clock)
        glQueryCounter(stamps[0], GL_TIMESTAMP);
    const bool ok = run_tracer(contest, contender->tracer, contender->way == BENCH_TRAVERSAL, wave, error);
    if (has_clock)
        glQueryCounter(stamps[1], GL_TIMESTAMP);
    glFinish();
    time->host_ns = clock_now_ns() - start_ns;
    for (int i = 0; has_clock && i < 2; i++)
        glGetQueryObjectui64v(stamps[i], GL_QUERY_RESULT, &stamps_ns[i]);
    time->device_ns = stamps_ns[1] - stamps_ns[0];
    glDeleteQueries(2, stamps);
    return ok;
}

/* ---- answers ---- */

static float let_through(uint32_t visibility)
{
    return (float)((visibility & 255) + (visibility >> 8 & 255) + (visibility >> 16 & 255)) / 765;
}

/* Reads a number for each ray: the distance (< 0: nothing), or the transmittance; by way of `raw`. */
static void read_answers(struct bench_contest *contest, const struct bench_wave *wave, void *raw, float *answers)
{
    const bool is_any = bench_wave_facts[wave->kind].is_any;
    const size_t item_bytes = is_any ? sizeof(uint32_t) : sizeof(struct hit);
    gpu_buffer_read(contest->device, &contest->answer_buffer, 0, raw, wave->ray_count * item_bytes);
    for (uint32_t i = 0; i < wave->ray_count; i++)
        answers[i] = is_any ? let_through(((const uint32_t *)raw)[i]) : ((const struct hit *)raw)[i].distance;
}

static bool is_same(const struct bench_contest *contest, bool is_any, float truth, float answer)
{
    if (is_any)
        return fabsf(truth - answer) <= VISIBILITY_TOLERANCE;
    if (truth < 0 || answer < 0)
        return truth < 0 && answer < 0;
    return fabsf(truth - answer) <=
           DISTANCE_TOLERANCE * truth + DISTANCE_OF_DIAGONAL * contest->scene->gpu.diagonal;
}

/* The ray moved or turned a little: two ways along each of five axes. */
static void nudge(struct ray *out, const struct ray *ray, uint32_t which, float diagonal)
{
    const float *d = ray->direction_t_max;
    float side[3], above[3], by = (which & 1 ? -1.0f : 1.0f) * NUDGE;
    int minimum =
        fabsf(d[0]) < fabsf(d[1]) ? (fabsf(d[0]) < fabsf(d[2]) ? 0 : 2) : (fabsf(d[1]) < fabsf(d[2]) ? 1 : 2);
    int a = (minimum + 1) % 3, b = (minimum + 2) % 3;
    side[minimum] = 0;
    side[a] = -d[b];
    side[b] = d[a];
    above[0] = d[1] * side[2] - d[2] * side[1];
    above[1] = d[2] * side[0] - d[0] * side[2];
    above[2] = d[0] * side[1] - d[1] * side[0];
    *out = *ray;
    for (int k = 0; k < 3; k++) {
        const float towards[5] = {side[k], above[k], side[k], above[k], d[k]};
        if (which / 2 < 2)
            out->direction_t_max[k] += by * towards[which / 2];
        else
            out->origin_t_min[k] += by * diagonal * towards[which / 2];
    }
}

/* How many of the rays at `places` have an answer that the truth gives to a neighbour. */
static bool count_edges(struct bench_contest *contest, const struct bench_contender *truth,
                        const struct bench_wave *wave, const uint32_t *places, uint32_t count,
                        const float *answers, uint32_t *edges, struct error *error)
{
    const bool is_any = bench_wave_facts[wave->kind].is_any;
    struct ray *rays = malloc(count * NUDGES * sizeof(*rays));
    void *raw = malloc(count * NUDGES * sizeof(struct hit));
    float *near = malloc(count * NUDGES * sizeof(*near));
    const struct bench_wave nudged = {.kind = wave->kind, .rays = rays, .ray_count = count * NUDGES};
    struct run_time time;
    bool ok = rays && raw && near;
    *edges = 0;
    for (uint32_t i = 0; ok && i < count * NUDGES; i++)
        nudge(&rays[i], &wave->rays[places[i / NUDGES]], i % NUDGES, contest->scene->gpu.diagonal);
    ok = ok && upload(contest, &nudged, error) && run_once(contest, truth, &nudged, &time, error);
    if (ok)
        read_answers(contest, &nudged, raw, near);
    for (uint32_t i = 0; ok && i < count; i++) {
        bool is_edge = false;
        for (uint32_t k = 0; k < NUDGES; k++)
            is_edge = is_edge || is_same(contest, is_any, near[i * NUDGES + k], answers[places[i]]);
        *edges += is_edge;
    }
    free(rays);
    free(raw);
    free(near);
    return ok || error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory to look at edges");
}

/* Leaves other rays than the wave's in the buffers where some differ. */
static bool compare(struct bench_contest *contest, struct bench_contender *contender,
                    const struct bench_contender *truth, const struct bench_wave *wave, const float *truths,
                    const float *answers, struct error *error)
{
    const bool is_any = bench_wave_facts[wave->kind].is_any;
    uint32_t *places = malloc(EXAMINED_MAX * sizeof(*places));
    if (!places)
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory to compare");
    contender->is_compared = true;
    contender->differing = contender->edges = 0;
    for (uint32_t i = 0; i < wave->ray_count; i++) {
        if (is_same(contest, is_any, truths[i], answers[i]))
            continue;
        if (contender->differing < EXAMINED_MAX)
            places[contender->differing] = i;
        contender->differing++;
    }
    bool ok = true;
    if (contender->differing > 0)
        ok = count_edges(contest, truth, wave, places,
                         contender->differing < EXAMINED_MAX ? contender->differing : EXAMINED_MAX, answers,
                         &contender->edges, error) &&
             upload(contest, wave, error);
    free(places);
    return ok;
}

bool bench_contender_failed(const struct bench_contender *contender, uint32_t ray_count)
{
    return contender->is_exact && contender->is_compared &&
           (double)(contender->differing - contender->edges) > DISAGREEMENT_MAX * (double)ray_count;
}

/* ---- a wave ---- */

/* The contender whose answers count as right: the reference. NULL: there is none. */
static const struct bench_contender *find_truth(const struct bench_contest *contest)
{
    for (unsigned i = 0; i < contest->contender_count; i++) {
        const struct bench_contender *contender = &contest->contenders[i];
        if (contender->way == BENCH_INTERFACE && strcmp(contender->tracer->impl->name, "reference") == 0)
            return contender;
    }
    return NULL;
}

/* Runs each contender once; the round's number turns their order. The results of the last round are compared. */
static bool run_round(struct bench_contest *contest, unsigned round, const struct bench_wave *wave,
                      const struct bench_contender *truth, void *raw, float *truths, float *answers,
                      struct error *error)
{
    for (unsigned k = 0; k < contest->contender_count; k++) {
        struct bench_contender *contender = &contest->contenders[(k + round) % contest->contender_count];
        struct run_time time;
        if (!fits(contender, wave->kind))
            continue;
        if (!run_once(contest, contender, wave, &time, error))
            return false;
        if (round > 0) {
            bench_add(&contender->runs, time.host_ns);
            bench_add(&contender->device_runs, time.device_ns);
        }
        if (round == 0 && contender == truth)
            read_answers(contest, wave, raw, truths);
        if (round < contest->runs || !truth || contender == truth)
            continue;
        read_answers(contest, wave, raw, answers);
        if (!compare(contest, contender, truth, wave, truths, answers, error))
            return false;
    }
    return true;
}

/* Keeps hardware at work: idle, its clock is a fraction of what it is at work. */
static bool warm_up(struct bench_contest *contest, const struct bench_wave *wave, struct error *error)
{
    const uint64_t start_ns = clock_now_ns();
    struct run_time time;
    bool ok = true;
    for (unsigned i = 0; ok && !contest->device->info.software && clock_now_ns() - start_ns < WARM_UP_NS; i++) {
        const struct bench_contender *contender = &contest->contenders[i % contest->contender_count];
        ok = !fits(contender, wave->kind) || run_once(contest, contender, wave, &time, error);
    }
    return ok;
}

bool bench_contest_wave(struct bench_contest *contest, const struct bench_wave *wave, struct error *error)
{
    const struct bench_contender *truth = find_truth(contest);
    void *raw = malloc(wave->ray_count * sizeof(struct hit));
    float *truths = malloc(wave->ray_count * sizeof(*truths)),
          *answers = malloc(wave->ray_count * sizeof(*answers));
    bool ok = raw && truths && answers;
    if (!ok)
        error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for a wave");
    for (unsigned i = 0; i < contest->contender_count; i++) {
        contest->contenders[i].runs.count = contest->contenders[i].device_runs.count = 0;
        contest->contenders[i].is_compared = false;
    }
    gpu_scene_bind(&contest->scene->gpu);
    ok = ok && upload(contest, wave, error) && warm_up(contest, wave, error);
    for (unsigned round = 0; ok && round <= contest->runs; round++)
        ok = run_round(contest, round, wave, truth, raw, truths, answers, error);
    ok = ok && gpu_check(contest->device, "bench", error);
    free(raw);
    free(truths);
    free(answers);
    return ok;
}

bool bench_contest_hits(struct bench_contest *contest, struct tracer *tracer, const struct bench_wave *wave,
                        struct hit *hits, struct error *error)
{
    gpu_scene_bind(&contest->scene->gpu);
    if (!upload(contest, wave, error) || !run_tracer(contest, tracer, false, wave, error))
        return false;
    gpu_buffer_read(contest->device, &contest->answer_buffer, 0, hits, wave->ray_count * sizeof(*hits));
    return true;
}

void bench_contest_finish(struct bench_contest *contest)
{
    gpu_buffer_finish(contest->device, &contest->ray_buffer);
    gpu_buffer_finish(contest->device, &contest->answer_buffer);
}
