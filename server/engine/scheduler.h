/* SPDX-License-Identifier: MIT */
/* Whose slice is next. Pure: no clock, no GL, no socket.
 *
 * Fair queueing by virtual time: what the thread that owns the device has spent on somebody, divided by the weight
 * of the job that it was spent on. Whoever has least of it is next, first among clients, then among the jobs of
 * that client; so each gets its share of time however long its slices are, and however many jobs others have. Who
 * comes, or comes back after a pause, begins at the least of those who are ready: it is next, or one of the next,
 * but has no claim on what it missed.
 *
 * Some slices are very long: the first ones compile programs, upload the scene and build its structures, for all
 * who come after. Whoever had one waits for it, but not much longer than SCHEDULE_WAIT_MAX_NS.
 *
 * A frame that somebody looks at is better finished than begun beside others: with sixty of them in turns by
 * slices each would show a camera that is sixty frames old. So it may keep the turn for a while, and is charged
 * all the same. The while grows with the number of those who wait, and no faster than they are owed time: with n
 * of them, who has short frames is due again after n of these. */
#ifndef FARLIGHT_ENGINE_SCHEDULER_H
#define FARLIGHT_ENGINE_SCHEDULER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Of a client, or of a job among those of its client. All-zero is one that has just come. */
struct schedule_share {
    uint64_t virtual_ns;
    uint64_t turn;     /* number of its last slice; among equals who has waited longest is next */
    uint64_t ready_in; /* number of the last pick that found it ready */
    bool ready;        /* during a pick */
};

/* Those who compete with each other: all clients, or the jobs of one. */
struct schedule_group {
    uint64_t least_ns; /* virtual time of whoever of those that were ready had least; never goes back */
    /* During a pick. */
    uint64_t next_ns;
    uint32_t ready_count;
};

struct schedule_client {
    struct schedule_share share;
    uint64_t mean_ns; /* of its slices, the last ones most */
    struct schedule_group jobs;
};

struct scheduler {
    struct schedule_group clients;
    uint64_t picks, turns;
    uint64_t turn_ns, turn_end_ns; /* since whoever had the last slice was picked */
};

struct schedule_entry {
    struct schedule_client *client; /* of several jobs the same one */
    struct schedule_share *job;
    bool ready;
};

#define SCHEDULE_TURN_NS 10000000u    /* about a slice on software GL */
#define SCHEDULE_TURN_EACH_NS 500000u /* longer for each client that is ready */
/* A slice that is so many times as long as the client's others, and at least so long, is charged as one of that
 * length: the machine had other work meanwhile, or something was done once for all. What comes again is in the
 * mean. */
#define SCHEDULE_OUTLIER 8
#define SCHEDULE_OUTLIER_MIN_NS 2000000u
#define SCHEDULE_WAIT_MAX_NS UINT64_C(2000000000)
#define SCHEDULE_NONE SIZE_MAX

/* Position of the entry whose slice is next, and is to be charged; SCHEDULE_NONE: nobody is ready. Who is not
 * named is not ready. */
size_t schedule_pick(struct scheduler *scheduler, const struct schedule_entry *entries, size_t count);
/* A slice of that job took so long. `weight`: of the job, at least 1. */
void schedule_charge(struct scheduler *scheduler, struct schedule_client *client, struct schedule_share *job,
                     uint64_t slice_ns, uint32_t weight);

/* Whether who had the last slice may go on without another pick, if it has begun what is better finished. */
bool schedule_turn_lasts(const struct scheduler *scheduler);

#endif
