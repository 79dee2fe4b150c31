/* SPDX-License-Identifier: MIT */
/* Threads that encode rendered pixels. A client's frames occupy all threads but one at most, so that another
 * client's need not wait; a frame that is no longer wanted is abandoned. */
#ifndef FARLIGHT_ENGINE_ENCODE_POOL_H
#define FARLIGHT_ENGINE_ENCODE_POOL_H

#include "engine/output.h"
#include "engine/totals.h"

struct encode_pool;

struct encode_pool_options {
    unsigned threads; /* 0: one per core, 2 to 4 */
    struct stage_totals *totals;
    void (*on_done)(void *context); /* after each frame, from a thread of the pool */
    void *context;
};

/* The frames of one view. Frames of a stream (encode/stream.h) are encoded one after the other in the order of
 * submission, however many threads there are. Reference-counted: each frame under way holds a reference. */
struct encode_lane;

struct encode_lane *encode_lane_create(float frames_per_second); /* NULL: out of memory */
void encode_lane_unref(struct encode_lane *lane);                /* accepts NULL */

struct encode_pool *encode_pool_create(const struct encode_pool_options *options, struct error *error);
/* Drops all frames, also those that are being encoded. Nothing may be submitted any more. Accepts NULL. */
void encode_pool_destroy(struct encode_pool *pool);
/* Encodes a frame, whose result holds the pixels, with its encoding and quality, and puts it at its position of
 * the output. Takes over the frame; takes references of its own to the output and the lane. `lane`: the view's;
 * NULL if no frame is part of a stream. One thread submits the frames of a lane. False: out of memory. */
bool encode_pool_submit(struct encode_pool *pool, struct job_output *output, struct encode_lane *lane,
                        uint64_t position, struct engine_frame *frame);

#endif
