/* SPDX-License-Identifier: MIT */
/* The pass that turns a picture's sums into pixels on the host. */
#ifndef FARLIGHT_RENDER_FRAME_OUTPUT_H
#define FARLIGHT_RENDER_FRAME_OUTPUT_H

#include "render/context/pass.h"
#include "render/frame/state.h"

/* Resolves and reads back a band of a plane a step. */
extern const struct pass output_pass;

/* Whether the next step would only wait for a copy. */
bool output_waits(const struct frame_renderer *renderer);

#endif
