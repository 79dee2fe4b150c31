/* SPDX-License-Identifier: MIT */
/* How long one step of a frame takes, which is how long a cancel and other clients wait for it: every integrator
 * with every tracer. Usage: bench steps --model FILE | --family TRIANGLES  [--size WxH] [--samples N]
 * [--tracers LIST] [--integrators LIST] [--seconds N] [--eye X,Y,Z --look-at X,Y,Z [--up X,Y,Z] [--fov DEGREES]]
 *
 * The first frame of a form builds the structure and compiles programs: how long its begin took, which is one step
 * too, and its longest step is told apart from those of the second. Prints JSON: {"width", "height", "samples",
 * "software", "forms": [{tracer, integrator, first_begin_ns, first_max_ns, begin_ns, whole, frame_ns, cpu_ns,
 * "stages": [{stage, count, median_ns, p99_ns, max_ns, cpu_max_ns}], "first_stages": [the same]}]}; the
 * stage "all" has the steps of all. A frame is left after so many seconds (30): whole says whether it was
 * finished. cpu: of all threads together, which other work on the machine makes hardly longer. */
#include "tests/bench/bench.h"
#include "tests/bench/bench_stats.h"
#include "tests/bench/bench_options.h"

#include "base/clock.h"
#include "render/frame_state.h"

#include <getopt.h>
#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { ALL = PHASE_IDLE, SHADOW = PHASE_RESOLVE + 1, STAGES };
static const char *const stage_names[STAGES] = {
    [ALL] = "all",           [PHASE_BUILD] = "build",     [PHASE_SAMPLE] = "sample", [PHASE_RASTER] = "raster",
    [PHASE_SLICE] = "slice", [PHASE_PRIMARY] = "primary", [PHASE_LAYERS] = "layers", [PHASE_SHADE] = "shade",
    [PHASE_TRACE] = "trace", [PHASE_RESOLVE] = "resolve", [SHADOW] = "shadow",
};
static const char *const integrator_names[] = {
    [INTEGRATOR_WHITTED] = "whitted", [INTEGRATOR_DISTRIBUTED] = "distributed",
    [INTEGRATOR_RAYCAST] = "raycast", [INTEGRATOR_AO] = "ao",
    [INTEGRATOR_PATH] = "path",
};
enum { INTEGRATORS = sizeof(integrator_names) / sizeof(integrator_names[0]) };

struct bench {
    struct bench_scene_options scene_options;
    struct bench_scene scene;
    struct gpu_device *device;
    struct frame_scene *shared;
    struct frame_renderer *renderer;
    uint32_t width, height, samples, seconds;
    const char *tracers, *integrators; /* names with commas; NULL: all, but of tracers not naive */
    json_t *forms;
};

struct step {
    int stage;
    uint64_t ns, cpu_ns;
};

struct steps {
    struct step *list;
    size_t count, capacity;
};

static bool add_step(struct steps *steps, const struct step *step)
{
    if (steps->count == steps->capacity) {
        size_t capacity = steps->capacity ? 2 * steps->capacity : 4096;
        struct step *list = realloc(steps->list, capacity * sizeof(*list));
        if (!list)
            return false;
        steps->list = list;
        steps->capacity = capacity;
    }
    steps->list[steps->count++] = *step;
    return true;
}

static int by_size(const void *a, const void *b)
{
    const struct step *x = a, *y = b;
    return x->ns < y->ns ? -1 : x->ns > y->ns;
}

/* The steps are in the order of their times. */
static void describe_stage(json_t *list, const struct steps *steps, int stage)
{
    struct steps own = {0};
    uint64_t cpu_max_ns = 0;
    for (size_t i = 0; i < steps->count; i++) {
        const struct step *step = &steps->list[i];
        if (stage != ALL && step->stage != stage)
            continue;
        cpu_max_ns = step->cpu_ns > cpu_max_ns ? step->cpu_ns : cpu_max_ns;
        if (!add_step(&own, step))
            break;
    }
    if (own.count > 0)
        json_array_append_new(
            list, json_pack("{s:s, s:I, s:I, s:I, s:I, s:I}", "stage", stage_names[stage], "count",
                            (json_int_t)own.count, "median_ns", (json_int_t)own.list[own.count / 2].ns, "p99_ns",
                            (json_int_t)own.list[own.count - 1 - own.count / 100].ns, "max_ns",
                            (json_int_t)own.list[own.count - 1].ns, "cpu_max_ns", (json_int_t)cpu_max_ns));
    free(own.list);
}

static bool begin(struct bench *bench, const struct frame_request *request, uint64_t *ns, struct error *error)
{
    const uint64_t start_ns = clock_now_ns();
    bool begun = frame_begin(bench->renderer, bench->scene.loaded.scene, NULL, request, error);
    *ns = clock_now_ns() - start_ns;
    return begun;
}

/* What the next step of the frame is. */
static int next_stage(const struct frame_renderer *renderer)
{
    return renderer->phase == PHASE_SHADE && renderer->work->context.asking > 0 ? SHADOW : (int)renderer->phase;
}

/* *whole: the frame was finished in the time that is given. The steps come back in the order of their times. */
static bool step(struct bench *bench, struct steps *steps, bool *whole, struct error *error)
{
    const uint64_t end_ns = clock_now_ns() + UINT64_C(1000000000) * bench->seconds;
    struct frame_result result = {0};
    enum frame_progress progress = FRAME_MORE;
    while (progress == FRAME_MORE && clock_now_ns() < end_ns) {
        struct step now = {.stage = next_stage(bench->renderer)};
        const uint64_t start_ns = clock_now_ns(), cpu_start_ns = bench_processor_ns();
        progress = frame_step(bench->renderer, &result, error);
        now.cpu_ns = bench_processor_ns() - cpu_start_ns;
        now.ns = clock_now_ns() - start_ns;
        if (!add_step(steps, &now))
            return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for the steps");
    }
    *whole = progress == FRAME_DONE;
    frame_result_finish(&result);
    frame_abandon(bench->renderer);
    qsort(steps->list, steps->count, sizeof(*steps->list), by_size);
    return progress != FRAME_FAILED;
}

static bool measure(struct bench *bench, unsigned tracer, enum integrator_kind integrator, struct error *error)
{
    const struct frame_request request = {.width = bench->width,
                                          .height = bench->height,
                                          .samples = bench->samples,
                                          .depth = 8,
                                          .camera = bench->scene.camera,
                                          .tracer = tracer,
                                          .integrator = integrator};
    struct steps first = {0}, steps = {0};
    uint64_t first_begin_ns, begin_ns;
    bool whole = false;
    bool good = begin(bench, &request, &first_begin_ns, error) && step(bench, &first, &whole, error) &&
                begin(bench, &request, &begin_ns, error);
    const uint64_t start_ns = clock_now_ns(), cpu_start_ns = bench_processor_ns();
    good = good && step(bench, &steps, &whole, error);
    if (good) {
        json_t *stages = json_array(), *first_stages = json_array();
        json_int_t frame_ns = (json_int_t)(clock_now_ns() - start_ns);
        json_int_t cpu_ns = (json_int_t)(bench_processor_ns() - cpu_start_ns);
        for (int stage = 0; stage < STAGES; stage++) {
            describe_stage(stages, &steps, stage);
            describe_stage(first_stages, &first, stage);
        }
        json_array_append_new(bench->forms,
                              json_pack("{s:s, s:s, s:I, s:I, s:I, s:b, s:I, s:I, s:o, s:o}", "tracer",
                                        tracer_impl_by_number(tracer)->name, "integrator",
                                        integrator_names[integrator], "first_begin_ns", (json_int_t)first_begin_ns,
                                        "first_max_ns", (json_int_t)first.list[first.count - 1].ns, "begin_ns",
                                        (json_int_t)begin_ns, "whole", whole, "frame_ns", frame_ns, "cpu_ns",
                                        cpu_ns, "stages", stages, "first_stages", first_stages));
    }
    free(first.list);
    free(steps.list);
    return good;
}

static bool measure_all(struct bench *bench, struct error *error)
{
    for (unsigned tracer = 0; tracer < TRACER_COUNT; tracer++) {
        const struct tracer_impl *impl = tracer_impl_by_number(tracer);
        bool asked =
            impl && (bench->tracers ? bench_is_named(bench->tracers, impl->name) : impl != &tracer_naive_impl);
        for (enum integrator_kind i = 0; asked && (int)i < INTEGRATORS; i++)
            if ((!bench->integrators || bench_is_named(bench->integrators, integrator_names[i])) &&
                !measure(bench, tracer, i, error))
                return false;
    }
    return true;
}

static bool print(struct bench *bench)
{
    json_t *all =
        json_pack("{s:i, s:i, s:i, s:b, s:O}", "width", (int)bench->width, "height", (int)bench->height, "samples",
                  (int)bench->samples, "software", bench->device->facts.software, "forms", bench->forms);
    bool printed = all && json_dumpf(all, stdout, 0) == 0 && putchar('\n') == '\n' && fflush(stdout) == 0;
    json_decref(all);
    return printed;
}

static bool parse_option(struct bench *bench, int option, const char *text)
{
    switch (option) {
    case 's':
        return bench_parse_size(text, &bench->width, &bench->height);
    case 'n':
        return bench_parse_number(text, 1, 4096, &bench->samples);
    case 'c':
        return bench_parse_number(text, 1, 3600, &bench->seconds);
    case 't':
        bench->tracers = text;
        return true;
    case 'i':
        bench->integrators = text;
        return true;
    default:
        return bench_parse_scene(option, text, &bench->scene_options);
    }
}

static bool parse(struct bench *bench, int argc, char **argv)
{
    static const struct option names[] = {
        {"model", 1, NULL, 'm'},   {"family", 1, NULL, 'f'},  {"size", 1, NULL, 's'},
        {"samples", 1, NULL, 'n'}, {"tracers", 1, NULL, 't'}, {"integrators", 1, NULL, 'i'},
        {"eye", 1, NULL, 'e'},     {"look-at", 1, NULL, 'l'}, {"up", 1, NULL, 'u'},
        {"fov", 1, NULL, 'v'},     {"seconds", 1, NULL, 'c'}, {NULL, 0, NULL, 0},
    };
    *bench = (struct bench){.width = 1280, .height = 720, .samples = 1, .seconds = 30};
    bench->scene_options.up[1] = 1;
    bench->scene_options.fov_y = 0.7f;
    for (int option; (option = getopt_long(argc, argv, "", names, NULL)) != -1;)
        if (option == '?' || !parse_option(bench, option, optarg))
            return false;
    bench->scene_options.aspect = (float)bench->width / (float)bench->height;
    return (bench->scene_options.model != NULL) != (bench->scene_options.family_triangles != 0);
}

BENCH(steps)
{
    struct bench bench;
    struct error error = {0};
    if (!parse(&bench, argc, argv)) {
        fputs("bench steps: wrong arguments; they are described at the head of bench_steps.c\n", stderr);
        return 2;
    }
    bench.forms = json_array();
    bench.device = gpu_device_create(&(struct gpu_options){.index = -1}, &error);
    bench.shared = bench.device ? frame_scene_create(bench.device, &error) : NULL;
    bench.renderer = bench.shared ? frame_renderer_create(bench.shared, &error) : NULL;
    bool ok = bench.renderer && bench_scene_init(&bench.scene, bench.device, &bench.scene_options, &error) &&
              measure_all(&bench, &error) && print(&bench);
    if (!ok)
        fprintf(stderr, "bench steps: %s%s%s\n", error.field, error.field[0] ? ": " : "", error.text);
    json_decref(bench.forms);
    if (bench.renderer)
        bench_scene_finish(&bench.scene);
    frame_renderer_destroy(bench.renderer);
    frame_scene_destroy(bench.shared);
    if (bench.device)
        gpu_device_destroy(bench.device);
    return ok ? 0 : 1;
}
