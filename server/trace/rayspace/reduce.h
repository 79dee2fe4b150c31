/* SPDX-License-Identifier: MIT */
/* Stream reduction in passes of its own (section 4 of the paper), in place of that which is fused with the
 * descent: by segments, or by a geometry shader. Structs on the device: shaders/rayspace/reduce.h. */
#ifndef FARLIGHT_TRACE_RAYSPACE_REDUCE_H
#define FARLIGHT_TRACE_RAYSPACE_REDUCE_H

#include "gpu/buffer.h"
#include "protocol/tracers.h"
#include "rayspace/reduce.h"

/* All-zero is the valid empty one. */
struct rayspace_reduction {
    enum rayspace_reduce way;
    uint32_t slot_count; /* that there is room for */
    struct gpu_buffer slots, packed, segments, draw;
    unsigned framebuffer, queries[RAYSPACE_LISTS];
};

/* Where pairs go: those that the pass kept, the leaves, and those that are put off; and who says where there. */
struct rayspace_lists {
    struct gpu_buffer *control, *pairs, *leaves, *put_off;
    uint32_t to, later; /* numbers of the stacks */
};

/* The most pairs that a pass may take, at most `pairs`: not all that a stack holds, for slots take five times the
 * place. */
uint32_t rayspace_reduction_pairs(const struct gpu_device *device, uint32_t pairs);
/* For passes of so many pairs. */
bool rayspace_reduction_reserve(struct gpu_device *device, struct rayspace_reduction *reduction,
                                enum rayspace_reduce way, uint32_t pairs, struct error *error);
/* What the pass in hand has left in the slots goes to the lists; or it does not all fit, and nothing counts. */
bool rayspace_reduction_run(struct gpu_device *device, struct rayspace_reduction *reduction,
                            const struct rayspace_lists *lists, struct error *error);
uint64_t rayspace_reduction_bytes(const struct rayspace_reduction *reduction);
void rayspace_reduction_finish(struct gpu_device *device, struct rayspace_reduction *reduction);

#endif
