/* SPDX-License-Identifier: MIT */
/* A shaped link: by a clock of the test's own what it does to bytes, and by the machine's that they come, in order
 * and not too early. How late they may come depends on the machine, so nothing is said of that. */
#include "tests/unit/client/played_daemon.h"
#include "tests/harness/test.h"

#include "lib/link.h"
#include "lib/shaper.h"
#include "protocol/common/clock.h"

#include <errno.h>
#include <math.h>

#define SECOND_NS UINT64_C(1000000000)

static struct fl_link parsed(const char *text)
{
    struct fl_link link;
    error = (struct fl_error){0};
    if (!fl_link_parse(text, &link, &error))
        fail_msg("%s: %s", text, error.text);
    return link;
}

EACH_TEST(NULL, end_played)

/* ---- what is typed ---- */

TEST(the_parts_of_a_link_are_told_apart_by_their_units)
{
    const struct fl_link all = parsed("2.5mbit,100ms,1%,seed=7");
    assert_int_equal(all.bits_per_second, 2500000);
    assert_int_equal(all.round_trip_ns, 100000000);
    assert_true(fabs(all.reset_chance - 0.01) < 1e-12);
    assert_int_equal(all.seed, 7);
    const struct fl_link turned = parsed("50%,1.5s,56kbit");
    assert_int_equal(turned.bits_per_second, 56000);
    assert_int_equal(turned.round_trip_ns, 1500000000);
    assert_true(turned.reset_chance == 0.5 && turned.seed == 1);
    const struct fl_link delay = parsed("80ms");
    assert_int_equal(delay.bits_per_second, 10 * SECOND_NS);
    assert_true(delay.reset_chance == 0);
    assert_int_equal(parsed("1gbit").bits_per_second, SECOND_NS);
}

TEST(a_wrong_part_is_named_with_what_is_allowed)
{
    static const struct {
        const char *text, *part, *allowed;
    } wrong[] = {{"", "''", "kbit, mbit, gbit"},
                 {"2mbit,", "''", "seed=N"},
                 {"2mb,100ms", "'2mb'", "kbit, mbit, gbit"},
                 {"2 mbit", "'2 mbit'", "kbit, mbit, gbit"},
                 {"-2mbit", "'-2mbit'", "kbit, mbit, gbit"},
                 {"mbit", "'mbit'", "1kbit to 10gbit"},
                 {"1.2.3mbit", "'1.2.3mbit'", "1kbit to 10gbit"},
                 {"0.5kbit", "'0.5kbit'", "1kbit to 10gbit"},
                 {"11gbit", "'11gbit'", "1kbit to 10gbit"},
                 {"2mbit,11s", "'11s'", "0ms to 10s"},
                 {"2mbit,1ms,100%", "'100%'", "0% to 99%"},
                 {"2mbit,seed=4294967296", "'seed=4294967296'", "0 to 4294967295"},
                 {"2mbit,3mbit", "'3mbit'", "second of its kind"}};
    for (size_t i = 0; i < sizeof(wrong) / sizeof(wrong[0]); i++) {
        struct fl_link link;
        error = (struct fl_error){0};
        assert_false(fl_link_parse(wrong[i].text, &link, &error));
        check_error(FL_ERROR_ARGUMENT, wrong[i].part);
        check_error(FL_ERROR_ARGUMENT, wrong[i].allowed);
    }
}

/* ---- when bytes arrive, by the test's own clock ---- */

TEST(bytes_arrive_after_their_bits_by_the_rate_and_half_the_round_trip)
{
    const struct fl_link link = parsed("2mbit,100ms");
    const uint64_t begin_ns = 5 * SECOND_NS;
    uint64_t free_ns = 0, due_ns = 0;
    /* Each takes 6 ms: by analysis the last of a hundred arrives after 100 * 6 + 50. */
    for (int i = 0; i < 100; i++)
        due_ns = fl_link_enter(&link, &free_ns, 1500, begin_ns);
    assert_int_equal(due_ns - begin_ns, 650000000);
    /* One that comes when the others have left waits for none: 100 bytes take 0.4 ms. */
    assert_int_equal(fl_link_enter(&link, &free_ns, 100, begin_ns + SECOND_NS) - begin_ns, SECOND_NS + 50400000);
}

TEST(a_queue_takes_packets_until_they_need_100_ms_to_leave)
{
    const struct fl_link link = parsed("2mbit,500ms");
    const uint64_t begin_ns = SECOND_NS;
    uint64_t free_ns = 0;
    unsigned taken = 0;
    for (; fl_link_opens_ns(free_ns) <= begin_ns; taken++)
        fl_link_enter(&link, &free_ns, 1500, begin_ns);
    assert_int_equal(taken, 17); /* the one that exceeds 100 ms by 6 ms each is the last */
    assert_int_equal(fl_link_opens_ns(free_ns) - begin_ns, 2000000);
    /* Of what has left the queue, a round trip's half is on the way, and needs space as well: 350 ms of bytes. */
    assert_true(fl_link_packets(&link) * 1500 >= 2000000 / 8 * 350 / 1000);
    assert_true(
        fl_link_packets(&(struct fl_link){.bits_per_second = 10 * SECOND_NS, .round_trip_ns = 10 * SECOND_NS}) *
            FL_LINK_PACKET_BYTES <=
        FL_LINK_IN_FLIGHT_MAX + FL_LINK_PACKET_BYTES);
}

/* ---- resets ---- */

TEST(a_connection_is_reset_with_the_same_chance_in_each_second)
{
    const struct fl_link link = parsed("10%");
    unsigned left[4] = {0};
    const unsigned count = 100000;
    for (uint64_t i = 0; i < count; i++)
        for (unsigned second = 0; second < 4; second++)
            left[second] += fl_link_reset_ns(&link, i) >= second * SECOND_NS;
    assert_int_equal(left[0], count);
    for (unsigned second = 1; second < 4; second++) {
        /* Of n that are left n * 0.1 end, with a standard deviation of sqrt(n * 0.09): five of those. */
        const double ended = left[second - 1] - left[second], wanted = left[second - 1] * 0.1;
        if (fabs(ended - wanted) > 5 * sqrt(left[second - 1] * 0.09))
            fail_msg("%g of %u ended in second %u", ended, left[second - 1], second);
    }
}

TEST(resets_repeat_with_their_seed)
{
    const struct fl_link one = parsed("10%,seed=1"), other = parsed("10%,seed=2"), none = parsed("1mbit");
    unsigned same = 0;
    for (uint64_t i = 0; i < 100; i++) {
        assert_int_equal(fl_link_reset_ns(&one, i), fl_link_reset_ns(&one, i));
        same += fl_link_reset_ns(&one, i) == fl_link_reset_ns(&other, i);
        assert_true(fl_link_reset_ns(&none, i) == UINT64_MAX);
    }
    assert_int_equal(same, 0);
}

/* ---- the thread, by the machine's clock ---- */

struct ends {
    int near, far; /* ours, and the peer's */
    struct fl_shaper *shaper;
};

static struct ends open_ends(const char *text)
{
    const struct fl_link link = parsed(text);
    int pair[2];
    assert_int_equal(socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair), 0);
    struct ends ends = {.near = pair[0], .far = pair[1]};
    ends.shaper = fl_shaper_start(&link, &ends.near, &error);
    assert_non_null(ends.shaper);
    return ends;
}

static void close_ends(struct ends *ends)
{
    close(ends->near);
    fl_shaper_destroy(ends->shaper);
    close(ends->far);
}

static uint8_t byte_at(size_t at, uint8_t salt)
{
    return (uint8_t)((at * 2654435761u >> 13) + salt);
}

/* Writes and reads `count` bytes at each of the two, as they can. */
static void exchange(const int fds[2], size_t count)
{
    static uint8_t bytes[4096];
    size_t sent[2] = {0}, got[2] = {0};
    while (got[0] < count || got[1] < count) {
        struct pollfd polled[2];
        for (int i = 0; i < 2; i++)
            polled[i] = (struct pollfd){.fd = fds[i], .events = (short)(POLLIN | (sent[i] < count ? POLLOUT : 0))};
        assert_true(poll(polled, 2, -1) > 0);
        for (int i = 0; i < 2; i++) {
            size_t length = count - sent[i] < sizeof(bytes) ? count - sent[i] : sizeof(bytes);
            for (size_t at = 0; at < length; at++)
                bytes[at] = byte_at(sent[i] + at, (uint8_t)i);
            const ssize_t put = length > 0 ? send(fds[i], bytes, length, MSG_DONTWAIT | MSG_NOSIGNAL) : 0;
            assert_true(put >= 0 || errno == EAGAIN);
            sent[i] += put > 0 ? (size_t)put : 0;
            const ssize_t taken = recv(fds[i], bytes, sizeof(bytes), MSG_DONTWAIT);
            assert_true(taken > 0 || (taken < 0 && errno == EAGAIN));
            for (ssize_t at = 0; at < taken; at++)
                assert_int_equal(bytes[at], byte_at(got[i]++, (uint8_t)!i));
        }
    }
}

TEST(bytes_of_both_directions_arrive_in_order_and_not_too_early)
{
    struct ends ends = open_ends("20mbit,40ms");
    const uint64_t begin_ns = monotonic_now_ns();
    exchange((const int[2]){ends.near, ends.far}, 250000);
    /* 100 ms for the bits, 20 for the way. */
    assert_true(monotonic_now_ns() - begin_ns >= 120000000);
    close_ends(&ends);
}

static size_t fill(int fd)
{
    static const uint8_t bytes[1024];
    size_t all = 0;
    for (ssize_t put; (put = send(fd, bytes, sizeof(bytes), MSG_DONTWAIT | MSG_NOSIGNAL)) > 0;)
        all += (size_t)put;
    assert_int_equal(errno, EAGAIN);
    return all;
}

TEST(a_sender_is_blocked_once_the_queue_is_full_and_the_other_direction_goes_on)
{
    struct ends ends = open_ends("80kbit");
    char byte = 0;
    const uint64_t begin_ns = monotonic_now_ns();
    const size_t taken = fill(ends.near);
    /* 100 ms of 10 KB/s and the packet beyond, what has left meanwhile, and the kernel's buffer of 32 KiB, which
     * it doubles. Without a link it would be more than 200 KB. */
    const double seconds = (double)(monotonic_now_ns() - begin_ns) * 1e-9;
    assert_true((double)taken <= 1000 + 1500 + 10000 * seconds + 65536);
    assert_int_equal(send(ends.far, "x", 1, MSG_NOSIGNAL), 1);
    assert_int_equal(recv(ends.near, &byte, 1, 0), 1);
    assert_int_equal(byte, 'x');
    close_ends(&ends);
}

TEST(what_was_sent_arrives_before_the_end)
{
    struct ends ends = open_ends("1mbit,100ms");
    uint8_t bytes[2000] = {0}, got[sizeof(bytes) + 1];
    assert_int_equal(send(ends.near, bytes, sizeof(bytes), MSG_NOSIGNAL), sizeof(bytes));
    close(ends.near);
    fl_shaper_destroy(ends.shaper);
    assert_int_equal(recv(ends.far, got, sizeof(got), MSG_WAITALL), sizeof(bytes));
    close(ends.far);
}

TEST(the_end_of_the_peer_arrives_behind_its_bytes)
{
    struct ends ends = open_ends("1mbit,20ms");
    char got[8];
    assert_int_equal(send(ends.far, "bye", 3, MSG_NOSIGNAL), 3);
    shutdown(ends.far, SHUT_RDWR);
    assert_int_equal(recv(ends.near, got, sizeof(got), MSG_WAITALL), 3);
    close_ends(&ends);
}

TEST(a_reset_ends_both_sides)
{
    struct ends ends = open_ends("99%"); /* lasts for 0.2 s in the mean */
    char byte;
    assert_true(recv(ends.near, &byte, 1, 0) <= 0);
    assert_true(recv(ends.far, &byte, 1, 0) <= 0);
    close_ends(&ends);
}

/* ---- a connection over it ---- */

static void play_pongs(struct daemon *daemon)
{
    greet(daemon);
    while (take(daemon) && asked.type == MESSAGE_PING)
        tell_type(daemon, header.request, MESSAGE_PONG);
}

static void connect_over(const char *link)
{
    error = (struct fl_error){0};
    played = start(play_pongs);
    connection = fl_connect(&(struct fl_connect_options){.server = played->address, .link = link}, &error);
}

TEST(a_connection_over_a_link_takes_its_round_trips_and_is_not_local)
{
    uint64_t ns = 0;
    connect_over("10mbit,50ms");
    if (!connection)
        fail_msg("%s", error.text);
    assert_false(fl_connection_is_local(connection));
    assert_true(fl_ping(connection, &ns, &error));
    assert_true(ns >= 50000000);
}

TEST(a_connection_that_the_link_resets_is_lost_and_may_be_made_again)
{
    uint64_t ns = 0;
    connect_over("90%"); /* lasts for 0.4 s in the mean */
    while (connection && fl_ping(connection, &ns, &error))
        continue;
    check_error(FL_ERROR_CONNECTION, "closed");
    assert_true(error.retryable);
}

TEST(a_wrong_link_connects_to_nothing)
{
    error = (struct fl_error){0};
    assert_null(
        fl_connect(&(struct fl_connect_options){.server = "unix:/nonexistent/socket", .link = "2mb"}, &error));
    check_error(FL_ERROR_ARGUMENT, "'2mb'");
    assert_string_equal(error.field, "--link");
}
