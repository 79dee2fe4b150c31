/* SPDX-License-Identifier: MIT */
/* Rays travel in waves: a batch of rays in, a batch of hits (or of visibilities) out, all on the device. */
#ifndef FARLIGHT_TRACE_WAVE_H
#define FARLIGHT_TRACE_WAVE_H

#include "gpu/buffer.h"
#include "shared/frame.h"

#include <stdbool.h>
#include <stdint.h>

enum wave_kind {
    WAVE_CLOSEST, /* fills `hits` */
    WAVE_ANY,     /* fills `visibility`: transmittance up to t_max (shared/ray.h); opaque surfaces stop it,
                     translucent ones (transmission, blend) tint it */
};

/* Waves of one family have rays of one kind and bounce, which cost about the same: measurements of one wave
 * (how many rays fit a step, how large a buffer must be) are a good guess for the next. */
#define WAVE_FAMILIES 32u
/* Families of one kind of rays (enum ray_kind) follow one another, one for each bounce; the last one has all
 * further bounces. */
#define WAVE_BOUNCES 8u
#define WAVE_RAY_KINDS (WAVE_FAMILIES / WAVE_BOUNCES)

/* A wave; owns nothing. The buffers are the caller's and must stay until the wave is traced. */
struct wave {
    enum wave_kind kind;
    unsigned family; /* below WAVE_FAMILIES; 0 where the caller does not distinguish them */
    /* Number of `rays` to trace, at least 1; an upper bound if `counts` is set. */
    uint32_t ray_count;
    /* NULL, or a buffer of struct wave_counts (shared/wave.h), whose element counts_index is written on the device
     * before the wave is traced: how many rays there are, at most ray_count, and the work groups of a dispatch
     * over them. The buffers hold ray_count rays all the same; their contents behind the last ray are arbitrary
     * but finite. A tracer that traces on the host (tracer_impl) traces these too, and their answers mean nothing;
     * the others never wait for the counts to be on the host. */
    struct gpu_buffer *counts;
    uint32_t counts_index;
    /* With counts: NULL, or the buffer and word that a tracer sets to WAVE_STOPPED_LONG, unless it is set
     * already, where it could not finish the rays without waiting. Their answers are then invalid; the caller
     * has a `patient` state (tracer.h) trace the wave again. */
    struct gpu_buffer *stopped;
    uint32_t stopped_word;
    struct gpu_buffer *rays;       /* struct ray */
    struct gpu_buffer *hits;       /* struct hit; closest */
    struct gpu_buffer *visibility; /* uint; any */
    struct gpu_buffer *times;      /* float per ray, 0: the shutter opens, 1: it closes; NULL: 0 for all */
    bool shared_origin;            /* every ray begins at the same point */
    bool within_reach;             /* layers only: no hits on surfaces hidden from every eye of the structure */
    bool bare;                     /* closest: intersections suffice, they do not become hits */
    float origin_spread;           /* diameter of the disc (lens) that all rays start on, metres; 0: unknown */
    uint64_t frame_samples;        /* maximum of samples in all pixels of its frame; 0: unknown */
    bool apart;                    /* an answer must not depend, to the bit, on neighbouring rays */
};

/* Rays of pinhole eyes of a frame (shared/frame.h); its uniforms are bound. */
struct eye_rays {
    const struct frame_uniforms *frame;
    uint32_t first_slot, slot_count; /* pixels, each with 2 to the power of frame->sample_shift samples */
    bool spread;                     /* SPREAD of common/sample_place.glsl */
    float reach;                     /* maximum distance of a ray from its pixel's centre, pixels */
    struct gpu_buffer *hits;         /* RGBA32F texels, shared/eye_hit.h */
};

/* A non-empty range of consecutive rays of a wave. */
struct ray_range {
    const struct wave *wave;
    uint32_t first, end; /* rays first .. end - 1 */
};

#endif
