/* SPDX-License-Identifier: MIT */
/* Shares of processor time: a weight for each worker, which the kernel applies. Where the daemon is alone in a
 * control group that is delegated to it (systemd's Delegate=cpu), each worker has a group of its own with that
 * cpu.weight (Documentation/admin-guide/cgroup-v2.rst); elsewhere the weight becomes a niceness. */
#ifndef FARLIGHT_FRONT_SHARES_H
#define FARLIGHT_FRONT_SHARES_H

#include "base/error.h"

#include <limits.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/types.h>

#define SHARES_MAX 64
#define SHARES_DEFAULT_WEIGHT 100u
#define SHARES_WEIGHT_MAX 10000u

struct shares {
    struct {
        uint32_t user;
        uint32_t weight;
    } users[SHARES_MAX];
    size_t count;
    uint32_t of_keys, of_networks; /* weights of clients with a key, and of unidentified clients */
};

/* Reads NAME=WEIGHT separated by blanks; a name is a user, a user's number, "keys" or "networks". False with
 * ERROR_INVALID: something cannot be understood; `field` is the error's field. */
bool shares_parse(struct shares *shares, const char *text, const char *field, struct error *error);
/* The weight of auth_owner_number(). */
uint32_t shares_weight(const struct shares *shares, uint64_t owner);

/* The group that is delegated to the daemon; "": none is. */
struct share_groups {
    char folder[PATH_MAX - 64];
};

/* Moves this process into a group of its own below the delegated one. `groups_file`: as /proc/self/cgroup; `root`:
 * where groups are mounted, as /sys/fs/cgroup. Without a delegated group nothing is changed. */
void share_groups_begin(struct share_groups *groups, const char *groups_file, const char *root);
/* Gives a process that was just started its weight, and a group where there is one. */
void share_groups_apply(const struct share_groups *groups, uint32_t worker, pid_t pid, uint32_t weight);
/* Removes the group of a worker that has ended. */
void share_groups_end(const struct share_groups *groups, uint32_t worker);

#endif
