/* SPDX-License-Identifier: MIT */
/* Objects of a scene, asked of the daemon: by name, and as they are. */
#ifndef FARLIGHT_CLIENT_EDIT_OBJECTS_H
#define FARLIGHT_CLIENT_EDIT_OBJECTS_H

#include "lib/farlight.h"

/* An object as the daemon has it: a set_node, set_material, set_light, set_camera or set_environment. */
struct edit_object {
    enum protocol_object_kind kind;
    uint32_t id;
    uint64_t revision; /* of the scene, when it was read */
    struct message message;
    void *memory; /* owned: what its strings and arrays are in */
};
/* The object is to be finished in any case. */
bool edit_object_read(struct fl_scene *scene, enum protocol_object_kind kind, uint32_t id,
                      struct edit_object *object, struct fl_error *error);
void edit_object_finish(struct edit_object *object);

#endif
