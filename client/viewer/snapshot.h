/* SPDX-License-Identifier: MIT */
#ifndef FARLIGHT_CLIENT_VIEWER_SNAPSHOT_H
#define FARLIGHT_CLIENT_VIEWER_SNAPSHOT_H

#include "viewer/pixmap.h"

/* Writes a PNG; it is complete when this returns true. */
bool snapshot_write(const char *path, const struct pixmap *picture, struct fl_error *error);

#endif
