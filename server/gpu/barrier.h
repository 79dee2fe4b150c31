/* SPDX-License-Identifier: MIT */
/* Memory barriers. A later command sees the output of shaders, and leaves their input intact, only after a barrier
 * that names the kind of that command's access.
 *
 * The command that reads, overwrites or copies issues the barrier: a pass waits for the kinds of access that the
 * text of its program declares, gpu/buffer.h for its own, and no command waits twice for the same passes. So no
 * caller states its barriers, and none can forget them. Shaders write buffers only, never textures, and the output
 * of other commands needs no barrier. */
#ifndef FARLIGHT_GPU_BARRIER_H
#define FARLIGHT_GPU_BARRIER_H

#include "base/error.h"
#include "gpu/device.h"
#include "gpu/program.h"

/* Adds the GL_*_BARRIER_BITs of resources that a stage's text declares on lines that begin with `layout(`.
 * Lines in a branch of #if count, too: an unnecessary kind costs little. */
void gpu_accesses_add(struct gpu_program *program, const char *text);
/* Whether the driver finds only these accesses in the program, and all values in its block. For debug devices. */
bool gpu_accesses_check(const struct gpu_program *program, struct error *error);

/* Issues the barriers that a command needs which accesses buffers in these ways. */
void gpu_await(struct gpu_device *device, unsigned accesses);
/* Issues the barriers of a dispatch or draw, which accesses them in these ways in addition to those of its
 * program. */
void gpu_await_pass(struct gpu_device *device, const struct gpu_program *program, unsigned accesses);

/* Brackets passes that need not wait for one another: none reads or overwrites another one's output, except by
 * atomic operations whose order does not matter. */
void gpu_together_begin(struct gpu_device *device);
void gpu_together_end(struct gpu_device *device);

#endif
