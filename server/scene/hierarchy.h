/* SPDX-License-Identifier: MIT */
/* Nodes in the order of their ids, with their parents as positions. Private to scene/. */
#ifndef FARLIGHT_SCENE_HIERARCHY_H
#define FARLIGHT_SCENE_HIERARCHY_H

#include "scene/scene.h"

#define HIERARCHY_NONE UINT32_MAX

/* A hierarchy; all-zero is empty. */
struct hierarchy {
    const struct scene_node **nodes; /* owned array of borrowed nodes */
    uint32_t *parents;               /* position of the parent; HIERARCHY_NONE: the root, or a missing parent */
    size_t count;
};

/* Takes ownership of `nodes` (malloc'ed), sorts it and finds the parents. False: out of memory; `nodes` is
 * freed. */
bool hierarchy_init(struct hierarchy *hierarchy, const struct scene_node **nodes, size_t count);
void hierarchy_finish(struct hierarchy *hierarchy);
/* Makes the hierarchy of a scene's nodes. */
bool hierarchy_of_scene(struct hierarchy *hierarchy, const struct scene *scene);

#endif
