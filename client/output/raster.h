/* SPDX-License-Identifier: MIT */
/* Pixels that are to become an image file. */
#ifndef FARLIGHT_CLIENT_OUTPUT_RASTER_H
#define FARLIGHT_CLIENT_OUTPUT_RASTER_H

#include <stdint.h>

struct raster {
    uint32_t width, height;
    unsigned channels;        /* of a pixel: red, green, blue, and alpha where there are four */
    unsigned component_bytes; /* 1: 0 to 255; 2: half floats; 4: floats */
    const void *pixels;       /* rows from the top, without gaps */
};

#endif
