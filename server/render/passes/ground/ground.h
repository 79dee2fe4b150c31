/* SPDX-License-Identifier: MIT */
/* The ground of a picture (frame_ground of frame.h), which is no part of the scene: no tracer knows it, and rays
 * meet it where they meet nothing else. */
#ifndef FARLIGHT_RENDER_PASSES_GROUND_H
#define FARLIGHT_RENDER_PASSES_GROUND_H

#include "render/context/context.h"

/* The picture's integrator is a parameter of these. */
struct integrator;

/* Whether the frame in progress shows one. */
bool ground_is_shown(const struct render_context *context, const struct integrator *integrator);
/* Makes ready what its light is chosen by; at the start of a frame. */
bool ground_prepare(struct render_context *context, const struct integrator *integrator, struct error *error);
/* How many shadow rays of each hit it asks for, those of the integrator included. */
uint32_t ground_shadow_rays(const struct render_context *context, const struct integrator *integrator);
/* Makes hits of the wave's rays that meet it, before they are listed (compact_hits). Inside a span. */
bool ground_hit(struct render_context *context, const struct integrator *integrator, struct error *error);
/* Shades those hits anew, after the integrator has shaded all; and makes dead shadow rays of other hits, in the
 * places that the integrator leaves: first .. first + count - 1 of each hit. What a shading pass reads and writes
 * is bound, but for the program. Inside a span. */
bool ground_shade(struct render_context *context, const struct integrator *integrator, uint32_t first,
                  uint32_t count, struct error *error);

#endif
