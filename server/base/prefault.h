/* SPDX-License-Identifier: MIT */
/* Memory that the kernel gives for the first time costs a fault a page, of which a gigabyte may take seconds. A
 * thread has it from the kernel and frees it, and from what was freed (allocator.c) the block that was meant is
 * taken without faults. It saves time, and nothing depends on it: without a thread, or another allocator's, all
 * goes on as without it. From one thread. */
#ifndef FARLIGHT_BASE_PREFAULT_H
#define FARLIGHT_BASE_PREFAULT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Less takes no time worth a wait, and more would hold too much of the host's memory. */
#define PREFAULT_BYTES_MIN ((size_t)1 << 20)
#define PREFAULT_BYTES_MAX ((size_t)512 << 20)

struct prefault;

struct prefault *prefault_create(void);           /* NULL: no memory */
void prefault_destroy(struct prefault *prefault); /* accepts NULL */
/* Whether a block of that many bytes may be allocated now, which the caller then does at once. Otherwise the
 * thread is at it; it is waited for until `until_ns` of the clock. Small blocks come before large ones. */
bool prefault_is_ready(struct prefault *prefault, size_t bytes, uint64_t until_ns);
/* Whether the thread is still at it. */
bool prefault_goes_on(struct prefault *prefault, size_t bytes);

#endif
