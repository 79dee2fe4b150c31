/* SPDX-License-Identifier: MIT */
/* Comparison of rasterised and traced first hits, and of the kinds of nodes of bvh, on this device. */
#ifndef FARLIGHT_CHECK_FIRST_HITS_H
#define FARLIGHT_CHECK_FIRST_HITS_H

#include "base/error.h"
#include "gpu/device.h"

#include <stdbool.h>
#include <stdint.h>

enum first_hits_way { FIRST_HITS_RASTERISED, FIRST_HITS_TRACED };

struct first_hits {
    uint64_t ns[2][2]; /* time per pixel with one sample, with several; by way */
    uint64_t few_ns;   /* time to rasterise hardly any primitives */
    uint64_t primitives, pixels;
    uint64_t links_ns, eight_ns; /* time of rays that go apart, by nodes of bvh */
    double agree;                /* share of pixels with the same depth both ways */
};

/* Measures: takes some frames of 65,536 triangles, of few and of 262,144, and the compilation of their programs.
 */
bool first_hits_measure(struct gpu_device *device, struct first_hits *measured, struct error *error);
/* Decides by these measurements, also at the next start, if the device is unknown and no software GL. False:
 * they cannot be stored. */
bool first_hits_keep(struct gpu_device *device, const struct first_hits *measured);
/* Measures, and keeps the result, if the device is unknown and no software GL. A failure is a line in the log,
 * and first hits are rasterised. */
void first_hits_decide(struct gpu_device *device);
/* Limits that follow from the measurements; not known if the device has no time stamps. Pure. */
struct gpu_measured first_hits_limits(const struct first_hits *measured);

#endif
