/* SPDX-License-Identifier: MIT */
/* Scenes that are made here, so that a device can be looked over with no file. */
#ifndef FARLIGHT_CHECK_SCENE_H
#define FARLIGHT_CHECK_SCENE_H

#include "scene/scene.h"

/* Some hundred triangles of a closed body, a floor, a screen with holes, spheres of glass, metal and plaster, a
 * disc, a light and a sky. NULL and *error on failure. */
struct scene *check_scene_small(struct error *error);
/* A body of 2 x around x across triangles alone. */
struct scene *check_scene_torus(uint32_t around, uint32_t across, struct error *error);

#endif
