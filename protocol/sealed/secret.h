/* SPDX-License-Identifier: MIT */
/* Memory for keys: locked, so that it is never written to swap, left out of dumps, and wiped when it is freed. */
#ifndef FARLIGHT_PROTOCOL_SEALED_SECRET_H
#define FARLIGHT_PROTOCOL_SEALED_SECRET_H

#include <stdbool.h>
#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Zeros. The process cannot be dumped or traced by its user any more (PR_SET_DUMPABLE): registers and stacks hold
 * parts of keys, too. NULL: no memory, or no random numbers. */
void *secret_create(size_t bytes);
void secret_destroy(void *secret); /* accepts NULL */
/* Whether the memory could be locked; RLIMIT_MEMLOCK may forbid it, which is no error. */
bool secret_is_locked(void *secret, size_t bytes);

#ifdef __cplusplus
}
#endif
#endif
