/* SPDX-License-Identifier: MIT */
/* Events of mouse and keyboard, and their meaning. Independent of the window: a real one and a replay create
 * the same events. */
#ifndef FARLIGHT_VIEWER_INPUT_CONTROLS_H
#define FARLIGHT_VIEWER_INPUT_CONTROLS_H

#include "camera.h"

#include <stdio.h>

enum input_kind {
    INPUT_BUTTON_DOWN,
    INPUT_BUTTON_UP,
    INPUT_MOTION,
    INPUT_WHEEL,
    INPUT_KEY_DOWN,
    INPUT_KEY_UP,
    INPUT_TEXT,
    INPUT_RESIZE,
    INPUT_FOCUS_LOST,
    INPUT_DROP,
    INPUT_QUIT
};

enum input_button { INPUT_LEFT, INPUT_MIDDLE, INPUT_RIGHT };

struct input {
    enum input_kind kind;
    enum input_button button;
    unsigned clicks;   /* 2 for the second press of a double click */
    double x, y;       /* pointer, pixels of the window from its top left */
    double wheel;      /* notches away from the user */
    char key[16];      /* the key's label, in small letters: "a", "f1", "space", "[" */
    bool shift, ctrl;  /* held modifiers */
    char text[16];     /* INPUT_TEXT: typed text, by any keys */
    int width, height; /* new size of the window, pixels */
    double scale;      /* pixels of the window per pixel of the desktop, for text */
    const char *path;  /* file dropped on the window; valid until the next event */
};

/* Immediate effects of keys. */
enum action {
    ACTION_NONE,
    ACTION_QUIT,
    ACTION_HELP,
    ACTION_OVERLAY,
    ACTION_OVERLAY_BACK,
    ACTION_FULL_SCREEN,
    ACTION_SCREENSHOT,
    ACTION_HOME,
    ACTION_FOCUS,
    ACTION_NEXT_CAMERA,
    ACTION_PREVIOUS_CAMERA,
    ACTION_NEXT_CLIP,
    ACTION_PREVIOUS_CLIP,
    ACTION_PLAY,
    ACTION_SLOWER,
    ACTION_FASTER,
    ACTION_STEP_BACK,
    ACTION_STEP_ON,
    ACTION_NEXT_TRACER,
    ACTION_PREVIOUS_TRACER,
    ACTION_NEXT_INTEGRATOR,
    ACTION_PREVIOUS_INTEGRATOR,
    ACTION_DARKER,
    ACTION_BRIGHTER,
    ACTION_NEXT_TONE_MAP,
    ACTION_COARSER,
    ACTION_FINER,
    ACTION_ERROR_MAP,
    ACTION_STEREO,
    ACTION_VIEW_SOURCE,
    ACTION_LOCAL,
    ACTION_HOLES,
    ACTION_PANEL,
    ACTION_UP,
    ACTION_DOWN,
    ACTION_PICK,
    ACTION_EDIT,
    ACTION_EDIT_NEXT,
    ACTION_EDIT_PREVIOUS,
    ACTION_UNDO,
    ACTION_REDO,
};

/* A line of the list of keys; keys with action NONE are held, or belong to the mouse. */
struct binding {
    const char *keys; /* label: "T, Shift+T" */
    const char *key;  /* key as in struct input; NULL: held, or the mouse */
    enum action plain, with_shift;
    const char *doc;
};
extern const struct binding input_bindings[];
extern const size_t input_binding_count;

enum action input_action(const struct input *input); /* for a pressed key */
void input_print_bindings(FILE *out);

/* ---- the camera's way ---- */

enum fly_key { FLY_FORWARD, FLY_BACK, FLY_LEFT, FLY_RIGHT, FLY_UP, FLY_DOWN, FLY_COUNT };

/* Held buttons and keys; initially zero. */
struct controls {
    bool dragging[3]; /* by enum input_button */
    bool shift;       /* held when the drag began */
    double x, y;      /* pointer, pixels */
    bool held[FLY_COUNT], fast;
};

/* Processes an event; true: it moved the camera. `height` is the window's, pixels. */
bool controls_input(struct controls *controls, const struct input *input, double height,
                    struct viewer_camera *camera);
/* Moves the camera by held keys for `seconds`; true: it has moved. */
bool controls_fly(struct controls *controls, double seconds, struct viewer_camera *camera);

#endif
