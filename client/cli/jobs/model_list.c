/* SPDX-License-Identifier: MIT */
/* Lists of models in folders. */
#include "model_list.h"

#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

#define DEPTH_MAX 16

/* Endings of the formats that farlight-import reads. */
static const char *const endings[] = {".gltf", ".glb", ".obj", ".nff", ".3ds", ".3mf", ".ac",
                                      ".dae",  ".fbx", ".off", ".ply", ".stl", ".x3d"};

static bool is_model(const char *name)
{
    const char *dot = strrchr(name, '.');
    for (size_t i = 0; dot && dot > name && i < sizeof(endings) / sizeof(endings[0]); i++)
        if (strcasecmp(dot, endings[i]) == 0)
            return true;
    return false;
}

static bool add_file(struct model_list *list, const char *path, size_t name_at, struct fl_error *error)
{
    if (list->count == MODEL_LIST_MAX)
        return fl_error_set(error, FL_ERROR_ARGUMENT, path, "more than %d models", MODEL_LIST_MAX);
    if (list->count == list->capacity) {
        const size_t more = list->capacity * 2 + 16;
        struct model_list_entry *grown = realloc(list->entries, more * sizeof(*grown));
        if (!grown)
            return fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
        list->entries = grown;
        list->capacity = more;
    }
    struct model_list_entry *entry = &list->entries[list->count];
    *entry = (struct model_list_entry){.path = strdup(path), .name_at = name_at};
    list->count += entry->path != NULL;
    return entry->path || fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
}

static bool add_folder(struct model_list *list, const char *folder, size_t name_at, unsigned depth,
                       struct fl_error *error)
{
    struct dirent **found = NULL;
    const int count = scandir(folder, &found, NULL, alphasort);
    bool good = count >= 0 ||
                fl_error_set(error, FL_ERROR_FILE, folder, "this folder cannot be read: %s", strerror(errno));
    for (int i = 0; i < count; i++) {
        const char *name = found[i]->d_name;
        struct stat status;
        char *path = NULL;
        if (good && name[0] != '.' && asprintf(&path, "%s/%s", folder, name) >= 0 && lstat(path, &status) == 0) {
            if (S_ISDIR(status.st_mode) && depth < DEPTH_MAX)
                good = add_folder(list, path, name_at, depth + 1, error);
            else if (!S_ISDIR(status.st_mode) && is_model(name))
                good = add_file(list, path, name_at, error);
        }
        free(path);
        free(found[i]);
    }
    free(found);
    return good;
}

bool model_list_add(struct model_list *list, const char *path, struct fl_error *error)
{
    struct stat status;
    size_t length = strlen(path);
    if (stat(path, &status) < 0)
        return fl_error_set(error, FL_ERROR_FILE, path, "cannot be read: %s", strerror(errno));
    if (!S_ISDIR(status.st_mode)) {
        const char *slash = strrchr(path, '/');
        return add_file(list, path, slash ? (size_t)(slash - path) + 1 : 0, error);
    }
    while (length > 1 && path[length - 1] == '/')
        length--;
    char *folder = strndup(path, length);
    const bool good = folder ? add_folder(list, folder, length + 1, 0, error)
                             : fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    free(folder);
    return good;
}

void model_list_finish(struct model_list *list)
{
    for (size_t i = 0; i < list->count; i++)
        free(list->entries[i].path);
    free(list->entries);
    *list = (struct model_list){0};
}
