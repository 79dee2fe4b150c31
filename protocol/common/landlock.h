/* SPDX-License-Identifier: MIT */
/* Landlock (landlock(7)), for the sandboxes of the daemon's workers and of helper programs. A ruleset binds the
 * calling thread and those that it starts. The process must have no other: an unbound thread shares the memory,
 * and could act for a bound one. Cannot be undone. */
#ifndef FARLIGHT_PROTOCOL_COMMON_LANDLOCK_H
#define FARLIGHT_PROTOCOL_COMMON_LANDLOCK_H

#include <linux/landlock.h>
#include <stdbool.h>
#include <stdint.h>

/* Headers of some supported distributions lack these. */
#ifndef LANDLOCK_ACCESS_FS_TRUNCATE
#define LANDLOCK_ACCESS_FS_TRUNCATE (1ULL << 14)
#endif
#ifndef LANDLOCK_ACCESS_FS_IOCTL_DEV
#define LANDLOCK_ACCESS_FS_IOCTL_DEV (1ULL << 15)
#endif

/* Number of threads of this process; 0: unknown, errno says why. */
unsigned landlock_thread_count(void);
/* Creates a ruleset that denies what this kernel's Landlock can: files, TCP, signals and abstract Unix sockets
 * beyond the process. Returns its descriptor; -1 with *file_rights 0: the kernel has no Landlock; -1 otherwise:
 * errno. */
int landlock_create(uint64_t *file_rights);
/* Grants access to an open file, or to a folder and everything below it. */
bool landlock_allow(int ruleset, int fd, uint64_t rights);
/* Enforces the ruleset for this thread, which must not be able to gain privileges. */
bool landlock_enforce(int ruleset);

#endif
