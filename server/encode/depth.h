/* SPDX-License-Identifier: MIT */
/* Depths as they travel: rounded inverses, within a bound in pixels (protocol/pixels/inverse_depth.h). */
#ifndef FARLIGHT_ENCODE_DEPTH_H
#define FARLIGHT_ENCODE_DEPTH_H

#include "base/error.h"

#include <stddef.h>
#include <stdint.h>

struct depth_picture {
    const float *depths; /* metres; 0: nothing is there */
    uint32_t width, height;
    float fov_y;          /* 0: orthographic */
    float pixels, radius; /* the bound */
};

/* *rounded: malloc'ed, multiples of *step, 1 / metres; NULL: such a picture cannot have that, and has metres.
 * False: there is no memory. */
bool depth_round(const struct depth_picture *picture, uint16_t **rounded, float *step, struct error *error);

/* *out: malloc'ed, what protocol/pixels/coarse_depth.h makes of rounded depths. */
bool depth_encode_coarse(const uint16_t *rounded, uint32_t width, uint32_t height, uint8_t **out,
                         size_t *out_bytes, struct error *error);

#endif
