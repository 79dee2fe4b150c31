/* SPDX-License-Identifier: MIT */
/* Every tracer of the build beside Embree on the same rays of one scene: one JSON object on standard output, what
 * it is doing on standard error. bench.py calls it and makes the tables. `bench tracers --help` has the options.
 * Exit status: 1 if answers are wrong beyond 0.01 % of the rays, edges aside, or something fails; 2 usage. */
#include "tests/bench/bench.h"
#include "tests/bench/bench_contest.h"
#include "tests/bench/bench_options.h"

#include "base/clock.h"
#include "base/parallel.h"

#include <epoxy/gl.h>
#include <jansson.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define TRACERS_MAX 16u
#define BUILDS_MAX 3u
#define COPY_BYTES ((size_t)256 << 20)

/* A tracer, or Embree, with what its builds took. */
struct structure {
    const char *tracer, *form;
    struct tracer *made;
    struct bench_embree *embree;
    struct bench_runs builds;
    uint64_t bytes;
};

struct bench {
    struct bench_options options;
    struct gpu_device *device;
    struct bench_scene scene;
    struct bench_contest contest;
    struct structure structures[TRACERS_MAX + 4];
    unsigned structure_count;
    bool failed;
};

/* ---- structures ---- */

static struct trace_view view_of(const struct bench *bench)
{
    const struct frame_camera *camera = &bench->scene.camera;
    struct trace_view view = {
        .fov_y = camera->fov_y, .width = bench->options.width, .height = bench->options.height};
    memcpy(view.world_from_view, camera->world_from_view, sizeof(view.world_from_view));
    return view;
}

static bool build_tracer(struct bench *bench, struct structure *structure, const struct tracer_impl *impl,
                         const struct tracer_options *options, struct error *error)
{
    const struct trace_view view = view_of(bench);
    for (unsigned i = 0; i < BUILDS_MAX && i < bench->options.runs; i++) {
        tracer_destroy(structure->made);
        structure->made = tracer_create(impl, bench->device, options, error);
        if (!structure->made)
            return false;
        const uint64_t start_ns = clock_now_ns();
        bool ok = tracer_update(structure->made, &bench->scene.gpu, &(struct tracer_update){.view = &view}, error);
        glFinish();
        bench_add(&structure->builds, clock_now_ns() - start_ns);
        if (!ok)
            return false;
    }
    structure->bytes = structure->made->stats.device_bytes;
    return true;
}

static bool build_embree(struct bench *bench, struct structure *structure, bool robust, struct error *error)
{
    for (unsigned i = 0; i < BUILDS_MAX && i < bench->options.runs; i++) {
        uint64_t time_ns;
        bench_embree_destroy(structure->embree);
        structure->embree = bench_embree_create(&bench->scene.gpu, robust, &time_ns, error);
        if (!structure->embree)
            return false;
        bench_add(&structure->builds, time_ns);
    }
    structure->bytes = bench_embree_bytes(structure->embree);
    return true;
}

static void add_contenders(struct bench *bench, const struct structure *structure)
{
    struct bench_contest *contest = &bench->contest;
    /* Those that traverse a tree of the scene itself answer exactly; samples of it have their own measure. */
    const bool is_exact = bench_is_named("bvh,reference,naive", structure->tracer);
    for (enum bench_way way = BENCH_INTERFACE; way <= BENCH_TRAVERSAL; way++) {
        if (way == BENCH_TRAVERSAL && !is_exact)
            continue; /* has no intersections */
        struct bench_contender *added = bench_contest_add(contest, structure->tracer, structure->form, way);
        added->tracer_used = structure->made;
        added->is_exact = is_exact;
    }
}

static bool add_tracer(struct bench *bench, const struct tracer_impl *impl, const char *form,
                       const struct tracer_options *options, struct error *error)
{
    struct structure *structure = &bench->structures[bench->structure_count++];
    *structure = (struct structure){.tracer = impl->name, .form = form};
    if (!build_tracer(bench, structure, impl, options, error))
        return false;
    add_contenders(bench, structure);
    return true;
}

static bool add_embree(struct bench *bench, bool robust, struct error *error)
{
    static const unsigned packets[3] = {1, 8, 16};
    static const char *const forms[2][3] = {{"1 a call", "8 a call", "16 a call"},
                                            {"1 a call, robust", "8 a call, robust", "16 a call, robust"}};
    struct structure *structure = &bench->structures[bench->structure_count++];
    *structure = (struct structure){.tracer = "embree", .form = robust ? "robust" : "default"};
    if (!build_embree(bench, structure, robust, error))
        return false;
    for (int i = 0; i < 3; i++) {
        if (bench->options.quick && packets[i] != 1)
            continue;
        struct bench_contender *added = bench_contest_add(&bench->contest, "embree", forms[robust][i], BENCH_RAW);
        added->embree = structure->embree;
        added->packet = packets[i];
    }
    return true;
}

static bool build_all(struct bench *bench, struct error *error)
{
    for (unsigned number = 0; number < TRACERS_MAX; number++) {
        const struct tracer_impl *impl = tracer_impl_by_number(number);
        if (!impl || (bench->options.tracers ? !bench_is_named(bench->options.tracers, impl->name)
                                             : impl == &tracer_naive_impl))
            continue;
        fprintf(stderr, "    building %s\n", impl->name);
        if (!add_tracer(bench, impl, "auto", NULL, error))
            return false;
        /* The baseline of the choice of packets. */
        if (impl == &tracer_bvh_impl && !bench->options.quick &&
            !add_tracer(bench, impl, "1 ray", &(struct tracer_options){.bvh = {.rays = 1}}, error))
            return false;
    }
    fprintf(stderr, "    building embree\n");
    return add_embree(bench, false, error) && (bench->options.quick || add_embree(bench, true, error));
}

/* ---- JSON ---- */

static json_t *figure_json(const struct bench_runs *runs)
{
    const struct bench_figure figure = bench_figure(runs);
    return json_pack("{s:f, s:f, s:f, s:f, s:o}", "median_ns", figure.median_ns, "deviation_ns",
                     figure.deviation_ns, "min_ns", figure.min_ns, "max_ns", figure.max_ns, "runs_ns",
                     bench_times_json(runs));
}

static json_t *structures_json(const struct bench *bench)
{
    json_t *list = json_array();
    for (unsigned i = 0; i < bench->structure_count; i++) {
        const struct structure *structure = &bench->structures[i];
        json_array_append_new(list, json_pack("{s:s, s:s, s:o, s:I}", "tracer", structure->tracer, "form",
                                              structure->form, "build", figure_json(&structure->builds),
                                              "memory_bytes", (json_int_t)structure->bytes));
    }
    return list;
}

static json_t *contender_json(const struct bench_contender *contender, uint32_t ray_count)
{
    static const char *const ways[] = {"interface", "traversal", "raw"};
    const double median_ns = bench_figure(&contender->runs).median_ns;
    json_t *made = json_pack("{s:s, s:s, s:s, s:o, s:f}", "tracer", contender->tracer, "form", contender->form,
                             "way", ways[contender->way], "time", figure_json(&contender->runs), "rays_per_s",
                             median_ns > 0 ? 1e9 * (double)ray_count / median_ns : 0.0);
    if (contender->is_compared)
        json_object_set_new(made, "agreement",
                            json_pack("{s:I, s:I, s:b}", "differing", (json_int_t)contender->differing, "edges",
                                      (json_int_t)contender->edges, "failed",
                                      bench_contender_failed(contender, ray_count)));
    return made;
}

static json_t *wave_json(struct bench *bench, const struct bench_wave *wave)
{
    const struct bench_wave_fact *fact = &bench_wave_facts[wave->kind];
    json_t *list = json_array();
    for (unsigned i = 0; i < bench->contest.contender_count; i++) {
        const struct bench_contender *contender = &bench->contest.contenders[i];
        if (contender->runs.count == 0)
            continue;
        json_array_append_new(list, contender_json(contender, wave->ray_count));
        if (!bench_contender_failed(contender, wave->ray_count))
            continue;
        fprintf(stderr, "bench tracers: %s (%s): %u of %u %s rays differ, %u of them at edges\n",
                contender->tracer, contender->form, contender->differing, wave->ray_count, fact->name,
                contender->edges);
        bench->failed = true;
    }
    return json_pack("{s:s, s:s, s:b, s:i, s:i, s:o}", "kind", fact->name, "order", fact->order, "any",
                     fact->is_any, "rays", (int)wave->ray_count, "answer_bytes",
                     fact->is_any ? (int)sizeof(uint32_t) : (int)sizeof(struct hit), "measures", list);
}

/* Bytes read and written a second by the device's own copy; 0: it has not that much memory. */
static double copy_bytes_per_s(struct gpu_device *device)
{
    struct gpu_buffer from = {0}, to = {0};
    struct bench_runs runs = {0};
    struct error error = {0};
    bool ok = gpu_buffer_reserve(device, &from, COPY_BYTES, &error) &&
              gpu_buffer_reserve(device, &to, COPY_BYTES, &error);
    for (int i = 0; ok && i < 6; i++) {
        const uint64_t start_ns = clock_now_ns();
        glCopyNamedBufferSubData(from.name, to.name, 0, 0, (GLsizeiptr)COPY_BYTES);
        glFinish();
        if (i > 0)
            bench_add(&runs, clock_now_ns() - start_ns);
    }
    gpu_buffer_finish(device, &from);
    gpu_buffer_finish(device, &to);
    return runs.count > 0 ? 2e9 * (double)COPY_BYTES / bench_figure(&runs).median_ns : 0;
}

static json_t *environment_json(const struct bench *bench)
{
    const struct gpu_device_info *info = &bench->device->info;
    char embree[80] = "";
    for (unsigned i = 0; i < bench->structure_count; i++)
        if (bench->structures[i].embree)
            bench_embree_describe(bench->structures[i].embree, embree, sizeof(embree));
    json_t *made = json_pack("{s:s, s:s, s:s, s:b, s:i, s:s}", "device", info->name, "vendor", info->vendor,
                             "version", info->version, "software", bench->device->facts.software, "processors",
                             (int)parallel_processors(), "embree", embree);
    if (!bench->device->facts.software)
        json_object_set_new(made, "copy_bytes_per_s", json_real(copy_bytes_per_s(bench->device)));
    return made;
}

static json_t *result_json(const struct bench *bench, json_t *waves)
{
    const struct bench_scene *scene = &bench->scene;
    return json_pack("{s:s, s:I, s:I, s:i, s:i, s:i, s:i, s:i, s:i, s:f, s:o, s:o, s:o}", "scene",
                     bench->options.scene.model ? bench->options.scene.model : "family", "triangles",
                     (json_int_t)scene->triangle_count, "spheres", (json_int_t)scene->sphere_count, "instances",
                     (int)scene->gpu.instance_count, "discs", (int)scene->gpu.disc_count, "width",
                     (int)bench->options.width, "height", (int)bench->options.height, "rays_per_pixel",
                     (int)bench->options.rays_each, "runs", (int)bench->options.runs, "diagonal",
                     (double)scene->gpu.diagonal, "environment", environment_json(bench), "structures",
                     structures_json(bench), "waves", waves);
}

/* ---- waves ---- */

static struct tracer *first_tracer(const struct bench *bench)
{
    for (unsigned i = 0; i < bench->structure_count; i++)
        if (bench->structures[i].made)
            return bench->structures[i].made;
    return NULL;
}

static bool run_wave(struct bench *bench, enum bench_wave_kind kind, const struct ray *camera_rays,
                     const struct hit *hits, json_t *waves, struct error *error)
{
    const uint32_t pixels = bench->options.width * bench->options.height,
                   each = kind == BENCH_PRIMARY ? 1 : bench->options.rays_each;
    struct ray *rays = malloc((size_t)pixels * each * sizeof(*rays));
    struct bench_wave wave = {.kind = kind, .rays = rays, .ray_count = pixels};
    if (!rays)
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for rays");
    if (kind == BENCH_PRIMARY)
        memcpy(rays, camera_rays, pixels * sizeof(*rays));
    else
        wave.ray_count = bench_secondary_rays(rays, kind, camera_rays, hits, pixels, each, &bench->scene);
    fprintf(stderr, "    %s: %u rays\n", bench_wave_facts[kind].name, wave.ray_count);
    bool ok = wave.ray_count == 0 || bench_contest_wave(&bench->contest, &wave, error);
    if (ok && wave.ray_count > 0)
        json_array_append_new(waves, wave_json(bench, &wave));
    free(rays);
    return ok;
}

static bool run_waves(struct bench *bench, json_t *waves, struct error *error)
{
    const uint32_t pixels = bench->options.width * bench->options.height;
    struct ray *camera_rays = malloc(pixels * sizeof(*camera_rays));
    struct hit *hits = malloc(pixels * sizeof(*hits));
    bool ok = camera_rays && hits;
    if (ok)
        bench_camera_rays(camera_rays, &bench->scene.camera, bench->options.width, bench->options.height);
    const struct bench_wave primary = {.kind = BENCH_PRIMARY, .rays = camera_rays, .ray_count = pixels};
    ok = ok && bench_contest_hits(&bench->contest, first_tracer(bench), &primary, hits, error);
    for (enum bench_wave_kind kind = 0; ok && kind < BENCH_WAVE_KINDS; kind++)
        if (bench->options.waves[kind])
            ok = run_wave(bench, kind, camera_rays, hits, waves, error);
    free(camera_rays);
    free(hits);
    return ok || error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for a picture's rays");
}

static bool run_bench(struct bench *bench, struct error *error)
{
    bench->options.scene.aspect = (float)bench->options.width / (float)bench->options.height;
    if (!bench_scene_init(&bench->scene, bench->device, &bench->options.scene, error))
        return false;
    fprintf(stderr, "  %s: %llu triangles, %llu spheres, %ux%u\n",
            bench->options.scene.model ? bench->options.scene.model : "family",
            (unsigned long long)bench->scene.triangle_count, (unsigned long long)bench->scene.sphere_count,
            bench->options.width, bench->options.height);
    bench->contest =
        (struct bench_contest){.device = bench->device, .scene = &bench->scene, .runs = bench->options.runs};
    json_t *waves = json_array();
    bool ok = build_all(bench, error) &&
              (first_tracer(bench) || error_set(error, ERROR_INVALID, "--tracers", "no such tracer")) &&
              run_waves(bench, waves, error);
    if (!ok) {
        json_decref(waves);
        return false;
    }
    json_t *result = result_json(bench, waves);
    ok = result && json_dumpf(result, stdout, JSON_REAL_PRECISION(9)) == 0 && putchar('\n') == '\n' &&
         fflush(stdout) == 0;
    json_decref(result);
    return ok || error_set(error, ERROR_INTERNAL, NULL, "the result cannot be written");
}

static void finish(struct bench *bench)
{
    for (unsigned i = 0; i < bench->structure_count; i++) {
        tracer_destroy(bench->structures[i].made);
        bench_embree_destroy(bench->structures[i].embree);
    }
    if (bench->contest.device)
        bench_contest_finish(&bench->contest);
    bench_scene_finish(&bench->scene);
    gpu_device_destroy(bench->device);
}

BENCH(tracers)
{
    struct bench bench = {0};
    struct gpu_options gpu = {.index = -1};
    struct error error = {0};
    if (argc == 2 && strcmp(argv[1], "--help") == 0) {
        fputs(bench_usage, stdout);
        return 0;
    }
    if (!bench_parse(argc, argv, &bench.options, &gpu)) {
        fputs(bench_usage, stderr);
        return 2;
    }
    bench.device = gpu_device_create(&gpu, &error);
    bool ok = bench.device && run_bench(&bench, &error);
    if (!ok)
        fprintf(stderr, "bench tracers: %s%s%s\n", error.field, error.field[0] ? ": " : "", error.text);
    if (bench.device)
        finish(&bench);
    return ok && !bench.failed ? 0 : 1;
}
