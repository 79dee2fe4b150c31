/* SPDX-License-Identifier: MIT */
/* How the process has its memory from the kernel, by jemalloc. Software GL takes memory for each buffer, and a
 * frame for its pixels: large blocks, again and again. What was freed stays for ten seconds (jemalloc's default,
 * here for the largest blocks as well) for whichever thread comes next (one arena), and fresh memory comes in huge
 * pages: in small ones it costs 3 to 30 times as much. What nobody wants is given back by a thread beside. */
#include <stddef.h>

/* Read by jemalloc when it starts, by this name, which -fvisibility=hidden would hide. */
__attribute__((visibility("default"))) const char *malloc_conf =
    "thp:always,oversize_threshold:0,narenas:1,background_thread:true";

/* NULL where the sanitizers have an allocator of their own. */
extern int mallctl(const char *name, void *old, size_t *old_bytes, void *new, size_t new_bytes)
    __attribute__((weak));

/* The first arena is made before jemalloc has read its options, and would give large blocks back at once. */
__attribute__((constructor)) static void keep_large_blocks(void)
{
    size_t never = (size_t)1 << 50;
    if (mallctl)
        mallctl("arena.0.oversize_threshold", NULL, NULL, &never, sizeof(never));
}
