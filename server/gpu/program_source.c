/* SPDX-License-Identifier: MIT */
/* Preprocessor of shaders: includes, defines and line numbers. */
#include "gpu/program_source.h"

#include "gpu/shader_sources.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Maximum depth of includes; deeper ones are a circle that the once-only rule did not break. */
#define INCLUDE_DEPTH_MAX 32

struct expansion {
    struct gpu_source_text *text;
    gpu_source_lookup lookup;
    const struct gpu_define *defines;
    struct error *error;
    unsigned depth;
};

bool gpu_source_lookup_embedded(const char *path, size_t path_length, const char **kept_path, const char **begin,
                                const char **end)
{
    for (unsigned i = 0; i < shader_source_count; i++) {
        const struct shader_source *source = &shader_sources[i];
        if (strlen(source->path) == path_length && memcmp(source->path, path, path_length) == 0) {
            *kept_path = source->path;
            *begin = source->begin;
            *end = source->end;
            return true;
        }
    }
    return false;
}

static bool append(struct gpu_source_text *text, const char *bytes, size_t length, struct error *error)
{
    if (text->capacity - text->length <= length) {
        size_t capacity = text->capacity * 2 + length + 4096;
        char *larger = realloc(text->text, capacity);
        if (!larger)
            return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for a shader's text");
        text->text = larger;
        text->capacity = capacity;
    }
    memcpy(text->text + text->length, bytes, length);
    text->length += length;
    text->text[text->length] = '\0';
    return true;
}

static bool append_format(struct gpu_source_text *text, struct error *error, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
static bool append_format(struct gpu_source_text *text, struct error *error, const char *format, ...)
{
    char line[512];
    va_list arguments;
    va_start(arguments, format);
    int length = vsnprintf(line, sizeof(line), format, arguments);
    va_end(arguments);
    if (length < 0 || (size_t)length >= sizeof(line))
        return error_set(error, ERROR_INTERNAL, NULL, "a shader's define is too long");
    return append(text, line, (size_t)length, error);
}

static const char *skip_blanks(const char *at, const char *end)
{
    while (at < end && (*at == ' ' || *at == '\t'))
        at++;
    return at;
}

/* Text after `#name`; NULL if the line is no such directive. */
static const char *directive(const char *line, const char *end, const char *name)
{
    size_t length = strlen(name);
    const char *at = skip_blanks(line, end);
    if (at == end || *at != '#')
        return NULL;
    at = skip_blanks(at + 1, end);
    if ((size_t)(end - at) < length || memcmp(at, name, length) != 0)
        return NULL;
    return skip_blanks(at + length, end);
}

static const char *define_value(const struct gpu_define *defines, const char *name, size_t length)
{
    for (; defines && defines->name; defines++)
        if (strlen(defines->name) == length && memcmp(defines->name, name, length) == 0)
            return defines->value;
    return NULL;
}

/* Text between the quotes of `"path"`; NULL if there are no quotes. */
static const char *quoted(const char *at, const char *end, size_t *length)
{
    if (at >= end || *at != '"')
        return NULL;
    const char *close = at + 1;
    while (close < end && *close != '"')
        close++;
    if (close == end)
        return NULL;
    *length = (size_t)(close - at - 1);
    return at + 1;
}

static bool expand_file(struct expansion *expansion, const char *path, size_t path_length);

static bool expand_include(struct expansion *expansion, const char *at, const char *end, unsigned file,
                           unsigned line_number)
{
    size_t length = 0;
    if (at < end && *at == '<') /* headers of the C library, for the C side of shared files */
        return append(expansion->text, "\n", 1, expansion->error);
    const char *path = quoted(at, end, &length);
    if (!path) {
        const char *name_end = at;
        while (name_end<end && * name_end> ' ')
            name_end++;
        const char *value = define_value(expansion->defines, at, (size_t)(name_end - at));
        if (value)
            path = quoted(value, value + strlen(value), &length);
    }
    if (!path)
        return error_set(expansion->error, ERROR_INTERNAL, NULL, "%s:%u: #include names no file",
                         expansion->text->files[file], line_number);
    if (!expand_file(expansion, path, length))
        return error_set(expansion->error, ERROR_INTERNAL, NULL, "%s:%u: the shader file \"%.*s\" does not exist",
                         expansion->text->files[file], line_number, (int)length, path);
    return append_format(expansion->text, expansion->error, "#line %u %u\n", line_number + 1, file);
}

static bool expand_lines(struct expansion *expansion, const char *at, const char *end, unsigned file)
{
    for (unsigned number = 1; at < end; number++) {
        const char *newline = memchr(at, '\n', (size_t)(end - at));
        const char *line_end = newline ? newline : end;
        const char *included = directive(at, line_end, "include");
        bool ok = true;
        if (included)
            ok = expand_include(expansion, included, line_end, file, number);
        else if (directive(at, line_end, "version"))
            ok = append(expansion->text, "\n", 1, expansion->error);
        else
            ok = append(expansion->text, at, (size_t)(line_end - at), expansion->error) &&
                 append(expansion->text, "\n", 1, expansion->error);
        if (!ok)
            return false;
        at = newline ? newline + 1 : end;
    }
    return true;
}

static bool expand_file(struct expansion *expansion, const char *path, size_t path_length)
{
    struct gpu_source_text *text = expansion->text;
    const char *kept, *begin, *end;
    if (!expansion->lookup(path, path_length, &kept, &begin, &end))
        return false;
    for (unsigned i = 0; i < text->file_count; i++)
        if (strcmp(text->files[i], kept) == 0)
            return append(text, "\n", 1, expansion->error);
    if (text->file_count == GPU_SOURCE_FILES_MAX || expansion->depth == INCLUDE_DEPTH_MAX)
        return error_set(expansion->error, ERROR_INTERNAL, NULL, "%s: too many or too deep includes", kept);
    unsigned file = text->file_count++;
    text->files[file] = kept;
    expansion->depth++;
    bool ok =
        append_format(text, expansion->error, "#line 1 %u\n", file) && expand_lines(expansion, begin, end, file);
    expansion->depth--;
    return ok;
}

bool gpu_source_expand(struct gpu_source_text *text, gpu_source_lookup lookup, const char *path,
                       const struct gpu_define *defines, struct error *error)
{
    struct expansion expansion = {.text = text, .lookup = lookup, .defines = defines, .error = error};
    *text = (struct gpu_source_text){0};
    bool ok = append_format(text, error, GPU_SOURCE_HEAD);
    for (const struct gpu_define *define = defines; ok && define && define->name; define++) {
        const char *value = define->value ? define->value : "1";
        if (strcmp(define->name, "EXTENSION") == 0)
            ok = append_format(text, error, "#extension %s : require\n", value);
        else if (strcmp(define->name, "PRAGMA") == 0)
            ok = append_format(text, error, "#pragma %s\n", value);
        else if (value[0] != '"')
            ok = append_format(text, error, "#define %s %s\n", define->name, value);
    }
    if (ok && !expand_file(&expansion, path, strlen(path)))
        ok = error_set(error, ERROR_INTERNAL, NULL, "the shader file \"%s\" does not exist", path);
    if (!ok)
        gpu_source_finish(text);
    return ok;
}

bool gpu_source_insert(struct gpu_source_text *text, size_t offset, const char *bytes, size_t length,
                       struct error *error)
{
    const size_t behind = text->length - offset;
    if (!append(text, bytes, length, error)) /* only reserves memory */
        return false;
    memmove(text->text + offset + length, text->text + offset, behind);
    memcpy(text->text + offset, bytes, length);
    return true;
}

void gpu_source_finish(struct gpu_source_text *text)
{
    free(text->text);
    *text = (struct gpu_source_text){0};
}

void gpu_source_name_files(const struct gpu_source_text *text, const char *log, char *out, size_t size)
{
    size_t length = 0;
    bool line_start = true;
    while (*log && length + 1 < size) {
        if (line_start && *log >= '0' && *log <= '9') {
            char *after;
            unsigned long file = strtoul(log, &after, 10);
            if (file < text->file_count && (*after == ':' || *after == '(')) {
                int n = snprintf(out + length, size - length, "%s", text->files[file]);
                length += n < 0 ? 0 : (size_t)n;
                if (length >= size)
                    length = size - 1;
                log = after;
                line_start = false;
                continue;
            }
        }
        line_start = *log == '\n';
        out[length++] = *log++;
    }
    if (size)
        out[length] = '\0';
}
