/* SPDX-License-Identifier: MIT */
/* Options of jemalloc. Software GL allocates memory for each buffer, and each frame allocates its pixels: large
 * blocks, repeatedly. Freed memory keeps its pages for ten seconds (jemalloc's default, here for the largest
 * blocks too) for whichever thread allocates next (one arena). New memory comes in huge pages, as small ones cost
 * 3 to 30 times as much. */
#include "base/allocator.h"

#include <jemalloc/jemalloc.h>

/* Options that jemalloc reads at its start, by this name, which -fvisibility=hidden would hide. */
__attribute__((visibility("default"))) const char *malloc_conf = "thp:always,oversize_threshold:0,narenas:1";

/* NULL if the sanitizers are linked instead of jemalloc. */
#pragma weak mallctl

/* Sets the options of the first arena, which jemalloc makes before it reads them: it would return large blocks
 * to the kernel at once. */
__attribute__((constructor)) static void keep_large_blocks(void)
{
    size_t never = (size_t)1 << 50;
    if (mallctl)
        mallctl("arena.0.oversize_threshold", NULL, NULL, &never, sizeof(never));
}

void allocator_start_thread(void)
{
    bool yes = true;
    if (mallctl)
        mallctl("background_thread", NULL, NULL, &yes, sizeof(yes));
}
