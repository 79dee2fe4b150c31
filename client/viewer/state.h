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
    struct settings first; /* initial settings */
    struct controls controls;
    unsigned times_live; /* session_times_live() when the view was started */
    unsigned times_read; /* session_times_read() when cameras and clips were last read */
    char *model;         /* path of a dropped model that is shown; NULL: the command line's model */
    struct {
        struct session *session; /* session of a dropped model until it is ready; NULL: none */
        char *model;             /* path of that model */
    } opening;
    struct {
        struct replay events;
        size_t next;
        uint64_t ns;       /* time from which the next event's delay counts */
        uint64_t revision; /* revision of the scene after the last event */
        struct viewer_shot {
            const char *path;
            struct pixmap picture;
        } * shots; /* screenshots not yet written */
        size_t shot_count;
    } replaying;
    unsigned screenshots;
    uint64_t tick_ns;
    bool quit;
};

/* ---- open.c ---- */

/* Creates the session of a dropped model, whose path must outlive it, or of the command line's model (NULL). */
struct session *viewer_open_session(struct viewer *viewer, const char *dropped, struct fl_error *error);
const char *viewer_scene_name(const struct viewer *viewer);
/* Begins to open a model that replaces the present one. */
void viewer_open(struct viewer *viewer, const char *path);
void viewer_step_opening(struct viewer *viewer, uint64_t now_ns);
void viewer_abandon_opening(struct viewer *viewer);

/* ---- act.c ---- */

void viewer_input(struct viewer *viewer, const struct input *input);
void viewer_replay(struct viewer *viewer, uint64_t now_ns);
/* Chooses a clip of the scene. TOUR_NONE: none. */
void viewer_choose_clip(struct viewer *viewer, int clip);

/* ---- draw.c ---- */

void viewer_hud(struct viewer *viewer, struct hud_state *state);
bool viewer_screenshot(struct viewer *viewer, const char *path, struct fl_error *error);
/* Takes a screenshot and writes it before the next state or wait, so that a replay keeps its timing. The path
 * must live until then. */
bool viewer_keep_screenshot(struct viewer *viewer, const char *path, struct fl_error *error);
/* Writes the screenshots that are kept, and frees them. */
bool viewer_write_screenshots(struct viewer *viewer, struct fl_error *error);
void viewer_print_state(struct viewer *viewer, const char *name);

#endif
