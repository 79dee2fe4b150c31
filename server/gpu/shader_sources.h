/* SPDX-License-Identifier: MIT */
/* Files of shaders/, compiled into the binary by shaders/embed.sh. */
#ifndef FARLIGHT_GPU_SHADER_SOURCES_H
#define FARLIGHT_GPU_SHADER_SOURCES_H

struct shader_source {
    const char *path;        /* below shaders/ */
    const char *begin, *end; /* text; a NUL follows */
};
extern const struct shader_source shader_sources[];
extern const unsigned shader_source_count;

#endif
