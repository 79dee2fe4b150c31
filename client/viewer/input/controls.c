/* SPDX-License-Identifier: MIT */
/* Bindings of keys, and camera controls. */
#include "controls.h"

#include <math.h>
#include <string.h>

#define ORBIT_RADIANS_PER_HEIGHT 3.5 /* for the window's height: a little more than half a turn */
#define TURN_RADIANS_PER_HEIGHT 1.6
#define DOLLY_PER_NOTCH 0.88 /* factor of the distance */
#define MIN_SHARE 1e-4       /* minimum share of the distance after a notch */
#define FLY_DISTANCES_PER_SECOND 0.8
#define FLY_FAST 4.0

const struct binding input_bindings[] = {
    {"Left drag", NULL, ACTION_NONE, ACTION_NONE, "orbit"},
    {"Shift + left drag, middle drag", NULL, ACTION_NONE, ACTION_NONE, "pan"},
    {"Right drag", NULL, ACTION_NONE, ACTION_NONE, "look around"},
    {"Wheel", NULL, ACTION_NONE, ACTION_NONE, "move nearer, farther"},
    {"Double click, F", "f", ACTION_FOCUS, ACTION_FOCUS, "focus on the surface under the pointer"},
    {"W A S D, Q E", NULL, ACTION_NONE, ACTION_NONE, "fly; Shift: faster"},
    {"Home, H", "home", ACTION_HOME, ACTION_HOME, "back to the first camera"},
    {NULL, "h", ACTION_HOME, ACTION_HOME, NULL},
    {"C, Shift+C", "c", ACTION_NEXT_CAMERA, ACTION_PREVIOUS_CAMERA, "next, previous camera of the scene"},
    {"V, Shift+V", "v", ACTION_NEXT_CLIP, ACTION_PREVIOUS_CLIP, "next, previous clip"},
    {"Space", "space", ACTION_PLAY, ACTION_PLAY, "play, pause"},
    {", .", ",", ACTION_SLOWER, ACTION_SLOWER, "slower, faster"},
    {NULL, ".", ACTION_FASTER, ACTION_FASTER, NULL},
    {"Left, Right", "left", ACTION_STEP_BACK, ACTION_STEP_BACK, "one step back, forward in the clip"},
    {NULL, "right", ACTION_STEP_ON, ACTION_STEP_ON, NULL},
    {"T, Shift+T", "t", ACTION_NEXT_TRACER, ACTION_PREVIOUS_TRACER, "next, previous tracer"},
    {"P", "p", ACTION_PANEL, ACTION_PANEL, "settings of the tracer; arrows choose and change"},
    {NULL, "up", ACTION_UP, ACTION_UP, NULL},
    {NULL, "down", ACTION_DOWN, ACTION_DOWN, NULL},
    {"Ctrl + click, K", "k", ACTION_PICK, ACTION_PICK, "edit the object under the pointer"},
    {"N", "n", ACTION_EDIT, ACTION_EDIT, "its fields; arrows, drags and numbers change them"},
    {"Tab, Shift+Tab", "tab", ACTION_EDIT_NEXT, ACTION_EDIT_PREVIOUS, "node, material, lights, environment"},
    {"Z, Shift+Z", "z", ACTION_UNDO, ACTION_REDO, "undo, redo changes"},
    {NULL, "y", ACTION_REDO, ACTION_REDO, NULL},
    {"I, Shift+I", "i", ACTION_NEXT_INTEGRATOR, ACTION_PREVIOUS_INTEGRATOR, "next, previous integrator"},
    {"B, Shift+B", "b", ACTION_STEREO, ACTION_VIEW_SOURCE, "both eyes, or one; from layers, or rendered"},
    {"[ ]", "[", ACTION_DARKER, ACTION_DARKER, "darker, brighter by a third of a stop"},
    {NULL, "]", ACTION_BRIGHTER, ACTION_BRIGHTER, NULL},
    {"M", "m", ACTION_NEXT_TONE_MAP, ACTION_NEXT_TONE_MAP, "next tone map"},
    {"- =", "-", ACTION_COARSER, ACTION_COARSER, "fewer, more pixels"},
    {NULL, "=", ACTION_FINER, ACTION_FINER, NULL},
    {"L, Shift+L", "l", ACTION_LOCAL, ACTION_HOLES, "views made here: off, auto, on; mark holes"},
    {"X", "x", ACTION_ERROR_MAP, ACTION_ERROR_MAP, "errors against the reference, as heat"},
    {"O, Shift+O", "o", ACTION_OVERLAY, ACTION_OVERLAY_BACK, "figures and timeline, figures, nothing, one line"},
    {"F1", "f1", ACTION_HELP, ACTION_HELP, "this list"},
    {"F11", "f11", ACTION_FULL_SCREEN, ACTION_FULL_SCREEN, "full screen"},
    {"F12", "f12", ACTION_SCREENSHOT, ACTION_SCREENSHOT, "write farlight-N.png"},
    {"Escape", "escape", ACTION_QUIT, ACTION_QUIT, "close"},
};
const size_t input_binding_count = sizeof(input_bindings) / sizeof(input_bindings[0]);

enum action input_action(const struct input *input)
{
    for (size_t i = 0; i < input_binding_count; i++)
        if (input_bindings[i].key && strcmp(input_bindings[i].key, input->key) == 0)
            return input->shift ? input_bindings[i].with_shift : input_bindings[i].plain;
    return ACTION_NONE;
}

void input_print_bindings(FILE *out)
{
    for (size_t i = 0; i < input_binding_count; i++)
        if (input_bindings[i].keys)
            fprintf(out, "  %-31s %s\n", input_bindings[i].keys, input_bindings[i].doc);
}

/* ---- the camera's way ---- */

static bool drag(struct controls *controls, const struct input *input, double height, struct viewer_camera *camera)
{
    const double right = (input->x - controls->x) / height, down = (input->y - controls->y) / height;
    controls->x = input->x;
    controls->y = input->y;
    if (right == 0 && down == 0)
        return false;
    if (controls->dragging[INPUT_MIDDLE] || (controls->dragging[INPUT_LEFT] && controls->shift))
        camera_pan(camera, -right, down);
    else if (controls->dragging[INPUT_RIGHT])
        camera_turn(camera, right * TURN_RADIANS_PER_HEIGHT, -down * TURN_RADIANS_PER_HEIGHT);
    else if (controls->dragging[INPUT_LEFT])
        /* The dragged scene follows the pointer, so the eye moves the other way. */
        camera_orbit(camera, right * ORBIT_RADIANS_PER_HEIGHT, -down * ORBIT_RADIANS_PER_HEIGHT);
    else
        return false;
    return true;
}

static void hold(struct controls *controls, const struct input *input)
{
    static const char keys[FLY_COUNT] = {'w', 's', 'a', 'd', 'e', 'q'};
    controls->fast = input->shift;
    for (int i = 0; i < FLY_COUNT; i++)
        if (input->key[0] == keys[i] && input->key[1] == '\0')
            controls->held[i] = input->kind == INPUT_KEY_DOWN;
}

bool controls_input(struct controls *controls, const struct input *input, double height,
                    struct viewer_camera *camera)
{
    switch (input->kind) {
    case INPUT_BUTTON_DOWN:
        controls->shift = input->shift;
        controls->x = input->x;
        controls->y = input->y;
        controls->dragging[input->button] = true;
        return false;
    case INPUT_BUTTON_UP:
        controls->dragging[input->button] = false;
        return false;
    case INPUT_MOTION:
        return drag(controls, input, height, camera);
    case INPUT_WHEEL:
        camera_dolly(camera, pow(DOLLY_PER_NOTCH, input->wheel), camera_distance(camera) * MIN_SHARE);
        return input->wheel != 0;
    case INPUT_KEY_DOWN:
    case INPUT_KEY_UP:
        hold(controls, input);
        return false;
    case INPUT_FOCUS_LOST: /* buttons and keys that are released now are not reported */
        *controls = (struct controls){.x = controls->x, .y = controls->y};
        return false;
    default:
        return false;
    }
}

bool controls_fly(struct controls *controls, double seconds, struct viewer_camera *camera)
{
    const double speed =
        camera_distance(camera) * FLY_DISTANCES_PER_SECOND * (controls->fast ? FLY_FAST : 1) * seconds;
    const bool *held = controls->held;
    const double metres[3] = {(held[FLY_RIGHT] - held[FLY_LEFT]) * speed, (held[FLY_UP] - held[FLY_DOWN]) * speed,
                              (held[FLY_FORWARD] - held[FLY_BACK]) * speed};
    if (metres[0] == 0 && metres[1] == 0 && metres[2] == 0)
        return false;
    camera_fly(camera, metres);
    return true;
}
