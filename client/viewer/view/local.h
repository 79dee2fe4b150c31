/* SPDX-License-Identifier: MIT */
/* Views that are made here while the camera moves: what the daemon is asked for, and which picture is shown. */
#ifndef FARLIGHT_VIEWER_VIEW_LOCAL_H
#define FARLIGHT_VIEWER_VIEW_LOCAL_H

#include "plan.h"
#include "views.h"

struct view;

struct view_local {
    struct plan_switch switched;
    struct plan_motion motion; /* up to .. */
    struct viewer_camera followed_camera;
    struct plan_pace pace;
    bool asked, granted; /* the stream was asked to have depths; it has had them since then */
    bool has_keys;       /* views can be made */
    uint32_t key_frame;  /* number of the frame that the last key was */
    float radius;        /* of the sphere that their bound holds in */
    struct views *views; /* NULL: none was needed */
    struct views_wish wished;
    uint64_t wish; /* its number; 0: none */
    struct pixmap made;
    struct views_made made_of;
    bool has_made;   /* since views are wanted */
    bool shows_made; /* in place of the daemon's picture */
    uint64_t count;
};

bool view_has_local(const struct view *view); /* views are made while the camera moves */
/* Decides it, after a frame. */
void view_plan_local(struct view *view, uint64_t now_ns);
/* Completes a request for a view with what is needed for them. */
void view_ask_local(struct view *view, struct message_render *render);
bool view_asks_otherwise(const struct view *view); /* than it did */
/* Takes back what may be why the view was refused. */
void view_refuse_local(struct view *view);
/* The camera that the daemon is told: while it moves, where it will be when the picture is here. */
void view_aim(const struct view *view, bool moving, uint64_t now_ns, struct viewer_camera *camera);
/* What the picture of a key hides. */
void view_take_hidden(struct view *view, struct fl_frame *frame);
/* The frame that has arrived, which is without its margin afterwards. */
bool view_take_picture(struct view *view, struct fl_frame *frame);
/* Wants a view where it is needed, and shows what has been made. */
void view_step_local(struct view *view, uint64_t now_ns);
void view_forget_local(struct view *view); /* of a connection that is gone */
/* The picture is of the newest camera, and the best one until another frame comes. */
bool view_shows_camera(const struct view *view);

#endif
