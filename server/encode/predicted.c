/* SPDX-License-Identifier: MIT */
/* Lossless pictures by prediction from neighbours (protocol/pixels). */
#include "encode/encoder.h"
#include "protocol/pixels/predicted.h"

static struct predicted_form form_of(const struct picture *picture)
{
    return (struct predicted_form){picture->width, picture->height, picture->bytes_per_pixel};
}

static size_t bound(const struct picture *picture)
{
    struct predicted_form form = form_of(picture);
    return predicted_bound(&form);
}

static size_t encode(const struct picture *picture, unsigned quality, uint8_t *out, size_t capacity,
                     struct error *error)
{
    const struct predicted_source source = {
        .form = form_of(picture),
        .pixels = picture->pixels,
        .level = quality,
        .is_given_up = picture->is_given_up,
        .context = picture->given_up_context,
    };
    struct predicted_result result = predicted_encode(&source, out, capacity);
    if (result.status == PREDICTED_NO_MEMORY)
        error_set(error, ERROR_OUT_OF_MEMORY, "encoding", "no memory to encode a frame with");
    else if (result.status == PREDICTED_GIVEN_UP)
        encoder_given_up(error);
    else if (result.status == PREDICTED_FAILED)
        error_set(error, ERROR_INTERNAL, "encoding", "predicted: %s", result.reason);
    return result.bytes;
}

const struct encoder_impl encoder_predicted_impl = {.name = "predicted", .bound = bound, .encode = encode};
