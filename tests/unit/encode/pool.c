/* SPDX-License-Identifier: MIT */
/* Many threads encode, and still a stream is one: each picture by what is different from the one before. */
#include "engine/encode_pool.h"

#include "protocol/pixels/inverse_depth.h"
#include "protocol/pixels/predicted.h"

#include "tests/unit/encode/h264_player.h"
#include "tests/harness/test.h"

#define WIDTH 64u
#define HEIGHT 48u
#define FRAMES 40u

static void on_done(void *context)
{
    (void)context;
}

/* A frame of a single grey that encodes its number; the pool owns it. */
static struct engine_frame *new_frame(enum encoding encoding, uint32_t number)
{
    struct engine_frame *frame = calloc(1, sizeof(*frame));
    assert_non_null(frame);
    frame->frame = number;
    frame->encoding = encoding;
    frame->quality = 90;
    frame->result = (struct frame_result){.width = WIDTH, .height = HEIGHT, .layers = 1};
    frame->result.size_bytes = (size_t)4 * WIDTH * HEIGHT;
    frame->result.pixels = malloc(frame->result.size_bytes);
    assert_non_null(frame->result.pixels);
    memset(frame->result.pixels, (int)(40 + 4 * number), frame->result.size_bytes);
    return frame;
}

static struct fixture {
    struct queue *events;
    struct stage_totals totals;
    struct encode_pool *pool;
    struct job_output *output;
    struct encode_lane *lane;
} fixture;

static void begin_with(unsigned threads)
{
    struct error error = {0};
    fixture = (struct fixture){.events = queue_create(2 * FRAMES, false), .lane = encode_lane_create(30)};
    fixture.pool = encode_pool_create(
        &(struct encode_pool_options){.threads = threads, .totals = &fixture.totals, .on_done = on_done}, &error);
    fixture.output = job_output_create(
        &(struct job_output_options){.events = fixture.events, .window = 2 * FRAMES, .credit = UINT64_MAX});
    assert_true(fixture.events && fixture.pool && fixture.output && fixture.lane);
}

static void submit_to(struct encode_lane *lane, struct engine_frame *made)
{
    assert_true(encode_pool_submit(fixture.pool, fixture.output, lane, job_output_reserve(fixture.output), made));
}

static void submit(enum encoding encoding, uint32_t number)
{
    submit_to(fixture.lane, new_frame(encoding, number));
}

static void drop_event(void *item)
{
    engine_event_destroy(item);
}

static void end_all(void)
{
    encode_pool_destroy(fixture.pool);
    encode_lane_unref(fixture.lane);
    job_output_unref(fixture.output);
    queue_destroy(fixture.events, drop_event);
}

static int begin(void **state)
{
    (void)state;
    begin_with(2);
    return 0;
}

static int end(void **state)
{
    (void)state;
    end_all();
    return 0;
}

static void use_threads(unsigned threads)
{
    end_all();
    begin_with(threads);
}

static struct engine_event *next(void)
{
    struct engine_event *event = queue_pop(fixture.events, 10000000000);
    assert_non_null(event);
    if (event->kind != ENGINE_FRAME)
        fail_msg("%s", event->error.text);
    return event;
}

ALL_TESTS(skip_without_h264, NULL)
EACH_TEST(begin, end)

TEST(a_stream_is_encoded_in_order_by_however_many_threads)
{
    struct player player = player_begin();
    use_threads(8);
    for (uint32_t i = 0; i < FRAMES; i++)
        submit(ENCODING_H264, i);
    for (uint32_t i = 0; i < FRAMES; i++) {
        struct engine_event *event = next();
        const struct engine_frame *frame = event->frame;
        assert_int_equal(frame->frame, i);
        assert_int_equal(frame->key_frame, i == 0);
        assert_int_equal(frame->quality, 90);
        assert_true(play(&player, frame->bytes, frame->size_bytes));
        double shown = (player.frame->data[0][0] - 16) * 255 / 219.0;
        if (fabs(shown - (40 + 4.0 * i)) > 1.9) /* half of what is between two, less rounding */
            fail_msg("frame %u shows %.1f", i, shown);
        engine_event_destroy(event);
    }
    player_end(&player);
}

TEST(frames_that_stand_alone_do_not_wait_for_the_stream)
{
    for (uint32_t i = 0; i < FRAMES; i++)
        submit(i % 2 ? ENCODING_PREDICTED : ENCODING_H264, i);
    for (uint32_t i = 0; i < FRAMES; i++) {
        struct engine_event *event = next();
        assert_int_equal(event->frame->frame, i);
        assert_int_equal(event->frame->key_frame, i == 0 || i % 2);
        assert_int_equal(event->frame->quality, i % 2 ? 0 : 90);
        engine_event_destroy(event);
    }
}

TEST(what_is_attached_lies_behind_the_picture)
{
    for (uint32_t attachments = 0; attachments <= 7; attachments++) {
        struct engine_frame *made = new_frame(attachments % 2 ? ENCODING_H264 : ENCODING_RAW, attachments);
        const size_t plane_bytes = (size_t)4 * WIDTH * HEIGHT;
        made->result.attachments = attachments;
        made->result.pixels = realloc(made->result.pixels, 4 * plane_bytes);
        assert_non_null(made->result.pixels);
        memset(made->result.pixels + plane_bytes, 3, 3 * plane_bytes);
        submit_to(fixture.lane, made);
        struct engine_event *event = next();
        const struct engine_frame *frame = event->frame;
        assert_int_equal(frame->depth_bytes > 0, (attachments & 1u << ATTACHMENT_DEPTH) != 0);
        assert_int_equal(frame->normal_bytes > 0, (attachments & 1u << ATTACHMENT_NORMALS) != 0);
        assert_int_equal(frame->sticking_bytes > 0, (attachments & 1u << ATTACHMENT_STICKING) != 0);
        /* Planes that are the same all over. */
        assert_true(frame->depth_bytes < 200 && frame->normal_bytes < 200 && frame->sticking_bytes < 200);
        size_t picture_bytes =
            frame->size_bytes - frame->depth_bytes - frame->normal_bytes - frame->sticking_bytes;
        if (frame->encoding == ENCODING_RAW)
            assert_int_equal(picture_bytes, plane_bytes);
        const uint8_t *behind = frame->bytes + picture_bytes, magic[] = {0x28, 0xb5, 0x2f, 0xfd}; /* Zstandard's */
        if (frame->depth_bytes)
            assert_memory_equal(behind, magic, sizeof(magic));
        if (frame->normal_bytes)
            assert_memory_equal(behind + frame->depth_bytes, magic, sizeof(magic));
        if (frame->sticking_bytes)
            assert_memory_equal(behind + frame->depth_bytes + frame->normal_bytes, magic, sizeof(magic));
        engine_event_destroy(event);
    }
}

static float depth_of(size_t pixel)
{
    return pixel % 7 == 0 ? 0.0f : 0.5f + 0.25f * (float)pixel;
}

static struct engine_frame *frame_with_depth(float fov_y, float nearest)
{
    const size_t plane_bytes = (size_t)4 * WIDTH * HEIGHT;
    struct engine_frame *made = new_frame(ENCODING_RAW, 0);
    made->result.attachments = 1u << ATTACHMENT_DEPTH;
    made->result.pixels = realloc(made->result.pixels, 2 * plane_bytes);
    assert_non_null(made->result.pixels);
    for (size_t i = 0; i < plane_bytes / 4; i++)
        memcpy(made->result.pixels + plane_bytes + 4 * i, &(float){i == 1 ? nearest : depth_of(i)}, 4);
    made->request.camera.fov_y = fov_y;
    made->view =
        (struct record_view){.depth_form = DEPTH_FORM_INVERSE, .depth_pixels = 0.5f, .depth_radius = 0.2f};
    return made;
}

/* A depth is off by what the bound allows: half a pixel seen from 20 cm aside. What is no inverse is in metres. */
TEST(inverse_depths_keep_the_bound_that_was_asked_for)
{
    const struct {
        float fov_y, nearest;
        bool is_inverse;
    } cases[] = {{1.0f, 0.4f, true}, {0.0f, 0.4f, false}, {1.0f, 1e-5f, false}};
    for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
        struct engine_frame *made = frame_with_depth(cases[i].fov_y, cases[i].nearest);
        submit_to(NULL, made);
        struct engine_event *event = next();
        const struct engine_frame *frame = event->frame;
        assert_int_equal(frame->depth_step > 0.0f, cases[i].is_inverse);
        if (cases[i].is_inverse) {
            const struct predicted_form form = {WIDTH, HEIGHT, 2};
            uint16_t rounded[WIDTH * HEIGHT];
            float depths[WIDTH * HEIGHT];
            const uint8_t *encoded = frame->bytes + frame->size_bytes - frame->depth_bytes;
            assert_int_equal(predicted_decode(&form, encoded, frame->depth_bytes, (uint8_t *)rounded).status,
                             PREDICTED_DONE);
            inverse_depth_restore(rounded, WIDTH * HEIGHT, frame->depth_step, depths);
            const double pixels_a_radian = HEIGHT / (2 * tan(0.5));
            for (size_t k = 2; k < WIDTH * HEIGHT; k++) {
                const double was = depth_of(k) > 0.0f ? 1 / (double)depth_of(k) : 0;
                const double is = depths[k] > 0.0f ? 1 / (double)depths[k] : 0;
                assert_true(fabs(is - was) * pixels_a_radian * 0.2 < 0.5 * (1 + 1e-5)); /* rounding of floats */
            }
        }
        engine_event_destroy(event);
    }
}

/* Other planes than an encoder takes are an error of that frame. */
TEST(planes_come_to_the_encoder_as_they_are)
{
    struct player player = player_begin();
    struct engine_frame *made = new_frame(ENCODING_H264, 0);
    const size_t row_bytes = ycbcr_row_bytes(WIDTH), luma_bytes = ycbcr_luma_bytes(WIDTH);
    made->result.ycbcr = YCBCR_VIDEO;
    made->result.size_bytes = row_bytes * HEIGHT;
    for (uint32_t y = 0; y < HEIGHT; y++) {
        memset(made->result.pixels + y * row_bytes, 80, luma_bytes);
        memset(made->result.pixels + y * row_bytes + luma_bytes, y % 2 ? 170 : 100, luma_bytes / 2);
    }
    submit_to(fixture.lane, made);
    struct engine_event *event = next();
    assert_true(play(&player, event->frame->bytes, event->frame->size_bytes));
    assert_in_range(player.frame->data[0][0], 79, 81);
    assert_in_range(player.frame->data[1][0], 99, 101);
    assert_in_range(player.frame->data[2][0], 169, 171);
    engine_event_destroy(event);
    made = new_frame(ENCODING_RAW, 1);
    made->result.ycbcr = YCBCR_VIDEO;
    submit_to(fixture.lane, made);
    event = queue_pop(fixture.events, 10000000000);
    assert_non_null(event);
    assert_int_equal(event->kind, ENGINE_FAILED);
    assert_int_equal(event->error.kind, ERROR_UNSUPPORTED);
    engine_event_destroy(event);
    player_end(&player);
}

/* The address sanitizer reports what is left over. */
TEST(a_pool_that_ends_drops_what_waits_in_a_lane)
{
    use_threads(1);
    for (uint32_t i = 0; i < FRAMES; i++)
        submit(ENCODING_H264, i);
}

TEST(frames_of_a_closed_output_are_not_encoded)
{
    job_output_close(fixture.output, NULL);
    for (uint32_t i = 0; i < FRAMES; i++)
        submit(ENCODING_H264, i);
}

/* Coarse depths come beside those of the picture, which is as long as it was. */
TEST(a_frame_in_parts_has_first_colours_and_coarse_depth_first)
{
    static const enum frame_part_kind order[] = {FRAME_PART_COLOURS, FRAME_PART_COARSE_DEPTH, FRAME_PART_COLOURS,
                                                 FRAME_PART_DEPTH, FRAME_PART_COLOURS};
    struct engine_frame *made = frame_with_depth(1.0f, 0.4f);
    made->encoding = ENCODING_JPEG;
    made->in_parts = true;
    submit_to(NULL, made);
    struct engine_event *event = next();
    const struct engine_frame *frame = event->frame;
    size_t sums[FRAME_PART_COUNT] = {0}, bytes = 0;
    assert_int_equal(frame->parts.count, sizeof(order) / sizeof(order[0]));
    for (uint32_t i = 0; i < frame->parts.count; i++) {
        assert_int_equal(frame->parts.parts[i].kind, order[i]);
        sums[order[i]] += frame->parts.parts[i].bytes;
        bytes += frame->parts.parts[i].bytes;
    }
    assert_int_equal(bytes, frame->size_bytes);
    assert_int_equal(sums[FRAME_PART_DEPTH], frame->depth_bytes);
    assert_int_equal(sums[FRAME_PART_COARSE_DEPTH], frame->coarse_bytes);
    const size_t needed = frame->parts.parts[0].bytes + frame->parts.parts[1].bytes;
    assert_int_equal(parts_needed_bytes(&frame->parts), needed);
    assert_int_equal(parts_end(&frame->parts, 0), frame->parts.parts[0].bytes);
    assert_int_equal(parts_end(&frame->parts, needed), needed);
    assert_int_equal(parts_end(&frame->parts, needed + 1), needed + frame->parts.parts[2].bytes);
    engine_event_destroy(event);
}

/* A frame that cannot be cut arrives as before. */
TEST(a_frame_of_one_part_is_in_no_parts)
{
    struct engine_frame *made = new_frame(ENCODING_RAW, 7);
    made->in_parts = true;
    submit_to(NULL, made);
    struct engine_event *event = next();
    assert_int_equal(event->frame->parts.count, 0);
    assert_int_equal(event->frame->bytes[5], 40 + 4 * 7);
    engine_event_destroy(event);
}
