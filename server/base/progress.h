/* SPDX-License-Identifier: MIT */
/* Signs of life from work that takes long without looking up, as to build a tree over a hundred million triangles:
 * whoever watches a thread that is at it can tell it from one that hangs in a driver. */
#ifndef FARLIGHT_BASE_PROGRESS_H
#define FARLIGHT_BASE_PROGRESS_H

#include <stdint.h>

/* On any thread, once in a while: a part of such work is done. */
void progress_tell(void);
/* How often it was told, by all threads of the process. */
uint64_t progress_told(void);

#endif
