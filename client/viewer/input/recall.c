/* SPDX-License-Identifier: MIT */
/* Saved choices of the viewer. */
#include "recall.h"
#include "options/image_path.h"
#include "lib/json_text.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#define FILE_BYTES_MAX 65536u
#define PATH_BYTES 4096
#define EDGE_MAX 8192
#define PLACE_MAX 65536

static const char *const choice_names[RECALL_COUNT] = {"tracer", "integrator", "tone_map", "scale",
                                                       "views",  "holes",      "overlay"};

/* NULL: there is no such value. */
static const char *text_of(enum recall_choice choice, int value)
{
    static const char *const scales[SETTINGS_COARSEST + 1] = {"1", "2", "4", "8"};
    static const char *const overlays[OVERLAY_MODE_COUNT] = {"line", "all", "figures", "none"};
    const struct tracer_desc *tracer;
    switch (choice) {
    case RECALL_TRACER:
        tracer = tracer_describe((uint32_t)value);
        return tracer && !tracer->is_for_tests ? tracer->name : NULL;
    case RECALL_INTEGRATOR:
        return value < PROTOCOL_INTEGRATOR_COUNT ? protocol_integrator_text((enum protocol_integrator)value)
                                                 : NULL;
    case RECALL_TONE_MAP:
        return value < PROTOCOL_TONE_COUNT ? protocol_tone_map_text((enum protocol_tone_map)value) : NULL;
    case RECALL_SCALE:
        return value <= SETTINGS_COARSEST ? scales[value] : NULL;
    case RECALL_VIEWS:
        return value < LOCAL_VIEWS_COUNT ? local_views_names[value] : NULL;
    case RECALL_HOLES:
        return value == FL_WARP_FILL ? "fill" : value == FL_WARP_PATTERN ? "pattern" : NULL;
    case RECALL_OVERLAY:
        return value < OVERLAY_MODE_COUNT ? overlays[value] : NULL;
    default:
        return NULL;
    }
}

static int recall_value(enum recall_choice choice, const struct settings *settings)
{
    const int values[RECALL_COUNT] = {(int)settings->tracer, (int)settings->integrator, (int)settings->tone_map,
                                      settings->coarser,     (int)settings->local,      (int)settings->holes,
                                      (int)settings->overlay};
    return values[choice];
}

void recall_apply(const struct recall *recall, struct settings *settings)
{
    const int *chosen = recall->chosen;
    if (recall->has[RECALL_TRACER])
        settings->tracer = (enum protocol_tracer)chosen[RECALL_TRACER];
    if (recall->has[RECALL_INTEGRATOR])
        settings->integrator = (enum protocol_integrator)chosen[RECALL_INTEGRATOR];
    if (recall->has[RECALL_TONE_MAP])
        settings->tone_map = (enum protocol_tone_map)chosen[RECALL_TONE_MAP];
    if (recall->has[RECALL_SCALE])
        settings->coarser = chosen[RECALL_SCALE];
    if (recall->has[RECALL_VIEWS])
        settings->local = (enum local_views)chosen[RECALL_VIEWS];
    if (recall->has[RECALL_HOLES])
        settings->holes = (enum fl_warp_holes)chosen[RECALL_HOLES];
    if (recall->has[RECALL_OVERLAY])
        settings->overlay = (enum overlay_mode)chosen[RECALL_OVERLAY];
}

void recall_note(struct recall *recall, const struct settings *first, const struct settings *now)
{
    for (int i = 0; i < RECALL_COUNT; i++) {
        const int value = recall_value((enum recall_choice)i, now);
        if (value == recall_value((enum recall_choice)i, first) || !text_of((enum recall_choice)i, value))
            continue;
        recall->has[i] = true;
        recall->chosen[i] = value;
    }
}

/* ---- the file ---- */

bool recall_default_path(char *path, size_t path_bytes)
{
    const char *state = getenv("XDG_STATE_HOME"), *home = getenv("HOME");
    int length = -1;
    if (state && state[0] == '/')
        length = snprintf(path, path_bytes, "%s/farlight/viewer.json", state);
    else if (home && home[0] == '/')
        length = snprintf(path, path_bytes, "%s/.local/state/farlight/viewer.json", home);
    return length > 0 && (size_t)length < path_bytes;
}

/* Reads an integer of the object within a range. */
static bool read_int(const json_t *root, const char *key, int minimum, int maximum, int *value)
{
    const json_t *found = json_object_get(root, key);
    const json_int_t number = json_integer_value(found);
    if (!json_is_integer(found) || number < minimum || number > maximum)
        return false;
    *value = (int)number;
    return true;
}

static void read_choice(struct recall *recall, const json_t *root, enum recall_choice choice)
{
    const char *found = json_string_value(json_object_get(root, choice_names[choice]));
    const char *text;
    for (int value = 0; found && value < 64; value++) { /* numbers of tracers may have gaps */
        text = text_of(choice, value);
        if (!text || strcmp(text, found) != 0)
            continue;
        recall->has[choice] = true;
        recall->chosen[choice] = value;
    }
}

void recall_load(struct recall *recall, const char *path)
{
    struct fl_json json;
    struct fl_error ignored;
    struct stat status;
    *recall = (struct recall){0};
    /* Opening a FIFO would block. */
    if (stat(path, &status) < 0 || !S_ISREG(status.st_mode) ||
        !fl_json_load(&json, path, FILE_BYTES_MAX, &ignored))
        return;
    const json_t *root = json.root;
    int width, height;
    if (read_int(root, "width", 64, EDGE_MAX, &width) && read_int(root, "height", 64, EDGE_MAX, &height)) {
        recall->width = width;
        recall->height = height;
    }
    recall->has_place = read_int(root, "x", -PLACE_MAX, PLACE_MAX, &recall->x) &&
                        read_int(root, "y", -PLACE_MAX, PLACE_MAX, &recall->y);
    recall->full_screen = json_is_true(json_object_get(root, "full_screen"));
    for (int i = 0; i < RECALL_COUNT; i++)
        read_choice(recall, root, (enum recall_choice)i);
    fl_json_finish(&json);
}

static char *print(const struct recall *recall)
{
    json_t *root = json_object();
    if (recall->width > 0) {
        json_object_set_new(root, "width", json_integer(recall->width));
        json_object_set_new(root, "height", json_integer(recall->height));
    }
    if (recall->has_place) {
        json_object_set_new(root, "x", json_integer(recall->x));
        json_object_set_new(root, "y", json_integer(recall->y));
    }
    if (recall->full_screen)
        json_object_set_new(root, "full_screen", json_true());
    for (int i = 0; i < RECALL_COUNT; i++)
        if (recall->has[i])
            json_object_set_new(root, choice_names[i],
                                json_string(text_of((enum recall_choice)i, recall->chosen[i])));
    char *text = json_dumps(root, JSON_INDENT(2));
    json_decref(root);
    return text;
}

bool recall_save(const struct recall *recall, const char *path, struct fl_error *error)
{
    char folder[PATH_BYTES];
    const char *slash = strrchr(path, '/');
    if (strlen(path) >= sizeof(folder))
        return fl_error_set(error, FL_ERROR_FILE, "", "the path of the file is too long");
    snprintf(folder, sizeof(folder), "%.*s", slash ? (int)(slash - path) : 0, path);
    if (folder[0] != '\0' && !cli_make_folder(folder, error))
        return false;
    char *text = print(recall);
    const bool done =
        text ? cli_write_text(path, text, 0600, error) : fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    free(text);
    return done;
}
