/* SPDX-License-Identifier: MIT */
/* What follows a frame's encoded pixels, and the order of all if it is in parts. Any thread. */
#ifndef FARLIGHT_ENGINE_ATTACHMENTS_H
#define FARLIGHT_ENGINE_ATTACHMENTS_H

#include "engine/engine.h"

/* Of a frame whose pixels, `picture`, are encoded. */
bool attachments_append(struct engine_frame *frame, const struct picture *picture, struct error *error);
/* NULL: there are none. */
const float *attachments_depths(const struct frame_result *result);

#endif
