/* SPDX-License-Identifier: MIT */
/* Encoders of depth. */
#include "encode/depth.h"

#include "protocol/pixels/coarse_depth.h"
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

bool depth_encode_coarse(const uint16_t *rounded, uint32_t width, uint32_t height, uint8_t **out,
                         size_t *out_bytes, struct error *error)
{
    const struct predicted_source source = {
        .form = {width, height, sizeof(*rounded)}, .pixels = (const uint8_t *)rounded, .level = 1};
    const size_t capacity = coarse_depth_bound(width, height);
    *out = capacity ? malloc(capacity) : NULL;
    if (!*out)
        return error_set(error, ERROR_OUT_OF_MEMORY, "encoding", "out of memory for the coarse depths of a frame");
    const struct predicted_result result = coarse_depth_encode(&source, *out, capacity);
    *out_bytes = result.bytes;
    if (result.status == PREDICTED_DONE)
        return true;
    free(*out);
    *out = NULL;
    return error_set(error, ERROR_INTERNAL, "encoding", "coarse depths: %s", result.reason);
}
