/* SPDX-License-Identifier: MIT */
/* Memory limits of control groups, of both versions of Linux's interface (Documentation/admin-guide/cgroup-v2.rst,
 * cgroup-v1/memory.rst). Any thread. */
#ifndef FARLIGHT_BASE_CGROUP_H
#define FARLIGHT_BASE_CGROUP_H

#include <stdint.h>

/* The lowest limit of the groups that a file names, and of the groups above them; UINT64_MAX: there is none.
 * `groups_file`: as /proc/self/cgroup; `root`: where the groups are mounted, as /sys/fs/cgroup. A limit below
 * which the kernel only slows a process (memory.high) counts as well. */
uint64_t cgroup_memory_limit_bytes(const char *groups_file, const char *root);

#endif
