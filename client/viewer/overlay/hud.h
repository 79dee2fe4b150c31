/* SPDX-License-Identifier: MIT */
/* The overlay: what is drawn over the picture and where, as boxes and texts. Knows no window: whoever paints it
 * says how wide a text is. */
#ifndef FARLIGHT_VIEWER_OVERLAY_HUD_H
#define FARLIGHT_VIEWER_OVERLAY_HUD_H

#include "heat.h"
#include "edit_panel.h"
#include "mark.h"
#include "metrics.h"
#include "viewer/input/settings.h"
#include "viewer/input/tour.h"

#define HUD_STRUCTURE_MAX 4u /* parts */
#define HUD_STRUCTURE_TEXT_MAX 256u

enum hud_status { HUD_LOADING, HUD_LIVE, HUD_LOST, HUD_REFUSED };

/* Views that are made here. */
struct hud_local {
    bool on, shown; /* they are made; one is what is seen */
    double age_s;   /* of the picture that it was made from */
    double bound_pixels, unseen, sticking;
    double view_s;        /* that it took */
    uint64_t depth_bytes; /* of the last frame's bytes */
    enum fl_warp_quality quality;
};

/* What it tells of. */
struct hud_state {
    double width, height, scale; /* of the window, pixels; pixels of it in one of the desktop's */
    enum hud_status status;
    double progress;         /* HUD_LOADING: share, 0: unknown */
    const char *status_text; /* what is being done, or what went wrong */
    const char *notice;      /* for a while; empty: none */
    const char *scene, *server;
    const char *camera, *clip; /* names; empty: none */
    const struct settings *settings;
    double exposure_stops;
    double stereo_m; /* between both eyes, where there are two */
    const struct tour *tour;
    const struct metrics *metrics;
    uint64_t now_ns;
    uint32_t picture_width, picture_height, samples, samples_wanted;
    uint32_t depth, depth_less; /* bounces that were asked for, and how many fewer there are */
    bool moving;
    uint64_t revision, wire_bytes;            /* of the last frame */
    const char *structure[HUD_STRUCTURE_MAX]; /* what its tracer says of its parts; NULL: no more */
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
