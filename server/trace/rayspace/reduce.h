/* SPDX-License-Identifier: MIT */
/* Stream reduction in passes of its own, segment by segment (section 4.1 of the paper), in place of the reduction
 * that is fused with the descent. Structs on the device: shaders/rayspace/reduce.h. */
#ifndef FARLIGHT_TRACE_RAYSPACE_REDUCE_H
#define FARLIGHT_TRACE_RAYSPACE_REDUCE_H

#include "gpu/buffer.h"
#include "rayspace/reduce.h"

/* A reduction's buffers; all-zero is empty. */
struct rayspace_reduction {
    struct gpu_buffer slots, packed, segments;
};

/* Destinations of pairs that a pass keeps and of leaves, and the control that says where in them. */
struct rayspace_lists {
    struct gpu_buffer *control, *pairs, *leaves;
    uint32_t to; /* number of the destination stack */
};

/* Maximum of pairs in a pass, at most `pairs`: slots take five times the memory of the stack's pairs. */
uint32_t rayspace_reduction_pairs(const struct gpu_device *device, uint32_t pairs);
/* Reserves slots for passes of `pairs` pairs. */
bool rayspace_reduction_reserve(struct gpu_device *device, struct rayspace_reduction *reduction, uint32_t pairs,
                                struct error *error);
/* Moves the output of the current pass from the slots to the lists; if not all of it fits, the pass has no
 * effect. */
bool rayspace_reduction_run(struct gpu_device *device, struct rayspace_reduction *reduction,
                            const struct rayspace_lists *lists, struct error *error);
uint64_t rayspace_reduction_bytes(const struct rayspace_reduction *reduction);
void rayspace_reduction_finish(struct gpu_device *device, struct rayspace_reduction *reduction);

#endif
