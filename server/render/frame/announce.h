/* SPDX-License-Identifier: MIT */
/* The programs of a frame, announced ahead of their use (gpu_program_announce): threads compile them meanwhile. */
#ifndef FARLIGHT_RENDER_FRAME_ANNOUNCE_H
#define FARLIGHT_RENDER_FRAME_ANNOUNCE_H

#include "render/frame/state.h"

/* Called while a new scene is uploaded: announces the program that depends on materials alone. */
void announce_first(struct frame_renderer *renderer);
/* While the structure is built, for a frame that is made in one pass: programs that depend on no structure. */
void announce_shading(struct frame_renderer *renderer);
/* Every program of the picture that is being reserved. */
void announce_programs(struct frame_renderer *renderer);

#endif
