/* SPDX-License-Identifier: MIT */
/* Whose slice is next. Pure: no clock, no GL, no socket.
 *
 * Round robin between clients, and between the jobs of a client: whoever has waited longest is next. Waiting is
 * counted in slices, so that a client who comes back after a pause has no claim on what it missed. */
#ifndef FARLIGHT_JOB_SCHEDULER_H
#define FARLIGHT_JOB_SCHEDULER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct schedule_entry {
    uint64_t client;
    uint64_t client_served; /* number of the slice that the client had last; 0: none yet */
    uint64_t job_served;    /* likewise the job */
    bool ready;
};

#define SCHEDULE_NONE SIZE_MAX

/* Position of the entry whose slice is next; SCHEDULE_NONE: nobody is ready. Among equals the first. */
size_t schedule_pick(const struct schedule_entry *entries, size_t count);

#endif
