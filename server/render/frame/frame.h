/* SPDX-License-Identifier: MIT */
/* A frame in steps: begin it, step until it is done, or abandon it. */
#ifndef FARLIGHT_RENDER_FRAME_H
#define FARLIGHT_RENDER_FRAME_H

#include "render/context/request.h"
#include "render/frame/renderer.h"
#include "render/frame/result.h"
#include "scene/pose.h"
#include "scene/scene.h"

#include <stdbool.h>

/* Renderers of one scene may have frames in progress at the same time, stepped in any order. A frame that
 * would change their shared state (another revision, motion, a tracer in use that is not up to date) may only
 * begin while no other is in progress. False: it has to wait for that. A tracer that is being updated for one
 * frame is shared as well: each frame that waits for it does steps of its update. */
bool frame_may_begin(const struct frame_renderer *renderer, const struct scene *scene,
                     const struct scene_motion *motion, const struct frame_request *request);
/* A frame in slices, so that others get their turn and a cancel is served: begin, then step until it is done
 * (or abandon). Building the tracers is part of the steps; abandoned with all frames that wait for it, a
 * build is dropped. Between begin and the end the scene must not be edited. A step takes a few milliseconds
 * where the device allows. `result` is filled by the last step. `motion`: poses while the shutter is open;
 * NULL: the committed ones. Both must stay until the frame is done or abandoned. A frame that may not begin
 * is refused, ERROR_INTERNAL. */
bool frame_begin(struct frame_renderer *renderer, const struct scene *scene, const struct scene_motion *motion,
                 const struct frame_request *request, struct error *error);
enum frame_progress { FRAME_FAILED, FRAME_MORE, FRAME_DONE };
enum frame_progress frame_step(struct frame_renderer *renderer, struct frame_result *result, struct error *error);
void frame_abandon(struct frame_renderer *renderer);
/* Whether the next step would only wait for the device, or for other threads that build a tracer's structure:
 * others may have their turn first. */
bool frame_step_waits(const struct frame_renderer *renderer);

#endif
