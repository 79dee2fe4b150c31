/* SPDX-License-Identifier: MIT */
/* Every tracer of the build beside the reference on the same rays of one scene: one JSON object on standard
 * output, what it is doing on standard error. bench.py calls it and makes the tables. `bench tracers --help` has
 * the options. Exit status: 1 if answers are wrong beyond 0.01 % of the rays, edges aside, or something fails; 2
 * usage. */
#include "tests/bench/bench.h"
#include "tests/bench/bench_contest.h"

#include "base/clock.h"
#include "base/parallel.h"

#include <epoxy/gl.h>
#include <jansson.h>

#include <getopt.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define TRACERS_MAX 16u
#define BUILDS_MAX 3u
#define RAYS_MAX ((uint64_t)1 << 24)

static const char usage[] =
    "usage: bench tracers --model FILE | --family TRIANGLES  [options]\n"
    "  --size WxH            multiples of 8; default 512x512\n"
    "  --eye X,Y,Z --look-at X,Y,Z [--up X,Y,Z] [--fov DEGREES]   else the model's first camera, or one that sees "
    "all\n"
    "  --waves LIST          of primary,reflection,shadow,occlusion,bounce; default: all\n"
    "  --rays-per-pixel N    of every wave but primary; default 1\n"
    "  --tracers LIST        default: all but naive; bvh-links and bvh-eight: bvh by nodes of one kind\n"
    "  --runs N              after one warm-up; default 5, at most 64\n"
    "  --device N            which OpenGL device; default: the first hardware, else software\n";

struct options {
    struct bench_scene_options scene;
    uint32_t width, height, rays_each, runs;
    bool waves[BENCH_WAVE_KINDS];
    const char *tracers; /* names with commas; NULL: all but naive */
};

/* A tracer and the times of its builds. */
struct structure {
    const char *name;
    struct tracer *made;
    struct bench_runs builds;
};

struct bench {
    struct options options;
    struct gpu_device *device;
    struct bench_scene scene;
    struct bench_contest contest;
    struct structure structures[TRACERS_MAX];
    unsigned structure_count;
    bool failed;
};

/* Whether `name` is one of a list of names with commas in between. */
static bool is_named(const char *list, const char *name)
{
    const size_t length = strlen(name);
    for (const char *at = list; (at = strstr(at, name)); at += length)
        if ((at == list || at[-1] == ',') && (at[length] == '\0' || at[length] == ','))
            return true;
    return false;
}

/* ---- structures ---- */

static struct trace_view view_of(const struct bench *bench)
{
    const struct frame_camera *camera = &bench->scene.camera;
    struct trace_view view = {
        .fov_y = camera->fov_y, .width = bench->options.width, .height = bench->options.height};
    memcpy(view.world_from_view, camera->world_from_view, sizeof(view.world_from_view));
    return view;
}

static bool build(struct bench *bench, struct structure *structure, const struct tracer_impl *impl,
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
    return true;
}

static bool add_structure(struct bench *bench, const char *name, const struct tracer_impl *impl,
                          const struct tracer_options *options, struct error *error)
{
    fprintf(stderr, "    building %s\n", name);
    struct structure *structure = &bench->structures[bench->structure_count++];
    structure->name = name;
    if (!build(bench, structure, impl, options, error))
        return false;
    /* Tracers that traverse a tree of the scene itself answer exactly, and have intersections. */
    const bool is_exact = is_named("bvh,reference,naive", impl->name);
    for (enum bench_way way = BENCH_INTERFACE; way <= (is_exact ? BENCH_TRAVERSAL : BENCH_INTERFACE); way++) {
        struct bench_contender *contender = bench_contest_add(&bench->contest, structure->made, way);
        contender->name = name;
        contender->is_exact = is_exact;
    }
    return true;
}

static bool build_all(struct bench *bench, struct error *error)
{
    static const struct {
        const char *name;
        struct tracer_options options;
    } nodes[] = {{"bvh-links", {.bvh.nodes = BVH_NODES_LINKS}}, {"bvh-eight", {.bvh.nodes = BVH_NODES_EIGHT}}};
    for (size_t i = 0; bench->options.tracers && i < sizeof(nodes) / sizeof(*nodes); i++)
        if (is_named(bench->options.tracers, nodes[i].name) &&
            !add_structure(bench, nodes[i].name, &tracer_bvh_impl, &nodes[i].options, error))
            return false;
    for (unsigned number = 0; number < TRACERS_MAX; number++) {
        const struct tracer_impl *impl = tracer_impl_by_number(number);
        if (!impl ||
            (bench->options.tracers ? !is_named(bench->options.tracers, impl->name) : impl == &tracer_naive_impl))
            continue;
        if (!add_structure(bench, impl->name, impl, NULL, error))
            return false;
    }
    return true;
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
        json_array_append_new(list, json_pack("{s:s, s:o, s:I}", "tracer", structure->name, "build",
                                              figure_json(&structure->builds), "memory_bytes",
                                              (json_int_t)structure->made->stats.device_bytes));
    }
    return list;
}

static json_t *contender_json(const struct bench_contender *contender, uint32_t ray_count)
{
    static const char *const ways[] = {"interface", "traversal"};
    const double median_ns = bench_figure(&contender->runs).median_ns;
    json_t *made = json_pack("{s:s, s:s, s:o, s:f}", "tracer", contender->name, "way", ways[contender->way],
                             "time", figure_json(&contender->runs), "rays_per_s",
                             median_ns > 0 ? 1e9 * (double)ray_count / median_ns : 0.0);
    const double device_ns = bench_figure(&contender->device_runs).median_ns;
    if (device_ns > 0) {
        json_object_set_new(made, "device_time", figure_json(&contender->device_runs));
        json_object_set_new(made, "device_rays_per_s", json_real(1e9 * (double)ray_count / device_ns));
    }
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
        fprintf(stderr, "bench tracers: %s: %u of %u %s rays differ, %u of them at edges\n", contender->name,
                contender->differing, wave->ray_count, fact->name, contender->edges);
        bench->failed = true;
    }
    return json_pack("{s:s, s:s, s:b, s:i, s:o}", "kind", fact->name, "order", fact->order, "any", fact->is_any,
                     "rays", (int)wave->ray_count, "measures", list);
}

static json_t *environment_json(const struct bench *bench)
{
    const struct gpu_device_info *info = &bench->device->info;
    return json_pack("{s:s, s:s, s:s, s:b, s:i}", "device", info->name, "vendor", info->vendor, "version",
                     info->version, "software", bench->device->facts.software, "processors",
                     (int)parallel_processors());
}

static json_t *result_json(const struct bench *bench, json_t *waves)
{
    const struct bench_scene *scene = &bench->scene;
    return json_pack("{s:s, s:I, s:I, s:i, s:i, s:i, s:i, s:o, s:o, s:o}", "scene",
                     bench->options.scene.model ? bench->options.scene.model : "family", "triangles",
                     (json_int_t)scene->triangle_count, "spheres", (json_int_t)scene->sphere_count, "instances",
                     (int)scene->gpu.instance_count, "width", (int)bench->options.width, "height",
                     (int)bench->options.height, "rays_per_pixel", (int)bench->options.rays_each, "environment",
                     environment_json(bench), "structures", structures_json(bench), "waves", waves);
}

/* ---- waves ---- */

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
    ok = ok && bench_contest_hits(&bench->contest, bench->structures[0].made, &primary, hits, error);
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
              (bench->structure_count > 0 || error_set(error, ERROR_INVALID, "--tracers", "no such tracer")) &&
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
    for (unsigned i = 0; i < bench->structure_count; i++)
        tracer_destroy(bench->structures[i].made);
    if (bench->contest.device)
        bench_contest_finish(&bench->contest);
    bench_scene_finish(&bench->scene);
    gpu_device_destroy(bench->device);
}

/* ---- command line ---- */

static bool parse_vector(const char *text, float v[3])
{
    char rest;
    return sscanf(text, "%f,%f,%f%c", &v[0], &v[1], &v[2], &rest) == 3;
}

static bool parse_number(const char *text, uint32_t minimum, uint32_t maximum, uint32_t *value)
{
    char *end;
    unsigned long parsed = strtoul(text, &end, 10);
    *value = (uint32_t)parsed;
    return *text >= '0' && *text <= '9' && *end == '\0' && parsed >= minimum && parsed <= maximum;
}

static bool parse_size(const char *text, uint32_t *width, uint32_t *height)
{
    char rest;
    return sscanf(text, "%ux%u%c", width, height, &rest) == 2 && *width % 8 == 0 && *height % 8 == 0 &&
           *width >= 8 && *height >= 8 && *width <= 4096 && *height <= 4096;
}

static bool parse_waves(const char *text, bool waves[BENCH_WAVE_KINDS])
{
    unsigned found = 0, asked = 1;
    for (const char *at = text; *at; at++)
        asked += *at == ',';
    for (enum bench_wave_kind kind = 0; kind < BENCH_WAVE_KINDS; kind++)
        found += waves[kind] = is_named(text, bench_wave_facts[kind].name);
    return found == asked;
}

static bool parse_option(int option, const char *text, struct options *options, struct gpu_options *gpu)
{
    struct bench_scene_options *scene = &options->scene;
    uint32_t number;
    char *end;
    switch (option) {
    case 'm':
        scene->model = text;
        return true;
    case 'f':
        return parse_number(text, 1, 50000000, &scene->family_triangles);
    case 'e':
        return scene->has_eye = parse_vector(text, scene->eye);
    case 'l':
        return parse_vector(text, scene->look_at);
    case 'u':
        return parse_vector(text, scene->up);
    case 'v':
        scene->fov_y = strtof(text, &end) * 0.0174532925f;
        return *end == '\0' && scene->fov_y > 0 && scene->fov_y < 3.1f;
    case 's':
        return parse_size(text, &options->width, &options->height);
    case 'w':
        return parse_waves(text, options->waves);
    case 'p':
        return parse_number(text, 1, 256, &options->rays_each);
    case 't':
        options->tracers = text;
        return true;
    case 'r':
        return parse_number(text, 1, BENCH_RUNS_MAX, &options->runs);
    default:
        gpu->index = parse_number(text, 0, 63, &number) ? (int)number : -1;
        return gpu->index >= 0;
    }
}

/* False: what is wrong was said on standard error, the usage was not. Strings of argv stay in use. */
static bool parse(int argc, char **argv, struct options *options, struct gpu_options *gpu)
{
    static const struct option names[] = {
        {"model", 1, NULL, 'm'},   {"family", 1, NULL, 'f'},  {"size", 1, NULL, 's'},
        {"eye", 1, NULL, 'e'},     {"look-at", 1, NULL, 'l'}, {"up", 1, NULL, 'u'},
        {"fov", 1, NULL, 'v'},     {"waves", 1, NULL, 'w'},   {"rays-per-pixel", 1, NULL, 'p'},
        {"tracers", 1, NULL, 't'}, {"runs", 1, NULL, 'r'},    {"device", 1, NULL, 'd'},
        {NULL, 0, NULL, 0},
    };
    *options = (struct options){.width = 512, .height = 512, .rays_each = 1, .runs = 5};
    options->scene.up[1] = 1;
    options->scene.fov_y = 0.7f;
    memset(options->waves, true, sizeof(options->waves));
    for (int option; (option = getopt_long(argc, argv, "", names, NULL)) != -1;) {
        if (option == '?')
            return false;
        if (!parse_option(option, optarg, options, gpu)) {
            fprintf(stderr, "bench tracers: no such value: %s\n", optarg);
            return false;
        }
    }
    if ((options->scene.model != NULL) == (options->scene.family_triangles != 0)) {
        fprintf(stderr, "bench tracers: one of --model and --family is needed\n");
        return false;
    }
    if ((uint64_t)options->width * options->height * options->rays_each > RAYS_MAX) {
        fprintf(stderr, "bench tracers: more than 16 Mi rays a wave\n");
        return false;
    }
    return optind == argc;
}

BENCH(tracers)
{
    struct bench bench = {0};
    struct gpu_options gpu = {.index = -1};
    struct error error = {0};
    if (argc == 2 && strcmp(argv[1], "--help") == 0) {
        fputs(usage, stdout);
        return 0;
    }
    if (!parse(argc, argv, &bench.options, &gpu)) {
        fputs(usage, stderr);
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
