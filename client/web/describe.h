/* SPDX-License-Identifier: MIT */
/* Messages to the page, as malloc'ed JSON text; NULL: out of memory. */
#ifndef FARLIGHT_CLIENT_WEB_DESCRIBE_H
#define FARLIGHT_CLIENT_WEB_DESCRIBE_H

#include "lib/farlight.h"

/* {"scene": ..}: cameras, clips, bounds, tracers, integrators, and the first request of the view. */
char *web_describe_scene(struct fl_scene *scene, const char *name, const struct message_render *render,
                         const struct fl_scene_bounds *bounds, bool can_h264, bool may_edit);
/* The header of a frame's bytes; `id`: the page's number of the camera that it shows, 0: none. */
char *web_describe_frame(const struct fl_frame *frame, uint32_t id);
/* {"errors": ..}, the header of the errors of a frame's pixels, a byte each: the differences between the
 * answers of its tracer and the reference's, with the names of `farlight compare --json`. */
char *web_describe_errors(const struct fl_frame *frame, double far_share, uint32_t id);
/* {"refused": {"compare", "text"}}: a comparison was refused, with the reason. */
char *web_describe_refusal(const struct fl_error *error, uint32_t id);
/* {"refused": {"edit", "text"}}: an edit was refused, with the reason. */
char *web_describe_edit_refusal(const struct fl_error *error);
/* {"error": {"text", "again"}}; again: the error may pass. */
char *web_describe_error(const struct fl_error *error, bool again);

#endif
