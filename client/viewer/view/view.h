/* SPDX-License-Identifier: MIT */
/* The view of a scene: what the daemon is told, its frames, and what is made of them. The parts have owners:
 * stream.c (told, frames), eye.c, local.c, tasks.c (tasks, heat), outline.c. */
#ifndef FARLIGHT_VIEWER_VIEW_VIEW_H
#define FARLIGHT_VIEWER_VIEW_VIEW_H

#include "decode.h"
#include "eye.h"
#include "local.h"
#include "outline.h"
#include "session.h"
#include "tasks.h"
#include "viewer/overlay/screen.h"

/* From the command line. */
struct view_options {
    struct message_render render; /* of one eye; width and height are the window's, in pixels of the desktop */
    bool stereo_over;             /* of two views the left one is above the other */
    float stereo_m;               /* between the eyes */
    bool has_encoding, has_still_encoding, has_primary;
    bool always_adapt, never_adapt;
    float moving_rate; /* frames a second */
    bool jumps;        /* the camera does not glide */
};

/* What the daemon was told last. */
struct view_told {
    bool must_show, must_look;
    uint64_t change, command, looked_ns;
    bool moving, has_looked;
};

struct view_frames {
    struct decoder *decoder;
    struct pixmap arrived;                                     /* the last frame, while it is decided on .. */
    struct pixmap live;                                        /* .. and the last one that can be shown */
    bool is_live;                                              /* the last frame is in `live` */
    struct fl_frame last;                                      /* what it told, without its arrays */
    char structure[HUD_STRUCTURE_MAX][HUD_STRUCTURE_TEXT_MAX]; /* of its tracer */
    size_t structure_count;
    uint64_t count;
    struct metrics metrics;
};

struct view {
    const struct view_options *options;
    struct message_render render; /* of one eye: from the options, completed by the scene */
    struct session *session;
    struct screen *screen;
    const struct edit_choice *choice;
    struct settings settings, taken; /* `taken`: with which frames came */
    struct view_eye eye;
    struct view_told told;
    struct view_frames frames;
    struct view_local local;
    struct view_tasks tasks;
    struct view_heat heat;
    struct view_outline outline;
    bool is_dropped;            /* the scene is that of a dropped model */
    char refused[HUD_TEXT_MAX]; /* why a dropped model is not shown, though it is there; empty: it is */
    struct fl_error failure;    /* why the viewer ends */
};

void view_tell(struct view *view, uint64_t now_ns); /* of the view and the camera, where they changed */
void view_receive(struct view *view, unsigned timeout_ms);
/* The frame has that many samples, or an error that is as small as is wanted. */
bool view_has_samples(const struct view *view, const struct fl_frame *frame, unsigned enough);
/* The frame shows the last request, and will not get more than `samples` samples (0: all). */
bool view_is_at_rest(const struct view *view, unsigned samples);
/* Makes a request for a picture of width x height pixels one of both eyes, where there are two. */
void view_use_eyes(const struct view *view, struct message_render *render);
/* The pixels that the daemon renders for the window, for one eye or two. */
void view_render_size(const struct view *view, uint32_t *width, uint32_t *height);
/* The scene's first picture is not possible: a dropped one says so and waits for other settings. */
void view_refuse_scene(struct view *view, const struct fl_error *refusal);
/* The picture that is shown. */
const struct pixmap *view_picture(const struct view *view);
void view_finish(struct view *view);

#endif
