/* SPDX-License-Identifier: MIT */
/* A daemon that a thread of the test plays, message by message. */
#ifndef FARLIGHT_TESTS_UNIT_PLAYED_DAEMON_H
#define FARLIGHT_TESTS_UNIT_PLAYED_DAEMON_H

#include "lib/scene.h"

#include "protocol/sealed/link.h"

#include <poll.h>
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cmocka.h>

struct daemon {
    int listener, fd;
    pthread_t thread;
    void (*play)(struct daemon *daemon);
    char folder[64], path[96], address[112];
    struct sealed_link *link; /* NULL: nothing is sealed */
    uint8_t in[FRAMING_MESSAGE_MAX_BYTES + SEALED_PLAIN_MAX_BYTES];
    size_t in_bytes;
    uint8_t scratch_data[SCRATCH_BYTES];
    struct scratch scratch;
};

static struct fl_error error;

/* The client's last message, of the thread that plays. */
static struct framing_header header;
static struct message asked;

/* The daemon and the connection of a test that begins with connect_to_played(). */
static struct daemon *played;
static struct fl_connection *connection;

static inline void put_plainly(struct daemon *daemon, const void *bytes, size_t count)
{
    if (send(daemon->fd, bytes, count, MSG_NOSIGNAL) != (ssize_t)count)
        shutdown(daemon->fd, SHUT_RDWR);
}

/* Bytes that wait in the link. */
static inline void put_link(struct daemon *daemon)
{
    size_t count;
    const uint8_t *bytes = sealed_link_waiting(daemon->link, &count);
    if (bytes)
        put_plainly(daemon, bytes, count);
    sealed_link_sent(daemon->link, count);
}

/* Answers what belongs to the link itself, and opens what has come. */
static inline bool more_sealed(struct daemon *daemon)
{
    struct decode_error why;
    size_t room, opened = 0;
    uint8_t *space = sealed_link_space(daemon->link, &room);
    const ssize_t got = recv(daemon->fd, space, room, 0);
    sealed_link_came(daemon->link, got > 0 ? (size_t)got : 0);
    enum sealed_result result = sealed_link_handshake(daemon->link, &why);
    if (result == SEALED_REFUSED)
        sealed_link_refuse(daemon->link);
    put_link(daemon);
    for (; result == SEALED_CONSUMED; daemon->in_bytes += opened)
        result = sealed_link_open(daemon->link, daemon->in + daemon->in_bytes,
                                  sizeof(daemon->in) - daemon->in_bytes, &opened, &why);
    return got > 0 && result != SEALED_REFUSED && result != SEALED_FATAL;
}

static inline bool more(struct daemon *daemon)
{
    if (daemon->link)
        return more_sealed(daemon);
    const ssize_t got = recv(daemon->fd, daemon->in + daemon->in_bytes, sizeof(daemon->in) - daemon->in_bytes, 0);
    daemon->in_bytes += got > 0 ? (size_t)got : 0;
    return got > 0;
}

static inline void used(struct daemon *daemon, size_t count)
{
    memmove(daemon->in, daemon->in + count, daemon->in_bytes - count);
    daemon->in_bytes -= count;
}

static inline void put(struct daemon *daemon, const void *bytes, size_t count)
{
    const uint8_t *next = bytes;
    if (!daemon->link)
        put_plainly(daemon, bytes, count);
    for (size_t sealed; daemon->link && count > 0; next += sealed, count -= sealed) {
        sealed = sealed_link_seal(daemon->link, next, count);
        put_link(daemon);
    }
}

static inline void greet_with(struct daemon *daemon, uint64_t capabilities)
{
    struct handshake_hello hello;
    struct handshake_reply reply = {
        .version = HANDSHAKE_VERSION_MAX, .capabilities = capabilities, .name = "played"};
    uint8_t bytes[HANDSHAKE_REPLY_MAX_BYTES];
    size_t count = 0;
    while (handshake_hello_parse(&hello, daemon->in, daemon->in_bytes, &count, NULL) != HANDSHAKE_CONSUMED)
        if (!more(daemon))
            return;
    used(daemon, count);
    put(daemon, bytes, handshake_reply_encode(bytes, &reply));
}

static inline void greet(struct daemon *daemon)
{
    greet_with(daemon, 0);
}

/* The next message of the client; false at the end. */
static inline bool take(struct daemon *daemon)
{
    static struct frame frame;
    while (framing_parse(&frame, daemon->in, daemon->in_bytes, MESSAGE_FROM_CLIENT, NULL) != FRAMING_CONSUMED)
        if (!more(daemon))
            return false;
    header = frame.header;
    scratch_init(&daemon->scratch, daemon->scratch_data, sizeof(daemon->scratch_data));
    const bool good = message_decode(&asked, frame.header.type, frame.payload, frame.header.payload_bytes,
                                     &daemon->scratch, NULL);
    used(daemon, frame.consumed_bytes);
    return good;
}

static inline size_t pack(uint8_t *bytes, size_t capacity, uint32_t request, const struct message *message)
{
    struct writer writer;
    writer_init(&writer, bytes, capacity);
    return message_write(&writer, request, 0, message) ? writer.used_bytes : 0;
}

static inline void tell(struct daemon *daemon, uint32_t request, const struct message *message)
{
    static uint8_t bytes[FRAMING_MESSAGE_MAX_BYTES];
    put(daemon, bytes, pack(bytes, sizeof(bytes), request, message));
}

static inline void send_type(struct daemon *daemon, uint32_t request, enum message_type type)
{
    const struct message message = {.type = type};
    tell(daemon, request, &message);
}

static inline void *run(void *argument)
{
    struct daemon *daemon = argument;
    daemon->fd = accept(daemon->listener, NULL, NULL);
    if (daemon->fd >= 0) {
        daemon->play(daemon);
        close(daemon->fd);
    }
    return NULL;
}

static inline struct daemon *start(void (*play)(struct daemon *daemon))
{
    struct daemon *daemon = calloc(1, sizeof(*daemon));
    struct sockaddr_un name = {.sun_family = AF_UNIX};
    assert_non_null(daemon);
    daemon->play = play;
    snprintf(daemon->folder, sizeof(daemon->folder), "%s/farlight-client-XXXXXX", P_tmpdir);
    assert_non_null(mkdtemp(daemon->folder));
    snprintf(daemon->path, sizeof(daemon->path), "%s/socket", daemon->folder);
    snprintf(daemon->address, sizeof(daemon->address), "unix:%s", daemon->path);
    strcpy(name.sun_path, daemon->path);
    daemon->listener = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    assert_int_equal(bind(daemon->listener, (const struct sockaddr *)&name, sizeof(name)), 0);
    assert_int_equal(listen(daemon->listener, 1), 0);
    assert_int_equal(pthread_create(&daemon->thread, NULL, run, daemon), 0);
    return daemon;
}

static inline void stop(struct daemon *daemon)
{
    shutdown(daemon->listener, SHUT_RDWR);
    pthread_join(daemon->thread, NULL);
    close(daemon->listener);
    unlink(daemon->path);
    rmdir(daemon->folder);
    sealed_link_destroy(daemon->link);
    free(daemon);
}

static inline struct fl_connection *connect_to(struct daemon *daemon)
{
    error = (struct fl_error){0};
    return fl_connect(&(struct fl_connect_options){.server = daemon->address, .timeout_ms = 3000}, &error);
}

static inline void connect_to_played(void (*play)(struct daemon *daemon))
{
    played = start(play);
    connection = connect_to(played);
    if (!connection)
        fail_msg("%s", error.text);
}

/* From then on what the daemon saw is known. */
static inline void leave_played(void)
{
    fl_connection_destroy(connection);
    connection = NULL;
    if (played)
        stop(played);
    played = NULL;
}

static inline int end_played(void **state)
{
    (void)state;
    leave_played();
    return 0;
}

static inline void check_error(enum fl_error_code code, const char *part)
{
    if (error.code != code || !strstr(error.text, part))
        fail_msg("error %d '%s' in place of %d '%s'", (int)error.code, error.text, (int)code, part);
}

#endif
