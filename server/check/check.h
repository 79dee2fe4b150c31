/* SPDX-License-Identifier: MIT */
/* farlightd --check-device: looks a device over before anybody relies on it. */
#ifndef FARLIGHT_CHECK_CHECK_H
#define FARLIGHT_CHECK_CHECK_H

#include "gpu/device.h"

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

struct check_options {
    struct gpu_options gpu;
    uint64_t device_bytes_limit; /* that is configured; 0: none is */
    FILE *stream;                /* gets the rows */
    bool json;
};

enum check_outcome {
    CHECK_ALL_HOLDS,
    CHECK_SOME_FAIL,
    CHECK_DEVICE_LOST /* the device was lost on the way; the next time may be different */
};

/* Opens the device and leaves nothing open. Every program that is needed is compiled, none is taken from the disk.
 */
enum check_outcome check_device(const struct check_options *options);

#endif
