/* SPDX-License-Identifier: MIT */
/* Views of the library against a daemon that a thread of the test plays: cameras, frames, acknowledgements and
 * credit, a view that another takes the place of, a job beside it, and what a hostile daemon may try. */
#include "tests/unit/client/played_daemon.h"
#include "protocol/common/clock.h"
#include "tests/harness/test.h"

#include <semaphore.h>
#include <xxhash.h>

#define EDGE 16u
#define IN_FLIGHT 3u

#define FRAME_BYTES ((size_t)EDGE * EDGE * 4)
static uint8_t pixels[(EDGE + 1) * EDGE * 4]; /* for a frame that is a column too wide */

/* Messages of the client; read once the daemon's thread has ended. */
static struct {
    unsigned renders, cameras, acks, begun_acks, key_frames, cancels;
    uint64_t credit, last_command;
    uint32_t last_acked;
    struct message_render first, last;
    bool was_moving, closed_after_cancel;
    uint32_t node;
} seen;

static struct message_render some_options(void)
{
    struct message_render options = fl_view_defaults();
    options.picture.width = options.picture.height = EDGE;
    options.credit = IN_FLIGHT;
    options.picture.exposure_stops = 1;
    options.view.still_encoding = PROTOCOL_ENCODING_ZSTD;
    options.view.pass_samples = 2;
    options.weight = 5;
    options.view.adapt = 1;
    return options;
}

static struct message_render usual_options; /* some_options() */
static int begin(void **state)
{
    (void)state;
    memset(&seen, 0, sizeof(seen));
    usual_options = some_options();
    for (size_t i = 0; i < sizeof(pixels); i++)
        pixels[i] = (uint8_t)i;
    return 0;
}

static struct message_frame_begin some_frame(uint32_t number, uint64_t command)
{
    return (struct message_frame_begin){.frame = number,
                                        .width = EDGE,
                                        .height = EDGE,
                                        .samples = 1,
                                        .layers = 1,
                                        .command = command,
                                        .received_ns = 5,
                                        .applied_ns = 6,
                                        .rendered_ns = 7,
                                        .key_frame = 1,
                                        .size_bytes = FRAME_BYTES,
                                        .digest = XXH3_64bits(pixels, FRAME_BYTES)};
}

static void send_begin(struct daemon *daemon, uint32_t request, const struct message_frame_begin *frame)
{
    struct message message = {.type = MESSAGE_FRAME_BEGIN, .frame_begin = *frame};
    tell(daemon, request, &message);
}

static void tell_rest(struct daemon *daemon, uint32_t request, const struct message_frame_begin *frame)
{
    struct message message = {.type = MESSAGE_FRAME_DATA};
    message.frame_data.data = pixels;
    message.frame_data.data_bytes = (uint32_t)frame->size_bytes;
    tell(daemon, request, &message);
    message = (struct message){.type = MESSAGE_FRAME_END};
    message.frame_end.frame = frame->frame;
    tell(daemon, request, &message);
}

static void send_frame(struct daemon *daemon, uint32_t request, const struct message_frame_begin *frame)
{
    send_begin(daemon, request, frame);
    tell_rest(daemon, request, frame);
}

/* Notes what it sees of the client's next message; false at the end. */
static bool look(struct daemon *daemon)
{
    if (!take(daemon))
        return false;
    switch (asked.type) {
    case MESSAGE_RENDER:
        seen.last = asked.render;
        if (seen.renders++ == 0)
            seen.first = asked.render;
        break;
    case MESSAGE_VIEW_CAMERA:
        seen.cameras++;
        seen.last_command = asked.view_camera.command;
        seen.was_moving = asked.view_camera.moving != 0;
        seen.node = asked.view_camera.node;
        break;
    case MESSAGE_FRAME_ACK:
        seen.acks += asked.frame_ack.want_key_frame == 0 && asked.frame_ack.whole;
        seen.begun_acks += !asked.frame_ack.whole;
        seen.key_frames += asked.frame_ack.want_key_frame;
        seen.last_acked = asked.frame_ack.frame;
        break;
    case MESSAGE_CREDIT:
        seen.credit = asked.credit.total;
        break;
    case MESSAGE_CANCEL:
        seen.cancels++;
        break;
    default:
        break;
    }
    return true;
}

/* A frame for each camera, as a daemon does it that is never behind; another render takes the view's place. */
static void play_view(struct daemon *daemon)
{
    uint32_t request = 0, number = 0;
    greet(daemon);
    while (look(daemon)) {
        if (asked.type == MESSAGE_RENDER && asked.render.kind == PROTOCOL_JOB_VIEW) {
            const struct message_frame_begin frame = some_frame(number++, seen.last_command);
            if (request != 0)
                send_type(daemon, request, MESSAGE_OK);
            request = header.request;
            send_frame(daemon, request, &frame);
        } else if (asked.type == MESSAGE_RENDER) {
            const struct message_frame_begin frame = some_frame(asked.render.first_frame, 0);
            send_frame(daemon, header.request, &frame);
            send_type(daemon, header.request, MESSAGE_OK);
        } else if (asked.type == MESSAGE_VIEW_CAMERA) {
            const struct message_frame_begin frame = some_frame(number++, asked.view_camera.command);
            send_frame(daemon, request, &frame);
        } else if (asked.type == MESSAGE_PING) {
            send_type(daemon, header.request, MESSAGE_PONG);
        }
    }
}

static const struct fl_view_camera some_camera = {
    .eye_world = {0, 0, 5}, .up_world = {0, 1, 0}, .fov_y = 0.7f, .time_s = 1.5f, .moving = true, .node = 9};

static struct fl_view *start_view(struct fl_scene *of)
{
    error = (struct fl_error){0};
    const struct message_render options = some_options();
    struct fl_view *view = fl_view_start(of, &options, &error);
    if (!view)
        fail_msg("%s", error.text);
    return view;
}

static struct fl_scene scene;

static void connect_scene(void (*play)(struct daemon *daemon))
{
    connect_to_played(play);
    scene = (struct fl_scene){.connection = connection, .scene = 1};
}

static struct fl_view *begin_view(void (*play)(struct daemon *daemon))
{
    connect_scene(play);
    return start_view(&scene);
}

/* From then on `seen` is all that the daemon saw. */
static void end_view(struct fl_view *view)
{
    fl_view_destroy(view);
    leave_played();
}

static struct fl_frame *next_frame(struct fl_view *view)
{
    struct fl_frame *frame = fl_view_next(view, 10000, &error);
    if (!frame)
        fail_msg("no frame: %s", error.text);
    return frame;
}

EACH_TEST(begin, end_played)

TEST(cameras_are_sent_and_frames_name_them_with_their_times)
{
    struct fl_view *view = begin_view(play_view);
    assert_null(fl_view_start(&scene, &usual_options, &error)); /* a second view is refused */
    fl_frame_destroy(next_frame(view));
    for (uint64_t i = 1; i <= 5; i++) {
        uint64_t command = 0;
        const uint64_t before_ns = monotonic_now_ns();
        assert_true(fl_view_set_camera(view, &some_camera, &command, &error));
        assert_int_equal(command, i);
        struct fl_frame *frame = next_frame(view);
        assert_int_equal(frame->frame, i);
        assert_int_equal(frame->command, i);
        assert_in_range(frame->command_sent_ns, before_ns, frame->begun_ns);
        assert_in_range(frame->whole_ns, frame->begun_ns, monotonic_now_ns());
        assert_int_equal(frame->command_received_ns, 5);
        assert_int_equal(frame->command_applied_ns, 6);
        assert_int_equal(frame->rendered_ns, 7);
        assert_true(frame->key_frame);
        assert_memory_equal(frame->pixels, pixels, FRAME_BYTES);
        fl_frame_destroy(frame);
    }
    end_view(view);
    assert_int_equal(seen.first.kind, PROTOCOL_JOB_VIEW);
    assert_int_equal(seen.first.sampling.samples, 64);
    assert_int_equal(seen.first.frames_per_second, 60);
    assert_int_equal(seen.first.view.still_encoding, PROTOCOL_ENCODING_ZSTD);
    assert_int_equal(seen.first.view.pass_samples, 2);
    assert_int_equal(seen.first.weight, 5);
    assert_int_equal(seen.first.view.adapt, 1);
    assert_int_equal(seen.first.credit, IN_FLIGHT);
    assert_true(seen.first.picture.exposure_stops == 1);
    assert_true(seen.was_moving);
    assert_int_equal(seen.node, 9);
    assert_int_equal(seen.cancels, 1);
}

/* Every frame is acknowledged once it is whole, and makes room for another once it is taken. */
TEST(frames_are_acknowledged_and_credit_follows_the_frames_consumed)
{
    struct fl_view *view = begin_view(play_view);
    assert_true(fl_view_want_key_frame(view, &error)); /* the first one stands alone anyway */
    fl_frame_destroy(next_frame(view));
    for (unsigned i = 0; i < 2; i++)
        assert_true(fl_view_set_camera(view, &some_camera, NULL, &error));
    fl_frame_destroy(next_frame(view));
    uint64_t ns = 0;
    assert_true(fl_ping(connection, &ns, &error)); /* the third frame comes meanwhile and is kept */
    assert_true(fl_view_want_key_frame(view, &error));
    fl_frame_destroy(next_frame(view));
    assert_null(fl_view_next(view, 0, &error));
    assert_int_equal(error.code, FL_ERROR_NONE);
    end_view(view);
    assert_int_equal(seen.begun_acks, 3);
    assert_int_equal(seen.acks, 3);
    assert_int_equal(seen.last_acked, 2);
    assert_int_equal(seen.key_frames, 1);
    assert_int_equal(seen.credit, IN_FLIGHT + 3);
}

/* Sends one more frame of the old size before a new render takes its place, if the new one is wide. */
static void play_changes(struct daemon *daemon)
{
    uint32_t request = 0, number = 0;
    greet(daemon);
    while (look(daemon)) {
        const struct message_frame_begin frame = some_frame(number, seen.last_command);
        if (asked.type == MESSAGE_RENDER) {
            if (request != 0 && asked.render.picture.width > EDGE)
                send_frame(daemon, request, &frame);
            number += request != 0 && asked.render.picture.width > EDGE;
            if (request != 0)
                send_type(daemon, request, MESSAGE_OK);
            request = header.request;
        } else if (asked.type == MESSAGE_VIEW_CAMERA) {
            send_frame(daemon, request, &frame); /* smaller than what was asked for, as one that adapts */
            number++;
        }
    }
}

TEST(a_changed_view_takes_frames_of_both_sizes_and_counts_on)
{
    struct fl_view *view = begin_view(play_changes);
    struct message_render options = some_options();
    uint32_t number = 0;
    options.tracing.tracer = PROTOCOL_TRACER_LDC;
    for (unsigned i = 0; i < 40; i++) {
        options.picture.width = i >= 20 ? 2 * EDGE : EDGE;
        if (!fl_view_change(view, &options, &error) || !fl_view_set_camera(view, &some_camera, NULL, &error))
            fail_msg("%s", error.text);
        for (unsigned frames = i >= 20 ? 2 : 1; frames > 0; frames--) {
            struct fl_frame *frame = next_frame(view);
            assert_int_equal(frame->frame, number++);
            assert_int_equal(frame->change,
                             frames == 2 ? i : i + 1); /* the first of two is still the old view's */
            fl_frame_destroy(frame);
        }
    }
    for (unsigned i = 0; i < 20; i++) { /* faster than anything is answered */
        options.picture.width = EDGE;
        assert_true(fl_view_change(view, &options, &error));
    }
    assert_true(fl_view_set_camera(view, &some_camera, NULL, &error));
    fl_frame_destroy(next_frame(view));
    end_view(view);
    assert_int_equal(seen.renders, 61);
    assert_int_equal(seen.last.channel, seen.first.channel);
    assert_int_equal(seen.last.tracing.tracer, PROTOCOL_TRACER_LDC);
    assert_int_equal(seen.cameras, 41);
}

TEST(a_job_runs_beside_a_view_and_each_gets_its_own_frames)
{
    struct fl_view *view = begin_view(play_view);
    struct message_render options = fl_render_defaults();
    options.picture.width = options.picture.height = EDGE;
    options.first_frame = options.last_frame = 77;
    for (unsigned i = 0; i < 3; i++) {
        bool done = false;
        struct fl_job *job = fl_render_start(&scene, &options, &error);
        assert_non_null(job);
        struct fl_frame *frame = NULL;
        for (unsigned tries = 0; !frame && tries < 6000; tries++) {
            frame = fl_render_poll(job, 10, &done, &error);
            assert_int_equal(error.code, FL_ERROR_NONE);
        }
        assert_non_null(frame);
        assert_false(done);
        assert_int_equal(frame->frame, 77);
        fl_frame_destroy(frame);
        assert_null(fl_render_next(job, &error));
        assert_int_equal(error.code, FL_ERROR_NONE);
        assert_null(fl_render_poll(job, 0, &done, &error));
        assert_true(done);
        fl_render_destroy(job);
    }
    struct fl_frame *frame = next_frame(view);
    assert_int_equal(frame->frame, 0);
    fl_frame_destroy(frame);
    end_view(view);
}

/* ---- what a daemon may say ---- */

static void tell_refusal(struct daemon *daemon, uint32_t request)
{
    struct message refusal = {.type = MESSAGE_ERROR};
    refusal.error.code = PROTOCOL_ERROR_UNSUPPORTED;
    refusal.error.field = "tracer";
    refusal.error.text = "not in this build";
    tell(daemon, request, &refusal);
}

/* The first render is good, each after it refused. */
static void play_refused_change(struct daemon *daemon)
{
    uint32_t request = 0, number = 0;
    greet(daemon);
    while (look(daemon)) {
        const struct message_frame_begin frame = some_frame(number, seen.last_command);
        if (asked.type == MESSAGE_RENDER && request != 0)
            tell_refusal(daemon, header.request);
        if (asked.type == MESSAGE_RENDER && request == 0)
            request = header.request;
        if (asked.type == MESSAGE_VIEW_CAMERA) {
            send_frame(daemon, request, &frame);
            number++;
        }
    }
}

TEST(a_refused_change_is_reported_once_and_the_view_continues_unchanged)
{
    struct fl_view *view = begin_view(play_refused_change);
    assert_true(fl_view_change(view, &usual_options, &error));
    assert_null(fl_view_next(view, 10000, &error));
    check_error(FL_ERROR_REFUSED, "not in this build");
    assert_true(fl_view_set_camera(view, &some_camera, NULL, &error));
    fl_frame_destroy(next_frame(view));
    end_view(view);
    assert_int_equal(seen.cancels, 1);
}

static void play_refused_view(struct daemon *daemon)
{
    greet(daemon);
    while (look(daemon))
        if (asked.type == MESSAGE_RENDER)
            tell_refusal(daemon, header.request);
}

TEST(a_refused_view_stays_refused_and_the_connection_can_be_used)
{
    struct fl_view *view = begin_view(play_refused_view);
    for (unsigned i = 0; i < 2; i++) {
        assert_null(fl_view_next(view, 10000, &error));
        check_error(FL_ERROR_REFUSED, "not in this build");
    }
    assert_false(fl_view_set_camera(view, &some_camera, NULL, &error));
    fl_view_destroy(view);
    view = start_view(&scene);
    assert_null(fl_view_next(view, 10000, &error));
    check_error(FL_ERROR_REFUSED, "not in this build");
    end_view(view);
    assert_int_equal(seen.cancels, 0);
}

/* `made` says what is wrong with the second of two frames. */
static struct message_frame_begin wrong_frame;
static unsigned wrong_count;

static void play_wrong(struct daemon *daemon)
{
    const struct message_frame_begin good = some_frame(4, 0);
    greet(daemon);
    while (look(daemon)) {
        if (asked.type != MESSAGE_RENDER)
            continue;
        send_frame(daemon, header.request, &good);
        for (unsigned i = 0; i < wrong_count; i++)
            send_frame(daemon, header.request, &wrong_frame);
    }
}

static void expect_broken(const struct message_frame_begin *frame, unsigned count, const char *part)
{
    wrong_frame = *frame;
    wrong_count = count;
    struct fl_view *view = begin_view(play_wrong);
    struct fl_frame *whole = NULL;
    while ((whole = fl_view_next(view, 10000, &error)))
        fl_frame_destroy(whole);
    check_error(FL_ERROR_PROTOCOL, part);
    assert_false(fl_view_set_camera(view, &some_camera, NULL, &error));
    assert_int_equal(error.code, FL_ERROR_PROTOCOL);
    end_view(view);
}

TEST(frames_that_nothing_allows_break_the_connection)
{
    struct message_frame_begin frame = some_frame(4, 0);
    expect_broken(&frame, 1, "frame 4 arrived, but frame 5 was expected");
    frame = some_frame(9, 0); /* numbers may be left out */
    frame.width = EDGE + 1;
    frame.size_bytes = (uint64_t)(EDGE + 1) * EDGE * 4;
    expect_broken(&frame, 1, "17x16");
    frame = some_frame(5, 0);
    frame.encoding = PROTOCOL_ENCODING_JPEG;
    expect_broken(&frame, 1, "jpeg");
    frame = some_frame(5, 0);
    frame.digest++;
    expect_broken(&frame, 1, "differ from those that were rendered");
    frame = some_frame(5, 0);
    frame.layers = 3;
    expect_broken(&frame, 1, "layers");
}

/* Many more frames than the client gave credit for, while it takes none. */
static void play_flood(struct daemon *daemon)
{
    greet(daemon);
    while (look(daemon)) {
        if (asked.type == MESSAGE_RENDER)
            for (uint32_t i = 0; i <= IN_FLIGHT; i++) {
                const struct message_frame_begin frame = some_frame(i, 0);
                send_frame(daemon, header.request, &frame);
            }
        if (asked.type == MESSAGE_PING)
            send_type(daemon, header.request, MESSAGE_PONG);
    }
}

TEST(more_frames_than_credit_break_the_connection)
{
    struct fl_view *view = begin_view(play_flood);
    uint64_t ns = 0;
    assert_false(fl_ping(connection, &ns, &error));
    check_error(FL_ERROR_PROTOCOL, "more frames arrived than were requested");
    end_view(view);
}

/* An access unit goes to the caller as it came. */
static void play_h264(struct daemon *daemon)
{
    struct message_frame_begin frame = some_frame(0, 0);
    frame.encoding = PROTOCOL_ENCODING_H264;
    frame.size_bytes = 100;
    greet(daemon);
    while (look(daemon))
        if (asked.type == MESSAGE_RENDER)
            send_frame(daemon, header.request, &frame);
}

TEST(a_frame_in_h264_is_left_to_the_caller)
{
    connect_scene(play_h264);
    struct message_render options = some_options();
    options.encoding = PROTOCOL_ENCODING_H264;
    assert_false(fl_connection_can_h264(scene.connection)); /* the played daemon has not said so */
    struct fl_view *view = fl_view_start(&scene, &options, &error);
    struct fl_frame *frame = next_frame(view);
    assert_null(frame->pixels);
    assert_int_equal(frame->encoded_bytes, 100);
    assert_memory_equal(frame->encoded, pixels, 100);
    fl_frame_destroy(frame);
    fl_view_destroy(view);
    leave_played();
    assert_int_equal(seen.first.quality, 0); /* where nothing is said it is left to the daemon */
}

/* The first frame ends unfinished; the next one is whole. */
static void play_abandoned(struct daemon *daemon)
{
    const struct message_frame_begin next = some_frame(5, 0);
    greet(daemon);
    while (look(daemon)) {
        if (asked.type != MESSAGE_RENDER)
            continue;
        send_begin(daemon, header.request, &wrong_frame);
        struct message part = {.type = MESSAGE_FRAME_DATA};
        part.frame_data.data = pixels;
        part.frame_data.data_bytes = (uint32_t)wrong_frame.size_bytes / 2;
        tell(daemon, header.request, &part);
        part = (struct message){.type = MESSAGE_FRAME_END};
        part.frame_end.frame = wrong_frame.frame;
        part.frame_end.abandoned = 1;
        tell(daemon, header.request, &part);
        send_frame(daemon, header.request, &next);
    }
}

TEST(a_frame_that_is_abandoned_is_not_seen_and_not_acknowledged)
{
    wrong_frame = some_frame(4, 0);
    struct fl_view *view = begin_view(play_abandoned);
    struct fl_frame *frame = fl_view_next(view, 10000, &error);
    assert_non_null(frame);
    assert_int_equal(frame->frame, 5);
    fl_frame_destroy(frame);
    end_view(view);
    assert_int_equal(seen.acks, 1);
    assert_int_equal(seen.begun_acks, 2);
    assert_int_equal(seen.credit, seen.first.credit + 1); /* for the one that was seen */
}

/* A frame of motion in two parts; it ends without the second one when a camera comes. */
static void play_parts(struct daemon *daemon)
{
    struct record_frame_part parts[] = {{PROTOCOL_FRAME_PART_COLOURS, FRAME_BYTES},
                                        {PROTOCOL_FRAME_PART_NORMALS, 100}};
    struct message_frame_begin frame = some_frame(0, 0);
    uint32_t request = 0;
    frame.moving = 1;
    frame.attachments = FL_ATTACH_NORMALS;
    frame.normal_bytes = 100;
    greet(daemon);
    while (look(daemon)) {
        struct message next = {.type = MESSAGE_FRAME_PARTS};
        if (asked.type == MESSAGE_RENDER && asked.render.view.parts) {
            request = header.request;
            next.frame_parts.parts = parts;
            next.frame_parts.parts_count = 2;
            send_begin(daemon, request, &frame);
            tell(daemon, request, &next);
            next = (struct message){.type = MESSAGE_FRAME_DATA};
            next.frame_data.data = pixels;
            next.frame_data.data_bytes = FRAME_BYTES;
            tell(daemon, request, &next);
        } else if (asked.type == MESSAGE_VIEW_CAMERA) {
            next = (struct message){.type = MESSAGE_FRAME_END};
            next.frame_end.abandoned = 1;
            tell(daemon, request, &next);
        }
    }
}

TEST(first_parts_are_delivered_at_once_and_again_at_the_end_for_one_credit)
{
    struct fl_view *view = begin_view(play_parts);
    usual_options.view.attachments = FL_ATTACH_NORMALS;
    usual_options.view.parts = 1;
    fl_view_deliver_parts(view, true);
    assert_true(fl_view_change(view, &usual_options, &error));
    for (int i = 0; i < 2; i++) {
        struct fl_frame *frame = next_frame(view);
        assert_int_equal(frame->frame, 0);
        assert_int_equal(frame->more_follows, i == 0);
        assert_true(frame->parts_come == 1 && frame->parts == 2);
        assert_memory_equal(frame->pixels, pixels, FRAME_BYTES);
        assert_null(frame->normals);
        fl_frame_destroy(frame);
        assert_true(i > 0 || fl_view_set_camera(view, &some_camera, NULL, &error));
    }
    end_view(view);
    assert_int_equal(seen.begun_acks, 1);
    assert_int_equal(seen.acks, 1);
    assert_int_equal(seen.credit, seen.first.credit + 1);
}

TEST(a_frame_of_motion_that_is_abandoned_breaks_the_connection)
{
    wrong_frame = some_frame(4, 0);
    wrong_frame.moving = 1;
    struct fl_view *view = begin_view(play_abandoned);
    assert_null(fl_view_next(view, 10000, &error));
    check_error(FL_ERROR_PROTOCOL, "which is allowed only at rest");
    end_view(view);
}

/* Half a frame, then nothing. */
static void play_half(struct daemon *daemon)
{
    const struct message_frame_begin frame = some_frame(0, 0);
    greet(daemon);
    while (look(daemon)) {
        if (asked.type == MESSAGE_RENDER)
            send_begin(daemon, header.request, &frame);
        if (asked.type == MESSAGE_VIEW_CAMERA)
            return;
    }
}

TEST(a_connection_lost_within_a_frame_is_reported_and_nothing_waits_forever)
{
    struct fl_view *view = begin_view(play_half);
    assert_null(fl_view_next(view, 20, &error));
    assert_int_equal(error.code, FL_ERROR_NONE);
    assert_true(fl_view_set_camera(view, &some_camera, NULL, &error));
    assert_null(fl_view_next(view, 10000, &error));
    check_error(FL_ERROR_CONNECTION, "closed");
    assert_false(fl_view_change(view, &usual_options, &error));
    end_view(view);
    assert_int_equal(seen.acks, 0);
}

/* Reads nothing from its first frame on until it is told to, and sends the next one once both the acknowledgement
 * and the credit for it have come. */
static sem_t may_read;

static void play_busy(struct daemon *daemon)
{
    uint32_t number = 0;
    struct message_frame_begin frame = some_frame(number++, 0);
    greet(daemon);
    if (!look(daemon))
        return;
    const uint32_t request = header.request;
    send_frame(daemon, request, &frame);
    sem_wait(&may_read);
    while (look(daemon)) {
        if (number > 1 || seen.acks == 0 || seen.credit <= IN_FLIGHT)
            continue;
        frame = some_frame(number++, 0);
        send_frame(daemon, request, &frame);
    }
}

TEST(what_had_no_room_beside_much_else_is_acknowledged_later)
{
    sem_init(&may_read, 0, 0);
    struct fl_view *view = begin_view(play_busy);
    /* Sending ends where there is no room for a message of any size. */
    while (fl_view_set_camera(view, &some_camera, NULL, &error))
        continue;
    check_error(FL_ERROR_TIMEOUT, "no more messages");
    fl_frame_destroy(next_frame(view));
    sem_post(&may_read);
    fl_frame_destroy(next_frame(view));
    end_view(view);
    sem_destroy(&may_read);
    assert_int_equal(seen.acks, 2);
    assert_int_equal(seen.credit, IN_FLIGHT + 2);
}

/* Reads nothing until it is told to; then it answers what it has no frames for. */
static void play_busy_until_the_end(struct daemon *daemon)
{
    greet(daemon);
    sem_wait(&may_read);
    while (look(daemon)) {
        seen.closed_after_cancel |= asked.type == MESSAGE_SCENE_CLOSE && seen.cancels == 1;
        if (asked.type == MESSAGE_CANCEL || asked.type == MESSAGE_SCENE_CLOSE)
            send_type(daemon, header.request, MESSAGE_OK);
        if (asked.type != MESSAGE_PING)
            continue;
        send_type(daemon, header.request, MESSAGE_PONG);
    }
}

TEST(what_ends_beside_much_else_is_given_back_later)
{
    sem_init(&may_read, 0, 0);
    connect_to_played(play_busy_until_the_end);
    struct fl_scene *own = fl_scene_create(connection, &error);
    assert_non_null(own);
    struct fl_view *view = start_view(own);
    while (fl_view_set_camera(view, &some_camera, NULL, &error))
        continue;
    check_error(FL_ERROR_TIMEOUT, "no more messages");
    fl_view_destroy(view);
    fl_scene_destroy(own);
    uint64_t ping_ns;
    assert_false(fl_ping(connection, &ping_ns, &error)); /* still nothing has room */
    check_error(FL_ERROR_TIMEOUT, "no more messages");
    sem_post(&may_read);
    /* Later requests queue behind it. */
    while (!fl_ping(connection, &ping_ns, &error))
        check_error(FL_ERROR_TIMEOUT, "no more messages");
    leave_played();
    sem_destroy(&may_read);
    assert_int_equal(seen.cancels, 1);
    assert_true(seen.closed_after_cancel);
}
