/* SPDX-License-Identifier: MIT */
/* Reading a shot file: members, names, paths, and mistakes with their line. */
#include "read.h"
#include "lib/text.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct shot_value shot_member(const struct shot_value *object, const char *key)
{
    return (struct shot_value){
        .place = {.outer = !object->place.outer && !object->place.key ? NULL : &object->place, .key = key},
        .value = json_object_get(object->value, key)};
}

struct shot_value shot_element(const struct shot_value *array, size_t index)
{
    return (struct shot_value){.place = {.outer = &array->place, .index = index},
                               .value = json_array_get(array->value, index)};
}

static bool is_root(const struct shot_value *at)
{
    return !at->place.outer && !at->place.key;
}

bool shot_wrong(const struct shot_reader *reader, const struct shot_value *at, const char *remedy,
                const char *format, ...)
{
    char text[640], path[100];
    const struct fl_json_place *place = is_root(at) ? NULL : &at->place;
    const size_t length = strlen(reader->shot->path);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof(text), format, arguments);
    va_end(arguments);
    fl_json_path(place, path, sizeof(path));
    fl_error_set(&reader->job->error, FL_ERROR_ARGUMENT, reader->shot->path + (length > 150 ? length - 150 : 0),
                 "line %u: %s%s%s", fl_json_line(&reader->shot->json, place), path, path[0] != '\0' ? ": " : "",
                 text);
    return fl_error_remedy(&reader->job->error, "%s", remedy ? remedy : "see farlight-shot(5)");
}

/* ---- members ---- */

static bool unknown_member(const struct shot_reader *reader, const struct shot_value *object, const char *name,
                           const char *const *known)
{
    char list[560] = "", remedy[80];
    struct fl_nearest nearest = {0};
    for (size_t i = 0; known[i]; i++) {
        const size_t used = strlen(list);
        snprintf(list + used, sizeof(list) - used, "%s%s", i > 0 ? ", " : "", known[i]);
        fl_nearest_try(&nearest, name, known[i]);
    }
    struct shot_value member = shot_member(object, name);
    snprintf(remedy, sizeof(remedy), "did you mean '%s'?", nearest.name ? nearest.name : "");
    return shot_wrong(reader, &member, nearest.name ? remedy : NULL, "is not known; known: %s", list);
}

bool shot_is_object(const struct shot_reader *reader, const struct shot_value *at, const char *const *known)
{
    const char *name = NULL;
    json_t *value = NULL;
    if (!json_is_object(at->value))
        return shot_wrong(reader, at, NULL, "must be an object {..}");
    json_object_foreach((json_t *)(uintptr_t)at->value, name, value)
    {
        bool found = false;
        for (size_t i = 0; known[i] && !found; i++)
            found = strcmp(name, known[i]) == 0;
        if (!found)
            return unknown_member(reader, at, name, known);
    }
    return true;
}

bool shot_is_array(const struct shot_reader *reader, const struct shot_value *at, size_t maximum)
{
    if (!json_is_array(at->value))
        return shot_wrong(reader, at, NULL, "must be an array [..]");
    return json_array_size(at->value) <= maximum ||
           shot_wrong(reader, at, "leave some out", "has more than %zu elements", maximum);
}

/* ---- values ---- */

bool shot_number(const struct shot_reader *reader, const struct shot_value *at, double minimum, double maximum,
                 double *number)
{
    const double read = json_is_number(at->value) ? json_number_value(at->value) : NAN;
    if (!(read >= minimum && read <= maximum)) {
        char remedy[80];
        snprintf(remedy, sizeof(remedy), "give a number from %.7g to %.7g", minimum, maximum);
        return shot_wrong(reader, at, remedy, json_is_number(at->value) ? "is out of range" : "must be a number");
    }
    *number = read;
    return true;
}

void *shot_allocate(const struct shot_reader *reader, size_t count, size_t item_bytes)
{
    struct cli_shot *shot = reader->shot;
    if (shot->owned_count == shot->owned_capacity) {
        const size_t capacity = shot->owned_capacity > 0 ? shot->owned_capacity * 2 : 32;
        void **owned = realloc(shot->owned, capacity * sizeof(*owned));
        if (!owned) {
            fl_error_set(&reader->job->error, FL_ERROR_MEMORY, "", "out of memory");
            return NULL;
        }
        shot->owned = owned;
        shot->owned_capacity = capacity;
    }
    void *made = calloc(count > 0 ? count : 1, item_bytes);
    if (!made) {
        fl_error_set(&reader->job->error, FL_ERROR_MEMORY, "", "out of memory");
        return NULL;
    }
    shot->owned[shot->owned_count++] = made;
    return made;
}

bool shot_name(const struct shot_reader *reader, const struct shot_value *at, const char **name)
{
    if (json_is_string(at->value) && json_string_length(at->value) > 0) {
        *name = json_string_value(at->value);
        return true;
    }
    const double number = json_number_value(at->value);
    if (!json_is_number(at->value) || number < 0 || number > UINT32_MAX || floor(number) != number)
        return shot_wrong(reader, at, "'farlight info' lists the contents of a model",
                          "must be a name, or a number counted from 0");
    char *text = shot_allocate(reader, 24, 1);
    if (!text)
        return false;
    snprintf(text, 24, "%.0f", number);
    *name = text;
    return true;
}

bool shot_path(const struct shot_reader *reader, const struct shot_value *at, const char **path)
{
    const char *read = json_string_value(at->value);
    if (!read || read[0] == '\0')
        return shot_wrong(reader, at, "give a path relative to this file's folder", "must be the path of a file");
    if (read[0] == '/' || strcmp(read, "-") == 0) {
        *path = read;
        return true;
    }
    const size_t bytes = strlen(reader->shot->folder) + strlen(read) + 1;
    char *joined = shot_allocate(reader, bytes, 1);
    if (!joined)
        return false;
    snprintf(joined, bytes, "%s%s", reader->shot->folder, read);
    *path = joined;
    return true;
}
