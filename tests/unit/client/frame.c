/* SPDX-License-Identifier: MIT */
/* Messages of a hostile or broken daemon about a frame. */
#include "lib/frame.h"

#include "encode/encoder.h"
#include "encode/sticking.h"
#include "protocol/pixels/sticking.h"
#include "tests/harness/test.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <turbojpeg.h>
#include <xxhash.h>
#include <zstd.h>

#define WIDTH 40u
#define HEIGHT 24u
#define PIXELS_BYTES (WIDTH * HEIGHT * 4u)

static struct fl_error error;
static uint8_t pixels[PIXELS_BYTES];

static int fill_pixels(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof(pixels); i++)
        pixels[i] = i % 4 == 3 ? 255 : (uint8_t)(i / 64);
    return 0;
}

static struct fl_assembly some_assembly(enum protocol_encoding encoding)
{
    error = (struct fl_error){0};
    return (struct fl_assembly){
        .expected = {.width = WIDTH, .height = HEIGHT, .encoding = encoding, .layers = FL_LAYERS_PICTURE}};
}

static struct message_frame_begin some_begin(enum protocol_encoding encoding, uint64_t size_bytes)
{
    return (struct message_frame_begin){.frame = 3,
                                        .width = WIDTH,
                                        .height = HEIGHT,
                                        .samples = 1,
                                        .layers = 1,
                                        .size_bytes = size_bytes,
                                        .encoding = encoding,
                                        .digest = XXH3_64bits(pixels, sizeof(pixels))};
}

static bool begin(struct fl_assembly *assembly, const struct message_frame_begin *message)
{
    return fl_assembly_begin(assembly, message, 3, 1, &error);
}

static bool give(struct fl_assembly *assembly, const uint8_t *bytes, size_t count, uint64_t offset)
{
    const struct message_frame_data data = {.offset_bytes = offset, .data = bytes, .data_bytes = (uint32_t)count};
    return fl_assembly_data(assembly, &data, &error);
}

static struct fl_frame *end(struct fl_assembly *assembly)
{
    struct record_stage_time stage = {.stage = PROTOCOL_STAGE_TRACE, .duration_ns = 5};
    const struct message_frame_end message = {
        .frame = 3, .primary_rays = 960, .stages = &stage, .stages_count = 1};
    return fl_assembly_end(assembly, &message, 2, &error);
}

/* The whole way of one frame. */
static struct fl_frame *receive(enum protocol_encoding encoding, const uint8_t *bytes, size_t count)
{
    struct fl_assembly assembly = some_assembly(encoding);
    const struct message_frame_begin message = some_begin(encoding, count);
    struct fl_frame *frame = NULL;
    if (begin(&assembly, &message) && give(&assembly, bytes, count / 2, 0) &&
        give(&assembly, bytes + count / 2, count - count / 2, count / 2))
        frame = end(&assembly);
    fl_assembly_finish(&assembly);
    return frame;
}

static void expect_refused(enum protocol_encoding encoding, const uint8_t *bytes, size_t count)
{
    assert_null(receive(encoding, bytes, count));
    assert_int_equal(error.code, FL_ERROR_PROTOCOL);
}

/* The frame has the pixels that were sent. */
static void expect_exact(struct fl_frame *frame)
{
    assert_non_null(frame);
    assert_true(frame->digest_checked);
    assert_memory_equal(frame->pixels, pixels, sizeof(pixels));
}

/* Assembles a frame from one message with all of its bytes. */
static struct fl_frame *assemble(struct fl_assembly *assembly, const struct message_frame_begin *message,
                                 const uint8_t *bytes, size_t count)
{
    struct fl_frame *frame = begin(assembly, message) && give(assembly, bytes, count, 0) ? end(assembly) : NULL;
    fl_assembly_finish(assembly);
    return frame;
}

ALL_TESTS(fill_pixels, NULL)

TEST(a_raw_frame_arrives)
{
    struct fl_frame *frame = receive(PROTOCOL_ENCODING_RAW, pixels, sizeof(pixels));
    expect_exact(frame);
    assert_int_equal(frame->frame, 3);
    assert_int_equal(frame->primary_rays, 960);
    assert_int_equal(frame->stage_count, 1);
    assert_int_equal(frame->stages[0].duration_ns, 5);
    fl_frame_destroy(frame);
}

TEST(a_zstd_frame_arrives)
{
    uint8_t packed[2 * PIXELS_BYTES];
    const size_t count = ZSTD_compress(packed, sizeof(packed), pixels, sizeof(pixels), 1);
    assert_false(ZSTD_isError(count));
    struct fl_frame *frame = receive(PROTOCOL_ENCODING_ZSTD, packed, count);
    expect_exact(frame);
    fl_frame_destroy(frame);
}

static struct picture picture_of(const uint8_t *bytes)
{
    return (struct picture){.width = WIDTH, .height = HEIGHT, .bytes_per_pixel = 4, .pixels = bytes};
}

static size_t make_predicted(const struct picture *picture, uint8_t **packed)
{
    struct error failure = {0};
    size_t count;
    assert_true(encoder_encode(ENCODING_PREDICTED, picture, 1, packed, &count, &failure));
    return count;
}

TEST(a_predicted_frame_arrives_in_every_pixel_format)
{
    for (enum protocol_pixel_format format = 0; format < PROTOCOL_PIXEL_FORMAT_COUNT; format++) {
        /* The picture has equal bytes: fewer rows the larger its pixels are. */
        const uint32_t pixel_bytes = fl_bytes_per_pixel(format);
        const struct picture picture = {
            .width = WIDTH, .height = HEIGHT * 4 / pixel_bytes, .bytes_per_pixel = pixel_bytes, .pixels = pixels};
        struct fl_assembly assembly = some_assembly(PROTOCOL_ENCODING_PREDICTED);
        uint8_t *packed;
        const size_t count = make_predicted(&picture, &packed);
        struct message_frame_begin message = some_begin(PROTOCOL_ENCODING_PREDICTED, count);
        message.height = assembly.expected.height = picture.height;
        message.format = assembly.expected.format = format;
        struct fl_frame *frame = assemble(&assembly, &message, packed, count);
        expect_exact(frame);
        fl_frame_destroy(frame);
        free(packed);
    }
}

TEST(a_damaged_predicted_frame_is_refused)
{
    const struct picture picture = picture_of(pixels);
    struct picture smaller = picture;
    smaller.height--;
    uint8_t *packed;
    size_t count = make_predicted(&picture, &packed);
    expect_refused(PROTOCOL_ENCODING_PREDICTED, packed, count - 1);
    free(packed);
    count = make_predicted(&smaller, &packed);
    expect_refused(PROTOCOL_ENCODING_PREDICTED, packed, count);
    free(packed);
    uint8_t other[PIXELS_BYTES];
    memcpy(other, pixels, sizeof(other));
    other[77] ^= 1;
    struct picture changed = picture_of(other);
    count = make_predicted(&changed, &packed);
    assert_null(receive(PROTOCOL_ENCODING_PREDICTED, packed, count));
    assert_string_equal(error.field, "frame.digest");
    free(packed);
}

/* A frame with what is attached: *bytes is malloc'ed. */
static struct message_frame_begin make_attached(enum protocol_encoding encoding, unsigned attachments,
                                                const uint8_t *depth, const uint8_t *normals,
                                                const uint8_t *sticking, uint8_t **bytes)
{
    const enum encoding numbers[] = {ENCODING_RAW, ENCODING_ZSTD, ENCODING_JPEG, ENCODING_RAW, ENCODING_PREDICTED};
    const struct picture parts[3] = {picture_of(pixels), picture_of(depth), picture_of(normals)};
    size_t counts[4] = {0}, used = 0;
    *bytes = malloc(4 * PIXELS_BYTES);
    assert_non_null(*bytes);
    for (unsigned i = 0; i < 4; i++) {
        uint8_t *encoded = NULL;
        struct error failure = {0};
        if (i > 0 && (attachments & 1u << (i - 1)) == 0)
            continue;
        assert_true(i == 3 ? sticking_encode(sticking, 1, WIDTH, HEIGHT, &encoded, &counts[i], &failure)
                           : encoder_encode(i == 0 ? numbers[encoding] : ENCODING_PREDICTED, &parts[i], 1,
                                            &encoded, &counts[i], &failure));
        memcpy(*bytes + used, encoded, counts[i]);
        used += counts[i];
        free(encoded);
    }
    struct message_frame_begin message = some_begin(encoding, counts[0]);
    message.attachments = attachments;
    message.depth_bytes = counts[1];
    message.normal_bytes = counts[2];
    message.sticking_bytes = counts[3];
    return message;
}

TEST(what_is_attached_arrives_beside_any_encoding)
{
    float depth[WIDTH * HEIGHT];
    uint8_t normals[PIXELS_BYTES], sticking[WIDTH * HEIGHT];
    for (size_t i = 0; i < WIDTH * HEIGHT; i++) {
        depth[i] = 1.5f + (float)(i % WIDTH) / 7;
        sticking[i] = i % WIDTH < WIDTH / 2 ? 255 : 0; /* blocks of one share, which come as they are */
    }
    for (size_t i = 0; i < sizeof(normals); i++)
        normals[i] = (uint8_t)(i * 3);
    for (unsigned i = 0; i < 8 * PROTOCOL_ENCODING_COUNT; i++) {
        const enum protocol_encoding encoding = (enum protocol_encoding)(i / 8);
        struct fl_assembly assembly = some_assembly(encoding);
        assembly.expected.attachments = i % 8;
        uint8_t *bytes;
        const struct message_frame_begin message =
            make_attached(encoding, i % 8, (const uint8_t *)depth, normals, sticking, &bytes);
        const size_t count =
            (size_t)(message.size_bytes + message.depth_bytes + message.normal_bytes + message.sticking_bytes);
        struct fl_frame *frame = assemble(&assembly, &message, bytes, count);
        assert_non_null(frame);
        assert_int_equal(frame->wire_bytes, count);
        assert_int_equal(frame->depth != NULL, (i & FL_ATTACH_DEPTH) != 0);
        assert_int_equal(frame->normals != NULL, (i & FL_ATTACH_NORMALS) != 0);
        assert_int_equal(frame->sticking != NULL, (i & FL_ATTACH_STICKING) != 0);
        if (frame->sticking)
            assert_memory_equal(frame->sticking, sticking, sizeof(sticking));
        if (frame->depth)
            assert_memory_equal(frame->depth, depth, sizeof(depth));
        if (frame->normals)
            assert_memory_equal(frame->normals, normals, sizeof(normals));
        if (encoding == PROTOCOL_ENCODING_H264)
            assert_true(frame->encoded_bytes == sizeof(pixels) && !frame->pixels);
        else if (encoding != PROTOCOL_ENCODING_JPEG)
            assert_memory_equal(frame->pixels, pixels, sizeof(pixels));
        fl_frame_destroy(frame);
        free(bytes);
    }
}

/* Halves of a step, which 1 / depth of a quarter and of a half are; the third is nothing. */
static struct message_frame_begin make_inverse(uint8_t **bytes, size_t *count)
{
    uint16_t rounded[WIDTH * HEIGHT];
    for (size_t i = 0; i < WIDTH * HEIGHT; i++)
        rounded[i] = (uint16_t)(i % 3 == 2 ? 0 : 8 >> i % 3);
    struct picture depth = picture_of((const uint8_t *)rounded);
    depth.bytes_per_pixel = 2;
    uint8_t *encoded;
    size_t depth_bytes;
    struct error failure;
    assert_true(encoder_encode(ENCODING_PREDICTED, &depth, 1, &encoded, &depth_bytes, &failure));
    *count = PIXELS_BYTES + depth_bytes;
    *bytes = malloc(*count);
    assert_non_null(*bytes);
    memcpy(*bytes, pixels, PIXELS_BYTES);
    memcpy(*bytes + PIXELS_BYTES, encoded, depth_bytes);
    free(encoded);
    struct message_frame_begin message = some_begin(PROTOCOL_ENCODING_RAW, PIXELS_BYTES);
    message.attachments = FL_ATTACH_DEPTH;
    message.depth_bytes = depth_bytes;
    message.depth_form = PROTOCOL_DEPTH_FORM_INVERSE;
    message.depth_step = 0.5f;
    return message;
}

TEST(inverse_depths_arrive_in_metres)
{
    const float depths[3] = {0.25f, 0.5f, 0.0f};
    struct fl_assembly assembly = some_assembly(PROTOCOL_ENCODING_RAW);
    assembly.expected.attachments = FL_ATTACH_DEPTH;
    uint8_t *bytes;
    size_t count;
    const struct message_frame_begin message = make_inverse(&bytes, &count);
    struct fl_frame *frame = assemble(&assembly, &message, bytes, count);
    assert_non_null(frame);
    assert_true(frame->depth_step == 0.5f);
    for (size_t i = 0; i < WIDTH * HEIGHT; i++)
        assert_true(frame->depth[i] == depths[i % 3]);
    fl_frame_destroy(frame);
    free(bytes);
}

TEST(depths_margins_and_hidden_layers_that_cannot_be_are_refused)
{
    uint8_t *bytes;
    size_t count;
    for (unsigned i = 0; i < 7; i++) {
        struct fl_assembly assembly = some_assembly(PROTOCOL_ENCODING_RAW);
        assembly.expected.is_view = true;
        assembly.expected.hidden_layers = 1;
        assembly.expected.attachments = FL_ATTACH_DEPTH;
        assembly.expected.margin_x_max = 1;
        struct message_frame_begin message = make_inverse(&bytes, &count);
        message.depth_step = i == 0 ? 0.0f : message.depth_step;
        message.depth_form = i == 1 ? PROTOCOL_DEPTH_FORM_METRES : message.depth_form;
        message.margin_x = i == 2 ? 2 : 0;
        message.margin_y = i == 3 ? 1 : 0;
        message.width += i == 4; /* without a margin */
        message.hidden_layer = i == 5 ? 2 : i == 6;
        message.of_frame = i == 6 ? message.frame : 0; /* itself */
        if (begin(&assembly, &message))
            fail_msg("change %u was not noticed", i);
        assert_int_equal(error.code, FL_ERROR_PROTOCOL);
        fl_assembly_finish(&assembly);
        free(bytes);
    }
}

TEST(attachments_that_cannot_be_are_refused)
{
    for (unsigned i = 0; i < 6; i++) {
        struct fl_assembly assembly = some_assembly(PROTOCOL_ENCODING_RAW);
        assembly.expected.attachments = FL_ATTACH_DEPTH;
        uint8_t *bytes;
        struct message_frame_begin message =
            make_attached(PROTOCOL_ENCODING_RAW, FL_ATTACH_DEPTH, pixels, pixels, pixels, &bytes);
        message.attachments = i == 0 ? 0 : i == 1 ? 3 : message.attachments;
        message.depth_bytes = i == 2 ? 0 : i == 3 ? 4 * PIXELS_BYTES : message.depth_bytes;
        message.normal_bytes = i == 4 ? 10 : 0;
        if (i == 5) { /* damaged on the way */
            bytes[PIXELS_BYTES + 4] ^= 0xff;
            assert_true(begin(&assembly, &message));
            assert_true(give(&assembly, bytes, PIXELS_BYTES + (size_t)message.depth_bytes, 0));
            assert_null(end(&assembly));
        } else if (begin(&assembly, &message)) {
            fail_msg("change %u was not noticed", i);
        }
        assert_int_equal(error.code, FL_ERROR_PROTOCOL);
        fl_assembly_finish(&assembly);
        free(bytes);
    }
}

/* Behind a raw picture. */
static struct message_frame_begin make_sticking(const uint8_t *blocks, size_t count, uint8_t **bytes)
{
    const size_t bound = ZSTD_compressBound(count);
    *bytes = malloc(PIXELS_BYTES + bound);
    assert_non_null(*bytes);
    memcpy(*bytes, pixels, PIXELS_BYTES);
    struct message_frame_begin message = some_begin(PROTOCOL_ENCODING_RAW, PIXELS_BYTES);
    message.attachments = FL_ATTACH_STICKING;
    message.sticking_bytes = ZSTD_compress(*bytes + PIXELS_BYTES, bound, blocks, count, 1);
    return message;
}

TEST(what_cannot_be_sticking_is_refused)
{
    enum { BLOCKS = WIDTH / 4 * HEIGHT / 4 };
    for (unsigned i = 0; i <= 6; i++) {
        uint8_t blocks[BLOCKS + 1] = {0}, *bytes;
        blocks[BLOCKS - 1] = i == 1 ? 8 : 7; /* sevenths */
        struct fl_assembly assembly = some_assembly(PROTOCOL_ENCODING_RAW);
        assembly.expected.attachments = FL_ATTACH_STICKING;
        struct message_frame_begin message = make_sticking(blocks,
                                                           i == 2   ? BLOCKS - 1
                                                           : i == 3 ? BLOCKS + 1
                                                                    : BLOCKS,
                                                           &bytes);
        bytes[PIXELS_BYTES] ^= i == 4 ? 0xff : 0;
        message.sticking_bytes = i == 5 ? 0 : i == 6 ? UINT32_MAX : message.sticking_bytes;
        struct fl_frame *frame =
            assemble(&assembly, &message, bytes, (size_t)(message.size_bytes + message.sticking_bytes));
        assert_int_equal(frame != NULL, i == 0);
        assert_int_equal(error.code, i == 0 ? FL_ERROR_NONE : FL_ERROR_PROTOCOL);
        if (frame)
            assert_true(frame->sticking[WIDTH * HEIGHT - 1] == 255 && frame->sticking[0] == 0);
        fl_frame_destroy(frame);
        free(bytes);
    }
}

/* Blocks at the edges have what is left of the picture. */
TEST(shares_come_as_the_means_of_their_blocks_within_half_a_step)
{
    enum { ACROSS = 13, DOWN = 7 };
    uint8_t shares[2 * ACROSS * DOWN], blocks[4 * 2], restored[ACROSS * DOWN];
    for (uint32_t i = 0; i < ACROSS * DOWN; i++)
        shares[2 * i] = (uint8_t)(i * 37);
    sticking_round(shares, 2, ACROSS, DOWN, blocks);
    assert_true(sticking_restore(blocks, ACROSS, DOWN, restored));
    for (uint32_t y = 0; y < DOWN; y++)
        for (uint32_t x = 0; x < ACROSS; x++) {
            double sum = 0, count = 0;
            for (uint32_t i = 0; i < ACROSS * DOWN; i++)
                if (i % ACROSS / 4 == x / 4 && i / ACROSS / 4 == y / 4) {
                    sum += shares[2 * i];
                    count++;
                }
            assert_true(fabs(restored[y * ACROSS + x] - sum / count) <= 255 / 14.0 + 0.5);
        }
}

static unsigned long make_jpeg(unsigned width, unsigned height, uint8_t **packed)
{
    unsigned long count = 0;
    *packed = NULL;
    const tjhandle encoder = tjInitCompress();
    assert_int_equal(
        tjCompress2(encoder, pixels, (int)width, 0, (int)height, TJPF_RGBA, packed, &count, TJSAMP_420, 90, 0), 0);
    tjDestroy(encoder);
    return count;
}

TEST(a_jpeg_frame_arrives_with_an_opaque_alpha)
{
    uint8_t *packed = NULL;
    const unsigned long count = make_jpeg(WIDTH, HEIGHT, &packed);
    struct fl_frame *frame = receive(PROTOCOL_ENCODING_JPEG, packed, count);
    assert_non_null(frame);
    assert_false(frame->digest_checked);
    for (size_t i = 3; i < sizeof(pixels); i += 4)
        assert_int_equal(frame->pixels[i], 255);
    fl_frame_destroy(frame);
    tjFree(packed);
}

TEST(a_damaged_jpeg_and_one_of_another_size_are_refused)
{
    uint8_t *packed = NULL;
    unsigned long count = make_jpeg(WIDTH, HEIGHT - 8, &packed);
    expect_refused(PROTOCOL_ENCODING_JPEG, packed, count);
    tjFree(packed);
    count = make_jpeg(WIDTH, HEIGHT, &packed);
    expect_refused(PROTOCOL_ENCODING_JPEG, packed, count - 20);
    expect_refused(PROTOCOL_ENCODING_JPEG, pixels, 100);
    tjFree(packed);
}

TEST(changed_pixels_do_not_pass_the_digest)
{
    uint8_t changed[PIXELS_BYTES];
    memcpy(changed, pixels, sizeof(changed));
    changed[PIXELS_BYTES - 1] ^= 1;
    assert_null(receive(PROTOCOL_ENCODING_RAW, changed, sizeof(changed)));
    assert_string_equal(error.field, "frame.digest");
}

TEST(a_zstd_frame_that_unpacks_to_more_or_less_is_refused)
{
    uint8_t *large = calloc(1, 100 * PIXELS_BYTES), packed[2 * PIXELS_BYTES];
    assert_non_null(large);
    size_t count = ZSTD_compress(packed, sizeof(packed), large, 100 * PIXELS_BYTES, 1);
    expect_refused(PROTOCOL_ENCODING_ZSTD, packed, count);
    count = ZSTD_compress(packed, sizeof(packed), large, PIXELS_BYTES - 1, 1);
    expect_refused(PROTOCOL_ENCODING_ZSTD, packed, count);
    expect_refused(PROTOCOL_ENCODING_ZSTD, large, 50);
    free(large);
}

TEST(a_frame_that_was_not_asked_for_is_refused)
{
    for (unsigned i = 0; i < 7; i++) {
        struct fl_assembly assembly = some_assembly(PROTOCOL_ENCODING_RAW);
        struct message_frame_begin message = some_begin(PROTOCOL_ENCODING_RAW, PIXELS_BYTES);
        message.width += i == 0;
        message.height -= i == 1;
        message.frame += i == 2;
        message.format = i == 3 ? PROTOCOL_PIXEL_FORMAT_RGBA32F : message.format;
        message.encoding = i == 4 ? PROTOCOL_ENCODING_ZSTD : message.encoding;
        message.size_bytes -= i == 5;
        message.size_bytes += i == 6;
        if (begin(&assembly, &message))
            fail_msg("change %u was not noticed", i);
        assert_int_equal(error.code, FL_ERROR_PROTOCOL);
        fl_assembly_finish(&assembly);
    }
}

TEST(huge_declared_sizes_are_refused_before_memory_is_allocated)
{
    static const enum protocol_encoding encodings[] = {PROTOCOL_ENCODING_RAW, PROTOCOL_ENCODING_ZSTD,
                                                       PROTOCOL_ENCODING_JPEG};
    static const uint64_t sizes[] = {0, 4294967296u, UINT64_MAX};
    for (size_t i = 0; i < 3; i++) {
        for (size_t j = 0; j < 3; j++) {
            struct fl_assembly assembly = some_assembly(encodings[i]);
            const struct message_frame_begin message = some_begin(encodings[i], sizes[j]);
            assert_false(begin(&assembly, &message));
            assert_null(assembly.frame);
        }
    }
}

/* Beauty and albedo, in one piece after zstd. */
TEST(layers_arrive_one_behind_the_other_under_one_digest)
{
    static uint8_t both[2 * PIXELS_BYTES], packed[2 * PIXELS_BYTES + 4096];
    memcpy(both, pixels, PIXELS_BYTES);
    for (size_t i = 0; i < PIXELS_BYTES; i++)
        both[PIXELS_BYTES + i] = (uint8_t)(pixels[i] ^ 0x5a);
    const size_t packed_bytes = ZSTD_compress(packed, sizeof(packed), both, sizeof(both), 1);
    struct fl_assembly assembly = some_assembly(PROTOCOL_ENCODING_ZSTD);
    struct message_frame_begin message = some_begin(PROTOCOL_ENCODING_ZSTD, packed_bytes);
    assembly.expected.layers = message.layers = 3;
    message.digest = XXH3_64bits(both, sizeof(both));
    struct fl_frame *frame = assemble(&assembly, &message, packed, packed_bytes);
    assert_non_null(frame);
    assert_int_equal(frame->layers, 3);
    assert_int_equal(frame->pixels_bytes, sizeof(both));
    assert_memory_equal(frame->pixels, both, sizeof(both));
    assert_true(frame->digest_checked);
    fl_frame_destroy(frame);
}

TEST(layers_that_were_not_requested_are_refused_before_memory_is_allocated)
{
    static const unsigned came[] = {2, 3, 127};
    for (size_t i = 0; i < sizeof(came) / sizeof(came[0]); i++) {
        struct fl_assembly assembly = some_assembly(PROTOCOL_ENCODING_RAW);
        struct message_frame_begin message =
            some_begin(PROTOCOL_ENCODING_RAW, (uint64_t)__builtin_popcount(came[i]) * PIXELS_BYTES);
        message.layers = came[i];
        assert_false(begin(&assembly, &message));
        assert_null(assembly.frame);
        assert_string_equal(error.field, "frame_begin.layers");
    }
    /* The bytes of one layer in place of those of two. */
    struct fl_assembly assembly = some_assembly(PROTOCOL_ENCODING_RAW);
    struct message_frame_begin message = some_begin(PROTOCOL_ENCODING_RAW, PIXELS_BYTES);
    assembly.expected.layers = message.layers = 5;
    assert_false(begin(&assembly, &message));
    assert_null(assembly.frame);
}

TEST(chunks_out_of_order_are_refused)
{
    struct fl_assembly assembly = some_assembly(PROTOCOL_ENCODING_RAW);
    const struct message_frame_begin message = some_begin(PROTOCOL_ENCODING_RAW, PIXELS_BYTES);
    assert_false(give(&assembly, pixels, 10, 0)); /* no frame */
    assert_true(begin(&assembly, &message));
    assert_false(begin(&assembly, &message)); /* inside another */
    assert_false(give(&assembly, pixels, 10, 10));
    assert_true(give(&assembly, pixels, 10, 0));
    assert_false(give(&assembly, pixels, 10, 0));
    assert_false(give(&assembly, pixels, PIXELS_BYTES, 10));
    assert_false(give(&assembly, pixels, 10, UINT64_MAX));
    assert_null(end(&assembly)); /* not complete */
    assert_int_equal(error.code, FL_ERROR_PROTOCOL);
    fl_assembly_finish(&assembly);
}

TEST(comparisons_of_waves_arrive)
{
    struct fl_assembly assembly = some_assembly(PROTOCOL_ENCODING_RAW);
    const struct message_frame_begin message = some_begin(PROTOCOL_ENCODING_RAW, PIXELS_BYTES);
    struct record_wave_comparison waves[2] = {{.rays = 960, .both_hit = 960},
                                              {.kind = PROTOCOL_RAY_SHADOW, .rays = 7, .both_missed = 7}};
    const struct message_frame_end last = {.frame = 3, .comparisons = waves, .comparisons_count = 2};
    assert_true(begin(&assembly, &message));
    assert_true(give(&assembly, pixels, PIXELS_BYTES, 0));
    struct fl_frame *frame = fl_assembly_end(&assembly, &last, 2, &error);
    assert_non_null(frame);
    assert_int_equal(frame->wave_comparison_count, 2);
    assert_int_equal(frame->wave_comparisons[0].both_hit, 960);
    assert_int_equal(frame->wave_comparisons[1].kind, PROTOCOL_RAY_SHADOW);
    assert_int_equal(frame->stage_count, 0);
    fl_frame_destroy(frame);
}

TEST(a_part_of_a_structure_is_one_line_with_its_units)
{
    static struct record_structure_row rows[] = {
        {.unit = PROTOCOL_UNIT_NUMBER, .number = 1856, .name = "nodes"},
        {.part = 3, .unit = PROTOCOL_UNIT_PER_RAY, .measure = 69.44f, .name = "shadow/cone_tests"},
        {.part = 3, .unit = PROTOCOL_UNIT_PER_RAY, .measure = 12345.6f, .name = "shadow/triangle_tests"},
        {.part = 3, .unit = PROTOCOL_UNIT_NUMBER, .number = 12, .name = "shadow/turned"},
    };
    const struct fl_frame frame = {.structure = rows, .structure_count = sizeof(rows) / sizeof(rows[0])};
    struct fl_structure_part part;
    size_t at = 0;
    assert_true(fl_structure_next(&frame, &at, &part));
    assert_string_equal(part.name, "");
    assert_string_equal(part.text, "nodes 1856");
    assert_true(fl_structure_next(&frame, &at, &part));
    assert_int_equal(part.number, 3);
    assert_string_equal(part.name, "shadow");
    assert_string_equal(part.text, "cone tests 69.4 a ray, triangle tests 12346 a ray, turned 12");
    assert_false(part.is_kept);
    assert_false(fl_structure_next(&frame, &at, &part));
}

TEST(what_a_tracer_says_of_its_structure_outlives_the_message)
{
    struct fl_assembly assembly = some_assembly(PROTOCOL_ENCODING_RAW);
    const struct message_frame_begin message = some_begin(PROTOCOL_ENCODING_RAW, PIXELS_BYTES);
    char name[] = "static/cell", warning[] = "4 samples are missing";
    struct record_structure_row rows[2] = {
        {.unit = PROTOCOL_UNIT_METRES, .measure = 0.5f, .name = name, .warning = ""},
        {.part = 1, .unit = PROTOCOL_UNIT_BUILT, .number = 1, .name = "dynamic/built", .warning = warning}};
    const struct message_frame_end last = {.frame = 3, .structure = rows, .structure_count = 2};
    assert_true(begin(&assembly, &message));
    assert_true(give(&assembly, pixels, PIXELS_BYTES, 0));
    struct fl_frame *frame = fl_assembly_end(&assembly, &last, 2, &error);
    assert_non_null(frame);
    memset(name, 'x', sizeof(name));
    memset(warning, 'x', sizeof(warning));
    memset(rows, 0, sizeof(rows));
    assert_int_equal(frame->structure_count, 2);
    assert_string_equal(frame->structure[0].name, "static/cell");
    assert_true(frame->structure[0].measure == 0.5f);
    assert_string_equal(frame->structure[0].warning, "");
    assert_int_equal(frame->structure[1].part, 1);
    assert_int_equal(frame->structure[1].unit, PROTOCOL_UNIT_BUILT);
    assert_int_equal(frame->structure[1].number, 1);
    assert_string_equal(frame->structure[1].name, "dynamic/built");
    assert_string_equal(frame->structure[1].warning, "4 samples are missing");
    fl_frame_destroy(frame);
}

TEST(agreement_leaves_edges_aside_and_stays_a_share_whatever_a_daemon_says)
{
    struct record_wave_comparison wave = {.rays = 1000,
                                          .both_hit = 900,
                                          .both_missed = 90,
                                          .only_tracer = 4,
                                          .only_reference = 6,
                                          .far = 5,
                                          .edges = 5};
    assert_true(fl_wave_agreement(&wave) == 1 - 10.0 / 995);
    wave.other_surface = 20; /* differ, and are on no edge */
    assert_true(fl_wave_agreement(&wave) == 1 - 30.0 / 995);
    struct record_wave_comparison sum = {0};
    assert_true(fl_wave_agreement(&sum) == 1);
    wave.distance_max = 0.5f;
    fl_wave_add(&sum, &wave);
    wave.distance_max = 0.25f;
    fl_wave_add(&sum, &wave);
    assert_int_equal(sum.rays, 2000);
    assert_true(sum.distance_max == 0.5f);
    assert_true(fl_wave_agreement(&sum) == fl_wave_agreement(&wave));
    struct record_wave_comparison lie = {.rays = 1, .only_tracer = UINT64_MAX, .far = UINT64_MAX};
    assert_true(fl_wave_agreement(&lie) == 0);
    lie.edges = UINT64_MAX;
    assert_true(fl_wave_agreement(&lie) >= 0 && fl_wave_agreement(&lie) <= 1);
}
