/* SPDX-License-Identifier: MIT */
/* Errors of libavcodec and libavformat. */
#ifndef FARLIGHT_CLIENT_VIDEO_LOG_H
#define FARLIGHT_CLIENT_VIDEO_LOG_H

#include "encode.h"

/* Sets the failure "what: error", with the library's error `number` in words and the last line that it logged.
 * Returns false. */
bool video_fail_library(struct video_failure *failure, const char *field, const char *what, int number);

#endif
