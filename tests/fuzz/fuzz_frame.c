/* SPDX-License-Identifier: MIT */
/* Any frame of a view, as a client takes it: what is whole is decoded, and what it says of itself holds.
 * Input: u16 size of frame_begin's payload, that payload, the bytes of the frame. */
#include "lib/frame.h"
#include "protocol/codec.h"
#include "tests/fuzz/fuzz.h"
#include "tests/unit/protocol/cases.h"

#include <math.h>

#define PIXELS_MAX 4096u /* larger frames take long and are no different */

static uint8_t scratch_memory[SCRATCH_BYTES];

static bool take_begin(const uint8_t *data, size_t size, size_t *used, struct message *message)
{
    struct scratch scratch;
    struct decode_error error;
    if (size < 2)
        return false;
    const size_t payload = (size_t)data[0] | (size_t)data[1] << 8;
    *used = payload + 2;
    scratch_init(&scratch, scratch_memory, sizeof(scratch_memory));
    return *used <= size && message_decode(message, MESSAGE_FRAME_BEGIN, data + 2, payload, &scratch, &error) &&
           (uint64_t)message->frame_begin.width * message->frame_begin.height <= PIXELS_MAX;
}

/* As a viewer asks; of what is free as the frame says, so that more than its first field is looked at. */
static struct fl_frame_expected expect(const struct message_frame_begin *begin)
{
    return (struct fl_frame_expected){.width = PIXELS_MAX,
                                      .height = PIXELS_MAX,
                                      .format = begin->format,
                                      .encoding = begin->encoding,
                                      .still_encoding = begin->encoding,
                                      .layers = 1,
                                      .attachments = begin->attachments,
                                      .is_view = true,
                                      .margin_x_max = 64,
                                      .margin_y_max = 64,
                                      .hidden_layers = 2};
}

/* The share of a pixel is that of the first one of its block. */
static bool whole_blocks(const struct fl_frame *frame)
{
    for (uint32_t y = 0; frame->sticking && y < frame->height; y++)
        for (uint32_t x = 0; x < frame->width; x++)
            if (frame->sticking[y * frame->width + x] != frame->sticking[(y & ~3u) * frame->width + (x & ~3u)])
                return false;
    return true;
}

static void check(const struct fl_frame *frame)
{
    const size_t count = (size_t)frame->width * frame->height;
    FUZZ_REQUIRE(frame->width > 2 * frame->margin_x && frame->height > 2 * frame->margin_y);
    FUZZ_REQUIRE(frame->hidden_layer <= 2 && (frame->hidden_layer == 0 || frame->of_frame < frame->frame));
    FUZZ_REQUIRE(!(frame->depth_step > 0.0f) || frame->depth);
    FUZZ_REQUIRE(whole_blocks(frame));
    FUZZ_REQUIRE((frame->encoded != NULL) != (frame->pixels != NULL));
    for (size_t i = 0; frame->depth && frame->depth_step > 0.0f && i < count; i++) {
        const double steps =
            frame->depth[i] > 0.0f ? 1.0 / (double)frame->depth[i] / (double)frame->depth_step : 0.0;
        FUZZ_REQUIRE(frame->depth[i] >= 0.0f && !(steps > 65535.5));
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct message message;
    struct fl_error error = {0};
    size_t used = 0;
    if (!take_begin(data, size, &used, &message))
        return 0;
    const struct message_frame_begin *begin = &message.frame_begin;
    const size_t left = size - used, half = left / 2;
    struct fl_assembly assembly = {.expected = expect(begin)};
    const struct message_frame_data first = {.data = data + used, .data_bytes = (uint32_t)half};
    const struct message_frame_data second = {
        .offset_bytes = half, .data = data + used + half, .data_bytes = (uint32_t)(left - half)};
    const struct message_frame_end end = {.frame = begin->frame};
    struct fl_frame *frame = NULL;
    const bool whole =
        fl_assembly_begin(&assembly, begin, 0, 0, &error) && fl_assembly_data(&assembly, &first, &error) &&
        fl_assembly_data(&assembly, &second, &error) && (frame = fl_assembly_end(&assembly, &end, 0, &error));
    FUZZ_REQUIRE(whole || error.code != FL_ERROR_NONE);
    if (frame)
        check(frame);
    fl_frame_destroy(frame);
    fl_assembly_finish(&assembly);
    return 0;
}
