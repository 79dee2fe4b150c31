/* SPDX-License-Identifier: MIT */
/* How many rays are best in a packet: the paper's parallel traversal ('Stackless traversal of a sphere BVH',
 * section 5) with 1, 2, 3, 4 and 8 rays on coherent, partly coherent and incoherent rays, boxes and spheres. One
 * JSON object on standard output; bench.py makes the table. bench parallel TRIANGLES [RUNS]    the generated
 * family Exit status 1 if something fails or answers differ beyond 0.01 % of the rays from those of one ray at a
 * time. */
#include "tests/accuracy/test_scenes.h"
#include "tests/bench/bench.h"
#include "tests/bench/bench_stats.h"
#include "tests/bench/bench_waves.h"
#include "trace/tracer.h"

#include "base/clock.h"

#include <epoxy/gl.h>
#include <jansson.h>

#define WIDTH 128u
#define HEIGHT 96u
#define SAMPLES 24u /* of a pixel, next to each other; a multiple of all numbers of rays */
#define RAY_COUNT (WIDTH * HEIGHT * SAMPLES)
/* Rays of a packet take triangles relative to the leading one's origin: one within rounding of an edge may
 * go by it, or meet its other triangle. */
#define DIFFERING_SHARE 10000u
#define TOLERANCE 1e-5f

enum order { COHERENT, PARTLY, INCOHERENT, ORDERS };
static const char *const order_names[ORDERS] = {"coherent", "partly", "incoherent"};
static const uint32_t numbers[] = {1, 2, 3, 4, 8};
#define NUMBER_COUNT (sizeof(numbers) / sizeof(numbers[0]))
enum { BOXES, SPHERES, BOUNDS };

struct bench {
    struct gpu_device *device;
    struct bench_scene scene;
    struct tracer *tracers[BOUNDS][NUMBER_COUNT];
    struct gpu_buffer rays, hits;
    struct bench_runs runs[BOUNDS][NUMBER_COUNT];
    bool failed;
};

static void require(bool ok, const struct error *error)
{
    if (ok)
        return;
    fprintf(stderr, "bench parallel: %s %s\n", error->field, error->text);
    exit(1);
}

/* Jittered within their pixel. */
static void camera_rays(struct ray *rays, const struct frame_camera *camera)
{
    const float *m = camera->world_from_view, reach = tanf(camera->fov_y / 2);
    uint64_t seed = 11;
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        uint32_t pixel = i / SAMPLES;
        float x = (float)(pixel % WIDTH) + test_uniform(&seed, 0, 1),
              y = (float)(pixel / WIDTH) + test_uniform(&seed, 0, 1);
        float u = reach * (float)WIDTH / (float)HEIGHT * (2 * x / WIDTH - 1), v = -reach * (2 * y / HEIGHT - 1);
        float length = sqrtf(u * u + v * v + 1);
        for (int k = 0; k < 3; k++) {
            rays[i].origin_t_min[k] = m[4 * k + 3];
            rays[i].direction_t_max[k] = (u * m[4 * k] + v * m[4 * k + 1] - m[4 * k + 2]) / length;
        }
        rays[i].origin_t_min[3] = 0;
        rays[i].direction_t_max[3] = 1e30f;
    }
}

static void shuffle(struct ray *rays, uint32_t count)
{
    uint64_t seed = 12;
    for (uint32_t i = count - 1; i > 0; i--) {
        uint32_t j = (uint32_t)((uint64_t)test_random(&seed) * (i + 1) >> 32);
        struct ray moved = rays[i];
        rays[i] = rays[j];
        rays[j] = moved;
    }
}

static void trace(struct bench *bench, struct tracer *tracer, uint32_t ray_count, bool surfaces)
{
    struct error error = {0};
    const struct wave wave = {.ray_count = ray_count, .rays = &bench->rays, .hits = &bench->hits};
    require((surfaces ? tracer_trace : tracer_intersect)(tracer, &bench->scene.gpu, &wave, &error), &error);
    glFinish();
}

static struct hit *read_hits(struct bench *bench, uint32_t ray_count)
{
    struct hit *hits = malloc(ray_count * sizeof(*hits));
    gpu_buffer_read(bench->device, &bench->hits, 0, hits, ray_count * sizeof(*hits));
    return hits;
}

static void upload(struct bench *bench, const struct ray *rays, uint32_t count)
{
    struct error error = {0};
    require(gpu_buffer_upload(bench->device, &bench->rays, rays, count * sizeof(*rays), &error) &&
                gpu_buffer_reserve(bench->device, &bench->hits, count * sizeof(struct hit), &error),
            &error);
    gpu_scene_bind(&bench->scene.gpu);
}

static void check(struct bench *bench, struct tracer *tracer, const struct hit *expected, uint32_t count)
{
    trace(bench, tracer, count, false);
    struct hit *hits = read_hits(bench, count);
    uint32_t differing = 0;
    for (uint32_t i = 0; i < count; i++)
        differing +=
            fabsf(hits[i].distance - expected[i].distance) <= TOLERANCE * fabsf(expected[i].distance) ? 0 : 1;
    bench->failed = bench->failed || differing > count / DIFFERING_SHARE;
    free(hits);
}

/* All numbers take turns, run by run. */
static json_t *measure(struct bench *bench, enum order order, const struct ray *rays, uint32_t count,
                       unsigned runs)
{
    json_t *rows = json_array();
    upload(bench, rays, count);
    trace(bench, bench->tracers[BOXES][0], count, false);
    struct hit *expected = read_hits(bench, count);
    memset(bench->runs, 0, sizeof(bench->runs));
    for (int bounds = 0; bounds < BOUNDS; bounds++)
        for (size_t n = 0; n < NUMBER_COUNT; n++)
            check(bench, bench->tracers[bounds][n], expected, count); /* compiles, too */
    for (unsigned run = 0; run < runs; run++) {
        for (int bounds = 0; bounds < BOUNDS; bounds++) {
            for (size_t n = 0; n < NUMBER_COUNT; n++) {
                uint64_t start_ns = clock_now_ns();
                trace(bench, bench->tracers[bounds][n], count, false);
                bench_add(&bench->runs[bounds][n], clock_now_ns() - start_ns);
            }
        }
    }
    for (int bounds = 0; bounds < BOUNDS; bounds++) {
        for (size_t n = 0; n < NUMBER_COUNT; n++) {
            json_array_append_new(rows, json_pack("{s:s, s:s, s:i, s:i, s:o}", "order", order_names[order],
                                                  "bounds", bounds == BOXES ? "boxes" : "spheres", "packet",
                                                  (int)numbers[n], "rays", (int)count, "runs_ns",
                                                  bench_times_json(&bench->runs[bounds][n])));
        }
    }
    free(expected);
    return rows;
}

static json_t *measure_all(struct bench *bench, unsigned runs)
{
    struct ray *rays = malloc(RAY_COUNT * sizeof(*rays)), *secondary = malloc(RAY_COUNT * sizeof(*rays));
    camera_rays(rays, &bench->scene.camera);
    json_t *results = measure(bench, COHERENT, rays, RAY_COUNT, runs);
    upload(bench, rays, RAY_COUNT);
    trace(bench, bench->tracers[BOXES][0], RAY_COUNT, true);
    struct hit *hits = read_hits(bench, RAY_COUNT);
    uint32_t count = bench_secondary_rays(secondary, BENCH_REFLECTION, rays, hits, RAY_COUNT, 1, &bench->scene);
    json_t *more = measure(bench, PARTLY, secondary, count, runs);
    json_array_extend(results, more);
    json_decref(more);
    count = bench_secondary_rays(secondary, BENCH_BOUNCE, rays, hits, RAY_COUNT, 1, &bench->scene);
    shuffle(secondary, count);
    more = measure(bench, INCOHERENT, secondary, count, runs);
    json_array_extend(results, more);
    json_decref(more);
    free(hits);
    free(rays);
    free(secondary);
    return results;
}

static void make_tracers(struct bench *bench)
{
    struct error error = {0};
    for (int bounds = 0; bounds < BOUNDS; bounds++) {
        for (size_t n = 0; n < NUMBER_COUNT; n++) {
            const struct tracer_options options = {
                .bvh = {.bounds = bounds == BOXES ? BVH_BOUNDS_BOX : BVH_BOUNDS_SPHERE, .rays = numbers[n]}};
            struct tracer *tracer = tracer_create(&tracer_bvh_impl, bench->device, &options, &error);
            require(tracer && tracer_update(tracer, &bench->scene.gpu, &(struct tracer_update){0}, &error),
                    &error);
            bench->tracers[bounds][n] = tracer;
        }
    }
}

BENCH(parallel)
{
    long triangles = argc > 1 ? strtol(argv[1], NULL, 10) : 0, runs = argc > 2 ? strtol(argv[2], NULL, 10) : 5;
    if (triangles < 1 || triangles > 10000000 || runs < 1 || runs > BENCH_RUNS_MAX) {
        fprintf(stderr, "usage: bench parallel TRIANGLES [RUNS]\n");
        return 2;
    }
    struct error error = {0};
    struct bench bench = {.device = gpu_device_create(&(struct gpu_options){.index = -1}, &error)};
    require(bench.device != NULL, &error);
    const struct bench_scene_options options = {.family_triangles = (uint32_t)triangles, .aspect = 4.0f / 3};
    require(bench_scene_init(&bench.scene, bench.device, &options, &error), &error);
    make_tracers(&bench);
    json_t *results = measure_all(&bench, (unsigned)runs);
    json_t *whole = json_pack("{s:I, s:o}", "triangles", (json_int_t)bench.scene.triangle_count, "rows", results);
    json_dumpf(whole, stdout, JSON_INDENT(1));
    printf("\n");
    json_decref(whole);
    for (int bounds = 0; bounds < BOUNDS; bounds++)
        for (size_t n = 0; n < NUMBER_COUNT; n++)
            tracer_destroy(bench.tracers[bounds][n]);
    gpu_buffer_finish(bench.device, &bench.rays);
    gpu_buffer_finish(bench.device, &bench.hits);
    bench_scene_finish(&bench.scene);
    gpu_device_destroy(bench.device);
    return bench.failed ? 1 : 0;
}
