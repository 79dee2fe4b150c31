/* SPDX-License-Identifier: MIT */
/* Copies from the device to memory that go on by themselves while it is given other work. */
#ifndef FARLIGHT_GPU_READBACK_H
#define FARLIGHT_GPU_READBACK_H

#include "gpu/buffer.h"

/* One copy at a time. All-zero is the valid empty one. */
struct gpu_readback {
    unsigned name;      /* GL buffer that stays mapped, 0: none yet */
    const void *mapped; /* of it */
    size_t capacity_bytes, size_bytes;
    void *fence; /* behind the copy; NULL: none is on its way */
};

/* Begins to copy the first bytes of a buffer, as they are after the commands queued so far. Drops a copy that was
 * not fetched. */
bool gpu_readback_copy(struct gpu_device *device, struct gpu_readback *readback, const struct gpu_buffer *from,
                       size_t size_bytes, struct error *error);
/* Call it once after that, and after other commands whose end is to be known with the copy's. */
bool gpu_readback_fence(struct gpu_readback *readback, struct error *error);
/* Whether gpu_readback_take() would not have to wait. */
bool gpu_readback_is_done(const struct gpu_readback *readback);
/* Waits for the copy, and puts it there. */
bool gpu_readback_take(struct gpu_device *device, struct gpu_readback *readback, void *data, struct error *error);
void gpu_readback_drop(struct gpu_readback *readback); /* the pending copy, if there is one */
void gpu_readback_finish(struct gpu_device *device, struct gpu_readback *readback); /* leaves it empty */

#endif
