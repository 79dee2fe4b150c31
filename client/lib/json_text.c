/* SPDX-License-Identifier: MIT */
/* JSON files with line numbers. */
#include "lib/json_text.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool fl_json_load(struct fl_json *json, const char *path, size_t max_bytes, struct fl_error *error)
{
    *json = (struct fl_json){0};
    FILE *file = fopen(path, "rbe");
    if (!file)
        return fl_error_set(error, FL_ERROR_FILE, path, "cannot be read: %m");
    json->text = malloc(max_bytes + 1);
    json->length = json->text ? fread(json->text, 1, max_bytes + 1, file) : 0;
    json_error_t why;
    if (!json->text)
        fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    else if (ferror(file) != 0)
        fl_error_set(error, FL_ERROR_FILE, path, "cannot be read: %m");
    else if (json->length > max_bytes)
        fl_error_set(error, FL_ERROR_FILE, path, "is larger than %zu bytes", max_bytes);
    else if (!(json->root = json_loadb(json->text, json->length, JSON_REJECT_DUPLICATES, &why)))
        fl_error_set(error, FL_ERROR_ARGUMENT, path, "line %d, column %d: %s", why.line, why.column, why.text);
    fclose(file);
    if (json->root)
        return true;
    fl_json_finish(json);
    return false;
}

void fl_json_finish(struct fl_json *json)
{
    json_decref(json->root);
    free(json->text);
    *json = (struct fl_json){0};
}

/* ---- where things stand ---- */

/* The text is known to be valid JSON: the scan only has to follow its structure. It is bounded all the same. */
struct scan {
    const char *at, *end;
};

static void skip_blanks(struct scan *scan)
{
    while (scan->at < scan->end && strchr(" \t\r\n", *scan->at))
        scan->at++;
}

static void skip_string(struct scan *scan)
{
    for (scan->at++; scan->at < scan->end && *scan->at != '"'; scan->at++)
        if (*scan->at == '\\' && scan->end - scan->at > 1)
            scan->at++;
    scan->at += scan->at < scan->end ? 1 : 0;
}

/* Skips to the comma or bracket behind the value. */
static void skip_value(struct scan *scan)
{
    size_t depth = 0;
    while (scan->at < scan->end) {
        const char c = *scan->at;
        if (c == '"') {
            skip_string(scan);
            continue;
        }
        if (c == '[' || c == '{')
            depth++;
        if (depth == 0 && (c == ',' || c == ']' || c == '}'))
            return;
        if (c == ']' || c == '}')
            depth--;
        scan->at++;
    }
}

/* True if the string from `begin` to `end`, quotes included, is `key`. */
static bool is_key(const char *begin, const char *end, const char *key)
{
    const size_t length = (size_t)(end - begin);
    if (!memchr(begin, '\\', length))
        return length == strlen(key) + 2 && memcmp(begin + 1, key, length - 2) == 0;
    json_t *decoded = json_loadb(begin, length, JSON_DECODE_ANY, NULL);
    const bool equal = decoded && strcmp(json_string_value(decoded), key) == 0;
    json_decref(decoded);
    return equal;
}

/* Moves past the next comma; false at the end of the array or object. */
static bool next_entry(struct scan *scan)
{
    skip_value(scan);
    if (scan->at >= scan->end || *scan->at != ',')
        return false;
    scan->at++;
    skip_blanks(scan);
    return true;
}

/* Moves from the value at `scan` to the member or element; *found is the start of its key or element. */
static bool descend(struct scan *scan, const struct fl_json_place *place, const char **found)
{
    const char open = place->key ? '{' : '[';
    if (scan->at >= scan->end || *scan->at != open)
        return false;
    scan->at++;
    skip_blanks(scan);
    size_t index = 0;
    do {
        const char *begin = scan->at;
        if (begin >= scan->end || *begin == '}' || *begin == ']')
            return false;
        if (!place->key) {
            *found = begin;
            if (index++ == place->index)
                return true;
            continue;
        }
        skip_string(scan);
        const char *end = scan->at;
        skip_blanks(scan);
        scan->at += scan->at < scan->end ? 1 : 0; /* the colon */
        skip_blanks(scan);
        if (is_key(begin, end, place->key)) {
            *found = begin;
            return true;
        }
    } while (next_entry(scan));
    return false;
}

/* False: the place, or one around it, does not exist; *found is the innermost existing one. */
static bool find(struct scan *scan, const struct fl_json_place *place, const char **found)
{
    if (!place) {
        skip_blanks(scan);
        *found = scan->at;
        return true;
    }
    const char *inner = NULL;
    if (!find(scan, place->outer, found) || !descend(scan, place, &inner))
        return false;
    *found = inner;
    return true;
}

unsigned fl_json_line(const struct fl_json *json, const struct fl_json_place *place)
{
    struct scan scan = {.at = json->text, .end = json->text + json->length};
    const char *found = json->text;
    unsigned line = 1;
    find(&scan, place, &found);
    for (const char *at = json->text; at < found; at++)
        line += *at == '\n' ? 1 : 0;
    return line;
}

void fl_json_path(const struct fl_json_place *place, char *path, size_t path_bytes)
{
    if (!place) {
        path[0] = '\0';
        return;
    }
    fl_json_path(place->outer, path, path_bytes);
    const size_t used = strlen(path);
    if (place->key)
        snprintf(path + used, path_bytes - used, "%s%s", used > 0 ? "." : "", place->key);
    else
        snprintf(path + used, path_bytes - used, "[%zu]", place->index);
}
