/* SPDX-License-Identifier: MIT */
/* Checks of a frame: of its request alone, and together with its scene and its tracers. */
#ifndef FARLIGHT_RENDER_FRAME_CHECK_H
#define FARLIGHT_RENDER_FRAME_CHECK_H

#include "render/frame/state.h"

/* Checks the parts of a request that the session does not check, and that its tracers exist. */
bool frame_check_request(const struct frame_renderer *renderer, const struct frame_request *request,
                         struct error *error);
/* Refuses layers of light in a scene whose light is in display values. */
bool frame_check_light(const struct scene *scene, const struct frame_request *request, struct error *error);
/* Refuses light groups of surfaces that the tracer cannot distinguish; called once the tracer is known. */
bool frame_check_groups(const struct frame_renderer *renderer, struct error *error);
/* Refuses the layer motion if hits do not name the moving object; called once the method of first hits is
 * known. */
bool frame_check_moves(const struct frame_renderer *renderer, struct error *error);
bool frame_has_motion_layer(const struct frame_renderer *renderer);
/* The tracer of that number, or its stand-in. */
const struct tracer_impl *frame_find_tracer(const struct frame_renderer *renderer, unsigned number,
                                            const char *field, struct error *error);

#endif
