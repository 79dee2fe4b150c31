/* SPDX-License-Identifier: MIT */
/* Edges of triangles, drawn on first hits: shaders/render/wireframe.comp. */
#ifndef FARLIGHT_RENDER_PASSES_WIREFRAME_H
#define FARLIGHT_RENDER_PASSES_WIREFRAME_H

#include "render/context/pass.h"

/* Runs on first hits before other passes read them, where the request has `wireframe`. It has no state. */
extern const struct pass wireframe_pass;

#endif
