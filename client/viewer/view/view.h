/* SPDX-License-Identifier: MIT */
/* View of a scene: requests to the daemon, its frames, and pictures made from them. Owners of the parts:
 * stream.c (sent, frames), eye.c, local.c, tasks.c (tasks, heat), outline.c. */
#ifndef FARLIGHT_VIEWER_VIEW_VIEW_H
#define FARLIGHT_VIEWER_VIEW_VIEW_H

#include "decode.h"
#include "eye.h"
#include "local.h"
#include "outline.h"
#include "session.h"
#include "tasks.h"
#include "viewer/overlay/screen.h"

/* Settings from the command line. */
struct view_options {
    struct message_render render; /* for one eye; width and height are the window's, in pixels of the desktop */
    bool stereo_over;             /* stacks two views, the left one on top */
    float stereo_m;               /* distance between the eyes in metres */
    bool has_encoding, has_still_encoding, has_primary;
    bool always_adapt, never_adapt;
    float moving_rate; /* frames per second */
    bool jumps;        /* the camera does not glide */
};

/* The last request to the daemon. */
struct view_sent {
    bool must_send_view, must_send_camera;
    uint64_t change, command, camera_ns;
    bool moving, has_sent_camera;
};

struct view_frames {
    struct decoder *decoder;
    struct pixmap arrived; /* the last frame until it is decided which one is shown, .. */
    struct pixmap live;    /* .. and the last frame that can be shown */
    bool is_live;          /* the last frame is in `live` */
    struct fl_frame last;  /* metadata of the last frame, without its arrays */
    char structure[HUD_STRUCTURE_MAX][HUD_STRUCTURE_TEXT_MAX]; /* lines about the tracer's structure */
    size_t structure_count;
    uint64_t count;
    struct metrics metrics;
};

struct view {
    const struct view_options *options;
    struct message_render render; /* for one eye: from the options, completed by the scene */
    struct session *session;
    struct screen *screen;
    const struct edit_choice *choice;
    struct settings settings, taken; /* `taken`: settings of the last frame */
    struct view_eye eye;
    struct view_sent sent;
    struct view_frames frames;
    struct view_local local;
    struct view_tasks tasks;
    struct view_heat heat;
    struct view_outline outline;
    bool is_dropped;            /* the scene is a dropped model */
    char refused[HUD_TEXT_MAX]; /* why a dropped model is not shown although it is loaded; empty: it is shown */
    struct fl_error failure;    /* reason for which the viewer ends */
};

void view_send(struct view *view, uint64_t now_ns); /* sends view and camera where they changed */
void view_receive(struct view *view, unsigned timeout_ms);
/* The frame has at least that many samples, or an error below the target. */
bool view_has_samples(const struct view *view, const struct fl_frame *frame, unsigned enough);
/* The frame shows the last request, and will not get more than `samples` samples (0: no limit). */
bool view_is_at_rest(const struct view *view, unsigned samples);
/* Makes a request for a picture of width x height pixels one for both eyes, if there are two. */
void view_use_eyes(const struct view *view, struct message_render *render);
/* Computes the size that the daemon renders for the window, for one eye or two. */
void view_render_size(const struct view *view, uint32_t *width, uint32_t *height);
/* Handles a refused first picture: a dropped scene shows the reason and waits for other settings. */
void view_refuse_scene(struct view *view, const struct fl_error *refusal);
/* Returns the picture that is shown. */
const struct pixmap *view_picture(const struct view *view);
void view_finish(struct view *view);

#endif
