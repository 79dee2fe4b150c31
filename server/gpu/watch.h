/* SPDX-License-Identifier: MIT */
/* Duration of each dispatch by itself, by time stamps. The host waits after each one, so this is for the device
 * check only. */
#ifndef FARLIGHT_GPU_WATCH_H
#define FARLIGHT_GPU_WATCH_H

#include "gpu/device.h"

#include <stdint.h>

struct gpu_watch {
    unsigned queries[2];      /* GL time stamps: before, after */
    uint64_t count;           /* measured dispatches */
    uint64_t longest_ns;      /* 0: the device has no time stamps */
    unsigned longest_program; /* its GL name */
};

/* Measures all dispatches of the device from here on; `watch` stays the caller's until the end. */
void gpu_watch_begin(struct gpu_device *device, struct gpu_watch *watch);
void gpu_watch_end(struct gpu_device *device); /* its figures stay */

/* Hooks of program.c around a dispatch; nothing happens while no dispatch is measured. */
void gpu_watch_before(struct gpu_device *device);
void gpu_watch_after(struct gpu_device *device, unsigned program);

#endif
