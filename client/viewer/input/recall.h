/* SPDX-License-Identifier: MIT */
/* State that the viewer saves in a small JSON file: the window's place and choices of keys. The file is not
 * trusted: invalid contents are ignored. Independent of window and daemon. */
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
    int width, height; /* size of the window, pixels of the desktop; 0: unknown */
    bool has_place;
    int x, y; /* top left of the window on the desktop */
    bool full_screen;
    bool has[RECALL_COUNT]; /* keys have chosen it .. */
    int chosen[RECALL_COUNT];
};

/* The default path: farlight/viewer.json in $XDG_STATE_HOME or ~/.local/state (XDG Base Directory
 * Specification). False: there is no such folder. */
bool recall_default_path(char *path, size_t path_bytes);
/* Loads the file; a missing or broken one counts as empty. */
void recall_load(struct recall *recall, const char *path);
/* Saves the file, which appears complete or not at all; makes missing folders. */
bool recall_save(const struct recall *recall, const char *path, struct fl_error *error);

/* Applies saved choices to the settings. */
void recall_apply(const struct recall *recall, struct settings *settings);
/* Records choices that differ from the first settings. */
void recall_note(struct recall *recall, const struct settings *first, const struct settings *now);

#endif
