/* SPDX-License-Identifier: MIT */
/* The library on sealed connections, against a daemon that a thread of the test plays: with its key, without one,
 * with another, and with somebody on the way. */
#include "tests/unit/client/played_daemon.h"

#include "protocol/sealed/key.h"
#include "tests/harness/test.h"

static char key_file[64];
static struct sealed_key key;
static const struct sealed_key other_key = {.bytes = "not what is in the file"};

static int make_key(void **state)
{
    (void)state;
    struct decode_error why = {0};
    snprintf(key_file, sizeof(key_file), "%s/farlight-key-XXXXXX", P_tmpdir);
    const int fd = mkstemp(key_file);
    assert_true(fd >= 0);
    close(fd);
    unlink(key_file);
    return sealed_key_create(key_file, &why) && sealed_key_read(&key, key_file, &why) ? 0 : 1;
}

static int remove_key(void **state)
{
    (void)state;
    unlink(key_file);
    return 0;
}

/* False: why is in `error`. */
static bool connect_sealed(void (*play)(struct daemon *daemon))
{
    leave_played();
    error = (struct fl_error){0};
    played = start(play);
    connection = fl_connect(
        &(struct fl_connect_options){.server = played->address, .key_file = key_file, .timeout_ms = 3000}, &error);
    return connection;
}

static void seal_with(struct daemon *daemon, const struct sealed_key *with)
{
    daemon->link = sealed_link_server(with, 1);
}

/* ---- a daemon with the key ---- */

#define PIECES 40u

static void play_pieces(struct daemon *daemon)
{
    static uint8_t data[262144];
    seal_with(daemon, &key);
    greet(daemon);
    while (take(daemon) && asked.type == MESSAGE_PING) {
        /* Far more than the library's buffers hold, before the answer. */
        for (uint32_t i = 0; i < PIECES; i++) {
            struct message piece = {.type = MESSAGE_FRAME_DATA};
            memset(data, (int)i, sizeof(data));
            piece.frame_data.data = data;
            piece.frame_data.data_bytes = (uint32_t)sizeof(data) - 1000 * i;
            tell(daemon, 1000 + i, &piece);
        }
        send_type(daemon, header.request, MESSAGE_PONG);
    }
}

ALL_TESTS(make_key, remove_key)
EACH_TEST(NULL, end_played)

TEST(more_comes_than_the_buffers_hold_and_nothing_is_lost)
{
    if (!connect_sealed(play_pieces))
        fail_msg("%s", error.text);
    struct message ping = {.type = MESSAGE_PING};
    assert_true(fl_connection_send(connection, 7, 0, &ping, &error));
    usleep(50000); /* the buffers fill up, down to the socket's */
    struct fl_received received;
    for (uint32_t i = 0; i < PIECES; i++) {
        assert_true(fl_connection_receive(connection, &received, UINT64_MAX, &error));
        assert_int_equal(received.header.request, 1000 + i);
        assert_int_equal(received.message.frame_data.data_bytes, 262144 - 1000 * i);
        assert_int_equal(received.message.frame_data.data[200000], i);
    }
    assert_true(fl_connection_receive(connection, &received, UINT64_MAX, &error));
    assert_int_equal(received.message.type, MESSAGE_PONG);
}

static bool heard_the_last;

static void play_until_the_end(struct daemon *daemon)
{
    seal_with(daemon, &key);
    greet(daemon);
    while (take(daemon))
        continue;
    heard_the_last = asked.type == MESSAGE_GOODBYE && sealed_has_opened_last(daemon->link->sealed);
}

TEST(the_library_seals_its_end_behind_its_goodbye)
{
    heard_the_last = false;
    if (!connect_sealed(play_until_the_end))
        fail_msg("%s", error.text);
    leave_played();
    assert_true(heard_the_last);
}

/* ---- refusals ---- */

static void play_other_key(struct daemon *daemon)
{
    seal_with(daemon, &other_key);
    while (more(daemon))
        continue;
}

TEST(a_wrong_key_is_reported_with_a_remedy)
{
    assert_false(connect_sealed(play_other_key));
    check_error(FL_ERROR_REFUSED, "another key");
    assert_int_equal(error.server_code, PROTOCOL_ERROR_DENIED);
    assert_false(error.retryable);
    assert_string_equal(error.field, played->address);
    assert_non_null(strstr(error.remedy, "--key"));
}

static enum sealed_status refusal;

static void play_refusal(struct daemon *daemon)
{
    uint8_t bytes[SEALED_REFUSAL_BYTES];
    more(daemon);
    sealed_refuse(bytes, refusal);
    put(daemon, bytes, sizeof(bytes));
    more(daemon);
}

TEST(other_refusals_are_reported_too)
{
    refusal = SEALED_NO_KEY;
    assert_false(connect_sealed(play_refusal));
    check_error(FL_ERROR_REFUSED, "no key");
    assert_non_null(strstr(error.remedy, "leave --key"));
}

static void play_key_needed(struct daemon *daemon)
{
    struct handshake_reply reply = {.version = 0, .capabilities = HANDSHAKE_NEEDS_KEY, .text = "a key is needed"};
    uint8_t bytes[HANDSHAKE_REPLY_MAX_BYTES];
    more(daemon);
    put(daemon, bytes, handshake_reply_encode(bytes, &reply));
    more(daemon);
}

TEST(a_needed_key_is_reported_with_a_remedy)
{
    struct daemon *daemon = start(play_key_needed);
    assert_null(connect_to(daemon));
    check_error(FL_ERROR_REFUSED, "clients with its key");
    assert_non_null(strstr(error.remedy, "--key"));
    stop(daemon);
}

static void play_no_place(struct daemon *daemon)
{
    struct handshake_reply reply = {.capabilities = HANDSHAKE_TRY_AGAIN, .text = "all places are taken"};
    uint8_t bytes[HANDSHAKE_REPLY_MAX_BYTES];
    more(daemon);
    put(daemon, bytes, handshake_reply_encode(bytes, &reply));
    more(daemon);
}

TEST(a_daemon_without_a_place_is_heard_before_the_seal)
{
    assert_false(connect_sealed(play_no_place));
    check_error(FL_ERROR_REFUSED, "all places are taken");
    assert_true(error.retryable);
}

/* A client with a key never speaks openly, whatever answers. */
static bool heard_only_the_seal;

static void play_open(struct daemon *daemon)
{
    struct handshake_reply reply = {.version = HANDSHAKE_VERSION_MAX, .name = "open"};
    uint8_t bytes[HANDSHAKE_REPLY_MAX_BYTES];
    more(daemon);
    put(daemon, bytes, handshake_reply_encode(bytes, &reply));
    while (more(daemon))
        continue;
    heard_only_the_seal = daemon->in_bytes == SEALED_MESSAGE_MAX_BYTES && memcmp(daemon->in, SEALED_MAGIC, 4) == 0;
}

TEST(an_unsealed_answer_is_refused)
{
    heard_only_the_seal = false;
    assert_false(connect_sealed(play_open));
    check_error(FL_ERROR_PROTOCOL, "no sealed connection");
    leave_played();
    assert_true(heard_only_the_seal);
}

TEST(the_key_file_is_looked_at_before_anybody_is_asked)
{
    error = (struct fl_error){0};
    assert_null(fl_connect(
        &(struct fl_connect_options){.server = "unix:/nowhere/socket", .key_file = "/nowhere/key"}, &error));
    check_error(FL_ERROR_FILE, "No such file");
    assert_string_equal(error.field, "/nowhere/key");
    assert_non_null(strstr(error.remedy, "farlight key"));
}

/* ---- on the way ---- */

static size_t
    cut_at; /* place of the cut in the daemon's bytes after the handshake of the link; SIZE_MAX: no cut */
static bool is_changed;

static void play_cut(struct daemon *daemon)
{
    struct handshake_reply reply = {.version = HANDSHAKE_VERSION_MAX, .name = "cut"};
    struct message goodbye = {.type = MESSAGE_GOODBYE, .goodbye = {.text = "enough"}};
    static uint8_t plain[HANDSHAKE_REPLY_MAX_BYTES + 200];
    size_t plain_bytes = handshake_reply_encode(plain, &reply), sealed_bytes;
    plain_bytes += pack(plain + plain_bytes, sizeof(plain) - plain_bytes, 0, &goodbye);
    seal_with(daemon, &key);
    while (daemon->in_bytes == 0 && more(daemon))
        continue;
    sealed_link_seal(daemon->link, plain, plain_bytes);
    sealed_link_seal_last(daemon->link);
    const uint8_t *sealed = sealed_link_waiting(daemon->link, &sealed_bytes);
    uint8_t *copy = malloc(sealed_bytes);
    assert_non_null(copy);
    memcpy(copy, sealed, sealed_bytes);
    if (is_changed)
        copy[sealed_bytes - 1] ^= 1;
    put_plainly(daemon, copy, cut_at < sealed_bytes ? cut_at : sealed_bytes);
    free(copy);
    shutdown(daemon->fd, SHUT_WR);
    while (more(daemon))
        continue;
}

TEST(an_end_that_is_not_sealed_is_a_cut)
{
    uint64_t ns;
    cut_at = 50; /* within the record of the reply */
    is_changed = false;
    assert_false(connect_sealed(play_cut));
    check_error(FL_ERROR_CONNECTION, "its sealed end is missing");
    cut_at = SIZE_MAX;
    assert_true(connect_sealed(play_cut));
    assert_false(fl_ping(connection, &ns, &error));
    check_error(FL_ERROR_CONNECTION, "enough");
}

TEST(a_changed_byte_breaks_the_connection)
{
    is_changed = true;
    cut_at = SIZE_MAX;
    connect_sealed(play_cut);
    /* The last record is wrong: whether it is looked at before the reply is taken depends on what came at once. */
    if (connection) {
        uint64_t ns;
        assert_false(fl_ping(connection, &ns, &error));
    }
    check_error(FL_ERROR_PROTOCOL, "changed on the way");
}
