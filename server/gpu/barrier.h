/* SPDX-License-Identifier: MIT */
/* What shaders write is seen by a later command, and what they read is safe from it, only behind a barrier that
 * names the kind of that command's access.
 *
 * The command that reads, overwrites or copies issues the barrier: a pass waits for the kinds of access that the
 * text of its program declares, gpu/buffer.h for its own, and no command waits twice for the same passes. So no
 * caller states what it waits for, and none can forget to. Shaders write buffers only, never textures, and what
 * commands other than shaders write needs no barrier. */
#ifndef FARLIGHT_GPU_BARRIER_H
#define FARLIGHT_GPU_BARRIER_H

#include "base/error.h"
#include "gpu/device.h"
#include "gpu/program.h"

/* Adds the GL_*_BARRIER_BITs of what a stage's text declares on lines that begin with `layout(`. What stands in a
 * branch of #if counts, too: one kind too many costs little. */
void gpu_accesses_add(struct gpu_program *program, const char *text);
/* Whether they are all that the driver sees in the program, and whether all values lie in its block. For devices
 * for debugging. */
bool gpu_accesses_check(const struct gpu_program *program, struct error *error);

/* Before a command that accesses buffers in these ways. */
void gpu_await(struct gpu_device *device, unsigned accesses);
/* Before a dispatch or draw, which accesses them in these ways beside those of its program. */
void gpu_await_pass(struct gpu_device *device, const struct gpu_program *program, unsigned accesses);

/* The passes between need not wait for one another: none reads or overwrites what another one writes, except by
 * atomic operations whose order does not matter. */
void gpu_together_begin(struct gpu_device *device);
void gpu_together_end(struct gpu_device *device);

#endif
