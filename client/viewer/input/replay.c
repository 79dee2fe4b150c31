/* SPDX-License-Identifier: MIT */
/* Reading of recorded events. */
#include "replay.h"
#include "lib/json_text.h"

#include <stdlib.h>
#include <string.h>

#define FILE_BYTES_MAX (16u << 20)
#define TIMEOUT_S 120
#define SECONDS_MAX 3600.0

struct reader {
    struct fl_json json;
    const char *path;
    struct fl_error *error;
    struct fl_json_place event; /* current event */
};

static bool refuse(struct reader *reader, const char *key, const char *what)
{
    const struct fl_json_place member = {.outer = &reader->event, .key = key};
    const struct fl_json_place *place = key ? &member : &reader->event;
    char name[96];
    fl_json_path(place, name, sizeof(name));
    return fl_error_set(reader->error, FL_ERROR_ARGUMENT, reader->path, "line %u: %s: %s",
                        fl_json_line(&reader->json, place), name, what);
}

/* Reads a number; *value stays if the event lacks the key. */
static bool read_number(struct reader *reader, const json_t *event, const char *key, double minimum,
                        double maximum, double *value)
{
    const json_t *found = json_object_get(event, key);
    if (!found)
        return true;
    const double number = json_number_value(found);
    if (!json_is_number(found) || !(number >= minimum && number <= maximum))
        return refuse(reader, key, "is not a number in its range");
    *value = number;
    return true;
}

static bool read_text(struct reader *reader, const json_t *event, const char *key, char *text, size_t text_bytes)
{
    const char *found = json_string_value(json_object_get(event, key));
    if (!found || found[0] == '\0' || strlen(found) >= text_bytes)
        return refuse(reader, key, "is not a text, or too long");
    strcpy(text, found);
    return true;
}

static bool read_mouse(struct reader *reader, const json_t *json, struct replay_event *event)
{
    static const char *const kinds[] = {"down", "up", "move"};
    static const char *const buttons[] = {"left", "middle", "right"};
    const char *kind = json_string_value(json_object_get(json, "mouse"));
    const char *button = json_string_value(json_object_get(json, "button"));
    struct input *input = &event->input;
    double clicks = 1;
    if (!read_number(reader, json, "x", -1e5, 1e5, &input->x) ||
        !read_number(reader, json, "y", -1e5, 1e5, &input->y) ||
        !read_number(reader, json, "clicks", 1, 3, &clicks))
        return false;
    input->clicks = (unsigned)clicks;
    for (int i = 0; i < 3 && button; i++)
        if (strcmp(button, buttons[i]) == 0)
            input->button = (enum input_button)i;
    for (int i = 0; i < 3 && kind; i++)
        if (strcmp(kind, kinds[i]) == 0) {
            input->kind = (enum input_kind)(INPUT_BUTTON_DOWN + i);
            return true;
        }
    return refuse(reader, "mouse", "is not one of down, up, move");
}

static bool read_wait(struct reader *reader, const json_t *json, struct replay_event *event)
{
    static const char *const names[] = {"rest", "live", "lost", "camera", "change"};
    const char *name = json_string_value(json_object_get(json, "wait"));
    double samples = 0;
    if (!read_number(reader, json, "samples", 1, 65536, &samples) ||
        !read_number(reader, json, "timeout", 0, SECONDS_MAX, &event->timeout_s))
        return false;
    event->samples = (unsigned)samples;
    for (int i = 0; i < 5 && name; i++)
        if (strcmp(name, names[i]) == 0) {
            event->kind = (enum replay_kind)(REPLAY_REST + i);
            return true;
        }
    return refuse(reader, "wait", "is not one of rest, live, lost, camera, change");
}

static bool read_resize(struct reader *reader, const json_t *json, struct replay_event *event)
{
    const json_t *size = json_object_get(json, "resize");
    const json_int_t width = json_integer_value(json_array_get(size, 0));
    const json_int_t height = json_integer_value(json_array_get(size, 1));
    if (width < 1 || width > 8192 || height < 1 || height > 8192)
        return refuse(reader, "resize", "is not [WIDTH, HEIGHT]");
    event->input = (struct input){.kind = INPUT_RESIZE, .width = (int)width, .height = (int)height, .scale = 1};
    return true;
}

/* Reads a key; a held one becomes two events. */
static bool read_key(struct reader *reader, const json_t *json, struct replay *replay, struct replay_event *event)
{
    double hold_s = 0;
    event->input.kind = INPUT_KEY_DOWN;
    if (!read_text(reader, json, "key", event->input.key, sizeof(event->input.key)) ||
        !read_number(reader, json, "hold", 0, SECONDS_MAX, &hold_s))
        return false;
    struct replay_event *release = &replay->events[++replay->count];
    *release = *event;
    release->after_s = hold_s;
    release->input.kind = INPUT_KEY_UP;
    return true;
}

static bool read_event(struct reader *reader, const json_t *json, struct replay *replay)
{
    struct replay_event *event = &replay->events[replay->count];
    *event = (struct replay_event){.number = reader->event.index, .timeout_s = TIMEOUT_S};
    event->input.shift = json_is_true(json_object_get(json, "shift"));
    event->input.ctrl = json_is_true(json_object_get(json, "ctrl"));
    if (!read_number(reader, json, "after", 0, SECONDS_MAX, &event->after_s))
        return false;
    bool good = false;
    if (json_object_get(json, "mouse")) {
        good = read_mouse(reader, json, event);
    } else if (json_object_get(json, "wheel")) {
        event->input.kind = INPUT_WHEEL;
        good = read_number(reader, json, "wheel", -1000, 1000, &event->input.wheel);
    } else if (json_object_get(json, "key")) {
        good = read_key(reader, json, replay, event);
    } else if (json_object_get(json, "text")) {
        event->input.kind = INPUT_TEXT;
        good = read_text(reader, json, "text", event->input.text, sizeof(event->input.text));
    } else if (json_object_get(json, "resize")) {
        good = read_resize(reader, json, event);
    } else if (json_object_get(json, "wait")) {
        good = read_wait(reader, json, event);
    } else if (json_object_get(json, "drop")) {
        event->input.kind = INPUT_DROP;
        event->input.path = event->path;
        good = read_text(reader, json, "drop", event->path, sizeof(event->path));
    } else if (json_object_get(json, "screenshot")) {
        event->kind = REPLAY_SCREENSHOT;
        good = read_text(reader, json, "screenshot", event->path, sizeof(event->path));
    } else if (json_object_get(json, "state")) {
        event->kind = REPLAY_STATE;
        good = read_text(reader, json, "state", event->path, 100);
    } else if (json_object_get(json, "after")) { /* a pause */
        event->kind = REPLAY_INPUT;
        event->input.kind = INPUT_KEY_UP;
        good = true;
    } else {
        return refuse(reader, NULL,
                      "is not one of mouse, wheel, key, text, resize, drop, wait, screenshot, state, after");
    }
    replay->count++;
    return good;
}

bool replay_load(struct replay *replay, const char *path, struct fl_error *error)
{
    struct reader reader = {.path = path, .error = error};
    *replay = (struct replay){0};
    if (!fl_json_load(&reader.json, path, FILE_BYTES_MAX, error))
        return false;
    const size_t count = json_array_size(reader.json.root);
    bool good = json_is_array(reader.json.root);
    if (!good)
        fl_error_set(error, FL_ERROR_ARGUMENT, path, "is not a list of events");
    replay->events = calloc(2 * count + 1, sizeof(*replay->events));
    if (good && !replay->events)
        good = fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    for (size_t i = 0; i < count && good; i++) {
        reader.event = (struct fl_json_place){.index = i};
        good = read_event(&reader, json_array_get(reader.json.root, i), replay);
    }
    fl_json_finish(&reader.json);
    if (!good)
        replay_finish(replay);
    return good;
}

void replay_finish(struct replay *replay)
{
    free(replay->events);
    *replay = (struct replay){0};
}
