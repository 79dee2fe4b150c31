/* SPDX-License-Identifier: MIT */
/* A list of timed events in JSON that replaces a user. Independent of the window. */
#ifndef FARLIGHT_VIEWER_INPUT_REPLAY_H
#define FARLIGHT_VIEWER_INPUT_REPLAY_H

#include "controls.h"

enum replay_kind {
    REPLAY_INPUT, /* a dropped file is `path` */
    /* Wait until the picture is at rest, with all samples or `samples` of them, or the map has arrived */
    REPLAY_REST,
    REPLAY_LIVE,       /* wait until the scene is loaded */
    REPLAY_LOST,       /* wait until the connection is lost */
    REPLAY_CAMERA,     /* wait until the picture shows the newest camera, from the daemon or made in the client */
    REPLAY_CHANGE,     /* wait until the scene has changed since the previous event */
    REPLAY_SCREENSHOT, /* into `path` */
    REPLAY_STATE       /* a line of JSON on standard output */
};

struct replay_event {
    enum replay_kind kind;
    size_t number;  /* index in the file */
    double after_s; /* since the end of the previous event */
    struct input input;
    unsigned samples; /* 0: all */
    double timeout_s; /* limit of a wait */
    char path[4096];
};

struct replay {
    struct replay_event *events;
    size_t count;
};

/* Reads
 *   [{"mouse": "down", "button": "left", "x": 100, "y": 80, "clicks": 1, "shift": false, "ctrl": false},
 *    {"mouse": "move", "x": 120, "y": 80, "after": 0.02}, {"mouse": "up", "button": "left", "x": 120, "y": 80},
 *    {"wheel": 2}, {"key": "t", "shift": true}, {"key": "w", "hold": 0.5}, {"text": "0.5"},
 *    {"resize": [640, 360]}, {"drop": "teapot.glb"}, {"wait": "rest", "samples": 8, "timeout": 60},
 *    {"wait": "live"}, {"wait": "lost"}, {"wait": "camera"}, {"wait": "change"},
 *    {"screenshot": "a.png"}, {"state": "name"}]
 * "after" is in seconds since the previous event was finished, default 0. Errors name the file, the line and the
 * event.
 */
bool replay_load(struct replay *replay, const char *path, struct fl_error *error);
void replay_finish(struct replay *replay);

#endif
