/* SPDX-License-Identifier: MIT */
/* The origin of a model far from the world's origin, such as a survey or a city: positions are 32-bit floats in
 * the scene, half a metre apart at 5000 km, and the offset of rays from surfaces grows with the position, so
 * the model is shown around an origin of its own. */
#ifndef FARLIGHT_IMPORT_MODEL_ORIGIN_H
#define FARLIGHT_IMPORT_MODEL_ORIGIN_H

#include "scene.h"

#ifdef __cplusplus
extern "C" {
#endif

/* True if a box is so far away that it needs its own origin, which is written to `origin`: whole metres near
 * its middle that floats hold exactly. False for boxes that are not finite. */
bool import_find_origin(const double lower[3], const double upper[3], double origin[3]);

/* Adds a node at `origin`, for positions that a reader with doubles has made relative to it. */
uint32_t import_add_origin_node(struct import_scene *scene, const double origin[3], uint32_t parent);

/* Moves a distant scene to its own origin, once all objects are added: the origin is subtracted from the roots'
 * positions and stored in the scene. False: the scene has failed. */
bool import_settle_origin(struct import_scene *scene);

#ifdef __cplusplus
}
#endif

#endif
