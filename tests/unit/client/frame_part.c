/* SPDX-License-Identifier: MIT */
/* Parts of frames as frames of their own. */
#include "lib/frame_part.h"
#include "tests/harness/test.h"

#include <string.h>

TEST(a_part_has_its_pixels_of_every_layer_and_an_eye_of_its_own)
{
    /* Two layers of 4 x 2 pixels of 4 bytes: layer, row, column, 0. */
    uint8_t pixels[2 * 2 * 4 * 4];
    for (unsigned i = 0; i < 16; i++)
        memcpy(pixels + (size_t)4 * i, (uint8_t[]){(uint8_t)(i / 8), i / 4 % 2, i % 4, 0}, 4);
    struct fl_frame frame = {.width = 4,
                             .height = 2,
                             .format = PROTOCOL_PIXEL_FORMAT_RGBA8,
                             .layers = 3,
                             .pixels = pixels,
                             .pixels_bytes = sizeof(pixels),
                             .world_from_view = {0, 0, 1, 5, 0, 1, 0, 6, -1, 0, 0, 7}};
    const struct fl_frame_part part = {.x = 2, .y = 0, .width = 2, .height = 2, .eye = {0.5f, 0.25f}};
    struct fl_error error = {0};
    struct fl_frame *cut = fl_frame_cut(&frame, &part, &error);
    assert_non_null(cut);
    assert_int_equal(cut->pixels_bytes, sizeof(pixels) / 2);
    for (unsigned i = 0; i < 8; i++)
        assert_memory_equal(cut->pixels + (size_t)4 * i,
                            ((uint8_t[]){(uint8_t)(i / 4), i / 2 % 2, (uint8_t)(2 + i % 2), 0}), 4);
    assert_true(cut->world_from_view[3] == 5.0f && cut->world_from_view[7] == 6.25f &&
                cut->world_from_view[11] == 6.5f);
    fl_frame_destroy(cut);
    const struct fl_frame_part beyond = {.x = 3, .y = 0, .width = 2, .height = 2};
    assert_null(fl_frame_cut(&frame, &beyond, &error));
    assert_int_equal(error.code, FL_ERROR_ARGUMENT);
}
