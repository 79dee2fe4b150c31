/* SPDX-License-Identifier: MIT */
/* A frame's camera as the shaders take it. */
#ifndef FARLIGHT_RENDER_CONTEXT_CAMERA_H
#define FARLIGHT_RENDER_CONTEXT_CAMERA_H

#include "render/frame/frame.h"
#include "shared/frame.h"
#include "gpu_scene/scene.h"

/* Fills the camera's and the lens's part of the uniforms; a near, far or focal distance that the request leaves
 * open comes from the scene. */
void camera_fill_uniforms(struct frame_uniforms *uniforms, const struct frame_request *request,
                          const struct gpu_scene *scene);

#endif
