/* SPDX-License-Identifier: MIT */
/* How much of each pixel of a frame follows the eye, as it came. */
#ifndef FARLIGHT_CLIENT_LIB_STICKING_H
#define FARLIGHT_CLIENT_LIB_STICKING_H

#include "lib/farlight.h"

/* Of width * height pixels, malloc'ed; NULL and *error: that is not what the bytes hold, or there is no memory. */
uint8_t *fl_sticking_decode(const uint8_t *encoded, uint64_t encoded_bytes, uint32_t width, uint32_t height,
                            struct fl_error *error);

#endif
