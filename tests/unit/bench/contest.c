/* SPDX-License-Identifier: MIT */
/* The benchmark's own eyes: wrong answers are seen, edges are told from faults. A tracer that spoils `naive`'s
 * answers stands in for a broken one; Embree is the truth. */
#include "tests/bench/bench_contest.h"
#include "tests/harness/test.h"

#include <stddef.h>
#include <stdint.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define EDGE 64u
#define RAYS (EDGE * EDGE)

static struct gpu_device *device;
static struct bench_scene scene;

/* ---- a tracer that lies ---- */

enum lie { LIE_NONE, LIE_FARTHER, LIE_MISSES };
static enum lie lie;
static struct tracer *honest;

static struct tracer *liar_create(struct gpu_device *on, const struct tracer_options *options, struct error *error)
{
    (void)options;
    honest = tracer_create(&tracer_naive_impl, on, NULL, error);
    return honest ? calloc(1, sizeof(struct tracer)) : NULL;
}

static void liar_destroy(struct tracer *tracer)
{
    tracer_destroy(honest);
    free(tracer);
}

static enum tracer_progress liar_update(struct tracer *tracer, struct gpu_scene *gpu,
                                        const struct tracer_update *update, struct error *error)
{
    (void)tracer;
    return tracer_progress_of(tracer_update(honest, gpu, update, error));
}

/* Every hundredth hit is told wrong. */
static bool liar_trace(struct tracer *tracer, struct gpu_scene *gpu, struct trace_state *state,
                       const struct ray_range *rays, struct error *error)
{
    static struct hit hits[RAYS];
    const struct wave *wave = &state->wave;
    (void)rays; /* all of them */
    if (!tracer_intersect(honest, gpu, wave, error) || lie == LIE_NONE)
        return true;
    gpu_buffer_read(tracer->device, wave->hits, 0, hits, wave->ray_count * sizeof(*hits));
    for (uint32_t i = 0, met = 0; i < wave->ray_count; i++) {
        if (hits[i].distance >= 0 && met++ % 100 == 0)
            hits[i].distance = lie == LIE_MISSES ? -1 : hits[i].distance * 1.01f;
    }
    gpu_buffer_write(tracer->device, wave->hits, 0, hits, wave->ray_count * sizeof(*hits));
    return true;
}

static const struct tracer_impl liar_impl = {.name = "liar",
                                             .create = liar_create,
                                             .destroy = liar_destroy,
                                             .update = liar_update,
                                             .trace_range = liar_trace};

/* ---- a contest of it and Embree ---- */

struct outcome {
    uint32_t differing, edges, rays;
    bool failed;
    unsigned runs;
};

static struct outcome contest_with(enum lie told)
{
    static struct ray rays[RAYS];
    struct error error = {0};
    uint64_t build_ns;
    lie = told;
    struct tracer *liar = tracer_create(&liar_impl, device, NULL, &error);
    struct bench_embree *embree = bench_embree_create(&scene.gpu, true, &build_ns, &error);
    assert_non_null(liar);
    assert_non_null(embree);
    assert_true(build_ns > 0);
    assert_true(bench_embree_bytes(embree) > 0);
    assert_true(tracer_update(liar, &scene.gpu, &(struct tracer_update){0}, &error));
    struct bench_contest contest = {.device = device, .scene = &scene, .runs = 2};
    struct bench_contender *raw = bench_contest_add(&contest, "embree", "1 a call, robust", BENCH_RAW);
    raw->embree = embree;
    raw->packet = 1;
    struct bench_contender *liars = bench_contest_add(&contest, "liar", "auto", BENCH_INTERFACE);
    liars->tracer_used = liar;
    liars->is_exact = true;
    bench_camera_rays(rays, &scene.camera, EDGE, EDGE);
    if (!bench_contest_wave(&contest, &(struct bench_wave){BENCH_PRIMARY, rays, RAYS}, &error))
        fail_msg("%s", error.text);
    assert_true(liars->is_compared);
    assert_false(raw->is_compared);
    assert_int_equal(raw->runs.count, 2);
    const struct outcome outcome = {liars->differing, liars->edges, RAYS, bench_contender_failed(liars, RAYS),
                                    liars->runs.count};
    bench_contest_finish(&contest);
    bench_embree_destroy(embree);
    tracer_destroy(liar);
    return outcome;
}

static int make_scene(void **state)
{
    struct error error = {0};
    (void)state;
    device = gpu_device_create(&(struct gpu_options){.index = -1}, &error);
    if (!device)
        return 0;
    const struct bench_scene_options options = {.family_triangles = 1000, .aspect = 1};
    return bench_scene_init(&scene, device, &options, &error) ? 0 : -1;
}

static int drop_scene(void **state)
{
    (void)state;
    if (device)
        bench_scene_finish(&scene);
    gpu_device_destroy(device);
    return 0;
}

static void skip_without_device(void)
{
    if (!device) {
        print_message("skipped: no OpenGL device\n");
        skip();
    }
}

ALL_TESTS(make_scene, drop_scene)

TEST(right_answers_pass)
{
    skip_without_device();
    const struct outcome outcome = contest_with(LIE_NONE);
    /* What differs lies at edges: brute force and Embree round differently there. */
    assert_int_equal(outcome.differing, outcome.edges);
    assert_false(outcome.failed);
    assert_int_equal(outcome.runs, 2); /* the warm-up is not counted */
}

TEST(distances_a_hundredth_off_fail)
{
    skip_without_device();
    const struct outcome outcome = contest_with(LIE_FARTHER);
    assert_in_range(outcome.differing - outcome.edges, RAYS / 400,
                    RAYS / 90); /* most rays hit, one in 100 is off */
    assert_true(outcome.failed);
}

TEST(hits_that_were_missed_fail)
{
    skip_without_device();
    const struct outcome outcome = contest_with(LIE_MISSES);
    assert_in_range(outcome.differing - outcome.edges, RAYS / 400, RAYS / 90);
    assert_true(outcome.failed);
}

TEST(packets_of_every_size_answer_alike)
{
    static struct ray rays[RAYS];
    static struct bench_intersection intersections[3][RAYS];
    static uint32_t visibilities[3][RAYS];
    static const unsigned packets[3] = {1, 8, 16};
    struct error error = {0};
    uint64_t build_ns;
    (void)state;
    skip_without_device();
    struct bench_embree *embree = bench_embree_create(&scene.gpu, true, &build_ns, &error);
    assert_non_null(embree);
    bench_camera_rays(rays, &scene.camera, EDGE, EDGE);
    rays[5].direction_t_max[3] = -1; /* dead */
    const uint32_t count = RAYS - 3; /* no multiple of a packet */
    for (int i = 0; i < 3; i++) {
        bench_embree_trace(embree,
                           &(struct bench_embree_wave){rays, count, packets[i], true, intersections[i], NULL});
        bench_embree_trace(embree,
                           &(struct bench_embree_wave){rays, count, packets[i], true, NULL, visibilities[i]});
    }
    unsigned met = 0;
    for (uint32_t k = 0; k < count; k++) {
        met += intersections[0][k].distance >= 0;
        assert_int_equal(visibilities[0][k] == 0, intersections[0][k].distance >= 0);
        for (int i = 1; i < 3; i++) {
            assert_float_equal(intersections[i][k].distance, intersections[0][k].distance, 1e-4f);
            assert_int_equal(visibilities[i][k], visibilities[0][k]);
        }
    }
    assert_true(met > count / 2);
    assert_true(intersections[0][5].distance < 0);
    assert_int_equal(visibilities[0][5], UINT32_MAX);
    bench_embree_destroy(embree);
}

TEST(the_median_and_its_deviation_are_those_of_the_runs)
{
    static const uint64_t times[] = {50, 10, 20, 1000, 30};
    struct bench_runs runs = {0};
    (void)state;
    assert_true(bench_figure(&runs).median_ns == 0);
    for (size_t i = 0; i < sizeof(times) / sizeof(times[0]); i++)
        bench_add(&runs, times[i]);
    const struct bench_figure figure = bench_figure(&runs);
    assert_true(figure.median_ns == 30 && figure.deviation_ns == 20); /* of 20 20 10 970 0 */
    assert_true(figure.min_ns == 10 && figure.max_ns == 1000);
}
