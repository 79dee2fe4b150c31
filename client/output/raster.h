/* SPDX-License-Identifier: MIT */
/* Pixels of a picture for an image file. */
#ifndef FARLIGHT_CLIENT_OUTPUT_RASTER_H
#define FARLIGHT_CLIENT_OUTPUT_RASTER_H

#include <stdint.h>

struct raster {
    uint32_t width, height;
    unsigned channels;        /* red, green, blue, and alpha if there are four */
    unsigned component_bytes; /* 1: 0 to 255; 2: half floats; 4: floats */
    const void *pixels;       /* rows from the top, without gaps */
};

#endif
