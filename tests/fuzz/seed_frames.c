/* SPDX-License-Identifier: MIT */
#include "tests/fuzz/seed_frames.h"

#include "protocol/codec.h"
#include "protocol/pixels/coarse_depth.h"
#include "protocol/pixels/predicted.h"

#include <string.h>
#include <turbojpeg.h>
#include <xxhash.h>
#include <zstd.h>

/* A picture of 8x4 in each of some encodings, with depth in both forms, one with what sticks. */
static bool write_frame(const char *folder, int number, enum protocol_encoding encoding, bool inverse)
{
    enum { WIDTH = 8, HEIGHT = 4, COUNT = WIDTH * HEIGHT };
    static const struct predicted_form rgba = {WIDTH, HEIGHT, 4}, rounded = {WIDTH, HEIGHT, 2};
    uint8_t pixels[4 * COUNT], depth[4 * COUNT], bytes[2048];
    for (size_t i = 0; i < sizeof(pixels); i++)
        pixels[i] = (uint8_t)(i * 5);
    for (size_t i = 0; i < sizeof(depth); i++)
        depth[i] = (uint8_t)(inverse ? i % 2 ? 0 : i : i % 4 == 3 ? 0x3f : 0x80);
    struct message message = {.type = MESSAGE_FRAME_BEGIN};
    message_init(&message, MESSAGE_FRAME_BEGIN);
    struct message_frame_begin *begin = &message.frame_begin;
    begin->frame = 7;
    begin->width = WIDTH;
    begin->height = HEIGHT;
    begin->encoding = encoding;
    begin->digest = XXH3_64bits(pixels, sizeof(pixels));
    begin->attachments = 1;
    begin->depth_form = inverse ? PROTOCOL_DEPTH_FORM_INVERSE : PROTOCOL_DEPTH_FORM_METRES;
    begin->depth_step = inverse ? 0.01f : 0.0f;
    begin->margin_x = begin->margin_y = 1;
    begin->hidden_layer = (uint32_t)number % 3;
    begin->of_frame = begin->hidden_layer ? 6 : 0;
    uint8_t encoded[1024];
    size_t used = sizeof(pixels);
    memcpy(encoded, pixels, used);
    if (encoding == PROTOCOL_ENCODING_PREDICTED)
        used =
            predicted_encode(&(struct predicted_source){.form = rgba, .pixels = pixels, .level = 1}, encoded, 512)
                .bytes;
    begin->size_bytes = used;
    begin->depth_bytes =
        predicted_encode(&(struct predicted_source){.form = inverse ? rounded : rgba, .pixels = depth, .level = 1},
                         encoded + used, sizeof(encoded) - used)
            .bytes;
    used += begin->depth_bytes;
    if (number == 2) {
        const uint8_t blocks[2] = {7, 3};
        begin->attachments |= 4;
        begin->sticking_bytes = ZSTD_compress(encoded + used, sizeof(encoded) - used, blocks, sizeof(blocks), 1);
        used += begin->sticking_bytes;
    }
    struct writer writer;
    writer_init(&writer, bytes + 2, sizeof(bytes) - 2 - used);
    if (!message_encode(&writer, &message))
        return false;
    bytes[0] = (uint8_t)writer.used_bytes;
    bytes[1] = (uint8_t)(writer.used_bytes >> 8);
    memcpy(bytes + 2 + writer.used_bytes, encoded, used);
    return seed_write_file(folder, "frame", "frame", number, bytes, 2 + writer.used_bytes + used);
}

enum { PARTS_WIDTH = 16, PARTS_HEIGHT = 16, PARTS_TEXELS = PARTS_WIDTH * PARTS_HEIGHT };

/* Where the second scan of a JPEG in scans begins with its table. */
static size_t first_scans_end(const uint8_t *jpeg, size_t bytes)
{
    size_t at = 0;
    while (at + 1 < bytes && !(jpeg[at] == 0xff && jpeg[at + 1] == 0xda))
        at++;
    while (at + 1 < bytes && !(jpeg[at] == 0xff && jpeg[at + 1] == 0xc4))
        at++;
    return at;
}

static size_t pack(const void *from, uint32_t pixel_bytes, uint8_t *out, size_t capacity)
{
    const struct predicted_form form = {PARTS_WIDTH, PARTS_HEIGHT, pixel_bytes};
    return predicted_encode(&(struct predicted_source){.form = form, .pixels = from, .level = 1}, out, capacity)
        .bytes;
}

/* The bytes of each kind, and all of them in the order of the records. */
static bool make_parts(struct message_frame_begin *begin, struct record_frame_part records[5], uint8_t *out,
                       size_t capacity, size_t *used)
{
    uint8_t pixels[4 * PARTS_TEXELS], *jpeg = NULL;
    uint16_t depth[PARTS_TEXELS];
    for (size_t i = 0; i < sizeof(pixels); i++)
        pixels[i] = (uint8_t)(i * i / 7);
    for (size_t i = 0; i < PARTS_TEXELS; i++)
        depth[i] = (uint16_t)(i % PARTS_WIDTH > 7 ? 90 : 30 + i / PARTS_WIDTH);
    tjhandle encoder = tjInitCompress();
    unsigned long bytes = 0;
    if (!encoder || tjCompress2(encoder, pixels, PARTS_WIDTH, 0, PARTS_HEIGHT, TJPF_RGBX, &jpeg, &bytes,
                                TJSAMP_420, 50, TJFLAG_PROGRESSIVE))
        return false;
    const struct predicted_source source = {
        .form = {PARTS_WIDTH, PARTS_HEIGHT, 2}, .pixels = (const uint8_t *)depth, .level = 1};
    const size_t first = first_scans_end(jpeg, bytes);
    memcpy(out, jpeg, first);
    size_t at = first;
    const size_t coarse = coarse_depth_encode(&source, out + at, capacity - at).bytes;
    at += coarse;
    memcpy(out + at, jpeg + first, bytes - first);
    at += bytes - first;
    begin->size_bytes = bytes;
    begin->depth_bytes = pack(depth, 2, out + at, capacity - at);
    at += begin->depth_bytes;
    begin->normal_bytes = pack(pixels, 4, out + at, capacity - at);
    *used = at + begin->normal_bytes;
    const struct record_frame_part made[5] = {{PROTOCOL_FRAME_PART_COLOURS, first},
                                              {PROTOCOL_FRAME_PART_COARSE_DEPTH, coarse},
                                              {PROTOCOL_FRAME_PART_COLOURS, bytes - first},
                                              {PROTOCOL_FRAME_PART_DEPTH, begin->depth_bytes},
                                              {PROTOCOL_FRAME_PART_NORMALS, begin->normal_bytes}};
    memcpy(records, made, sizeof(made));
    tjFree(jpeg);
    tjDestroy(encoder);
    return true;
}

/* With its size before it. */
static size_t put_sized(uint8_t *out, size_t capacity, const struct message *message, unsigned flag)
{
    struct writer writer;
    writer_init(&writer, out + 2, capacity - 2);
    if (!message_encode(&writer, message))
        return 0;
    out[0] = (uint8_t)writer.used_bytes;
    out[1] = (uint8_t)(writer.used_bytes >> 8 | flag);
    return 2 + writer.used_bytes;
}

enum parts_fault { PARTS_SOUND, PARTS_HUGE, PARTS_ALL_COARSE, PARTS_WITHOUT_COLOURS, PARTS_FAULTS };

/* The first `come` of its parts. */
static bool write_parts(const char *folder, int number, uint32_t come, enum parts_fault fault)
{
    enum { IN_PARTS = 0x80 };
    uint8_t bytes[8192], encoded[4096];
    struct message begin, parts;
    struct record_frame_part records[5];
    size_t all = 0, cut = 0;
    message_init(&begin, MESSAGE_FRAME_BEGIN);
    message_init(&parts, MESSAGE_FRAME_PARTS);
    begin.frame_begin.width = PARTS_WIDTH;
    begin.frame_begin.height = PARTS_HEIGHT;
    begin.frame_begin.encoding = PROTOCOL_ENCODING_JPEG;
    begin.frame_begin.attachments = 3;
    begin.frame_begin.depth_form = PROTOCOL_DEPTH_FORM_INVERSE;
    begin.frame_begin.depth_step = 0.01f;
    if (!make_parts(&begin.frame_begin, records, encoded, sizeof(encoded), &all))
        return false;
    for (uint32_t i = 0; i < come; i++)
        cut += (size_t)records[i].size_bytes;
    for (uint32_t i = 0; i < 5; i++)
        records[i].kind = fault == PARTS_ALL_COARSE ? PROTOCOL_FRAME_PART_COARSE_DEPTH : records[i].kind;
    if (fault == PARTS_HUGE)
        records[1].size_bytes = UINT64_C(1) << 32;
    parts.frame_parts.parts = records + (fault == PARTS_WITHOUT_COLOURS);
    parts.frame_parts.parts_count = 5 - (fault == PARTS_WITHOUT_COLOURS);
    const size_t first = put_sized(bytes, sizeof(bytes), &begin, IN_PARTS);
    const size_t second = first ? put_sized(bytes + first, sizeof(bytes) - first, &parts, 0) : 0;
    if (!second || first + second + cut > sizeof(bytes))
        return false;
    memcpy(bytes + first + second, encoded, cut);
    return seed_write_file(folder, "frame", "parts", number, bytes, first + second + cut);
}

bool seed_write_frames(const char *folder)
{
    for (uint32_t come = 1; come <= 5; come++)
        if (!write_parts(folder, (int)come, come, PARTS_SOUND))
            return false;
    for (enum parts_fault fault = PARTS_HUGE; fault < PARTS_FAULTS; fault++)
        if (!write_parts(folder, 5 + (int)fault, 5, fault))
            return false;
    return write_frame(folder, 0, PROTOCOL_ENCODING_RAW, false) &&
           write_frame(folder, 1, PROTOCOL_ENCODING_RAW, true) &&
           write_frame(folder, 2, PROTOCOL_ENCODING_PREDICTED, true);
}
