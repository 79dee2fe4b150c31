/* SPDX-License-Identifier: MIT */
/* Copies from the device to memory that proceed while it is given other work. */
#ifndef FARLIGHT_GPU_READBACK_H
#define FARLIGHT_GPU_READBACK_H

#include "gpu/buffer.h"

/* A readback, one copy at a time; all-zero is empty. */
struct gpu_readback {
    unsigned name;      /* GL buffer that stays mapped, 0: none yet */
    const void *mapped; /* mapped memory of the buffer */
    size_t capacity_bytes, size_bytes;
    uint32_t copies; /* number of copies so far, which the device writes behind the copy */
    void *fence;     /* fence behind the copy; NULL: no copy is pending */
};

/* Begins to copy a part of a buffer, in its state after the commands queued so far. Drops a copy that was not
 * fetched. */
bool gpu_readback_copy(struct gpu_device *device, struct gpu_readback *readback, const struct gpu_buffer *from,
                       size_t offset_bytes, size_t size_bytes, struct error *error);
/* Sets the fence; call it once after the copy, and after other commands whose end is to be known with the
 * copy's. */
bool gpu_readback_fence(struct gpu_readback *readback, struct error *error);
/* Whether gpu_readback_take() would return without a wait. */
bool gpu_readback_is_done(const struct gpu_readback *readback);
/* Waits for the copy, and stores it in `data`. */
bool gpu_readback_take(struct gpu_device *device, struct gpu_readback *readback, void *data, struct error *error);
void gpu_readback_drop(struct gpu_readback *readback);                              /* drops a pending copy */
void gpu_readback_finish(struct gpu_device *device, struct gpu_readback *readback); /* leaves it empty */

#endif
