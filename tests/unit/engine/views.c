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

/* The requests of client 1, which has opened scene 1. */
static struct view_mailbox *mailbox;

static struct engine_frame *taken[256]; /* until the test ends */
static size_t taken_count;

static struct engine_frame *take(struct engine_event *event)
{
    assert_true(taken_count < sizeof(taken) / sizeof(taken[0]));
    struct engine_frame *frame = taken[taken_count++] = event->frame;
    event->frame = NULL;
    engine_event_destroy(event);
    return frame;
}

static int begin(void **state)
{
    (void)state;
    start((struct engine_options){.encode_threads = 4});
    mailbox = view_mailbox_create();
    open_scene(1, 1);
    return 0;
}

static int end(void **state)
{
    while (taken_count) {
        struct engine_frame *frame = taken[--taken_count];
        frame_result_finish(&frame->result);
        free(frame->bytes);
        free(frame);
    }
    view_mailbox_unref(mailbox);
    return stop_engine(state);
}

/* Frames need 1 sample of 4, so that they refine; the bound of frames a second is out of the way. */
static struct engine_command *view_of(uint32_t request, struct view_mailbox *wanted)
{
    struct engine_command *made = render(1, request, 0, UINT32_MAX);
    made->job.kind = JOB_VIEW;
    made->job.frames_per_second = 100000;
    made->job.frame.sampling.samples = 4;
    made->job.view.pass_samples = 1;
    made->job.weight = 1;
    made->job.encoding = ENCODING_JPEG;
    made->job.quality = 80;
    made->job.view.still_encoding = ENCODING_RAW;
    made->job.mailbox = view_mailbox_ref(wanted);
    return made;
}

static struct engine_command *view(uint32_t request)
{
    return view_of(request, mailbox);
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

static void set_eye(const struct view_camera *from)
{
    if (view_mailbox_set_camera(mailbox, from))
        submit(command(ENGINE_VIEW_CHANGED, 1, 0));
}

static void look(uint64_t number, bool moving)
{
    struct view_camera made = camera(number, moving);
    set_eye(&made);
}

EACH_TEST(begin, end)

TEST(a_frame_tells_of_the_camera_that_it_shows)
{
    struct engine_command *made = view(2);
    made->job.first_frame = 5;
    made->job.frame.sampling.samples = 1;
    submit(made);
    struct engine_frame *first = take(expect_frame(1, 2, 5));
    assert_int_equal(first->command, 0);
    assert_int_equal(first->received_ns, 0);
    assert_false(first->moving);
    assert_true(first->key_frame);
    expect_silence(); /* nothing changes, and there are enough samples */
    uint64_t before_ns = clock_now_ns();
    look(7, true);
    struct engine_frame *frame = take(expect_frame(1, 2, 6));
    assert_int_equal(frame->command, 7);
    assert_int_equal(frame->received_ns, 1007);
    assert_true(frame->moving);
    assert_true(before_ns <= frame->applied_ns && frame->applied_ns <= frame->rendered_ns);
    assert_true(frame->rendered_ns <= frame->encoded_ns && frame->encoded_ns <= clock_now_ns());
    /* The eye is the camera's place. */
    assert_true(frame->request.camera.world_from_view[7] == 7.0f);
    assert_true(frame->request.camera.world_from_view[11] == 5.0f);
    expect_silence();
}

static struct engine_command *with_samples(struct engine_command *made, uint32_t samples, uint32_t pass_samples)
{
    made->job.frame.sampling.samples = samples;
    made->job.view.pass_samples = pass_samples;
    return made;
}

static void expect_picture(uint32_t request, uint32_t number, uint64_t command_number, uint32_t samples,
                           enum encoding encoding)
{
    struct engine_frame *frame = take(expect_frame(1, request, number));
    if (frame->command != command_number || frame->result.samples != samples || frame->encoding != encoding)
        fail_msg("frame %u shows command %d with %u samples in encoding %d; expected %d, %u, %d", number,
                 (int)frame->command, frame->result.samples, frame->encoding, (int)command_number, samples,
                 encoding);
}

TEST(of_many_cameras_the_newest_is_shown)
{
    submit(gated(with_samples(view(2), 1, 1)));
    look(1, true);
    wait_until(&fake.frames_begun, 1);
    for (uint64_t number = 2; number <= 500; number++)
        look(number, true);
    expect_silence();
    assert_int_equal(atomic_load(&fake.frames_begun), 1); /* a frame that shows something new is finished */
    atomic_store(&fake.gate_open, true);
    struct engine_event *event = next_event();
    assert_true(event->frame->command <= 1); /* the frame may have been begun before the first camera came */
    engine_event_destroy(event);
    expect_picture(2, 1, 500, 1, ENCODING_JPEG);
    expect_silence();
}

TEST(a_picture_that_rests_is_refined_until_it_has_its_samples)
{
    submit(with_samples(view(2), 7, 3));
    expect_picture(2, 0, 0, 3, ENCODING_RAW);
    expect_picture(2, 1, 0, 6, ENCODING_RAW);
    expect_picture(2, 2, 0, 7, ENCODING_RAW);
    expect_silence();
    look(1, true);
    expect_picture(2, 3, 1, 3, ENCODING_JPEG);
    expect_silence(); /* the camera moves: more will follow */
    struct view_camera stays = camera(1, false);
    stays.command = 2; /* an equal place: the samples so far count */
    set_eye(&stays);
    expect_picture(2, 4, 2, 6, ENCODING_RAW);
    expect_picture(2, 5, 2, 7, ENCODING_RAW);
    expect_silence();
}

/* The error of N samples is 1 / N here. */
TEST(a_picture_that_rests_is_refined_until_its_error_is_as_small_as_wanted)
{
    struct engine_command *made = with_samples(view(2), 1000, 3);
    made->job.frame.sampling.noise = 0.12f;
    submit(made);
    expect_picture(2, 0, 0, 3, ENCODING_RAW);
    expect_picture(2, 1, 0, 6, ENCODING_RAW);
    expect_picture(2, 2, 0, 9, ENCODING_RAW);
    expect_silence();
    look(1, false); /* another place, of which nothing is known */
    expect_picture(2, 3, 1, 3, ENCODING_RAW);
    expect_picture(2, 4, 1, 6, ENCODING_RAW);
    expect_picture(2, 5, 1, 9, ENCODING_RAW);
    expect_silence();
}

TEST(an_edit_of_the_scene_begins_anew)
{
    submit(with_samples(view(2), 2, 1));
    expect_picture(2, 0, 0, 1, ENCODING_RAW);
    expect_picture(2, 1, 0, 2, ENCODING_RAW);
    expect_silence();
    submit_commit(1, 3, 1);
    assert_int_equal(expect_done(1, 3), 1);
    struct engine_frame *frame = take(expect_frame(1, 2, 2));
    assert_int_equal(frame->result.revision, 1);
    assert_int_equal(frame->result.samples, 1);
    expect_picture(2, 3, 0, 2, ENCODING_RAW);
    expect_silence();
}

/* The view has shown a frame, and a refining one is in progress until the gate is opened. */
static void start_refining(void)
{
    atomic_store(&fake.gate_open, true);
    struct engine_command *made = gated(with_samples(view(2), 1000, 1));
    made->job.credit = 1;
    submit(made);
    expect_picture(2, 0, 0, 1, ENCODING_RAW);
    atomic_store(&fake.gate_open, false);
    submit_target(ENGINE_JOB_CREDIT, 1, 0, 2, 2);
    wait_until(&fake.frames_begun, 2);
}

TEST(a_new_camera_interrupts_refining)
{
    start_refining();
    look(9, true);
    wait_until(&fake.frames_begun, 3);
    assert_int_equal(atomic_load(&fake.frames_abandoned), 1);
    look(10, true);
    expect_silence();
    assert_int_equal(atomic_load(&fake.frames_abandoned), 1); /* a frame that shows something new is finished */
    atomic_store(&fake.gate_open, true);
    expect_picture(2, 1, 9, 1, ENCODING_JPEG);
    expect_silence(); /* there is no credit for a third */
}

TEST(an_edit_interrupts_refining)
{
    start_refining();
    submit_commit(1, 3, 1);
    assert_int_equal(expect_done(1, 3), 1); /* the gate is closed still */
    atomic_store(&fake.gate_open, true);
    struct engine_frame *frame = take(expect_frame(1, 2, 1));
    assert_int_equal(frame->result.revision, 1);
    assert_int_equal(frame->result.samples, 1);
}

TEST(a_view_shows_cameras_while_an_edit_waits_for_a_long_batch_frame)
{
    submit(gated(render(1, 9, 0, 0)));
    wait_until(&fake.frames_begun, 1);
    submit_commit(1, 3, 1); /* for the frame of the batch */
    /* This view follows the edit, and is not begun before it. */
    submit(view(2));
    expect_silence();
    atomic_store(&fake.gate_open, true);
    /* The view's frames may come before the batch's own has been encoded. */
    for (int answers = 0, samples = 0; answers < 2 || samples < 4;) {
        struct engine_event *event = next_event();
        answers += event->kind == ENGINE_DONE;
        samples += event->kind == ENGINE_FRAME && event->request == 2;
        engine_event_destroy(event);
    }
    /* Now the view is there before. */
    atomic_store(&fake.gate_open, false);
    int begun = atomic_load(&fake.frames_begun);
    submit(gated(render(1, 10, 0, 0)));
    wait_until(&fake.frames_begun, begun + 1);
    submit_commit(1, 4, 1);
    for (uint64_t number = 1; number <= 5; number++) {
        look(number, number < 5);
        struct engine_frame *frame = take(expect_frame(1, 2, 3 + (uint32_t)number));
        assert_int_equal(frame->command, number);
        assert_int_equal(frame->result.revision, 1);
    }
    expect_silence(); /* a frame at rest is not refined to be thrown away */
    atomic_store(&fake.gate_open, true);
    uint32_t shown = 0;
    for (bool applied = false; !applied || shown < 4;) {
        struct engine_event *event = next_event();
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
    struct engine_command *made = with_samples(view(2), 1, 1);
    made->job.credit = 0;
    submit(made);
    look(1, true);
    expect_silence();
    assert_int_equal(atomic_load(&fake.frames_begun), 0);
    look(2, true);
    submit_target(ENGINE_JOB_CREDIT, 1, 0, 2, 1);
    expect_picture(2, 0, 2, 1, ENCODING_JPEG);
    look(3, true);
    expect_silence();
    assert_int_equal(atomic_load(&fake.frames_begun), 1);
}

TEST(no_more_frames_come_than_were_asked_for_a_second)
{
    struct engine_command *made = with_samples(view(2), 1000, 1);
    made->job.frames_per_second = 100;
    submit(made);
    uint64_t first_ns = 0, last_ns = 0;
    for (uint32_t number = 0; number < 11; number++) {
        struct engine_frame *frame = take(expect_frame(1, 2, number));
        first_ns = number ? first_ns : frame->applied_ns;
        last_ns = frame->applied_ns;
    }
    assert_true(last_ns - first_ns >= 10 * UINT64_C(10000000));
}

static void expect_key(struct engine_frame *frame, bool wants_key)
{
    assert_int_equal(frame->wants_key, wants_key);
}

TEST(a_complete_picture_comes_again_as_a_key_frame_and_not_with_more_samples)
{
    submit(with_samples(view(2), 7, 3));
    for (uint32_t number = 0; number < 3; number++)
        expect_key(take(expect_frame(1, 2, number)), false);
    for (uint32_t number = 3; number < 5; number++) {
        assert_true(view_mailbox_request_key_frame(mailbox));
        submit(command(ENGINE_VIEW_CHANGED, 1, 0));
        struct engine_frame *frame = take(expect_frame(1, 2, number));
        assert_true(frame->wants_key);
        assert_int_equal(frame->result.samples, 7);
        expect_silence();
    }
}

/* Takes the frame that shows the next camera. */
static struct engine_frame *take_next(uint64_t number, bool moving)
{
    look(number, moving);
    struct engine_frame *frame = take(next_event());
    assert_int_equal(frame->command, number);
    return frame;
}

static void expect_encoded(struct engine_frame *frame, enum encoding encoding, bool key_frame)
{
    assert_int_equal(frame->encoding, encoding);
    assert_int_equal(frame->key_frame, key_frame);
}

TEST(a_stream_continues_over_frames_at_rest_and_restarts_on_request)
{
    if (!encoder_stream_supports(ENCODING_H264, 4)) {
        print_message("skipped: no encoder of H.264 is here\n");
        return;
    }
    struct engine_command *made = with_samples(view(2), 1, 1);
    made->job.encoding = ENCODING_H264;
    submit(made);
    expect_encoded(take(expect_frame(1, 2, 0)), ENCODING_RAW, true);
    expect_encoded(take_next(1, true), ENCODING_H264, true);
    expect_encoded(take_next(2, true), ENCODING_H264, false);
    expect_encoded(take_next(3, false), ENCODING_RAW, true);
    expect_encoded(take_next(4, true), ENCODING_H264, false);
    /* A camera at rest has a frame at once, and the stream begins again with the next motion. */
    look(5, false);
    expect_encoded(take(next_event()), ENCODING_RAW, true);
    assert_true(view_mailbox_request_key_frame(mailbox));
    submit(command(ENGINE_VIEW_CHANGED, 1, 0));
    expect_encoded(take(next_event()), ENCODING_RAW, true);
    expect_encoded(take_next(6, true), ENCODING_H264, true);
    expect_encoded(take_next(7, true), ENCODING_H264, false);
    /* So it does with a view that takes the place of this one. */
    made = with_samples(view(3), 1, 1);
    made->job.encoding = made->job.view.still_encoding = ENCODING_H264;
    submit(made);
    expect_done(1, 2);
    expect_encoded(take(next_event()), ENCODING_H264, true);
    expect_encoded(take_next(8, false), ENCODING_H264, false);
}

TEST(a_view_takes_the_place_of_another_and_goes_on_from_it)
{
    struct view_mailbox *others = view_mailbox_create();
    open_scene(1, 7);
    submit(with_samples(view(2), 1, 1));
    expect_picture(2, 0, 0, 1, ENCODING_RAW);
    submit(with_samples(view_of(20, others), 1, 1)); /* another view of the same client */
    expect_picture(20, 0, 0, 1, ENCODING_RAW);
    look(3, true);
    expect_picture(2, 1, 3, 1, ENCODING_JPEG);
    struct engine_command *made = with_samples(view(4), 1, 1);
    made->job.encoding = ENCODING_ZSTD;
    made->scene = 7;
    submit(made);
    expect_done(1, 2);
    expect_picture(4, 2, 3, 1, ENCODING_ZSTD);
    expect_silence();
    /* A view that cannot be made changes nothing. */
    made = view(5);
    made->job.frame.tracing.tracer = 99;
    submit(made);
    expect_failed(1, 5, ERROR_UNSUPPORTED, "render.tracer");
    look(6, true);
    expect_picture(4, 3, 6, 1, ENCODING_ZSTD);
    view_mailbox_unref(others);
}

TEST(a_frame_in_progress_ends_with_the_view_that_is_replaced)
{
    submit(gated(view(2)));
    wait_until(&fake.frames_begun, 1);
    submit(with_samples(view(3), 1, 1));
    expect_done(1, 2);
    wait_until(&fake.frames_abandoned, 1);
    expect_picture(3, 0, 0, 1, ENCODING_RAW);
}

TEST(a_cancelled_view_ends_whatever_it_does)
{
    submit(with_samples(view(2), 1, 1));
    expect_picture(2, 0, 0, 1, ENCODING_RAW);
    submit_target(ENGINE_JOB_CANCEL, 1, 3, 2, 0); /* at rest */
    expect_failed(1, 2, ERROR_CANCELLED, "");
    expect_done(1, 3);
    submit(gated(view(4)));
    wait_until(&fake.frames_begun, 2);
    submit_target(ENGINE_JOB_CANCEL, 1, 5, 4, 0); /* in a frame */
    expect_failed(1, 4, ERROR_CANCELLED, "");
    expect_done(1, 5);
    look(1, true);
    expect_silence();
    submit(gated(view(6)));
    wait_until(&fake.frames_begun, 3);
    submit(command(ENGINE_CLIENT_GONE, 1, 0));
    expect_forgotten(1);
    expect_silence();
}

/* Rows: a view's request, what the link carries, and the frame that is rendered then. The view has 80x48 pixels
 * while it moves, 8 bounces, and 2 samples of which each frame adds one. */
TEST(effort_counts_for_a_view_that_moves_and_asked_for_it)
{
    const struct view_effort small = {.scale_32nds = 12, .quality = 55, .bytes = 1234, .sparing = true};
    static const char *const names[] = {"adapts", "keeps a rate", "with a margin", "with half a margin",
                                        "as asked"};
    const struct {
        bool adapt, keeps_rate;
        float margin;
        struct view_effort effort;
        uint32_t width, height, margin_x, margin_y, depth, quality;
        uint64_t bytes;
        enum encoding first; /* where the link is to be spared, until all samples are there */
    } rows[] = {
        {true, false, 0, small, 30, 18, 0, 0, 8, 55, 1234, ENCODING_JPEG},
        {false, true, 0, {.scale_32nds = 20, .depth_less = 6}, 50, 30, 0, 0, 2, 80, 0, ENCODING_RAW},
        {true, false, 0.1f, small, 30 + 6, 18 + 2, 3, 1, 8, 55, 1234, ENCODING_JPEG},
        {true, false, 0.25f, {.margin_halves_less = 1}, 80 + 20, 48 + 12, 10, 6, 8, 80, 0, ENCODING_RAW},
        {false, false, 0, small, 80, 48, 0, 0, 8, 80, 0, ENCODING_RAW},
    };
    for (uint32_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++) {
        struct engine_command *made = with_samples(view(2 + i), 2, 1);
        const uint64_t number = 10 * (i + 1);
        made->job.view.adapt = rows[i].adapt;
        made->job.view.moving_rate = rows[i].keeps_rate ? 10.0f : 0.0f;
        made->job.view.margin = rows[i].margin;
        made->job.frame.light.depth = 8;
        made->job.frame.picture.width = 80;
        made->job.frame.picture.height = 48;
        view_mailbox_set_effort(mailbox, &rows[i].effort);
        look(number, false);
        submit(made);
        float fov_y = 0;
        for (uint32_t samples = 1; samples <= 2; samples++) {
            struct engine_frame *frame = take(expect_frame(1, 2 + i, samples - 1));
            if (frame->result.width != 80 || frame->result.height != 48 || frame->margin_x || frame->depth_less)
                fail_msg("%s: %ux%u at rest", names[i], frame->result.width, frame->result.height);
            assert_int_equal(frame->encoding, samples == 1 ? rows[i].first : ENCODING_RAW);
            fov_y = frame->request.camera.fov_y;
        }
        look(number + 1, true);
        struct engine_frame *frame = take(expect_frame(1, 2 + i, 2));
        if (frame->result.width != rows[i].width || frame->result.height != rows[i].height ||
            frame->margin_x != rows[i].margin_x || frame->margin_y != rows[i].margin_y ||
            frame->request.light.depth != rows[i].depth || frame->quality != rows[i].quality ||
            frame->wanted_bytes != rows[i].bytes)
            fail_msg("%s: %ux%u with a margin of %ux%u, %u bounces, quality %u, %d bytes", names[i],
                     frame->result.width, frame->result.height, frame->margin_x, frame->margin_y,
                     frame->request.light.depth, frame->quality, (int)frame->wanted_bytes);
        /* A margin keeps as many pixels a radian. */
        assert_float_equal(tanf(frame->request.camera.fov_y / 2.0f) / tanf(fov_y / 2.0f),
                           (float)rows[i].height / (float)(rows[i].height - 2 * rows[i].margin_y), 1e-5f);
        look(number + 2, false);
        for (uint32_t samples = 1; samples <= 2; samples++)
            take(expect_frame(1, 2 + i, 2 + samples));
        submit_target(ENGINE_JOB_CANCEL, 1, 100 + i, 2 + i, 0);
        expect_failed(1, 2 + i, ERROR_CANCELLED, "");
        expect_done(1, 100 + i);
    }
}

static void expect_layer(uint32_t number, uint64_t command, uint32_t layer, uint32_t of_frame,
                         enum encoding encoding)
{
    struct engine_frame *frame = take(expect_frame(1, 2, number));
    assert_int_equal(frame->command, command);
    assert_int_equal(frame->request.hidden_layer, layer);
    assert_int_equal(frame->of_frame, of_frame);
    assert_int_equal(frame->encoding, encoding);
    assert_int_equal(frame->result.samples, layer ? 1 : frame->request.sampling.samples);
}

/* A stream has pictures alone: what they hide is coded as pictures that stand alone. */
TEST(what_a_picture_hides_follows_it_while_it_moves)
{
    struct engine_command *made = with_samples(view(2), 1, 1);
    made->job.view.hidden_layers = 2;
    made->job.encoding = ENCODING_H264;
    made->job.view.still_encoding = ENCODING_RAW;
    made->job.frame.picture.format = PIXEL_FORMAT_RGBA8;
    made->job.frame.picture.width = made->job.frame.picture.height = 64;
    look(1, true);
    submit(made);
    expect_layer(0, 1, 0, 0, ENCODING_H264);
    expect_layer(1, 1, 1, 0, ENCODING_JPEG);
    expect_layer(2, 1, 2, 0, ENCODING_JPEG);
    expect_silence();
    look(2, true);
    expect_layer(3, 2, 0, 0, ENCODING_H264);
    expect_layer(4, 2, 1, 3, ENCODING_JPEG);
    expect_layer(5, 2, 2, 3, ENCODING_JPEG);
    look(3, false);
    expect_layer(6, 3, 0, 0, ENCODING_RAW);
    expect_silence();
}

/* A camera waits whenever a picture ends. What is hidden in one takes as long as that here. */
TEST(what_is_hidden_takes_no_more_than_its_share_while_cameras_come)
{
    clock_stop();
    atomic_store(&fake.step_us, 2000);
    struct engine_command *made = with_samples(view(2), 1, 1);
    made->job.view.hidden_layers = 1;
    look(1, true);
    submit(made);
    expect_layer(0, 1, 0, 0, ENCODING_JPEG);
    clock_let_pass(100 * MS);
    expect_layer(1, 1, 1, 0, ENCODING_JPEG); /* in spare time: now its cost is known */
    uint64_t hidden_ns = 0, begin_ns = 0, end_ns = 0, pictures = 0, longest_ns = 0;
    for (uint64_t number = 2; number <= 100; number++) {
        look(number, true);
        struct engine_frame *frame = take(expect_frame(1, 2, (uint32_t)number));
        const uint64_t took_ns = frame->rendered_ns - frame->applied_ns;
        begin_ns = begin_ns ? begin_ns : frame->applied_ns;
        end_ns = frame->rendered_ns;
        hidden_ns += frame->request.hidden_layer ? took_ns : 0;
        longest_ns = frame->request.hidden_layer && took_ns > longest_ns ? took_ns : longest_ns;
        pictures += !frame->request.hidden_layer;
    }
    assert_true(hidden_ns > 0 && pictures > 70);
    /* A layer that takes longer than the previous one is not saved for. */
    assert_true((double)hidden_ns < 0.15 * (double)(end_ns - begin_ns) + 2.0 * (double)longest_ns);
}

TEST(less_is_made_for_views_of_the_client_where_time_or_the_link_is_short)
{
    struct engine_command *made = with_samples(view(2), 4, 4);
    made->job.view.adapt = true;
    made->job.view.margin = 0.25f;
    made->job.view.hidden_layers = 1;
    made->job.frame.picture.width = made->job.frame.picture.height = 64;
    view_mailbox_set_effort(mailbox,
                            &(struct view_effort){.samples = 2, .margin_halves_less = 1, .no_hidden = true});
    look(1, true);
    submit(made);
    struct engine_frame *frame = take(expect_frame(1, 2, 0));
    assert_int_equal(frame->margin_x, 8);
    assert_int_equal(frame->margin_halves_less, 1);
    assert_int_equal(frame->result.samples, 2);
    const uint64_t rendered_ns = frame->rendered_ns;
    frame = take(expect_frame(1, 2, 1));
    assert_int_equal(frame->request.hidden_layer, 1);
    assert_int_equal(frame->request.picture.width, 40);       /* half of 64 and its margins */
    assert_true(frame->applied_ns - rendered_ns >= 100 * MS); /* nobody has wished anything since */
    view_mailbox_set_effort(mailbox, &(struct view_effort){.margin_halves_less = 2});
    look(2, true);
    frame = take(expect_frame(1, 2, 2));
    assert_int_equal(frame->margin_x, 0);
    assert_int_equal(frame->result.samples, 4);
}

TEST(a_view_that_cannot_have_what_is_hidden_goes_on_without)
{
    struct engine_command *made = with_samples(view(2), 1, 1);
    made->job.view.hidden_layers = 1;
    atomic_store(&fake.fail_kind, ERROR_LIMIT);
    atomic_store(&fake.fail_from_frame, atomic_load(&fake.frames_begun) + 2);
    look(1, true);
    submit(made);
    expect_layer(0, 1, 0, 0, ENCODING_JPEG);
    for (int i = 0; i < 60000 && atomic_load(&fake.fail_steps) == 0; i++)
        usleep(1000);
    assert_true(atomic_load(&fake.fail_steps) < 0); /* the frame of what is hidden has failed */
    expect_silence();
    atomic_store(&fake.fail_from_frame, 0);
    look(2, true);
    expect_layer(1, 2, 0, 0, ENCODING_JPEG);
    expect_silence();
}

static void expect_form(struct engine_frame *frame, enum encoding encoding, enum ycbcr form)
{
    assert_int_equal(frame->encoding, encoding);
    assert_int_equal(frame->result.ycbcr, form);
}

/* The renderer is asked for it before the frame is there; what is encoded is what it was asked for. */
TEST(frames_come_in_the_form_that_their_encoder_takes)
{
    struct engine_command *made = with_samples(view(2), 2, 1);
    made->job.view.adapt = true;
    view_mailbox_set_effort(mailbox, &(struct view_effort){.quality = 95, .sparing = true});
    submit(made);
    /* Only its samples tell whether a frame at rest will be lossy. */
    expect_form(take(expect_frame(1, 2, 0)), ENCODING_JPEG, YCBCR_NONE);
    expect_form(take(expect_frame(1, 2, 1)), ENCODING_RAW, YCBCR_NONE);
    look(1, true);
    expect_form(take(expect_frame(1, 2, 2)), ENCODING_JPEG, YCBCR_NONE); /* full chroma */
    view_mailbox_set_effort(mailbox, &(struct view_effort){.quality = 55, .sparing = true});
    look(2, true);
    expect_form(take(expect_frame(1, 2, 3)), ENCODING_JPEG, YCBCR_JPEG);
    look(3, false);
    expect_form(take(expect_frame(1, 2, 4)), ENCODING_JPEG, YCBCR_NONE);
    expect_form(take(expect_frame(1, 2, 5)), ENCODING_RAW, YCBCR_NONE);
    /* Rest that is encoded as motion comes in the same form. */
    made = with_samples(view(3), 2, 1);
    made->job.view.still_encoding = ENCODING_JPEG;
    submit(made);
    expect_done(1, 2);
    look(4, false);
    expect_form(take(expect_frame(1, 3, 6)), ENCODING_JPEG, YCBCR_JPEG);
    expect_form(take(expect_frame(1, 3, 7)), ENCODING_JPEG, YCBCR_JPEG);
}

TEST(a_camera_that_spans_no_view_ends_it)
{
    submit(with_samples(view(2), 1, 1));
    expect_picture(2, 0, 0, 1, ENCODING_RAW);
    struct view_camera nowhere = camera(1, true);
    memcpy(nowhere.key.look_at_world, nowhere.key.eye_world, sizeof(nowhere.key.eye_world));
    assert_true(view_mailbox_set_camera(mailbox, &nowhere));
    submit(command(ENGINE_VIEW_CHANGED, 1, 0));
    expect_failed(1, 2, ERROR_INVALID, "view_camera.up_world");
}

/* The frame before it has taken 300 ns to render until 1000, and is being encoded, which took 500 the last time.
 */
TEST_WITH(a_frame_is_begun_so_that_it_comes_when_the_encoder_is_free, NULL, NULL)
{
    struct queue *events = queue_create(4, false);
    struct view_mailbox *own = view_mailbox_create();
    struct scene *scene = scene_create("", &(struct scene_limits){0});
    struct engine_scene held = {.scene = scene};
    struct job job = {
        .scene = &held,
        .output = job_output_create(&(struct job_output_options){.events = events, .window = 3, .credit = 100}),
        .spec = {.mailbox = own, .frame.sampling.samples = 1, .view.pass_samples = 1},
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
    view_mailbox_unref(own);
}

TEST(a_view_goes_on_after_the_device_was_lost)
{
    atomic_store(&fake.fail_kind, ERROR_DEVICE_LOST);
    atomic_store(&fake.fail_steps, 1);
    submit(with_samples(view(2), 4, 2));
    for (uint32_t number = 0; number < 2; number++) {
        struct engine_frame *frame = take(expect_frame(1, 2, number));
        assert_int_equal(frame->result.samples, 2 * (number + 1));
    }
    atomic_store(&fake.fail_steps, 1);
    look(1, true);
    struct engine_frame *frame = take(expect_frame(1, 2, 2));
    assert_int_equal(frame->command, 1);
    assert_int_equal(atomic_load(&fake.devices_made), 3);
}
