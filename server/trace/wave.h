/* SPDX-License-Identifier: MIT */
/* Rays travel in waves: a batch of rays in, a batch of hits (or of visibilities) out, all on the device. */
#ifndef FARLIGHT_TRACE_WAVE_H
#define FARLIGHT_TRACE_WAVE_H

#include "gpu/buffer.h"

#include <stdint.h>

/* Parts begin at multiples of it: rays that walk together, 8 or 3, say, stay together. */
#define WAVE_PART_RAYS 192u

enum wave_kind {
    WAVE_CLOSEST, /* fills `hits` */
    WAVE_ANY,     /* fills `visibility`: transmittance up to t_max, unorm 4x8 rgb; opaque surfaces stop it,
                     translucent ones (transmission, blend) tint it */
};

struct wave {
    enum wave_kind kind;
    uint32_t ray_count; /* on the host: how many of `rays` are to be traced */
    /* The part of them that is traced now, so that a long wave is some short steps: from a multiple of
     * WAVE_PART_RAYS up to end_ray; 0: to the last. Parts come in their order, others' waves may come in between,
     * and with all of them traced the answers are the whole wave's to the bit. */
    uint32_t first_ray, end_ray;
    /* What a tracer chooses for a wave by its first part; the caller's, for the parts after it. May be NULL where
     * the first part is the whole. */
    uint32_t *chosen;
    struct gpu_buffer *rays;       /* struct ray */
    struct gpu_buffer *hits;       /* struct hit; closest */
    struct gpu_buffer *visibility; /* uint; any */
    struct gpu_buffer *times;      /* float a ray: when, 0: the shutter opens, 1: it closes; NULL: all at 0 */
    bool shared_origin;            /* all rays begin at one point */
    float origin_spread;           /* or all on a disc of this diameter, a lens: metres; 0: who knows where */
    /* Closest hits of an exact tracer stay crossings (shared/hit.h): for benchmarks, of the walk alone. */
    bool crossings_only;
};

#endif
