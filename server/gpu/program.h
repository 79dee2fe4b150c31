/* SPDX-License-Identifier: MIT */
/* Shader programs from the sources in shaders/, which are compiled into the binary.
 *
 * `#include "common/math.glsl"` is resolved from the root of shaders/, each file once per program, with
 * #line so that the driver's messages name file and line. A `#version 450 core` line and the defines are put in
 * front. Programs are cached by (files, defines) for the life of the device, and their binaries on the disk where
 * the driver has binaries (gpu/binary_cache.h).
 *
 * `#include NAME` takes the path from the define of that name, whose value is then a path in double quotes; GLSL
 * does not see such a define. The define EXTENSION names an extension of GLSL that the program requires, and
 * PRAGMA is a pragma for the compilers that know it. A file that is included again is skipped, so an `#include`
 * must not be in a branch of #if that is sometimes off. */
#ifndef FARLIGHT_GPU_PROGRAM_H
#define FARLIGHT_GPU_PROGRAM_H

#include "base/error.h"
#include "gpu/buffer.h"
#include "gpu/device.h"

struct gpu_define {
    const char *name, *value;
};

struct gpu_program_source {
    const char *compute;                      /* "render/resolve.comp"; or: */
    const char *vertex, *geometry, *fragment; /* geometry may be NULL; fragment NULL: depth only */
    const struct gpu_define *defines;         /* ends with {0} ; may be NULL */
};

struct gpu_program {
    unsigned name;                 /* GL program */
    uint32_t group_size;           /* compute: local_size_x * y * z */
    struct gpu_uniforms *uniforms; /* values, see gpu/uniforms.h */
    unsigned accesses;             /* accesses to buffers, see gpu/barrier.h; 0: any */
};

/* Gets the cached program, or compiles it. The device owns it. NULL and *error with the compiler's log. */
const struct gpu_program *gpu_program_get(struct gpu_device *device, const struct gpu_program_source *source,
                                          struct error *error);

/* Begins announcements, or ends them with NULL. In between, gpu_program_get() only announces a program: it
 * returns NULL without an error, and threads compile the program if the device does not have it
 * (gpu/program_ahead.h). A later gpu_program_get() returns it. Announce programs in the order of their need,
 * and only those that will be needed. The formats must live as long as the device. */
void gpu_program_announce(struct gpu_device *device, const struct gpu_texel_formats *formats);

/* A program of the device, for the device check. */
struct gpu_program_stat {
    const char *key;   /* files and defines, each followed by ';'; lives as long as the device */
    unsigned name;     /* GL program */
    uint64_t build_ns; /* from the sources, or from the disk */
    bool compiled;     /* from the sources, here or ahead */
};
/* Lists the programs used so far, the newest first. False: there are no more. */
bool gpu_program_stat(const struct gpu_device *device, size_t index, struct gpu_program_stat *stat);

/* Set uniforms by name, "name[1]" in an array, for the next dispatch or gpu_program_use(). Values stay until
 * they are set again and are zero at first. A name that the program does not have is ignored; one of another
 * type makes gpu_check() fail. */
void gpu_uniform_uint(const struct gpu_program *program, const char *name, uint32_t value);
void gpu_uniform_int(const struct gpu_program *program, const char *name, int32_t value);
void gpu_uniform_float(const struct gpu_program *program, const char *name, float value);
void gpu_uniform_vec(const struct gpu_program *program, const char *name, unsigned components, const float *value);

/* Makes the program and its values current before a draw; a dispatch does it itself. */
void gpu_program_use(struct gpu_device *device, const struct gpu_program *program);

/* Dispatches ceil(items / local size) groups along x, after the passes whose output it may access. More than
 * facts.work_groups_max groups are spread over y; the shader finds its item with `item_index()` of
 * common/dispatch.glsl. */
void gpu_dispatch(struct gpu_device *device, const struct gpu_program *program, uint64_t items);
/* Dispatches the numbers of groups along x, y and z that the device has written there: three u32. */
void gpu_dispatch_indirect(const struct gpu_program *program, const struct gpu_buffer *groups,
                           size_t offset_bytes);

#endif
