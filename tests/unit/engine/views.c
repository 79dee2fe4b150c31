/* SPDX-License-Identifier: MIT */
/* Views in the engine, with a renderer that the tests control: the newest camera, refinement, replacing, credit.
 */
#include "tests/unit/engine/engine_fake.h"

#include "base/clock.h"
#include "encode/stream.h"
#include "engine/engine_private.h"
#include "tests/harness/test.h"

#include <math.h>

#define MS UINT64_C(1000000)

/* An engine in which client 1 has opened scene 1, and what that client wishes to see. */
struct watching {
    struct engine *engine;
    struct view_wishes *wishes;
};

static int begin_with(void **state, struct engine_options options)
{
    struct watching *watching = calloc(1, sizeof(*watching));
    assert_non_null(watching);
    *state = watching;
    watching->engine = start(options);
    watching->wishes = view_wishes_create();
    open_scene(watching->engine, 1, 1);
    return 0;
}

static int begin(void **state)
{
    return begin_with(state, (struct engine_options){0});
}

static int begin_with_encoders(void **state)
{
    return begin_with(state, (struct engine_options){.encode_threads = 4});
}

static int end(void **state)
{
    struct watching *watching = *state;
    view_wishes_unref(watching->wishes);
    stop(watching->engine);
    free(watching);
    return 0;
}

/* Frames need 1 sample of 4, so that they refine; the bound of frames a second is out of the way. */
static struct engine_command *view(uint32_t request, struct view_wishes *wishes)
{
    struct engine_command *made = render(1, request, 0, UINT32_MAX);
    made->job.kind = JOB_VIEW;
    made->job.frames_per_second = 100000;
    made->job.frame.samples = 4;
    made->job.pass_samples = 1;
    made->job.weight = 1;
    made->job.encoding = ENCODING_JPEG;
    made->job.quality = 80;
    made->job.still_encoding = ENCODING_RAW;
    made->job.wishes = view_wishes_ref(wishes);
    return made;
}

/* From 5 m away, at the height of the command's number. */
static struct view_camera camera(uint64_t number, bool moving)
{
    return (struct view_camera){
        .command = number,
        .received_ns = 1000 + number,
        .moving = moving,
        .key = {.eye_world = {0, (float)number, 5}, .up_world = {0, 1, 0}, .fov_y = 1},
    };
}

static void look_from(struct watching *watching, const struct view_camera *from)
{
    if (view_wishes_look(watching->wishes, from))
        submit(watching->engine, command(ENGINE_VIEW_LOOK, 1, 0));
}

static void look(struct watching *watching, uint64_t number, bool moving)
{
    struct view_camera made = camera(number, moving);
    look_from(watching, &made);
}

static struct engine_frame *take(struct engine_event *event)
{
    struct engine_frame *frame = event->frame;
    event->frame = NULL;
    engine_event_destroy(event);
    return frame;
}

static void drop(struct engine_frame *frame)
{
    frame_result_finish(&frame->result);
    free(frame->bytes);
    free(frame);
}

EACH_TEST(begin, end)

TEST(a_frame_tells_of_the_camera_that_it_shows)
{
    struct watching *watching = *state;
    struct engine_command *made = view(2, watching->wishes);
    made->job.first_frame = 5;
    made->job.frame.samples = 1;
    submit(watching->engine, made);
    struct engine_frame *first = take(expect_frame(watching->engine, 1, 2, 5));
    assert_int_equal(first->command, 0);
    assert_int_equal(first->received_ns, 0);
    assert_false(first->moving);
    assert_true(first->key_frame);
    drop(first);
    expect_silence(watching->engine); /* nothing changes, and there are enough samples */
    uint64_t before_ns = clock_now_ns();
    look(watching, 7, true);
    struct engine_frame *frame = take(expect_frame(watching->engine, 1, 2, 6));
    assert_int_equal(frame->command, 7);
    assert_int_equal(frame->received_ns, 1007);
    assert_true(frame->moving);
    assert_true(before_ns <= frame->applied_ns && frame->applied_ns <= frame->rendered_ns);
    assert_true(frame->rendered_ns <= frame->encoded_ns && frame->encoded_ns <= clock_now_ns());
    /* The eye is the camera's place. */
    assert_true(frame->request.camera.world_from_view[7] == 7.0f);
    assert_true(frame->request.camera.world_from_view[11] == 5.0f);
    drop(frame);
    expect_silence(watching->engine);
}

static struct engine_command *with_samples(struct engine_command *made, uint32_t samples, uint32_t pass_samples)
{
    made->job.frame.samples = samples;
    made->job.pass_samples = pass_samples;
    return made;
}

static void expect_picture(struct watching *watching, uint32_t request, uint32_t number, uint64_t command_number,
                           uint32_t samples, enum encoding encoding)
{
    struct engine_frame *frame = take(expect_frame(watching->engine, 1, request, number));
    if (frame->command != command_number || frame->result.samples != samples || frame->encoding != encoding)
        fail_msg("frame %u shows command %d with %u samples in encoding %d; expected %d, %u, %d", number,
                 (int)frame->command, frame->result.samples, frame->encoding, (int)command_number, samples,
                 encoding);
    drop(frame);
}

TEST(of_many_cameras_the_newest_is_shown)
{
    struct watching *watching = *state;
    submit(watching->engine, gated(with_samples(view(2, watching->wishes), 1, 1)));
    look(watching, 1, true);
    wait_until(&fake.frames_begun, 1);
    for (uint64_t number = 2; number <= 500; number++)
        look(watching, number, true);
    expect_silence(watching->engine);
    assert_int_equal(atomic_load(&fake.frames_begun), 1); /* what shows something new is finished */
    atomic_store(&fake.gate_open, true);
    struct engine_event *event = event_within(watching->engine, 10000);
    assert_non_null(event);
    assert_true(event->frame->command <= 1); /* it may have been begun before the first camera came */
    engine_event_destroy(event);
    expect_picture(watching, 2, 1, 500, 1, ENCODING_JPEG);
    expect_silence(watching->engine);
}

TEST(a_picture_that_rests_is_refined_until_it_has_its_samples)
{
    struct watching *watching = *state;
    submit(watching->engine, with_samples(view(2, watching->wishes), 7, 3));
    expect_picture(watching, 2, 0, 0, 3, ENCODING_RAW);
    expect_picture(watching, 2, 1, 0, 6, ENCODING_RAW);
    expect_picture(watching, 2, 2, 0, 7, ENCODING_RAW);
    expect_silence(watching->engine);
    look(watching, 1, true);
    expect_picture(watching, 2, 3, 1, 3, ENCODING_JPEG);
    expect_silence(watching->engine); /* it moves: more will follow */
    struct view_camera stays = camera(1, false);
    stays.command = 2; /* the same place: the samples that it has count */
    look_from(watching, &stays);
    expect_picture(watching, 2, 4, 2, 6, ENCODING_RAW);
    expect_picture(watching, 2, 5, 2, 7, ENCODING_RAW);
    expect_silence(watching->engine);
}

/* The error of N samples is 1 / N here. */
TEST(a_picture_that_rests_is_refined_until_its_error_is_as_small_as_wanted)
{
    struct watching *watching = *state;
    struct engine_command *made = with_samples(view(2, watching->wishes), 1000, 3);
    made->job.frame.noise = 0.12f;
    submit(watching->engine, made);
    expect_picture(watching, 2, 0, 0, 3, ENCODING_RAW);
    expect_picture(watching, 2, 1, 0, 6, ENCODING_RAW);
    expect_picture(watching, 2, 2, 0, 9, ENCODING_RAW);
    expect_silence(watching->engine);
    look(watching, 1, false); /* another place, of which nothing is known */
    expect_picture(watching, 2, 3, 1, 3, ENCODING_RAW);
    expect_picture(watching, 2, 4, 1, 6, ENCODING_RAW);
    expect_picture(watching, 2, 5, 1, 9, ENCODING_RAW);
    expect_silence(watching->engine);
}

TEST(an_edit_of_the_scene_begins_anew)
{
    struct watching *watching = *state;
    submit(watching->engine, with_samples(view(2, watching->wishes), 2, 1));
    expect_picture(watching, 2, 0, 0, 1, ENCODING_RAW);
    expect_picture(watching, 2, 1, 0, 2, ENCODING_RAW);
    expect_silence(watching->engine);
    submit_commit(watching->engine, 1, 3, 1);
    assert_int_equal(expect_done(watching->engine, 1, 3), 1);
    struct engine_frame *frame = take(expect_frame(watching->engine, 1, 2, 2));
    assert_int_equal(frame->result.revision, 1);
    assert_int_equal(frame->result.samples, 1);
    drop(frame);
    expect_picture(watching, 2, 3, 0, 2, ENCODING_RAW);
    expect_silence(watching->engine);
}

/* The view has shown a frame, and a refining one is in progress until the gate is opened. */
static void start_refining(struct watching *watching)
{
    atomic_store(&fake.gate_open, true);
    struct engine_command *made = gated(with_samples(view(2, watching->wishes), 1000, 1));
    made->job.credit = 1;
    submit(watching->engine, made);
    expect_picture(watching, 2, 0, 0, 1, ENCODING_RAW);
    atomic_store(&fake.gate_open, false);
    submit_target(watching->engine, ENGINE_JOB_CREDIT, 1, 0, 2, 2);
    wait_until(&fake.frames_begun, 2);
}

TEST(a_new_camera_interrupts_refining)
{
    struct watching *watching = *state;
    start_refining(watching);
    look(watching, 9, true);
    wait_until(&fake.frames_begun, 3);
    assert_int_equal(atomic_load(&fake.frames_abandoned), 1);
    look(watching, 10, true);
    expect_silence(watching->engine);
    assert_int_equal(atomic_load(&fake.frames_abandoned), 1); /* what shows something new is finished */
    atomic_store(&fake.gate_open, true);
    expect_picture(watching, 2, 1, 9, 1, ENCODING_JPEG);
    expect_silence(watching->engine); /* there is no credit for a third */
}

TEST(an_edit_interrupts_refining)
{
    struct watching *watching = *state;
    start_refining(watching);
    submit_commit(watching->engine, 1, 3, 1);
    assert_int_equal(expect_done(watching->engine, 1, 3), 1); /* the gate is closed still */
    atomic_store(&fake.gate_open, true);
    struct engine_frame *frame = take(expect_frame(watching->engine, 1, 2, 1));
    assert_int_equal(frame->result.revision, 1);
    assert_int_equal(frame->result.samples, 1);
    drop(frame);
}

TEST(a_view_shows_cameras_while_an_edit_waits_for_a_long_batch_frame)
{
    struct watching *watching = *state;
    submit(watching->engine, gated(render(1, 9, 0, 0)));
    wait_until(&fake.frames_begun, 1);
    submit_commit(watching->engine, 1, 3, 1); /* for the frame of the batch */
    /* That comes after the edit, and is not begun before it. */
    submit(watching->engine, view(2, watching->wishes));
    expect_silence(watching->engine);
    atomic_store(&fake.gate_open, true);
    /* The view's frames may come before the batch's own has been encoded. */
    for (int answers = 0, samples = 0; answers < 2 || samples < 4;) {
        struct engine_event *event = event_within(watching->engine, 10000);
        assert_non_null(event);
        answers += event->kind == ENGINE_DONE;
        samples += event->kind == ENGINE_FRAME && event->request == 2;
        engine_event_destroy(event);
    }
    /* Now the view is there before. */
    atomic_store(&fake.gate_open, false);
    int begun = atomic_load(&fake.frames_begun);
    submit(watching->engine, gated(render(1, 10, 0, 0)));
    wait_until(&fake.frames_begun, begun + 1);
    submit_commit(watching->engine, 1, 4, 1);
    for (uint64_t number = 1; number <= 5; number++) {
        look(watching, number, number < 5);
        struct engine_frame *frame = take(expect_frame(watching->engine, 1, 2, 3 + (uint32_t)number));
        assert_int_equal(frame->command, number);
        assert_int_equal(frame->result.revision, 1);
        drop(frame);
    }
    expect_silence(watching->engine); /* what rests is not refined to be thrown away */
    atomic_store(&fake.gate_open, true);
    uint32_t shown = 0;
    for (bool applied = false; !applied || shown < 4;) {
        struct engine_event *event = event_within(watching->engine, 10000);
        assert_non_null(event);
        applied |= event->request == 4;
        if (event->kind == ENGINE_FRAME && event->request == 2) {
            assert_true(applied);
            assert_int_equal(event->frame->result.revision, 2);
            shown++;
        }
        engine_event_destroy(event);
    }
}

TEST(nothing_is_begun_beyond_credit_so_that_nothing_becomes_stale)
{
    struct watching *watching = *state;
    struct engine_command *made = with_samples(view(2, watching->wishes), 1, 1);
    made->job.credit = 0;
    submit(watching->engine, made);
    look(watching, 1, true);
    expect_silence(watching->engine);
    assert_int_equal(atomic_load(&fake.frames_begun), 0);
    look(watching, 2, true);
    submit_target(watching->engine, ENGINE_JOB_CREDIT, 1, 0, 2, 1);
    expect_picture(watching, 2, 0, 2, 1, ENCODING_JPEG);
    look(watching, 3, true);
    expect_silence(watching->engine);
    assert_int_equal(atomic_load(&fake.frames_begun), 1);
}

TEST(no_more_frames_come_than_were_asked_for_a_second)
{
    struct watching *watching = *state;
    struct engine_command *made = with_samples(view(2, watching->wishes), 1000, 1);
    made->job.frames_per_second = 100;
    submit(watching->engine, made);
    uint64_t first_ns = 0, last_ns = 0;
    for (uint32_t number = 0; number < 11; number++) {
        struct engine_frame *frame = take(expect_frame(watching->engine, 1, 2, number));
        first_ns = number ? first_ns : frame->applied_ns;
        last_ns = frame->applied_ns;
        drop(frame);
    }
    assert_true(last_ns - first_ns >= 10 * UINT64_C(10000000));
}

TEST(a_key_frame_comes_also_where_nothing_moves)
{
    struct watching *watching = *state;
    submit(watching->engine, with_samples(view(2, watching->wishes), 1, 1));
    struct engine_frame *frame = take(expect_frame(watching->engine, 1, 2, 0));
    assert_false(frame->wants_key);
    drop(frame);
    expect_silence(watching->engine);
    assert_true(view_wishes_want_key_frame(watching->wishes));
    submit(watching->engine, command(ENGINE_VIEW_LOOK, 1, 0));
    frame = take(expect_frame(watching->engine, 1, 2, 1));
    assert_true(frame->wants_key);
    drop(frame);
    expect_silence(watching->engine);
}

TEST(a_complete_picture_comes_again_as_a_key_frame_and_not_with_more_samples)
{
    struct watching *watching = *state;
    submit(watching->engine, with_samples(view(2, watching->wishes), 7, 3));
    for (uint32_t number = 0; number < 3; number++)
        drop(take(expect_frame(watching->engine, 1, 2, number)));
    for (uint32_t number = 3; number < 5; number++) {
        assert_true(view_wishes_want_key_frame(watching->wishes));
        submit(watching->engine, command(ENGINE_VIEW_LOOK, 1, 0));
        struct engine_frame *frame = take(expect_frame(watching->engine, 1, 2, number));
        assert_true(frame->wants_key);
        assert_int_equal(frame->result.samples, 7);
        drop(frame);
        expect_silence(watching->engine);
    }
}

/* Takes the frame that shows the next camera. */
static struct engine_frame *take_next(struct watching *watching, uint64_t number, bool moving)
{
    look(watching, number, moving);
    struct engine_frame *frame = take(event_within(watching->engine, 10000));
    assert_int_equal(frame->command, number);
    return frame;
}

static void expect_encoded(struct engine_frame *frame, enum encoding encoding, bool key_frame)
{
    assert_int_equal(frame->encoding, encoding);
    assert_int_equal(frame->key_frame, key_frame);
    drop(frame);
}

TEST_WITH(a_stream_continues_over_frames_at_rest_and_restarts_on_request, begin_with_encoders, end)
{
    struct watching *watching = *state;
    if (!encoder_stream_supports(ENCODING_H264, 4)) {
        print_message("skipped: no encoder of H.264 is here\n");
        return;
    }
    struct engine_command *made = with_samples(view(2, watching->wishes), 1, 1);
    made->job.encoding = ENCODING_H264;
    submit(watching->engine, made);
    expect_encoded(take(expect_frame(watching->engine, 1, 2, 0)), ENCODING_RAW, true);
    expect_encoded(take_next(watching, 1, true), ENCODING_H264, true);
    expect_encoded(take_next(watching, 2, true), ENCODING_H264, false);
    expect_encoded(take_next(watching, 3, false), ENCODING_RAW, true);
    expect_encoded(take_next(watching, 4, true), ENCODING_H264, false);
    /* One of rest comes at once, and the stream begins again with the next motion. */
    look(watching, 5, false);
    expect_encoded(take(event_within(watching->engine, 10000)), ENCODING_RAW, true);
    assert_true(view_wishes_want_key_frame(watching->wishes));
    submit(watching->engine, command(ENGINE_VIEW_LOOK, 1, 0));
    expect_encoded(take(event_within(watching->engine, 10000)), ENCODING_RAW, true);
    expect_encoded(take_next(watching, 6, true), ENCODING_H264, true);
    expect_encoded(take_next(watching, 7, true), ENCODING_H264, false);
    /* So it does with a view that takes the place of this one. */
    made = with_samples(view(3, watching->wishes), 1, 1);
    made->job.encoding = made->job.still_encoding = ENCODING_H264;
    submit(watching->engine, made);
    expect_done(watching->engine, 1, 2);
    expect_encoded(take(event_within(watching->engine, 10000)), ENCODING_H264, true);
    expect_encoded(take_next(watching, 8, false), ENCODING_H264, false);
}

TEST(a_view_takes_the_place_of_another_and_goes_on_from_it)
{
    struct watching *watching = *state;
    struct view_wishes *others = view_wishes_create();
    open_scene(watching->engine, 1, 7);
    submit(watching->engine, with_samples(view(2, watching->wishes), 1, 1));
    expect_picture(watching, 2, 0, 0, 1, ENCODING_RAW);
    submit(watching->engine, with_samples(view(20, others), 1, 1)); /* of the same client, but another one */
    expect_picture(watching, 20, 0, 0, 1, ENCODING_RAW);
    look(watching, 3, true);
    expect_picture(watching, 2, 1, 3, 1, ENCODING_JPEG);
    struct engine_command *made = with_samples(view(4, watching->wishes), 1, 1);
    made->job.encoding = ENCODING_ZSTD;
    made->scene = 7;
    submit(watching->engine, made);
    expect_done(watching->engine, 1, 2);
    expect_picture(watching, 4, 2, 3, 1, ENCODING_ZSTD);
    expect_silence(watching->engine);
    /* One that cannot be changes nothing. */
    made = view(5, watching->wishes);
    made->job.frame.tracer = 99;
    submit(watching->engine, made);
    expect_failed(watching->engine, 1, 5, ERROR_UNSUPPORTED, "render.tracer");
    look(watching, 6, true);
    expect_picture(watching, 4, 3, 6, 1, ENCODING_ZSTD);
    view_wishes_unref(others);
}

TEST(a_frame_in_progress_ends_with_the_view_that_is_replaced)
{
    struct watching *watching = *state;
    submit(watching->engine, gated(view(2, watching->wishes)));
    wait_until(&fake.frames_begun, 1);
    submit(watching->engine, with_samples(view(3, watching->wishes), 1, 1));
    expect_done(watching->engine, 1, 2);
    wait_until(&fake.frames_abandoned, 1);
    expect_picture(watching, 3, 0, 0, 1, ENCODING_RAW);
}

TEST(a_cancelled_view_ends_whatever_it_does)
{
    struct watching *watching = *state;
    submit(watching->engine, with_samples(view(2, watching->wishes), 1, 1));
    expect_picture(watching, 2, 0, 0, 1, ENCODING_RAW);
    submit_target(watching->engine, ENGINE_JOB_CANCEL, 1, 3, 2, 0); /* at rest */
    expect_failed(watching->engine, 1, 2, ERROR_CANCELLED, "");
    expect_done(watching->engine, 1, 3);
    submit(watching->engine, gated(view(4, watching->wishes)));
    wait_until(&fake.frames_begun, 2);
    submit_target(watching->engine, ENGINE_JOB_CANCEL, 1, 5, 4, 0); /* in a frame */
    expect_failed(watching->engine, 1, 4, ERROR_CANCELLED, "");
    expect_done(watching->engine, 1, 5);
    look(watching, 1, true);
    expect_silence(watching->engine);
    submit(watching->engine, gated(view(6, watching->wishes)));
    wait_until(&fake.frames_begun, 3);
    submit(watching->engine, command(ENGINE_CLIENT_GONE, 1, 0));
    engine_event_destroy(expect_event(watching->engine, ENGINE_CLIENT_FORGOTTEN, 1, 0));
    expect_silence(watching->engine);
}

TEST(a_view_that_adapts_is_smaller_while_it_moves)
{
    struct watching *watching = *state;
    struct engine_command *made = with_samples(view(2, watching->wishes), 2, 1);
    made->job.adapt = true;
    made->job.frame.width = 80;
    made->job.frame.height = 48;
    view_wishes_set_effort(
        watching->wishes, &(struct view_effort){.scale_32nds = 12, .quality = 55, .bytes = 1234, .sparing = true});
    submit(watching->engine, made);
    struct engine_frame *frame = take(expect_frame(watching->engine, 1, 2, 0));
    assert_int_equal(frame->result.width, 80);
    assert_int_equal(frame->encoding, ENCODING_JPEG); /* the link is to be spared until all samples are there */
    assert_int_equal(frame->quality, 80);
    drop(frame);
    expect_picture(watching, 2, 1, 0, 2, ENCODING_RAW);
    look(watching, 1, true);
    frame = take(expect_frame(watching->engine, 1, 2, 2));
    assert_int_equal(frame->request.width, 30);
    assert_int_equal(frame->result.height, 18);
    assert_int_equal(frame->scale_32nds, 12);
    assert_int_equal(frame->quality, 55);
    assert_int_equal(frame->wanted_bytes, 1234);
    drop(frame);
    look(watching, 2, false);
    frame = take(expect_frame(watching->engine, 1, 2, 3));
    assert_int_equal(frame->result.height, 48);
    drop(frame);
}

TEST(a_view_that_keeps_a_rate_goes_without_bounces_while_it_moves)
{
    struct watching *watching = *state;
    struct engine_command *made = with_samples(view(2, watching->wishes), 2, 1);
    made->job.keeps_rate = true;
    made->job.frame.depth = 8;
    made->job.frame.width = made->job.frame.height = 64;
    view_wishes_set_effort(watching->wishes, &(struct view_effort){.scale_32nds = 20, .depth_less = 6});
    look(watching, 1, true);
    submit(watching->engine, made);
    struct engine_frame *frame = take(expect_frame(watching->engine, 1, 2, 0));
    assert_int_equal(frame->request.depth, 2);
    assert_int_equal(frame->depth_less, 6);
    assert_int_equal(frame->request.width, 40);
    assert_int_equal(frame->quality, 80); /* the job's */
    drop(frame);
    look(watching, 2, false);
    frame = take(expect_frame(watching->engine, 1, 2, 1));
    assert_int_equal(frame->request.depth, 8);
    assert_int_equal(frame->depth_less, 0);
    assert_int_equal(frame->request.width, 64);
    drop(frame);
}

/* Of 80x48 at 3/8, a tenth on each side; and the field of view that keeps as many pixels a radian. */
TEST(a_frame_has_a_margin_while_it_moves)
{
    struct watching *watching = *state;
    struct engine_command *made = with_samples(view(2, watching->wishes), 1, 1);
    made->job.adapt = true;
    made->job.margin = 0.1f;
    made->job.frame.width = 80;
    made->job.frame.height = 48;
    view_wishes_set_effort(
        watching->wishes, &(struct view_effort){.scale_32nds = 12, .quality = 55, .bytes = 1234, .sparing = true});
    look(watching, 1, false);
    submit(watching->engine, made);
    struct engine_frame *frame = take(expect_frame(watching->engine, 1, 2, 0));
    const float fov_y = frame->request.camera.fov_y;
    assert_true(frame->result.width == 80 && frame->margin_x == 0 && frame->margin_y == 0);
    drop(frame);
    look(watching, 2, true);
    frame = take(expect_frame(watching->engine, 1, 2, 1));
    assert_true(frame->margin_x == 3 && frame->margin_y == 1);
    assert_true(frame->result.width == 30 + 6 && frame->result.height == 18 + 2);
    assert_float_equal(tanf(frame->request.camera.fov_y / 2.0f) / tanf(fov_y / 2.0f), 20.0f / 18.0f, 1e-5f);
    drop(frame);
    look(watching, 3, false);
    frame = take(expect_frame(watching->engine, 1, 2, 2));
    assert_true(frame->result.width == 80 && frame->margin_x == 0);
    drop(frame);
}

static void expect_layer(struct watching *watching, uint32_t number, uint64_t command, uint32_t layer,
                         uint32_t of_frame, enum encoding encoding)
{
    struct engine_frame *frame = take(expect_frame(watching->engine, 1, 2, number));
    assert_int_equal(frame->command, command);
    assert_int_equal(frame->request.hidden_layer, layer);
    assert_int_equal(frame->of_frame, of_frame);
    assert_int_equal(frame->encoding, encoding);
    assert_int_equal(frame->result.samples, layer ? 1 : frame->request.samples);
    drop(frame);
}

/* A stream has pictures alone: what they hide is coded as pictures that stand alone. */
TEST(what_a_picture_hides_follows_it_while_it_moves)
{
    struct watching *watching = *state;
    struct engine_command *made = with_samples(view(2, watching->wishes), 1, 1);
    made->job.hidden_layers = 2;
    made->job.encoding = ENCODING_H264;
    made->job.still_encoding = ENCODING_RAW;
    made->job.frame.format = PIXEL_FORMAT_RGBA8;
    made->job.frame.width = made->job.frame.height = 64;
    look(watching, 1, true);
    submit(watching->engine, made);
    expect_layer(watching, 0, 1, 0, 0, ENCODING_H264);
    expect_layer(watching, 1, 1, 1, 0, ENCODING_JPEG);
    expect_layer(watching, 2, 1, 2, 0, ENCODING_JPEG);
    expect_silence(watching->engine);
    look(watching, 2, true);
    expect_layer(watching, 3, 2, 0, 0, ENCODING_H264);
    expect_layer(watching, 4, 2, 1, 3, ENCODING_JPEG);
    expect_layer(watching, 5, 2, 2, 3, ENCODING_JPEG);
    look(watching, 3, false);
    expect_layer(watching, 6, 3, 0, 0, ENCODING_RAW);
    expect_silence(watching->engine);
}

/* A camera waits whenever a picture ends. What is hidden in one takes as long as that here. */
TEST(what_is_hidden_takes_no_more_than_its_share_while_cameras_come)
{
    struct watching *watching = *state;
    atomic_store(&fake.step_us, 2000);
    struct engine_command *made = with_samples(view(2, watching->wishes), 1, 1);
    made->job.hidden_layers = 1;
    look(watching, 1, true);
    submit(watching->engine, made);
    uint64_t hidden_ns = 0, begin_ns = 0, end_ns = 0, pictures = 0, longest_ns = 0;
    for (uint64_t number = 2; number <= 100; number++) {
        look(watching, number, true);
        struct engine_frame *frame = take(expect_frame(watching->engine, 1, 2, (uint32_t)number - 2));
        const uint64_t took_ns = frame->rendered_ns - frame->applied_ns;
        begin_ns = begin_ns ? begin_ns : frame->applied_ns;
        end_ns = frame->rendered_ns;
        hidden_ns += frame->request.hidden_layer ? took_ns : 0;
        longest_ns = frame->request.hidden_layer && took_ns > longest_ns ? took_ns : longest_ns;
        pictures += !frame->request.hidden_layer;
        drop(frame);
    }
    print_message("%.1f %% of the time\n", 100.0 * (double)hidden_ns / (double)(end_ns - begin_ns));
    assert_true(hidden_ns > 0 && pictures > 70);
    /* The first one, and one that takes longer than the one before it, are not saved for. */
    assert_true((double)hidden_ns < 0.15 * (double)(end_ns - begin_ns) + 2.0 * (double)longest_ns);
}

TEST(less_is_made_for_views_of_the_client_where_time_or_the_link_is_short)
{
    struct watching *watching = *state;
    struct engine_command *made = with_samples(view(2, watching->wishes), 4, 4);
    made->job.adapt = true;
    made->job.margin = 0.25f;
    made->job.hidden_layers = 1;
    made->job.frame.width = made->job.frame.height = 64;
    view_wishes_set_effort(watching->wishes,
                           &(struct view_effort){.samples = 2, .margin_halves_less = 1, .no_hidden = true});
    look(watching, 1, true);
    submit(watching->engine, made);
    struct engine_frame *frame = take(expect_frame(watching->engine, 1, 2, 0));
    assert_int_equal(frame->margin_x, 8);
    assert_int_equal(frame->margin_halves_less, 1);
    assert_int_equal(frame->result.samples, 2);
    const uint64_t rendered_ns = frame->rendered_ns;
    drop(frame);
    frame = take(expect_frame(watching->engine, 1, 2, 1));
    assert_int_equal(frame->request.hidden_layer, 1);
    assert_int_equal(frame->request.width, 40);               /* half of 64 and its margins */
    assert_true(frame->applied_ns - rendered_ns >= 100 * MS); /* nobody has wished anything since */
    drop(frame);
    view_wishes_set_effort(watching->wishes, &(struct view_effort){.margin_halves_less = 2});
    look(watching, 2, true);
    frame = take(expect_frame(watching->engine, 1, 2, 2));
    assert_int_equal(frame->margin_x, 0);
    assert_int_equal(frame->result.samples, 4);
    drop(frame);
}

TEST(a_view_that_cannot_have_what_is_hidden_goes_on_without)
{
    struct watching *watching = *state;
    struct engine_command *made = with_samples(view(2, watching->wishes), 1, 1);
    made->job.hidden_layers = 1;
    atomic_store(&fake.fail_kind, ERROR_LIMIT);
    atomic_store(&fake.fail_from_frame, atomic_load(&fake.frames_begun) + 2);
    look(watching, 1, true);
    submit(watching->engine, made);
    expect_layer(watching, 0, 1, 0, 0, ENCODING_JPEG);
    expect_silence(watching->engine);
    atomic_store(&fake.fail_from_frame, 0);
    look(watching, 2, true);
    expect_layer(watching, 1, 2, 0, 0, ENCODING_JPEG);
    expect_silence(watching->engine);
}

static void expect_form(struct engine_frame *frame, enum encoding encoding, enum ycbcr form)
{
    assert_int_equal(frame->encoding, encoding);
    assert_int_equal(frame->result.ycbcr, form);
    drop(frame);
}

/* The renderer is asked for it before the frame is there; what is encoded is what it was asked for. */
TEST(frames_come_in_the_form_that_their_encoder_takes)
{
    struct watching *watching = *state;
    struct engine *engine = watching->engine;
    struct engine_command *made = with_samples(view(2, watching->wishes), 2, 1);
    made->job.adapt = true;
    view_wishes_set_effort(watching->wishes, &(struct view_effort){.quality = 95, .sparing = true});
    submit(engine, made);
    /* Of rest only its samples tell whether it will be one that loses. */
    expect_form(take(expect_frame(engine, 1, 2, 0)), ENCODING_JPEG, YCBCR_NONE);
    expect_form(take(expect_frame(engine, 1, 2, 1)), ENCODING_RAW, YCBCR_NONE);
    look(watching, 1, true);
    expect_form(take(expect_frame(engine, 1, 2, 2)), ENCODING_JPEG, YCBCR_NONE); /* full chroma */
    view_wishes_set_effort(watching->wishes, &(struct view_effort){.quality = 55, .sparing = true});
    look(watching, 2, true);
    expect_form(take(expect_frame(engine, 1, 2, 3)), ENCODING_JPEG, YCBCR_JPEG);
    look(watching, 3, false);
    expect_form(take(expect_frame(engine, 1, 2, 4)), ENCODING_JPEG, YCBCR_NONE);
    expect_form(take(expect_frame(engine, 1, 2, 5)), ENCODING_RAW, YCBCR_NONE);
}

TEST(rest_that_is_encoded_as_motion_comes_in_the_same_form)
{
    struct watching *watching = *state;
    struct engine_command *made = with_samples(view(2, watching->wishes), 2, 1);
    made->job.still_encoding = ENCODING_JPEG;
    submit(watching->engine, made);
    expect_form(take(expect_frame(watching->engine, 1, 2, 0)), ENCODING_JPEG, YCBCR_JPEG);
    expect_form(take(expect_frame(watching->engine, 1, 2, 1)), ENCODING_JPEG, YCBCR_JPEG);
}

TEST(a_view_that_does_not_adapt_keeps_its_requested_settings)
{
    struct watching *watching = *state;
    struct engine_command *made = with_samples(view(2, watching->wishes), 2, 1);
    view_wishes_set_effort(
        watching->wishes, &(struct view_effort){.scale_32nds = 12, .quality = 55, .bytes = 1234, .sparing = true});
    submit(watching->engine, made);
    expect_picture(watching, 2, 0, 0, 1, ENCODING_RAW);
    expect_picture(watching, 2, 1, 0, 2, ENCODING_RAW);
    look(watching, 1, true);
    struct engine_frame *frame = take(expect_frame(watching->engine, 1, 2, 2));
    assert_int_equal(frame->result.width, 4);
    assert_int_equal(frame->quality, 80);
    drop(frame);
}

TEST(a_camera_that_spans_no_view_ends_it)
{
    struct watching *watching = *state;
    submit(watching->engine, with_samples(view(2, watching->wishes), 1, 1));
    expect_picture(watching, 2, 0, 0, 1, ENCODING_RAW);
    struct view_camera nowhere = camera(1, true);
    memcpy(nowhere.key.look_at_world, nowhere.key.eye_world, sizeof(nowhere.key.eye_world));
    assert_true(view_wishes_look(watching->wishes, &nowhere));
    submit(watching->engine, command(ENGINE_VIEW_LOOK, 1, 0));
    expect_failed(watching->engine, 1, 2, ERROR_INVALID, "view_camera.up_world");
}

/* 20 ms to render, and 16 MiB to hash and copy. */
TEST(the_next_frame_is_rendered_while_one_is_encoded)
{
    struct watching *watching = *state;
    atomic_store(&fake.step_us, 20000);
    struct engine_command *made = with_samples(view(2, watching->wishes), 1000, 1);
    made->job.frame.width = made->job.frame.height = 2048;
    submit(watching->engine, made);
    uint64_t encoded_ns = 0;
    unsigned overlaps = 0;
    for (uint32_t number = 0; number < 6; number++) {
        struct engine_frame *frame = take(expect_frame(watching->engine, 1, 2, number));
        overlaps += frame->applied_ns < encoded_ns;
        encoded_ns = frame->encoded_ns;
        drop(frame);
    }
    assert_true(overlaps > 0); /* of 5; how many it is depends on who else computes */
}

/* The frame before it has taken 300 ns to render until 1000, and is being encoded, which took 500 the last time.
 */
TEST_WITH(a_frame_is_begun_so_that_it_comes_when_the_encoder_is_free, NULL, NULL)
{
    struct queue *events = queue_create(4, false);
    struct view_wishes *wishes = view_wishes_create();
    struct scene *scene = scene_create("", &(struct scene_limits){0});
    struct engine_scene held = {.scene = scene};
    struct job job = {
        .scene = &held,
        .output = job_output_create(&(struct job_output_options){.events = events, .window = 3, .credit = 100}),
        .spec = {.wishes = wishes, .frame.samples = 1, .pass_samples = 1},
        .view = {.credit = 10, .due_ns = 7 * MS, .render_ns = 3 * MS, .rendered_ns = 10 * MS},
    };
    assert_int_equal(view_due_ns(&job), 7 * MS);
    uint64_t position = job_output_reserve(job.output);
    struct engine_event *event = event_create(ENGINE_FRAME, 1, 1);
    event->frame = calloc(1, sizeof(*event->frame));
    stage_times_begin(&event->frame->result.times);
    stage_times_add(&event->frame->result.times, STAGE_ENCODE, CLOCK_CPU, 0, 0, 5 * MS);
    job_output_put(job.output, position, event);
    assert_int_equal(view_due_ns(&job), 7 * MS);
    job_output_reserve(job.output);
    assert_int_equal(view_due_ns(&job), 10 * MS + 5 * MS - 3 * MS - MS / 2);
    job.view.render_ns = 50 * MS;
    assert_int_equal(view_due_ns(&job), 7 * MS);
    job_output_reserve(job.output); /* a second one waits for the encoder */
    assert_true(view_due_ns(&job) == UINT64_MAX);
    job_output_unref(job.output);
    engine_event_destroy(queue_try_pop(events));
    queue_destroy(events, NULL);
    scene_destroy(scene);
    view_wishes_unref(wishes);
}

TEST(a_view_goes_on_after_the_device_was_lost)
{
    struct watching *watching = *state;
    atomic_store(&fake.fail_kind, ERROR_DEVICE_LOST);
    atomic_store(&fake.fail_steps, 1);
    submit(watching->engine, with_samples(view(2, watching->wishes), 4, 2));
    for (uint32_t number = 0; number < 2; number++) {
        struct engine_frame *frame = take(expect_frame(watching->engine, 1, 2, number));
        assert_int_equal(frame->result.samples, 2 * (number + 1));
        drop(frame);
    }
    atomic_store(&fake.fail_steps, 1);
    look(watching, 1, true);
    struct engine_frame *frame = take(expect_frame(watching->engine, 1, 2, 2));
    assert_int_equal(frame->command, 1);
    drop(frame);
    assert_int_equal(atomic_load(&fake.devices_made), 3);
}
