/* SPDX-License-Identifier: MIT */
#ifndef FARLIGHT_CLIENT_VIDEO_LOG_H
#define FARLIGHT_CLIENT_VIDEO_LOG_H

#include "encode.h"

/* `number`: an error of the library's, which is spelled out after `what`, with the last error that it logged.
 * Returns false. */
bool video_fail_library(struct video_failure *failure, const char *field, const char *what, int number);

#endif
