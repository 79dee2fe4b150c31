/* SPDX-License-Identifier: MIT */
/* A model far from the origin, as of a survey or a city, is shown around an origin of its own: positions are
 * 32-bit floats from here on, which are half a metre apart at 5000 km, and what rays need to leave a surface grows
 * with the position. */
#ifndef FARLIGHT_IMPORT_MODEL_ORIGIN_H
#define FARLIGHT_IMPORT_MODEL_ORIGIN_H

#include "scene.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Whether a box is so far away that it needs an origin of its own, which is written to `origin`: whole metres near
 * its middle that floats hold exactly. Not finite: false. */
bool import_find_origin(const double lower[3], const double upper[3], double origin[3]);

/* A node at `origin`, for positions that a reader of doubles has from there. */
uint32_t import_add_origin_node(struct import_scene *scene, const double origin[3], uint32_t parent);

/* Once all is added: moves a far scene to its own origin, which is subtracted from the places of its roots and
 * kept in the scene. False: the scene has failed. */
bool import_settle_origin(struct import_scene *scene);

#ifdef __cplusplus
}
#endif

#endif
