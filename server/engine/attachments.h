/* SPDX-License-Identifier: MIT */
/* Attachments, which follow a frame's encoded pixels, and the order of both in a frame in parts. Any thread. */
#ifndef FARLIGHT_ENGINE_ATTACHMENTS_H
#define FARLIGHT_ENGINE_ATTACHMENTS_H

#include "engine/engine.h"

/* Encodes the attachments of a frame whose pixels, `picture`, are encoded already, and appends them. */
bool attachments_append(struct engine_frame *frame, const struct picture *picture, struct error *error);
/* Depths of a frame; NULL: it has none. */
const float *attachments_depths(const struct frame_result *result);

#endif
