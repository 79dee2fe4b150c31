/* SPDX-License-Identifier: MIT */
/* Events of mouse and keyboard, and their meaning. Independent of the window: a real one and a replay both create
 * them. */
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
    unsigned clicks;   /* of a button that goes down: 2 for the second of a double click */
    double x, y;       /* pointer, pixels of the window from its top left */
    double wheel;      /* notches away from the person */
    char key[16];      /* as the key is labelled, in small letters: "a", "f1", "space", "[" */
    bool shift, ctrl;  /* held */
    char text[16];     /* INPUT_TEXT: what was typed, by whatever keys */
    int width, height; /* of a window of another size, pixels */
    double scale;      /* pixels of the window per pixel of the desktop, for text */
    const char *path;  /* of a file that is dropped on the window; until the next event */
};

/* What a key does at once. */
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

/* One line of the list of keys; those with action NONE are held down or of the mouse. */
struct binding {
    const char *keys; /* as shown: "T, Shift+T" */
    const char *key;  /* as of struct input; NULL: of the mouse, or held */
    enum action plain, with_shift;
    const char *doc;
};
extern const struct binding input_bindings[];
extern const size_t input_binding_count;

enum action input_action(const struct input *input); /* of a key that went down */
void input_print_bindings(FILE *out);

/* ---- the camera's way ---- */

enum fly_key { FLY_FORWARD, FLY_BACK, FLY_LEFT, FLY_RIGHT, FLY_UP, FLY_DOWN, FLY_COUNT };

/* What is held. All zero at first. */
struct controls {
    bool dragging[3]; /* by enum input_button */
    bool shift;       /* while the drag began */
    double x, y;      /* of the pointer, pixels */
    bool held[FLY_COUNT], fast;
};

/* True: it moved the camera. `height` of the window, pixels. */
bool controls_input(struct controls *controls, const struct input *input, double height,
                    struct viewer_camera *camera);
/* True: held keys moved it during the last `seconds`. */
bool controls_fly(struct controls *controls, double seconds, struct viewer_camera *camera);

#endif
