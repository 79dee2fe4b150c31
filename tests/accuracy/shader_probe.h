/* SPDX-License-Identifier: MIT */
/* A compute shader that a test brings along, with what it includes taken from those that are embedded. */
#ifndef FARLIGHT_TESTS_SHADER_PROBE_H
#define FARLIGHT_TESTS_SHADER_PROBE_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "gpu/program.h"
#include "gpu/program_source.h"

#include <epoxy/gl.h>
#include <string.h>

#define SHADER_PROBE_NAME "probe.comp"
static const char *shader_probe_text; /* of the one that is compiled */

static inline bool shader_probe_lookup(const char *path, size_t length, const char **kept, const char **begin,
                                       const char **end)
{
    static const char own[] = SHADER_PROBE_NAME;
    if (length != strlen(own) || memcmp(path, own, length) != 0)
        return gpu_source_lookup_embedded(path, length, kept, begin, end);
    *kept = own;
    *begin = shader_probe_text;
    *end = shader_probe_text + strlen(shader_probe_text);
    return true;
}

/* `defines` ends with {0}, or is NULL. Deleted by glDeleteProgram(). */
static inline struct gpu_program shader_probe_compile(const char *text, const struct gpu_define *defines)
{
    struct error error = {0};
    struct gpu_source_text whole = {0};
    shader_probe_text = text;
    if (!gpu_source_expand(&whole, shader_probe_lookup, SHADER_PROBE_NAME, defines, &error))
        fail_msg("%s", error.text);
    const GLchar *source = whole.text;
    const struct gpu_program program = {glCreateShaderProgramv(GL_COMPUTE_SHADER, 1, &source), 1024};
    GLint linked = GL_FALSE;
    glGetProgramiv(program.name, GL_LINK_STATUS, &linked);
    if (!linked) {
        char log[2048] = "", named[4096] = "";
        glGetProgramInfoLog(program.name, sizeof(log), NULL, log);
        gpu_source_name_files(&whole, log, named, sizeof(named));
        fail_msg("%s", named);
    }
    gpu_source_finish(&whole);
    return program;
}

#endif
