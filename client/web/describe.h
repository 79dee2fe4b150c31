/* SPDX-License-Identifier: MIT */
/* What a page is told, as JSON text for free(); NULL: out of memory. */
#ifndef FARLIGHT_CLIENT_WEB_DESCRIBE_H
#define FARLIGHT_CLIENT_WEB_DESCRIBE_H

#include "lib/farlight.h"

/* {"scene": ..}: cameras, clips, bounds, tracers, integrators; what the view is asked for first. */
char *web_describe_scene(struct fl_scene *scene, const char *name, const struct message_render *render,
                         const struct fl_scene_bounds *bounds, bool can_h264, bool may_edit);
/* What precedes a frame's bytes; `id`: of the camera that it shows, 0: none. */
char *web_describe_frame(const struct fl_frame *frame, uint32_t id);
/* {"errors": ..}, which precedes the errors of a frame's pixels, a byte each: how the answers of its tracer differ
 * from those of the reference, with the names of `farlight compare --json`. */
char *web_describe_errors(const struct fl_frame *frame, double far_share, uint32_t id);
/* {"refused": {"compare", "text"}}: why there is no such comparison. */
char *web_describe_refusal(const struct fl_error *error, uint32_t id);
/* {"refused": {"edit", "text"}}: why that was not done. */
char *web_describe_edit_refusal(const struct fl_error *error);
/* {"error": {"text", "again"}}; again: it may be gone later. */
char *web_describe_error(const struct fl_error *error, bool again);

#endif
