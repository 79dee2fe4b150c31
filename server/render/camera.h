/* SPDX-License-Identifier: MIT */
/* A frame's camera as the shaders take it. */
#ifndef FARLIGHT_RENDER_CAMERA_H
#define FARLIGHT_RENDER_CAMERA_H

#include "render/frame.h"
#include "shared/frame.h"
#include "trace/scene_gpu.h"

/* Fills the camera's part of the uniforms; a near or far distance that the camera leaves open comes from the
 * scene. */
void camera_fill_uniforms(struct frame_uniforms *uniforms, const struct frame_request *request,
                          const struct scene_gpu *scene);
/* Where in each pixel sample `index` lies, 0..1; the middle if it is the only one. */
void camera_jitter(float jitter_pixel[2], uint64_t seed, uint32_t index, uint32_t samples);

#endif
