/* SPDX-License-Identifier: MIT */
/* Lists of models in folders. */
#ifndef FARLIGHT_CLI_JOBS_MODEL_LIST_H
#define FARLIGHT_CLI_JOBS_MODEL_LIST_H

#include "lib/farlight.h"

#define MODEL_LIST_MAX 4096

struct model_list_entry {
    char *path;
    size_t name_at; /* offset in `path` of its name within the folder, or of its own name */
};

struct model_list {
    struct model_list_entry *entries;
    size_t count, capacity;
};

/* Adds a file, or the files in a folder and its subfolders with the ending of a model, sorted by name. Hidden
 * files and links to folders are skipped. */
bool model_list_add(struct model_list *list, const char *path, struct fl_error *error);
void model_list_finish(struct model_list *list);

#endif
