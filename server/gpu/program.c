/* SPDX-License-Identifier: MIT */
#include "gpu/program.h"

#include "base/clock.h"
#include "base/log.h"
#include "base/progress.h"
#include "gpu/barrier.h"
#include "gpu/program_cache.h"
#include "gpu/program_source.h"
#include "gpu/registry.h"
#include "gpu/uniforms.h"
#include "gpu/watch.h"

#include <epoxy/gl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <xxhash.h>

#define STAGE_MAX 3
#define KEY_MAX 1024

struct cached_program {
    struct gpu_program program;
    struct cached_program *next;
    uint64_t build_ns;
    char key[]; /* files and defines */
};

struct gpu_program_cache {
    struct cached_program *first;
};

struct shader_stage {
    GLenum type;
    const char *path;
    struct gpu_source_text text;
    GLuint shader;
};

struct gpu_program_cache *gpu_program_cache_create(void)
{
    return calloc(1, sizeof(struct gpu_program_cache));
}

void gpu_program_cache_destroy(struct gpu_program_cache *cache)
{
    if (!cache)
        return;
    for (struct cached_program *next, *at = cache->first; at; at = next) {
        next = at->next;
        gpu_uniforms_destroy(at->program.uniforms);
        free(at);
    }
    free(cache);
}

/* One line for files and defines; false: longer than KEY_MAX. */
static bool make_key(char key[KEY_MAX], const struct gpu_program_source *source)
{
    const char *paths[] = {source->compute, source->vertex, source->geometry, source->fragment};
    size_t length = 0;
    for (size_t i = 0; i < sizeof(paths) / sizeof(paths[0]) && length < KEY_MAX; i++)
        length += (size_t)snprintf(key + length, KEY_MAX - length, "%s;", paths[i] ? paths[i] : "");
    for (const struct gpu_define *define = source->defines; define && define->name && length < KEY_MAX; define++)
        length += (size_t)snprintf(key + length, KEY_MAX - length, "%s=%s;", define->name,
                                   define->value ? define->value : "1");
    return length < KEY_MAX;
}

static unsigned list_stages(struct shader_stage stages[STAGE_MAX], const struct gpu_program_source *source)
{
    unsigned count = 0;
    if (source->compute)
        stages[count++] = (struct shader_stage){.type = GL_COMPUTE_SHADER, .path = source->compute};
    if (source->vertex)
        stages[count++] = (struct shader_stage){.type = GL_VERTEX_SHADER, .path = source->vertex};
    if (source->geometry && count < STAGE_MAX)
        stages[count++] = (struct shader_stage){.type = GL_GEOMETRY_SHADER, .path = source->geometry};
    if (source->fragment && count < STAGE_MAX)
        stages[count++] = (struct shader_stage){.type = GL_FRAGMENT_SHADER, .path = source->fragment};
    return count;
}

static bool compile(struct shader_stage *stage, struct error *error)
{
    char log[4096] = "", named[sizeof(((struct error *)0)->text)];
    const GLchar *text = stage->text.text;
    GLint length = (GLint)stage->text.length, compiled = GL_FALSE;
    stage->shader = glCreateShader(stage->type);
    glShaderSource(stage->shader, 1, &text, &length);
    glCompileShader(stage->shader);
    glGetShaderiv(stage->shader, GL_COMPILE_STATUS, &compiled);
    if (compiled)
        return true;
    gpu_note_loss(gpu_device_current(), error);
    glGetShaderInfoLog(stage->shader, sizeof(log), NULL, log);
    gpu_source_name_files(&stage->text, log, named, sizeof(named));
    return error_set(error, ERROR_INTERNAL, stage->path, "%s", named);
}

static bool link_program(GLuint program, struct shader_stage *stages, unsigned stage_count, struct error *error)
{
    for (unsigned i = 0; i < stage_count; i++) {
        if (!compile(&stages[i], error))
            return false;
        glAttachShader(program, stages[i].shader);
    }
    GLint linked = GL_FALSE;
    glLinkProgram(program);
    glGetProgramiv(program, GL_LINK_STATUS, &linked);
    progress_tell();
    for (unsigned i = 0; i < stage_count; i++)
        glDetachShader(program, stages[i].shader);
    if (linked)
        return true;
    gpu_note_loss(gpu_device_current(), error);
    char log[sizeof(error->text)] = "";
    glGetProgramInfoLog(program, sizeof(log), NULL, log);
    return error_set(error, ERROR_INTERNAL, stages[0].path, "%s", log);
}

static struct gpu_binary_key binary_key(const struct gpu_device *device, const struct shader_stage *stages,
                                        unsigned stage_count)
{
    XXH3_state_t *state = XXH3_createState();
    if (!state)
        return (struct gpu_binary_key){0};
    XXH3_128bits_reset(state);
    for (unsigned i = 0; i < stage_count; i++)
        XXH3_128bits_update(state, stages[i].text.text, stages[i].text.length + 1);
    XXH3_128bits_update(state, device->info.vendor, strlen(device->info.vendor) + 1);
    XXH3_128bits_update(state, device->info.name, strlen(device->info.name) + 1);
    XXH3_128bits_update(state, device->info.version, strlen(device->info.version) + 1);
    XXH128_hash_t hash = XXH3_128bits_digest(state);
    XXH3_freeState(state);
    return (struct gpu_binary_key){hash.low64, hash.high64};
}

/* From the disk, else compiled. */
static bool build(struct gpu_device *device, GLuint program, struct shader_stage *stages, unsigned stage_count,
                  struct error *error)
{
    struct gpu_binary_key key = {0};
    for (unsigned i = 0; i < stage_count; i++)
        if (!stages[i].text.text)
            return false;
    if (device->facts.has_program_binary) {
        key = binary_key(device, stages, stage_count);
        glProgramParameteri(program, GL_PROGRAM_BINARY_RETRIEVABLE_HINT, GL_TRUE);
        if (!device->compiles && gpu_binary_load(&key, program))
            return true;
    }
    if (!link_program(program, stages, stage_count, error))
        return false;
    if (device->facts.has_program_binary)
        gpu_binary_store(&key, program);
    return true;
}

static struct cached_program *add_program(struct gpu_device *device, const struct gpu_program *program,
                                          bool is_compute, const char *key)
{
    size_t key_bytes = strlen(key) + 1;
    struct cached_program *cached = malloc(sizeof(*cached) + key_bytes);
    if (!cached)
        return NULL;
    GLint size[3] = {1, 1, 1};
    if (is_compute)
        glGetProgramiv(program->name, GL_COMPUTE_WORK_GROUP_SIZE, size);
    cached->program = *program;
    cached->program.group_size = (uint32_t)(size[0] * size[1] * size[2]);
    memcpy(cached->key, key, key_bytes);
    cached->next = device->programs->first;
    device->programs->first = cached;
    return cached;
}

static const struct gpu_program *create_program(struct gpu_device *device, const struct gpu_program_source *source,
                                                const char *key, struct error *error)
{
    struct shader_stage stages[STAGE_MAX];
    unsigned stage_count = list_stages(stages, source);
    struct cached_program *program = NULL;
    const uint64_t start_ns = clock_now_ns();
    GLuint name = gpu_object_create(device->registry, GPU_PROGRAM);
    bool ok = name != 0;
    if (!ok)
        gpu_note_loss(device, error);
    struct gpu_program made = {.name = name, .uniforms = gpu_uniforms_create()};
    ok = ok && made.uniforms;
    for (unsigned i = 0; ok && i < stage_count; i++)
        ok = gpu_source_expand(&stages[i].text, gpu_source_lookup_embedded, stages[i].path, source->defines,
                               error) &&
             gpu_uniforms_take(made.uniforms, &stages[i].text, source->defines, error);
    for (unsigned i = 0; ok && i < stage_count; i++) {
        gpu_accesses_add(&made, stages[i].text.text);
        ok = gpu_uniforms_put(made.uniforms, &stages[i].text, error);
    }
    ok = ok && build(device, name, stages, stage_count, error) &&
         (!device->facts.debug_output || gpu_accesses_check(&made, error));
    for (unsigned i = 0; i < stage_count; i++) {
        gpu_source_finish(&stages[i].text);
        glDeleteShader(stages[i].shader);
    }
    if (ok)
        program = add_program(device, &made, source->compute != NULL, key);
    if (!program) {
        gpu_uniforms_destroy(made.uniforms);
        gpu_object_destroy(device->registry, GPU_PROGRAM, name);
        error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for a program"); /* unless a reason stands there */
        return NULL;
    }
    program->build_ns = clock_now_ns() - start_ns;
    return &program->program;
}

const struct gpu_program *gpu_program_get(struct gpu_device *device, const struct gpu_program_source *source,
                                          struct error *error)
{
    char key[KEY_MAX];
    if (!make_key(key, source)) {
        error_set(error, ERROR_INTERNAL, NULL, "a program's files and defines take more than %d bytes", KEY_MAX);
        return NULL;
    }
    for (struct cached_program *at = device->programs->first; at; at = at->next)
        if (strcmp(at->key, key) == 0)
            return &at->program;
    return create_program(device, source, key, error);
}

bool gpu_program_stat(const struct gpu_device *device, size_t index, struct gpu_program_stat *stat)
{
    const struct cached_program *at = device->programs->first;
    while (at && index > 0)
        at = at->next, index--;
    if (at)
        *stat = (struct gpu_program_stat){.key = at->key, .name = at->program.name, .build_ns = at->build_ns};
    return at;
}

static void begin_pass(struct gpu_device *device, const struct gpu_program *program, unsigned accesses)
{
    glUseProgram(program->name);
    gpu_uniforms_bind(device, program->uniforms);
    gpu_await_pass(device, program, accesses);
}

void gpu_program_use(struct gpu_device *device, const struct gpu_program *program)
{
    begin_pass(device, program, GL_COMMAND_BARRIER_BIT | GL_VERTEX_ATTRIB_ARRAY_BARRIER_BIT);
}

void gpu_dispatch(struct gpu_device *device, const struct gpu_program *program, uint64_t items)
{
    if (items == 0)
        return;
    uint64_t groups = (items + program->group_size - 1) / program->group_size;
    uint64_t groups_x = groups < device->facts.work_groups_max ? groups : device->facts.work_groups_max;
    uint64_t groups_y = (groups + groups_x - 1) / groups_x;
    begin_pass(device, program, 0);
    gpu_watch_before(device);
    glDispatchCompute((GLuint)groups_x, (GLuint)groups_y, 1);
    gpu_watch_after(device, program->name);
}

void gpu_dispatch_indirect(const struct gpu_program *program, const struct gpu_buffer *groups, size_t offset_bytes)
{
    begin_pass(gpu_device_current(), program, GL_COMMAND_BARRIER_BIT);
    glBindBuffer(GL_DISPATCH_INDIRECT_BUFFER, groups->name);
    gpu_watch_before(gpu_device_current());
    glDispatchComputeIndirect((GLintptr)offset_bytes);
    gpu_watch_after(gpu_device_current(), program->name);
}
