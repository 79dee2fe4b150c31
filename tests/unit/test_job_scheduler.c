/* SPDX-License-Identifier: MIT */
#include "job/scheduler.h"

#include <setjmp.h>
#include <stdarg.h>
#include <string.h>

#include <cmocka.h>

#define JOBS 6

/* Serves slices as the engine does and counts who had them. */
struct simulation {
    struct schedule_entry entries[JOBS];
    size_t count;
    uint64_t slice;
    unsigned had[JOBS];
};

static size_t serve(struct simulation *simulation)
{
    size_t picked = schedule_pick(simulation->entries, simulation->count);
    if (picked == SCHEDULE_NONE)
        return picked;
    simulation->slice++;
    simulation->entries[picked].job_served = simulation->slice;
    for (size_t i = 0; i < simulation->count; i++) {
        if (simulation->entries[i].client == simulation->entries[picked].client)
            simulation->entries[i].client_served = simulation->slice;
    }
    simulation->had[picked]++;
    return picked;
}

static void expect_had(const struct simulation *simulation, const unsigned *expected)
{
    for (size_t i = 0; i < simulation->count; i++) {
        if (simulation->had[i] != expected[i])
            fail_msg("job %zu had %u slices, expected %u", i, simulation->had[i], expected[i]);
    }
}

static void nobody_is_picked_when_nobody_is_ready(void **state)
{
    (void)state;
    struct simulation simulation = {.entries = {{.client = 1}, {.client = 2}}, .count = 2};
    assert_true(serve(&simulation) == SCHEDULE_NONE);
    assert_true(schedule_pick(NULL, 0) == SCHEDULE_NONE);
}

static void clients_share_alike_however_many_jobs_they_have(void **state)
{
    (void)state;
    struct simulation simulation = {.count = JOBS};
    for (size_t i = 0; i < JOBS; i++)
        simulation.entries[i] = (struct schedule_entry){.client = i < 4 ? 1 : i, .ready = true};
    for (int i = 0; i < 120; i++)
        serve(&simulation);
    expect_had(&simulation, (const unsigned[]){10, 10, 10, 10, 40, 40});
}

static void two_clients_take_turns(void **state)
{
    (void)state;
    struct simulation simulation = {
        .entries = {{.client = 8, .ready = true}, {.client = 3, .ready = true}},
        .count = 2,
    };
    size_t before = serve(&simulation);
    for (int i = 0; i < 20; i++) {
        size_t now = serve(&simulation);
        assert_true(now != before);
        before = now;
    }
}

static void who_comes_back_after_a_pause_has_no_claim_on_what_it_missed(void **state)
{
    (void)state;
    struct simulation simulation = {
        .entries = {{.client = 1, .ready = true}, {.client = 2, .ready = false}},
        .count = 2,
    };
    for (int i = 0; i < 100; i++)
        serve(&simulation);
    simulation.entries[1].ready = true;
    memset(simulation.had, 0, sizeof simulation.had);
    assert_int_equal(serve(&simulation), 1); /* it is next at once */
    for (int i = 1; i < 20; i++)
        serve(&simulation);
    expect_had(&simulation, (const unsigned[]){10, 10});
}

static void a_client_that_is_alone_has_every_slice(void **state)
{
    (void)state;
    struct simulation simulation = {
        .entries = {{.client = 1, .ready = true}, {.client = 1, .ready = true}, {.client = 2}},
        .count = 3,
    };
    for (int i = 0; i < 10; i++)
        serve(&simulation);
    expect_had(&simulation, (const unsigned[]){5, 5, 0});
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nobody_is_picked_when_nobody_is_ready),
        cmocka_unit_test(clients_share_alike_however_many_jobs_they_have),
        cmocka_unit_test(two_clients_take_turns),
        cmocka_unit_test(who_comes_back_after_a_pause_has_no_claim_on_what_it_missed),
        cmocka_unit_test(a_client_that_is_alone_has_every_slice),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
