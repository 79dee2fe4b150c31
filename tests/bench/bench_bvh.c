/* SPDX-License-Identifier: MIT */
/* The forms of the tracer `bvh` side by side: rays a second of the traversal alone, build time, memory.
 * Usage: bench bvh [TRIANGLES ..]     (default: 5000 37000 146000 590000)
 * Nine bumpy spheres on a floor, seen from above: waves of camera rays (8x8 tiles in Morton order) and of one
 * diffuse bounce from where these hit. Each figure is the median of RUNS after a warm-up, which also compiles.
 * Every form's hits are compared ray by ray with those of the first; exit status 1 if more than 0.01 % differ, or
 * GL reports an error. */
#include "tests/accuracy/test_scenes.h"
#include "tests/bench/bench.h"
#include "tests/bench/bench_scene.h"

#include "base/clock.h"
#include "gpu/device.h"
#include "shared/hit.h"
#include "shared/ray.h"
#include "trace/tracer.h"

#include <epoxy/gl.h>

#include <stdbool.h>

#define WIDTH 512
#define HEIGHT 512
#define RAY_COUNT (WIDTH * HEIGHT)
#define RUNS 5
#define PI_F 3.14159265f
/* Distances of the same surface by way of different bounds are the same computation. */
#define TOLERANCE 1e-5f
/* Rays of a packet take triangles relative to the leading one's origin: one that passes within
 * rounding of an edge may go by it, or meet its other triangle. */
#define DIFFERING_MAX (RAY_COUNT / 10000)

struct form {
    const char *name;
    struct tracer_options options;
};
static const struct form forms[] = {
    {"plain (spheres, storage buffer)", {.bench = {.bvh_layout = BVH_LAYOUT_PLAIN}}},
    {"spheres, 1 ray", {.bvh = {.bounds = BVH_BOUNDS_SPHERE, .rays = 1}}},
    {"spheres, packets of 2", {.bvh = {.bounds = BVH_BOUNDS_SPHERE, .rays = 2}}},
    {"boxes, 1 ray", {.bvh = {.bounds = BVH_BOUNDS_BOX, .rays = 1}}},
    {"boxes, packets of 2", {.bvh = {.bounds = BVH_BOUNDS_BOX, .rays = 2}}},
    {"boxes, packets of 4", {.bvh = {.bounds = BVH_BOUNDS_BOX, .rays = 4}}},
    {"boxes, packets of 8", {.bvh = {.bounds = BVH_BOUNDS_BOX, .rays = 8}}},
    {"auto", {.bvh = {0}}},
};
#define FORM_COUNT (sizeof(forms) / sizeof(forms[0]))
enum { WAVE_PRIMARY, WAVE_BOUNCE, WAVE_SHADOW, WAVE_KINDS };

struct bench {
    struct gpu_device *device;
    struct scene *scene;
    struct gpu_scene gpu;
    struct gpu_buffer ray_buffer, answers;
    struct ray *rays[WAVE_KINDS];
    void *reference[WAVE_KINDS]; /* what the first form answered */
    uint64_t build_ns;           /* of the last update */
    double plain_primary;
    bool failed;
};

static void require(bool ok, const struct error *error)
{
    if (ok)
        return;
    fprintf(stderr, "bench bvh: %s %s\n", error->field, error->text);
    exit(1);
}

/* ---- rays ---- */

static void set_ray(struct ray *ray, const float origin[3], const float direction[3])
{
    float length = sqrtf(direction[0] * direction[0] + direction[1] * direction[1] + direction[2] * direction[2]);
    for (int k = 0; k < 3; k++) {
        ray->origin_t_min[k] = origin[k];
        ray->direction_t_max[k] = direction[k] / length;
    }
    ray->origin_t_min[3] = 1e-4f;
    ray->direction_t_max[3] = 1e30f;
}

static void make_camera_rays(struct ray *rays)
{
    static const float eye[3] = {0, 5, 9};
    const float forward[2] = {-0.4311f, -0.9023f}; /* y, z: down to the spheres */
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        uint32_t tile = i / 64, m = i % 64;
        uint32_t x = tile % (WIDTH / 8) * 8 + ((m & 1) | (m >> 1 & 2) | (m >> 2 & 4));
        uint32_t y = tile / (WIDTH / 8) * 8 + ((m >> 1 & 1) | (m >> 2 & 2) | (m >> 3 & 4));
        float u = 0.45f * (2 * ((float)x + 0.5f) / WIDTH - 1), v = -0.45f * (2 * ((float)y + 0.5f) / HEIGHT - 1);
        set_ray(&rays[i], eye, (float[3]){u, forward[0] - v * forward[1], forward[1] + v * forward[0]});
    }
}

static void unpack_unit(float out[3], uint32_t bits)
{
    float x = (float)(int16_t)(bits & 0xffff) / 32767, y = (float)(int16_t)(bits >> 16) / 32767;
    out[2] = 1 - fabsf(x) - fabsf(y);
    out[0] = out[2] < 0 ? (1 - fabsf(y)) * (x >= 0 ? 1.0f : -1.0f) : x;
    out[1] = out[2] < 0 ? (1 - fabsf(x)) * (y >= 0 ? 1.0f : -1.0f) : y;
}

/* From where the camera rays hit: one cosine-weighted bounce, and a ray to a light. Rays of the sky are dead. */
static void make_secondary_rays(struct bench *bench, const struct hit *hits)
{
    uint64_t seed = 7;
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        const struct ray *from = &bench->rays[WAVE_PRIMARY][i];
        float normal[3], origin[3], bounce[3], to_light[3];
        static const float light[3] = {4, 8, 5};
        unpack_unit(normal, hits[i].normal_geometric);
        float side = hits[i].material & HIT_BACK_FACE ? -1.0f : 1.0f;
        float z = test_uniform(&seed, -0.999f, 0.999f), phi = test_uniform(&seed, 0, 2 * PI_F),
              r = sqrtf(1 - z * z);
        const float on_sphere[3] = {r * cosf(phi), r * sinf(phi), z};
        for (int k = 0; k < 3; k++) {
            origin[k] =
                from->origin_t_min[k] + hits[i].distance * from->direction_t_max[k] + 1e-4f * side * normal[k];
            bounce[k] = side * normal[k] * 1.001f + on_sphere[k];
            to_light[k] = light[k] - origin[k];
        }
        set_ray(&bench->rays[WAVE_BOUNCE][i], origin, bounce);
        set_ray(&bench->rays[WAVE_SHADOW][i], origin, to_light);
        if (hits[i].distance < 0)
            bench->rays[WAVE_BOUNCE][i].direction_t_max[3] = bench->rays[WAVE_SHADOW][i].direction_t_max[3] = -1;
    }
}

/* ---- measuring ---- */

/* The traversal alone, or its surfaces too. */
static void run(struct bench *bench, struct tracer *tracer, int kind, bool surfaces)
{
    struct error error = {0};
    const struct wave wave = {.kind = kind == WAVE_SHADOW ? WAVE_ANY : WAVE_CLOSEST,
                              .ray_count = RAY_COUNT,
                              .rays = &bench->ray_buffer,
                              .hits = &bench->answers,
                              .visibility = &bench->answers,
                              .shared_origin = kind == WAVE_PRIMARY};
    require((surfaces ? tracer_trace : tracer_intersect)(tracer, &bench->gpu, &wave, &error), &error);
    glFinish();
}

static int by_time(const void *a, const void *b)
{
    uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return x < y ? -1 : x > y;
}

/* Answers that are not the first form's. */
static uint32_t count_differing(const struct bench *bench, int kind, const void *answers)
{
    uint32_t differing = 0;
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        if (kind == WAVE_SHADOW) {
            differing += ((const uint32_t *)bench->reference[kind])[i] == ((const uint32_t *)answers)[i] ? 0 : 1;
            continue;
        }
        float a = ((const struct hit *)bench->reference[kind])[i].distance,
              b = ((const struct hit *)answers)[i].distance;
        differing += fabsf(a - b) <= TOLERANCE * fabsf(a) ? 0 : 1;
    }
    return differing;
}

/* Mray/s; *compile_ms: what the first run took beyond the median. */
static double measure(struct bench *bench, struct tracer *tracer, int kind, double *compile_ms)
{
    struct error error = {0};
    size_t bytes = RAY_COUNT * (kind == WAVE_SHADOW ? sizeof(uint32_t) : sizeof(struct hit));
    uint64_t times[RUNS];
    require(gpu_buffer_upload(bench->device, &bench->ray_buffer, bench->rays[kind], RAY_COUNT * sizeof(struct ray),
                              &error) &&
                gpu_buffer_reserve(bench->device, &bench->answers, bytes, &error),
            &error);
    gpu_scene_bind(&bench->gpu);
    uint64_t start_ns = clock_now_ns();
    run(bench, tracer, kind, false);
    uint64_t first_ns = clock_now_ns() - start_ns;
    for (int i = 0; i < RUNS; i++) {
        start_ns = clock_now_ns();
        run(bench, tracer, kind, false);
        times[i] = clock_now_ns() - start_ns;
    }
    if (!bench->reference[WAVE_PRIMARY]) /* the other waves begin on its surfaces */
        run(bench, tracer, kind, true);
    require(gpu_check(bench->device, "bench_bvh", &error), &error);
    qsort(times, RUNS, sizeof(times[0]), by_time);
    *compile_ms = first_ns > times[RUNS / 2] ? (double)(first_ns - times[RUNS / 2]) * 1e-6 : 0;
    void *answers = malloc(bytes);
    gpu_buffer_read(bench->device, &bench->answers, 0, answers, bytes);
    if (!bench->reference[kind]) {
        bench->reference[kind] = answers;
        if (kind == WAVE_PRIMARY)
            make_secondary_rays(bench, answers);
    } else {
        uint32_t differing = count_differing(bench, kind, answers);
        if (differing > 0)
            printf("  %u of %u answers differ from those of '%s'\n", differing, RAY_COUNT, forms[0].name);
        bench->failed = bench->failed || differing > DIFFERING_MAX;
        free(answers);
    }
    return RAY_COUNT / ((double)times[RUNS / 2] * 1e-3);
}

static void measure_form(struct bench *bench, const struct form *form)
{
    struct error error = {0};
    struct stage_times times;
    stage_times_begin(&times);
    struct tracer *tracer = tracer_create(&tracer_bvh_impl, bench->device, &form->options, &error);
    require(tracer && tracer_update(tracer, &bench->gpu, &(struct tracer_update){.times = &times}, &error),
            &error);
    double rates[WAVE_KINDS], compile_ms[WAVE_KINDS];
    for (int kind = 0; kind < WAVE_KINDS; kind++)
        rates[kind] = measure(bench, tracer, kind, &compile_ms[kind]);
    if (form == &forms[0])
        bench->plain_primary = rates[WAVE_PRIMARY];
    printf("%-32s %7.2f %6.2f %7.2f %7.2f   %6.0f %6.0f %7.1f   %5.0f %5.0f\n", form->name, rates[WAVE_PRIMARY],
           rates[WAVE_PRIMARY] / bench->plain_primary, rates[WAVE_BOUNCE], rates[WAVE_SHADOW],
           (double)stage_times_sum_ns(&times, STAGE_BUILD, CLOCK_CPU) * 1e-6,
           (double)stage_times_sum_ns(&times, STAGE_UPLOAD, CLOCK_CPU) * 1e-6,
           (double)tracer->stats.device_bytes / (1 << 20), compile_ms[WAVE_PRIMARY], compile_ms[WAVE_SHADOW]);
    fflush(stdout);
    tracer_destroy(tracer);
}

static bool bench_scene(struct gpu_device *device, uint32_t triangles)
{
    struct bench bench = {.device = device};
    struct error error = {0};
    struct scene_changes changes;
    bench.scene = bench_family_scene(triangles);
    gpu_scene_init(&bench.gpu, device);
    require(gpu_scene_update(&bench.gpu, bench.scene, NULL, &changes, NULL, &error), &error);
    for (int kind = 0; kind < WAVE_KINDS; kind++)
        bench.rays[kind] = malloc(RAY_COUNT * sizeof(struct ray));
    make_camera_rays(bench.rays[WAVE_PRIMARY]);
    printf("\n%u triangles\n%-32s %7s %6s %7s %7s   %6s %6s %7s   %5s %5s\n",
           bench.gpu.geometries[0].device.primitive_count, "", "primary", "x", "bounce", "shadow", "build",
           "upload", "memory", "compile", "");
    printf("%-32s %7s %6s %7s %7s   %6s %6s %7s   %5s %5s\n", "", "Mray/s", "plain", "Mray/s", "Mray/s", "ms",
           "ms", "MiB", "ms", "ms");
    for (size_t i = 0; i < FORM_COUNT; i++)
        measure_form(&bench, &forms[i]);
    for (int kind = 0; kind < WAVE_KINDS; kind++) {
        free(bench.rays[kind]);
        free(bench.reference[kind]);
    }
    gpu_buffer_finish(device, &bench.ray_buffer);
    gpu_buffer_finish(device, &bench.answers);
    gpu_scene_finish(&bench.gpu);
    scene_destroy(bench.scene);
    return !bench.failed;
}

BENCH(bvh)
{
    static const uint32_t defaults[] = {5000, 37000, 146000, 590000};
    struct error error = {0};
    struct gpu_device *device = gpu_device_create(&(struct gpu_options){.index = -1}, &error);
    if (!device) {
        printf("SKIP: no OpenGL device: %s\n", error.text);
        return 0;
    }
    printf("%s, %s\n", device->info.name, device->info.version);
    bool ok = true;
    for (int i = 1; i < argc; i++) {
        long triangles = strtol(argv[i], NULL, 10);
        if (triangles < 1 || triangles > 50000000) {
            fprintf(stderr, "bench bvh: %s: between 1 and 50000000 triangles\n", argv[i]);
            gpu_device_destroy(device);
            return 2;
        }
        ok = bench_scene(device, (uint32_t)triangles) && ok;
    }
    for (size_t i = 0; argc < 2 && i < sizeof(defaults) / sizeof(defaults[0]); i++)
        ok = bench_scene(device, defaults[i]) && ok;
    gpu_device_destroy(device);
    return ok ? 0 : 1;
}
