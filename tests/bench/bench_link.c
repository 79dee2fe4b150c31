/* SPDX-License-Identifier: MIT */
/* Cost of sealing: frames from the daemon's network side to the library over TCP on loopback, open and sealed
 * by turns. bench link [MIB [RUNS]] prints JSON: "mib", and for "open" and "sealed" a figure for each run:
 * "wall_ns" from the connect to the last byte, "daemon_ns" and "client_ns", the processor time of either end. */
#include "tests/bench/bench.h"

#include "base/clock.h"
#include "lib/connection.h"
#include "net/connection.h"
#include "net/listen.h"
#include "protocol/sealed/key.h"
#include "session/frame_messages.h"
#include "session/frames.h"

#include <inttypes.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <time.h>
#include <unistd.h>

#define CHANNEL 2
#define RUNS_MAX 64

static struct served {
    struct loop *loop;
    struct listener listener;
    struct connection *connection;
    struct sealed_key key;
    uint64_t pieces_left, sent_bytes;
    uint64_t cpu_ns;
} served;
static struct out_chunk piece;

static uint64_t thread_ns(void)
{
    struct timespec time;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return (uint64_t)time.tv_sec * 1000000000u + (uint64_t)time.tv_nsec;
}

static _Noreturn void die(const char *what)
{
    fprintf(stderr, "bench link: %s\n", what);
    exit(1);
}

/* ---- the daemon's end -------------------------------------------------------------------------------- */

static bool on_hello(void *context, const struct handshake_hello *hello, struct handshake_reply *reply)
{
    (void)context;
    reply->version = handshake_choose_version(hello, NULL);
    return true;
}

static uint64_t on_seal_wait_ns(void *context)
{
    (void)context;
    return 0;
}

static void on_key(void *context)
{
    (void)context;
}

static void on_key_proved(void *context, size_t index)
{
    (void)context, (void)index;
}

static void on_message(void *context, const struct framing_header *header, const struct message *message)
{
    (void)context, (void)header;
    if (message->type == MESSAGE_GOODBYE)
        connection_close(served.connection);
}

static void on_invalid(void *context, const struct framing_header *header, const struct decode_error *error)
{
    (void)context, (void)header, (void)error;
    die("the library sent what is not valid");
}

static void on_room(void *context)
{
    (void)context;
    while (served.pieces_left && connection_wants_bulk(served.connection)) {
        struct out_message *message = out_message_create(FRAME_DATA_HEAD_BYTES);
        if (!message)
            die("no memory");
        frame_data_head(message->head, 1, CHANNEL, served.sent_bytes, (uint32_t)FRAME_PIECE_BYTES);
        message->body = &piece;
        message->body_bytes = FRAME_PIECE_BYTES;
        out_chunk_ref(&piece);
        connection_send_raw(served.connection, message, true);
        served.pieces_left--;
        served.sent_bytes += FRAME_PIECE_BYTES;
    }
}

static bool on_awaited(const void *context)
{
    (void)context;
    return true;
}

static void on_closed(void *context)
{
    (void)context;
    loop_stop(served.loop);
}

static void accept_one(void *context, uint32_t epoll_events)
{
    static const struct connection_limits limits = {.handshake_ms = 10000,
                                                    .progress_grace_ms = 10000,
                                                    .progress_bytes_per_s = 1,
                                                    .queued_soft_ms = 10000,
                                                    .queued_soft_bytes = 16 << 20,
                                                    .queued_hard_bytes = 64 << 20};
    static const struct connection_handler handler = {.seal_wait_ns = on_seal_wait_ns,
                                                      .key_failed = on_key,
                                                      .key_proved = on_key_proved,
                                                      .hello = on_hello,
                                                      .opened = on_key,
                                                      .message = on_message,
                                                      .invalid = on_invalid,
                                                      .room = on_room,
                                                      .awaited = on_awaited,
                                                      .closed = on_closed};
    const struct connection_entry entry = {.keys = &served.key, .key_count = 1};
    (void)context, (void)epoll_events;
    struct address peer;
    bool retry_later;
    struct error error = {0};
    int fd = listener_accept(&served.listener, &peer, &retry_later);
    if (fd < 0)
        return;
    served.connection = connection_create(served.loop, fd, &limits, &entry, &handler, NULL, NULL, &error);
    if (!served.connection)
        die(error.text);
}

static void *serve(void *context)
{
    (void)context;
    struct error error = {0};
    uint64_t begin_ns = thread_ns();
    served.loop = loop_create(&error);
    struct loop_watch *watch =
        served.loop ? loop_watch_add(served.loop, served.listener.fd, EPOLLIN, accept_one, NULL, &error) : NULL;
    if (!watch || !loop_run(served.loop, &error))
        die(error.text);
    loop_watch_remove(watch);
    loop_run_deferred(served.loop);
    loop_destroy(served.loop);
    served.cpu_ns = thread_ns() - begin_ns;
    return NULL;
}

/* ---- a run ------------------------------------------------------------------------------------------- */

struct run {
    uint64_t wall_ns, daemon_ns, client_ns;
};

static struct run run_once(const char *address, const char *key_file, uint64_t pieces)
{
    struct fl_error error = {0};
    struct fl_received received;
    pthread_t thread;
    served.pieces_left = pieces;
    served.sent_bytes = 0;
    if (pthread_create(&thread, NULL, serve, NULL) != 0)
        die("no thread");
    uint64_t client_begin_ns = thread_ns(), begin_ns = clock_now_ns();
    struct fl_connection *connection =
        fl_connect(&(struct fl_connect_options){.server = address, .key_file = key_file}, &error);
    if (!connection)
        die(error.text);
    for (uint64_t i = 0; i < pieces; i++) {
        if (!fl_connection_receive(connection, &received, UINT64_MAX, &error))
            die(error.text);
        if (received.message.type != MESSAGE_FRAME_DATA ||
            memcmp(received.message.frame_data.data, piece.data, FRAME_PIECE_BYTES) != 0)
            die("other bytes came than were sent");
    }
    struct run run = {.wall_ns = clock_now_ns() - begin_ns, .client_ns = thread_ns() - client_begin_ns};
    fl_connection_destroy(connection);
    pthread_join(thread, NULL);
    run.daemon_ns = served.cpu_ns;
    return run;
}

static void print_runs(const char *name, const struct run *runs, unsigned long count)
{
    static const char *const fields[] = {"wall_ns", "daemon_ns", "client_ns"};
    printf(",\"%s\":{", name);
    for (unsigned field = 0; field < 3; field++) {
        printf("%s\"%s\":[", field ? "," : "", fields[field]);
        for (unsigned long i = 0; i < count; i++) {
            const uint64_t values[] = {runs[i].wall_ns, runs[i].daemon_ns, runs[i].client_ns};
            printf("%s%" PRIu64, i ? "," : "", values[field]);
        }
        printf("]");
    }
    printf("}");
}

BENCH(link)
{
    const unsigned long mib = argc > 1 ? strtoul(argv[1], NULL, 10) : 512;
    const unsigned long count = argc > 2 ? strtoul(argv[2], NULL, 10) : 7;
    static struct run runs[2][RUNS_MAX]; /* open, sealed */
    char folder[] = P_tmpdir "/farlight-bench-XXXXXX", key_file[sizeof(folder) + 8], text[ADDRESS_TEXT_BYTES];
    struct decode_error why = {0};
    struct error error = {0};
    struct address address;
    if (mib < 1 || mib > 65536 || count < 1 || count > RUNS_MAX)
        die("bench link [MIB [RUNS]]");
    uint8_t *data = malloc(FRAME_PIECE_BYTES);
    if (!data || !mkdtemp(folder))
        die("no memory, or no folder");
    for (size_t i = 0; i < FRAME_PIECE_BYTES; i++)
        data[i] = (uint8_t)(i * 2654435761u >> 13);
    piece = (struct out_chunk){.references = 1, .data = data, .size_bytes = FRAME_PIECE_BYTES};
    snprintf(key_file, sizeof(key_file), "%s/key", folder);
    if (!sealed_key_create(key_file, &why) || !sealed_key_read(&served.key, key_file, &why))
        die(why.text);
    if (!address_parse(&address, "tcp:127.0.0.1:0", &error) ||
        !listener_open(&served.listener, &address, false, &error))
        die(error.text);
    address_print(&served.listener.address, text);
    const uint64_t pieces = mib * ((1 << 20) / FRAME_PIECE_BYTES);
    for (unsigned long i = 0; i < 2 * count; i++)
        runs[i % 2][i / 2] = run_once(text, i % 2 ? key_file : NULL, pieces);
    printf("{\"mib\":%lu", mib);
    print_runs("open", runs[0], count);
    print_runs("sealed", runs[1], count);
    printf("}\n");
    unlink(key_file);
    rmdir(folder);
    listener_close(&served.listener);
    free(data);
    return 0;
}
