/* SPDX-License-Identifier: MIT */
/* Unique names of objects. */
#include "lib/names.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PATH_BYTES 4096
#define DEPTH_MAX 64 /* limit of a path; nodes above it are left out */

struct named {
    const struct fl_object *object;
    char **name;
};

/* Sorts objects of one name side by side, ascending by identifier. */
static int by_name(const void *a, const void *b)
{
    const struct named *one = a, *other = b;
    const int order = strcmp(*one->name, *other->name);
    return order != 0 ? order : (one->object->id > other->object->id) - (one->object->id < other->object->id);
}

static int by_id(const void *a, const void *b)
{
    const struct fl_object *one = a, *other = b;
    return (one->id > other->id) - (one->id < other->id);
}

static void own_name(const struct fl_object *object, char *name, size_t name_bytes)
{
    if (object->name[0] != '\0')
        snprintf(name, name_bytes, "%s", object->name);
    else
        snprintf(name, name_bytes, "#%u", object->id);
}

/* True if the name of an object below contains the name above already, as below a model's own node. */
static bool is_in_name(const struct fl_object *above, const struct fl_object *below)
{
    const size_t length = strlen(above->name);
    return strncmp(below->name, above->name, length) == 0 && (length == 0 || below->name[length] == '/');
}

/* Builds a path, "car/wheel", and leaves out nodes without a name. `objects` ascend by id. */
static void path_name(const struct fl_object *objects, size_t count, const struct fl_object *object, char *path,
                      size_t path_bytes)
{
    const struct fl_object *chain[DEPTH_MAX];
    size_t length = 0, used = 0;
    for (const struct fl_object *at = object; at && length < DEPTH_MAX;) {
        chain[length++] = at;
        const struct fl_object above = {.id = at->parent};
        at = above.id > 0 ? bsearch(&above, objects, count, sizeof(above), by_id) : NULL;
    }
    path[0] = '\0';
    while (length-- > 0 && used < path_bytes) {
        char name[sizeof(chain[0]->name)];
        if (length > 0 && is_in_name(chain[length], chain[length - 1]))
            continue;
        own_name(chain[length], name, sizeof(name));
        used += (size_t)snprintf(path + used, path_bytes - used, "%s%s", used > 0 ? "/" : "", name);
    }
}

static bool set_name(char **name, const char *text, struct fl_error *error)
{
    char *copy = strdup(text);
    if (!copy)
        return fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    free(*name);
    *name = copy;
    return true;
}

static size_t end_of_same(const struct named *named, size_t count, size_t from)
{
    size_t end = from + 1;
    while (end < count && strcmp(*named[end].name, *named[from].name) == 0)
        end++;
    return end;
}

/* Appends the identifier to every object that shares a name, so that a name does not change when other objects
 * are added. */
static bool number_all(struct named *named, size_t count, struct fl_error *error)
{
    char text[PATH_BYTES + 16];
    qsort(named, count, sizeof(*named), by_name);
    for (size_t i = 0, end; i < count; i = end) {
        end = end_of_same(named, count, i);
        for (size_t k = i; end - i > 1 && k < end; k++) {
            snprintf(text, sizeof(text), "%s#%u", *named[k].name, named[k].object->id);
            if (!set_name(named[k].name, text, error))
                return false;
        }
    }
    return true;
}

static bool name_by_paths(const struct fl_object *objects, size_t count, struct named *named, size_t named_count,
                          struct fl_error *error)
{
    char path[PATH_BYTES];
    qsort(named, named_count, sizeof(*named), by_name);
    for (size_t i = 0, end; i < named_count; i = end) {
        end = end_of_same(named, named_count, i);
        for (size_t k = i; end - i > 1 && k < end; k++) {
            path_name(objects, count, named[k].object, path, sizeof(path));
            if (!set_name(named[k].name, path, error))
                return false;
        }
    }
    return true;
}

static bool make(const struct fl_object *objects, size_t count, bool are_nodes, char **names, struct named *named,
                 struct fl_error *error)
{
    size_t named_count = 0;
    for (size_t i = 0; i < count; i++) {
        char name[sizeof(objects[i].name)];
        if (are_nodes && objects[i].shows_kind != PROTOCOL_NODE_MESH &&
            objects[i].shows_kind != PROTOCOL_NODE_SPHERES)
            continue;
        own_name(&objects[i], name, sizeof(name));
        if (!set_name(&names[i], name, error))
            return false;
        named[named_count++] = (struct named){.object = &objects[i], .name = &names[i]};
    }
    return (!are_nodes || name_by_paths(objects, count, named, named_count, error)) &&
           number_all(named, named_count, error);
}

bool fl_names_make(const struct fl_object *objects, size_t count, enum protocol_object_kind kind, char ***names,
                   struct fl_error *error)
{
    *names = calloc(count + 1, sizeof(**names));
    struct named *named = calloc(count + 1, sizeof(*named));
    const bool made = *names && named ? make(objects, count, kind == PROTOCOL_OBJECT_NODE, *names, named, error)
                                      : fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    free(named);
    if (!made) {
        fl_names_free(*names, count);
        *names = NULL;
    }
    return made;
}

void fl_names_free(char **names, size_t count)
{
    for (size_t i = 0; names && i < count; i++)
        free(names[i]);
    free(names);
}
