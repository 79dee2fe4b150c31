/* SPDX-License-Identifier: MIT */
/* A scene of a connection, for the files of this folder. */
#ifndef FARLIGHT_CLIENT_LIB_SCENE_H
#define FARLIGHT_CLIENT_LIB_SCENE_H

#include "lib/catalogue.h"
#include "lib/connection.h"
#include "lib/imported.h"

struct fl_scene {
    struct fl_receiver receiver; /* first member; gets changes by other clients */
    struct fl_connection *connection;
    uint32_t scene;
    uint64_t revision; /* the newest revision that the daemon has reported */
    uint32_t *clips;   /* this client's clips in another client's scene: removed at the end */
    size_t clip_count, clip_capacity;
    bool attached;
    struct fl_import_stats stats;
    struct fl_camera_info *cameras;
    size_t camera_count;
    struct fl_catalogue catalogue;
    char **files;
    size_t file_count;
    struct fl_imported imported; /* empty unless the scene will be loaded again */
};

/* A new scene of the connection, with its own number; nothing is sent. NULL: out of memory. */
struct fl_scene *fl_scene_create(struct fl_connection *connection, struct fl_error *error);
/* Raises the scene's revision to one that the daemon has reported. */
void fl_scene_note_revision(struct fl_scene *scene, uint64_t revision);
/* Frees everything that an import has recorded of the scene. */
void fl_scene_forget_import(struct fl_scene *scene);

#endif
