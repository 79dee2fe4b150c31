/* SPDX-License-Identifier: MIT */
#include "lib/predicted.h"

#include <stdlib.h>
#include <zstd.h>

static inline uint8_t predict(uint8_t left, uint8_t above, uint8_t above_left)
{
    const uint8_t least = left < above ? left : above;
    const uint8_t greatest = left < above ? above : left;
    const uint8_t third = above_left > greatest ? greatest : above_left < least ? least : above_left;
    return (uint8_t)(least + greatest - third);
}

/* All channels of a row in one go: each byte waits for the one left of it, but not for those beside that. Inlined
 * where `step` is known. */
static inline __attribute__((always_inline)) void add_row(uint8_t *pixels, const uint8_t *above,
                                                          const uint8_t *residuals, size_t plane_bytes,
                                                          size_t width, size_t step)
{
    uint8_t left[16] = {0}, above_left[16] = {0};
    for (size_t x = 0; x < width; x++) {
        for (size_t c = 0; c < step; c++) {
            const uint8_t over = above[x * step + c];
            left[c] = (uint8_t)(residuals[c * plane_bytes + x] + predict(left[c], over, above_left[c]));
            above_left[c] = over;
            pixels[x * step + c] = left[c];
        }
    }
}

static void add_predictions(const struct fl_predicted *predicted, const uint8_t *residuals, const uint8_t *zeros,
                            uint8_t *pixels)
{
    const size_t width = predicted->width, step = predicted->pixel_bytes, plane_bytes = width * predicted->rows;
    const uint8_t *above = zeros;
    for (uint32_t y = 0; y < predicted->rows; y++, residuals += width) {
        if (step == 4)
            add_row(pixels, above, residuals, plane_bytes, width, 4);
        else if (step == 8)
            add_row(pixels, above, residuals, plane_bytes, width, 8);
        else
            add_row(pixels, above, residuals, plane_bytes, width, 16);
        above = pixels;
        pixels += width * step;
    }
}

bool fl_predicted_decode(const struct fl_predicted *predicted, uint8_t *pixels, struct fl_error *error)
{
    const size_t row_bytes = (size_t)predicted->width * predicted->pixel_bytes,
                 bytes = row_bytes * predicted->rows;
    uint8_t *residuals = malloc(bytes), *zeros = calloc(1, row_bytes);
    bool good = residuals != NULL && zeros != NULL;
    if (!good) {
        fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    } else {
        const size_t made = ZSTD_decompress(residuals, bytes, predicted->encoded, predicted->encoded_bytes);
        good = made == bytes;
        if (ZSTD_isError(made))
            fl_error_set(error, FL_ERROR_PROTOCOL, "frame", "not to be decompressed: %s", ZSTD_getErrorName(made));
        else if (!good)
            fl_error_set(error, FL_ERROR_PROTOCOL, "frame", "%zu bytes came out in place of %zu", made, bytes);
    }
    if (good)
        add_predictions(predicted, residuals, zeros, pixels);
    free(residuals);
    free(zeros);
    return good;
}
