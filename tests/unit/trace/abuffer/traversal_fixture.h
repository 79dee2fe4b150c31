/* SPDX-License-Identifier: MIT */
/* A-buffers of shapes, every way in which they are searched, and waves through them: for the tests of traversal.
 * All is in cells, which are as wide as the world's unit. */
#ifndef FARLIGHT_TESTS_ABUFFER_TRAVERSAL_FIXTURE_H
#define FARLIGHT_TESTS_ABUFFER_TRAVERSAL_FIXTURE_H

#include "tests/accuracy/test_scenes.h"
#include "tests/fixtures/waves.h"
#include "tests/unit/trace/abuffer/samples.h"

#include "trace/abuffer/trace.h"
#include "trace/abuffer/voxels.h"

#include <float.h>

#define RAY_COUNT 4096u
#define FAR 1e30f
#define PI_D 3.14159265358979

static const struct form {
    const char *name;
    struct tracer_options options;
} forms[] = {
    {"dda", {.abuffer = {.search = ABUFFER_SEARCH_DDA}}},
    {"linear3", {.abuffer = {.search = ABUFFER_SEARCH_LINEAR3}}},
    {"linear1", {.abuffer = {.search = ABUFFER_SEARCH_LINEAR1}}},
    {"voxels3", {.abuffer = {.search = ABUFFER_SEARCH_VOXELS3}}},
    {"voxels1", {.abuffer = {.search = ABUFFER_SEARCH_VOXELS1}}},
    {"parity3", {.abuffer = {.search = ABUFFER_SEARCH_PARITY3}}},
    {"parity1", {.abuffer = {.search = ABUFFER_SEARCH_PARITY1}}},
};
/* Those before FORM_COUNT read one structure; the others one of whole voxels. */
enum { DDA, LINEAR3, LINEAR1, FORM_COUNT, VOXELS3 = FORM_COUNT, VOXELS1, PARITY3, PARITY1, FORMS_END };

struct fixture {
    struct scene *scene;
    struct gpu_scene gpu; /* has the materials, and no geometry that a tracer would see */
    struct abuffer_store store;
    struct abuffer_samples samples;
};

static inline void fixture_init(struct fixture *fixture, struct scene *scene, uint32_t resolution, uint32_t voxels)
{
    struct error error = {0};
    struct scene_changes changes;
    *fixture = (struct fixture){.scene = scene ? scene : test_scene_create(),
                                .samples = {.resolution = resolution, .voxels_along = voxels}};
    gpu_scene_init(&fixture->gpu, device);
    expect_ok(gpu_scene_update(&fixture->gpu, fixture->scene, NULL, &changes, NULL, &error), &error);
    abuffer_store_init(&fixture->store, device);
}

static inline void fixture_build(struct fixture *fixture)
{
    struct abuffer_store *store = &fixture->store;
    struct error error = {0};
    expect_ok(abuffer_upload(&fixture->samples, store, 1, &error), &error);
    expect_ok(abuffer_voxels_reserve(store, &error), &error);
    for (unsigned pass = 0; pass < ABUFFER_VOXEL_PASSES; pass++)
        expect_ok(abuffer_voxels_pass(store, pass, 0, abuffer_voxel_blocks(store), &error), &error);
}

static inline void fixture_finish(struct fixture *fixture)
{
    abuffer_store_finish(&fixture->store);
    gpu_scene_finish(&fixture->gpu);
    scene_destroy(fixture->scene);
    abuffer_free(&fixture->samples);
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
    return abuffer_intersect(&traversal->fixture->store, &traversal->fixture->gpu, &all, traversal->options,
                             error);
}

static inline void trace(struct fixture *fixture, const struct tracer_options *options, enum wave_kind kind,
                         const struct ray *rays, uint32_t count, struct hit *hits, uint32_t *visibility)
{
    trace_rays(traverse_wave, &(struct traversal){fixture, options}, kind, rays, count, hits, visibility);
}

/* ---- shapes ---- */

static inline void add_quad(struct abuffer_samples *s, const double p[4][3], bool is_body)
{
    const double first[3][3] = {
        {p[0][0], p[0][1], p[0][2]}, {p[1][0], p[1][1], p[1][2]}, {p[2][0], p[2][1], p[2][2]}};
    const double second[3][3] = {
        {p[0][0], p[0][1], p[0][2]}, {p[2][0], p[2][1], p[2][2]}, {p[3][0], p[3][1], p[3][2]}};
    abuffer_add_triangle(s, first, is_body);
    abuffer_add_triangle(s, second, is_body);
}

/* Outside is outside. */
static inline void add_ball(struct abuffer_samples *s, const double centre[3], double radius, int steps,
                            bool is_body)
{
    for (int i = 0; i < steps; i++) {
        for (int j = 0; j < 2 * steps; j++) {
            double p[4][3];
            for (int k = 0; k < 4; k++) {
                int row = i + (k == 1 || k == 2), at = (j + (k >= 2)) % (2 * steps);
                double theta = PI_D * row / steps, phi = PI_D * at / steps;
                double across = row == 0 || row == steps ? 0 : sin(theta);
                p[3 - k][0] = centre[0] + radius * across * cos(phi);
                p[3 - k][1] = centre[1] + radius * cos(theta);
                p[3 - k][2] = centre[2] + radius * across * sin(phi);
            }
            add_quad(s, (const double(*)[3])p, is_body);
        }
    }
}

static inline void add_box(struct abuffer_samples *s, const double lower[3], const double upper[3], bool is_body)
{
    for (int side = 0; side < 6; side++) {
        const int axis = side / 2, u = (axis + 1) % 3, v = (axis + 2) % 3;
        double p[4][3];
        for (int k = 0; k < 4; k++) {
            p[k][axis] = side % 2 ? upper[axis] : lower[axis];
            p[k][u] = (k == 1 || k == 2) == (side % 2 == 1) ? upper[u] : lower[u];
            p[k][v] = k >= 2 ? upper[v] : lower[v];
        }
        add_quad(s, (const double(*)[3])p, is_body);
    }
}

/* ---- rays ---- */

static inline struct ray ray_from(const double origin[3], const double direction[3], float t_min, float t_max)
{
    return (struct ray){.origin_t_min = {(float)origin[0], (float)origin[1], (float)origin[2], t_min},
                        .direction_t_max = {(float)direction[0], (float)direction[1], (float)direction[2], t_max}};
}

#endif
