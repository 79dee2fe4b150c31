/* SPDX-License-Identifier: MIT */
/* Memory prefaulted by up to two background threads. Each page that the kernel gives for the first time costs a
 * fault, and a gigabyte of them may take seconds. They allocate and fill a block; the caller's own allocation of
 * that size then takes the same pages, since the allocator keeps them (allocator.h). Correctness does not depend
 * on it: without them the caller has the faults itself. Call it from one thread. */
#ifndef FARLIGHT_BASE_PREFAULT_H
#define FARLIGHT_BASE_PREFAULT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Smaller blocks are not worth a wait; larger ones would hold too much of the host's memory. */
#define PREFAULT_BYTES_MIN ((size_t)1 << 20)
#define PREFAULT_BYTES_MAX ((size_t)512 << 20)

struct prefault;

struct prefault *prefault_create(void);           /* NULL: no memory */
void prefault_destroy(struct prefault *prefault); /* accepts NULL */
/* Waits until the block is prefaulted, at most until `until_ns` of the clock. True: the caller may allocate that
 * many bytes now, and should do so at once. False: the thread goes on with the block; call again. Small blocks
 * come before large ones. */
bool prefault_is_ready(struct prefault *prefault, size_t bytes, uint64_t until_ns);
/* Whether the thread still has such a block to finish. */
bool prefault_goes_on(struct prefault *prefault, size_t bytes);

#endif
