/* SPDX-License-Identifier: MIT */
/* Edges of triangles, drawn on what is seen first: shaders/render/wireframe.comp. */
#ifndef FARLIGHT_RENDER_PASSES_WIREFRAME_H
#define FARLIGHT_RENDER_PASSES_WIREFRAME_H

#include "render/context/context.h"

/* Of a new slice, whose first hits the context has and nothing has looked at. Hits that are stored samples name no
 * triangle and get no edges. Without `wireframe` in the request it does nothing. Inside no span. */
bool wireframe_paint(struct render_context *context, struct error *error);

#endif
