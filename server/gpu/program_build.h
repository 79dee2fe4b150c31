/* SPDX-License-Identifier: MIT */
/* Builds a program from its sources. The device's thread makes the texts; another thread may compile and link
 * them, in a context of its own. */
#ifndef FARLIGHT_GPU_PROGRAM_BUILD_H
#define FARLIGHT_GPU_PROGRAM_BUILD_H

#include "base/error.h"
#include "gpu/binary_cache.h"
#include "gpu/program.h"
#include "gpu/program_source.h"

#include <stdbool.h>

#define GPU_STAGES_MAX 3

struct gpu_stage {
    unsigned type; /* GL_COMPUTE_SHADER .. */
    const char *path;
    struct gpu_source_text text;
    unsigned shader;
};

struct gpu_build {
    struct gpu_stage stages[GPU_STAGES_MAX];
    unsigned stage_count;
    struct gpu_program program; /* without its name and the size of its groups */
    struct gpu_binary_key key;
};

/* Makes the texts, the uniforms and the key. On failure nothing is kept. */
bool gpu_build_prepare(struct gpu_build *build, const struct gpu_device *device,
                       const struct gpu_program_source *source, struct error *error);
/* Compiles and links in the current context without asking for a result, which would wait. */
void gpu_build_start(struct gpu_build *build, unsigned program);
/* Waits for the result. False: *error has the compiler's log. */
bool gpu_build_end(struct gpu_build *build, unsigned program, struct error *error);
/* Gets the binary of a linked program. False: the driver supports none. */
bool gpu_build_binary(struct gpu_binary *binary, unsigned program);
void gpu_build_finish(struct gpu_build *build); /* accepts zeros */

#endif
