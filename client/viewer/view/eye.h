/* SPDX-License-Identifier: MIT */
/* Where the camera is, and what moves it. */
#ifndef FARLIGHT_VIEWER_VIEW_EYE_H
#define FARLIGHT_VIEWER_VIEW_EYE_H

#include "viewer/input/camera.h"
#include "viewer/input/tour.h"

struct view;

struct view_eye {
    struct viewer_camera camera, home;
    bool has_camera, has_home;
    uint32_t followed; /* node of the camera that the view follows, for clips to move; 0: none */
    struct viewer_camera glide_from, glide_to; /* from .. to, since then; 0: it does not glide */
    uint64_t glide_begin_ns;
    uint64_t moved_ns;
    struct tour tour;
    char camera_name[129], clip_name[129]; /* of those that the tour is at */
};

/* Moves there; gliding, unless the view's options say that it jumps. `node`: the scene's camera there, which the
 * view then follows while a clip is chosen; 0: none. */
void view_go(struct view *view, const struct viewer_camera *camera, uint32_t node);
/* The picture is seen through the camera `followed`: `camera` only repeats the last frame's. */
bool view_follows(const struct view *view);
uint32_t view_home_node(const struct view *view); /* of the initial camera; 0: it is none of the scene's */
/* True: the camera has glided. */
bool view_glide(struct view *view, uint64_t now_ns);

#endif
