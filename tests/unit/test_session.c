/* SPDX-License-Identifier: MIT */
/* A session from hello to goodbye, over a socketpair, with an engine that answers what it is told to. */
#include "session_fixture.h"

#include "base/clock.h"
#include "base/queue.h"
#include "session/dispatch.h"
#include "session/frames.h"
#include "session/session.h"

#include <math.h>
#include <stdio.h>

#define FRAME_BYTES ((size_t)700001) /* three pieces, the last of odd size */

/* ---- an engine --------------------------------------------------------------------------------------- */

static struct {
    struct queue *events;
    pthread_mutex_t mutex;
    atomic_bool full;      /* takes no commands */
    atomic_bool keep_jobs; /* jobs render nothing until they are cancelled */
    atomic_bool keep_commits;
    struct engine_command *_Atomic kept_commit; /* has no answer until release_commit() */
    uint32_t job_request, next_frame, last_frame;
    struct engine_job job; /* the last one, but for what it owns */
    struct clip_use job_clips[16];
    struct tracer_cube cubes[TRACER_CUBES_MAX]; /* of the frames that it renders */
    uint64_t credit_seen, commits;
    atomic_uint edits, gone, frames_sent;
} engine;

static void event(enum engine_event_kind kind, const struct engine_command *command, uint32_t request)
{
    struct engine_event *made = calloc(1, sizeof *made);
    made->kind = kind;
    made->client = command->client;
    made->request = request;
    made->revision = engine.commits;
    if (kind == ENGINE_FAILED)
        error_set(&made->error, ERROR_CANCELLED, NULL, "cancelled");
    if (kind == ENGINE_STATS_READY) {
        made->stats = calloc(1, sizeof *made->stats);
        strcpy(made->stats->device.name, "none");
    }
    queue_push(engine.events, made);
}

static void render(const struct engine_command *command)
{
    for (; engine.next_frame <= engine.last_frame && engine.next_frame < engine.credit_seen; engine.next_frame++) {
        struct engine_event *made = calloc(1, sizeof *made);
        made->kind = ENGINE_FRAME;
        made->client = command->client;
        made->request = engine.job_request;
        made->frame = calloc(1, sizeof *made->frame);
        struct engine_frame *frame = made->frame;
        frame->frame = engine.next_frame;
        frame->request.width = frame->request.height = frame->request.samples = 1;
        frame->request.tracer = engine.job.frame.tracer;
        frame->request.aperture = engine.job.frame.aperture;
        frame->request.focus = engine.job.frame.focus;
        frame->shutter_s = engine.job.shutter / 8;
        frame->result.layers = engine.job.frame.layers ? engine.job.frame.layers : 1;
        frame->result.samples = 5; /* with those of frames before */
        memcpy(frame->result.cubes, engine.cubes, sizeof engine.cubes);
        frame->size_bytes = FRAME_BYTES;
        frame->bytes = malloc(FRAME_BYTES);
        for (size_t i = 0; i < FRAME_BYTES; i++)
            frame->bytes[i] = (uint8_t)(i * 31 + engine.next_frame);
        frame->encoded_ns = clock_now_ns();
        stage_times_begin(&frame->result.times);
        queue_push(engine.events, made);
    }
    if (engine.next_frame > engine.last_frame)
        event(ENGINE_DONE, command, engine.job_request);
}

static bool submit(void *context, struct engine_command *command, struct error *error)
{
    (void)context;
    if (atomic_load(&engine.full))
        return error_set(error, ERROR_BUSY, NULL, "full");
    switch (command->kind) {
    case ENGINE_COMMIT:
        if (atomic_load(&engine.keep_commits)) {
            atomic_store(&engine.kept_commit, command);
            return true;
        }
        engine.commits++;
        atomic_fetch_add(&engine.edits, (unsigned)command->edit_count);
        event(ENGINE_DONE, command, command->request);
        break;
    case ENGINE_SCENE_OPEN:
    case ENGINE_SCENE_ATTACH:
    case ENGINE_SCENE_CLOSE:
    case ENGINE_SCENE_LIST:
    case ENGINE_SCENE_DESCRIBE:
    case ENGINE_SCENES_TRIM:
        event(ENGINE_DONE, command, command->request);
        break;
    case ENGINE_JOB_START:
        engine.job_request = command->request;
        engine.next_frame = command->job.first_frame;
        engine.last_frame = command->job.last_frame;
        engine.credit_seen = command->job.credit;
        engine.job = command->job;
        for (uint32_t i = 0; i < command->job.clip_count; i++)
            engine.job_clips[i] = command->job.clips[i];
        if (!atomic_load(&engine.keep_jobs))
            render(command);
        break;
    case ENGINE_JOB_CREDIT:
        engine.credit_seen = command->credit;
        if (!atomic_load(&engine.keep_jobs))
            render(command);
        break;
    case ENGINE_JOB_CANCEL:
        event(ENGINE_FAILED, command, command->target_request);
        event(ENGINE_DONE, command, command->request);
        break;
    case ENGINE_VIEW_LOOK:
    case ENGINE_LIMITS:
        break;
    case ENGINE_STATS:
        event(ENGINE_STATS_READY, command, command->request);
        break;
    case ENGINE_CLIENT_GONE:
        atomic_fetch_add(&engine.gone, 1);
        event(ENGINE_CLIENT_FORGOTTEN, command, 0);
        break;
    }
    engine_command_destroy(command);
    return true;
}

static void release_commit(void)
{
    struct engine_command *command;
    while (!(command = atomic_exchange(&engine.kept_commit, NULL)))
        usleep(1000);
    event(ENGINE_DONE, command, command->request);
    engine_command_destroy(command);
}

static int event_fd(void *context)
{
    (void)context;
    return queue_event_fd(engine.events);
}

static struct engine_event *next_event(void *context)
{
    (void)context;
    return queue_try_pop(engine.events);
}

static void report_sent(void *context, uint64_t queue_ns, uint64_t send_ns)
{
    (void)context, (void)queue_ns, (void)send_ns;
    atomic_fetch_add(&engine.frames_sent, 1);
}

static void drop_event(void *item)
{
    engine_event_destroy(item);
}

static struct engine_port engine_begin(void)
{
    memset(&engine, 0, sizeof engine);
    engine.events = queue_create(4096, true);
    return (struct engine_port){
        .submit = submit, .event_fd = event_fd, .next_event = next_event, .report_sent = report_sent};
}

static void engine_end(void)
{
    queue_destroy(engine.events, drop_event);
}

/* ---- steps ------------------------------------------------------------------------------------------- */

static void begin_edit(uint32_t request, uint32_t scene)
{
    struct message message = made(MESSAGE_EDIT_BEGIN);
    message.edit_begin.scene = scene;
    send_message(request, 0, &message);
}

static void send_node(uint32_t request, uint32_t node)
{
    struct message message = made(MESSAGE_SET_NODE);
    message.set_node.node = node;
    send_message(request, 0, &message);
}

static void commit(uint32_t request)
{
    struct message message = made(MESSAGE_EDIT_COMMIT);
    send_message(request, 0, &message);
}

static struct record_blob_ref reference_to(const uint8_t *data, size_t bytes)
{
    struct record_blob_ref reference = {.size_bytes = bytes};
    blob_hash(reference.hash, data, bytes);
    return reference;
}

static uint32_t offer(uint32_t request, struct record_blob_ref reference)
{
    struct message message = made(MESSAGE_BLOB_OFFER);
    message.blob_offer.blobs = &reference;
    message.blob_offer.blobs_count = 1;
    send_message(request, 0, &message);
    expect(MESSAGE_BLOB_NEED, request);
    return client.message.blob_need.needed_count;
}

static void send_piece(uint32_t request, const struct record_blob_ref *reference, const uint8_t *data,
                       size_t offset, size_t bytes)
{
    struct message message = made(MESSAGE_BLOB_DATA);
    message.blob_data.offset_bytes = offset;
    memcpy(message.blob_data.hash, reference->hash, sizeof reference->hash);
    message.blob_data.data = data + offset;
    message.blob_data.data_bytes = (uint32_t)bytes;
    send_message(request, 1, &message);
}

/* As far as credit goes, waiting for more by pings. */
static void send_blob(uint32_t request, const struct record_blob_ref *reference, const uint8_t *data)
{
    static uint64_t sent;
    if (served.hub.sessions.count && client.upload_credit <= 1 << 20)
        sent = 0;
    for (size_t offset = 0; offset < reference->size_bytes;) {
        size_t piece = reference->size_bytes - offset < 262144 ? (size_t)reference->size_bytes - offset : 262144;
        while (client.upload_credit < sent + piece)
            expect_alive(9999);
        send_piece(request, reference, data, offset, piece);
        offset += piece;
        sent += piece;
    }
}

static struct message render_message(uint32_t last_frame, uint32_t credit)
{
    struct message message = made(MESSAGE_RENDER);
    message.render.scene = 1;
    message.render.channel = 2;
    message.render.credit = credit;
    message.render.last_frame = last_frame;
    return message;
}

static void expect_frame(uint32_t request, uint32_t number)
{
    expect(MESSAGE_FRAME_BEGIN, request);
    assert_int_equal(client.message.frame_begin.frame, number);
    assert_int_equal(client.message.frame_begin.size_bytes, FRAME_BYTES);
    for (size_t offset = 0; offset < FRAME_BYTES; offset += client.message.frame_data.data_bytes) {
        expect(MESSAGE_FRAME_DATA, request);
        const struct message_frame_data *data = &client.message.frame_data;
        assert_int_equal(client.header.channel, 2);
        assert_int_equal(data->offset_bytes, offset);
        for (size_t i = 0; i < data->data_bytes; i++) {
            if (data->data[i] != (uint8_t)((offset + i) * 31 + number))
                fail_msg("byte %zu of frame %u is %u", offset + i, number, data->data[i]);
        }
    }
    expect(MESSAGE_FRAME_END, request);
    assert_int_equal(client.message.frame_end.frame, number);
    bool queue = false, sent = false;
    for (uint32_t i = 0; i < client.message.frame_end.stages_count; i++) {
        queue = queue || client.message.frame_end.stages[i].stage == PROTOCOL_STAGE_QUEUE;
        sent = sent || client.message.frame_end.stages[i].stage == PROTOCOL_STAGE_SEND;
    }
    assert_true(queue && sent);
}

/* ---- tests ------------------------------------------------------------------------------------------- */

static void a_ping_is_answered_and_stats_are_told(void **state)
{
    (void)state;
    expect_alive(7);
    struct message message = made(MESSAGE_STATS);
    send_message(8, 0, &message);
    expect(MESSAGE_STATS_REPLY, 8);
    assert_int_equal(client.message.stats_reply.clients_count, 1);
    assert_non_null(
        strstr(client.message.stats_reply.clients[0].name, client.link ? "test (key, user " : "test (user "));
    assert_string_equal(client.message.stats_reply.device, "none");
}

static void edits_are_gathered_and_committed_together(void **state)
{
    (void)state;
    open_scene(1, 1);
    begin_edit(2, 1);
    for (uint32_t node = 1; node <= 10; node++)
        send_node(2, node);
    commit(2);
    expect(MESSAGE_OK, 2);
    assert_int_equal(client.message.ok.revision, 1);
    assert_int_equal(atomic_load(&engine.edits), 10);
}

static void a_failed_transaction_has_one_answer_and_what_follows_it_is_skipped(void **state)
{
    (void)state;
    open_scene(1, 1);
    begin_edit(2, 9); /* no such scene */
    send_node(2, 1);
    commit(2);
    expect_error(2, PROTOCOL_ERROR_CODE_UNKNOWN_ID);
    begin_edit(3, 1);
    for (uint32_t node = 1; node <= 12; node++) /* two more than fit */
        send_node(3, node);
    commit(3);
    expect_error(3, PROTOCOL_ERROR_CODE_LIMIT);
    expect_alive(4);
    begin_edit(3, 1); /* the number is free again */
    send_node(3, 1);
    commit(3);
    expect(MESSAGE_OK, 3);
    assert_int_equal(atomic_load(&engine.edits), 1);
}

static void edits_count_until_their_transaction_is_answered(void **state)
{
    (void)state;
    atomic_store(&engine.keep_commits, true);
    open_scene(1, 1);
    begin_edit(2, 1);
    for (uint32_t node = 1; node <= 10; node++)
        send_node(2, node);
    commit(2);
    begin_edit(3, 1);
    send_node(3, 11);
    expect_error(3, PROTOCOL_ERROR_CODE_LIMIT);
    assert_string_not_equal(client.message.error.remedy, "");
    release_commit();
    expect(MESSAGE_OK, 2);
    begin_edit(4, 1);
    for (uint32_t node = 1; node <= 10; node++)
        send_node(4, node);
    commit(4);
    release_commit();
    expect(MESSAGE_OK, 4);
}

static void edits_take_no_more_memory_than_the_limit(void **state)
{
    (void)state;
    static struct record_material_range ranges[4096];
    struct message message = made(MESSAGE_SET_MESH);
    message.set_mesh.mesh = 1;
    message.set_mesh.ranges = ranges;
    message.set_mesh.ranges_count = 4096; /* 48 KiB of the 64 */
    open_scene(1, 1);
    begin_edit(2, 1);
    send_message(2, 0, &message);
    begin_edit(3, 1);
    send_message(3, 0, &message);
    expect_error(3, PROTOCOL_ERROR_CODE_LIMIT);
    assert_non_null(strstr(client.message.error.remedy, "memory.transactions"));
    commit(2);
    expect(MESSAGE_OK, 2);
    begin_edit(4, 1);
    send_message(4, 0, &message);
    commit(4);
    expect(MESSAGE_OK, 4);
}

static void cancels_of_cancels_are_answered_in_their_order(void **state)
{
    (void)state;
    atomic_store(&engine.keep_commits, true);
    open_scene(1, 1);
    begin_edit(2, 1);
    commit(2);
    for (uint32_t request = 3; request <= 60; request++) {
        struct message message = made(MESSAGE_CANCEL);
        message.cancel.target_request = request - 1;
        send_message(request, 0, &message);
    }
    expect_alive(61);
    release_commit();
    for (uint32_t request = 2; request <= 60; request++)
        expect(MESSAGE_OK, request);
}

static void a_mesh_with_a_blob_that_is_not_held_names_it(void **state)
{
    (void)state;
    open_scene(1, 1);
    begin_edit(2, 1);
    struct record_blob_ref reference = {.size_bytes = 36, .hash = {0xab, 0xcd}};
    struct message message = made(MESSAGE_SET_MESH);
    message.set_mesh.mesh = 5;
    message.set_mesh.arrays = &reference;
    message.set_mesh.arrays_count = 1;
    send_message(2, 0, &message);
    expect_error(2, PROTOCOL_ERROR_CODE_UNKNOWN_ID);
    assert_non_null(strstr(client.message.error.text, "abcd0000"));
    assert_string_equal(client.message.error.field, "set_mesh 5.arrays[0]");
}

static void a_blob_is_sent_once_and_needed_no_more(void **state)
{
    (void)state;
    size_t bytes = ((size_t)2 << 20) + 12345;
    uint8_t *data = malloc(bytes);
    for (size_t i = 0; i < bytes; i++)
        data[i] = (uint8_t)(i ^ i >> 9);
    struct record_blob_ref reference = reference_to(data, bytes);
    assert_int_equal(offer(1, reference), 1);
    send_blob(2, &reference, data);
    expect(MESSAGE_OK, 2);
    assert_int_equal(offer(3, reference), 0);
    free(data);
}

static void a_blob_with_another_hash_is_refused_and_can_be_sent_again(void **state)
{
    (void)state;
    uint8_t data[1000] = {1, 2, 3}, wrong[1000] = {3, 2, 1};
    struct record_blob_ref reference = reference_to(data, sizeof data);
    assert_int_equal(offer(1, reference), 1);
    send_piece(2, &reference, wrong, 0, 1000);
    expect_error(2, PROTOCOL_ERROR_CODE_HASH_MISMATCH);
    send_piece(3, &reference, data, 0, 500);
    send_piece(3, &reference, data, 400, 500); /* not where it belongs */
    send_piece(3, &reference, data, 500, 500); /* of a request that has its answer */
    expect_error(3, PROTOCOL_ERROR_CODE_INVALID);
    send_piece(4, &reference, data, 0, 500);
    send_piece(4, &reference, data, 500, 500);
    expect(MESSAGE_OK, 4);
}

static void a_size_that_is_only_declared_takes_no_room_from_others(void **state)
{
    (void)state;
    static uint8_t data[3 << 20];
    struct record_blob_ref large = {.size_bytes = 6 << 20, .hash = {1}},
                           beyond = {.size_bytes = 9 << 20, .hash = {2}};
    assert_int_equal(offer(1, large), 1);
    send_piece(2, &large, data, 0, 8);
    assert_int_equal(offer(3, beyond), 1);
    send_piece(4, &beyond, data, 0, 8);
    expect_error(4, PROTOCOL_ERROR_CODE_LIMIT);
    struct record_blob_ref whole = reference_to(data, sizeof data);
    assert_int_equal(offer(5, whole), 1);
    for (size_t offset = 0; offset < sizeof data; offset += 131072) {
        while (client.upload_credit < 16 + offset + 131072)
            expect_alive(9999);
        send_piece(6, &whole, data, offset, 131072);
    }
    expect(MESSAGE_OK, 6);
}

static void made_up_hashes_with_the_same_head_are_told_apart(void **state)
{
    (void)state;
    uint8_t data[100] = {7};
    struct record_blob_ref references[3] = {reference_to(data, sizeof data)};
    for (uint8_t i = 1; i < 3; i++) {
        references[i] = references[0];
        references[i].hash[31] ^= i;
    }
    for (uint32_t i = 0; i < 3; i++)
        assert_int_equal(offer(1 + i, references[i]), 1);
    send_piece(4, &references[0], data, 0, sizeof data);
    expect(MESSAGE_OK, 4);
    assert_int_equal(offer(5, references[0]), 0);
    assert_int_equal(offer(6, references[1]), 1);
    assert_int_equal(offer(7, references[2]), 1);
}

static void blob_data_on_another_channel_ends_the_connection(void **state)
{
    (void)state;
    static const uint8_t data[100];
    struct record_blob_ref reference = reference_to(data, sizeof data);
    assert_int_equal(offer(1, reference), 1);
    struct message message = made(MESSAGE_BLOB_DATA);
    message.blob_data.data = data;
    message.blob_data.data_bytes = sizeof data;
    memcpy(message.blob_data.hash, reference.hash, sizeof reference.hash);
    send_message(2, 7, &message);
    expect_error(0, PROTOCOL_ERROR_CODE_PROTOCOL);
    expect(MESSAGE_GOODBYE, 0);
    expect_end();
}

static void frames_come_whole_in_order_and_as_far_as_credit_goes(void **state)
{
    (void)state;
    open_scene(1, 1);
    struct message message = render_message(6, 2);
    send_message(2, 0, &message);
    expect_frame(2, 0);
    expect_frame(2, 1);
    expect_alive(3); /* and no third one */
    message = made(MESSAGE_CREDIT);
    message.credit.channel = 2;
    message.credit.total = 100;
    send_message(0, 2, &message);
    for (uint32_t frame = 2; frame <= 6; frame++)
        expect_frame(2, frame);
    expect(MESSAGE_OK, 2);
    assert_int_equal(atomic_load(&engine.frames_sent), 7);
}

static void a_cancelled_job_has_one_answer_and_nothing_follows_it(void **state)
{
    (void)state;
    open_scene(1, 1);
    atomic_store(&engine.keep_jobs, true);
    struct message message = render_message(5, 10);
    send_message(2, 0, &message);
    message = made(MESSAGE_CANCEL);
    message.cancel.target_request = 2;
    send_message(3, 0, &message);
    expect_error(2, PROTOCOL_ERROR_CODE_CANCELLED);
    expect(MESSAGE_OK, 3);
    send_message(4, 0, &message); /* it is gone already */
    expect(MESSAGE_OK, 4);
    expect_alive(5);
}

/* Cancelled in the middle of its frames: pieces may be in the socket, nothing comes after the answer. */
static void a_job_whose_credit_is_used_up_is_told_so_once(void **state)
{
    (void)state;
    open_scene(1, 1);
    struct message message = render_message(2, 2);
    send_message(2, 0, &message);
    expect_frame(2, 0);
    expect_frame(2, 1);
    for (unsigned i = 0; !client.blocked && i < 200; i++) {
        expect_alive(9);
        usleep(10000);
    }
    assert_string_equal(client.blocked_text, "the credit is used up");
    usleep(250000);
    expect_alive(9);
    assert_int_equal(client.blocked, 1);
    message = made(MESSAGE_CREDIT);
    message.credit.channel = 2;
    message.credit.total = 3;
    send_message(0, 0, &message);
    expect_frame(2, 2);
    expect(MESSAGE_OK, 2);
}

static void a_job_cancelled_while_it_sends_ends_at_its_answer(void **state)
{
    (void)state;
    open_scene(1, 1);
    struct message message = render_message(50, 51);
    send_message(2, 0, &message);
    expect(MESSAGE_FRAME_BEGIN, 2);
    message = made(MESSAGE_CANCEL);
    message.cancel.target_request = 2;
    send_message(3, 0, &message);
    bool answered = false;
    for (;;) {
        const struct message *got = receive();
        if (got->type == MESSAGE_OK)
            break;
        assert_int_equal(client.header.request, 2);
        assert_false(answered);
        answered = got->type == MESSAGE_ERROR;
    }
    assert_true(answered);
    assert_int_equal(client.header.request, 3);
    expect_alive(4);
}

static void a_job_that_cannot_be_is_refused_by_its_field(void **state)
{
    (void)state;
    open_scene(1, 1);
    struct message message = render_message(0, 1);
    message.render.scene = 3;
    send_message(2, 0, &message);
    expect_error(2, PROTOCOL_ERROR_CODE_UNKNOWN_ID);
    message = render_message(0, 1);
    message.render.width = 1024;
    send_message(3, 0, &message);
    expect_error(3, PROTOCOL_ERROR_CODE_LIMIT);
    message = render_message(0, 1);
    message.render.first_frame = 1;
    send_message(4, 0, &message);
    expect_error(4, PROTOCOL_ERROR_CODE_INVALID);
    assert_string_equal(client.message.error.field, "render.last_frame");
    message = render_message(0, 1);
    message.render.encoding = PROTOCOL_ENCODING_JPEG;
    message.render.format = PROTOCOL_PIXEL_FORMAT_RGBA32F;
    send_message(5, 0, &message);
    expect_error(5, PROTOCOL_ERROR_CODE_UNSUPPORTED);
    message = render_message(0, 1);
    message.render.camera_path = PROTOCOL_CAMERA_PATH_KEYS;
    send_message(6, 0, &message);
    expect_error(6, PROTOCOL_ERROR_CODE_INVALID);
}

/* ---- what moves --------------------------------------------------------------------------------------- */

static struct record_blob_ref upload(uint32_t request, const void *data, size_t bytes)
{
    struct record_blob_ref reference = reference_to(data, bytes);
    assert_int_equal(offer(request, reference), 1);
    send_blob(request + 1, &reference, data);
    expect(MESSAGE_OK, request + 1);
    return reference;
}

static void send_skinned(uint32_t request, struct record_blob_ref *joints_and_matrices,
                         struct record_blob_ref *floats)
{
    struct record_morph_weight weights[] = {{0.25f}, {-4}};
    struct message message = made(MESSAGE_SET_NODE);
    message.set_node.node = 7;
    message.set_node.kind = PROTOCOL_NODE_KIND_MESH;
    message.set_node.object = 3;
    message.set_node.skin = 5;
    message.set_node.weights = weights;
    message.set_node.weights_count = 2;
    send_message(request, 0, &message);
    message = made(MESSAGE_SET_MESH);
    message.set_mesh.mesh = 3;
    message.set_mesh.influence_count = 4;
    message.set_mesh.target_count = 2;
    message.set_mesh.weights = weights + 1;
    message.set_mesh.weights_count = 1;
    send_message(request, 0, &message);
    message = made(MESSAGE_SET_SKIN);
    message.set_skin.skin = 5;
    message.set_skin.joint_count = 1;
    message.set_skin.arrays = joints_and_matrices;
    message.set_skin.arrays_count = 2;
    message.set_skin.name = "bones";
    send_message(request, 0, &message);
    message = made(MESSAGE_SET_CLIP);
    message.set_clip.clip = 6;
    message.set_clip.arrays = floats;
    message.set_clip.arrays_count = 1;
    message.set_clip.name = "run";
    send_message(request, 0, &message);
    message = made(MESSAGE_SET_CHANNEL);
    message.set_channel = (struct message_set_channel){
        .channel = 8,
        .clip = 6,
        .path = PROTOCOL_CHANNEL_PATH_LIGHT_SIZE,
        .object = 9,
        .interpolation = PROTOCOL_INTERPOLATION_BEZIER,
        .width = 2,
        .key_count = 1,
        .first_time = 1,
        .first_value = 2,
    };
    send_message(request, 0, &message);
}

static void skins_clips_and_channels_become_edits(void **state)
{
    (void)state;
    const uint32_t joint = 7;
    const float matrix[12] = {1, 2, 3}, numbers[3] = {4, 5, 6};
    open_scene(1, 1);
    struct record_blob_ref joints_and_matrices[] = {upload(10, &joint, 4), upload(12, matrix, sizeof matrix)};
    struct record_blob_ref floats = upload(14, numbers, sizeof numbers);
    atomic_store(&engine.keep_commits, true);
    begin_edit(2, 1);
    send_skinned(2, joints_and_matrices, &floats);
    commit(2);
    struct engine_command *kept;
    while (!(kept = atomic_load(&engine.kept_commit)))
        usleep(1000);
    assert_int_equal(kept->edit_count, 5);
    const struct scene_node *node = &kept->edits[0].set.node;
    assert_true(kept->edits[0].object == SCENE_NODE && node->skin == 5 && node->weight_count == 2);
    assert_true(node->weights[0] == 0.25f && node->weights[1] == -4.0f);
    const struct scene_mesh *mesh = &kept->edits[1].set.mesh;
    assert_true(mesh->influence_count == 4 && mesh->target_count == 2);
    assert_true(mesh->weight_count == 1 && mesh->weights[0] == -4.0f);
    const struct scene_skin *skin = &kept->edits[2].set.skin;
    assert_true(kept->edits[2].object == SCENE_SKIN && skin->base.id == 5 && skin->joint_count == 1);
    assert_string_equal(skin->base.name, "bones");
    assert_memory_equal(skin->joints->data, &joint, 4);
    assert_memory_equal(skin->joint_from_mesh->data, matrix, sizeof matrix);
    const struct scene_clip *clip = &kept->edits[3].set.clip;
    assert_true(kept->edits[3].object == SCENE_CLIP && clip->base.id == 6);
    assert_memory_equal(clip->floats->data, numbers, sizeof numbers);
    const struct scene_channel *channel = &kept->edits[4].set.channel;
    assert_true(kept->edits[4].object == SCENE_CHANNEL && channel->base.id == 8 && channel->clip == 6);
    assert_true(channel->path == CHANNEL_LIGHT_SIZE && channel->object == 9);
    assert_true(channel->interpolation == INTERPOLATION_BEZIER && channel->width == 2);
    assert_true(channel->key_count == 1 && channel->first_time == 1 && channel->first_value == 2);
    release_commit();
    expect(MESSAGE_OK, 2);
    /* An array that is not held is named. */
    begin_edit(3, 1);
    joints_and_matrices[1].hash[0] ^= 1;
    struct message message = made(MESSAGE_SET_SKIN);
    message.set_skin.skin = 5;
    message.set_skin.arrays = joints_and_matrices;
    message.set_skin.arrays_count = 2;
    send_message(3, 0, &message);
    expect_error(3, PROTOCOL_ERROR_CODE_UNKNOWN_ID);
    assert_string_equal(client.message.error.field, "set_skin 5.arrays[1]");
}

static void weights_count_as_memory_of_a_transaction(void **state)
{
    (void)state;
    static struct record_material_range ranges[4096];
    static struct record_morph_weight weights[1024];
    open_scene(1, 1);
    begin_edit(2, 1);
    struct message message = made(MESSAGE_SET_MESH); /* 48 of 64 KiB */
    message.set_mesh.ranges = ranges;
    message.set_mesh.ranges_count = 4096;
    send_message(2, 0, &message);
    for (uint32_t node = 1; node <= 4; node++) { /* 4 KiB each */
        message = made(MESSAGE_SET_NODE);
        message.set_node.node = node;
        message.set_node.weights = weights;
        message.set_node.weights_count = 1024;
        send_message(2, 0, &message);
    }
    expect_error(2, PROTOCOL_ERROR_CODE_LIMIT);
}

static void a_job_takes_its_clips_and_its_lens_along(void **state)
{
    (void)state;
    open_scene(1, 1);
    struct record_clip_use clips[] = {{.clip = 4, .start_s = -2, .speed = 0.5f, .loop = 1},
                                      {.clip = 5, .speed = 3}};
    struct message message = render_message(0, 1);
    message.render.clips = clips;
    message.render.clips_count = 2;
    message.render.aperture = 0.125f;
    message.render.focus = 7;
    message.render.shutter = 0.5f;
    message.render.pixel_filter = PROTOCOL_PIXEL_FILTER_TENT;
    message.render.bvh_rays_together = 3;
    message.render.accumulate = 1;
    send_message(2, 0, &message);
    expect(MESSAGE_FRAME_BEGIN, 2);
    const struct message_frame_begin *begin = &client.message.frame_begin;
    assert_true(begin->aperture == 0.125f && begin->focus == 7.0f && begin->shutter_s == 0.0625f);
    assert_int_equal(begin->samples, 5);
    const struct engine_job *job = &engine.job;
    assert_int_equal(job->clip_count, 2);
    assert_true(engine.job_clips[0].clip == 4 && engine.job_clips[0].start_s == -2.0f);
    assert_true(engine.job_clips[0].speed == 0.5f && engine.job_clips[0].loop);
    assert_true(engine.job_clips[1].clip == 5 && engine.job_clips[1].speed == 3.0f && !engine.job_clips[1].loop);
    assert_true(job->shutter == 0.5f && job->frame.filter == FILTER_TENT && job->frame.accumulate);
    assert_int_equal(job->frame.tracer_options.bvh_rays_together, 3);
    while (receive()->type != MESSAGE_OK)
        continue;
    const uint32_t not_walked[] = {5, 6, 7};
    for (uint32_t i = 0; i < 3; i++) {
        message = render_message(0, 1);
        message.render.bvh_rays_together = not_walked[i];
        send_message(3 + i, 0, &message);
        expect_error(3 + i, PROTOCOL_ERROR_CODE_INVALID);
        assert_string_equal(client.message.error.field, "render.bvh_rays_together");
    }
}

static void settings_of_cubes_go_to_the_engine_with_the_daemons_limits(void **state)
{
    (void)state;
    open_scene(1, 1);
    struct message message = render_message(0, 1);
    message.render.tracer = PROTOCOL_TRACER_LDC;
    message.render.ldc_resolution = 16;
    message.render.ldc_block = 32;
    message.render.ldc_build = PROTOCOL_LDC_BUILD_LISTS;
    message.render.ldc_levels = PROTOCOL_LDC_LEVELS_BLOCKS;
    message.render.ldc_images = PROTOCOL_LDC_IMAGES_ONE;
    message.render.ldc_tolerance = 0.25f;
    message.render.ldc_rays_together = 4;
    send_message(2, 0, &message);
    expect(MESSAGE_FRAME_BEGIN, 2);
    assert_int_equal(client.message.frame_begin.tracer, PROTOCOL_TRACER_LDC);
    const struct tracer_options *options = &engine.job.frame.tracer_options;
    assert_int_equal(options->ldc_resolution, 16);
    assert_int_equal(options->ldc_block, 32);
    assert_int_equal(options->ldc_build, LDC_BUILD_LISTS);
    assert_int_equal(options->ldc_levels, LDC_LEVELS_BLOCKS);
    assert_int_equal(options->ldc_images, LDC_IMAGES_ONE);
    assert_true(options->ldc_tolerance == 0.25f);
    assert_int_equal(options->ldc_rays_together, 4);
    assert_int_equal(options->ldc_layers_max, 7);
    assert_int_equal(options->ldc_mebibytes_max, 3);
    while (receive()->type != MESSAGE_OK)
        continue;
}

static void layers_go_to_the_engine_and_come_with_the_frame(void **state)
{
    (void)state;
    open_scene(1, 1);
    struct message message = render_message(0, 1);
    message.render.format = PROTOCOL_PIXEL_FORMAT_RGBA32F;
    message.render.encoding = PROTOCOL_ENCODING_ZSTD;
    message.render.layers = 1u << PROTOCOL_LAYER_BEAUTY | 1u << PROTOCOL_LAYER_DEPTH;
    send_message(2, 0, &message);
    expect(MESSAGE_FRAME_BEGIN, 2);
    assert_int_equal(engine.job.frame.layers, 1u << LAYER_BEAUTY | 1u << LAYER_DEPTH);
    assert_int_equal(client.message.frame_begin.layers, message.render.layers);
    while (receive()->type != MESSAGE_OK)
        continue;
    message = render_message(0, 1); /* the picture alone has any format, named or not */
    message.render.layers = 1u << PROTOCOL_LAYER_BEAUTY;
    message.render.encoding = PROTOCOL_ENCODING_JPEG;
    send_message(3, 0, &message);
    expect(MESSAGE_FRAME_BEGIN, 3);
    while (receive()->type != MESSAGE_OK)
        continue;
}

static void layers_that_pixels_or_messages_do_not_hold_are_refused(void **state)
{
    (void)state;
    static const struct {
        uint32_t layers, edge_pixels;
        enum protocol_pixel_format format;
        enum protocol_encoding encoding;
        enum protocol_error_code code;
        const char *remedy;
    } cases[] = {
        {3, 16, PROTOCOL_PIXEL_FORMAT_RGBA8, PROTOCOL_ENCODING_RAW, PROTOCOL_ERROR_CODE_UNSUPPORTED, "rgba32f"},
        {2, 16, PROTOCOL_PIXEL_FORMAT_RGBA16F, PROTOCOL_ENCODING_ZSTD, PROTOCOL_ERROR_CODE_UNSUPPORTED, "rgba32f"},
        {64, 16, PROTOCOL_PIXEL_FORMAT_RGBA8, PROTOCOL_ENCODING_JPEG, PROTOCOL_ERROR_CODE_UNSUPPORTED, "zstd"},
        {2, 16, PROTOCOL_PIXEL_FORMAT_RGBA32F, PROTOCOL_ENCODING_JPEG, PROTOCOL_ERROR_CODE_UNSUPPORTED, "zstd"},
        /* 8192 x 8192 x 16 bytes are 1 GiB */
        {15, 8192, PROTOCOL_PIXEL_FORMAT_RGBA32F, PROTOCOL_ENCODING_RAW, PROTOCOL_ERROR_CODE_LIMIT,
         "fewer layers"},
    };
    open_scene(1, 1);
    for (uint32_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct message message = render_message(0, 1);
        message.render.width = message.render.height = cases[i].edge_pixels;
        message.render.layers = cases[i].layers;
        message.render.format = cases[i].format;
        message.render.encoding = cases[i].encoding;
        send_message(2 + i, 0, &message);
        expect_error(2 + i, cases[i].code);
        assert_string_equal(client.message.error.field, "render.layers");
        assert_non_null(strstr(client.message.error.remedy, cases[i].remedy));
    }
}

static void settings_that_no_cube_has_are_refused_by_their_field(void **state)
{
    (void)state;
    static const struct {
        uint32_t resolution, block, rays;
        const char *field, *remedy;
    } cases[] = {
        {1, 0, 0, "render.ldc_resolution", "16 to 4096"}, {15, 0, 0, "render.ldc_resolution", "16 to 4096"},
        {0, 1, 0, "render.ldc_block", "16 or 32"},        {0, 24, 0, "render.ldc_block", "16 or 32"},
        {0, 0, 2, "render.ldc_rays_together", ""},        {0, 0, 3, "render.ldc_rays_together", ""},
    };
    open_scene(1, 1);
    for (uint32_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct message message = render_message(0, 1);
        message.render.ldc_resolution = cases[i].resolution;
        message.render.ldc_block = cases[i].block;
        message.render.ldc_rays_together = cases[i].rays;
        send_message(2 + i, 0, &message);
        expect_error(2 + i, PROTOCOL_ERROR_CODE_INVALID);
        assert_string_equal(client.message.error.field, cases[i].field);
        assert_non_null(strstr(client.message.error.remedy, cases[i].remedy));
    }
    struct message message = render_message(0, 1);
    message.render.ldc_levels = PROTOCOL_LDC_LEVELS_CELLS;
    message.render.ldc_tolerance = 0.5f;
    send_message(20, 0, &message);
    expect_error(20, PROTOCOL_ERROR_CODE_INVALID);
    assert_string_equal(client.message.error.field, "render.ldc_levels");
}

static void settings_of_a_buffers_and_light_go_to_the_engine(void **state)
{
    (void)state;
    open_scene(1, 1);
    struct message message = render_message(0, 1);
    message.render.tracer = PROTOCOL_TRACER_ABUFFER;
    message.render.abuffer_resolution = 64;
    message.render.abuffer_voxels = 64;
    message.render.abuffer_search = PROTOCOL_ABUFFER_SEARCH_LINEAR1;
    message.render.integrator = PROTOCOL_INTEGRATOR_PATH;
    message.render.brdf = PROTOCOL_BRDF_WARD;
    message.render.ao_distance = 2;
    message.render.ao_falloff = 0.5f;
    message.render.ao_rays = 256;
    message.render.layer_opacity = 0.75f;
    message.render.format = PROTOCOL_PIXEL_FORMAT_RGBA32F;
    message.render.layers = 1u << PROTOCOL_LAYER_ALBEDO | 1u << PROTOCOL_LAYER_ID;
    send_message(2, 0, &message);
    expect(MESSAGE_FRAME_BEGIN, 2);
    assert_int_equal(client.message.frame_begin.tracer, PROTOCOL_TRACER_ABUFFER);
    assert_int_equal(client.message.frame_begin.layers, message.render.layers);
    const struct frame_request *request = &engine.job.frame;
    assert_int_equal(request->tracer_options.abuffer_resolution, 64);
    assert_int_equal(request->tracer_options.abuffer_voxels, 64);
    assert_int_equal(request->tracer_options.abuffer_search, ABUFFER_SEARCH_LINEAR1);
    assert_int_equal(request->tracer_options.abuffer_mebibytes_max, 1);
    assert_int_equal(request->integrator, INTEGRATOR_PATH);
    assert_int_equal(request->brdf, FRAME_BRDF_WARD);
    assert_true(request->ao_distance == 2 && request->ao_falloff == 0.5f && request->layer_opacity == 0.75f);
    assert_int_equal(request->ao_rays, 256);
    assert_int_equal(request->layers, message.render.layers);
    while (receive()->type != MESSAGE_OK)
        continue;
}

static void settings_that_no_a_buffer_has_are_refused_by_their_field(void **state)
{
    (void)state;
    static const struct {
        uint32_t resolution, voxels;
        const char *field, *remedy;
    } cases[] = {
        {1, 0, "render.abuffer_resolution", "16 to 4096"}, {15, 0, "render.abuffer_resolution", "16 to 4096"},
        {0, 8, "render.abuffer_voxels", "16, 32, 64"},     {0, 100, "render.abuffer_voxels", "16, 32, 64"},
        {32, 64, "render.abuffer_voxels", "higher"},
    };
    open_scene(1, 1);
    for (uint32_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct message message = render_message(0, 1);
        message.render.abuffer_resolution = cases[i].resolution;
        message.render.abuffer_voxels = cases[i].voxels;
        send_message(2 + i, 0, &message);
        expect_error(2 + i, PROTOCOL_ERROR_CODE_INVALID);
        assert_string_equal(client.message.error.field, cases[i].field);
        assert_non_null(strstr(client.message.error.remedy, cases[i].remedy));
    }
}

static void layers_count_as_pictures_in_the_memory_for_frames(void **state)
{
    (void)state;
    open_scene(1, 1);
    struct message message = render_message(0, 1);
    /* While a job runs, all layers are more than is left of the memory for frames; the picture is not. */
    message.render.format = PROTOCOL_PIXEL_FORMAT_RGBA32F;
    message.render.width = message.render.height = 128;
    message.render.layers = 0;
    atomic_store(&engine.keep_jobs, true);
    send_message(3, 0, &message);
    for (uint32_t request = 4; request < 6; request++) {
        message.render.channel++;
        message.render.layers = request == 4 ? 127 : 0;
        send_message(request, 0, &message);
    }
    expect_error(4, PROTOCOL_ERROR_CODE_BUSY);
    expect_alive(6);
}

static void cubes_of_a_frame_are_told(void **state)
{
    (void)state;
    open_scene(1, 1);
    engine.cubes[TRACER_CUBE_DYNAMIC] = (struct tracer_cube){.resolution = 512,
                                                             .cell_metres = INFINITY, /* the scene is too large */
                                                             .layers_needed = 300,
                                                             .layers_kept = 255,
                                                             .samples = 1 << 20,
                                                             .samples_lost = 77,
                                                             .rebuilt = true};
    struct message message = render_message(0, 1);
    send_message(2, 0, &message);
    while (receive()->type != MESSAGE_FRAME_END)
        continue;
    assert_int_equal(client.message.frame_end.cubes_count, 1);
    const struct record_layered_cube *cube = &client.message.frame_end.cubes[0];
    assert_int_equal(cube->part, PROTOCOL_CUBE_PART_DYNAMIC);
    assert_int_equal(cube->resolution, 512);
    assert_true(cube->cell_metres > 1e38f && isfinite(cube->cell_metres));
    assert_int_equal(cube->layers_needed, 300);
    assert_int_equal(cube->layers_kept, 255);
    assert_int_equal(cube->samples, 1 << 20);
    assert_int_equal(cube->samples_lost, 77);
    assert_int_equal(cube->rebuilt, 1);
    expect(MESSAGE_OK, 2);
}

static void a_job_whose_frames_have_no_room_waits_for_others_to_end(void **state)
{
    (void)state;
    atomic_store(&engine.keep_jobs, true);
    open_scene(1, 1);
    struct message message = render_message(0, 1);
    message.render.width = message.render.height = 512; /* 7 MiB: 3 frames in the engine, 4 to be sent */
    send_message(2, 0, &message);
    message.render.channel = 3;
    send_message(3, 0, &message);
    expect_error(3, PROTOCOL_ERROR_CODE_BUSY);
    assert_int_equal(client.message.error.retryable, 1);
    assert_non_null(strstr(client.message.error.remedy, "memory.frames"));
    message = made(MESSAGE_CANCEL);
    message.cancel.target_request = 2;
    send_message(4, 0, &message);
    expect_error(2, PROTOCOL_ERROR_CODE_CANCELLED);
    expect(MESSAGE_OK, 4);
    message = render_message(0, 1);
    message.render.width = message.render.height = 512;
    message.render.format = PROTOCOL_PIXEL_FORMAT_RGBA32F; /* more than there is, but it is the only one */
    message.render.layers = 127;
    send_message(5, 0, &message);
    message = made(MESSAGE_CANCEL);
    message.cancel.target_request = 5;
    send_message(6, 0, &message);
    expect_error(5, PROTOCOL_ERROR_CODE_CANCELLED);
    expect(MESSAGE_OK, 6);
    assert_int_equal(served.hub.frame_bytes, 0);
}

static void a_full_engine_makes_clients_wait_and_loses_nothing(void **state)
{
    (void)state;
    atomic_store(&engine.full, true);
    struct message message = made(MESSAGE_SCENE_OPEN);
    for (uint32_t scene = 1; scene <= 2; scene++) {
        message.scene_open.scene = scene;
        send_message(scene, 0, &message);
    }
    usleep(20000);
    atomic_store(&engine.full, false);
    expect(MESSAGE_OK, 1);
    expect(MESSAGE_OK, 2);
    expect_alive(3);
}

/* More than one may have come already when nothing more is to be read. */
static void messages_that_come_while_the_engine_is_full_are_answered_later(void **state)
{
    (void)state;
    enum { PINGS = 100 };
    atomic_store(&engine.full, true);
    struct message message = made(MESSAGE_SCENE_OPEN);
    message.scene_open.scene = 1;
    send_message(1, 0, &message);
    usleep(20000);
    message = made(MESSAGE_PING);
    for (uint32_t request = 2; request < 2 + PINGS; request++)
        send_message(request, 0, &message);
    usleep(20000);
    atomic_store(&engine.full, false);
    expect(MESSAGE_OK, 1);
    for (uint32_t request = 2; request < 2 + PINGS; request++)
        expect(MESSAGE_PONG, request);
}

static void rubbish_is_told_so_and_the_connection_closed(void **state)
{
    (void)state;
    uint8_t bytes[64];
    memset(bytes, 0xff, sizeof bytes);
    send_bytes(bytes, sizeof bytes);
    expect_error(0, PROTOCOL_ERROR_CODE_PROTOCOL);
    expect(MESSAGE_GOODBYE, 0);
    expect_end();
}

static void a_request_number_in_flight_cannot_be_used_again(void **state)
{
    (void)state;
    open_scene(1, 1);
    begin_edit(2, 1);
    begin_edit(2, 1);
    expect_error(0, PROTOCOL_ERROR_CODE_PROTOCOL);
    expect(MESSAGE_GOODBYE, 0);
    expect_end();
}

static void the_65th_request_in_flight_is_refused_and_can_be_retried(void **state)
{
    (void)state;
    open_scene(1, 1);
    for (uint32_t request = 2; request <= 65; request++)
        begin_edit(request, 1);
    begin_edit(66, 1);
    expect_error(66, PROTOCOL_ERROR_CODE_LIMIT);
    assert_int_equal(client.message.error.retryable, 1);
    send_node(66, 1);
    commit(66);
    commit(2);
    expect(MESSAGE_OK, 2);
}

static void a_client_that_vanishes_is_forgotten(void **state)
{
    (void)state;
    open_scene(1, 1);
    struct message message = render_message(50, 51);
    send_message(2, 0, &message);
    expect(MESSAGE_FRAME_BEGIN, 2);
    shutdown(client.fd, SHUT_RDWR);
    pthread_join(thread, NULL); /* the daemon of a single client ends with it */
    assert_int_equal(atomic_load(&engine.gone), 1);
    assert_int_equal(pthread_create(&thread, NULL, run, NULL), 0);
}

static void every_message_of_a_client_has_a_row(void **state)
{
    (void)state;
    for (uint32_t type = 0; type <= UINT16_MAX; type++) {
        const struct message_info *info = message_lookup(type);
        bool from_client = info && (info->from & MESSAGE_FROM_CLIENT);
        if (from_client != (dispatch_find(type) != NULL))
            fail_msg("%s (%u): from a client: %d, row: %d", message_type_text(type), type, from_client,
                     !from_client);
    }
}

static void the_head_of_a_frame_piece_is_what_the_codec_writes(void **state)
{
    (void)state;
    static uint8_t data[FRAME_PIECE_BYTES], bytes[FRAMING_MESSAGE_MAX_BYTES];
    static const size_t sizes[] = {1, 7, 8, 1000, FRAME_PIECE_BYTES};
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        struct message message = made(MESSAGE_FRAME_DATA);
        message.frame_data.offset_bytes = UINT64_C(0xa1b2c3d4);
        message.frame_data.data = data;
        message.frame_data.data_bytes = (uint32_t)sizes[i];
        struct writer writer;
        writer_init(&writer, bytes, sizeof bytes);
        assert_true(message_write(&writer, 77, 5, &message));
        uint8_t head[FRAME_DATA_HEAD_BYTES];
        frame_data_head(head, 77, 5, UINT64_C(0xa1b2c3d4), (uint32_t)sizes[i]);
        assert_memory_equal(head, bytes, sizeof head);
        assert_int_equal(writer.used_bytes, (sizeof head + sizes[i] + 7) & ~(size_t)7);
    }
}

/* ---- patience ---------------------------------------------------------------------------------------- */

static void expect_closed_within_5_s(void)
{
    uint64_t before_ns = clock_now_ns();
    struct pollfd fd = {.fd = client.fd, .events = POLLIN};
    uint8_t bytes[4096];
    while (poll(&fd, 1, 20000) == 1 && recv(client.fd, bytes, sizeof bytes, 0) > 0)
        continue;
    assert_in_range((clock_now_ns() - before_ns) / 1000000, 0, 5000);
}

static int real_calls(void **state)
{
    (void)state;
    real = sys;
    return 0;
}

static void who_does_not_introduce_himself_is_closed(void **state)
{
    (void)state;
    struct connection_limits limits = patient;
    limits.handshake_ms = 50;
    start(&limits);
    send_bytes("FARL", 4);
    expect_closed_within_5_s();
}

static void who_does_not_finish_a_message_is_closed(void **state)
{
    (void)state;
    struct connection_limits limits = patient;
    limits.progress_grace_ms = 50;
    limits.progress_bytes_per_s = 1000000;
    start(&limits);
    greet();
    uint8_t header[FRAMING_HEADER_BYTES];
    framing_header_encode(header,
                          &(struct framing_header){.type = MESSAGE_PING, .payload_bytes = 10, .request = 1});
    send_bytes(header, sizeof header);
    expect_closed_within_5_s();
}

static void who_cannot_finish_a_message_because_nothing_is_read_has_his_time_later(void **state)
{
    (void)state;
    struct connection_limits limits = patient;
    limits.progress_grace_ms = 100;
    limits.progress_bytes_per_s = 1000000;
    limits.queued_soft_bytes = 1000;
    start(&limits);
    greet();
    open_scene(1, 1);
    uint8_t bytes[1024];
    struct writer writer;
    writer_init(&writer, bytes, sizeof bytes);
    struct message message = render_message(5, 6);
    assert_true(message_write(&writer, 2, 0, &message));
    size_t begun_bytes = writer.used_bytes + 20;
    message = made(MESSAGE_PING);
    assert_true(message_write(&writer, 3, 0, &message));
    send_bytes(bytes, begun_bytes); /* the frames fill the way back, the ping is cut off */
    usleep(400000);
    send_bytes(bytes + begun_bytes, writer.used_bytes - begun_bytes);
    bool pong = false, done = false;
    while (!pong || !done) {
        const struct message *got = receive();
        if (got->type == MESSAGE_ERROR || got->type == MESSAGE_GOODBYE)
            fail_msg("%s", got->type == MESSAGE_ERROR ? got->error.text : got->goodbye.text);
        pong = pong || got->type == MESSAGE_PONG;
        done = done || got->type == MESSAGE_OK;
    }
}

static void who_is_silent_is_closed_but_not_while_he_waits(void **state)
{
    (void)state;
    struct connection_limits limits = patient;
    limits.idle_ms = 60;
    start(&limits);
    greet();
    atomic_store(&engine.keep_jobs, true);
    open_scene(1, 1);
    struct message message = render_message(5, 10);
    send_message(2, 0, &message);
    usleep(1300000); /* past the idle time, and past the second in between two looks */
    expect_alive(3);
    message = made(MESSAGE_CANCEL);
    message.cancel.target_request = 2;
    send_message(4, 0, &message);
    expect_error(2, PROTOCOL_ERROR_CODE_CANCELLED);
    expect(MESSAGE_OK, 4);
    expect_closed_within_5_s();
}

static void who_does_not_read_is_closed(void **state)
{
    (void)state;
    struct connection_limits limits = patient;
    limits.queued_soft_bytes = 1000;
    limits.queued_soft_ms = 100;
    start(&limits);
    greet();
    open_scene(1, 1);
    struct message message = render_message(50, 51);
    send_message(2, 0, &message);
    usleep(500000);
    expect_closed_within_5_s();
    assert_int_equal(atomic_load(&engine.gone), 1);
}

/* ---- keys ---------------------------------------------------------------------------------------------- */

static void who_is_sealed_but_does_not_introduce_himself_is_closed(void **state)
{
    (void)state;
    struct connection_limits limits = patient;
    limits.handshake_ms = 200;
    start(&limits);
    seal_with(&session_key);
    expect_closed_within_5_s();
}

static void who_does_not_finish_a_record_is_closed(void **state)
{
    (void)state;
    struct connection_limits limits = patient;
    limits.progress_grace_ms = 50;
    limits.progress_bytes_per_s = 1000000;
    start(&limits);
    seal_with(&session_key);
    greet();
    const uint8_t length_and_a_byte[5] = {200};
    send_plainly(length_and_a_byte, sizeof length_and_a_byte);
    expect_closed_within_5_s();
}

static void a_record_that_was_changed_is_told_so_and_the_connection_closed(void **state)
{
    (void)state;
    start(&patient);
    seal_with(&session_key);
    greet();
    uint8_t record[21] = {17};
    send_plainly(record, sizeof record);
    expect_error(0, PROTOCOL_ERROR_CODE_PROTOCOL);
    assert_string_equal(client.message.error.field, "record");
    expect(MESSAGE_GOODBYE, 0);
    expect_end();
}

/* The only session; the daemon's thread sleeps. */
static const struct session *only_session(void)
{
    size_t cursor = 0;
    void *session = NULL;
    assert_true(hashmap_next(&served.hub.sessions, &cursor, NULL, &session));
    return session;
}

static void a_key_says_who_it_is_and_what_he_may_do(void **state)
{
    (void)state;
    static const struct sealed_key *const keys[] = {&session_key, &session_reader_key, NULL};
    blob_principal principals[3];
    for (size_t i = 0; i < 3; i++) {
        start(&patient);
        if (keys[i])
            seal_with(keys[i]);
        greet();
        expect_alive(1);
        const struct session *session = only_session();
        principals[i] = session->principal;
        assert_true(session->identity.known);
        assert_int_equal(session->identity.has_key, keys[i] != NULL);
        assert_int_equal(session->identity.read_only, keys[i] == &session_reader_key);
        if (i < 2)
            tear_down(NULL);
    }
    assert_int_not_equal(principals[0], principals[1]);
    assert_int_equal(principals[2], getuid());
    assert_true(principals[0] > UINT32_MAX && principals[1] > UINT32_MAX);
}

static void a_wrong_key_is_answered_after_a_while(void **state)
{
    (void)state;
    static const struct sealed_key wrong = {.bytes = "nobody knows this one"};
    struct connection_limits limits = patient;
    limits.wrong_key_ms = 300;
    start(&limits);
    uint64_t before_ns = clock_now_ns();
    struct decode_error error = {0};
    enum sealed_result result;
    client.link = sealed_link_client(&wrong);
    while ((result = sealed_link_handshake(client.link, &error)) == SEALED_NEED_MORE) {
        struct pollfd fd = {.fd = client.fd, .events = POLLIN};
        send_sealed();
        assert_int_equal(poll(&fd, 1, 20000), 1);
        assert_true(receive_sealed());
    }
    assert_in_range((clock_now_ns() - before_ns) / 1000000, 300, 5000);
    assert_int_equal(result, SEALED_REFUSED);
    assert_int_equal(sealed_status(client.link->sealed), SEALED_WRONG_KEY);
    assert_false(receive_sealed());
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        BOTH(a_ping_is_answered_and_stats_are_told),
        BOTH(edits_are_gathered_and_committed_together),
        BOTH(a_failed_transaction_has_one_answer_and_what_follows_it_is_skipped),
        BOTH(edits_count_until_their_transaction_is_answered),
        BOTH(edits_take_no_more_memory_than_the_limit),
        BOTH(cancels_of_cancels_are_answered_in_their_order),
        BOTH(a_mesh_with_a_blob_that_is_not_held_names_it),
        BOTH(a_blob_is_sent_once_and_needed_no_more),
        BOTH(a_blob_with_another_hash_is_refused_and_can_be_sent_again),
        BOTH(a_size_that_is_only_declared_takes_no_room_from_others),
        BOTH(made_up_hashes_with_the_same_head_are_told_apart),
        BOTH(blob_data_on_another_channel_ends_the_connection),
        BOTH(frames_come_whole_in_order_and_as_far_as_credit_goes),
        BOTH(a_cancelled_job_has_one_answer_and_nothing_follows_it),
        BOTH(a_job_whose_credit_is_used_up_is_told_so_once),
        BOTH(a_job_cancelled_while_it_sends_ends_at_its_answer),
        BOTH(a_job_that_cannot_be_is_refused_by_its_field),
        BOTH(skins_clips_and_channels_become_edits),
        BOTH(weights_count_as_memory_of_a_transaction),
        BOTH(a_job_takes_its_clips_and_its_lens_along),
        BOTH(settings_of_cubes_go_to_the_engine_with_the_daemons_limits),
        BOTH(layers_go_to_the_engine_and_come_with_the_frame),
        BOTH(layers_that_pixels_or_messages_do_not_hold_are_refused),
        BOTH(settings_that_no_cube_has_are_refused_by_their_field),
        BOTH(settings_of_a_buffers_and_light_go_to_the_engine),
        BOTH(settings_that_no_a_buffer_has_are_refused_by_their_field),
        BOTH(layers_count_as_pictures_in_the_memory_for_frames),
        BOTH(cubes_of_a_frame_are_told),
        BOTH(a_job_whose_frames_have_no_room_waits_for_others_to_end),
        BOTH(a_full_engine_makes_clients_wait_and_loses_nothing),
        BOTH(messages_that_come_while_the_engine_is_full_are_answered_later),
        BOTH(rubbish_is_told_so_and_the_connection_closed),
        BOTH(a_request_number_in_flight_cannot_be_used_again),
        BOTH(the_65th_request_in_flight_is_refused_and_can_be_retried),
        BOTH(a_client_that_vanishes_is_forgotten),
        cmocka_unit_test(every_message_of_a_client_has_a_row),
        cmocka_unit_test(the_head_of_a_frame_piece_is_what_the_codec_writes),
        cmocka_unit_test_setup_teardown(who_does_not_introduce_himself_is_closed, real_calls, tear_down),
        cmocka_unit_test_setup_teardown(who_does_not_finish_a_message_is_closed, real_calls, tear_down),
        cmocka_unit_test_setup_teardown(who_cannot_finish_a_message_because_nothing_is_read_has_his_time_later,
                                        real_calls, tear_down),
        cmocka_unit_test_setup_teardown(who_is_silent_is_closed_but_not_while_he_waits, real_calls, tear_down),
        cmocka_unit_test_setup_teardown(who_does_not_read_is_closed, real_calls, tear_down),
        cmocka_unit_test_setup_teardown(who_is_sealed_but_does_not_introduce_himself_is_closed, real_calls,
                                        tear_down),
        cmocka_unit_test_setup_teardown(who_does_not_finish_a_record_is_closed, real_calls, tear_down),
        cmocka_unit_test_setup_teardown(a_record_that_was_changed_is_told_so_and_the_connection_closed, real_calls,
                                        tear_down),
        cmocka_unit_test_setup_teardown(a_key_says_who_it_is_and_what_he_may_do, real_calls, tear_down),
        cmocka_unit_test_setup_teardown(a_wrong_key_is_answered_after_a_while, real_calls, tear_down),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
