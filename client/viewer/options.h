/* SPDX-License-Identifier: MIT */
/* Options of the viewer, from the command line. */
#ifndef FARLIGHT_VIEWER_OPTIONS_H
#define FARLIGHT_VIEWER_OPTIONS_H

#include "viewer/input/recall.h"
#include "viewer/view/view.h"

struct viewer_options {
    const char *server, *key_file, *model, *environment, *scene_name; /* see struct session_options */
    const struct fl_model *models;
    size_t model_count;
    int input_fd;
    bool watch;
    const char *variant;               /* see struct session_options */
    const struct fl_assignment *edits; /* see struct session_options */
    size_t edit_count;
    double environment_degrees, point_size; /* see struct session_options */
    bool without_studio;                    /* see struct session_options */
    struct view_options view;
    bool stereo;                     /* initially two views */
    enum protocol_view_source views; /* how two views are made */
    const char *camera, *clip;       /* names or numbers; NULL: none given */
    const char *framed;              /* node that must be in view: name or number; NULL: none given */
    bool has_framing;                /* the camera is placed by the side that it looks from */
    double speed;                    /* speed of the clip; 1: real time */
    unsigned coarser;                /* see struct settings */
    enum local_views local;          /* see struct settings */
    enum overlay_mode overlay;
    enum fl_warp_holes holes;
    const char *state;    /* file that keeps settings between runs; NULL: none */
    struct recall recall; /* content of that file */
    bool headless;
    const char *replay; /* path of a replay; NULL: input comes from the user */
    bool quiet;
    bool has_retry_for;     /* else retries forever after a loss, and never for a daemon that was not there */
    double retry_for_s;     /* seconds of retries */
    unsigned lost_after_ms; /* see fl_connect */
    int interrupt_fd;
    int (*interrupt_signal)(void); /* returns the signal that interrupted; 0: none */
    void (*note)(void *user, const struct fl_note *note);
};

#endif
