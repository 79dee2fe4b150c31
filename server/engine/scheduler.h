/* SPDX-License-Identifier: MIT */
/* Chooses the job of the next slice. Pure: no clock, no GL, no socket.
 *
 * Fair queueing by virtual time: the time that the GL thread has spent on a job, divided by the job's weight. The
 * client with the minimum is next, and the job of that client with the minimum; so a view has its share of time
 * beside a batch, however long the batch's slices are. A client that arrives, or returns after a pause, begins at
 * the minimum of those that are ready: it is among the next, and has no claim on the time that it missed. All
 * clients of a process are one user's, or share a scene: between users, the operating system divides the time.
 *
 * Some slices are very long: the first ones compile programs, upload the scene and build its structures, for all
 * later users. The job of such a slice waits afterwards, but not much longer than SCHEDULE_WAIT_MAX_NS.
 *
 * A view's frame is better finished than interleaved with others: with sixty views in turns by slices, each would
 * show a camera that is sixty frames old. So a frame may keep the turn for some time, and is charged for it. That
 * time grows with the number of waiting clients, no faster than they are owed time: with n of them, a client with
 * short frames is due again after n turns. */
#ifndef FARLIGHT_ENGINE_SCHEDULER_H
#define FARLIGHT_ENGINE_SCHEDULER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Time of a client, or of a job among those of its client. All-zero: it has just arrived. */
struct schedule_share {
    uint64_t virtual_ns;
    uint64_t turn;     /* number of its last slice; among equals the longest waiting is next */
    uint64_t ready_in; /* number of the last pick that found it ready */
    bool ready;        /* during a pick */
};

/* The competitors for a turn: all clients, or the jobs of one client. */
struct schedule_group {
    uint64_t min_ns; /* the minimum virtual time of those that were ready; never decreases */
    /* During a pick. */
    uint64_t next_ns;
    uint32_t ready_count;
};

struct schedule_client {
    struct schedule_share share;
    uint64_t mean_ns; /* mean length of its slices, the last ones weighted most */
    struct schedule_group jobs;
};

struct scheduler {
    struct schedule_group clients;
    uint64_t picks, turns;
    uint64_t turn_ns, turn_end_ns; /* since the pick of the last slice */
};

struct schedule_entry {
    struct schedule_client *client; /* several jobs share one */
    struct schedule_share *job;
    bool ready;
};

#define SCHEDULE_TURN_NS 10000000u    /* about a slice on software GL */
#define SCHEDULE_TURN_EACH_NS 500000u /* longer for each competitor that is ready */
/* A slice that is this many times as long as the client's mean, and at least this long, is charged at that length:
 * the machine was busy with other work, or something was done once for all. Repeated cost enters the mean. */
#define SCHEDULE_OUTLIER 8
#define SCHEDULE_OUTLIER_MIN_NS 2000000u
#define SCHEDULE_WAIT_MAX_NS UINT64_C(2000000000)
#define SCHEDULE_NONE SIZE_MAX

/* The index of the entry whose slice is next, which is to be charged; SCHEDULE_NONE: none is ready. Entries that
 * are not passed are not ready. */
size_t schedule_pick(struct scheduler *scheduler, const struct schedule_entry *entries, size_t count);
/* Charges a slice to a job, whose weight is at least 1. */
void schedule_charge(struct scheduler *scheduler, const struct schedule_entry *entry, uint64_t slice_ns,
                     uint32_t weight);

/* Whether the job of the last slice may continue without another pick, if its frame is better finished. */
bool schedule_turn_lasts(const struct scheduler *scheduler);

#endif
