/* SPDX-License-Identifier: MIT */
/* The rays that are traced: those of a camera, and what comes of where they hit. */
#ifndef FARLIGHT_TESTS_BENCH_WAVES_H
#define FARLIGHT_TESTS_BENCH_WAVES_H

#include "shared/hit.h"
#include "shared/ray.h"
#include "tests/bench/bench_scene.h"

#include <stdbool.h>
#include <stdint.h>

enum bench_wave_kind {
    BENCH_PRIMARY,    /* camera rays, 8x8 tiles in Morton order: coherent, closest */
    BENCH_REFLECTION, /* mirrored where those hit: partly coherent, closest */
    BENCH_SHADOW,     /* rays to one point: coherent, any */
    BENCH_OCCLUSION,  /* cosine-weighted, a tenth of the diagonal long: incoherent, any */
    BENCH_BOUNCE,     /* cosine-weighted, without end: incoherent, closest */
    BENCH_WAVE_KINDS
};

struct bench_wave_fact {
    const char *name, *order; /* "coherent", "partly", "incoherent" */
    bool is_any;
    bool shared_origin; /* member of struct wave */
};
extern const struct bench_wave_fact bench_wave_facts[BENCH_WAVE_KINDS];

/* Width and height are multiples of 8. */
void bench_camera_rays(struct ray *rays, const struct frame_camera *camera, uint32_t width, uint32_t height);
/* `rays_each` rays of `kind` (not PRIMARY) for each of `count` camera rays that hit something, next to each other.
 * Returns how many these are. The same input gives the same rays. */
uint32_t bench_secondary_rays(struct ray *rays, enum bench_wave_kind kind, const struct ray *camera_rays,
                              const struct hit *hits, uint32_t count, uint32_t rays_each,
                              const struct bench_scene *scene);

#endif
