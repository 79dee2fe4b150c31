/* SPDX-License-Identifier: MIT */
/* Memory for keys: locked, so that it is never swapped out; excluded from dumps; wiped when freed. */
#ifndef FARLIGHT_PROTOCOL_SEALED_SECRET_H
#define FARLIGHT_PROTOCOL_SEALED_SECRET_H

#include <stdbool.h>
#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Allocates zeroed memory, and makes the process undumpable and untraceable for its user (PR_SET_DUMPABLE), as
 * registers and stacks hold parts of keys, too. NULL: out of memory, or no random numbers. */
void *secret_create(size_t bytes);
void secret_destroy(void *secret); /* accepts NULL */
/* True if the memory is locked; RLIMIT_MEMLOCK may forbid it, which is no error. */
bool secret_is_locked(void *secret, size_t bytes);

#ifdef __cplusplus
}
#endif
#endif
