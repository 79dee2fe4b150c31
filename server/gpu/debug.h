/* SPDX-License-Identifier: MIT */
/* Log of the driver's messages, with the names of the passes that cause them. */
#ifndef FARLIGHT_GPU_DEBUG_H
#define FARLIGHT_GPU_DEBUG_H

/* Sends the current context's debug messages to the log, with the name of the current group. */
void gpu_debug_start(void);

#endif
