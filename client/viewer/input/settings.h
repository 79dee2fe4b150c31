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
    int exposure_thirds;             /* thirds of a stop, added to the command line's exposure */
    int coarser;                     /* pixels along an edge are divided by 2 to this power */
    struct tracer_settings tracers;  /* settings of all tracers */
    bool stereo;                     /* two views in the picture .. */
    enum protocol_view_source views; /* .. from this source */
    bool panel;                      /* lists the tracer's settings .. */
    size_t setting;                  /* .. with this setting chosen */
    enum local_views local;          /* whether the client makes views .. */
    enum fl_warp_holes holes;        /* .. and how they show unknown regions */
    bool error_map, help;
    enum overlay_mode overlay;
};

#define SETTINGS_COARSEST 3

enum settings_change {
    SETTINGS_SAME,
    SETTINGS_DRAWN, /* the overlay has changed */
    SETTINGS_VIEW   /* the daemon's picture has changed */
};
/* True if an open panel handles the key. */
bool settings_is_of_panel(enum action action);
enum settings_change settings_act(struct settings *settings, enum action action);

#endif
