/* SPDX-License-Identifier: MIT */
/* The process' allocator: jemalloc, but the sanitizers' own where they are linked. */
#ifndef FARLIGHT_BASE_ALLOCATOR_H
#define FARLIGHT_BASE_ALLOCATOR_H

#include <stdbool.h>

/* Whether freed memory keeps its pages for the next allocation. False with the sanitizers. */
bool allocator_keeps_pages(void);

#endif
