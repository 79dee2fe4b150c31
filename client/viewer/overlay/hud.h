/* SPDX-License-Identifier: MIT */
/* The overlay over the picture, as a list of boxes and texts with places. Independent of the window: its
 * painter measures texts. */
#ifndef FARLIGHT_VIEWER_OVERLAY_HUD_H
#define FARLIGHT_VIEWER_OVERLAY_HUD_H

#include "heat.h"
#include "edit_panel.h"
#include "mark.h"
#include "metrics.h"
#include "viewer/input/settings.h"
#include "viewer/input/tour.h"

#define HUD_STRUCTURE_MAX 4u /* number of parts */
#define HUD_STRUCTURE_TEXT_MAX 256u

enum hud_status { HUD_LOADING, HUD_LIVE, HUD_LOST, HUD_REFUSED };

/* Views made in the client. */
struct hud_local {
    bool on, shown; /* the client makes views; the shown picture is one */
    double age_s;   /* age of the picture that the view was made from */
    double bound_pixels, unseen, sticking;
    double view_s;        /* duration of making the view */
    uint64_t depth_bytes; /* size of the last frame's depth */
    enum fl_warp_quality quality;
};

/* The state that the overlay shows. */
struct hud_state {
    double width, height, scale; /* size of the window in pixels; its pixels in one of the desktop's */
    enum hud_status status;
    double progress;         /* HUD_LOADING: share, 0: unknown */
    const char *status_text; /* current activity, or the fault */
    const char *notice;      /* a temporary notice; empty: none */
    const char *scene, *server;
    const char *camera, *clip; /* names; empty: none */
    const struct settings *settings;
    double exposure_stops;
    double stereo_m; /* distance between the eyes, for two views */
    const struct tour *tour;
    const struct metrics *metrics;
    uint64_t now_ns;
    uint32_t picture_width, picture_height, samples, samples_wanted;
    uint32_t depth, depth_less; /* requested bounces, and how many fewer the frame has */
    bool moving;
    uint64_t revision, wire_bytes;            /* the last frame's */
    const char *structure[HUD_STRUCTURE_MAX]; /* reports on the tracer's parts; NULL ends the list */
    enum protocol_encoding encoding;
    unsigned quality;
    struct hud_local local;
    const struct hud_edit *edit; /* NULL: none */
    enum { HUD_HEAT_NONE, HUD_HEAT_WAITING, HUD_HEAT_SHOWN } heat;
    struct heat_figures heat_figures;
    double heat_top;
};

void hud_layout(struct hud *hud, const struct hud_state *state, hud_measure *measure, void *user);

#endif
