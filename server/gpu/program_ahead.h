/* SPDX-License-Identifier: MIT */
/* Compiles programs before their first use, by threads with GL contexts of their own on the device's display.
 * These contexts share no objects with the device's: a thread hands over the binary, and the device's thread loads
 * it like one from the disk. So a failing context of a thread leaves the device's intact. The code that llvmpipe
 * makes for a program at its first dispatch passes through Mesa's own cache: see program_rehearse.h.
 *
 * The threads and their contexts exist only while there are programs to compile. Where the driver supports no
 * further contexts or no binaries, nothing is compiled ahead. */
#ifndef FARLIGHT_GPU_PROGRAM_AHEAD_H
#define FARLIGHT_GPU_PROGRAM_AHEAD_H

#include "gpu/binary_cache.h"
#include "gpu/program_build.h"

#include <stdbool.h>
#include <stddef.h>

struct gpu_ahead;

struct gpu_ahead *gpu_ahead_create(const struct gpu_device *device); /* NULL: out of memory */
/* Waits for programs being compiled and drops the rest. Accepts NULL. */
void gpu_ahead_destroy(struct gpu_ahead *ahead);

/* The device's thread calls the functions below. The key of a program is its files and defines, as program.c
 * writes them. */

/* Whether there is nothing to add: the program was added already, or no context can be made. */
bool gpu_ahead_knows(struct gpu_ahead *ahead, const char *key);
/* Adds a program and owns *build from then on. With `compiles` false only its texts are kept until the program
 * is taken, as its binary is on the disk. */
void gpu_ahead_add(struct gpu_ahead *ahead, const char *key, struct gpu_build *build, bool compiles);
/* Number of programs that were added and not taken. */
size_t gpu_ahead_left(struct gpu_ahead *ahead);
/* Takes a program that was added; waits if a thread is compiling it. The caller owns *build and *binary. The
 * binary is empty if compiling failed or had not begun. False: the program was not added. */
bool gpu_ahead_take(struct gpu_ahead *ahead, const char *key, struct gpu_build *build, struct gpu_binary *binary);

#endif
