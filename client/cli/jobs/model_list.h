/* SPDX-License-Identifier: MIT */
/* The models in folders. */
#ifndef FARLIGHT_CLI_JOBS_MODEL_LIST_H
#define FARLIGHT_CLI_JOBS_MODEL_LIST_H

#include "lib/farlight.h"

#define MODEL_LIST_MAX 4096

struct model_list_entry {
    char *path;
    size_t name_at; /* where its name within the folder, or its own name, begins in `path` */
};

struct model_list {
    struct model_list_entry *entries;
    size_t count, capacity;
};

/* Adds a file, or of a folder all files with the ending of a model, in it and in the folders below, by their
 * names. Hidden folders and links to folders are passed over. */
bool model_list_add(struct model_list *list, const char *path, struct fl_error *error);
void model_list_finish(struct model_list *list);

#endif
