/* SPDX-License-Identifier: MIT */
/* Camera keys from JSON: [{"time": 0, "eye": [x,y,z], "look_at": [x,y,z], "up": [x,y,z], "fov": 45}, ..].
 * `time` in seconds, ascending; `fov` vertical, in degrees; `up` (0,1,0) and `fov` 45 may be left out. */
#include "lib/json_text.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define KEYS_MAX 1024u /* the protocol's */
#define FILE_BYTES_MAX (4u << 20)
#define RADIANS_PER_DEGREE 0.017453292519943295

struct place {
    const char *path;
    const struct fl_json *json;
    size_t key;
    struct fl_error *error;
};

static bool wrong(const struct place *place, const char *field, const char *what)
{
    const struct fl_json_place key = {.index = place->key}, at = {.outer = &key, .key = field};
    return fl_error_set(place->error, FL_ERROR_ARGUMENT, place->path, "line %u: key %zu, \"%s\": %s",
                        fl_json_line(place->json, &at), place->key, field, what);
}

/* Missing values keep their default; `needed` ones must be present. */
static bool read_number(const struct place *place, const json_t *object, const char *field, bool needed,
                        double minimum, double maximum, double *value)
{
    const json_t *found = json_object_get(object, field);
    if (!found)
        return needed ? wrong(place, field, "is missing") : true;
    char what[96];
    const double read = json_is_number(found) ? json_number_value(found) : NAN;
    if (!(read >= minimum && read <= maximum)) {
        snprintf(what, sizeof(what), "must be a number from %g to %g", minimum, maximum);
        return wrong(place, field, what);
    }
    *value = read;
    return true;
}

static bool read_vector(const struct place *place, const json_t *object, const char *field, bool needed,
                        double maximum, float vector[3])
{
    const json_t *found = json_object_get(object, field);
    if (!found)
        return needed ? wrong(place, field, "is missing") : true;
    if (!json_is_array(found) || json_array_size(found) != 3)
        return wrong(place, field, "must be an array of three numbers");
    for (size_t i = 0; i < 3; i++) {
        const json_t *part = json_array_get(found, i);
        const double read = json_is_number(part) ? json_number_value(part) : NAN;
        if (!(fabs(read) <= maximum))
            return wrong(place, field, "must be an array of three numbers");
        vector[i] = (float)read;
    }
    return true;
}

static bool check_names(const struct place *place, json_t *object)
{
    static const char *const known[] = {"time", "eye", "look_at", "up", "fov"};
    const char *name = NULL;
    json_t *value = NULL;
    json_object_foreach(object, name, value)
    {
        bool found = false;
        for (size_t i = 0; i < sizeof(known) / sizeof(known[0]); i++)
            found = found || strcmp(name, known[i]) == 0;
        if (!found)
            return wrong(place, name, "is not known (known: time, eye, look_at, up, fov)");
    }
    return true;
}

static bool read_key(const struct place *place, json_t *object, struct record_camera_key *key)
{
    if (!json_is_object(object))
        return fl_error_set(place->error, FL_ERROR_ARGUMENT, place->path, "line %u: key %zu is not an object",
                            fl_json_line(place->json, &(struct fl_json_place){.index = place->key}), place->key);
    double time_s = 0, fov = 45;
    *key = (struct record_camera_key){.up_world = {0, 1, 0}};
    if (!check_names(place, object) || !read_number(place, object, "time", true, 0, 1e6, &time_s) ||
        !read_vector(place, object, "eye", true, 1e12, key->eye_world) ||
        !read_vector(place, object, "look_at", true, 1e12, key->look_at_world) ||
        !read_vector(place, object, "up", false, 1e6, key->up_world) ||
        !read_number(place, object, "fov", false, 0.1, 177, &fov))
        return false;
    key->time_s = (float)time_s;
    key->fov_y = (float)(fov * RADIANS_PER_DEGREE);
    if (memcmp(key->eye_world, key->look_at_world, sizeof(key->eye_world)) == 0)
        return wrong(place, "look_at", "is where the eye is");
    return true;
}

static bool read_all(const char *path, const struct fl_json *json, struct record_camera_key *keys,
                     struct fl_error *error)
{
    const size_t count = json_array_size(json->root);
    for (size_t i = 0; i < count; i++) {
        const struct place place = {.path = path, .json = json, .key = i, .error = error};
        if (!read_key(&place, json_array_get(json->root, i), &keys[i]))
            return false;
        if (i > 0 && keys[i].time_s <= keys[i - 1].time_s)
            return wrong(&place, "time", "does not come after the key before");
    }
    return true;
}

bool fl_camera_keys_load(const char *path, struct record_camera_key **keys, size_t *key_count,
                         struct fl_error *error)
{
    struct fl_json json;
    if (!fl_json_load(&json, path, FILE_BYTES_MAX, error))
        return false;
    const size_t count = json_is_array(json.root) ? json_array_size(json.root) : 0;
    struct record_camera_key *made = NULL;
    bool good = false;
    if (count == 0 || count > KEYS_MAX) {
        fl_error_set(error, FL_ERROR_ARGUMENT, path, "must be an array of 1 to %u camera keys", KEYS_MAX);
    } else {
        made = calloc(count, sizeof(*made));
        good =
            made ? read_all(path, &json, made, error) : fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    }
    fl_json_finish(&json);
    if (!good) {
        free(made);
        return false;
    }
    *keys = made;
    *key_count = count;
    return true;
}
