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
/* The thread of the device calls these three. A program is known by its files and defines, as program.c writes
 * them. */
bool gpu_ahead_knows(struct gpu_ahead *ahead, const char *key); /* or cannot be had */
void gpu_ahead_add(struct gpu_ahead *ahead, const char *key,
                   struct gpu_build *build);    /* takes what is in *build */
size_t gpu_ahead_left(struct gpu_ahead *ahead); /* added and not taken */
/* What was added, after a wait if it has begun. The caller owns both; the binary is empty if it was not compiled:
 * it had not begun, or failed. False: it was not added. */
bool gpu_ahead_take(struct gpu_ahead *ahead, const char *key, struct gpu_build *build, struct gpu_binary *binary);

#endif
