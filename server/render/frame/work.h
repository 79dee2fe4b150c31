/* SPDX-License-Identifier: MIT */
/* Resources of a frame in progress. */
#ifndef FARLIGHT_RENDER_FRAME_WORK_H
#define FARLIGHT_RENDER_FRAME_WORK_H

#include "render/frame/state.h"

/* Takes idle work, that of the same integrator if there is some, or makes some. */
struct frame_work *frame_work_take(struct frame_scene *shared, const struct integrator *integrator,
                                   struct error *error);
void frame_work_give(struct frame_scene *shared, struct frame_work *work); /* accepts NULL */
void frame_work_finish(struct frame_scene *shared);                        /* destroys idle state */
/* Makes one of the work's trace states fit the tracer. */
bool frame_work_trace_by(struct frame_work *work, struct trace_state **state, const struct tracer *tracer,
                         struct error *error);
uint64_t frame_work_device_bytes(const struct frame_work *work);

#endif
