/* SPDX-License-Identifier: MIT */
/* Cubes of samples, every form in which they are traversed, and waves through them: for the tests of traversal. */
#ifndef FARLIGHT_TESTS_LDC_TRAVERSAL_FIXTURE_H
#define FARLIGHT_TESTS_LDC_TRAVERSAL_FIXTURE_H

#include "tests/accuracy/test_scenes.h"
#include "tests/fixtures/waves.h"
#include "tests/unit/trace/ldc/samples.h"

#include "trace/ldc/levels.h"
#include "trace/ldc/trace.h"

#include <float.h>

#define RAY_COUNT 4096u
#define PI_F 3.14159265f
#define FAR 1e30f

static const struct form {
    const char *name;
    struct tracer_options options;
} forms[] = {
    {"cells", {.ldc = {0}}},
    {"cells, 4 rays", {.ldc = {.rays = 4}}},
    {"cells, by the device", {.bench = {.ldc_on_device = 1}}},
    {"pyramid", {.ldc = {.levels = LDC_LEVELS_PYRAMID}}},
    {"pyramid, 4 rays, layers one by one",
     {.ldc = {.levels = LDC_LEVELS_PYRAMID, .rays = 4}, .bench = {.ldc_layers_together = 1}}},
    {"blocks of 8", {.ldc = {.levels = LDC_LEVELS_BLOCKS, .block = 8}}},
    {"blocks of 2, 4 rays", {.ldc = {.levels = LDC_LEVELS_BLOCKS, .block = 2, .rays = 4}}},
    {"blocks of 32, layers one by one",
     {.ldc = {.levels = LDC_LEVELS_BLOCKS, .block = 32}, .bench = {.ldc_layers_together = 1}}},
};
#define FORM_COUNT (sizeof(forms) / sizeof(*forms))

/* ---- what is traversed ---- */

struct fixture {
    struct scene *scene;
    struct gpu_scene gpu; /* has the materials, and no geometry that a tracer would see */
    struct ldc_store store;
    struct ldc_samples samples[LDC_CUBES_MAX];
};

static inline void start_samples(struct ldc_samples *s, uint32_t resolution, float size, float x, float y, float z)
{
    *s = (struct ldc_samples){.lower = {x, y, z}, .cell = size / (float)resolution, .resolution = resolution};
}

static inline void fixture_init(struct fixture *fixture, struct scene *scene)
{
    struct error error = {0};
    struct scene_changes changes;
    *fixture = (struct fixture){.scene = scene ? scene : test_scene_create()};
    gpu_scene_init(&fixture->gpu, device);
    expect_ok(gpu_scene_update(&fixture->gpu, fixture->scene, NULL, &changes, NULL, &error), &error);
    ldc_store_init(&fixture->store, device);
}

static inline void fixture_finish(struct fixture *fixture)
{
    ldc_store_finish(&fixture->store);
    gpu_scene_finish(&fixture->gpu);
    scene_destroy(fixture->scene);
    for (int i = 0; i < LDC_CUBES_MAX; i++)
        free(fixture->samples[i].list);
}

/* A cube's nodes, from its samples. */
static inline void build_levels(struct fixture *fixture, unsigned which, const struct tracer_options *options)
{
    struct error error = {0};
    struct ldc_levels levels;
    enum tracer_progress progress = TRACER_MORE;
    ldc_levels_begin(&levels, &fixture->store, which, options);
    while (progress == TRACER_MORE)
        progress = ldc_levels_go_on(&levels, &error);
    ldc_levels_finish(&levels);
    expect_ok(progress == TRACER_DONE, &error);
}

/* The samples of both cubes, sorted, and their nodes in a form. */
static inline void build(struct fixture *fixture, const struct tracer_options *options)
{
    struct error error = {0};
    for (unsigned i = 0; i < LDC_CUBES_MAX; i++)
        if (fixture->samples[i].resolution)
            expect_ok(ldc_upload(&fixture->samples[i], &fixture->store, i, &error), &error);
    for (unsigned i = 0; i < LDC_CUBES_MAX; i++)
        build_levels(fixture, i, options);
}

struct traversal {
    struct fixture *fixture;
    const struct tracer_options *options;
};

static inline bool traverse_wave(void *user, const struct wave *wave, struct error *error)
{
    const struct traversal *traversal = user;
    gpu_scene_bind(&traversal->fixture->gpu);
    const struct ray_range all = {.wave = wave, .end = wave->ray_count};
    return ldc_intersect(&traversal->fixture->store, &traversal->fixture->gpu, &all, traversal->options, error);
}

static inline void trace(struct fixture *fixture, const struct tracer_options *options, enum wave_kind kind,
                         const struct ray *rays, uint32_t count, struct hit *hits, uint32_t *visibility)
{
    trace_rays(traverse_wave, &(struct traversal){fixture, options}, kind, rays, count, hits, visibility);
}

static inline void add_quad(struct ldc_samples *s, const float a[3], const float b[3], const float c[3],
                            const float d[3], uint32_t material)
{
    const float first[3][3] = {{a[0], a[1], a[2]}, {b[0], b[1], b[2]}, {c[0], c[1], c[2]}};
    const float second[3][3] = {{a[0], a[1], a[2]}, {c[0], c[1], c[2]}, {d[0], d[1], d[2]}};
    ldc_add_triangle(s, first, material);
    ldc_add_triangle(s, second, material);
}

static inline void on_sphere(float p[3], const float centre[3], float radius, float theta, float phi)
{
    p[0] = centre[0] + radius * sinf(theta) * cosf(phi);
    p[1] = centre[1] + radius * cosf(theta);
    p[2] = centre[2] + radius * sinf(theta) * sinf(phi);
}

static inline void add_sphere(struct ldc_samples *s, const float centre[3], float radius, int steps,
                              uint32_t material)
{
    for (int i = 0; i < steps; i++) {
        for (int j = 0; j < 2 * steps; j++) {
            float p[4][3];
            for (int k = 0; k < 4; k++)
                on_sphere(p[k], centre, radius, PI_F * (float)(i + (k == 1 || k == 2)) / (float)steps,
                          PI_F * (float)(j + (k >= 2)) / (float)steps);
            add_quad(s, p[0], p[3], p[2], p[1], material);
        }
    }
}

/* Outside is outside. */
static inline void add_box(struct ldc_samples *s, const float lower[3], const float upper[3], uint32_t material)
{
    for (int side = 0; side < 6; side++) {
        const int axis = side / 2, u = (axis + 1) % 3, v = (axis + 2) % 3;
        float p[4][3];
        for (int k = 0; k < 4; k++) {
            p[k][axis] = side % 2 ? upper[axis] : lower[axis];
            p[k][u] = (k == 1 || k == 2) == (side % 2 == 1) ? upper[u] : lower[u];
            p[k][v] = k >= 2 ? upper[v] : lower[v];
        }
        add_quad(s, p[0], p[1], p[2], p[3], material);
    }
}

static inline struct ray ray_from(const float origin[3], const float direction[3], float t_min, float t_max)
{
    return (struct ray){.origin_t_min = {origin[0], origin[1], origin[2], t_min},
                        .direction_t_max = {direction[0], direction[1], direction[2], t_max}};
}

#endif
