/* SPDX-License-Identifier: MIT */
/* The sky of models with lights but no environment, so that unlit surfaces and the background are not black. It
 * equals the daemon's sky for scenes without any light. */
#ifndef FARLIGHT_IMPORT_SKY_H
#define FARLIGHT_IMPORT_SKY_H

#include "import/model/scene.h"

/* Adds the sky after all models, unless a file has an environment or a camera of the file is in a room. */
void import_add_sky(struct import_scene *scene);

#endif
