/* SPDX-License-Identifier: MIT */
/* Uniforms of programs: one block of memory for each pass, without look-ups by the driver.
 *
 * Each module declares what it needs, `uniform uint first_ray;`. The declarations of all stages of a program are
 * removed from their texts and declared again at their top, as one std140 block, which is what glslang does for
 * Vulkan (GL_EXT_vulkan_glsl_relaxed). The offsets follow from the text; the driver is not asked. Setters write to
 * a copy on the host; if the copy has changed, a pass writes it to a range of a buffer that no earlier pass reads,
 * so nothing waits. A declaration has a line of its own; an `#if` around it has no effect. */
#ifndef FARLIGHT_GPU_UNIFORMS_H
#define FARLIGHT_GPU_UNIFORMS_H

#include "base/error.h"
#include "gpu/device.h"
#include "gpu/program_source.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define GPU_UNIFORMS_BINDING 2 /* lower ones are blocks that shaders declare themselves */

struct gpu_uniforms;

struct gpu_uniforms *gpu_uniforms_create(void);           /* NULL: out of memory */
void gpu_uniforms_destroy(struct gpu_uniforms *uniforms); /* accepts NULL */
/* Removes the declarations from the text. The size of an array is a number or one of the defines. */
bool gpu_uniforms_take(struct gpu_uniforms *uniforms, struct gpu_source_text *text,
                       const struct gpu_define *defines, struct error *error);
/* Inserts the block of all removed declarations before the text's first file. `software`: for a compute shader
 * in software GL; if it asks for UNIFORMS_AT_START, that is defined, and main() begins with copies of all
 * uniforms except arrays. llvmpipe reads a uniform once for all invocations of a group only outside of
 * branches: inside one, and after an early return, once for each. */
bool gpu_uniforms_put(const struct gpu_uniforms *uniforms, struct gpu_source_text *text, bool software,
                      struct error *error);
/* Finds the place of a value in the block. False: no value has that name ("lights[1]" in an array). */
bool gpu_uniforms_find(const struct gpu_uniforms *uniforms, const char *name, uint32_t *offset_bytes);

/* Creates the buffer of which passes get ranges. False: out of memory. */
bool gpu_uniforms_start(struct gpu_device *device);
/* Binds the values for the following dispatches and draws. */
void gpu_uniforms_bind(struct gpu_device *device, struct gpu_uniforms *uniforms);

#endif
