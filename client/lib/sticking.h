/* SPDX-License-Identifier: MIT */
/* Decoding of the share of a pixel's colour that moves with the eye, not with the surface (a reflection). */
#ifndef FARLIGHT_CLIENT_LIB_STICKING_H
#define FARLIGHT_CLIENT_LIB_STICKING_H

#include "lib/farlight.h"

/* Decodes width * height pixels, malloc'ed. NULL and *error: the bytes are malformed, or there is no memory. */
uint8_t *fl_sticking_decode(const uint8_t *encoded, uint64_t encoded_bytes, uint32_t width, uint32_t height,
                            struct fl_error *error);

#endif
