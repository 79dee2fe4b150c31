/* SPDX-License-Identifier: MIT */
/* The encoding `predicted`: each byte less the one that its neighbours foretell. The protocol's document describes
 * it. */
#ifndef FARLIGHT_CLIENT_LIB_PREDICTED_H
#define FARLIGHT_CLIENT_LIB_PREDICTED_H

#include "lib/farlight.h"

struct fl_predicted {
    uint32_t width, rows; /* at least 1 each */
    uint32_t pixel_bytes; /* 4, 8 or 16 */
    const uint8_t *encoded;
    size_t encoded_bytes;
};

/* Fills width * rows * pixel_bytes bytes. False: FL_ERROR_PROTOCOL, it is not that many; or FL_ERROR_MEMORY. */
bool fl_predicted_decode(const struct fl_predicted *predicted, uint8_t *pixels, struct fl_error *error);

#endif
