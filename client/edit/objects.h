/* SPDX-License-Identifier: MIT */
/* Objects of a scene, requested from the daemon by name or identifier. */
#ifndef FARLIGHT_CLIENT_EDIT_OBJECTS_H
#define FARLIGHT_CLIENT_EDIT_OBJECTS_H

#include "lib/farlight.h"

/* An object's state at the daemon: a set_node, set_material, set_light, set_camera or set_environment. */
struct edit_object {
    enum protocol_object_kind kind;
    uint32_t id;
    uint64_t revision; /* the scene's revision at the time of reading */
    struct message message;
    void *memory; /* owned: storage of strings and arrays */
};
/* Reads an object, which must be finished in any case. */
bool edit_object_read(struct fl_scene *scene, enum protocol_object_kind kind, uint32_t id,
                      struct edit_object *object, struct fl_error *error);
void edit_object_finish(struct edit_object *object);

#endif
