/* SPDX-License-Identifier: MIT */
/* Pixels to the bytes of a JPEG file, in memory. */
#ifndef FARLIGHT_CLIENT_OUTPUT_JPEG_ENCODE_H
#define FARLIGHT_CLIENT_OUTPUT_JPEG_ENCODE_H

#include "raster.h"

#include <stdbool.h>
#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

struct jpeg {
    struct raster raster;    /* of bytes, sRGB; alpha is left out */
    unsigned quality;        /* 1 to 100 */
    const char *description; /* a comment, and Exif's; "": none */
    const char *date;        /* "YYYY:MM:DD hh:mm:ss", Exif's; "": none */
};

/* *file is malloc'ed. False: `reason` says why. */
bool jpeg_encode(const struct jpeg *jpeg, uint8_t **file, size_t *file_bytes, char *reason, size_t reason_bytes);

#ifdef __cplusplus
}
#endif

#endif
