/* SPDX-License-Identifier: MIT */
#include "encode/depth.h"

#include "protocol/pixels/inverse_depth.h"

#include <stdlib.h>

bool depth_round(const struct depth_picture *picture, uint16_t **rounded, float *step, struct error *error)
{
    const size_t count = (size_t)picture->width * picture->height;
    *rounded = NULL;
    *step = 0.0f;
    if (!(picture->fov_y > 0.0f))
        return true;
    const float wanted = inverse_depth_step(picture->pixels, picture->radius, picture->height, picture->fov_y);
    uint16_t *made = malloc(count * sizeof(*made));
    if (!made)
        return error_set(error, ERROR_OUT_OF_MEMORY, "encoding", "out of memory for the depths of a frame");
    if (inverse_depth_round(picture->depths, count, wanted, made)) {
        *rounded = made;
        *step = wanted;
    } else {
        free(made);
    }
    return true;
}
