/* SPDX-License-Identifier: MIT */
/* Frames in parts, as the daemon makes them: each prefix is a coarser answer, and says how coarse. */
#include "lib/frame.h"

#include "encode/depth.h"
#include "encode/encoder.h"
#include "encode/parts.h"
#include "tests/harness/test.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define WIDTH 160u
#define HEIGHT 104u
#define TEXELS (WIDTH * HEIGHT)
#define STEP 0.001f

/* Encoded by the daemon's own code. */
struct made {
    struct message_frame_begin begin;
    struct record_frame_part records[PARTS_MAX];
    struct message_frame_parts parts;
    uint8_t *bytes;
    size_t size_bytes;
};

static struct fl_error error;
static uint8_t pixels[4 * TEXELS], normals[4 * TEXELS];
static uint16_t rounded[TEXELS];

/* A bright disc before a wavy wall. */
static int fill(void **state)
{
    (void)state;
    for (size_t i = 0; i < TEXELS; i++) {
        const float x = (float)(i % WIDTH), y = (float)i / WIDTH;
        const bool disc = hypotf(x - 70, y - 50) < 30;
        const float wave = 60 * sinf(x / 5) * cosf(y / 7);
        pixels[4 * i] = (uint8_t)(disc ? 230 : 120 + wave);
        pixels[4 * i + 1] = (uint8_t)(disc ? 180 - y : 110 - wave / 2);
        pixels[4 * i + 2] = (uint8_t)(40 + x);
        pixels[4 * i + 3] = 255;
        normals[4 * i] = (uint8_t)(i / 3);
        rounded[i] = (uint16_t)(disc ? 900 : 300 + x / 2);
    }
    return 0;
}

static uint8_t *encoded(enum encoding encoding, const void *from, uint32_t pixel_bytes, bool in_scans,
                        size_t *bytes)
{
    struct error failure = {0};
    uint8_t *out;
    const struct picture picture = {
        .width = WIDTH, .height = HEIGHT, .bytes_per_pixel = pixel_bytes, .pixels = from, .in_scans = in_scans};
    assert_true(encoder_encode(encoding, &picture, encoding == ENCODING_JPEG ? 75 : 1, &out, bytes, &failure));
    return out;
}

static struct made make(bool in_parts)
{
    struct made made = {0};
    struct parts_source source = {.encoding = ENCODING_JPEG};
    struct error failure = {0};
    uint8_t *of[FRAME_PART_COUNT] = {0};
    size_t *sizes = source.size_bytes;
    of[FRAME_PART_COLOURS] = encoded(ENCODING_JPEG, pixels, 4, in_parts, &sizes[FRAME_PART_COLOURS]);
    of[FRAME_PART_DEPTH] = encoded(ENCODING_PREDICTED, rounded, 2, false, &sizes[FRAME_PART_DEPTH]);
    of[FRAME_PART_NORMALS] = encoded(ENCODING_PREDICTED, normals, 4, false, &sizes[FRAME_PART_NORMALS]);
    if (in_parts)
        assert_true(depth_encode_coarse(rounded, WIDTH, HEIGHT, &of[FRAME_PART_COARSE_DEPTH],
                                        &sizes[FRAME_PART_COARSE_DEPTH], &failure));
    for (unsigned kind = 0; kind < FRAME_PART_COUNT; kind++) {
        source.bytes[kind] = of[kind];
        made.size_bytes += sizes[kind];
    }
    made.begin = (struct message_frame_begin){.frame = 3,
                                              .width = WIDTH,
                                              .height = HEIGHT,
                                              .samples = 1,
                                              .layers = 1,
                                              .moving = 1,
                                              .size_bytes = sizes[FRAME_PART_COLOURS],
                                              .depth_bytes = sizes[FRAME_PART_DEPTH],
                                              .normal_bytes = sizes[FRAME_PART_NORMALS],
                                              .attachments = FL_ATTACH_DEPTH | FL_ATTACH_NORMALS,
                                              .depth_form = PROTOCOL_DEPTH_FORM_INVERSE,
                                              .depth_step = STEP,
                                              .encoding = PROTOCOL_ENCODING_JPEG};
    struct part_list list;
    made.bytes = malloc(made.size_bytes);
    assert_non_null(made.bytes);
    parts_arrange(&source, made.bytes, &list);
    for (uint32_t i = 0; i < list.count; i++)
        made.records[i] =
            (struct record_frame_part){(enum protocol_frame_part_kind)list.parts[i].kind, list.parts[i].bytes};
    made.parts = (struct message_frame_parts){.frame = 3, .parts_count = list.count};
    for (unsigned kind = 0; kind < FRAME_PART_COUNT; kind++)
        free(of[kind]);
    return made;
}

static struct fl_assembly begin(const struct made *made)
{
    struct fl_assembly assembly = {.expected = {.width = WIDTH,
                                                .height = HEIGHT,
                                                .encoding = PROTOCOL_ENCODING_JPEG,
                                                .still_encoding = PROTOCOL_ENCODING_JPEG,
                                                .layers = FL_LAYERS_PICTURE,
                                                .attachments = FL_ATTACH_DEPTH | FL_ATTACH_NORMALS,
                                                .is_view = true,
                                                .parts = true}};
    error = (struct fl_error){0};
    assert_true(fl_assembly_begin(&assembly, &made->begin, 3, 1, &error));
    return assembly;
}

static bool tell(struct fl_assembly *assembly, const struct made *made)
{
    struct made told = *made;
    told.parts.parts = told.records;
    return fl_assembly_parts(assembly, &told.parts, &error);
}

static void give(struct fl_assembly *assembly, const struct made *made, size_t bytes)
{
    for (size_t at = 0; at < bytes;) { /* in chunks that end anywhere */
        const size_t chunk = bytes - at < 777 ? bytes - at : 777;
        const struct message_frame_data data = {
            .offset_bytes = at, .data = made->bytes + at, .data_bytes = (uint32_t)chunk};
        assert_true(fl_assembly_data(assembly, &data, &error));
        at += chunk;
    }
}

static struct fl_frame *end(struct fl_assembly *assembly, bool abandoned)
{
    return fl_assembly_end(assembly, &(struct message_frame_end){.frame = 3, .abandoned = abandoned}, 2, &error);
}

static struct fl_frame *receive(const struct made *made, bool in_parts, size_t bytes)
{
    struct fl_assembly assembly = begin(made);
    if (in_parts)
        assert_true(tell(&assembly, made));
    give(&assembly, made, bytes);
    struct fl_frame *frame = end(&assembly, bytes < made->size_bytes);
    fl_assembly_finish(&assembly);
    return frame;
}

static double error_of(const struct fl_frame *frame)
{
    double sum = 0;
    for (size_t i = 0; i < sizeof(pixels); i++)
        sum += (frame->pixels[i] - pixels[i]) * (frame->pixels[i] - pixels[i]);
    return sum;
}

ALL_TESTS(fill, NULL)

/* The picture equals a whole one, as JPEG's scans only order its data. */
TEST(all_parts_are_the_frame)
{
    const struct made parts = make(true), whole = make(false);
    struct fl_frame *a = receive(&parts, true, parts.size_bytes), *b = receive(&whole, false, whole.size_bytes);
    assert_non_null(a);
    assert_non_null(b);
    assert_int_equal(parts.parts.parts_count, 6);
    assert_true(a->parts == 6 && a->parts_come == 6 && b->parts == 1 && b->parts_come == 1);
    assert_false(a->depth_is_coarse || a->more_follows);
    assert_memory_equal(a->pixels, b->pixels, sizeof(pixels));
    assert_memory_equal(a->depth, b->depth, TEXELS * sizeof(*a->depth));
    assert_memory_equal(a->normals, normals, sizeof(normals));
    fl_frame_destroy(a);
    fl_frame_destroy(b);
    free(parts.bytes);
    free(whole.bytes);
}

static void check_bound(const struct fl_frame *frame)
{
    const double slack = 1e-5; /* rounding of 32-bit floats, in 1 / metres */
    for (size_t i = 0; i < TEXELS; i++) {
        const double inverse = frame->depth[i] > 0 ? 1.0 / (double)frame->depth[i] : 0;
        const double off = fabs(inverse - (double)rounded[i] * (double)STEP);
        if (off > (double)frame->depth_error + slack)
            fail_msg("texel %zu is off by %g, not %g", i, off, (double)frame->depth_error);
    }
}

/* With some bytes of the part that follows, which say nothing. */
TEST(every_prefix_of_parts_is_a_coarser_answer_within_its_bound)
{
    const struct made made = make(true);
    double first = 0, before = INFINITY;
    size_t bytes = 0;
    for (uint32_t count = 1; count < made.parts.parts_count; count++) {
        bytes += (size_t)made.records[count - 1].size_bytes;
        struct fl_frame *frame = receive(&made, true, bytes + (size_t)made.records[count].size_bytes / 2);
        assert_int_equal(frame != NULL, count >= 2); /* colours and coarse depth */
        if (!frame)
            continue;
        assert_int_equal(frame->parts_come, count);
        assert_int_equal(frame->depth_is_coarse, count < 4);
        assert_true(error_of(frame) <= before);
        before = error_of(frame);
        first = first > 0 ? first : before;
        check_bound(frame);
        assert_null(frame->normals); /* the last part */
        fl_frame_destroy(frame);
    }
    assert_true(before < first / 2);
    free(made.bytes);
}

TEST(first_parts_are_shown_and_all_take_their_place_in_the_queue)
{
    const struct made made = make(true);
    struct fl_frame_queue queue;
    assert_true(fl_frame_queue_init(&queue, 1, &error));
    struct fl_assembly assembly = begin(&made);
    assert_true(tell(&assembly, &made));
    const size_t first = (size_t)(made.records[0].size_bytes + made.records[1].size_bytes);
    give(&assembly, &made, first - 1);
    assert_false(fl_assembly_has_first_parts(&assembly));
    const struct message_frame_data rest = {.offset_bytes = first - 1,
                                            .data = made.bytes + first - 1,
                                            .data_bytes = (uint32_t)(made.size_bytes - first)};
    const struct message_frame_data last = {
        .offset_bytes = made.size_bytes - 1, .data = made.bytes + made.size_bytes - 1, .data_bytes = 1};
    assert_true(fl_assembly_data(&assembly, &rest, &error)); /* a byte is missing */
    assert_true(fl_assembly_has_first_parts(&assembly));
    struct fl_frame *shown = fl_assembly_show(&assembly, 2, &error);
    assert_non_null(shown);
    assert_true(shown->more_follows && shown->parts_come == 5);
    assert_true(fl_frame_queue_push(&queue, shown, &error));
    assert_true(fl_assembly_data(&assembly, &last, &error));
    assert_false(fl_assembly_has_first_parts(&assembly));
    assert_true(fl_frame_queue_push(&queue, end(&assembly, false), &error));
    assert_int_equal(queue.count, 1);
    struct fl_frame *frame = fl_frame_queue_pop(&queue);
    assert_true(!frame->more_follows && frame->parts_come == 6 && frame->normals);
    fl_frame_destroy(frame);
    fl_frame_queue_finish(&queue);
    free(made.bytes);
}

TEST(parts_that_cannot_be_are_refused)
{
    for (unsigned change = 0; change < 10; change++) {
        struct made made = make(true);
        struct fl_assembly assembly = begin(&made);
        struct record_frame_part *records = made.records;
        assembly.expected.parts = change != 0;
        made.parts.frame += change == 1;
        made.parts.parts_count -= change == 2; /* without normals */
        records[0].size_bytes += change == 3;  /* more than there are */
        if (change == 4)
            records[1].kind = PROTOCOL_FRAME_PART_DEPTH; /* twice */
        if (change == 5)
            records[1].size_bytes = UINT64_C(1) << 32;
        if (change == 6)
            assembly.begin.depth_step = 0; /* metres have no coarse ones */
        if (change == 7)
            assembly.begin.encoding = PROTOCOL_ENCODING_PREDICTED; /* is not cut */
        if (change == 8)
            give(&assembly, &made, 1); /* too late */
        if (change == 9)
            assert_true(tell(&assembly, &made)); /* twice */
        if (tell(&assembly, &made))
            fail_msg("change %u was not noticed", change);
        assert_int_equal(error.code, FL_ERROR_PROTOCOL);
        fl_assembly_finish(&assembly);
        free(made.bytes);
    }
}

/* Damage within a complete part ends in an error, and a complete frame may not be called abandoned. */
TEST(damaged_parts_are_refused)
{
    struct made made = make(true);
    const size_t first = (size_t)made.records[0].size_bytes, second = (size_t)made.records[1].size_bytes;
    struct fl_assembly assembly = begin(&made);
    assert_true(tell(&assembly, &made));
    give(&assembly, &made, made.size_bytes);
    assert_null(end(&assembly, true));
    fl_assembly_finish(&assembly);
    made.bytes[first + 2] ^= 0xff; /* a byte of the coarse depth's Zstandard frame */
    assert_null(receive(&made, true, first + second));
    assert_int_equal(error.code, FL_ERROR_PROTOCOL);
    made.bytes[first + 2] ^= 0xff;
    made.bytes[0] = 0;
    assert_null(receive(&made, true, first + second));
    assert_int_equal(error.code, FL_ERROR_PROTOCOL);
    free(made.bytes);
}
