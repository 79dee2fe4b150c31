/* SPDX-License-Identifier: MIT */
/* A daemon on a thread of its own, with the real engine but for its renderer, and any number of
 * clients of it here. */
#ifndef FARLIGHT_TESTS_CLIENTS_FIXTURE_H
#define FARLIGHT_TESTS_CLIENTS_FIXTURE_H

#include "tests/unit/engine/engine_fake.h"
#include "tests/unit/session/client.h"

#include "net/handover.h"
#include "session/others.h"
#include "session/session.h"

#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

/* ---- the daemon -------------------------------------------------------------------------------------- */

static struct {
    struct daemon daemon;
    pthread_t thread;
    int front; /* the test's end of the channel by which clients are handed over */
} served;

static inline void *run(void *context)
{
    (void)context;
    struct error error = {0};
    bool device_gone;
    daemon_run(&served.daemon, &device_gone, &error);
    return NULL;
}

static struct hub_options options; /* which a test may change before it starts the daemon */
static bool users_look_only;       /* set by the front for readers */

static inline int set_options(void **state)
{
    (void)state;
    options = (struct hub_options){
        .limits = {.clients = 16,
                   .requests_in_flight = 64,
                   .scenes_per_client = 3,
                   .jobs_per_client = 4,
                   .tracers.ldc_layers = 255,
                   .blobs_per_client = 64,
                   .transaction_edits = 1000,
                   .transaction_bytes = 1 << 20,
                   .nodes = 100,
                   .depth = 10,
                   .texture_edge_texels = 64,
                   .width_pixels = 512,
                   .height_pixels = 512,
                   .samples = 64,
                   .blob_bytes = 8 << 20,
                   .upload_window_bytes = 1 << 20,
                   .frame_bytes = 10 << 20,
                   .frames_in_flight = 3,
                   .frame_window_bytes = 1 << 20},
        .connection_limits = {.handshake_ms = 10000,
                              .progress_grace_ms = 10000,
                              .progress_bytes_per_s = 1,
                              .idle_ms = 60000,
                              .queued_soft_ms = 10000,
                              .queued_soft_bytes = 16 << 20,
                              .queued_hard_bytes = 64 << 20},
        .engine_limits = {.scene_linger_ms = 600000},
    };
    users_look_only = false;
    daemon_block_signals();
    return 0;
}

static inline void start_daemon(void)
{
    struct error error = {0};
    start((struct engine_options){.limits = options.engine_limits});
    options.engine = engine_port(engine);
    int ends[2];
    assert_true(channel_pair(ends, &error));
    served.front = ends[1];
    daemon_init(&served.daemon);
    served.daemon.unused_s = 3600;
    assert_true(daemon_start(&served.daemon, &options, &error));
    assert_true(daemon_serve_front(&served.daemon, ends[0], NULL, &error));
    others_reach(served.daemon.hub.others, NULL); /* the test answers no question */
    assert_int_equal(pthread_create(&served.thread, NULL, run, NULL), 0);
}

/* ---- clients ----------------------------------------------------------------------------------------- */

/* Those that are there: the end of the test closes them. */
static struct client *present[64];

static inline uint64_t expect_ok(struct client *client, uint32_t request)
{
    expect(client, MESSAGE_OK, request);
    return client->message.ok.revision;
}

/* A user, or with `is_stranger` somebody whom nobody knows. Says nothing yet. */
static inline struct client *knock(bool is_stranger)
{
    struct client *client = calloc(1, sizeof(*client));
    int pair[2];
    struct handover handover = {.peer = {.storage.ss_family = AF_UNIX, .storage_bytes = sizeof(sa_family_t)}};
    if (!is_stranger)
        handover.identity = (struct auth_identity){
            .known = true, .has_user = true, .user = geteuid(), .read_only = users_look_only};
    else
        handover.peer.storage.ss_family = AF_INET;
    snprintf(handover.identity.name, sizeof(handover.identity.name), "%s", is_stranger ? "a stranger" : "a user");
    assert_non_null(client);
    assert_int_equal(socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair), 0);
    assert_int_equal(fcntl(pair[0], F_SETFL, O_NONBLOCK), 0);
    const int fds[CHANNEL_FDS] = {pair[0], memfd_create("nothing was read", MFD_CLOEXEC)};
    channel_say(served.front, CHANNEL_CLIENT, &handover, sizeof(handover), fds);
    close(fds[0]);
    close(fds[1]);
    client->fd = pair[1];
    size_t place = 0;
    while (present[place])
        place++;
    return present[place] = client;
}

static inline struct client *come(bool is_stranger)
{
    struct client *client = knock(is_stranger);
    greet_with(client, 0);
    return client;
}

static inline void go(struct client *client)
{
    for (size_t i = 0; i < sizeof(present) / sizeof(present[0]); i++) {
        if (present[i] == client)
            present[i] = NULL;
    }
    close(client->fd);
    free(client);
}

/* Without a word, as when a line is cut. With a witness, the only other client, the daemon has noticed when this
 * returns. */
static inline void cut(struct client *client, struct client *witness)
{
    go(client);
    uint32_t clients;
    do {
        struct message message = made(MESSAGE_STATS);
        send_message(witness, 777, 0, &message);
        expect(witness, MESSAGE_STATS_REPLY, 777);
        clients = witness->message.stats_reply.clients_count;
        usleep(1000);
    } while (clients > 1);
}

static inline int tear_down(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof(present) / sizeof(present[0]); i++) {
        if (present[i])
            go(present[i]);
    }
    kill(getpid(), SIGTERM); /* blocked in every thread: the daemon's loop takes it */
    pthread_join(served.thread, NULL);
    daemon_finish(&served.daemon);
    close(served.front);
    stop();
    return 0;
}

static inline void submit_open(struct client *client, uint32_t scene, const char *name,
                               enum protocol_sharing sharing)
{
    struct message message = made(MESSAGE_SCENE_OPEN);
    message.scene_open.scene = scene;
    message.scene_open.sharing = sharing;
    message.scene_open.name = name;
    send_message(client, 100 + scene, 0, &message);
}

static inline void open_scene_as(struct client *client, uint32_t scene, const char *name,
                                 enum protocol_sharing sharing)
{
    submit_open(client, scene, name, sharing);
    assert_int_equal(expect_ok(client, 100 + scene), 0);
}

static inline uint64_t commit_node(struct client *client, uint32_t request, uint32_t scene, uint32_t node)
{
    begin_edit(client, request, scene);
    send_node(client, request, node, 0);
    commit(client, request);
    return expect_ok(client, request);
}

static inline void send_blob(struct client *client, uint32_t request, const struct record_blob_ref *reference,
                             const void *data)
{
    struct message message = made(MESSAGE_BLOB_DATA);
    memcpy(message.blob_data.hash, reference->hash, sizeof(reference->hash));
    message.blob_data.data = data;
    message.blob_data.data_bytes = (uint32_t)reference->size_bytes;
    send_message(client, request, 1, &message);
}

/* The revision that a frame shows. */
static inline uint64_t render_frame(struct client *client, uint32_t request, uint32_t scene)
{
    struct message message = made(MESSAGE_RENDER);
    message.render.picture.width = message.render.picture.height = 1;
    message.render.scene = scene;
    message.render.channel = request;
    message.render.credit = 1;
    send_message(client, request, 0, &message);
    expect(client, MESSAGE_FRAME_BEGIN, request);
    uint64_t revision = client->message.frame_begin.revision;
    expect(client, MESSAGE_FRAME_DATA, request);
    expect(client, MESSAGE_FRAME_END, request);
    expect_ok(client, request);
    return revision;
}

#endif
