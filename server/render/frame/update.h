/* SPDX-License-Identifier: MIT */
/* The pass that brings the scene to the device. */
#ifndef FARLIGHT_RENDER_FRAME_UPDATE_H
#define FARLIGHT_RENDER_FRAME_UPDATE_H

#include "render/context/pass.h"
#include "render/frame/state.h"

/* Updates the device's copy of the scene, in steps where it has little of it; then takes the frame's tracers. */
extern const struct pass update_pass;

/* Releases the tracers that the frame holds. */
void update_give_tracers(struct frame_renderer *renderer);
/* Forgets an update that has not ended: the copy is empty then. */
void update_abandon(struct frame_scene *shared);

#endif
