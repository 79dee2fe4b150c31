/* SPDX-License-Identifier: MIT */
/* Input of a view's structure besides the scene. */
#ifndef FARLIGHT_TRACE_VIEW_H
#define FARLIGHT_TRACE_VIEW_H

#include <stdint.h>

/* Camera of a frame and size of its picture. All members are words without padding, as views are compared byte
 * by byte. */
struct trace_view {
    float world_from_view[12]; /* rigid, three rows of four; looks along -z, y up */
    float fov_y;               /* radians, over the picture's full height; 0: orthographic */
    float ortho_height;        /* metres, for an orthographic camera */
    float near;                /* metres along the view; 0: chosen for the scene */
    uint32_t width, height;    /* pixels */
};

#endif
