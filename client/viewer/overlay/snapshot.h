/* SPDX-License-Identifier: MIT */
/* Writing of screenshots. */
#ifndef FARLIGHT_VIEWER_OVERLAY_SNAPSHOT_H
#define FARLIGHT_VIEWER_OVERLAY_SNAPSHOT_H

#include "pixmap.h"

/* Writes a PNG, which is complete when this returns true. */
bool snapshot_write(const char *path, const struct pixmap *picture, struct fl_error *error);

#endif
