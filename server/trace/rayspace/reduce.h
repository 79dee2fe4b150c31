/* SPDX-License-Identifier: MIT */
/* Stream reduction in passes of its own, segment by segment (section 4.1 of the paper), in place of that which is
 * fused with the descent. Structs on the device: shaders/rayspace/reduce.h. */
#ifndef FARLIGHT_TRACE_RAYSPACE_REDUCE_H
#define FARLIGHT_TRACE_RAYSPACE_REDUCE_H

#include "gpu/buffer.h"
#include "rayspace/reduce.h"

/* All-zero is the valid empty one. */
struct rayspace_reduction {
    struct gpu_buffer slots, packed, segments;
};

/* Where pairs go: those that the pass kept, and the leaves; and who says where there. */
struct rayspace_lists {
    struct gpu_buffer *control, *pairs, *leaves;
    uint32_t to; /* the stack's number */
};

/* The most pairs that a pass may take, at most `pairs`: not all that a stack holds, for slots take five times the
 * place. */
uint32_t rayspace_reduction_pairs(const struct gpu_device *device, uint32_t pairs);
/* For passes of so many pairs. */
bool rayspace_reduction_reserve(struct gpu_device *device, struct rayspace_reduction *reduction, uint32_t pairs,
                                struct error *error);
/* What the pass in hand has left in the slots goes to the lists; or it does not all fit, and nothing counts. */
bool rayspace_reduction_run(struct gpu_device *device, struct rayspace_reduction *reduction,
                            const struct rayspace_lists *lists, struct error *error);
uint64_t rayspace_reduction_bytes(const struct rayspace_reduction *reduction);
void rayspace_reduction_finish(struct gpu_device *device, struct rayspace_reduction *reduction);

#endif
