/* SPDX-License-Identifier: MIT */
/* The bundled scene that moves: a roundabout of teapots, carousel.glb, with one clip, "ride", of three seconds. */
#ifndef FARLIGHT_TOOLS_ANIMATED_SCENE_H
#define FARLIGHT_TOOLS_ANIMATED_SCENE_H

#include <stdbool.h>

/* Returns false and has said why on stderr. */
bool animated_scene_write(const char *path);

#endif
