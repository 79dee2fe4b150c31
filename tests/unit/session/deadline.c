/* SPDX-License-Identifier: MIT */
/* Bounces, size and samples dropped so that a view reaches its rate, with a simulated renderer: a part that
 * every frame takes, one that grows with the area, and bounces that do. */
#include "base/clock.h"
#include "session/guess.h"
#include "tests/harness/test.h"

#define MS UINT64_C(1000000)
#define DEADLINE_NS (100 * MS)

struct renderer {
    uint64_t fixed_ns, area_ns,
        bounce_ns; /* times of a full picture; each bounce takes half as long as the one before it */
    uint32_t chance;
    unsigned percent; /* up to so much more or less */
};

static struct pacing begin(uint32_t samples)
{
    struct pacing pacing;
    const struct pacing_terms terms = {
        .samples = samples, .depth = 8, .deadline_ns = DEADLINE_NS, .ignores_link = true};
    pacing_init(&pacing, DEADLINE_NS / 4); /* more often than that it may not come */
    pacing_set_terms(&pacing, DEADLINE_NS / 4, &terms);
    return pacing;
}

static uint64_t render(struct renderer *renderer, const struct pacing_advice *advice,
                       uint64_t wave_ns[PACING_WAVES])
{
    const double work = advice->scale_32nds * advice->scale_32nds / 1024.0 * advice->samples;
    renderer->chance = renderer->chance * 1664525u + 1013904223u;
    const double more = 1.0 + renderer->percent / 100.0 * ((renderer->chance >> 8) / (double)(1 << 23) - 1.0);
    double sum_ns = (double)renderer->fixed_ns + work * (double)renderer->area_ns;
    for (unsigned wave = 1; wave <= 8 - advice->depth_less; wave++) {
        wave_ns[wave] = (uint64_t)(more * work * (double)(renderer->bounce_ns >> wave));
        sum_ns += work * (double)(renderer->bounce_ns >> wave);
    }
    return (uint64_t)(more * sum_ns);
}

/* Follows its advice for so many frames, of which it says how long the longest took and how often they changed. */
static struct pacing_advice follow(struct pacing *pacing, struct renderer *renderer, unsigned frames,
                                   uint64_t *longest_ns, unsigned *changes)
{
    struct pacing_advice advice = pacing->advised;
    *longest_ns = *changes = 0;
    for (unsigned i = 0; i < frames; i++) {
        uint64_t wave_ns[PACING_WAVES] = {0};
        const struct pacing_advice before = advice;
        advice = pacing_advise(pacing, 90);
        const uint64_t took_ns = render(renderer, &advice, wave_ns);
        pacing_learn_waves(pacing, &advice, took_ns, wave_ns, 0);
        *longest_ns = took_ns > *longest_ns ? took_ns : *longest_ns;
        *changes += i > 0 && (advice.scale_32nds != before.scale_32nds || advice.samples != before.samples ||
                              advice.depth_less != before.depth_less);
    }
    return advice;
}

TEST(a_heavy_frame_comes_in_time_from_the_second_on)
{
    struct pacing pacing = begin(1);
    struct renderer heavy = {.fixed_ns = 10 * MS, .area_ns = 300 * MS, .bounce_ns = 200 * MS};
    uint64_t longest_ns;
    unsigned changes;
    follow(&pacing, &heavy, 1, &longest_ns, &changes);
    assert_true(longest_ns > 5 * DEADLINE_NS);
    follow(&pacing, &heavy, 1, &longest_ns, &changes);
    assert_true(longest_ns <= DEADLINE_NS);
    /* 85 of 100 ms: (12 / 32)^2 of 500 and 10 are 80, (13 / 32)^2 of it would be 92. */
    const struct pacing_advice advice = follow(&pacing, &heavy, 300, &longest_ns, &changes);
    assert_int_equal(advice.scale_32nds, 12);
    assert_int_equal(advice.depth_less, 0);
    assert_true(longest_ns <= DEADLINE_NS);
    assert_in_range(changes, 0, 1);
}

TEST(it_does_not_pump_where_times_vary)
{
    for (uint64_t area_ns = 50 * MS; area_ns <= 2000 * MS; area_ns += area_ns / 9) {
        struct pacing pacing = begin(1);
        struct renderer renderer = {
            .fixed_ns = 5 * MS, .area_ns = area_ns, .bounce_ns = area_ns / 3, .percent = 15};
        uint64_t longest_ns;
        unsigned changes;
        follow(&pacing, &renderer, 60, &longest_ns, &changes);
        follow(&pacing, &renderer, 300, &longest_ns, &changes);
        /* Half a minute of it: a step worse, and the same back, at most. The mean keeps 85 % of the deadline. */
        assert_in_range(changes, 0, 2);
        assert_true((double)longest_ns < 1.15 * 1.15 * (double)DEADLINE_NS);
    }
}

TEST(samples_go_first_then_size_then_bounces)
{
    struct pacing pacing = begin(8);
    struct renderer renderer = {.fixed_ns = MS, .area_ns = 16 * MS, .bounce_ns = 8 * MS};
    uint64_t longest_ns;
    unsigned changes;
    struct pacing_advice advice = follow(&pacing, &renderer, 100, &longest_ns, &changes);
    assert_int_equal(advice.samples, 3); /* 3 of 24 and 1 are 73 of 85 ms */
    assert_int_equal(advice.scale_32nds, PACING_SCALE_FULL);
    renderer.area_ns = 160 * MS;
    advice = follow(&pacing, &renderer, 100, &longest_ns, &changes);
    assert_int_equal(advice.samples, 1);
    assert_int_equal(advice.scale_32nds, 22); /* 0.47 of 168 and 1 are 80; 24 / 32: 95 */
    assert_int_equal(advice.depth_less, 0);
    renderer = (struct renderer){.fixed_ns = MS, .area_ns = 2200 * MS, .bounce_ns = 1500 * MS};
    advice = follow(&pacing, &renderer, 200, &longest_ns, &changes);
    /* 25 / 1024: 54 of the first hits and at most 18, 9, 5 .. of the bounces: the first two leave 81 + 1. */
    assert_int_equal(advice.scale_32nds, 5);
    assert_in_range(advice.depth_less, 5, 6);
}

TEST(one_frame_that_was_disturbed_changes_nothing)
{
    struct pacing pacing = begin(1);
    struct renderer renderer = {.fixed_ns = 10 * MS, .area_ns = 300 * MS, .bounce_ns = 200 * MS};
    uint64_t longest_ns;
    unsigned changes;
    const struct pacing_advice before = follow(&pacing, &renderer, 60, &longest_ns, &changes);
    for (int i = 0; i < 20; i++) {
        const uint64_t wave_ns[PACING_WAVES] = {0};
        pacing_learn_waves(&pacing, &before, 900 * MS, wave_ns, 0);
        const struct pacing_advice after = follow(&pacing, &renderer, 5, &longest_ns, &changes);
        assert_int_equal(changes, 0);
        assert_int_equal(after.scale_32nds, before.scale_32nds);
    }
}

TEST(all_comes_back_where_it_becomes_light)
{
    struct pacing pacing = begin(1);
    struct renderer renderer = {.fixed_ns = MS, .area_ns = 2000 * MS, .bounce_ns = 2000 * MS, .percent = 10};
    uint64_t longest_ns;
    unsigned changes;
    struct pacing_advice advice = follow(&pacing, &renderer, 60, &longest_ns, &changes);
    assert_int_equal(advice.scale_32nds, 5);
    assert_int_equal(advice.depth_less, 6);
    renderer.area_ns = renderer.bounce_ns = 20 * MS;
    advice = follow(&pacing, &renderer, 200, &longest_ns, &changes);
    assert_int_equal(advice.scale_32nds, PACING_SCALE_FULL);
    assert_int_equal(advice.depth_less, 0);
}

TEST(the_first_that_moves_is_right_where_pictures_at_rest_were_seen)
{
    struct pacing pacing = begin(1);
    struct renderer heavy = {.fixed_ns = 10 * MS, .area_ns = 300 * MS, .bounce_ns = 200 * MS};
    const struct pacing_advice full = {.scale_32nds = PACING_SCALE_FULL, .samples = 1};
    uint64_t wave_ns[PACING_WAVES] = {0}, longest_ns;
    unsigned changes;
    const uint64_t took_ns = render(&heavy, &full, wave_ns);
    pacing_learn_waves(&pacing, &full, took_ns, wave_ns, 0);
    follow(&pacing, &heavy, 30, &longest_ns, &changes);
    assert_true(longest_ns <= DEADLINE_NS);
}

static void add_spans(struct stage_times *times, enum stage stage, uint32_t wave, uint64_t first_ns, uint64_t ns)
{
    for (uint32_t slice = 0; slice < 8; slice++)
        stage_times_add(times, stage, CLOCK_CPU, wave, clock_now_ns(), slice == 0 ? first_ns : ns);
}

/* The first picture compiled for seconds, and built, before it rendered for half a second. */
TEST(the_first_that_moves_is_right_where_one_picture_at_rest_was_seen)
{
    struct pacing pacing = begin(1);
    struct renderer heavy = {.fixed_ns = 10 * MS, .area_ns = 300 * MS, .bounce_ns = 200 * MS};
    const struct pacing_advice full = {.scale_32nds = PACING_SCALE_FULL, .samples = 1};
    uint64_t wave_ns[PACING_WAVES] = {0}, guessed_ns[PACING_WAVES] = {0}, longest_ns, bounces_ns = 0;
    unsigned changes;
    struct stage_times times;
    const uint64_t took_ns = render(&heavy, &full, wave_ns);
    stage_times_begin(&times);
    stage_times_add(&times, STAGE_BUILD, CLOCK_CPU, 0, clock_now_ns(), 3000 * MS);
    for (uint32_t wave = 1; wave <= 8; wave++) {
        bounces_ns += wave_ns[wave];
        add_spans(&times, STAGE_TRACE, wave, 1000 * MS, wave_ns[wave] / 8);
    }
    add_spans(&times, STAGE_SHADE, 0, 1000 * MS, (took_ns - bounces_ns) / 8);
    const uint64_t guess_ns = guess_render_ns(&times, guessed_ns);
    assert_in_range(guess_ns, took_ns - 100, took_ns); /* nanoseconds that divisions have lost */
    pacing_guess_waves(&pacing, &full, guess_ns, guessed_ns);
    follow(&pacing, &heavy, 30, &longest_ns, &changes);
    assert_true(longest_ns <= DEADLINE_NS);
}

/* A guess that is a hundred times too high costs the frames until a better step has fitted eight times, no
 * more. */
TEST(a_guess_counts_until_something_is_known)
{
    struct pacing pacing = begin(1);
    struct renderer light = {.fixed_ns = MS, .area_ns = 20 * MS, .bounce_ns = 10 * MS};
    const struct pacing_advice full = {.scale_32nds = PACING_SCALE_FULL, .samples = 1};
    const uint64_t unknown[PACING_WAVES] = {0};
    uint64_t longest_ns;
    unsigned changes;
    pacing_guess_waves(&pacing, &full, 3000 * MS, unknown);
    struct pacing_advice advice = follow(&pacing, &light, 1, &longest_ns, &changes);
    assert_int_equal(advice.scale_32nds, 5); /* 0.024 of 3000 are 73 of 85 ms */
    advice = follow(&pacing, &light, 8, &longest_ns, &changes);
    assert_int_equal(advice.scale_32nds, PACING_SCALE_FULL);
}

TEST(without_a_deadline_bounces_stay)
{
    struct pacing pacing = begin(1);
    pacing_set_terms(&pacing, DEADLINE_NS, &(struct pacing_terms){.samples = 1, .depth = 8});
    struct renderer heavy = {.fixed_ns = MS, .area_ns = 20000 * MS, .bounce_ns = 20000 * MS};
    uint64_t longest_ns;
    unsigned changes;
    const struct pacing_advice advice = follow(&pacing, &heavy, 60, &longest_ns, &changes);
    assert_int_equal(advice.depth_less, 0);
    assert_int_equal(advice.scale_32nds, 8);
}
