/* SPDX-License-Identifier: MIT */
/* From the files of shaders/ to one GLSL text. Knows no GL. */
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
    const char *files[GPU_SOURCE_FILES_MAX]; /* by the number that `#line` gives */
    unsigned file_count;
};

/* Finds a file by its path below shaders/; false: it does not exist. The path that is kept must outlive the text.
 */
typedef bool (*gpu_source_lookup)(const char *path, size_t path_length, const char **kept_path, const char **begin,
                                  const char **end);
/* The files that are compiled into the binary. */
bool gpu_source_lookup_embedded(const char *path, size_t path_length, const char **kept_path, const char **begin,
                                const char **end);

/* What each program begins with. NVIDIA's compiler (driver 580) otherwise drops terms of sums of products, and
 * takes a comparison with NaN for true or false as it likes; frames and traversals measured on an H100 took no
 * longer without that. Other compilers ignore these pragmas. */
#define GPU_SOURCE_HEAD "#version 450 core\n#pragma optionNV(fastmath off)\n#pragma optionNV(fastprecision off)\n"

/* That head, the defines, then the file with everything that it includes. */
bool gpu_source_expand(struct gpu_source_text *text, gpu_source_lookup lookup, const char *path,
                       const struct gpu_define *defines, struct error *error);
/* Lines behind it keep their numbers where a #line stands between. */
bool gpu_source_insert(struct gpu_source_text *text, size_t offset, const char *bytes, size_t length,
                       struct error *error);
void gpu_source_finish(struct gpu_source_text *text);
/* A driver's log with the file numbers at the start of lines ("3:17(5): error", "3(17) : error") turned into
 * names; cut off where `size` ends. */
void gpu_source_name_files(const struct gpu_source_text *text, const char *log, char *out, size_t size);

#endif
