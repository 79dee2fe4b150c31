/* SPDX-License-Identifier: MIT */
/* Pixels to the bytes of a PNG file, in memory. */
#ifndef FARLIGHT_CLIENT_OUTPUT_PNG_ENCODE_H
#define FARLIGHT_CLIENT_OUTPUT_PNG_ENCODE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <time.h>

#ifdef __cplusplus
extern "C" {
#endif

struct png_text {
    const char *key, *text;
};

struct png {
    uint32_t width, height;
    unsigned channels;     /* 3, or 4 with straight alpha */
    bool other_display;    /* colours are of a display that may not be sRGB */
    const uint8_t *pixels; /* sRGB, rows from the top, without gaps */
    const struct png_text *texts;
    size_t text_count;
    const struct tm *date; /* may be NULL */
};

/* *file is malloc'ed. False: `reason` says why. */
bool png_encode(const struct png *png, uint8_t **file, size_t *file_bytes, char *reason, size_t reason_bytes);

#ifdef __cplusplus
}
#endif

#endif
