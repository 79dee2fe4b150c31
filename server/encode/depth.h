/* SPDX-License-Identifier: MIT */
/* Depths for the wire: rounded inverses, within a bound in pixels (protocol/pixels/inverse_depth.h). */
#ifndef FARLIGHT_ENCODE_DEPTH_H
#define FARLIGHT_ENCODE_DEPTH_H

#include "base/error.h"

#include <stddef.h>
#include <stdint.h>

struct depth_picture {
    const float *depths; /* metres; 0: no surface */
    uint32_t width, height;
    float fov_y;          /* 0: orthographic */
    float pixels, radius; /* bound of the error */
};

/* Rounds depths. *rounded: malloc'ed, multiples of *step, 1 / metres; NULL: this picture cannot be rounded, and
 * is sent in metres. False: there is no memory. */
bool depth_round(const struct depth_picture *picture, uint16_t **rounded, float *step, struct error *error);

/* Encodes rounded depths as protocol/pixels/coarse_depth.h describes. *out: malloc'ed. */
bool depth_encode_coarse(const uint16_t *rounded, uint32_t width, uint32_t height, uint8_t **out,
                         size_t *out_bytes, struct error *error);

#endif
