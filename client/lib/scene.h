/* SPDX-License-Identifier: MIT */
#ifndef FARLIGHT_CLIENT_LIB_SCENE_H
#define FARLIGHT_CLIENT_LIB_SCENE_H

#include "lib/catalogue.h"
#include "lib/connection.h"

struct fl_scene {
    struct fl_scene *next; /* of the connection's */
    struct fl_connection *connection;
    uint32_t scene;
    uint64_t revision; /* the greatest that was told of */
    uint32_t *clips;   /* of one's own, in a scene of others': they are taken away in the end */
    size_t clip_count, clip_capacity;
    bool attached;
    struct fl_import_stats stats;
    struct fl_camera_info *cameras;
    size_t camera_count;
    struct fl_catalogue catalogue;
};

/* A scene of the connection's with a number of its own; nothing is told to the daemon. NULL: out of memory. */
struct fl_scene *fl_scene_create(struct fl_connection *connection, struct fl_error *error);

#endif
