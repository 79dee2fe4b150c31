/* SPDX-License-Identifier: MIT */
/* Expands files of shaders/ to a single GLSL text. Knows no GL. */
#ifndef FARLIGHT_GPU_PROGRAM_SOURCE_H
#define FARLIGHT_GPU_PROGRAM_SOURCE_H

#include "base/error.h"
#include "gpu/program.h"

#include <stdbool.h>
#include <stddef.h>

#define GPU_SOURCE_FILES_MAX 64

struct gpu_source_text {
    char *text; /* NUL-terminated; owned */
    size_t length;
    size_t capacity;
    const char *files[GPU_SOURCE_FILES_MAX]; /* by their numbers in `#line` */
    unsigned file_count;
};

/* Finds a file by its path below shaders/. False: it does not exist. The kept path must outlive the text. */
typedef bool (*gpu_source_lookup)(const char *path, size_t path_length, const char **kept_path, const char **begin,
                                  const char **end);
/* Finds files that are compiled into the binary. */
bool gpu_source_lookup_embedded(const char *path, size_t path_length, const char **kept_path, const char **begin,
                                const char **end);

/* Beginning of every program. Without it NVIDIA's compiler (driver 580) drops terms of sums of products, and
 * evaluates comparisons with NaN arbitrarily; frames and traversals measured on an H100 took no longer with it.
 * Other compilers ignore these pragmas. */
#define GPU_SOURCE_HEAD "#version 450 core\n#pragma optionNV(fastmath off)\n#pragma optionNV(fastprecision off)\n"

/* Makes the text: that beginning, the defines, then the file with everything that it includes. */
bool gpu_source_expand(struct gpu_source_text *text, gpu_source_lookup lookup, const char *path,
                       const struct gpu_define *defines, struct error *error);
/* Inserts bytes; later lines keep their numbers if a #line comes between. */
bool gpu_source_insert(struct gpu_source_text *text, size_t offset, const char *bytes, size_t length,
                       struct error *error);
void gpu_source_finish(struct gpu_source_text *text);
/* Replaces file numbers at the start of lines in a driver's log ("3:17(5): error", "3(17) : error") by names;
 * truncates at `size`. */
void gpu_source_name_files(const struct gpu_source_text *text, const char *log, char *out, size_t size);

#endif
