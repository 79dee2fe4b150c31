/* SPDX-License-Identifier: MIT */
/* Memory that is released all at once. Not thread-safe. */
#ifndef FARLIGHT_BASE_ARENA_H
#define FARLIGHT_BASE_ARENA_H

#include <stddef.h>

struct arena {
    struct arena_block *blocks; /* newest first */
    size_t used_bytes;
    size_t limit_bytes; /* 0: none */
};

void arena_init(struct arena *arena, size_t limit_bytes);
void arena_finish(struct arena *arena);
void arena_reset(struct arena *arena); /* keeps one block for the next round */
/* Zeroed, 16-aligned; NULL when over the limit or out of memory. */
void *arena_alloc(struct arena *arena, size_t count, size_t size_bytes);
char *arena_strdup(struct arena *arena, const char *text);

#endif
