/* SPDX-License-Identifier: MIT */
/* The driver's messages, and the names of the passes they belong to. */
#ifndef FARLIGHT_GPU_DEBUG_H
#define FARLIGHT_GPU_DEBUG_H

/* Sends the current context's debug messages to the log, with the name of the current group. */
void gpu_debug_start(void);

#endif
