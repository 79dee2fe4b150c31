/* SPDX-License-Identifier: MIT */
#ifndef FARLIGHT_CLIENT_LIB_SCENE_H
#define FARLIGHT_CLIENT_LIB_SCENE_H

#include "lib/catalogue.h"
#include "lib/connection.h"

struct fl_scene {
    struct fl_connection *connection;
    uint32_t scene;
    struct fl_import_stats stats;
    struct fl_camera_info *cameras;
    size_t camera_count;
    struct fl_catalogue catalogue;
};

#endif
