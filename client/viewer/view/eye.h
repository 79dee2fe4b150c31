/* SPDX-License-Identifier: MIT */
/* Camera of the view, and its motion. */
#ifndef FARLIGHT_VIEWER_VIEW_EYE_H
#define FARLIGHT_VIEWER_VIEW_EYE_H

#include "viewer/input/camera.h"
#include "viewer/input/tour.h"

struct view;

struct view_eye {
    struct viewer_camera camera, home;
    bool has_camera, has_home;
    uint32_t followed; /* node of the scene's camera that the view follows, so that clips move it; 0: none */
    struct viewer_camera glide_from, glide_to; /* glide from .. to, begun at glide_begin_ns (0: no glide) */
    uint64_t glide_begin_ns;
    uint64_t moved_ns;
    struct tour tour;
    char camera_name[129], clip_name[129]; /* names of the tour's present camera and clip */
};

/* Moves the camera; it glides unless the options say that it jumps. `node`: the scene's camera at that place,
 * which the view follows while a clip is chosen; 0: none. */
void view_go(struct view *view, const struct viewer_camera *camera, uint32_t node);
/* Returns whether the picture is seen through the camera `followed`; `camera` then only repeats the last
 * frame's. */
bool view_follows(const struct view *view);
uint32_t view_home_node(const struct view *view); /* node of the initial camera; 0: it belongs to no node */
/* Advances a glide. Returns true if the camera has moved. */
bool view_glide(struct view *view, uint64_t now_ns);

#endif
