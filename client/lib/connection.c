/* SPDX-License-Identifier: MIT */
/* A connection to a daemon: handshake, messages, silence, loss. */
#include "lib/connection.h"
#include "lib/address.h"

#include "protocol/sealed/key.h"
#include "protocol/sealed/secret.h"
#include "protocol/common/clock.h"
#include "protocol/plain_text.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <unistd.h>

#define DEFAULT_TIMEOUT_MS 30000u
#define DEFAULT_LOST_AFTER_MS 60000u
#define LONGEST_SILENCE_NS 30000000000ull
#define PING_REQUEST UINT32_MAX /* beyond all requests of a connection, and of an importer's */
/* A killed daemon's connections close before it has ended, which takes a busy machine a while. */
#define LAST_WORDS_MS 2000
#define DEFAULT_REMOTE_SOCKET "/run/farlight/farlight.sock"

/* ---- failing ---- */

bool fl_connection_break(struct fl_connection *connection, struct fl_error *error)
{
    /* An interrupted or late call leaves the stream intact: later messages can still be sent. */
    if (error->code == FL_ERROR_INTERRUPTED)
        return false;
    if (error->code == FL_ERROR_TIMEOUT) {
        error->retryable = true;
        return false;
    }
    if (connection->process.pid > 0 && error->code == FL_ERROR_CONNECTION) {
        char words[520];
        fl_process_last_words(&connection->process, LAST_WORDS_MS, words, sizeof(words));
        const bool is_final = fl_process_has_refused(&connection->process);
        const bool was_there = connection->start_ns > 0;
        if (words[0] != '\0')
            fl_error_set(error, is_final ? FL_ERROR_SYSTEM : FL_ERROR_CONNECTION, "", "%s: %s",
                         was_there           ? "the connection is lost"
                         : connection->local ? "the daemon did not start"
                                             : "no daemon can be reached",
                         words);
        /* An ssh that has never reached a daemon is refused again: wrong host, user, key or command. */
        error->retryable = !is_final && (was_there || connection->local);
    }
    connection->broken = *error;
    return false;
}

bool fl_connection_check(const struct fl_connection *connection, struct fl_error *error)
{
    if (connection->broken.code == FL_ERROR_NONE)
        return true;
    *error = connection->broken;
    return false;
}

bool fl_error_from_message(struct fl_error *error, const struct message_error *message)
{
    fl_error_set(error, FL_ERROR_REFUSED, message->field, "%s",
                 message->text[0] != '\0' ? message->text : protocol_error_code_text(message->code));
    fl_error_remedy(error, "%s", message->remedy);
    error->server_code = message->code;
    /* These codes describe a state of the daemon that passes, or that another daemon at its address does not
     * share. */
    error->retryable = message->retryable != 0 || message->code == PROTOCOL_ERROR_SHUTTING_DOWN ||
                       message->code == PROTOCOL_ERROR_DEVICE_LOST || message->code == PROTOCOL_ERROR_BUSY;
    error->retry_after_ms = message->retry_after_ms;
    return false;
}

/* ---- messages ---- */

uint32_t fl_connection_next_request(struct fl_connection *connection)
{
    if (++connection->last_request == 0)
        connection->last_request = 1;
    return connection->last_request;
}

/* The peer has closed its side without a goodbye. */
static bool fail_ended(struct fl_connection *connection, struct fl_error *error)
{
    const char *how = "";
    if (fl_stream_has_remains(&connection->stream))
        how = " in the middle of a message";
    else if (!fl_stream_is_whole(&connection->stream))
        how = ", or it was cut on the way: its sealed end is missing";
    fl_error_set(error, FL_ERROR_CONNECTION, "", "the daemon closed the connection%s", how);
    error->retryable = true; /* a daemon was there */
    return fl_connection_break(connection, error);
}

bool fl_connection_push_late(struct fl_connection *connection, struct fl_error *error)
{
    while (connection->late && fl_stream_has_room(&connection->stream)) {
        struct fl_late *first = connection->late;
        const bool pushed = fl_stream_push(&connection->stream, first->request, 0, &first->message, error);
        connection->late = first->next;
        free(first);
        if (!pushed)
            return fl_connection_break(connection, error);
    }
    return true;
}

void fl_connection_send_late(struct fl_connection *connection, uint32_t request, const struct message *message)
{
    struct fl_error error = {0};
    if (connection->broken.code != FL_ERROR_NONE)
        return;
    struct fl_late *late = malloc(sizeof(*late));
    if (!late) {
        fl_error_set(&error, FL_ERROR_MEMORY, "", "out of memory");
        fl_connection_break(connection, &error);
        return;
    }
    *late = (struct fl_late){.request = request, .message = *message};
    *(connection->late ? connection->late_end : &connection->late) = late;
    connection->late_end = &late->next;
    if (fl_connection_push_late(connection, &error) && !fl_stream_transfer(&connection->stream, &error))
        fl_connection_break(connection, &error);
}

/* At least two pings fit in before the daemon counts as lost, and one before the daemon's own limit of silence. */
static uint64_t silence_ns(const struct fl_connection *connection)
{
    const uint64_t third_ns = connection->lost_after_ns / 3;
    const uint64_t idle_ns = connection->limits.idle_seconds * UINT64_C(1000000000);
    const uint64_t longest_ns = idle_ns > 0 && idle_ns / 3 < LONGEST_SILENCE_NS ? idle_ns / 3 : LONGEST_SILENCE_NS;
    return third_ns < longest_ns ? third_ns : longest_ns;
}

static bool push_ping(struct fl_connection *connection, struct fl_error *error)
{
    struct message ping = {.type = MESSAGE_PING};
    ping.ping.sent_ns = monotonic_now_ns();
    /* A full buffer holds a message that the daemon has not read yet, so a ping would add nothing. */
    return !fl_stream_has_room(&connection->stream) ||
           fl_stream_push(&connection->stream, PING_REQUEST, 0, &ping, error);
}

bool fl_connection_check_silence(struct fl_connection *connection, struct fl_error *error)
{
    /* While our buffer is full we hear nothing, whatever was sent. */
    const bool heard = connection->stream.heard || (fl_stream_events(&connection->stream) & POLLIN) == 0;
    if (connection->lost_after_ns == 0 || (!heard && monotonic_now_ns() < connection->check_ns))
        return true;
    connection->stream.heard = false;
    /* Time in which this process was stopped does not count as the daemon's silence. */
    connection->silent_ns = heard ? 0 : connection->silent_ns + silence_ns(connection);
    connection->check_ns = monotonic_now_ns() + silence_ns(connection);
    if (heard)
        return true;
    if (connection->silent_ns < connection->lost_after_ns)
        return push_ping(connection, error);
    fl_error_set(error, FL_ERROR_CONNECTION, "",
                 "the daemon counts as lost: it answered nothing, no ping either, for %g s",
                 (double)connection->lost_after_ns * 1e-9);
    fl_error_remedy(error, "see whether its process and the link to it still work");
    error->retryable = true; /* a daemon was there */
    return fl_connection_break(connection, error);
}

/* Runs one round of poll and transfer. */
static bool serve(struct fl_connection *connection, uint64_t deadline_ns, struct fl_error *error)
{
    if (!fl_connection_push_late(connection, error))
        return false;
    const uint64_t until_ns = connection->check_ns < deadline_ns ? connection->check_ns : deadline_ns;
    struct pollfd polled = {.fd = connection->stream.fd, .events = fl_stream_events(&connection->stream)};
    const bool is_late = !fl_wait(&polled, 1, connection->interrupt_fd, until_ns, error);
    if ((is_late && error->code != FL_ERROR_TIMEOUT) || !fl_stream_transfer(&connection->stream, error))
        return fl_connection_break(connection, error);
    if (!fl_connection_check_silence(connection, error))
        return false;
    if (is_late && until_ns == deadline_ns)
        return fl_connection_break(connection, error);
    if (is_late)
        *error = (struct fl_error){0};
    return true;
}

bool fl_connection_send(struct fl_connection *connection, uint32_t request, uint32_t channel,
                        const struct message *message, struct fl_error *error)
{
    if (!fl_connection_check(connection, error))
        return false;
    /* A client that only sends continues once the daemon reads again. */
    if (!fl_stream_has_room(&connection->stream) && !fl_stream_transfer(&connection->stream, error))
        return fl_connection_break(connection, error);
    if (!fl_connection_push_late(connection, error))
        return false;
    if (!fl_stream_has_room(&connection->stream)) {
        fl_error_set(error, FL_ERROR_TIMEOUT, "", "the daemon reads no more messages");
        return fl_connection_break(connection, error);
    }
    if (!fl_stream_push(&connection->stream, request, channel, message, error))
        return false;
    /* While the daemon reads nothing we continue to read, so that the two cannot wait for each other. Received
     * messages stay in the buffer; once that is full the message may stay in ours. */
    if (!fl_stream_transfer(&connection->stream, error))
        return fl_connection_break(connection, error);
    return true;
}

void fl_connection_add(struct fl_connection *connection, struct fl_receiver *receiver)
{
    receiver->next = connection->receivers;
    connection->receivers = receiver;
}

void fl_connection_remove(struct fl_connection *connection, struct fl_receiver *receiver)
{
    struct fl_receiver **place = &connection->receivers;
    while (*place != receiver)
        place = &(*place)->next;
    *place = receiver->next;
}

static int offer(struct fl_connection *connection, const struct framing_header *header,
                 const struct message *message, struct fl_error *error)
{
    int taken = 0;
    for (struct fl_receiver *one = connection->receivers; one && taken == 0; one = one->next)
        taken = one->take(one, header, message, error);
    if (taken < 0)
        fl_connection_break(connection, error);
    return taken;
}

int fl_connection_consume(struct fl_connection *connection, const struct framing_header *header,
                          const struct message *message, struct fl_error *error)
{
    switch (message->type) {
    case MESSAGE_PING: {
        struct message pong = {.type = MESSAGE_PONG};
        pong.pong.sent_ns = message->ping.sent_ns;
        pong.pong.received_ns = monotonic_now_ns();
        if (fl_stream_has_room(&connection->stream) &&
            !fl_stream_push(&connection->stream, header->request, 0, &pong, error))
            return -1;
        return 1;
    }
    case MESSAGE_PONG:
        return header->request == PING_REQUEST ? 1 : offer(connection, header, message, error);
    case MESSAGE_CREDIT:
        if (message->credit.channel == FL_UPLOAD_CHANNEL && message->credit.total > connection->upload_credit)
            connection->upload_credit = message->credit.total;
        return 1;
    case MESSAGE_BLOCKED:
        return 1;
    case MESSAGE_SCENE_CHANGED: /* maybe of a scene that is closed already */
        return offer(connection, header, message, error) < 0 ? -1 : 1;
    case MESSAGE_GOODBYE:
        fl_error_set(error, FL_ERROR_CONNECTION, "", "the daemon ended the connection: %s",
                     message->goodbye.text[0] != '\0' ? message->goodbye.text
                                                      : protocol_error_code_text(message->goodbye.code));
        error->retryable = message->goodbye.code == PROTOCOL_ERROR_SHUTTING_DOWN;
        break;
    case MESSAGE_ERROR:
        if (header->request != 0)
            return offer(connection, header, message, error);
        fl_error_from_message(error, &message->error);
        break;
    default:
        return offer(connection, header, message, error);
    }
    connection->broken = *error;
    return -1;
}

enum fl_step fl_connection_step(struct fl_connection *connection, struct fl_received *received,
                                uint64_t deadline_ns, struct fl_error *error)
{
    struct frame frame;
    const enum fl_stream_result result = fl_stream_next(&connection->stream, &frame, &received->message, error);
    if (result == FL_STREAM_ERROR) {
        fl_connection_break(connection, error);
        return FL_STEP_FAILED;
    }
    if (result == FL_STREAM_MESSAGE) {
        received->header = frame.header;
        const int consumed = fl_connection_consume(connection, &frame.header, &received->message, error);
        return consumed < 0 ? FL_STEP_FAILED : consumed > 0 ? FL_STEP_SERVED : FL_STEP_MESSAGE;
    }
    if (connection->stream.ended) {
        fail_ended(connection, error);
        return FL_STEP_FAILED;
    }
    return serve(connection, deadline_ns, error) ? FL_STEP_SERVED : FL_STEP_FAILED;
}

bool fl_connection_receive(struct fl_connection *connection, struct fl_received *received, uint64_t deadline_ns,
                           struct fl_error *error)
{
    enum fl_step step = FL_STEP_SERVED;
    if (!fl_connection_check(connection, error))
        return false;
    while (step == FL_STEP_SERVED)
        step = fl_connection_step(connection, received, deadline_ns, error);
    return step == FL_STEP_MESSAGE;
}

bool fl_connection_wait_upload(struct fl_connection *connection, uint32_t request, uint64_t total,
                               uint64_t deadline_ns, struct fl_error *error)
{
    if (!fl_connection_check(connection, error))
        return false;
    while (connection->upload_credit < total || !fl_stream_has_room(&connection->stream)) {
        struct fl_received received;
        const enum fl_step step = fl_connection_step(connection, &received, deadline_ns, error);
        if (step == FL_STEP_FAILED)
            return false;
        if (step == FL_STEP_MESSAGE && received.header.request == request &&
            received.message.type == MESSAGE_ERROR)
            return fl_error_from_message(error, &received.message.error);
    }
    return true;
}

bool fl_connection_answer(struct fl_connection *connection, uint32_t request, enum message_type expected,
                          struct fl_received *received, uint64_t deadline_ns, struct fl_error *error)
{
    while (fl_connection_receive(connection, received, deadline_ns, error)) {
        if (received->header.request != request)
            continue; /* a late answer to an abandoned request, or a frame of a cancelled job */
        if (received->message.type == MESSAGE_ERROR)
            return fl_error_from_message(error, &received->message.error);
        if (received->message.type == expected)
            return true;
    }
    return false;
}

/* ---- beginning and end ---- */

static bool report_key_needed(const struct fl_connection *connection, struct fl_error *error)
{
    fl_error_set(error, FL_ERROR_REFUSED, connection->address, "the daemon accepts only clients with its key");
    error->server_code = PROTOCOL_ERROR_DENIED;
    return fl_error_remedy(error, "name the file with a copy of the key by --key or FARLIGHT_KEY");
}

static bool read_key(struct sealed_key *key, const char *key_file, struct fl_error *error)
{
    struct decode_error why = {0};
    if (sealed_key_read(key, key_file, &why))
        return true;
    fl_error_set(error, FL_ERROR_FILE, key_file, "%s", why.text);
    return fl_error_remedy(
        error, why.code == PROTOCOL_ERROR_DENIED
                   ? "a key has to be its reader's own, and closed to others: run 'chown' or 'chmod 600'"
                   : "a key file has 32 bytes; 'farlight key FILE' creates one");
}

/* Reports the first line of the peer's bytes, which shows what kind of server answered. */
static bool report_other_server(const struct fl_connection *connection, const struct decode_error *why,
                                struct fl_error *error)
{
    const struct fl_stream *stream = &connection->stream;
    char came[61], shown[sizeof(came)];
    const size_t bytes = stream->in_end - stream->in_start;
    snprintf(came, sizeof(came), "%.*s", (int)(bytes < sizeof(came) ? bytes : sizeof(came) - 1),
             (const char *)stream->in + stream->in_start);
    came[strcspn(came, "\r\n")] = '\0';
    plain_text_copy(shown, sizeof(shown), came);
    fl_error_set(error, FL_ERROR_PROTOCOL, connection->address,
                 "the server there is not a farlight daemon: %s, but '%s'", why->text, shown);
    if (strncmp(connection->address, "ssh:", 4) == 0)
        fl_error_remedy(error, "'ssh HOST true' must print nothing: keep .bashrc and other login scripts quiet "
                               "where there is no terminal");
    return false;
}

static bool send_hello(struct fl_connection *connection, const char *name, struct handshake_hello *hello,
                       struct fl_error *error)
{
    *hello = (struct handshake_hello){
        .version_min = HANDSHAKE_VERSION_MIN,
        .version_max = HANDSHAKE_VERSION_MAX,
        .capabilities = HANDSHAKE_CAN_ABANDON | (connection->can_h264 ? HANDSHAKE_CAN_H264 : 0),
    };
    snprintf(hello->name, sizeof(hello->name), "%s", name);
    if (getrandom(hello->nonce, sizeof(hello->nonce), 0) != (ssize_t)sizeof(hello->nonce))
        return fl_error_set(error, FL_ERROR_SYSTEM, "", "no random numbers");
    connection->stream.out_end = handshake_hello_encode(connection->stream.out, hello);
    return connection->stream.out_end > 0 ||
           fl_error_set(error, FL_ERROR_ARGUMENT, "name", "the client's name is not allowed");
}

/* Sets the error's field to the address; returns false. */
static bool name_address(const struct fl_connection *connection, struct fl_error *error)
{
    snprintf(error->field, sizeof(error->field), "%.*s", (int)sizeof(error->field) - 1, connection->address);
    return false;
}

static bool accept_reply(struct fl_connection *connection, const struct handshake_hello *hello,
                         const struct handshake_reply *reply, struct fl_error *error)
{
    struct decode_error why = {0};
    if (reply->version == 0 && (reply->capabilities & HANDSHAKE_NEEDS_KEY) != 0)
        return report_key_needed(connection, error);
    if (fl_stream_is_turned_away(reply, error))
        return name_address(connection, error);
    if (!handshake_reply_accept(hello, reply, &why))
        return fl_error_set(error, FL_ERROR_PROTOCOL, connection->address, "%s", why.text);
    connection->limits = reply->limits;
    connection->read_only = (reply->capabilities & HANDSHAKE_CAN_READ_ONLY) != 0;
    connection->can_h264 = connection->can_h264 && (reply->capabilities & HANDSHAKE_CAN_H264) != 0;
    return true;
}

static bool shake_hands(struct fl_connection *connection, const char *name, uint64_t deadline_ns,
                        struct fl_error *error)
{
    struct fl_stream *stream = &connection->stream;
    struct handshake_hello hello;
    struct handshake_reply reply;
    struct decode_error why = {0};
    size_t consumed = 0;
    enum handshake_result result = HANDSHAKE_NEED_MORE;
    if (!send_hello(connection, name, &hello, error))
        return false;
    while (result == HANDSHAKE_NEED_MORE) {
        if (stream->ended)
            return fail_ended(connection, error);
        if (!serve(connection, deadline_ns, error)) {
            if (error->code == FL_ERROR_TIMEOUT)
                fl_error_set(error, FL_ERROR_TIMEOUT, connection->address,
                             "the daemon does not answer the handshake");
            else if (error->code == FL_ERROR_REFUSED || error->code == FL_ERROR_PROTOCOL)
                name_address(connection, error);
            return false;
        }
        result = handshake_reply_parse(&reply, stream->in + stream->in_start, stream->in_end - stream->in_start,
                                       &consumed, &why);
    }
    if (result == HANDSHAKE_FATAL)
        return report_other_server(connection, &why, error);
    stream->in_start += consumed;
    return accept_reply(connection, &hello, &reply, error);
}

/* `farlight bridge` on the other host. A host that begins with '-' would be an option of ssh. */
static bool start_ssh(struct fl_connection *connection, const char *where, int *fd, struct fl_error *error)
{
    char host[256], socket_address[300];
    const size_t host_bytes = strcspn(where, ":");
    const char *path = where[host_bytes] == ':' ? where + host_bytes + 1 : DEFAULT_REMOTE_SOCKET;
    if (host_bytes == 0 || host_bytes >= sizeof(host) || where[0] == '-' || *path == '\0')
        return fl_error_set(error, FL_ERROR_ARGUMENT, connection->address, "is not ssh:HOST[:SOCKET]");
    /* ssh passes its arguments to a shell on the remote host. */
    const char *harmless = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789/._-+@%,=";
    if (path[strspn(path, harmless)] != '\0' ||
        snprintf(socket_address, sizeof(socket_address), "unix:%s", path) >= (int)sizeof(socket_address))
        return fl_error_set(
            error, FL_ERROR_ARGUMENT, connection->address,
            "the socket's path has characters with a meaning for the shell; use letters, digits and /._-+@%%,=");
    snprintf(host, sizeof(host), "%.*s", (int)host_bytes, where);
    const char *const arguments[] = {"-T", "--", host, "farlight", "bridge", socket_address, NULL};
    connection->process.keeps_environment = true; /* an ssh agent needs its variables */
    return fl_process_start(&connection->process, "ssh", FL_WIRING_STANDARD, arguments, fd, error);
}

static bool open_stream(struct fl_connection *connection, const struct fl_connect_options *options,
                        uint64_t deadline_ns, struct fl_error *error)
{
    static const char *const none[] = {NULL};
    const char *const *arguments = options->daemon_arguments ? options->daemon_arguments : none;
    int fd = -1;
    if (!options->server) {
        connection->local = true;
        connection->process.keeps_environment = true; /* drivers have many variables */
        if (!fl_process_start(&connection->process, "farlightd", FL_WIRING_DESCRIPTOR, arguments, &fd, error))
            return false;
    } else if (strncmp(options->server, "ssh:", 4) == 0) {
        if (!start_ssh(connection, options->server + 4, &fd, error))
            return false;
    } else {
        fd = fl_address_connect(options->server, deadline_ns, options->interrupt_fd, &connection->local, error);
        if (fd < 0)
            return false;
    }
    return fl_stream_init(&connection->stream, fd, MESSAGE_FROM_SERVER, "the daemon", error);
}

/* The key is read first: without it there is no need to connect. */
static bool open_link(struct fl_connection *connection, const struct fl_connect_options *options,
                      uint64_t deadline_ns, struct fl_error *error)
{
    if (!options->server || !options->key_file)
        return open_stream(connection, options, deadline_ns, error);
    struct sealed_key *key = secret_create(sizeof(*key));
    const bool opened = (key || fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory, or no random numbers")) &&
                        read_key(key, options->key_file, error) &&
                        open_stream(connection, options, deadline_ns, error) &&
                        fl_stream_seal(&connection->stream, key, error);
    secret_destroy(key);
    return opened;
}

struct fl_connection *fl_connect(const struct fl_connect_options *options, struct fl_error *error)
{
    const uint64_t begin_ns = monotonic_now_ns();
    const unsigned timeout_ms = options->timeout_ms > 0 ? options->timeout_ms : DEFAULT_TIMEOUT_MS;
    const uint64_t deadline_ns = begin_ns + timeout_ms * 1000000ull;
    struct fl_connection *connection = calloc(1, sizeof(*connection));
    if (!connection) {
        fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
        return NULL;
    }
    connection->stream.fd = -1;
    connection->process.talk_fd = -1;
    connection->interrupt_fd = options->interrupt_fd;
    connection->can_h264 = options->can_h264;
    connection->last_channel = FL_UPLOAD_CHANNEL;
    connection->check_ns = UINT64_MAX;
    snprintf(connection->address, sizeof(connection->address), "%s",
             options->server ? options->server : "private");
    if (!open_link(connection, options, deadline_ns, error) ||
        !shake_hands(connection, options->name ? options->name : "libfarlight", deadline_ns, error)) {
        if (error->field[0] == '\0' && error->code == FL_ERROR_CONNECTION)
            name_address(connection, error);
        error->retryable = error->retryable || error->code == FL_ERROR_TIMEOUT;
        connection->broken = *error;
        fl_connection_destroy(connection);
        return NULL;
    }
    connection->lost_after_ns =
        (options->lost_after_ms > 0 ? options->lost_after_ms : DEFAULT_LOST_AFTER_MS) * UINT64_C(1000000);
    connection->check_ns = monotonic_now_ns() + silence_ns(connection);
    connection->start_ns = monotonic_now_ns() - begin_ns;
    return connection;
}

void fl_connection_end(struct fl_connection *connection)
{
    if (connection->broken.code == FL_ERROR_NONE && connection->stream.fd >= 0) {
        struct message goodbye = {.type = MESSAGE_GOODBYE};
        goodbye.goodbye.text = "";
        struct fl_error ignored;
        connection->stream.is_last = true;
        connection->said_goodbye = fl_connection_send(connection, 0, 0, &goodbye, &ignored);
        fl_error_set(&connection->broken, FL_ERROR_CONNECTION, "", "the connection has been ended");
    }
    fl_stream_finish(&connection->stream);
}

void fl_connection_destroy(struct fl_connection *connection)
{
    if (!connection)
        return;
    fl_connection_end(connection);
    for (struct fl_late *late = connection->late, *next; late; late = next) {
        next = late->next;
        free(late);
    }
    fl_process_end(&connection->process, connection->said_goodbye ? 3000 : 500);
    free(connection);
}

void fl_connection_set_interrupt(struct fl_connection *connection, int interrupt_fd)
{
    connection->interrupt_fd = interrupt_fd;
}

uint64_t fl_connection_start_ns(const struct fl_connection *connection)
{
    return connection->start_ns;
}

bool fl_connection_is_local(const struct fl_connection *connection)
{
    return connection->local;
}

bool fl_connection_can_h264(const struct fl_connection *connection)
{
    return connection->can_h264;
}

int fl_connection_fd(const struct fl_connection *connection)
{
    return connection->stream.fd;
}

bool fl_connection_is_read_only(const struct fl_connection *connection)
{
    return connection->read_only;
}

const char *fl_connection_address(const struct fl_connection *connection)
{
    return connection->address;
}

bool fl_connection_limit(const struct fl_connection *connection, size_t index, struct fl_limit *limit)
{
    struct handshake_limit sent;
    if (!handshake_limit_at(&connection->limits, index, &sent))
        return false;
    *limit = (struct fl_limit){sent.name, sent.what, sent.value};
    return true;
}
