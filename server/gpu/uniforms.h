/* SPDX-License-Identifier: MIT */
/* The values that a pass gives to its program: one block of memory for each pass, and no look-up by the driver.
 *
 * Each module declares what it needs, `uniform uint first_ray;`. All that the stages of a program declare is taken
 * out of their texts and declared again at their top, as one std140 block, which is what glslang does for Vulkan
 * (GL_EXT_vulkan_glsl_relaxed). The offsets follow from the text; the driver is asked nothing. Setters write to a
 * copy on the host; a pass whose copy changed has it written to a range of a buffer that no pass before it reads,
 * so nothing waits. A declaration has a line of its own; an `#if` around it has no effect. */
#ifndef FARLIGHT_GPU_UNIFORMS_H
#define FARLIGHT_GPU_UNIFORMS_H

#include "base/error.h"
#include "gpu/device.h"
#include "gpu/program_source.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define GPU_UNIFORMS_BINDING 2 /* lower ones are those of blocks that shaders write out */

struct gpu_uniforms;

struct gpu_uniforms *gpu_uniforms_create(void);           /* NULL: out of memory */
void gpu_uniforms_destroy(struct gpu_uniforms *uniforms); /* accepts NULL */
/* Takes the declarations out of the text. The size of an array is a number or one of the defines. */
bool gpu_uniforms_take(struct gpu_uniforms *uniforms, struct gpu_source_text *text,
                       const struct gpu_define *defines, struct error *error);
/* Puts the block of all that was taken in front of the text's first file. `software`: of a compute shader for
 * software GL; if it asks for UNIFORMS_AT_START, that is defined, and main() begins with copies of all uniforms
 * but arrays. llvmpipe reads a uniform once for all invocations of a group only outside of branches: in one, and
 * behind an early return, once for each. */
bool gpu_uniforms_put(const struct gpu_uniforms *uniforms, struct gpu_source_text *text, bool software,
                      struct error *error);
/* Where a value lies in the block, false: there is none of that name ("lights[1]" of an array). */
bool gpu_uniforms_find(const struct gpu_uniforms *uniforms, const char *name, uint32_t *offset_bytes);

/* The buffer of which passes get ranges; false: out of memory. */
bool gpu_uniforms_start(struct gpu_device *device);
/* Binds the values for the dispatches and draws that follow. */
void gpu_uniforms_bind(struct gpu_device *device, struct gpu_uniforms *uniforms);

#endif
