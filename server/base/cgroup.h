/* SPDX-License-Identifier: MIT */
/* Memory limits of control groups, of both versions of Linux's interface (Documentation/admin-guide/cgroup-v2.rst,
 * cgroup-v1/memory.rst). Any thread. */
#ifndef FARLIGHT_BASE_CGROUP_H
#define FARLIGHT_BASE_CGROUP_H

#include <stdint.h>

/* Minimum of the limits of the groups that a file names, and of their ancestors; UINT64_MAX: no limit.
 * `groups_file`: /proc/self/cgroup, for example; `root`: the mount of the groups, /sys/fs/cgroup for example. A
 * limit above which the kernel only slows a process (memory.high) counts as well. */
uint64_t cgroup_memory_limit_bytes(const char *groups_file, const char *root);

#endif
