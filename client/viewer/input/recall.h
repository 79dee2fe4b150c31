/* SPDX-License-Identifier: MIT */
/* What the viewer remembers from one time to the next, in a small JSON file: the window's place and what keys have
 * chosen. The file is not trusted: what it must not hold is passed over. Independent of window and daemon. */
#ifndef FARLIGHT_VIEWER_INPUT_RECALL_H
#define FARLIGHT_VIEWER_INPUT_RECALL_H

#include "settings.h"

enum recall_choice {
    RECALL_TRACER,
    RECALL_INTEGRATOR,
    RECALL_TONE_MAP,
    RECALL_SCALE,
    RECALL_VIEWS,
    RECALL_HOLES,
    RECALL_OVERLAY,
    RECALL_COUNT
};

struct recall {
    int width, height; /* of the window, pixels of the desktop; 0: not known */
    bool has_place;
    int x, y; /* of its top left on the desktop */
    bool full_screen;
    bool has[RECALL_COUNT]; /* keys have chosen it .. */
    int chosen[RECALL_COUNT];
};

/* Where it is by default: farlight/viewer.json in $XDG_STATE_HOME or ~/.local/state (XDG Base Directory
 * Specification). False: there is no such folder. */
bool recall_default_path(char *path, size_t path_bytes);
/* A missing or broken file is as an empty one. */
void recall_load(struct recall *recall, const char *path);
/* Makes missing folders; the file appears complete or not at all. */
bool recall_save(const struct recall *recall, const char *path, struct fl_error *error);

/* A choice as a number, and back. */
void recall_apply(const struct recall *recall, struct settings *settings);
/* Notes what is another than it was at first. */
void recall_note(struct recall *recall, const struct settings *first, const struct settings *now);

#endif
