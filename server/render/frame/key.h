/* SPDX-License-Identifier: MIT */
/* Frames whose eyes are made from layers of a key view (passes/key_view/): the pictures of such a frame, one
 * after the other. Each goes through the frame's passes from its builds on. */
#ifndef FARLIGHT_RENDER_FRAME_KEY_H
#define FARLIGHT_RENDER_FRAME_KEY_H

#include "render/context/pass.h"
#include "render/frame/state.h"

#define PASS_UNKNOWN UINT32_MAX
#define PASS_MARK (UINT32_MAX - 1) /* finds the texels that eyes see, before the layer is rendered */

bool frame_is_from_layers(const struct frame_request *request);
/* The camera of the key view, or else the picture's own. */
struct frame_camera frame_key_camera(const struct frame_request *request);
bool frame_is_layer_pass(const struct frame_renderer *renderer);
bool frame_is_mark_pass(const struct frame_renderer *renderer); /* a pass over the eyes as well */
bool frame_is_eyes_pass(const struct frame_renderer *renderer);
/* Takes the tracer of the key view's structure. */
bool frame_key_take(struct frame_renderer *renderer, struct error *error);
/* Sets the frame to the picture that is rendered next, once the tracers are built: request, tracer, and
 * target of the samples. */
bool frame_key_set_pass(struct frame_renderer *renderer, struct error *error);
/* Ends the marks, once every eye is intersected: the layers follow. */
bool frame_key_end_marks(struct frame_renderer *renderer, struct error *error);
/* Limits a layer that is rendered tile by tile to as many rows as the picture of those tiles has. */
void frame_key_limit_rows(const struct frame_renderer *renderer, struct frame_request *request);
/* Keeps a layer whose samples are complete, one band a step. */
extern const struct pass keep_pass;
/* Adds rows to the structure's report: statistics of the eyes' rays. */
bool frame_key_report(struct frame_renderer *renderer, struct error *error);

#endif
