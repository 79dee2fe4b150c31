/* SPDX-License-Identifier: MIT */
/* Progress of long uninterrupted work, such as the build of a tree over a hundred million triangles: a watchdog
 * can distinguish such a thread from one that hangs in a driver. */
#ifndef FARLIGHT_BASE_PROGRESS_H
#define FARLIGHT_BASE_PROGRESS_H

#include <stdint.h>

/* Reports progress. Call it from time to time, on any thread. */
void progress_report(void);
/* Number of reports so far, by all threads of the process. */
uint64_t progress_reports(void);

#endif
