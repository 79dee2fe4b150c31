/* SPDX-License-Identifier: MIT */
/* How long the device works on each dispatch by itself, by time stamps. The host waits after each one, so this is
 * for who looks a device over. */
#ifndef FARLIGHT_GPU_WATCH_H
#define FARLIGHT_GPU_WATCH_H

#include "gpu/device.h"

#include <stdint.h>

struct gpu_watch {
    unsigned queries[2];      /* GL time stamps: before, behind */
    uint64_t count;           /* of dispatches that were measured */
    uint64_t longest_ns;      /* 0: the device has no time stamps */
    unsigned longest_program; /* its GL name */
};

/* From now on all dispatches of the device are watched; `watch` stays the caller's until the end. */
void gpu_watch_begin(struct gpu_device *device, struct gpu_watch *watch);
void gpu_watch_end(struct gpu_device *device); /* its figures stay */

/* For program.c, around a dispatch; nothing happens while no dispatch is watched. */
void gpu_watch_before(struct gpu_device *device);
void gpu_watch_after(struct gpu_device *device, unsigned program);

#endif
