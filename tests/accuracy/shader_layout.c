/* SPDX-License-Identifier: MIT */
/* Every struct of shaders/shared/, and of the layouts of tracers, lies in the same places for C and for GLSL.
 *
 * The headers' own text is read: its members have only 4-byte alignment in C, and SHARED_SIZE makes the compiler
 * check that their sizes add up to the struct's size, so there is no padding and the sums are C's offsets. The
 * driver is asked for GLSL's. A new struct needs no line here. */
#include "gpu/program_source.h"
#include "gpu/shader_sources.h"
#include "tests/fixtures/device.h"
#include "tests/harness/test.h"

#include <ctype.h>
#include <epoxy/gl.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MEMBERS_MAX 64
#define NAME_MAX_LENGTH 63

struct member {
    char name[NAME_MAX_LENGTH + 1];
    bool is_array;
    unsigned offset_bytes;
};

struct layout {
    char name[NAME_MAX_LENGTH + 1];
    struct member members[MEMBERS_MAX];
    unsigned member_count, size_bytes;
    unsigned stated_size_bytes; /* by SHARED_SIZE */
};

static char shader_text[512];

static bool lookup(const char *path, size_t length, const char **kept, const char **begin, const char **end)
{
    static const char own[] = "layout.comp";
    if (length != strlen(own) || memcmp(path, own, length) != 0)
        return gpu_source_lookup_embedded(path, length, kept, begin, end);
    *kept = own;
    *begin = shader_text;
    *end = shader_text + strlen(shader_text);
    return true;
}

/* A copy without comments; free() it. */
static char *without_comments(const char *begin, const char *end)
{
    char *copy = malloc((size_t)(end - begin) + 1), *out = copy;
    while (begin < end) {
        if (end - begin >= 2 && begin[0] == '/' && begin[1] == '*') {
            const char *close = strstr(begin + 2, "*/");
            begin = close ? close + 2 : end;
        } else if (end - begin >= 2 && begin[0] == '/' && begin[1] == '/') {
            while (begin < end && *begin != '\n')
                begin++;
        } else {
            *out++ = *begin++;
        }
    }
    *out = '\0';
    return copy;
}

/* The struct that was read last, which the next one may hold. */
static struct layout before;

static unsigned type_bytes(const char *type)
{
    if (strcmp(type, before.name) == 0)
        return before.size_bytes;
    if (strcmp(type, "float") == 0 || strcmp(type, "uint") == 0)
        return 4;
    if (strcmp(type, "vec4") == 0 || strcmp(type, "uvec4") == 0)
        return 16;
    fail_msg("type \"%s\" may not stand in a shared struct", type);
    return 0;
}

/* "vec4 a[3], b" or "SHARED(inner) a, b", of which the inner struct's first member is looked at */
static void read_declaration(struct layout *layout, char *text)
{
    char type[NAME_MAX_LENGTH + 1];
    int length = 0;
    const bool is_struct = sscanf(text, " SHARED(%63[a-z0-9_])%n", type, &length) == 1;
    if (!is_struct && sscanf(text, " %63[a-z0-9_]%n", type, &length) != 1)
        return;
    char *rest = NULL;
    for (char *item = strtok_r(text + length, ",", &rest); item; item = strtok_r(NULL, ",", &rest)) {
        struct member *member = &layout->members[layout->member_count++];
        unsigned count = 1;
        assert_in_range(layout->member_count, 1, MEMBERS_MAX - 1);
        int found = sscanf(item, " %63[A-Za-z0-9_] [%u]", member->name, &count);
        assert_in_range(found, 1, 2);
        member->is_array = found == 2;
        if (is_struct) {
            size_t end = strlen(member->name);
            snprintf(member->name + end, sizeof(member->name) - end, ".%s", before.members[0].name);
        }
        member->offset_bytes = layout->size_bytes;
        layout->size_bytes += count * type_bytes(type);
    }
}

/* The next `struct name { .. };` of the text; NULL: none. */
static char *read_struct(char *text, struct layout *layout)
{
    before = *layout;
    *layout = (struct layout){0};
    for (char *at = strstr(text, "struct "); at; at = strstr(at + 1, "struct ")) {
        int length = 0;
        if (sscanf(at, "struct %63[a-z0-9_] {%n", layout->name, &length) != 1 || length == 0)
            continue;
        char *body = at + length, *close = strchr(body, '}'), *rest = NULL;
        assert_non_null(close);
        *close = '\0';
        for (char *part = strtok_r(body, ";", &rest); part; part = strtok_r(NULL, ";", &rest))
            read_declaration(layout, part);
        char stated[NAME_MAX_LENGTH + 32];
        snprintf(stated, sizeof(stated), "SHARED_SIZE(%s,", layout->name);
        char *size = strstr(close + 1, stated);
        if (!size || sscanf(size + strlen(stated), "%u", &layout->stated_size_bytes) != 1)
            fail_msg("struct %s has no SHARED_SIZE behind it", layout->name);
        return close + 1;
    }
    return NULL;
}

static GLuint compile(const char *header, const struct layout *layout, const char *packing)
{
    struct error error = {0};
    struct gpu_source_text text;
    snprintf(shader_text, sizeof(shader_text),
             "#include \"%s\"\n"
             "layout(local_size_x = 1) in;\n"
             "layout(%s, binding = 0) buffer from_block { %s items[]; };\n"
             "layout(%s, binding = 1) buffer to_block { %s copies[]; };\n"
             "void main() { copies[0] = items[1]; }\n",
             header, packing, layout->name, packing, layout->name);
    if (!gpu_source_expand(&text, lookup, "layout.comp", NULL, &error))
        fail_msg("%s", error.text);
    const GLchar *source = text.text;
    GLuint program = glCreateShaderProgramv(GL_COMPUTE_SHADER, 1, &source);
    GLint linked = GL_FALSE;
    glGetProgramiv(program, GL_LINK_STATUS, &linked);
    if (!linked) {
        char log[1024] = "";
        glGetProgramInfoLog(program, sizeof(log), NULL, log);
        fail_msg("%s, struct %s: %s", header, layout->name, log);
    }
    gpu_source_finish(&text);
    return program;
}

static GLint variable_property(GLuint program, const char *name, GLenum property)
{
    GLuint index = glGetProgramResourceIndex(program, GL_BUFFER_VARIABLE, name);
    if (index == GL_INVALID_INDEX)
        fail_msg("GLSL has no %s", name);
    GLint value = -1;
    glGetProgramResourceiv(program, GL_BUFFER_VARIABLE, index, 1, &property, 1, NULL, &value);
    return value;
}

static void expect_same_layout(const char *header, const struct layout *layout, const char *packing)
{
    GLuint program = compile(header, layout, packing);
    assert_int_equal(layout->size_bytes, layout->stated_size_bytes);
    for (unsigned i = 0; i < layout->member_count; i++) {
        const struct member *member = &layout->members[i];
        char name[NAME_MAX_LENGTH + 32];
        snprintf(name, sizeof(name), "items[0].%s%s", member->name, member->is_array ? "[0]" : "");
        GLint offset = variable_property(program, name, GL_OFFSET);
        if (offset != (GLint)member->offset_bytes)
            fail_msg("%s of %s: GLSL has it at %d, C at %u", member->name, layout->name, offset,
                     member->offset_bytes);
        assert_int_equal(variable_property(program, name, GL_TOP_LEVEL_ARRAY_STRIDE), layout->size_bytes);
    }
    glDeleteProgram(program);
}

ALL_TESTS(open_device, close_device)

TEST(every_shared_struct_has_one_layout)
{
    unsigned struct_count = 0;
    for (unsigned i = 0; i < shader_source_count; i++) {
        const struct shader_source *source = &shader_sources[i];
        if (strncmp(source->path, "shared/", 7) != 0 && !strstr(source->path, "/layout.h"))
            continue;
        char *text = without_comments(source->begin, source->end);
        struct layout layout = {0};
        for (char *at = text; (at = read_struct(at, &layout)); struct_count++) {
            expect_same_layout(source->path, &layout, "std430");
            if (layout.size_bytes % 16 == 0) /* std140 rounds the stride of an array of others up */
                expect_same_layout(source->path, &layout, "std140");
        }
        free(text);
    }
    assert_in_range(struct_count, 10, 1000); /* else nothing was read */
}
