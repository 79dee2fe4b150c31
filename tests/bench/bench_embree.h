/* SPDX-License-Identifier: MIT */
/* Embree itself, without our interface around it: the yardstick of the traversal alone. The scene's visible
 * triangles lie in world space as one geometry, spheres and discs as points; nothing is cut out. */
#ifndef FARLIGHT_TESTS_BENCH_EMBREE_H
#define FARLIGHT_TESTS_BENCH_EMBREE_H

#include "shared/ray.h"
#include "gpu_scene/scene.h"

#include <stdbool.h>
#include <stdint.h>

struct bench_embree;

/* What a ray found, as much as a traversal tells. */
struct bench_intersection {
    float distance; /* < 0: nothing */
    uint32_t primitive, instance;
    float u, v;
};

struct bench_embree_wave {
    const struct ray *rays;
    uint32_t ray_count;
    unsigned packet;                          /* rays a call: 1, 8, 16 */
    bool coherent;                            /* Embree's flag of that name */
    struct bench_intersection *intersections; /* closest hits; NULL: any hit */
    uint32_t *visibilities; /* any hit: all bits set where nothing is in the way, as of a tracer */
};

/* `robust`: RTC_SCENE_FLAG_ROBUST, else the default flags. *build_ns: Embree's own build. NULL and *error: no
 * memory, or a sphere is squeezed by its transform, which Embree has no points for. */
struct bench_embree *bench_embree_create(const struct gpu_scene *scene, bool robust, uint64_t *build_ns,
                                         struct error *error);
void bench_embree_destroy(struct bench_embree *embree);         /* accepts NULL */
uint64_t bench_embree_bytes(const struct bench_embree *embree); /* its structure, without the triangles */
/* On all cores, denormals flushed; rays are read from and answers written to arrays as a tracer has them. */
void bench_embree_trace(const struct bench_embree *embree, const struct bench_embree_wave *wave);
/* "3.13.5, native packets of 4 8 16" */
void bench_embree_describe(const struct bench_embree *embree, char *text, size_t text_bytes);

#endif
