/* SPDX-License-Identifier: MIT */
/* What was measured on a device, so that it is measured once: kept on the disk beside the programs, under the
 * driver's vendor, renderer and version and that of the daemon. */
#ifndef FARLIGHT_GPU_MEASURED_H
#define FARLIGHT_GPU_MEASURED_H

#include <stdbool.h>
#include <stdint.h>

struct gpu_device_info;

struct gpu_measured {
    bool known;
    /* From so many primitives a pixel on first hits are found clearly faster by tracing than by rasterising: with
     * one sample a pixel, with several. Rasterising takes time for each primitive, tracing hardly any. */
    float traced_from[2];
    uint64_t primitives_min; /* where there are fewer in all they are rasterised */
};

/* False: nothing is known of the device. Of software GL nothing is ever measured, so that its pictures do not
 * depend on what a machine was found to be: there is a rule. */
bool gpu_measured_load(const struct gpu_device_info *info, struct gpu_measured *measured);
/* False: there is no cache that can be written. */
bool gpu_measured_store(const struct gpu_device_info *info, const struct gpu_measured *measured);
/* Whether first hits are traced, where that is left to the device. */
bool gpu_measured_traces(const struct gpu_measured *measured, bool several_samples, uint64_t primitives,
                         uint64_t pixels);

#endif
