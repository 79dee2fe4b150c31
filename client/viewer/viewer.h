/* SPDX-License-Identifier: MIT */
/* The viewer: one loop over input (user or replay), frames and connection losses, with or without a window. */
#ifndef FARLIGHT_VIEWER_VIEWER_H
#define FARLIGHT_VIEWER_VIEWER_H

#include "options.h"

/* Runs until the window is closed, the replay has ended, or an error is final. */
bool viewer_run(const struct viewer_options *options, struct fl_error *error);

#endif
