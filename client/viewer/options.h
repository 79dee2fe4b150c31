/* SPDX-License-Identifier: MIT */
/* What the command line says of a viewer. */
#ifndef FARLIGHT_VIEWER_OPTIONS_H
#define FARLIGHT_VIEWER_OPTIONS_H

#include "viewer/input/recall.h"
#include "viewer/view/view.h"

struct viewer_options {
    const char *server, *key_file, *model, *environment, *scene_name; /* as of session_options */
    const struct fl_model *models;
    size_t model_count;
    int input_fd;
    bool watch;
    const char *variant;               /* likewise */
    const struct fl_assignment *edits; /* likewise */
    size_t edit_count;
    double environment_degrees, point_size; /* likewise */
    bool without_studio;                    /* likewise */
    struct view_options view;
    bool stereo;                     /* two views from the beginning */
    enum protocol_view_source views; /* of two eyes */
    const char *camera, *clip;       /* names or numbers; NULL: none is named */
    const char *framed;              /* node that is to be in view, likewise */
    bool has_framing;                /* the camera is placed by the side that it looks from */
    double speed;                    /* of the clip */
    unsigned coarser;                /* as of struct settings */
    enum local_views local;          /* likewise */
    enum overlay_mode overlay;
    enum fl_warp_holes holes;
    const char *state;    /* the file of what is remembered; NULL: none */
    struct recall recall; /* what was in it */
    bool headless;
    const char *replay; /* path; NULL: a person */
    bool quiet;
    bool has_retry_for;     /* else a daemon that was there is tried for ever, and one that was not is not */
    double retry_for_s;     /* likewise */
    unsigned lost_after_ms; /* as of fl_connect */
    int interrupt_fd;
    int (*interrupt_signal)(void); /* which one came; 0: none */
    void (*note)(void *user, const struct fl_note *note);
};

#endif
