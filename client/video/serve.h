/* SPDX-License-Identifier: MIT */
/* The stream of requests: videos, one after the other, and their frames. */
#ifndef FARLIGHT_CLIENT_VIDEO_SERVE_H
#define FARLIGHT_CLIENT_VIDEO_SERVE_H

#include <stdbool.h>

/* Answers requests on the connected stream socket until the other side ends; a video that is unfinished then is
 * taken away. False, with a line on standard error: it broke the protocol, or there is no memory. */
bool video_serve(int fd);

#endif
