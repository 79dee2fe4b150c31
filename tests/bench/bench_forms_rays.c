/* SPDX-License-Identifier: MIT */
/* Builds: {"name", "structure", "bytes", "build_ns": [..]}; of octrees also "octree": what the last build counted.
 * Waves: the same, and "waves": [{"kind", "rays", "hits_ns": [..], "traversal_ns": [..]}]: rays to hits on the
 * device, surfaces included, and the traversal alone (of any-hit waves there is none). Closest-hit waves beside
 * the reference also have "agree" (share of the rays that hit with both or miss with both), "only_form",
 * "only_reference", "far" and "normals" (shares of the rays: both hit, farther apart than 0.0001 of the scene's
 * diagonal; near, but with normals more than five degrees apart, or of another material), and of rays that hit
 * with both the difference of distances: "error_median", "error_p99", in metres; of ldc and abuffer also what a
 * ray looked at in the mean: "nodes" (abuffer: blocks of voxels), "texels" (or cells) and "samples". Rays begin
 * where the reference's camera rays hit. */
#include "tests/bench/bench_forms.h"

#include "base/clock.h"
#include "render/compare/rays.h"
#include "tests/bench/plain_pass.h"
#include "tests/bench/svo.h"

#include <epoxy/gl.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- builds ---- */

static bool make(struct bench_forms *bench, struct bench_form *form, struct error *error)
{
    const struct tracer_impl *impl = bench_form_impl(form, error);
    form->made = impl ? tracer_create(impl, bench->device, &form->options, error) : NULL;
    return form->made != NULL;
}

static bool is_rasterised(const struct bench_form *form)
{
    return form->rival || form->tracer == TRACER_LDC || form->tracer == TRACER_ABUFFER;
}

/* All that there is counts as changed. What is rasterised keeps its buffers, as it does for what moves; others,
 * which would find that nothing changed, begin from nothing. */
static bool build(struct bench_forms *bench, struct bench_form *form, uint64_t *time_ns, struct error *error)
{
    if (!is_rasterised(form)) {
        tracer_destroy(form->made);
        if (!make(bench, form, error))
            return false;
    }
    tracer_outdate(form->made);
    glFinish();
    const uint64_t start_ns = clock_now_ns();
    const bool done = tracer_update(form->made, &bench->scene.gpu, &(struct tracer_update){0}, error);
    glFinish();
    *time_ns = clock_now_ns() - start_ns;
    if (done && form->tracer == TRACER_LDC && form->made->stats.parts_built == 0)
        return error_set(error, ERROR_INTERNAL, NULL, "%s: it was not built", form->name);
    return done;
}

static json_t *describe(const struct bench_form *form, const struct bench_runs *builds)
{
    struct structure_rows structure;
    tracer_tell(form->made, &structure);
    json_t *object =
        json_pack("{s:s, s:o, s:I, s:o}", "name", form->name, "structure", bench_structure_json(&structure),
                  "bytes", (json_int_t)form->made->stats.device_bytes, "build_ns", bench_times_json(builds));
    if (form->rival && form->rival != &plain_pass_impl) {
        const struct svo_build_facts facts = svo_facts(form->made);
        json_object_set_new(object, "octree",
                            json_pack("{s:I, s:I, s:I, s:f, s:I, s:I}", "fragments", (json_int_t)facts.fragments,
                                      "records", (json_int_t)facts.records, "leaves", (json_int_t)facts.leaves,
                                      "cell_metres", (double)facts.cell_world, "voxelise_ns",
                                      (json_int_t)facts.voxelise_ns, "tree_ns", (json_int_t)facts.tree_ns));
    }
    return object;
}

/* The first build of each compiles, too. */
static bool build_all(struct bench_forms *bench, unsigned runs, struct bench_runs *builds, struct error *error)
{
    for (unsigned run = 0; run <= runs; run++) {
        for (unsigned i = 0; i < bench->form_count; i++) {
            struct bench_form *form = &bench->forms[i];
            uint64_t time_ns;
            if ((run == 0 && !make(bench, form, error)) || !build(bench, form, &time_ns, error))
                return false;
            if (run > 0)
                bench_add(&builds[i], time_ns);
        }
    }
    return gpu_check(bench->device, "bench_forms", error);
}

json_t *bench_forms_builds(struct bench_forms *bench, struct error *error)
{
    struct bench_runs builds[BENCH_FORMS_MAX] = {0};
    if (!build_all(bench, bench->runs, builds, error))
        return NULL;
    json_t *list = json_array();
    for (unsigned i = 0; i < bench->form_count; i++)
        json_array_append_new(list, describe(&bench->forms[i], &builds[i]));
    return list;
}

/* ---- how far answers are from the truth ---- */

/* Rays within rounding of an edge are not told apart here: they are few, and all forms have the same. */
static bool compare(json_t *object, const struct bench_wave *wave, float diagonal, const struct hit *truth,
                    const struct hit *hits, struct error *error)
{
    const struct wave_compare_settings settings = {.diagonal = diagonal, .far_share = WAVE_FAR_SHARE};
    const struct wave_answers answers = {
        .count = wave->ray_count, .rays = wave->rays, .first_hits = hits, .second_hits = truth};
    struct wave_tally *tally = calloc(1, sizeof(*tally));
    uint32_t *suspects = malloc(wave->ray_count * sizeof(*suspects));
    const bool done = tally && suspects;
    if (done) {
        const uint32_t differ = wave_compare(tally, &settings, &answers, suspects);
        const uint64_t alone = tally->only_first + tally->only_second, normals = differ - alone - tally->far;
        const double rays = (double)wave->ray_count, metres = (double)diagonal;
        json_object_set_new(object, "agree", json_real(1 - (double)alone / rays));
        json_object_set_new(object, "only_form", json_integer((json_int_t)tally->only_first));
        json_object_set_new(object, "only_reference", json_integer((json_int_t)tally->only_second));
        json_object_set_new(object, "far", json_real((double)tally->far / rays));
        json_object_set_new(object, "normals", json_real((double)normals / rays));
        if (tally->both_hit > 0) {
            const float median = error_histogram_percentile(&tally->distance, 0.5);
            const float p99 = error_histogram_percentile(&tally->distance, 0.99);
            json_object_set_new(object, "error_median", json_real((double)median * metres));
            json_object_set_new(object, "error_p99", json_real((double)p99 * metres));
        }
    }
    free(tally);
    free(suspects);
    return done || error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory to compare %u rays", wave->ray_count);
}

/* What the traversal looks at, in the mean of the wave's rays. Intersections are no answers then
 * (shaders/ldc/cube.glsl, shaders/abuffer/column.glsl).
 */
static bool count_steps(struct bench_contest *contest, struct bench_form *form, const struct bench_wave *wave,
                        struct hit *counts, json_t *object, struct error *error)
{
    static const char *const names[3] = {"nodes", "texels", "samples"};
    double sums[3] = {0};
    struct tracer_options *options = &form->made->options;
    options->bench.ldc_count_steps = options->bench.abuffer_count_steps = 1;
    const bool done = bench_contest_intersections(contest, form->made, wave, counts, error);
    options->bench.ldc_count_steps = options->bench.abuffer_count_steps = 0;
    for (uint32_t i = 0; done && i < wave->ray_count; i++) {
        sums[0] += (double)counts[i].distance;
        sums[1] += (double)counts[i].instance;
        sums[2] += (double)counts[i].primitive;
    }
    for (int i = 0; done && i < 3; i++)
        json_object_set_new(object, names[i], json_real(sums[i] / (double)wave->ray_count));
    return done;
}

/* ---- waves ---- */

struct waves {
    struct bench_forms *bench;
    struct bench_contest contest;
    struct bench_form reference; /* nothing made: this build has none */
    struct ray *camera_rays;
    struct hit *camera_hits, *truth, *hits; /* a pixel each, and a ray each */
    json_t *lists[BENCH_FORMS_MAX];
};

static bool begin(struct waves *waves, struct bench_forms *bench, struct error *error)
{
    const uint32_t pixels = bench->width * bench->height;
    const size_t maximum = (size_t)pixels * bench->rays_each;
    *waves = (struct waves){.bench = bench,
                            .contest = {.device = bench->device, .scene = &bench->scene, .runs = bench->runs},
                            .reference = {.name = "reference", .tracer = TRACER_REFERENCE},
                            .camera_rays = malloc(pixels * sizeof(*waves->camera_rays)),
                            .camera_hits = malloc(pixels * sizeof(*waves->camera_hits)),
                            .truth = malloc(maximum * sizeof(*waves->truth)),
                            .hits = malloc(maximum * sizeof(*waves->hits))};
    if (!waves->camera_rays || !waves->camera_hits || !waves->truth || !waves->hits)
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for a picture's rays");
    uint64_t time_ns;
    bench_camera_rays(waves->camera_rays, &bench->scene.camera, bench->width, bench->height);
    const struct bench_wave primary = {.kind = BENCH_PRIMARY, .rays = waves->camera_rays, .ray_count = pixels};
    return make(bench, &waves->reference, error) && build(bench, &waves->reference, &time_ns, error) &&
           bench_contest_hits(&waves->contest, waves->reference.made, &primary, waves->camera_hits, error);
}

static void add_contenders(struct waves *waves)
{
    for (unsigned i = 0; i < waves->bench->form_count; i++)
        for (enum bench_way way = BENCH_INTERFACE; way <= BENCH_TRAVERSAL; way++)
            bench_contest_add(&waves->contest, "", waves->bench->forms[i].name, way)->tracer_used =
                waves->bench->forms[i].made;
}

/* How good the answers are, and what finding them took. */
static bool examine(struct waves *waves, struct bench_form *form, const struct bench_wave *wave, json_t *object,
                    struct error *error)
{
    if (!bench_contest_hits(&waves->contest, form->made, wave, waves->hits, error))
        return false;
    if (!compare(object, wave, waves->bench->scene.gpu.diagonal, waves->truth, waves->hits, error))
        return false;
    return (form->tracer != TRACER_LDC && form->tracer != TRACER_ABUFFER) ||
           count_steps(&waves->contest, form, wave, waves->hits, object, error);
}

static bool measure(struct waves *waves, const struct bench_wave *wave, struct error *error)
{
    const struct bench_wave_fact *fact = &bench_wave_facts[wave->kind];
    struct bench_forms *bench = waves->bench;
    if (!bench_contest_wave(&waves->contest, wave, error))
        return false;
    if (!fact->is_any && !bench_contest_hits(&waves->contest, waves->reference.made, wave, waves->truth, error))
        return false;
    for (unsigned i = 0; i < bench->form_count; i++) {
        const struct bench_contender *pair = &waves->contest.contenders[2 * i];
        json_t *object = json_pack("{s:s, s:i, s:o}", "kind", fact->name, "rays", (int)wave->ray_count, "hits_ns",
                                   bench_times_json(&pair[0].runs));
        if (!fact->is_any) {
            json_object_set_new(object, "traversal_ns", bench_times_json(&pair[1].runs));
            if (!examine(waves, &bench->forms[i], wave, object, error)) {
                json_decref(object);
                return false;
            }
        }
        json_array_append_new(waves->lists[i], object);
    }
    return true;
}

static bool run_wave(struct waves *waves, enum bench_wave_kind kind, struct error *error)
{
    const struct bench_forms *bench = waves->bench;
    const uint32_t pixels = bench->width * bench->height;
    const size_t maximum =
        (size_t)pixels * (kind == BENCH_PRIMARY || kind == BENCH_SHUFFLED ? 1 : bench->rays_each);
    struct ray *rays = malloc(maximum * sizeof(*rays));
    struct bench_wave wave = {.kind = kind, .rays = rays, .ray_count = pixels};
    if (!rays)
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for rays");
    if (kind == BENCH_PRIMARY)
        memcpy(rays, waves->camera_rays, pixels * sizeof(*rays));
    else
        wave.ray_count = bench_secondary_rays(rays, kind, waves->camera_rays, waves->camera_hits, pixels,
                                              bench->rays_each, &bench->scene);
    const bool done = wave.ray_count == 0 || measure(waves, &wave, error);
    free(rays);
    return done;
}

static void end(struct waves *waves)
{
    bench_contest_finish(&waves->contest);
    tracer_destroy(waves->reference.made);
    free(waves->camera_rays);
    free(waves->camera_hits);
    free(waves->truth);
    free(waves->hits);
}

json_t *bench_forms_waves(struct bench_forms *bench, struct error *error)
{
    struct waves waves;
    struct bench_runs builds[BENCH_FORMS_MAX] = {0};
    bool done = begin(&waves, bench, error) && build_all(bench, 1, builds, error);
    json_t *list = json_array();
    for (unsigned i = 0; done && i < bench->form_count; i++) {
        json_t *form = describe(&bench->forms[i], &builds[i]);
        json_object_set_new(form, "waves", waves.lists[i] = json_array());
        json_array_append_new(list, form);
    }
    if (done)
        add_contenders(&waves);
    for (enum bench_wave_kind kind = 0; done && kind < BENCH_WAVE_KINDS; kind++)
        done = !bench->waves[kind] || run_wave(&waves, kind, error);
    end(&waves);
    if (done)
        return list;
    json_decref(list);
    return NULL;
}
