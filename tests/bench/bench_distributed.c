/* SPDX-License-Identifier: MIT */
/* Cost of a sample of distributed ray tracing beside a plain one, for whole frames on the paper's kind of
 * scene. Usage: bench distributed [--size WxH] [--runs N]  The contenders take turns, run by run, after a
 * warm-up. Prints JSON: {"scene": {primitives, width, height}, "forms": [{name, samples, primary_rays,
 * shadow_rays, secondary_rays, "frame_ns": [..], "stages_ns": {stage: [..]}}]}; times of the frame from begin
 * to the pixels on the host, one for each run. */
#include "tests/bench/bench.h"
#include "tests/bench/paper_scene.h"

#include "base/clock.h"
#include "gpu/device.h"

#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define RUNS_MAX 64

static const struct form {
    const char *name;
    enum integrator_kind integrator;
    uint32_t samples;
    float aperture;
    bool moves;
} forms[] = {
    {"whitted, 1 sample", INTEGRATOR_WHITTED, 1, 0.0f, false},
    {"distributed, 1 sample", INTEGRATOR_DISTRIBUTED, 1, 0.0f, false},
    {"distributed, 16 samples", INTEGRATOR_DISTRIBUTED, 16, 0.0f, false},
    {"and a lens", INTEGRATOR_DISTRIBUTED, 16, 0.12f, false},
    {"and motion", INTEGRATOR_DISTRIBUTED, 16, 0.12f, true},
};
enum { FORM_COUNT = sizeof(forms) / sizeof(forms[0]) };

struct bench {
    struct gpu_device *device;
    struct frame_scene *shared;
    struct frame_renderer *renderer;
    struct scene *scene;
    struct scene_motion motion;
    uint32_t width, height;
    unsigned runs;
    json_t *results[FORM_COUNT];
};

static bool render(struct bench *bench, const struct form *form, struct frame_result *result, struct error *error)
{
    struct frame_request request;
    paper_scene_request(&request);
    request.picture.width = bench->width;
    request.picture.height = bench->height;
    request.light.integrator = form->integrator;
    request.sampling.samples = form->samples;
    request.aperture = form->aperture;
    if (!frame_begin(bench->renderer, bench->scene, form->moves ? &bench->motion : NULL, &request, error))
        return false;
    enum frame_progress progress;
    do {
        progress = frame_step(bench->renderer, result, error);
    } while (progress == FRAME_MORE);
    return progress == FRAME_DONE;
}

static json_t *describe(const struct form *form, const struct frame_result *result)
{
    return json_pack("{s:s, s:i, s:I, s:I, s:I, s:[], s:{}}", "name", form->name, "samples", (int)form->samples,
                     "primary_rays", (json_int_t)result->primary_rays, "shadow_rays",
                     (json_int_t)result->shadow_rays, "secondary_rays", (json_int_t)result->secondary_rays,
                     "frame_ns", "stages_ns");
}

static void note(json_t *form, const struct frame_result *result, uint64_t frame_ns)
{
    json_array_append_new(json_object_get(form, "frame_ns"), json_integer((json_int_t)frame_ns));
    json_t *stages = json_object_get(form, "stages_ns");
    for (enum stage stage = 0; stage < STAGE_COUNT; stage++) {
        uint64_t ns = stage_times_sum_ns(&result->times, stage, CLOCK_CPU);
        if (stage == STAGE_FRAME || ns == 0)
            continue;
        json_t *runs = json_object_get(stages, stage_name(stage));
        if (!runs) {
            runs = json_array();
            json_object_set_new(stages, stage_name(stage), runs);
        }
        json_array_append_new(runs, json_integer((json_int_t)ns));
    }
}

static bool measure(struct bench *bench, struct error *error)
{
    for (unsigned run = 0; run <= bench->runs; run++)
        for (unsigned i = 0; i < FORM_COUNT; i++) {
            struct frame_result result = {0};
            uint64_t begin_ns = clock_now_ns();
            if (!render(bench, &forms[i], &result, error))
                return false;
            uint64_t frame_ns = clock_now_ns() - begin_ns;
            if (run == 0)
                bench->results[i] = describe(&forms[i], &result);
            else
                note(bench->results[i], &result, frame_ns);
            frame_result_finish(&result);
        }
    return true;
}

static bool print(struct bench *bench)
{
    json_t *list = json_array();
    for (unsigned i = 0; i < FORM_COUNT; i++)
        json_array_append(list, bench->results[i]);
    json_t *all = json_pack("{s:{s:i, s:i, s:i}, s:o}", "scene", "primitives", PAPER_SCENE_PRIMITIVES, "width",
                            (int)bench->width, "height", (int)bench->height, "forms", list);
    bool printed = all && json_dumpf(all, stdout, 0) == 0 && putchar('\n') == '\n' && fflush(stdout) == 0;
    json_decref(all);
    return printed;
}

static bool parse(struct bench *bench, int argc, char **argv)
{
    bench->width = 640;
    bench->height = 480;
    bench->runs = 5;
    for (int i = 1; i < argc; i += 2) {
        const char *value = argv[i + 1]; /* NULL after the last */
        char rest;
        if (!value)
            return false;
        if (strcmp(argv[i], "--size") == 0) {
            if (sscanf(value, "%ux%u%c", &bench->width, &bench->height, &rest) != 2)
                return false;
        } else if (strcmp(argv[i], "--runs") == 0) {
            if (sscanf(value, "%u%c", &bench->runs, &rest) != 1)
                return false;
        } else {
            return false;
        }
    }
    return bench->runs >= 1 && bench->runs <= RUNS_MAX;
}

BENCH(distributed)
{
    struct bench bench = {0};
    struct error error = {0};
    if (!parse(&bench, argc, argv)) {
        fputs("usage: bench distributed [--size WxH] [--runs N]\n", stderr);
        return 2;
    }
    bench.device = gpu_device_create(&(struct gpu_options){.index = -1}, &error);
    bench.shared = bench.device ? frame_scene_create(bench.device, &error) : NULL;
    bench.renderer = bench.shared ? frame_renderer_create(bench.shared, &error) : NULL;
    bench.scene = paper_scene_create();
    bool ok = bench.renderer && bench.scene && paper_scene_motion(&bench.motion) && measure(&bench, &error) &&
              print(&bench);
    if (!ok)
        fprintf(stderr, "bench distributed: %s%s%s\n", error.field, error.field[0] ? ": " : "", error.text);
    for (unsigned i = 0; i < FORM_COUNT; i++)
        json_decref(bench.results[i]);
    paper_scene_motion_finish(&bench.motion);
    scene_destroy(bench.scene);
    frame_renderer_destroy(bench.renderer);
    frame_scene_destroy(bench.shared);
    if (bench.device)
        gpu_device_destroy(bench.device);
    return ok ? 0 : 1;
}
