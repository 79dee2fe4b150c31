/* SPDX-License-Identifier: MIT */
/* Generated scenes, so that a device can be checked without a file. */
#ifndef FARLIGHT_CHECK_SCENE_H
#define FARLIGHT_CHECK_SCENE_H

#include "scene/scene.h"

/* A scene of some hundred triangles of a closed body, a floor, a screen with holes, spheres of glass, metal and
 * plaster, a disc, a light and a sky. NULL and *error on failure. */
struct scene *check_scene_small(struct error *error);
/* A body of 2 x around x across triangles alone. */
struct scene *check_scene_torus(uint32_t around, uint32_t across, struct error *error);

#endif
