/* SPDX-License-Identifier: MIT */
/* Measurements of a device, kept on the disk beside the programs so that they are made once, under the driver's
 * vendor, renderer and version and that of the daemon. */
#ifndef FARLIGHT_GPU_MEASURED_H
#define FARLIGHT_GPU_MEASURED_H

#include <stdbool.h>
#include <stdint.h>

struct gpu_device_info;

struct gpu_measured {
    bool known;
    /* Primitives per pixel from which tracing finds first hits clearly faster than rasterising: with one sample
     * per pixel, with several. Rasterising takes time for each primitive, tracing hardly any. */
    float traced_from[2];
    uint64_t primitives_min; /* with fewer in all they are rasterised */
    bool nodes_of_eight;     /* rays are clearly faster through nodes of eight children than through links */
};

/* Reads the measurements. False: none are known. Software GL has fixed rules and is never measured, so that its
 * pictures do not depend on the machine. */
bool gpu_measured_load(const struct gpu_device_info *info, struct gpu_measured *measured);
/* Writes the measurements. False: no cache is writable. */
bool gpu_measured_store(const struct gpu_device_info *info, const struct gpu_measured *measured);
/* Whether first hits are traced, where the device decides. */
bool gpu_measured_traces(const struct gpu_measured *measured, bool several_samples, uint64_t primitives,
                         uint64_t pixels);

#endif
