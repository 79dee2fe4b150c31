/* SPDX-License-Identifier: MIT */
/* Any frame of a view, as a client takes it: what is whole is decoded, and what it says of itself holds.
 * Input: u16 size of frame_begin's payload, plus IN_PARTS if it is in parts, that payload, likewise of frame_parts
 * if it is, and the bytes of the frame, or the first ones. */
#include "lib/frame.h"
#include "protocol/codec.h"
#include "tests/fuzz/fuzz.h"
#include "tests/unit/protocol/cases.h"

#include <math.h>

#define PIXELS_MAX 4096u /* larger frames take long and are no different */

#define IN_PARTS 0x8000u

static uint8_t scratch_memory[SCRATCH_BYTES];

struct input {
    const uint8_t *data;
    size_t size;
};

static bool take_message(struct input *input, uint16_t type, bool *in_parts, struct message *message)
{
    struct scratch scratch;
    struct decode_error error;
    if (input->size < 2)
        return false;
    const size_t number = (size_t)input->data[0] | (size_t)input->data[1] << 8, payload = number & ~IN_PARTS;
    const uint8_t *start = input->data + 2;
    if (payload > input->size - 2)
        return false;
    *in_parts = (number & IN_PARTS) != 0;
    input->data += 2 + payload;
    input->size -= 2 + payload;
    scratch_init(&scratch, scratch_memory, sizeof(scratch_memory));
    return message_decode(message, type, start, payload, &scratch, &error);
}

/* A viewer's expectation; open values follow the frame, so that more than its first field is read. */
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
                                      .hidden_layers = 2,
                                      .parts = true};
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
    FUZZ_REQUIRE(frame->parts_come > 0 && frame->parts_come <= frame->parts);
    FUZZ_REQUIRE(!frame->depth_is_coarse || (frame->parts_come < frame->parts && frame->depth_step > 0.0f));
    FUZZ_REQUIRE(whole_blocks(frame));
    FUZZ_REQUIRE((frame->encoded != NULL) != (frame->pixels != NULL));
    for (size_t i = 0; frame->depth && frame->depth_step > 0.0f && i < count; i++) {
        const double steps =
            frame->depth[i] > 0.0f ? 1.0 / (double)frame->depth[i] / (double)frame->depth_step : 0.0;
        FUZZ_REQUIRE(frame->depth[i] >= 0.0f && !(steps > 65535.5));
    }
}

static void check_first_parts(const struct fl_assembly *assembly)
{
    struct fl_error error = {0};
    if (!fl_assembly_has_first_parts(assembly))
        return;
    struct fl_frame *frame = fl_assembly_show(assembly, 0, &error);
    FUZZ_REQUIRE(frame || error.code != FL_ERROR_NONE);
    if (frame)
        check(frame);
    fl_frame_destroy(frame);
}

static bool give(struct fl_assembly *assembly, uint64_t offset_bytes, const struct input *input,
                 struct fl_error *error)
{
    const struct message_frame_data data = {
        .offset_bytes = offset_bytes, .data = input->data, .data_bytes = (uint32_t)input->size};
    return fl_assembly_data(assembly, &data, error);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct message begun, told;
    struct input input = {data, size};
    struct fl_error error = {0};
    bool in_parts, ignored;
    const struct message_frame_begin *begin = &begun.frame_begin;
    if (!take_message(&input, MESSAGE_FRAME_BEGIN, &in_parts, &begun) ||
        (uint64_t)begin->width * begin->height > PIXELS_MAX ||
        (in_parts && !take_message(&input, MESSAGE_FRAME_PARTS, &ignored, &told)))
        return 0;
    const struct input first = {input.data, input.size / 2};
    const struct input second = {input.data + first.size, input.size - first.size};
    struct fl_assembly assembly = {.expected = expect(begin)};
    struct fl_frame *frame = NULL;
    bool good = fl_assembly_begin(&assembly, begin, 0, 0, &error) &&
                (!in_parts || fl_assembly_parts(&assembly, &told.frame_parts, &error)) &&
                give(&assembly, 0, &first, &error);
    if (good)
        check_first_parts(&assembly);
    good = good && give(&assembly, first.size, &second, &error);
    if (good) {
        const bool is_cut = in_parts && assembly.received_bytes < assembly.encoded_bytes;
        const struct message_frame_end end = {.frame = begin->frame, .abandoned = is_cut};
        frame = fl_assembly_end(&assembly, &end, 0, &error);
    }
    FUZZ_REQUIRE(frame || error.code != FL_ERROR_NONE);
    if (frame)
        check(frame);
    fl_frame_destroy(frame);
    fl_assembly_finish(&assembly);
    return 0;
}
