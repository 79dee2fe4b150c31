/* SPDX-License-Identifier: MIT */
/* The input of a view's structure besides the scene. */
#ifndef FARLIGHT_TRACE_VIEW_H
#define FARLIGHT_TRACE_VIEW_H

#include <stdint.h>

/* The camera of a frame and the size of its picture. Compared byte by byte: words only, without bytes between
 * them.
 */
struct trace_view {
    float world_from_view[12]; /* rigid, three rows of four; looks along -z, y up */
    float fov_y;               /* radians, of the whole picture's height; 0: orthographic */
    float ortho_height;        /* metres, of an orthographic camera */
    float near;                /* metres along the view; 0: chosen from the scene */
    uint32_t width, height;    /* pixels */
};

#endif
