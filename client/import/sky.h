/* SPDX-License-Identifier: MIT */
/* The sky of models that have lights and no environment: what these do not reach, and what is behind all, is not
 * black. It is the sky that the daemon gives to scenes without any light. */
#ifndef FARLIGHT_IMPORT_SKY_H
#define FARLIGHT_IMPORT_SKY_H

#include "import/model/scene.h"

/* After all models. Not where a file says what is around it, nor in a room that a camera of the file is in. */
void import_add_sky(struct import_scene *scene);

#endif
