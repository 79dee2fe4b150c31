/* SPDX-License-Identifier: MIT */
/* Programs that are compiled ahead of their first use, by threads with GL contexts of their own on the device's
 * display. They share no objects with it: a thread hands over the binary, which the device's thread loads as it
 * loads one from the disk. So whatever befalls a thread's context, the device's stays as it is.
 *
 * The threads and their contexts are there only while something is to be compiled. Without contexts or binaries
 * nothing is done ahead. */
#ifndef FARLIGHT_GPU_PROGRAM_AHEAD_H
#define FARLIGHT_GPU_PROGRAM_AHEAD_H

#include "gpu/binary_cache.h"
#include "gpu/program_build.h"

#include <stdbool.h>
#include <stddef.h>

struct gpu_ahead;

struct gpu_ahead *gpu_ahead_create(const struct gpu_device *device); /* NULL: out of memory */
/* Waits for what is being compiled and drops the rest. Accepts NULL. */
void gpu_ahead_destroy(struct gpu_ahead *ahead);

/* The thread of the device calls the rest. The key of a program is its files and defines, as program.c writes
 * them. */

/* Whether there is nothing to add: the program was added already, or no context can be made. */
bool gpu_ahead_knows(struct gpu_ahead *ahead, const char *key);
/* Takes what is in *build. False for `compiles`: its texts are kept until the program is taken, no more, as its
 * binary is on the disk. */
void gpu_ahead_add(struct gpu_ahead *ahead, const char *key, struct gpu_build *build, bool compiles);
/* How many programs were added and not taken. */
size_t gpu_ahead_left(struct gpu_ahead *ahead);
/* Takes a program that was added; waits if a thread is compiling it. The caller owns *build and *binary. The
 * binary is empty if compiling failed or had not begun. False: the program was not added. */
bool gpu_ahead_take(struct gpu_ahead *ahead, const char *key, struct gpu_build *build, struct gpu_binary *binary);

#endif
