/* SPDX-License-Identifier: MIT */
/* Cache of programs: their keys, look-up, linking and dispatch. */
#include "gpu/program.h"

#include "base/clock.h"
#include "base/hashmap.h"
#include "gpu/barrier.h"
#include "gpu/binary_cache.h"
#include "gpu/program_ahead.h"
#include "gpu/program_build.h"
#include "gpu/program_cache.h"
#include "gpu/registry.h"
#include "gpu/uniforms.h"
#include "gpu/watch.h"

#include <epoxy/gl.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <xxhash.h>

#define KEY_MAX 1024

struct cached_program {
    struct gpu_program program;
    struct hashmap_link link; /* in `found` */
    struct cached_program *next;
    uint64_t build_ns;
    bool compiled;
    char key[]; /* files and defines */
};

struct gpu_program_cache {
    struct cached_program *first;
    struct hashmap found; /* by the key's hash: a frame looks up some hundred */
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
    hashmap_finish(&cache->found);
    free(cache);
}

struct key {
    size_t length; /* more than KEY_MAX: too long */
    char text[KEY_MAX + 1];
};

static void key_append(struct key *key, const char *text, char end)
{
    const size_t length = text ? strlen(text) : 0;
    if (length + 1 > KEY_MAX - key->length) {
        key->length = KEY_MAX + 1;
        return;
    }
    if (text)
        memcpy(key->text + key->length, text, length);
    key->text[key->length + length] = end;
    key->length += length + 1;
}

/* Makes the key, one line with files and defines. False: longer than KEY_MAX. */
static bool make_key(struct key *key, const struct gpu_program_source *source, struct error *error)
{
    const char *paths[] = {source->compute, source->vertex, source->geometry, source->fragment};
    key->length = 0;
    for (size_t i = 0; i < sizeof(paths) / sizeof(paths[0]) && key->length <= KEY_MAX; i++)
        key_append(key, paths[i], ';');
    for (const struct gpu_define *at = source->defines; at && at->name && key->length <= KEY_MAX; at++) {
        key_append(key, at->name, '=');
        if (key->length <= KEY_MAX)
            key_append(key, at->value ? at->value : "1", ';');
    }
    if (key->length > KEY_MAX)
        return error_set(error, ERROR_INTERNAL, NULL, "a program's files and defines take more than %d bytes",
                         KEY_MAX);
    key->text[key->length] = '\0';
    return true;
}

static struct cached_program *find_program(const struct gpu_program_cache *cache, const struct key *key,
                                           uint64_t hash)
{
    for (struct hashmap_link *link = hashmap_get(&cache->found, hash); link; link = link->next) {
        struct cached_program *at =
            (struct cached_program *)(void *)((char *)link - offsetof(struct cached_program, link));
        if (strcmp(at->key, key->text) == 0)
            return at;
    }
    return NULL;
}

static bool load(GLuint program, const struct gpu_binary *binary)
{
    GLint linked = GL_FALSE;
    if (!binary->data)
        return false;
    glProgramBinary(program, binary->format, binary->data, (GLsizei)binary->size_bytes);
    /* A binary in another driver's format is a GL error, and here only a miss. */
    if (glGetError() == GL_NO_ERROR)
        glGetProgramiv(program, GL_LINK_STATUS, &linked);
    return linked == GL_TRUE;
}

static void store(struct gpu_device *device, GLuint program, const struct gpu_binary_key *key)
{
    struct gpu_binary binary = {0};
    if (device->binaries && gpu_build_binary(&binary, program))
        gpu_binary_write(device->binaries, key, &binary);
    gpu_binary_finish(&binary);
}

/* Links a program that was compiled ahead or is on the disk; compiles others. */
static bool link_program(struct gpu_device *device, GLuint program, struct gpu_build *build,
                         struct gpu_binary *binary, bool *compiled, struct error *error)
{
    struct error failed = {0};
    *compiled = binary->data != NULL;
    if (load(program, binary))
        return true;
    gpu_binary_finish(binary);
    *compiled = false;
    if (!device->compiles && gpu_binary_read(device->binaries, &build->key, binary) && load(program, binary))
        return true;
    *compiled = true;
    gpu_build_start(build, program);
    if (gpu_build_end(build, program, &failed)) {
        store(device, program, &build->key);
        return true;
    }
    gpu_note_loss(device, error);
    if (error && error->kind == ERROR_NONE)
        *error = failed;
    return false;
}

static struct cached_program *add_program(struct gpu_device *device, const struct gpu_program *program,
                                          bool is_compute, const struct key *key, uint64_t hash)
{
    struct cached_program *cached = malloc(sizeof(*cached) + key->length + 1);
    if (!cached)
        return NULL;
    GLint size[3] = {1, 1, 1};
    if (is_compute)
        glGetProgramiv(program->name, GL_COMPUTE_WORK_GROUP_SIZE, size);
    *cached = (struct cached_program){.program = *program};
    cached->program.group_size = (uint32_t)(size[0] * size[1] * size[2]);
    memcpy(cached->key, key->text, key->length + 1);
    if (!hashmap_chain(&device->programs->found, hash, &cached->link)) {
        free(cached);
        return NULL;
    }
    cached->next = device->programs->first;
    device->programs->first = cached;
    return cached;
}

static const struct gpu_program *create_program(struct gpu_device *device, const struct gpu_program_source *source,
                                                const struct key *key, uint64_t hash, struct error *error)
{
    struct cached_program *program = NULL;
    struct gpu_build build = {0};
    struct gpu_binary binary = {0};
    bool compiled = false;
    const uint64_t start_ns = clock_now_ns();
    GLuint name = gpu_object_create(device->registry, GPU_PROGRAM);
    bool ok = name != 0;
    if (!ok)
        gpu_note_loss(device, error);
    ok = ok && (gpu_ahead_take(device->ahead, key->text, &build, &binary) ||
                gpu_build_prepare(&build, device, source, error));
    build.program.name = name;
    ok = ok && link_program(device, name, &build, &binary, &compiled, error) &&
         (!device->facts.debug_output || gpu_accesses_check(&build.program, error));
    if (ok)
        program = add_program(device, &build.program, source->compute != NULL, key, hash);
    if (program)
        build.program.uniforms = NULL; /* ownership has moved */
    gpu_build_finish(&build);
    gpu_binary_finish(&binary);
    if (!program) {
        gpu_object_destroy(device->registry, GPU_PROGRAM, name);
        /* The error stands unless an earlier one is set. */
        error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for a program");
        return NULL;
    }
    program->compiled = compiled;
    program->build_ns = clock_now_ns() - start_ns;
    return &program->program;
}

/* Whether programs are compiled ahead. The code that llvmpipe compiles at a dispatch passes through the disk.
 * Other software GL compiles hardly anything before a program is used: contexts for it cost more than they
 * gain. */
static bool compiles_ahead(const struct gpu_device *device)
{
    const struct gpu_facts *facts = &device->facts;
    const bool gains = facts->compiles_at_dispatch ? device->binaries != NULL : !facts->software;
    return gains && facts->has_program_binary && !device->compiles;
}

/* Announces a program; one on the disk need not be compiled, as it is loaded in no time. */
static void announce(struct gpu_device *device, const struct gpu_program_source *source, const struct key *key)
{
    struct gpu_build build;
    if (!compiles_ahead(device) || gpu_ahead_knows(device->ahead, key->text) ||
        !gpu_build_prepare(&build, device, source, NULL))
        return;
    gpu_ahead_add(device->ahead, key->text, &build, !gpu_binary_is_there(device->binaries, &build.key));
}

void gpu_program_announce(struct gpu_device *device, const struct gpu_texel_formats *formats)
{
    device->announces = formats != NULL;
    if (formats)
        device->texel_formats = formats;
}

const struct gpu_program *gpu_program_get(struct gpu_device *device, const struct gpu_program_source *source,
                                          struct error *error)
{
    struct key key;
    if (!make_key(&key, source, error))
        return NULL;
    const uint64_t hash = XXH3_64bits(key.text, key.length);
    const struct cached_program *known = find_program(device->programs, &key, hash);
    if (device->announces) {
        if (!known)
            announce(device, source, &key);
        return NULL;
    }
    return known ? &known->program : create_program(device, source, &key, hash, error);
}

bool gpu_program_stat(const struct gpu_device *device, size_t index, struct gpu_program_stat *stat)
{
    const struct cached_program *at = device->programs->first;
    while (at && index > 0)
        at = at->next, index--;
    if (at)
        *stat = (struct gpu_program_stat){
            .key = at->key, .name = at->program.name, .build_ns = at->build_ns, .compiled = at->compiled};
    return at;
}

static void begin_pass(struct gpu_device *device, const struct gpu_program *program, unsigned accesses)
{
    glUseProgram(program->name);
    gpu_uniforms_bind(device, program->uniforms);
    gpu_await_pass(device, program, accesses);
    device->dispatches += program->group_size > 0;
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
