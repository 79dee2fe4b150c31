/* SPDX-License-Identifier: MIT */
/* Encoding of pixels as the bytes of a JPEG file, in memory. */
#ifndef FARLIGHT_CLIENT_OUTPUT_JPEG_ENCODE_H
#define FARLIGHT_CLIENT_OUTPUT_JPEG_ENCODE_H

#include "raster.h"

#include <stdbool.h>
#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

struct jpeg {
    struct raster raster;    /* bytes, sRGB; alpha is dropped */
    unsigned quality;        /* 1 to 100 */
    const char *description; /* comment and Exif description; "": none */
    const char *date;        /* Exif date "YYYY:MM:DD hh:mm:ss"; "": none */
};

/* *file is malloc'ed. False: `reason` is set. */
bool jpeg_encode(const struct jpeg *jpeg, uint8_t **file, size_t *file_bytes, char *reason, size_t reason_bytes);

#ifdef __cplusplus
}
#endif

#endif
