/* SPDX-License-Identifier: MIT */
/* The allocator of the daemon is jemalloc; its options are in allocator.c. */
#ifndef FARLIGHT_BASE_ALLOCATOR_H
#define FARLIGHT_BASE_ALLOCATOR_H

/* Starts a thread that returns unused pages to the kernel, even while the process is idle. Does nothing if the
 * sanitizers are linked instead of jemalloc. */
void allocator_start_thread(void);

#endif
