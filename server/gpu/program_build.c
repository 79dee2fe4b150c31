/* SPDX-License-Identifier: MIT */
/* Texts of a program's stages, and its compilation. */
#include "gpu/program_build.h"

#include "base/progress.h"
#include "gpu/barrier.h"
#include "gpu/uniforms.h"

#include <epoxy/gl.h>
#include <stdlib.h>
#include <string.h>
#include <xxhash.h>

static void list_stages(struct gpu_build *build, const struct gpu_program_source *source)
{
    const struct gpu_stage all[] = {
        {.type = GL_COMPUTE_SHADER, .path = source->compute},
        {.type = GL_VERTEX_SHADER, .path = source->vertex},
        {.type = GL_GEOMETRY_SHADER, .path = source->geometry},
        {.type = GL_FRAGMENT_SHADER, .path = source->fragment},
    };
    for (size_t i = 0; i < sizeof(all) / sizeof(all[0]) && build->stage_count < GPU_STAGES_MAX; i++)
        if (all[i].path)
            build->stages[build->stage_count++] = all[i];
}

static bool make_key(struct gpu_build *build, const struct gpu_device_info *info)
{
    XXH3_state_t *state = XXH3_createState();
    if (!state)
        return false;
    XXH3_128bits_reset(state);
    for (unsigned i = 0; i < build->stage_count; i++)
        XXH3_128bits_update(state, build->stages[i].text.text, build->stages[i].text.length + 1);
    XXH3_128bits_update(state, info->vendor, strlen(info->vendor) + 1);
    XXH3_128bits_update(state, info->name, strlen(info->name) + 1);
    XXH3_128bits_update(state, info->version, strlen(info->version) + 1);
    XXH128_hash_t hash = XXH3_128bits_digest(state);
    XXH3_freeState(state);
    build->key = (struct gpu_binary_key){hash.low64, hash.high64};
    return true;
}

bool gpu_build_prepare(struct gpu_build *build, const struct gpu_device *device,
                       const struct gpu_program_source *source, struct error *error)
{
    *build = (struct gpu_build){.program.uniforms = gpu_uniforms_create()};
    list_stages(build, source);
    bool ok = build->program.uniforms != NULL;
    for (unsigned i = 0; ok && i < build->stage_count; i++)
        ok = gpu_source_expand(&build->stages[i].text, gpu_source_lookup_embedded, build->stages[i].path,
                               source->defines, error) &&
             gpu_uniforms_take(build->program.uniforms, &build->stages[i].text, source->defines, error);
    for (unsigned i = 0; ok && i < build->stage_count; i++) {
        gpu_accesses_add(&build->program, build->stages[i].text.text);
        ok = gpu_uniforms_put(build->program.uniforms, &build->stages[i].text,
                              device->facts.software && build->stages[i].type == GL_COMPUTE_SHADER, error);
    }
    ok = ok && make_key(build, &device->info);
    if (!ok) {
        gpu_build_finish(build);
        /* The error stands unless an earlier one is set. */
        error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for a program");
    }
    return ok;
}

void gpu_build_start(struct gpu_build *build, unsigned program)
{
    glProgramParameteri(program, GL_PROGRAM_BINARY_RETRIEVABLE_HINT, GL_TRUE);
    for (unsigned i = 0; i < build->stage_count; i++) {
        struct gpu_stage *stage = &build->stages[i];
        const GLchar *text = stage->text.text;
        const GLint length = (GLint)stage->text.length;
        stage->shader = glCreateShader(stage->type);
        glShaderSource(stage->shader, 1, &text, &length);
        glCompileShader(stage->shader);
        glAttachShader(program, stage->shader);
    }
    glLinkProgram(program);
}

static bool stage_compiled(const struct gpu_stage *stage, struct error *error)
{
    char log[4096] = "", named[sizeof(error->text)];
    GLint compiled = GL_FALSE;
    glGetShaderiv(stage->shader, GL_COMPILE_STATUS, &compiled);
    if (compiled)
        return true;
    glGetShaderInfoLog(stage->shader, sizeof(log), NULL, log);
    gpu_source_name_files(&stage->text, log, named, sizeof(named));
    return error_set(error, ERROR_INTERNAL, stage->path, "%s", named);
}

bool gpu_build_end(struct gpu_build *build, unsigned program, struct error *error)
{
    GLint linked = GL_FALSE;
    bool compiled = true;
    glGetProgramiv(program, GL_LINK_STATUS, &linked);
    progress_report();
    for (unsigned i = 0; i < build->stage_count; i++) {
        struct gpu_stage *stage = &build->stages[i];
        compiled = linked || (compiled && stage_compiled(stage, error));
        glDetachShader(program, stage->shader);
        glDeleteShader(stage->shader);
        stage->shader = 0;
    }
    if (linked)
        return true;
    char log[sizeof(error->text)] = "";
    if (compiled)
        glGetProgramInfoLog(program, sizeof(log), NULL, log);
    return compiled && error_set(error, ERROR_INTERNAL, build->stages[0].path, "%s", log);
}

bool gpu_build_binary(struct gpu_binary *binary, unsigned program)
{
    GLint size_bytes = 0;
    GLsizei written = 0;
    GLenum format = 0;
    *binary = (struct gpu_binary){0};
    glGetProgramiv(program, GL_PROGRAM_BINARY_LENGTH, &size_bytes);
    binary->data = size_bytes > 0 ? malloc((size_t)size_bytes) : NULL;
    if (binary->data)
        glGetProgramBinary(program, size_bytes, &written, &format, binary->data);
    binary->format = format;
    binary->size_bytes = written > 0 ? (uint32_t)written : 0;
    if (glGetError() == GL_NO_ERROR && written > 0)
        return true;
    gpu_binary_finish(binary);
    return false;
}

void gpu_build_finish(struct gpu_build *build)
{
    for (unsigned i = 0; i < build->stage_count; i++)
        gpu_source_finish(&build->stages[i].text);
    gpu_uniforms_destroy(build->program.uniforms);
    *build = (struct gpu_build){0};
}
