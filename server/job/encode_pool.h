/* SPDX-License-Identifier: MIT */
/* Threads that turn rendered pixels into the bytes that travel. */
#ifndef FARLIGHT_JOB_ENCODE_POOL_H
#define FARLIGHT_JOB_ENCODE_POOL_H

#include "job/output.h"
#include "job/totals.h"

struct encode_pool;

struct encode_pool_options {
    unsigned threads; /* 0: one per core, at most 4 */
    struct stage_totals *totals;
    void (*on_done)(void *context); /* after each frame, from a thread of the pool */
    void *context;
};

struct encode_pool *encode_pool_create(const struct encode_pool_options *options, struct error *error);
/* Ends after the frames in hand; those that wait are dropped. Accepts NULL. */
void encode_pool_destroy(struct encode_pool *pool);
/* Encodes a frame (its result holds the pixels) with its encoding and quality, and puts it at its position. Takes
 * over the frame, not the output, of which it holds a reference of its own. May wait; false: the pool is closed or
 * out of memory. */
bool encode_pool_submit(struct encode_pool *pool, struct job_output *output, uint64_t position,
                        struct engine_frame *frame);

#endif
