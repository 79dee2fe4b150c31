/* SPDX-License-Identifier: MIT */
/* The ground of a picture (frame_ground of request.h). It is no part of the scene: no tracer knows it, and a
 * ray hits it if it hits no surface. */
#ifndef FARLIGHT_RENDER_PASSES_GROUND_H
#define FARLIGHT_RENDER_PASSES_GROUND_H

#include "render/context/pass.h"
#include "render/waves/shading.h"

/* The pass makes hits of first rays that meet the ground, and lists all hits again. */
extern const struct pass ground_pass;
/* The ground's part in the waves of a slice: its hits, and their light. */
extern const struct shading_extra ground_shading;

/* Whether the frame shows a ground. */
bool ground_is_shown(const struct render_frame *frame);

#endif
