/* SPDX-License-Identifier: MIT */
/* Getting ready for samples, once the scene and the structures are on the device. */
#ifndef FARLIGHT_RENDER_FRAME_READY_H
#define FARLIGHT_RENDER_FRAME_READY_H

#include "render/context/pass.h"
#include "render/frame/state.h"

/* Does a step: the environment's light, then uniforms, sizes and buffers of the picture that is rendered next.
 * PASS_DONE: samples may begin. */
enum pass_progress ready_step(struct frame_renderer *renderer, struct error *error);
/* Called while the structure is built: does the work that does not need it, and announces programs. */
bool ready_announce_early(struct frame_renderer *renderer, struct error *error);

/* Between these two, reservations of memory may be postponed to the next step. reserve_end() is true if all
 * were made or some were postponed; else *error is the failure. */
void reserve_begin(const struct frame_renderer *renderer);
bool reserve_end(const struct frame_renderer *renderer, bool made, const struct error *failed,
                 struct error *error);

#endif
