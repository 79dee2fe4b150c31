/* SPDX-License-Identifier: MIT */
#ifndef FARLIGHT_CLIENT_LIB_SCENE_H
#define FARLIGHT_CLIENT_LIB_SCENE_H

#include "lib/catalogue.h"
#include "lib/connection.h"
#include "lib/imported.h"

struct fl_scene {
    struct fl_receiver receiver; /* first: of changes by other clients */
    struct fl_connection *connection;
    uint32_t scene;
    uint64_t revision; /* the newest that the daemon has named */
    uint32_t *clips;   /* own ones in a scene of others: removed at the end */
    size_t clip_count, clip_capacity;
    bool attached;
    struct fl_import_stats stats;
    struct fl_camera_info *cameras;
    size_t camera_count;
    struct fl_catalogue catalogue;
    char **files;
    size_t file_count;
    struct fl_imported imported; /* empty unless it is to be loaded again */
};

/* A new scene of the connection, with its own number; nothing is sent. NULL: out of memory. */
struct fl_scene *fl_scene_create(struct fl_connection *connection, struct fl_error *error);
/* Keeps the newest revision that the daemon has named. */
void fl_scene_note_revision(struct fl_scene *scene, uint64_t revision);
/* Frees what an import has told of it. */
void fl_scene_forget_import(struct fl_scene *scene);

#endif
