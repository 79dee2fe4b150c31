/* SPDX-License-Identifier: MIT */
/* Views warped locally while the camera moves: the settings of their keys, and which picture is shown. */
#ifndef FARLIGHT_VIEWER_VIEW_LOCAL_H
#define FARLIGHT_VIEWER_VIEW_LOCAL_H

#include "plan.h"
#include "views.h"

struct view;

struct view_local {
    struct plan_switch switched;
    struct plan_motion motion; /* motion up to `followed_camera` */
    struct viewer_camera followed_camera;
    struct plan_pace pace;
    bool asked, granted; /* `asked`: the stream was requested with depths; `granted`: it has had them since */
    bool has_keys;       /* views can be made */
    uint32_t key_frame;  /* number of the frame that became the last key */
    float radius;        /* radius of eye positions within which the depth's error bound holds */
    struct views *views; /* NULL: not needed yet */
    struct views_request requested;
    uint64_t request; /* number of the request; 0: none */
    struct pixmap made;
    struct views_made made_of;
    bool has_made;   /* a view was made since views are wanted */
    bool shows_made; /* the made view is shown in place of the daemon's picture */
    uint64_t count;
};

bool view_has_local(const struct view *view); /* views are made while the camera moves */
/* Decides after a frame whether views are made while the camera moves. */
void view_plan_local(struct view *view, uint64_t now_ns);
/* Adds the fields for warping to a view request: depths, margin and hidden layers. */
void view_ask_local(struct view *view, struct message_render *render);
bool view_asks_otherwise(const struct view *view); /* the view needs another request than the last one */
/* Turns off what may be the reason for the daemon's refusal of the view. */
void view_refuse_local(struct view *view);
/* Computes the camera to send: while it moves, its predicted place when the picture arrives. */
void view_aim(const struct view *view, bool moving, uint64_t now_ns, struct viewer_camera *camera);
/* Takes a frame of hidden layers that belongs to the last key. */
void view_take_hidden(struct view *view, struct fl_frame *frame);
/* Takes a picture that has arrived, and crops its margin. Returns whether the picture itself is shown. */
bool view_take_picture(struct view *view, struct fl_frame *frame);
/* Requests a view where one is needed, and shows the last one made. */
void view_step_local(struct view *view, uint64_t now_ns);
void view_forget_local(struct view *view); /* forgets all views of a lost connection */
/* The shown picture has the newest camera, and is the best one until another frame arrives. */
bool view_shows_camera(const struct view *view);

#endif
