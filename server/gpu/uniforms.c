/* SPDX-License-Identifier: MIT */
/* The block of a program's uniforms: declarations, values, and a ring of ranges. */
#include "gpu/uniforms.h"

#include "gpu/program.h"
#include "gpu/registry.h"

#include <epoxy/gl.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MEMBERS_MAX 64
#define BLOCK_BYTES_MAX 1024
#define NAME_BYTES 32
#define VEC4_BYTES 16u
#define ASKS_AT_START "UNIFORMS_AT_START"
#define IN_BLOCK "_in_block"
/* Ranges of a thousand passes, each at a multiple of 256 bytes: more than a frame has. */
#define RING_BYTES (256u << 10)

enum value_kind { VALUE_UINT, VALUE_INT, VALUE_BOOL, VALUE_FLOAT };

static const struct value_type {
    const char *name;
    enum value_kind kind;
    uint32_t components;
} types[] = {
    {"uint", VALUE_UINT, 1},  {"int", VALUE_INT, 1},    {"bool", VALUE_BOOL, 1},  {"float", VALUE_FLOAT, 1},
    {"vec2", VALUE_FLOAT, 2}, {"vec3", VALUE_FLOAT, 3}, {"vec4", VALUE_FLOAT, 4},
};

struct member {
    char name[NAME_BYTES];
    const struct value_type *type;
    uint32_t length; /* elements of an array; 0: no array */
    uint32_t offset_bytes;
};

struct gpu_uniforms {
    struct member members[MEMBERS_MAX];
    uint32_t count, size_bytes;
    bool changed;                     /* changed since the last write to the buffer */
    uint32_t turn, ring_offset_bytes; /* place of the last write */
    _Alignas(16) unsigned char values[BLOCK_BYTES_MAX];
};

struct gpu_uniforms *gpu_uniforms_create(void)
{
    struct gpu_uniforms *uniforms = calloc(1, sizeof(*uniforms));
    if (uniforms)
        uniforms->changed = true;
    return uniforms;
}

void gpu_uniforms_destroy(struct gpu_uniforms *uniforms)
{
    free(uniforms);
}

/* ---- declarations ---- */

static const struct member *find(const struct gpu_uniforms *uniforms, const char *name, size_t length)
{
    for (uint32_t i = 0; i < uniforms->count; i++)
        if (strncmp(uniforms->members[i].name, name, length) == 0 && uniforms->members[i].name[length] == '\0')
            return &uniforms->members[i];
    return NULL;
}

static uint32_t array_length(const char *text, const struct gpu_define *defines)
{
    for (; defines && defines->name; defines++)
        if (defines->value && strcmp(defines->name, text) == 0)
            text = defines->value;
    return (uint32_t)strtoul(text, NULL, 10);
}

/* Adds a member at its place by the rules of std140; one that another stage or module has declared keeps its
 * place. */
static bool add(struct gpu_uniforms *uniforms, const struct member *declared)
{
    const struct member *known = find(uniforms, declared->name, strlen(declared->name));
    if (known)
        return known->type == declared->type && known->length == declared->length;
    const uint32_t bytes = 4 * declared->type->components;
    const uint32_t alignment = declared->length > 0 || bytes > 8 ? VEC4_BYTES : bytes;
    const uint32_t offset_bytes = (uniforms->size_bytes + alignment - 1) / alignment * alignment;
    const uint32_t room = offset_bytes < BLOCK_BYTES_MAX ? BLOCK_BYTES_MAX - offset_bytes : 0;
    if (uniforms->count == MEMBERS_MAX || bytes > room || declared->length > room / VEC4_BYTES)
        return false;
    uniforms->members[uniforms->count] = *declared;
    uniforms->members[uniforms->count++].offset_bytes = offset_bytes;
    uniforms->size_bytes = offset_bytes + (declared->length > 0 ? declared->length * VEC4_BYTES : bytes);
    return true;
}

/* Reads a declaration: "uint first, count" or "int rows[ROWS]". */
static bool read_declaration(struct gpu_uniforms *uniforms, char *text, const struct gpu_define *defines)
{
    char type[8], *rest = NULL;
    int type_length = 0;
    struct member member = {0};
    if (sscanf(text, " %7[a-z0-9] %n", type, &type_length) != 1 || type_length == 0)
        return false;
    for (size_t i = 0; i < sizeof(types) / sizeof(types[0]); i++)
        if (strcmp(types[i].name, type) == 0)
            member.type = &types[i];
    bool good = member.type != NULL && text[type_length] != '\0';
    for (char *item = strtok_r(text + type_length, ",", &rest); good && item; item = strtok_r(NULL, ",", &rest)) {
        char length[NAME_BYTES] = "", close = '\0', after;
        const int parts =
            sscanf(item, " %31[A-Za-z0-9_] [ %31[A-Za-z0-9_] %c %c", member.name, length, &close, &after);
        member.length = parts == 3 ? array_length(length, defines) : 0;
        good = (parts == 1 && !strchr(item, '[')) || (parts == 3 && close == ']' && member.length > 0);
        good = good && strlen(member.name) < NAME_BYTES - 1 && add(uniforms, &member);
    }
    return good;
}

bool gpu_uniforms_take(struct gpu_uniforms *uniforms, struct gpu_source_text *text,
                       const struct gpu_define *defines, struct error *error)
{
    static const char word[] = "uniform ";
    for (char *at = text->text; (at = strstr(at, word)) != NULL; at++) {
        const char *before = at;
        while (before > text->text && (before[-1] == ' ' || before[-1] == '\t'))
            before--;
        if (before > text->text && before[-1] != '\n')
            continue; /* after a layout(), or in a comment */
        char declaration[256] = "";
        const size_t length = strcspn(at, ";\n");
        if (at[length] == ';' && length < sizeof(declaration))
            memcpy(declaration, at + strlen(word), length - strlen(word));
        if (!read_declaration(uniforms, declaration, defines))
            return error_set(
                error, ERROR_INTERNAL, NULL,
                "\"%.*s\" is no declaration of uint, int, bool, float or vec on one line, contradicts "
                "another one, or is one too many",
                (int)(length < 200 ? length : 200), at);
        memset(at, ' ', length + 1);
    }
    return true;
}

/* Functions for copies: Mesa optimises a plain copy back into the uniform, but not an expression. */
static const char at_start[] = "bool at_start(bool v) { return v; }\n"
                               "uint at_start(uint v) { return v | 0u; }\n"
                               "int at_start(int v) { return v | 0; }\n"
                               "float at_start(float v) { return uintBitsToFloat(floatBitsToUint(v)); }\n"
                               "vec2 at_start(vec2 v) { return uintBitsToFloat(floatBitsToUint(v)); }\n"
                               "vec3 at_start(vec3 v) { return uintBitsToFloat(floatBitsToUint(v)); }\n"
                               "vec4 at_start(vec4 v) { return uintBitsToFloat(floatBitsToUint(v)); }\n";

struct block {
    size_t length;
    char text[sizeof(ASKS_AT_START) + sizeof(at_start) + MEMBERS_MAX * (3 * NAME_BYTES + 64)];
};

static void write_format(struct block *block, const char *format, ...) __attribute__((format(printf, 2, 3)));
static void write_format(struct block *block, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    const int length =
        vsnprintf(block->text + block->length, sizeof(block->text) - block->length, format, arguments);
    va_end(arguments);
    block->length += length > 0 ? (size_t)length : 0;
}

bool gpu_uniforms_put(const struct gpu_uniforms *uniforms, struct gpu_source_text *text, bool software,
                      struct error *error)
{
    struct block block = {0};
    /* After the lines that must come first. */
    const char *files = text->text ? strstr(text->text, "#line ") : NULL;
    const bool copies = files && software && strstr(files, "#ifdef " ASKS_AT_START);
    if (!files)
        return true;
    if (copies)
        write_format(&block, "#define " ASKS_AT_START " 1\n%s", at_start);
    if (uniforms->count > 0)
        write_format(&block, "layout(std140, binding = %d) uniform pass_block {\n", GPU_UNIFORMS_BINDING);
    for (uint32_t i = 0; i < uniforms->count; i++) {
        const struct member *member = &uniforms->members[i];
        write_format(&block, "%s %s", member->type->name, member->name);
        if (member->length > 0)
            write_format(&block, "[%u]", member->length);
        write_format(&block, copies && member->length == 0 ? IN_BLOCK ";\n" : ";\n");
    }
    if (uniforms->count > 0)
        write_format(&block, "};\n");
    for (uint32_t i = 0; copies && i < uniforms->count; i++) {
        const struct member *member = &uniforms->members[i];
        if (member->length == 0) /* copying an array would have code for each of its elements */
            write_format(&block, "%s %s = at_start(%s" IN_BLOCK ");\n", member->type->name, member->name,
                         member->name);
    }
    return gpu_source_insert(text, (size_t)(files - text->text), block.text, block.length, error);
}

/* ---- values ---- */

static const struct member *find_element(const struct gpu_uniforms *uniforms, const char *name,
                                         uint32_t *offset_bytes)
{
    const size_t length = strcspn(name, "[");
    const struct member *member = uniforms ? find(uniforms, name, length) : NULL;
    const unsigned long index = name[length] == '[' ? strtoul(name + length + 1, NULL, 10) : 0;
    if (!member || (index > 0 && index >= member->length))
        return NULL;
    *offset_bytes = member->offset_bytes + (uint32_t)index * VEC4_BYTES;
    return member;
}

bool gpu_uniforms_find(const struct gpu_uniforms *uniforms, const char *name, uint32_t *offset_bytes)
{
    return find_element(uniforms, name, offset_bytes) != NULL;
}

static void set(const struct gpu_program *program, const char *name, struct value_type type, const void *value)
{
    uint32_t offset_bytes;
    const struct member *member = find_element(program->uniforms, name, &offset_bytes);
    if (!member)
        return;
    const enum value_kind kind = member->type->kind;
    if (member->type->components != type.components || (kind == VALUE_FLOAT) != (type.kind == VALUE_FLOAT) ||
        (kind != type.kind && kind != VALUE_BOOL && kind != VALUE_FLOAT)) {
        gpu_device_current()->misused_uniform = member->name;
        return;
    }
    unsigned char *to = program->uniforms->values + offset_bytes;
    if (memcmp(to, value, 4 * type.components) == 0)
        return;
    memcpy(to, value, 4 * type.components);
    program->uniforms->changed = true;
}

void gpu_uniform_uint(const struct gpu_program *program, const char *name, uint32_t value)
{
    set(program, name, (struct value_type){.kind = VALUE_UINT, .components = 1}, &value);
}

void gpu_uniform_int(const struct gpu_program *program, const char *name, int32_t value)
{
    set(program, name, (struct value_type){.kind = VALUE_INT, .components = 1}, &value);
}

void gpu_uniform_float(const struct gpu_program *program, const char *name, float value)
{
    set(program, name, (struct value_type){.kind = VALUE_FLOAT, .components = 1}, &value);
}

void gpu_uniform_vec(const struct gpu_program *program, const char *name, unsigned components, const float *value)
{
    set(program, name, (struct value_type){.kind = VALUE_FLOAT, .components = components}, value);
}

/* ---- the buffer ---- */

bool gpu_uniforms_start(struct gpu_device *device)
{
    struct gpu_uniform_ring *ring = &device->uniform_ring;
    GLint alignment = 0;
    glGetIntegerv(GL_UNIFORM_BUFFER_OFFSET_ALIGNMENT, &alignment);
    *ring = (struct gpu_uniform_ring){
        .name = gpu_object_create(device->registry, GPU_BUFFER),
        .alignment_bytes = alignment > 0 ? (uint32_t)alignment : 256,
        .end_bytes = RING_BYTES, /* makes the first pass allocate */
    };
    return ring->name != 0;
}

static void write_values(struct gpu_uniform_ring *ring, struct gpu_uniforms *uniforms, uint32_t size_bytes)
{
    if (size_bytes > RING_BYTES - ring->end_bytes) {
        /* The old name gets fresh memory; passes in progress keep theirs. */
        glNamedBufferData(ring->name, RING_BYTES, NULL, GL_STREAM_DRAW);
        ring->end_bytes = 0;
        ring->turn++;
    }
    glNamedBufferSubData(ring->name, ring->end_bytes, size_bytes, uniforms->values);
    uniforms->ring_offset_bytes = ring->end_bytes;
    uniforms->turn = ring->turn;
    uniforms->changed = false;
    const uint32_t next = (ring->end_bytes + size_bytes + ring->alignment_bytes - 1) / ring->alignment_bytes;
    ring->end_bytes = next * ring->alignment_bytes;
    ring->end_bytes = ring->end_bytes < RING_BYTES ? ring->end_bytes : RING_BYTES;
}

void gpu_uniforms_bind(struct gpu_device *device, struct gpu_uniforms *uniforms)
{
    struct gpu_uniform_ring *ring = &device->uniform_ring;
    if (!uniforms || uniforms->count == 0)
        return;
    const uint32_t size_bytes = (uniforms->size_bytes + VEC4_BYTES - 1) / VEC4_BYTES * VEC4_BYTES;
    if (uniforms->changed || uniforms->turn != ring->turn)
        write_values(ring, uniforms, size_bytes);
    glBindBufferRange(GL_UNIFORM_BUFFER, GPU_UNIFORMS_BINDING, ring->name, uniforms->ring_offset_bytes,
                      size_bytes);
}
