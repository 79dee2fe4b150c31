/* SPDX-License-Identifier: MIT */
/* Rasterised first hits beside traced ones, on this device. */
#ifndef FARLIGHT_CHECK_FIRST_HITS_H
#define FARLIGHT_CHECK_FIRST_HITS_H

#include "base/error.h"
#include "gpu/device.h"

#include <stdbool.h>
#include <stdint.h>

enum first_hits_way { FIRST_HITS_RASTERISED, FIRST_HITS_TRACED };

struct first_hits {
    uint64_t ns[2][2]; /* of a sample of every pixel, where there is one, where there are several; by way */
    uint64_t few_ns;   /* to rasterise hardly any primitives */
    uint64_t primitives, pixels;
    double agree; /* share of the pixels that are as deep either way */
};

/* Takes some frames of 65,536 triangles, and of few, and what they compile. */
bool first_hits_measure(struct gpu_device *device, struct first_hits *measured, struct error *error);
/* Where nothing is known of the device, and it is no software GL: decides by these, also at the next start. False:
 * there is nowhere to keep that. */
bool first_hits_keep(struct gpu_device *device, const struct first_hits *measured);
/* Where nothing is known of the device, and it is no software GL: measures, and keeps what it finds.
 * A failure is a line in the log, and first hits are rasterised. */
void first_hits_decide(struct gpu_device *device);
/* Not known, where the device has no time stamps. Pure. */
struct gpu_measured first_hits_limits(const struct first_hits *measured);

#endif
