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

/* Waves of one family have rays of one kind and bounce, which cost about the same: what a tracer learnt from one
 * of them (how many rays fit a step, how large a buffer has to be) is a good guess for the next. */
#define WAVE_FAMILIES 32u
/* Families of one kind of rays (enum ray_kind) follow one another, one for each bounce; the last one is of all
 * bounces that follow. */
#define WAVE_BOUNCES 8u
#define WAVE_RAY_KINDS (WAVE_FAMILIES / WAVE_BOUNCES)

/* Describes a wave; owns nothing. The buffers are the caller's and stay as they are until the wave is traced. */
struct wave {
    enum wave_kind kind;
    unsigned family; /* below WAVE_FAMILIES; 0 where the caller does not tell them apart */
    /* The number of `rays` to trace, at least 1; an upper bound if `counts` is set.
     */
    uint32_t ray_count;
    /* NULL, or a buffer of struct wave_counts (shared/wave.h), of which that one is written on the device before
     * the wave is traced: how many rays there are, at most ray_count, and the work groups of a dispatch over them.
     * The buffers hold ray_count rays all the same; what is in them behind the last ray is arbitrary but finite. A
     * tracer that traces on the host (tracer_impl) traces these too, and their answers mean nothing; the others
     * never wait for the counts to be on the host. */
    struct gpu_buffer *counts;
    uint32_t counts_index;
    /* With counts: NULL, or the buffer and the word in it that a tracer sets to WAVE_STOPPED_LONG, unless it is
     * set, where it could not finish the rays without waiting. Their answers then mean nothing; the caller has the
     * wave traced again by a `patient` state (tracer.h). */
    struct gpu_buffer *stopped;
    uint32_t stopped_word;
    struct gpu_buffer *rays;       /* struct ray */
    struct gpu_buffer *hits;       /* struct hit; closest */
    struct gpu_buffer *visibility; /* uint; any */
    struct gpu_buffer *times;      /* float a ray: when, 0: the shutter opens, 1: it closes; NULL: all at 0 */
    bool shared_origin;            /* all rays begin at one point */
    bool within_reach;             /* of a layer: without what is hidden from all eyes that it is for */
    bool bare;                     /* closest: intersections are enough, no surfaces are made of them */
    float origin_spread;           /* or all on a disc of this diameter, a lens: metres; 0: nothing is known */
    uint64_t frame_samples;        /* of all pixels of the frame that it is of, at most; 0: nothing is known */
    bool apart;                    /* an answer may not depend, to the bit, on which rays are beside its own */
};

/* The rays of pinhole eyes, as a frame has them (shared/frame.h); its uniforms are bound. */
struct eye_rays {
    const struct frame_uniforms *frame;
    uint32_t first_slot, slot_count; /* pixels, of each of which there are 2 to the power of frame->sample_shift */
    bool spread;                     /* SPREAD of common/sample_place.glsl */
    float reach;                     /* so far from a pixel's centre at most, pixels */
    struct gpu_buffer *hits;         /* RGBA32F texels, shared/eye_hit.h */
};

/* Consecutive rays of a wave, at least one. */
struct ray_range {
    const struct wave *wave;
    uint32_t first, end; /* rays first .. end - 1 */
};

#endif
