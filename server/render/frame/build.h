/* SPDX-License-Identifier: MIT */
/* The pass that builds the structures of the frame's tracers. */
#ifndef FARLIGHT_RENDER_FRAME_BUILD_H
#define FARLIGHT_RENDER_FRAME_BUILD_H

#include "render/context/pass.h"
#include "render/frame/state.h"

/* Brings the tracers to the scene; its last steps make the frame ready for samples (frame/ready.h). After a
 * picture that others of the frame are made from it runs again, for the next picture. */
extern const struct pass build_pass;

/* Whether the next step would only wait for threads that build a structure. */
bool build_waits(const struct frame_renderer *renderer);

#endif
