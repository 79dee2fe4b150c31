/* SPDX-License-Identifier: MIT */
/* Limits of the configuration, reached by clients of a daemon that has small ones: what is told beforehand, what
 * is told when one is reached, that just within is fine, and that another client does not notice. Limits that
 * belong to one subject are reached in its tests: requests, silence and slow readers in session.c, edits and
 * the memory of blobs in edits.c, that of frames in jobs.c, jobs in views.c, open scenes in scenes.c, scenes that
 * linger in unit/engine/scenes.c, layers and memory of tracers in limits.c of unit/trace/ldc and
 * unit/trace/abuffer, keys and connections of one address in the integration tests. */
#include "tests/unit/session/clients_fixture.h"
#include "tests/harness/test.h"

#include <inttypes.h>

#include <errno.h>

/* ---- steps ------------------------------------------------------------------------------------------- */

static void expect_limit(struct client *client, uint32_t request, const char *field, const char *option)
{
    expect_error(client, request, PROTOCOL_ERROR_LIMIT);
    assert_string_equal(client->message.error.field, field);
    if (!strstr(client->message.error.remedy, option))
        fail_msg("\"%s\" does not name %s", client->message.error.remedy, option);
}

/* The next byte, or the end, has come. */
static bool has_come(const struct client *client, int wait_ms)
{
    struct pollfd fd = {.fd = client->fd, .events = POLLIN};
    return poll(&fd, 1, wait_ms) == 1;
}

static void upload(struct client *client, uint32_t request, const struct record_blob_ref *reference,
                   const void *data)
{
    assert_int_equal(offer(client, request, *reference), 1);
    send_blob(client, request + 1, reference, data);
    expect_ok(client, request + 1);
}

static struct message render_message(uint32_t width, uint32_t height, uint32_t samples)
{
    struct message message = made(MESSAGE_RENDER);
    message.render.scene = 1;
    message.render.channel = 2;
    message.render.credit = 1;
    message.render.picture.width = width;
    message.render.picture.height = height;
    message.render.sampling.samples = samples;
    return message;
}

static void expect_picture(struct client *client, uint32_t request)
{
    do
        receive(client);
    while (client->message.type == MESSAGE_FRAME_BEGIN || client->message.type == MESSAGE_FRAME_DATA);
    assert_int_equal(client->message.type, MESSAGE_FRAME_END);
    expect_ok(client, request);
}

/* ---- what is told ------------------------------------------------------------------------------------ */

EACH_TEST(set_options, tear_down)

TEST(every_limit_is_stated_in_the_handshake)
{
    options = (struct hub_options){
        .limits = {.clients = 101,
                   .unauthenticated = 102,
                   .unauthenticated_per_address = 103,
                   .handshakes_a_second = 4,
                   .requests_in_flight = 105,
                   .scenes_per_client = 106,
                   .jobs_per_client = 107,
                   .blobs_per_client = 108,
                   .transaction_edits = 109,
                   .nodes = 110,
                   .depth = 111,
                   .texture_edge_texels = 112,
                   .width_pixels = 113,
                   .height_pixels = 114,
                   .samples = 115,
                   .tracers = {.ldc_layers = 116, .ldc_mebibytes = 117, .abuffer_mebibytes = 118},
                   .blob_bytes = 119000,
                   .transaction_bytes = 120,
                   .upload_window_bytes = 121,
                   .frame_bytes = 122,
                   .frames_in_flight = 3,
                   .frame_window_bytes = 123},
        .connection_limits = {.handshake_ms = 12400,
                              .wrong_key_ms = 125,
                              .progress_grace_ms = 12600,
                              .progress_bytes_per_s = 127,
                              .idle_ms = 128999,
                              .lost_ms = 136,
                              .queued_soft_ms = 12900,
                              .queued_soft_bytes = 130000,
                              .queued_hard_bytes = 131000},
        .engine_limits = {.scene = {.host_bytes = 132}, .scene_linger_ms = 133000, .lingering_scenes = 134},
        .device_bytes = 135,
    };
    const struct handshake_limits expected = {
        .queued_output_bytes = 131000,
        .scene_memory_bytes = 132,
        .handshake_ms = 12400,
        .control_payload_max_bytes = CODEC_CONTROL_PAYLOAD_MAX_BYTES,
        .bulk_chunk_max_bytes = 262144,
        .requests_in_flight = 105,
        .scenes_per_client = 106,
        .views_per_client = 107,
        .nodes_max = 110,
        .texture_edge_max = 112,
        .width_max = 113,
        .height_max = 114,
        .samples_max = 115,
        .idle_seconds = 128,
        .queued_soft_bytes = 130000,
        .device_memory_bytes = 135,
        .blob_memory_bytes = 119000,
        .transaction_memory_bytes = 120,
        .frame_memory_bytes = 122,
        .ldc_memory_bytes = 117u << 20,
        .abuffer_memory_bytes = 118u << 20,
        .upload_window_bytes = 121,
        .frame_window_bytes = 123,
        .queued_soft_ms = 12900,
        .progress_grace_ms = 12600,
        .progress_bytes_per_s = 127,
        .clients_max = 101,
        .unauthenticated_max = 102,
        .unauthenticated_per_address = 103,
        .wrong_key_ms = 125,
        .depth_max = 111,
        .blobs_per_client = 108,
        .transaction_edits = 109,
        .scene_linger_seconds = 133,
        .scenes_lingering = 134,
        .ldc_layers_max = 116,
        .lost_after_ms = 136,
        .handshakes_per_second = 4,
    };
    start_daemon();
    struct client *client = come(false);
    struct handshake_limit told, wanted;
    for (size_t i = 0; handshake_limit_at(&expected, i, &wanted); i++) {
        assert_true(handshake_limit_at(&client->limits, i, &told));
        if (told.value != wanted.value)
            fail_msg("%s: %" PRIu64 " is told, not %" PRIu64, told.name, told.value, wanted.value);
    }
}

TEST(times_below_a_second_are_not_stated_as_none)
{
    options.connection_limits.idle_ms = 900;
    options.engine_limits.scene_linger_ms = 0;
    start_daemon();
    struct client *client = come(false);
    assert_int_equal(client->limits.idle_seconds, 1);
    assert_int_equal(client->limits.scene_linger_seconds, 0);
}

/* ---- connections ------------------------------------------------------------------------------------- */

/* Begins a transaction with one edit, for which room for 32 is taken. */
static void begin_with_node(struct client *client, uint32_t request)
{
    begin_edit(client, request, 1);
    send_node(client, request, 1, 0);
}

TEST(edits_that_wait_take_no_more_memory_than_the_limit)
{
    options.limits.transaction_bytes = 2 * 32 * sizeof(struct scene_edit);
    start_daemon();
    struct client *one = come(true), *two = come(true);
    open_scene_as(one, 1, "", PROTOCOL_SHARING_PRIVATE);
    open_scene_as(two, 1, "", PROTOCOL_SHARING_PRIVATE);
    begin_with_node(one, 1);
    expect_alive(one, 900); /* the edit has been read */
    begin_with_node(two, 2);
    expect_alive(two, 900);
    begin_with_node(one, 3);
    expect_error(one, 3, PROTOCOL_ERROR_LIMIT);
    commit(two, 2);
    assert_int_equal(expect_ok(two, 2), 1);
    begin_with_node(one, 5);
    commit(one, 5);
    assert_int_equal(expect_ok(one, 5), 1);
}

#define SLOW_BYTES 30000

TEST(a_message_may_be_slow_but_not_slower_than_the_limit)
{
    options.connection_limits.progress_grace_ms = 200;
    options.connection_limits.progress_bytes_per_s = 300;
    start_daemon();
    static uint8_t data[SLOW_BYTES], bytes[FRAMING_MESSAGE_MAX_BYTES];
    struct record_blob_ref reference = reference_to(data, sizeof(data));
    struct client *within = come(false), *slower = come(false);
    assert_int_equal(offer(within, 1, reference), 1);
    struct message message = made(MESSAGE_BLOB_DATA);
    memcpy(message.blob_data.hash, reference.hash, sizeof(reference.hash));
    message.blob_data.data = data;
    message.blob_data.data_bytes = sizeof(data);
    struct writer writer;
    writer_init(&writer, bytes, sizeof(bytes));
    assert_true(message_write(&writer, 2, 1, &message));
    /* 2000 bytes each time, as this thread may have to wait for the processor for seconds; and one byte each time.
     * The whole takes several times the grace. */
    uint64_t begun_ns = clock_now_ns();
    bool told = false;
    for (size_t sent = 0; sent < writer.used_bytes; sent += 2000) {
        size_t left = writer.used_bytes - sent;
        assert_true(send(within->fd, bytes + sent, left < 2000 ? left : 2000, MSG_NOSIGNAL) > 0);
        if (!told)
            send(slower->fd, bytes + sent / 2000, 1, MSG_NOSIGNAL);
        usleep(50000);
        told = told || has_come(slower, 0);
    }
    assert_true(clock_now_ns() - begun_ns > 3 * 200 * UINT64_C(1000000));
    expect_ok(within, 2);
    expect_error(slower, 0, PROTOCOL_ERROR_TIMEOUT);
    assert_non_null(strstr(slower->message.error.text, "at less than 300 bytes a second"));
    expect(slower, MESSAGE_GOODBYE, 0);
    expect_alive(within, 900);
}

TEST(a_client_with_too_much_unread_output_is_disconnected_at_once)
{
    options.connection_limits.queued_hard_bytes = 64 << 10;
    options.connection_limits.queued_soft_bytes = 1 << 30; /* which would have it wait to read more */
    options.connection_limits.queued_soft_ms = 600000;
    start_daemon();
    struct client *client = come(false), *within = come(false);
    struct message message = made(MESSAGE_PING);
    for (uint32_t request = 1; request <= 500; request++)
        send_message(within, request, 0, &message); /* about 16 KiB of answers */
    uint8_t bytes[64];
    struct writer writer;
    writer_init(&writer, bytes, sizeof(bytes));
    assert_true(message_write(&writer, 7, 0, &message));
    unsigned pings = 0;
    while (send(client->fd, bytes, writer.used_bytes, MSG_NOSIGNAL) == (ssize_t)writer.used_bytes) {
        if (++pings == 200000)
            fail_msg("it may let %u answers wait", pings);
    }
    assert_true(errno == EPIPE || errno == ECONNRESET);
    assert_true(pings * writer.used_bytes > 64 << 10); /* and not before that */
    for (uint32_t request = 1; request <= 500; request++)
        expect(within, MESSAGE_PONG, request);
    expect_alive(within, 900);
}

/* ---- scenes ------------------------------------------------------------------------------------------ */

TEST(nodes_of_a_scene_are_limited)
{
    options.engine_limits.scene.nodes = 3;
    start_daemon();
    struct client *client = come(false), *other = come(true);
    open_scene_as(client, 1, "", PROTOCOL_SHARING_PRIVATE);
    begin_edit(client, 1, 1);
    for (uint32_t node = 1; node <= 3; node++)
        send_node(client, 1, node, 0);
    commit(client, 1);
    assert_int_equal(expect_ok(client, 1), 1);
    begin_edit(client, 2, 1);
    send_node(client, 2, 4, 0);
    commit(client, 2);
    expect_limit(client, 2, "edits", "limits.nodes");
    /* Another one has as many of its own. */
    open_scene_as(other, 1, "", PROTOCOL_SHARING_PRIVATE);
    assert_int_equal(commit_node(other, 1, 1, 4), 1);
}

TEST(the_depth_of_a_hierarchy_is_limited)
{
    options.engine_limits.scene.depth = options.limits.depth = 3;
    start_daemon();
    struct client *client = come(false), *other = come(true);
    assert_int_equal(client->limits.depth_max, 3);
    open_scene_as(client, 1, "", PROTOCOL_SHARING_PRIVATE);
    begin_edit(client, 1, 1);
    for (uint32_t node = 1; node <= 3; node++)
        send_node(client, 1, node, node - 1);
    commit(client, 1);
    assert_int_equal(expect_ok(client, 1), 1);
    begin_edit(client, 2, 1);
    send_node(client, 2, 4, 3);
    commit(client, 2);
    expect_limit(client, 2, "edits[0] (node 4).parent", "limits.depth");
    assert_non_null(strstr(client->message.error.text, "more than 3 levels"));
    begin_edit(client, 3, 1);
    send_node(client, 3, 4, 2);
    commit(client, 3);
    assert_int_equal(expect_ok(client, 3), 2);
    expect_alive(other, 900);
}

#define SPHERES 1000

TEST(memory_of_a_scene_is_limited)
{
    options.engine_limits.scene.host_bytes = 20000; /* enough for one set of 16,000 bytes, not for two */
    start_daemon();
    struct client *client = come(false), *other = come(true);
    static float spheres[4 * SPHERES];
    for (size_t i = 0; i < sizeof(spheres) / sizeof(spheres[0]); i++)
        spheres[i] = 1;
    struct record_blob_ref reference = reference_to(spheres, sizeof(spheres));
    open_scene_as(client, 1, "", PROTOCOL_SHARING_PRIVATE);
    upload(client, 1, &reference, spheres);
    struct message message = made(MESSAGE_SET_SPHERES);
    message.set_spheres.value.sphere_count = SPHERES;
    message.set_spheres.arrays = &reference;
    message.set_spheres.arrays_count = 1;
    for (uint32_t set = 1; set <= 2; set++) {
        message.set_spheres.spheres = set;
        begin_edit(client, 2 + set, 1);
        send_message(client, 2 + set, 0, &message);
        commit(client, 2 + set);
        if (set == 1)
            assert_int_equal(expect_ok(client, 3), 1);
    }
    expect_limit(client, 4, "edits", "memory.scene");
    expect_alive(other, 900);
}

/* An image of so many texels, which has been uploaded where it is within the limit. */
static void send_texture(struct client *client, uint32_t request, uint32_t width, uint32_t height,
                         struct record_blob_ref *reference)
{
    struct message message = made(MESSAGE_SET_TEXTURE);
    message.set_texture.texture = 1;
    message.set_texture.value.width = width;
    message.set_texture.value.height = height;
    message.set_texture.arrays = reference;
    message.set_texture.arrays_count = 1;
    begin_edit(client, request, 1);
    send_message(client, request, 0, &message);
    commit(client, request);
}

TEST(edges_of_images_are_limited)
{
    start_daemon(); /* 64 */
    struct client *client = come(false), *other = come(true);
    static uint8_t texels[64 * 64 * 4];
    struct record_blob_ref reference = reference_to(texels, sizeof(texels));
    open_scene_as(client, 1, "", PROTOCOL_SHARING_PRIVATE);
    upload(client, 1, &reference, texels);
    send_texture(client, 3, 64, 64, &reference);
    assert_int_equal(expect_ok(client, 3), 1);
    send_texture(client, 4, 65, 1, &reference);
    expect_limit(client, 4, "set_texture", "limits.texture_edge");
    send_texture(client, 5, 1, 65, &reference);
    expect_limit(client, 5, "set_texture", "limits.texture_edge");
    struct message message = made(MESSAGE_SET_ENVIRONMENT);
    message.set_environment.value.width = 65;
    message.set_environment.value.height = 1;
    message.set_environment.arrays = &reference;
    message.set_environment.arrays_count = 1;
    begin_edit(client, 6, 1);
    send_message(client, 6, 0, &message);
    commit(client, 6);
    expect_limit(client, 6, "set_environment", "limits.texture_edge");
    expect_alive(other, 900);
}

/* ---- blobs ------------------------------------------------------------------------------------------- */

TEST(blobs_of_a_connection_are_limited)
{
    options.limits.blobs_per_client = 3;
    start_daemon();
    struct client *client = come(false), *other = come(true);
    uint8_t data[4] = {0};
    for (uint8_t i = 1; i <= 3; i++) {
        data[0] = i;
        struct record_blob_ref reference = reference_to(data, sizeof(data));
        upload(client, 2 * i, &reference, data);
        assert_int_equal(offer(client, 2 * i, reference), 0); /* a repeated offer does not count */
    }
    data[0] = 4;
    struct record_blob_ref reference = reference_to(data, sizeof(data));
    struct message message = made(MESSAGE_BLOB_OFFER);
    message.blob_offer.blobs = &reference;
    message.blob_offer.blobs_count = 1;
    send_message(client, 8, 0, &message);
    expect_limit(client, 8, "blob_offer.blobs", "limits.blobs");
    upload(other, 1, &reference, data);
    expect_alive(client, 900);
}

TEST(upload_credit_limits_what_is_sent_ahead)
{
    options.limits.upload_window_bytes = 1000; /* less than one message may have */
    start_daemon();
    struct client *client = come(false), *other = come(true);
    static uint8_t data[2500];
    struct record_blob_ref all = reference_to(data, 1000), more = reference_to(data, 1001);
    upload(client, 1, &all, data);
    expect_alive(client, 900);
    assert_int_equal(client->upload_credit, 2000);
    assert_int_equal(offer(client, 3, more), 1);
    send_blob(client, 4, &more, data);
    expect_error(client, 0, PROTOCOL_ERROR_PROTOCOL);
    assert_string_equal(client->message.error.field, "blob_data");
    assert_non_null(strstr(client->message.error.text, "credit"));
    expect(client, MESSAGE_GOODBYE, 0);
    expect_end(client);
    expect_alive(other, 900);
}

/* ---- pictures ---------------------------------------------------------------------------------------- */

TEST(pixels_and_samples_of_a_picture_are_limited)
{
    options.limits.width_pixels = 100;
    options.limits.height_pixels = 50;
    options.limits.samples = 16;
    start_daemon();
    static const struct {
        uint32_t width, height, samples;
        const char *field;
    } beyond[] = {{101, 50, 16, "render.width"}, {100, 51, 16, "render.height"}, {100, 50, 17, "render.samples"}};
    struct client *client = come(false), *other = come(true);
    struct client *both[] = {client, other};
    for (uint32_t i = 0; i < 2; i++)
        open_scene_as(both[i], 1, "", PROTOCOL_SHARING_PRIVATE);
    for (uint32_t i = 0; i < 3; i++) {
        struct message message = render_message(beyond[i].width, beyond[i].height, beyond[i].samples);
        send_message(client, 1 + i, 0, &message);
        expect_limit(client, 1 + i, beyond[i].field, "[limits]");
    }
    for (uint32_t i = 0; i < 2; i++) {
        struct message message = render_message(100, 50, 16);
        send_message(both[i], 10, 0, &message);
        expect_picture(both[i], 10);
    }
}

TEST(frames_that_wait_for_a_slow_reader_are_limited)
{
    options.limits.frame_window_bytes = 2 << 20;
    start_daemon();
    struct client *client = come(false), *other = come(false);
    open_scene_as(client, 1, "", PROTOCOL_SHARING_PRIVATE);
    struct message message = render_message(512, 512, 1); /* 1 MiB, more than the socket takes */
    message.render.credit = 100;
    message.render.last_frame = 9;
    send_message(client, 1, 0, &message);
    wait_until(&fake.frames_begun, 2 + 3); /* two here, three in the engine */
    usleep(300000);
    assert_int_equal(atomic_load(&fake.frames_begun), 2 + 3);
    expect_alive(other, 900);
    for (uint32_t frame = 0; frame <= 9; frame++) {
        expect(client, MESSAGE_FRAME_BEGIN, 1);
        assert_int_equal(client->message.frame_begin.frame, frame);
        do
            receive(client);
        while (client->message.type == MESSAGE_FRAME_DATA);
        assert_int_equal(client->message.type, MESSAGE_FRAME_END);
    }
    expect_ok(client, 1);
}
