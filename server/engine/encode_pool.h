/* SPDX-License-Identifier: MIT */
/* Threads that turn rendered pixels into the bytes that travel. A client's frames have all threads but one at
 * most, so that another client's need not wait; a frame that is not wanted any more is given up. */
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

/* The frames of one view: those that are encoded as a stream (encode/stream.h) are so one after the other, as they
 * were submitted, whatever threads there are. Reference-counted: frames on their way hold one each. */
struct encode_lane;

struct encode_lane *encode_lane_create(float frames_per_second); /* NULL: out of memory */
void encode_lane_unref(struct encode_lane *lane);                /* accepts NULL */

struct encode_pool *encode_pool_create(const struct encode_pool_options *options, struct error *error);
/* Drops all frames, also those that are being encoded. Nothing may be submitted any more. Accepts NULL. */
void encode_pool_destroy(struct encode_pool *pool);
/* Encodes a frame (its result holds the pixels) with its encoding and quality, and puts it at its position. Takes
 * over the frame, not the output and the lane, of which it holds references of its own. `lane`: the view's; NULL
 * if no frame is part of a stream. One thread submits the frames of a lane. False: out of memory. */
bool encode_pool_submit(struct encode_pool *pool, struct job_output *output, struct encode_lane *lane,
                        uint64_t position, struct engine_frame *frame);

#endif
