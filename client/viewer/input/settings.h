/* SPDX-License-Identifier: MIT */
/* The settings of the picture that keys change. Independent of window and daemon. */
#ifndef FARLIGHT_VIEWER_INPUT_SETTINGS_H
#define FARLIGHT_VIEWER_INPUT_SETTINGS_H

#include "controls.h"
#include "panel.h"
#include "warp/warp.h"

enum overlay_mode { OVERLAY_LINE, OVERLAY_ALL, OVERLAY_FIGURES, OVERLAY_NONE, OVERLAY_MODE_COUNT };

/* Whether views are made here. */
enum local_views { LOCAL_OFF, LOCAL_AUTO, LOCAL_ON, LOCAL_VIEWS_COUNT };
extern const char *const local_views_names[LOCAL_VIEWS_COUNT + 1]; /* ends with NULL */

struct settings {
    enum protocol_tracer tracer;
    enum protocol_integrator integrator;
    enum protocol_tone_map tone_map;
    int exposure_thirds;             /* of a stop, added to that of the command line */
    int coarser;                     /* pixels along an edge are divided by 2 to this power */
    struct tracer_settings tracers;  /* their settings */
    bool stereo;                     /* two views in the picture .. */
    enum protocol_view_source views; /* .. of this origin */
    bool panel;                      /* lists those of the tracer .. */
    size_t setting;                  /* .. of which this one is chosen */
    enum local_views local;          /* whether views are made here .. */
    enum fl_warp_holes holes;        /* .. and how they show what nobody has seen yet */
    bool error_map, help;
    enum overlay_mode overlay;
};

#define SETTINGS_COARSEST 3

enum settings_change {
    SETTINGS_SAME,
    SETTINGS_DRAWN, /* the overlay is another */
    SETTINGS_VIEW   /* the daemon has to be told */
};
/* Whether a panel that is shown takes the key for itself. */
bool settings_is_of_panel(enum action action);
enum settings_change settings_act(struct settings *settings, enum action action);

#endif
