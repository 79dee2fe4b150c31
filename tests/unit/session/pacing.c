/* SPDX-License-Identifier: MIT */
/* The rule that paces views, on a link that is simulated: bytes stand in one line at a bottleneck, the way there
 * and back takes a fixed time. */
#include "session/pacing.h"
#include "tests/harness/test.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MS UINT64_C(1000000)
#define S UINT64_C(1000000000)
#define FRAME_NS (S / 30)
#define BEGIN_BYTES 300 /* size of the first message */

static struct pacing pacing;

static int begin(void **state)
{
    (void)state;
    pacing_init(&pacing, FRAME_NS);
    return 0;
}

EACH_TEST(begin, NULL)

/* ---- a link --------------------------------------------------------------------------------------- */

struct acknowledgement {
    uint32_t frame;
    bool whole;
    uint64_t at_ns;
};

struct link {
    double bytes_per_ns;
    uint64_t way_ns; /* time of one direction */
    double free_ns;  /* when the bottleneck has sent all that stands in line */
    struct acknowledgement coming[2 * PACING_IN_FLIGHT_MAX];
    size_t coming_count;
    bool tells_begin;
};

static struct link link_of(double megabits, uint64_t round_trip_ns)
{
    return (struct link){
        .bytes_per_ns = megabits * 1e6 / 8 / 1e9, .way_ns = round_trip_ns / 2, .tells_begin = true};
}

static void link_send(struct link *link, uint32_t frame, uint64_t bytes, uint64_t now_ns)
{
    double begin_ns = link->free_ns > (double)now_ns ? link->free_ns : (double)now_ns;
    double begun_ns = begin_ns + BEGIN_BYTES / link->bytes_per_ns;
    link->free_ns = begin_ns + (double)bytes / link->bytes_per_ns;
    uint64_t back_ns = 2 * link->way_ns;
    assert_true(link->coming_count + 2 <= 2 * PACING_IN_FLIGHT_MAX);
    if (link->tells_begin)
        link->coming[link->coming_count++] = (struct acknowledgement){frame, false, (uint64_t)begun_ns + back_ns};
    link->coming[link->coming_count++] = (struct acknowledgement){frame, true, (uint64_t)link->free_ns + back_ns};
}

/* How long what is sent now would stand in line. */
static double line_ns(const struct link *link, uint64_t now_ns)
{
    return link->free_ns > (double)now_ns ? link->free_ns - (double)now_ns : 0.0;
}

static void link_deliver(struct link *link, uint64_t now_ns)
{
    size_t count = 0;
    while (count < link->coming_count && link->coming[count].at_ns <= now_ns) {
        const struct acknowledgement *next = &link->coming[count++];
        pacing_acknowledged(&pacing, next->frame, next->whole, next->at_ns);
    }
    link->coming_count -= count;
    memmove(link->coming, link->coming + count, link->coming_count * sizeof(link->coming[0]));
}

struct tally {
    uint32_t frames;
    uint64_t bytes;
    double longest_line_ns; /* longest queue of a frame, its own bytes included */
};

/* Frames of about `bytes`, one each FRAME_NS as far as the pacing allows; a tick is a millisecond. */
static struct tally run(struct link *link, uint64_t begin_ns, uint64_t end_ns, uint64_t bytes, uint32_t *frame)
{
    struct tally tally = {0};
    uint64_t next_ns = begin_ns;
    for (uint64_t now_ns = begin_ns; now_ns < end_ns; now_ns += MS) {
        link_deliver(link, now_ns);
        if (now_ns < next_ns || !pacing_may_send(&pacing))
            continue;
        uint64_t size = bytes * 4 / 5 + bytes * 2 / 5 * (*frame * 2654435761u >> 16) / 65536; /* 0.8 to 1.2 */
        pacing_sent(&pacing, *frame, size, now_ns);
        link_send(link, (*frame)++, size, now_ns);
        double line = line_ns(link, now_ns);
        tally.longest_line_ns = line > tally.longest_line_ns ? line : tally.longest_line_ns;
        tally.frames++;
        tally.bytes += size;
        next_ns = (now_ns > next_ns + FRAME_NS ? now_ns : next_ns) + FRAME_NS;
    }
    return tally;
}

/* ---- when frames go -------------------------------------------------------------------------------- */

/* 7 Mbit/s on 100 wait for nothing but one round trip with the first, which nothing is known for; 6.2 on 10, of
 * which a frame takes 21 ms and 50 of the way, have three in flight; and twice what a link carries keeps the line
 * as short as the rule says, after five minutes as at first: in flight are at most the bytes of a frame time and a
 * round trip, and a fifth of a frame, as sizes are known only when they are sent. */
TEST(a_link_is_used_and_its_line_kept_short)
{
    static const struct {
        double megabits;
        uint64_t round_trip_ms, bytes;
        uint32_t frames_min, frames_max; /* in 30 seconds at 30 a second */
    } rows[] = {{100, 10, 30000, 897, 900}, {10, 50, 26000, 900 * 95 / 100, 900}, {10, 50, 83000, 230, 460}};
    for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++) {
        pacing_init(&pacing, FRAME_NS);
        struct link link = link_of(rows[i].megabits, rows[i].round_trip_ms * MS);
        uint32_t frame = 0;
        run(&link, 0, 2 * S, rows[i].bytes, &frame);
        const struct tally first = run(&link, 2 * S, 32 * S, rows[i].bytes, &frame);
        run(&link, 32 * S, 272 * S, rows[i].bytes, &frame);
        const struct tally last = run(&link, 272 * S, 302 * S, rows[i].bytes, &frame);
        const double max_ns = (double)FRAME_NS + (double)(rows[i].round_trip_ms * MS) +
                              0.2 * (double)rows[i].bytes / link.bytes_per_ns;
        assert_true(first.longest_line_ns < max_ns && last.longest_line_ns < max_ns);
        assert_in_range(first.frames, rows[i].frames_min, rows[i].frames_max);
        assert_in_range(last.frames, rows[i].frames_min, rows[i].frames_max);
        assert_true(last.frames + 2 >= first.frames);
    }
}

static uint64_t rate_learned(bool tells_begin, uint64_t *true_rate)
{
    pacing_init(&pacing, FRAME_NS);
    struct link link = link_of(20, 30 * MS);
    link.tells_begin = tells_begin;
    uint32_t frame = 0;
    run(&link, 0, 5 * S, 100000, &frame); /* more than it carries, so that frames stand in line */
    *true_rate = (uint64_t)(link.bytes_per_ns * 1e9);
    return pacing_bytes_per_second(&pacing);
}

TEST(learns_the_link)
{
    uint64_t true_rate, rate = rate_learned(true, &true_rate);
    assert_in_range(rate, true_rate * 95 / 100, true_rate * 105 / 100); /* the first message is not counted */
    assert_in_range(pacing_round_trip_ns(&pacing), 30 * MS, 31 * MS);   /* its 300 bytes take 0.1 ms */
    /* Without acknowledged beginnings, a frame of 40 ms seems to take 70 with the round trip. */
    rate = rate_learned(false, &true_rate);
    assert_in_range(rate, true_rate * 40 / 75, true_rate * 105 / 100);
}

TEST(follows_a_link_that_becomes_worse)
{
    struct link link = link_of(40, 20 * MS);
    uint32_t frame = 0;
    run(&link, 0, 5 * S, 60000, &frame);
    link.bytes_per_ns /= 8;
    run(&link, 5 * S, 8 * S, 60000, &frame);
    struct tally after = run(&link, 8 * S, 18 * S, 60000, &frame);
    /* 60 kB take 96 ms now: one is on its way, and one may stand behind it. */
    assert_true(after.longest_line_ns < 2.5 * 96.0 * MS);
    assert_in_range(pacing_bytes_per_second(&pacing), 550000, 700000);
}

TEST(sends_one_at_a_time_to_a_client_that_is_silent)
{
    assert_true(pacing_may_send(&pacing));
    pacing_sent(&pacing, 0, 1000, 0);
    assert_false(pacing_may_send(&pacing));
    pacing_note_silence(&pacing);
    assert_true(pacing_may_send(&pacing));
    /* Once it has acknowledged, credit does not stand for that any more. */
    pacing_sent(&pacing, 1, 1000000, MS);
    pacing_acknowledged(&pacing, 1, true, 101 * MS);
    pacing_sent(&pacing, 2, 1000000, 102 * MS);
    pacing_note_silence(&pacing);
    assert_false(pacing_may_send(&pacing));
}

/* 1 MB takes a second, longer than a client has to acknowledge. */
TEST(learns_a_slow_link_from_an_acknowledgement_that_comes_late)
{
    pacing_sent(&pacing, 0, 1000000, 0);
    pacing_note_silence(&pacing);
    for (uint32_t frame = 1; frame <= PACING_IN_FLIGHT_MAX / 2; frame++) {
        assert_true(pacing_may_send(&pacing));
        pacing_sent(&pacing, frame, 1000000, 250 * MS);
    }
    pacing_acknowledged(&pacing, 0, true, S);
    assert_int_equal(pacing_bytes_per_second(&pacing), 1000000);
    assert_false(pacing_may_send(&pacing));
}

TEST(goes_on_for_ever_with_a_client_that_acknowledges_nothing)
{
    pacing_sent(&pacing, 0, 1000, 0);
    pacing_note_silence(&pacing);
    for (uint32_t frame = 1; frame <= 3 * PACING_IN_FLIGHT_MAX; frame++) {
        assert_true(pacing_may_send(&pacing));
        pacing_sent(&pacing, frame, 1000, frame * MS);
    }
    assert_int_equal(pacing.in_flight_bytes, 1000 * PACING_IN_FLIGHT_MAX);
}

TEST(ignores_acknowledgements_of_what_is_not_in_flight)
{
    pacing_acknowledged(&pacing, 7, true, MS);
    pacing_sent(&pacing, 3, 50000, MS);
    pacing_acknowledged(&pacing, 4, true, 2 * MS);
    pacing_acknowledged(&pacing, 2, false, 2 * MS);
    assert_int_equal(pacing.in_flight_bytes, 50000);
    pacing_acknowledged(&pacing, 3, true, 3 * MS);
    pacing_acknowledged(&pacing, 3, true, 4 * MS); /* twice */
    assert_int_equal(pacing.in_flight_bytes, 0);
    assert_int_equal(pacing.in_flight_count, 0);
}

TEST(never_has_more_in_flight_than_it_can_note)
{
    pacing_sent(&pacing, 0, 1, 0);
    pacing_acknowledged(&pacing, 0, true, 1000); /* 1 byte in 1 us, and .. */
    uint32_t frame = 1;
    while (pacing_may_send(&pacing) && frame < 10000)
        pacing_sent(&pacing, frame++, 1, 1000); /* .. small frames that all fit */
    assert_int_equal(pacing.in_flight_count, PACING_IN_FLIGHT_MAX);
}

/* ---- size and quality ------------------------------------------------------------------------------- */

/* Says for how many frames advice is followed, of a picture that costs that much at full size and quality 75. */
static struct pacing_advice follow(struct link *link, uint64_t *now_ns, uint64_t render_ns, double bytes,
                                   unsigned frames)
{
    struct pacing_advice advice = {0};
    static uint32_t frame;
    for (unsigned i = 0; i < frames; i++) {
        advice = pacing_advise(&pacing, 90);
        double area = advice.scale_32nds * advice.scale_32nds / 1024.0;
        double quality = (advice.quality - 75.0) / 12.0, size = bytes * area;
        for (; quality > 1e-3; quality -= 1.0 / 12)
            size *= 1.0253; /* 1.35 to the twelfth part */
        for (; quality < -1e-3; quality += 1.0 / 12)
            size /= 1.0253;
        uint64_t render_now_ns = (uint64_t)((double)render_ns * area);
        *now_ns += render_now_ns > FRAME_NS ? render_now_ns : FRAME_NS;
        for (; link_deliver(link, *now_ns), !pacing_may_send(&pacing);)
            *now_ns += MS;
        pacing_sent(&pacing, frame, (uint64_t)size, *now_ns);
        link_send(link, frame++, (uint64_t)size, *now_ns);
        pacing_learn(&pacing, advice.scale_32nds, advice.quality, render_now_ns, (uint64_t)size);
    }
    return advice;
}

TEST(asks_for_everything_where_all_is_fast)
{
    struct link link = link_of(1000, MS);
    uint64_t now_ns = 0;
    struct pacing_advice advice = follow(&link, &now_ns, 5 * MS, 100000, 30);
    assert_int_equal(advice.scale_32nds, PACING_SCALE_FULL);
    assert_int_equal(advice.quality, 90);
}

TEST(makes_frames_smaller_that_take_long_to_render)
{
    struct link link = link_of(1000, MS);
    uint64_t now_ns = 0;
    struct pacing_advice advice = follow(&link, &now_ns, 100 * MS, 100000, 60);
    /* 33 ms a frame: half of each side is 25 ms, three quarters would be 56. */
    assert_int_equal(advice.scale_32nds, 16);
    /* The scene becomes simple: back to full. */
    advice = follow(&link, &now_ns, 10 * MS, 100000, 60);
    assert_int_equal(advice.scale_32nds, PACING_SCALE_FULL);
}

TEST(makes_frames_fit_the_link)
{
    struct link link = link_of(10, 50 * MS);
    uint64_t now_ns = 0;
    /* 150 kB at 75 and 30 frames a second are 36 Mbit/s. */
    follow(&link, &now_ns, 5 * MS, 150000, 60);
    uint64_t before_ns = now_ns;
    struct pacing_advice advice = follow(&link, &now_ns, 5 * MS, 150000, 300);
    double frames_per_second = 300e9 / (double)(now_ns - before_ns);
    assert_true(frames_per_second > 27.0); /* at a maximum of 30 */
    assert_true(advice.scale_32nds < PACING_SCALE_FULL);
    assert_true(advice.quality >= PACING_QUALITY_MIN);
    assert_true((double)advice.bytes <= 10e6 / 8 / 30);
    /* A better link: better frames, and not more than were asked for. */
    link.bytes_per_ns *= 20;
    advice = follow(&link, &now_ns, 5 * MS, 150000, 600);
    assert_int_equal(advice.scale_32nds, PACING_SCALE_FULL);
    assert_int_equal(advice.quality, 90);
}

/* Follows as follow(), but rendering takes `fixed_ns` whatever the size, and `area_ns` for the whole picture;
 * either varies by up to a fifth. */
static struct pacing_advice follow_renderer(uint64_t fixed_ns, uint64_t area_ns, unsigned frames)
{
    struct pacing_advice advice = {0};
    static uint32_t chance;
    for (unsigned i = 0; i < frames; i++) {
        advice = pacing_advise(&pacing, 90);
        double area = advice.scale_32nds * advice.scale_32nds / 1024.0;
        chance = chance * 1664525u + 1013904223u;
        double more = 0.8 + 0.4 * (chance >> 8) / (1 << 24);
        pacing_learn(&pacing, advice.scale_32nds, advice.quality,
                     (uint64_t)(more * ((double)fixed_ns + (double)area_ns * area)), 1000);
    }
    return advice;
}

TEST(does_not_shrink_what_takes_long_at_any_size)
{
    /* 33 ms a frame: 60 ms at least, 70 in full; hardly worth the picture. */
    assert_int_equal(follow_renderer(60 * MS, 10 * MS, 100).scale_32nds, PACING_SCALE_FULL);
    /* Size is what it costs: the same renderer with a slow light transport. */
    struct pacing_advice advice = follow_renderer(2 * MS, 200 * MS, 100);
    assert_in_range(advice.scale_32nds, 8, 12); /* 14.5 and 30 ms */
    /* And back. */
    assert_int_equal(follow_renderer(2 * MS, 10 * MS, 300).scale_32nds, PACING_SCALE_FULL);
}

TEST(does_not_flicker)
{
    struct link link = link_of(1000, MS);
    uint64_t now_ns = 0;
    follow(&link, &now_ns, 33 * MS, 50000, 60); /* just at the edge between two sizes */
    unsigned changes = 0, scale = 0;
    for (int i = 0; i < 300; i++) {
        struct pacing_advice advice = follow(&link, &now_ns, (uint64_t)(i % 2 ? 31 : 36) * MS, 50000, 1);
        changes += i > 0 && advice.scale_32nds != scale;
        scale = advice.scale_32nds;
    }
    assert_in_range(changes, 0, 2); /* ten seconds */
}

/* 1 MB a second and a round trip of 20 ms; a frame of 10 KB takes 10 ms. Room for one frame time and the way. */
TEST(the_wait_for_the_next_frame_is_what_has_to_drain)
{
    pacing_init(&pacing, 10 * MS);
    assert_int_equal(pacing_wait_ns(&pacing, 0), 0);
    assert_true(pacing_wait_ns(&pacing, 1) == UINT64_MAX); /* nothing is known of the link */
    pacing_sent(&pacing, 0, 10000, 0);
    assert_true(pacing_wait_ns(&pacing, 0) == UINT64_MAX);
    pacing_acknowledged(&pacing, 0, false, 20 * MS);
    pacing_acknowledged(&pacing, 0, true, 30 * MS);
    /* 30 KB: three frames. */
    assert_int_equal(pacing_wait_ns(&pacing, 2), 0);
    assert_in_range(pacing_wait_ns(&pacing, 3), 10 * MS - 1, 10 * MS + 1);
    pacing_sent(&pacing, 1, 10000, 30 * MS);
    assert_int_equal(pacing_wait_ns(&pacing, 1), 0);
    assert_in_range(pacing_wait_ns(&pacing, 3), 20 * MS - 1, 20 * MS + 1);
    /* A frame larger than the whole window waits until nothing is before it. */
    pacing_acknowledged(&pacing, 1, false, 50 * MS);
    pacing_acknowledged(&pacing, 1, true, 60 * MS);
    pacing_sent(&pacing, 2, 100000, 60 * MS);
    assert_in_range(pacing_wait_ns(&pacing, 0), 100 * MS - 1, 100 * MS + 1);
    assert_false(pacing_may_send(&pacing));
}

/* 10 Mbit/s, 100 ms there and back, and a picture at rest of a megabyte when motion goes on. */
TEST(motion_does_not_wait_for_what_was_abandoned)
{
    struct link link = link_of(10, 100 * MS);
    uint32_t frame = 0;
    assert_true(pacing_is_long(&pacing, 1)); /* nothing is known */
    run(&link, 0, 2 * S, 30000, &frame);
    link_deliver(&link, 3 * S);
    assert_int_equal(pacing.in_flight_count, 0);
    assert_true(pacing_is_long(&pacing, 60000));
    assert_false(pacing_is_long(&pacing, 20000));
    pacing_sent(&pacing, frame, 1000000, 3 * S);
    assert_in_range(pacing_wait_ns(&pacing, 0), 500 * MS, 1000 * MS);
    pacing_abandoned(&pacing, frame);
    assert_true(pacing_may_send(&pacing));
    assert_int_equal(pacing_wait_ns(&pacing, 1), 0);  /* nor does one behind it, which is no megabyte either */
    pacing_acknowledged(&pacing, frame, true, 4 * S); /* in vain */
    assert_in_range(pacing_bytes_per_second(&pacing), 1100000, 1300000);
    /* Those before it count on. */
    pacing_sent(&pacing, frame + 1, 150000, 4 * S);
    pacing_sent(&pacing, frame + 2, 1000000, 4 * S);
    pacing_abandoned(&pacing, frame + 2);
    assert_false(pacing_may_send(&pacing));
}

/* A link of 1 MB a second: what was cut has come as soon, and says as much of the link, as a frame of that size.
 */
TEST(bytes_that_are_cut_are_neither_waited_for_nor_learned)
{
    struct pacing cut, small;
    pacing_init(&cut, 100 * MS);
    pacing_init(&small, 100 * MS);
    pacing_sent(&cut, 0, 1000000, S);
    pacing_cut(&cut, 0, 50000);
    pacing_sent(&small, 0, 50000, S);
    struct pacing *both[] = {&cut, &small};
    for (int i = 0; i < 2; i++) {
        pacing_acknowledged(both[i], 0, false, S + 20 * MS);
        pacing_acknowledged(both[i], 0, true, S + 70 * MS);
        assert_int_equal(both[i]->in_flight_bytes, 0);
    }
    assert_int_equal(pacing_bytes_per_second(&cut), pacing_bytes_per_second(&small));
    assert_int_equal(pacing_bytes_per_second(&cut), 1000000);
    assert_true(pacing_takes_longer(&cut, 50000, 49 * MS));
    assert_false(pacing_takes_longer(&cut, 50000, 51 * MS));
}

TEST(a_wait_beyond_all_measure_is_still_one)
{
    const uint64_t month_ns = 30 * 86400 * S;
    pacing_sent(&pacing, 0, 1, 0);
    pacing_acknowledged(&pacing, 0, true, month_ns); /* a byte in a month */
    pacing_sent(&pacing, 1, UINT32_MAX, month_ns);
    assert_in_range(pacing_wait_ns(&pacing, 1), month_ns, UINT64_MAX / 4);
}

/* ---- clients that make their own views --------------------------------------------------------------- */

#define KEY_NS (S / 10)
#define HIDDEN_BYTES 20000.0

static const struct pacing_terms for_views = {.margin = 0.1f, .hidden_layers = 1, .samples = 4};

/* A link of that rate, and a renderer that takes `sample_ns` for each sample of a picture without a margin. */
struct key_views {
    double bytes_per_second, sample_ns, bytes_full; /* at the quality of 90 */
    uint32_t frame;
    uint64_t now_ns;
};

static struct key_views key_views_of(double bytes_per_second, double sample_ns, double bytes_full)
{
    struct key_views views = {
        .bytes_per_second = bytes_per_second, .sample_ns = sample_ns, .bytes_full = bytes_full, .now_ns = S};
    pacing_init(&pacing, KEY_NS);
    pacing_set_terms(&pacing, KEY_NS, &for_views);
    return views;
}

static double key_area(const struct pacing_advice *advice)
{
    const double side = advice->scale_32nds / 32.0, grown = 1.0 + 0.1 * (2 - advice->margin_halves_less);
    return side * side * grown * grown;
}

static double key_bytes(const struct key_views *views, const struct pacing_advice *advice)
{
    return views->bytes_full * key_area(advice) * pow(1.35, (advice->quality - 90.0) / 12.0);
}

static double key_render_ns(const struct key_views *views, const struct pacing_advice *advice)
{
    return views->sample_ns * key_area(advice) * advice->samples;
}

/* After so many pictures as it advises, each of which the link carries before the next one. */
static struct pacing_advice settle(struct key_views *views, unsigned frames)
{
    struct pacing_advice advice = {0};
    for (unsigned i = 0; i < frames; i++) {
        advice = pacing_advise(&pacing, 90);
        const double bytes = key_bytes(views, &advice);
        pacing_sent(&pacing, views->frame, (uint64_t)bytes, views->now_ns);
        pacing_acknowledged(&pacing, views->frame, false, views->now_ns + MS);
        views->now_ns += MS + (uint64_t)(bytes / views->bytes_per_second * 1e9);
        pacing_acknowledged(&pacing, views->frame++, true, views->now_ns);
        pacing_learn_picture(&pacing, &advice, (uint64_t)key_render_ns(views, &advice), (uint64_t)bytes);
        pacing_learn_hidden(&pacing, (uint64_t)HIDDEN_BYTES);
    }
    return advice;
}

/* A tenth of a second of the link carries that many times what a picture with everything takes. */
static struct pacing_advice settle_on_link(double times)
{
    const double bytes = 100000.0, whole = bytes * 1.44 + HIDDEN_BYTES;
    struct key_views views = key_views_of(times * whole * 10.0 / 0.9, 1e6, bytes);
    return settle(&views, 60);
}

TEST(on_a_link_too_slow_what_views_need_least_goes_first)
{
    struct pacing_advice advice = settle_on_link(1.5);
    assert_true(!advice.no_hidden && advice.margin_halves_less == 0 && advice.quality == 90);
    advice = settle_on_link(0.9); /* 148 KB of 164; a picture with its margin is 144 */
    assert_true(advice.no_hidden && advice.margin_halves_less == 0 && advice.quality == 90);
    advice = settle_on_link(0.8); /* 131 KB; with half of it 121 */
    assert_true(advice.no_hidden && advice.margin_halves_less == 1 && advice.quality == 90);
    advice = settle_on_link(0.65); /* 107 KB; without 100 */
    assert_true(advice.no_hidden && advice.margin_halves_less == 2 && advice.quality == 90);
    advice = settle_on_link(0.4); /* 66 KB */
    assert_true(advice.margin_halves_less == 2 && advice.quality < 90 && advice.quality > PACING_QUALITY_MIN);
    assert_int_equal(advice.scale_32nds, 32);
    advice = settle_on_link(0.1); /* 16 KB: one of 29 is twice as late as it should be, and no more */
    assert_true(advice.quality == PACING_QUALITY_MIN && advice.scale_32nds == 32);
    advice = settle_on_link(0.05); /* a quarter of a second carries 20 KB */
    assert_true(advice.quality == PACING_QUALITY_MIN && advice.scale_32nds < 32);
}

static struct pacing_advice settle_on_renderer(double sample_ns)
{
    struct key_views views = key_views_of(1e9, sample_ns, 100000.0);
    return settle(&views, 60);
}

/* A margin is 1.44 times the work, half of one 1.21. */
TEST(pictures_for_views_are_smaller_only_where_they_take_a_quarter_of_a_second)
{
    struct pacing_advice advice = settle_on_renderer(10e6);
    assert_true(advice.samples == 4 && advice.margin_halves_less == 0);
    advice = settle_on_renderer(30e6);
    assert_true(advice.samples == 2 && advice.margin_halves_less == 0 && !advice.no_hidden);
    advice = settle_on_renderer(150e6); /* 216 ms */
    assert_true(advice.samples == 1 && advice.margin_halves_less == 0);
    advice = settle_on_renderer(190e6);
    assert_true(advice.samples == 1 && advice.margin_halves_less == 1 && advice.scale_32nds == 32);
    advice = settle_on_renderer(230e6);
    assert_true(advice.margin_halves_less == 2 && advice.scale_32nds == 32);
    advice = settle_on_renderer(400e6);
    assert_true(advice.margin_halves_less == 2 && advice.scale_32nds == 24 && advice.quality == 90);
    advice =
        settle_on_renderer(600e6); /* 338 ms at three quarters; half of the size with all of its margin is 216 */
    assert_true(advice.margin_halves_less == 0 && advice.scale_32nds == 16 && advice.samples == 1);
}

/* Where the link is just enough for a step, and pictures differ by a tenth, steps do not alternate. */
TEST(what_views_are_made_from_does_not_flicker)
{
    const double bytes = 100000.0;
    for (double times = 0.3; times < 1.3; times += 0.05) {
        struct key_views views = key_views_of(times * bytes * 14.4 / 0.9, 30e6, bytes);
        struct pacing_advice before = settle(&views, 60);
        unsigned changes = 0;
        for (unsigned i = 0; i < 200; i++) {
            views.bytes_full = bytes * (0.95 + 0.1 * (i * 7 % 11) / 11.0);
            const struct pacing_advice advice = settle(&views, 1);
            changes += advice.margin_halves_less != before.margin_halves_less ||
                       advice.no_hidden != before.no_hidden || advice.samples != before.samples;
            before = advice;
        }
        assert_true(changes <= 4); /* the size settles */
    }
}
