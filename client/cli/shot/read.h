/* SPDX-License-Identifier: MIT */
/* Shared parts of the readers of a shot file. All but the first two functions return false with the job's error
 * set. */
#ifndef FARLIGHT_CLI_SHOT_READ_H
#define FARLIGHT_CLI_SHOT_READ_H

#include "script.h"

struct shot_reader {
    struct cli_shot *shot;
    struct cli_job *job;
    const struct cli_shot_given *given;
    cli_shot_set *set;
    void *user;
};

/* A value and its place. `value` is NULL if it is missing. */
struct shot_value {
    struct fl_json_place place;
    const json_t *value;
};
struct shot_value shot_member(const struct shot_value *object, const char *key);
struct shot_value shot_element(const struct shot_value *array, size_t index);

/* Sets an error at a value. A remedy of NULL refers to the manual. */
bool shot_wrong(const struct shot_reader *reader, const struct shot_value *at, const char *remedy,
                const char *format, ...) __attribute__((format(printf, 4, 5)));
/* Checks for an object without other members than the listed ones (NULL-terminated). */
bool shot_is_object(const struct shot_reader *reader, const struct shot_value *at, const char *const *known);
/* Checks for an array of at most `maximum` elements. */
bool shot_is_array(const struct shot_reader *reader, const struct shot_value *at, size_t maximum);
/* Reads a number in [minimum, maximum]. */
bool shot_number(const struct shot_reader *reader, const struct shot_value *at, double minimum, double maximum,
                 double *number);
/* Reads a name, or a whole number as text: "Light", "0". Lives as long as the shot. */
bool shot_name(const struct shot_reader *reader, const struct shot_value *at, const char **name);
/* Reads a path relative to the file's folder. Lives as long as the shot. */
bool shot_path(const struct shot_reader *reader, const struct shot_value *at, const char **path);
/* Allocates memory that lives as long as the shot. */
void *shot_allocate(const struct shot_reader *reader, size_t count, size_t item_bytes);

/* ---- value.c: constant and keyed values ---- */

enum shot_kind {
    SHOT_NUMBERS,
    SHOT_COLOUR, /* three numbers, and alpha, which defaults to 1 */
    SHOT_SIZE,   /* two numbers, or one for both */
    SHOT_TURN,   /* quaternion */
    SHOT_ANGLES, /* degrees about x, then y, then z; converted to a quaternion */
    SHOT_FLAG    /* true and false; converted to 1 and 0 */
};
struct shot_property {
    const char *name;
    enum protocol_channel_path path;
    enum shot_kind kind;
    unsigned width; /* numbers of a value in the file */
    double min, max;
    double scale; /* factor from the file's unit to the protocol's */
    const char *example;
};
/* True for {"times": .., "values": ..}. */
bool shot_is_keyed(const struct shot_value *at);
/* Reads a channel, which has no object yet. A single value is a key at time 0. */
bool shot_channel(const struct shot_reader *reader, const struct shot_value *at,
                  const struct shot_property *property, struct fl_channel *channel);
/* Appends a channel to the job's. `target`: NULL for the view; `at` locates an unknown name. */
bool shot_add_channel(const struct shot_reader *reader, const struct shot_value *at,
                      const struct fl_channel *channel, enum protocol_object_kind kind, const char *target);

/* ---- settings.c ---- */

#define SHOT_SETTINGS_MAX 96
/* Writes at most SHOT_SETTINGS_MAX names; returns their number. */
size_t shot_setting_names(const char **names);
/* Reads the settings in the file's object. */
bool shot_settings(const struct shot_reader *reader, const struct shot_value *root);

/* ---- models.c ---- */

bool shot_models(const struct shot_reader *reader, const struct shot_value *at);

/* ---- camera.c ---- */

bool shot_camera(const struct shot_reader *reader, const struct shot_value *at);

#endif
