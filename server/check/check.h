/* SPDX-License-Identifier: MIT */
/* Device check (farlightd --check-device): tests a device before anybody relies on it. */
#ifndef FARLIGHT_CHECK_CHECK_H
#define FARLIGHT_CHECK_CHECK_H

#include "gpu/device.h"

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

struct check_options {
    struct gpu_options gpu;
    uint64_t device_bytes_limit; /* configured limit; 0: none */
    FILE *stream;                /* receives the rows */
    bool json;
};

enum check_outcome {
    CHECK_ALL_HOLDS,
    CHECK_SOME_FAIL,
    CHECK_DEVICE_LOST /* the device was lost on the way; the next run may differ */
};

/* Opens the device and leaves nothing open. Every program needed is compiled, none is read from the disk. */
enum check_outcome check_device(const struct check_options *options);

#endif
