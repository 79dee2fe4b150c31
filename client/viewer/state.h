/* SPDX-License-Identifier: MIT */
/* Internals of the viewer, for the files of this folder. */
#ifndef FARLIGHT_VIEWER_STATE_H
#define FARLIGHT_VIEWER_STATE_H

#include "options.h"
#include "viewer/edit/editor.h"
#include "viewer/input/replay.h"

struct viewer {
    const struct viewer_options *options;
    struct screen screen;
    struct view view;
    struct editor edit;
    struct settings first; /* as they were at first */
    struct controls controls;
    unsigned times_live; /* of the session, as of when its view was started */
    unsigned times_read; /* likewise; what is known of cameras and clips is as of then */
    char *model;         /* that was dropped, and is shown; NULL: that of the options */
    struct {
        struct session *session; /* that of a dropped model, until it is there; NULL: there is none */
        char *model;             /* its path */
    } opening;
    struct {
        struct replay events;
        size_t next;
        uint64_t ns;       /* since when the next event is looked at */
        uint64_t revision; /* of the scene, after the last event */
        struct viewer_shot {
            const char *path;
            struct pixmap picture;
        } * shots; /* screenshots that are not written yet */
        size_t shot_count;
    } replaying;
    unsigned screenshots;
    uint64_t tick_ns;
    bool quit;
};

/* ---- open.c ---- */

/* Of a dropped model, whose path must live as long, or NULL: of the command line's. */
struct session *viewer_open_session(struct viewer *viewer, const char *dropped, struct fl_error *error);
const char *viewer_scene_name(const struct viewer *viewer);
/* Begins to open a model in place of the one that is shown. */
void viewer_open(struct viewer *viewer, const char *path);
void viewer_step_opening(struct viewer *viewer, uint64_t now_ns);
void viewer_abandon_opening(struct viewer *viewer);

/* ---- act.c ---- */

void viewer_input(struct viewer *viewer, const struct input *input);
void viewer_replay(struct viewer *viewer, uint64_t now_ns);
/* Chooses a clip of the scene, TOUR_NONE: none. */
void viewer_choose_clip(struct viewer *viewer, int clip);

/* ---- draw.c ---- */

void viewer_hud(struct viewer *viewer, struct hud_state *state);
bool viewer_screenshot(struct viewer *viewer, const char *path, struct fl_error *error);
/* One that is written before the next state or wait, so that a replay goes on in time. The path must live until
 * then. */
bool viewer_keep_screenshot(struct viewer *viewer, const char *path, struct fl_error *error);
/* Of those that are kept; frees them. */
bool viewer_write_screenshots(struct viewer *viewer, struct fl_error *error);
void viewer_print_state(struct viewer *viewer, const char *name);

#endif
