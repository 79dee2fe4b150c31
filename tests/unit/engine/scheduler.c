/* SPDX-License-Identifier: MIT */
/* Shares of the device among jobs, in a simulation. */
#include "engine/scheduler.h"
#include "tests/harness/test.h"

#include <stdlib.h>
#include <string.h>

#define JOBS_MAX 64
#define MS ((uint64_t)1000000)

/* Serves slices as the engine does, and counts the time that each job had. */
static struct simulation {
    struct scheduler scheduler;
    struct schedule_client clients[JOBS_MAX];
    struct schedule_share shares[JOBS_MAX];
    struct schedule_entry entries[JOBS_MAX];
    uint32_t weights[JOBS_MAX];
    uint64_t slice_ns[JOBS_MAX];
    uint64_t had_ns[JOBS_MAX], waited_ns[JOBS_MAX], longest_wait_ns[JOBS_MAX];
    bool keeps_turn[JOBS_MAX]; /* set while a job has begun something */
    size_t count, before;
    uint64_t now_ns;
} simulation;

static int begin(void **state)
{
    (void)state;
    memset(&simulation, 0, sizeof(simulation));
    return 0;
}

EACH_TEST(begin, NULL)

static size_t add(size_t client, uint32_t weight, uint64_t slice_ns)
{
    size_t i = simulation.count++;
    simulation.entries[i] = (struct schedule_entry){
        .client = &simulation.clients[client], .job = &simulation.shares[i], .ready = true};
    simulation.weights[i] = weight;
    simulation.slice_ns[i] = slice_ns;
    return i;
}

static size_t serve(void)
{
    size_t picked = simulation.before;
    if (!simulation.keeps_turn[picked] || !schedule_turn_lasts(&simulation.scheduler))
        picked = schedule_pick(&simulation.scheduler, simulation.entries, simulation.count);
    if (picked == SCHEDULE_NONE)
        return picked;
    uint64_t slice_ns = simulation.slice_ns[picked];
    schedule_charge(&simulation.scheduler, &simulation.entries[picked], slice_ns, simulation.weights[picked]);
    simulation.before = picked;
    simulation.now_ns += slice_ns;
    simulation.had_ns[picked] += slice_ns;
    simulation.waited_ns[picked] = 0;
    for (size_t i = 0; i < simulation.count; i++) {
        if (i == picked || !simulation.entries[i].ready)
            continue;
        simulation.waited_ns[i] += slice_ns;
        if (simulation.waited_ns[i] > simulation.longest_wait_ns[i])
            simulation.longest_wait_ns[i] = simulation.waited_ns[i];
    }
    return picked;
}

static void serve_for(uint64_t time_ns)
{
    for (uint64_t end_ns = simulation.now_ns + time_ns; simulation.now_ns < end_ns;)
        assert_true(serve() != SCHEDULE_NONE);
}

/* Within one slice of whoever has the longest. */
static void expect_had(size_t job, uint64_t expected_ns)
{
    uint64_t longest_ns = 0;
    for (size_t i = 0; i < simulation.count; i++)
        longest_ns = simulation.slice_ns[i] > longest_ns ? simulation.slice_ns[i] : longest_ns;
    uint64_t had_ns = simulation.had_ns[job];
    if (had_ns > expected_ns + longest_ns || had_ns + longest_ns < expected_ns)
        fail_msg("job %zu had %.1f ms, expected %.1f within %.1f", job, (double)had_ns / MS,
                 (double)expected_ns / MS, (double)longest_ns / MS);
}

TEST(no_job_is_picked_when_none_is_ready)
{
    assert_true(serve() == SCHEDULE_NONE);
    for (size_t client = 0; client < 2; client++)
        simulation.entries[add(client, 1, MS)].ready = false;
    assert_true(serve() == SCHEDULE_NONE);
}

TEST(a_client_that_is_alone_has_all_of_the_time)
{
    add(0, 1, 3 * MS);
    add(0, 1, 3 * MS);
    simulation.entries[add(1, 1, MS)].ready = false;
    serve_for(300 * MS);
    expect_had(0, 150 * MS);
    expect_had(1, 150 * MS);
}

TEST(clients_share_alike_however_many_jobs_they_have)
{
    for (size_t i = 0; i < 6; i++)
        add(i < 4 ? 0 : i, 1, (i + 1) * MS);
    serve_for(1200 * MS);
    for (size_t i = 0; i < 4; i++)
        expect_had(i, 100 * MS);
    for (size_t i = 4; i < 6; i++)
        expect_had(i, 400 * MS);
}

TEST(long_slices_buy_no_more_time_and_keep_short_ones_waiting_for_one_only)
{
    size_t heavy = add(0, 1, 100 * MS), light = add(1, 1, 2 * MS);
    serve_for(10000 * MS);
    expect_had(heavy, 5000 * MS);
    expect_had(light, 5000 * MS);
    assert_true(simulation.longest_wait_ns[light] == 100 * MS);
    assert_true(simulation.longest_wait_ns[heavy] <= 102 * MS);
}

TEST(weights_divide_the_time_between_clients)
{
    size_t view = add(0, 4, 3 * MS), batch = add(1, 1, 7 * MS);
    serve_for(5000 * MS);
    expect_had(view, 4000 * MS);
    expect_had(batch, 1000 * MS);
    /* A batch that is given the same weight has the same share, and the maximum weight sixteen times that of the
     * minimum. */
    size_t great = add(2, 16, 5 * MS), same = add(3, 4, 5 * MS);
    memset(simulation.had_ns, 0, sizeof(simulation.had_ns));
    serve_for(25000 * MS);
    expect_had(view, 4000 * MS);
    expect_had(batch, 1000 * MS);
    expect_had(great, 16000 * MS);
    expect_had(same, 4000 * MS);
}

TEST(weights_divide_the_time_between_the_jobs_of_a_client_too)
{
    size_t view = add(0, 4, 2 * MS), batch = add(0, 1, 9 * MS);
    serve_for(2000 * MS);
    expect_had(view, 1600 * MS);
    expect_had(batch, 400 * MS);
}

TEST(a_job_that_returns_after_a_pause_has_no_claim_on_missed_time)
{
    size_t there = add(0, 1, 5 * MS), paused = add(1, 1, 5 * MS);
    serve_for(100 * MS);
    simulation.entries[paused].ready = false;
    serve_for(5000 * MS);
    simulation.entries[paused].ready = true;
    memset(simulation.had_ns, 0, sizeof(simulation.had_ns));
    assert_int_equal(serve(), paused); /* the job is next at once */
    serve_for(195 * MS);
    expect_had(there, 100 * MS);
    expect_had(paused, 100 * MS);
    /* So it is for one that was never seen, and for a job among others of its client. */
    size_t late = add(2, 1, 5 * MS), second = add(0, 1, 5 * MS);
    memset(simulation.had_ns, 0, sizeof(simulation.had_ns));
    serve_for(300 * MS);
    expect_had(late, 100 * MS);
    expect_had(paused, 100 * MS);
    expect_had(there, 50 * MS);
    expect_had(second, 50 * MS);
}

TEST(a_client_whose_job_has_ended_has_no_claim_either)
{
    add(0, 1, 5 * MS);
    size_t job = add(1, 1, 5 * MS);
    serve_for(100 * MS);
    simulation.count--; /* the last job is not named any more */
    serve_for(3000 * MS);
    simulation.shares[job] = (struct schedule_share){0}; /* another one of that client */
    simulation.count++;
    memset(simulation.had_ns, 0, sizeof(simulation.had_ns));
    serve_for(200 * MS);
    expect_had(0, 100 * MS);
    expect_had(job, 100 * MS);
}

TEST(pauses_of_all_do_not_make_the_first_to_come_the_owner)
{
    size_t first = add(0, 1, 5 * MS);
    serve_for(3000 * MS);
    simulation.entries[first].ready = false;
    assert_true(serve() == SCHEDULE_NONE);
    size_t second = add(1, 1, 5 * MS);
    assert_int_equal(serve(), second);
    simulation.entries[first].ready = true;
    memset(simulation.had_ns, 0, sizeof(simulation.had_ns));
    serve_for(200 * MS);
    expect_had(first, 100 * MS);
    expect_had(second, 100 * MS);
}

TEST(a_job_that_pauses_between_slices_is_served_first_and_not_more)
{
    size_t batch = add(0, 1, 8 * MS), view = add(1, 4, 5 * MS);
    simulation.entries[view].ready = false;
    serve_for(40 * MS);
    /* A camera every fourth slice or so, as it comes. */
    for (int i = 0; i < 400; i++) {
        if (i % 4 == 0)
            simulation.entries[view].ready = true;
        size_t picked = serve();
        assert_int_equal(picked, i % 4 == 0 ? view : batch);
        if (picked == view)
            simulation.entries[view].ready = false;
    }
}

TEST(many_clients_are_all_served)
{
    uint32_t random = 1;
    for (size_t i = 0; i < JOBS_MAX; i++)
        add(i, 1, MS);
    for (int round = 0; round < 20000; round++) {
        for (size_t i = 0; i < JOBS_MAX; i++) {
            random = random * 1664525u + 1013904223u;
            simulation.slice_ns[i] = (1 + (random >> 16) % (i % 2 ? 3 : 20)) * MS;
        }
        serve();
    }
    for (size_t i = 0; i < JOBS_MAX; i++)
        simulation.slice_ns[i] = 20 * MS; /* length of the longest slice */
    for (size_t i = 0; i < JOBS_MAX; i++) {
        expect_had(i, simulation.now_ns / JOBS_MAX);
        /* Nobody waits for longer than it takes to serve each of the others, and what its own slice went too far.
         */
        assert_true(simulation.longest_wait_ns[i] <= 2 * JOBS_MAX * 20 * MS);
    }
}

TEST(a_frame_that_is_looked_at_is_finished_before_another_is_begun)
{
    for (size_t i = 0; i < 3; i++) {
        add(i, 4, 2 * MS);
        simulation.keeps_turn[i] = true;
    }
    size_t batch = add(3, 1, 2 * MS);
    /* Frames of four slices; of a next one nothing is begun when one is done. */
    for (size_t frame = 0, before = batch; frame < 300; frame++) {
        size_t now = serve();
        assert_true(now != before || now == batch);
        if (before != batch)
            simulation.keeps_turn[before] = true;
        for (int slice = 1; slice < 4 && now != batch; slice++)
            assert_int_equal(serve(), now);
        simulation.keeps_turn[now] = false;
        before = now;
    }
    for (size_t i = 0; i < 3; i++) {
        simulation.slice_ns[i] = 8 * MS; /* a frame's */
        expect_had(i, simulation.now_ns * 4 / 13);
    }
    expect_had(batch, simulation.now_ns / 13);
}

TEST(a_long_frame_does_not_keep_the_turn_for_ever)
{
    size_t heavy = add(0, 1, 3 * MS), light = add(1, 1, 3 * MS);
    simulation.keeps_turn[heavy] = true;
    serve_for(3000 * MS);
    expect_had(heavy, 1500 * MS);
    expect_had(light, 1500 * MS);
    assert_true(simulation.longest_wait_ns[light] <= SCHEDULE_TURN_NS + 2 * SCHEDULE_TURN_EACH_NS + 3 * MS);
}

TEST(a_very_long_slice_is_not_paid_for_without_end)
{
    for (size_t i = 0; i < JOBS_MAX; i++)
        add(i, 1, 5 * MS);
    serve_for(1000 * MS);
    size_t first = 3;
    simulation.slice_ns[first] = 5000 * MS; /* programs are compiled, a large scene is built */
    while (serve() != first)
        continue;
    simulation.slice_ns[first] = 5 * MS;
    memset(simulation.longest_wait_ns, 0, sizeof(simulation.longest_wait_ns));
    memset(simulation.waited_ns, 0, sizeof(simulation.waited_ns));
    serve_for(10000 * MS);
    /* The bound: two turns of each of so many jobs, and one round, as the others did not have equal times
     * either. */
    uint64_t turn_ns = SCHEDULE_TURN_NS + JOBS_MAX * (uint64_t)SCHEDULE_TURN_EACH_NS;
    assert_true(simulation.longest_wait_ns[first] <= JOBS_MAX * (2 * turn_ns + 5 * MS));
    assert_true(simulation.longest_wait_ns[first] >= SCHEDULE_WAIT_MAX_NS);
}

TEST(a_slice_that_the_machine_interrupts_costs_no_turns)
{
    for (size_t i = 0; i < JOBS_MAX; i++)
        add(i, 1, MS / 4);
    serve_for(200 * MS);
    simulation.slice_ns[7] = 40 * MS;
    while (serve() != 7)
        continue;
    simulation.slice_ns[7] = MS / 4;
    memset(simulation.longest_wait_ns, 0, sizeof(simulation.longest_wait_ns));
    memset(simulation.waited_ns, 0, sizeof(simulation.waited_ns));
    serve_for(1000 * MS);
    assert_true(simulation.longest_wait_ns[7] <= JOBS_MAX * (SCHEDULE_OUTLIER_MIN_NS + MS / 4));
}

TEST(short_frames_come_as_often_as_they_are_due_beside_many_long_ones)
{
    size_t light = add(0, 1, 2 * MS);
    for (size_t i = 1; i < JOBS_MAX; i++)
        simulation.keeps_turn[add(i, 1, 3 * MS)] = true;
    uint32_t frames = 0;
    while (simulation.now_ns < 20000 * MS)
        frames += serve() == light;
    /* A 64th of the time, in frames of 2 ms. */
    assert_true(frames >= 20000 / 64 / 2 * 9 / 10);
    expect_had(light, frames * 2 * MS);
}
