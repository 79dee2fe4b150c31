/* SPDX-License-Identifier: MIT */
/* Keyed values of a shot file: {"times": [..], "values": [..], "interpolation": "..", "handles": [[before,
 * after], ..]}. */
#include "read.h"
#include "options/job.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define KEYS_MAX 65536u
#define CHANNELS_MAX 4096u
#define TIME_MAX_S 1e6
/* Rotations in degrees are divided into steps below this, so that the shorter arc is the intended one. */
#define STEP_DEGREES 60.0
#define RADIANS_PER_DEGREE 0.017453292519943295

/* Keys of a property; `numbers` is the protocol's count for a value. */
struct keys {
    const struct shot_property *property;
    enum protocol_interpolation interpolation;
    size_t count;
    unsigned numbers;
    float *times;
    float *values; /* `numbers` for each key, or three times as many */
};

bool shot_is_keyed(const struct shot_value *at)
{
    return json_is_object(at->value);
}

/* ---- one value ---- */

static bool wrong_shape(const struct shot_reader *reader, const struct shot_value *at,
                        const struct shot_property *property)
{
    char remedy[160], what[64];
    if (property->kind == SHOT_FLAG)
        snprintf(what, sizeof(what), "must be true or false");
    else if (property->width == 1)
        snprintf(what, sizeof(what), "must be a number");
    else
        snprintf(what, sizeof(what), "must be an array of %s%u numbers",
                 property->kind == SHOT_COLOUR && property->width == 4 ? "3 or "
                 : property->kind == SHOT_SIZE                         ? "1 or "
                                                                       : "",
                 property->width);
    snprintf(remedy, sizeof(remedy), "for example \"%s\": %s", property->name, property->example);
    return shot_wrong(reader, at, remedy, "%s", what);
}

static bool read_scaled(const struct shot_reader *reader, const struct shot_value *at,
                        const struct shot_property *property, float *value)
{
    double number = 0;
    if (!shot_number(reader, at, property->min, property->max, &number))
        return false;
    *value = (float)(number * property->scale);
    return true;
}

/* Reads property->width numbers, scaled. */
static bool read_plain(const struct shot_reader *reader, const struct shot_value *at,
                       const struct shot_property *property, float value[4])
{
    if (property->kind == SHOT_FLAG) {
        if (!json_is_boolean(at->value))
            return wrong_shape(reader, at, property);
        value[0] = json_is_true(at->value) ? 1 : 0;
        return true;
    }
    if (property->width == 1 || (property->kind == SHOT_SIZE && json_is_number(at->value))) {
        if (!json_is_number(at->value))
            return wrong_shape(reader, at, property);
        if (!read_scaled(reader, at, property, &value[0]))
            return false;
        value[1] = value[0];
        return true;
    }
    const size_t count = json_array_size(at->value);
    const bool without_alpha = property->kind == SHOT_COLOUR && property->width == 4 && count == 3;
    if (!json_is_array(at->value) || (count != property->width && !without_alpha))
        return wrong_shape(reader, at, property);
    value[3] = 1;
    for (size_t i = 0; i < count; i++) {
        const struct shot_value number = shot_element(at, i);
        if (!json_is_number(number.value))
            return wrong_shape(reader, at, property);
        if (!read_scaled(reader, &number, property, &value[i]))
            return false;
    }
    return true;
}

/* Converts angles about x, then y, then z, each a fixed axis. */
static void quaternion_of_angles(const double degrees[3], float quaternion[4])
{
    double c[3], s[3];
    for (unsigned i = 0; i < 3; i++) {
        c[i] = cos(degrees[i] * RADIANS_PER_DEGREE / 2);
        s[i] = sin(degrees[i] * RADIANS_PER_DEGREE / 2);
    }
    quaternion[0] = (float)(s[0] * c[1] * c[2] - c[0] * s[1] * s[2]);
    quaternion[1] = (float)(c[0] * s[1] * c[2] + s[0] * c[1] * s[2]);
    quaternion[2] = (float)(c[0] * c[1] * s[2] - s[0] * s[1] * c[2]);
    quaternion[3] = (float)(c[0] * c[1] * c[2] + s[0] * s[1] * s[2]);
}

static bool read_value(const struct shot_reader *reader, const struct shot_value *at,
                       const struct shot_property *property, float value[4])
{
    float read[4] = {0};
    if (!read_plain(reader, at, property, read))
        return false;
    memcpy(value, read, sizeof(read));
    if (property->kind == SHOT_TURN) {
        const double length = sqrt((double)read[0] * (double)read[0] + (double)read[1] * (double)read[1] +
                                   (double)read[2] * (double)read[2] + (double)read[3] * (double)read[3]);
        if (!(length > 1e-6))
            return shot_wrong(reader, at, "[0, 0, 0, 1] is no rotation", "has length 0, so it is not a rotation");
        for (unsigned i = 0; i < 4; i++)
            value[i] = (float)((double)read[i] / length);
    }
    return true;
}

/* ---- keys ---- */

static bool has_handles(enum protocol_interpolation interpolation)
{
    return interpolation == PROTOCOL_INTERPOLATION_CUBIC_SPLINE || interpolation == PROTOCOL_INTERPOLATION_BEZIER;
}

static unsigned numbers_of(const struct shot_property *property)
{
    return property->kind == SHOT_ANGLES ? 4 : property->width;
}

static bool allocate(const struct shot_reader *reader, struct keys *keys, size_t count)
{
    const size_t parts = has_handles(keys->interpolation) ? 3 : 1;
    keys->count = count;
    keys->numbers = numbers_of(keys->property);
    keys->times = shot_allocate(reader, count, sizeof(float));
    keys->values = keys->times ? shot_allocate(reader, count * keys->numbers * parts, sizeof(float)) : NULL;
    return keys->values != NULL;
}

static bool read_interpolation(const struct shot_reader *reader, const struct shot_value *at, struct keys *keys)
{
    const struct shot_value given = shot_member(at, "interpolation");
    const bool is_flag = keys->property->kind == SHOT_FLAG, is_angles = keys->property->kind == SHOT_ANGLES;
    keys->interpolation = is_flag ? PROTOCOL_INTERPOLATION_STEP : PROTOCOL_INTERPOLATION_LINEAR;
    if (!given.value)
        return true;
    const char *text = json_string_value(given.value);
    if (!text || !protocol_interpolation_parse(text, &keys->interpolation)) {
        char known[160], remedy[200];
        snprintf(remedy, sizeof(remedy), "known: %s", protocol_enum_list("interpolation", known, sizeof(known)));
        return shot_wrong(reader, &given, remedy, "is not an interpolation");
    }
    if (is_flag && keys->interpolation != PROTOCOL_INTERPOLATION_STEP)
        return shot_wrong(reader, &given, "leave it out, or use step", "true and false cannot be interpolated");
    if (is_angles && keys->interpolation != PROTOCOL_INTERPOLATION_STEP &&
        keys->interpolation != PROTOCOL_INTERPOLATION_LINEAR)
        return shot_wrong(reader, &given, "use linear or step, or \"rotation\"",
                          "angles can only be interpolated by linear or step");
    return true;
}

static bool read_times(const struct shot_reader *reader, const struct shot_value *times, float *out)
{
    for (size_t i = 0; i < json_array_size(times->value); i++) {
        const struct shot_value at = shot_element(times, i);
        double time_s = 0;
        if (!shot_number(reader, &at, 0, TIME_MAX_S, &time_s))
            return false;
        out[i] = (float)time_s;
        if (i > 0 && !(out[i] > out[i - 1]))
            return shot_wrong(reader, &at, "give times in seconds, ascending",
                              "is not later than the time before it");
    }
    return true;
}

/* Reads a spline's key: the values before it, at it and after it. Without handles the velocity is zero there. */
static bool read_spline_key(const struct shot_reader *reader, const struct shot_value *handles, size_t i,
                            struct keys *keys, const float value[4])
{
    const size_t bytes = keys->numbers * sizeof(float);
    float *out = keys->values + i * keys->numbers * 3, side[4];
    const bool is_bezier = keys->interpolation == PROTOCOL_INTERPOLATION_BEZIER;
    memcpy(out + keys->numbers, value, bytes);
    if (!handles->value) {
        if (is_bezier) {
            memcpy(out, value, bytes);
            memcpy(out + keys->numbers * 2, value, bytes);
        }
        return true;
    }
    const struct shot_value pair = shot_element(handles, i);
    if (json_array_size(pair.value) != 2)
        return shot_wrong(reader, &pair, "give two values per key: before it and after it",
                          "must be an array of two values");
    /* A curve's control values may lie beyond the curve, and tangents are per second. */
    struct shot_property property = *keys->property;
    property.min = -1e12;
    property.max = 1e12;
    for (size_t k = 0; k < 2; k++) {
        const struct shot_value at = shot_element(&pair, k);
        if (!read_plain(reader, &at, &property, side))
            return false;
        if (!is_bezier && property.kind == SHOT_COLOUR && json_array_size(at.value) == 3)
            side[3] = 0; /* a missing alpha does not change */
        memcpy(out + keys->numbers * 2 * k, side, bytes);
    }
    return true;
}

static bool read_values(const struct shot_reader *reader, const struct shot_value *values,
                        const struct shot_value *handles, struct keys *keys)
{
    for (size_t i = 0; i < keys->count; i++) {
        const struct shot_value at = shot_element(values, i);
        float value[4];
        if (!read_value(reader, &at, keys->property, value))
            return false;
        if (!has_handles(keys->interpolation))
            memcpy(keys->values + i * keys->numbers, value, keys->numbers * sizeof(float));
        else if (!read_spline_key(reader, handles, i, keys, value))
            return false;
    }
    return true;
}

/* Reads angles, which are interpolated as written: [0, 0, 0] to [0, 720, 0] turns twice. */
static bool read_angles(const struct shot_reader *reader, const struct shot_value *values, struct keys *keys)
{
    const size_t written = keys->count;
    const float *times = keys->times;
    float(*degrees)[4] = shot_allocate(reader, written, sizeof(*degrees));
    if (!degrees)
        return false;
    size_t total = 1;
    for (size_t i = 0; i < written; i++) {
        const struct shot_value at = shot_element(values, i);
        if (!read_plain(reader, &at, keys->property, degrees[i]))
            return false;
        double maximum = 0;
        for (unsigned k = 0; k < 3 && i > 0; k++)
            maximum = fmax(maximum, fabs((double)degrees[i][k] - (double)degrees[i - 1][k]));
        /* The fourth number holds the number of steps from the previous key. */
        degrees[i][3] =
            keys->interpolation == PROTOCOL_INTERPOLATION_STEP ? 1 : (float)(floor(maximum / STEP_DEGREES) + 1);
        total += i > 0 ? (size_t)degrees[i][3] : 0;
        if (total > KEYS_MAX)
            return shot_wrong(reader, &at, "use fewer turns, or several shots", "turns too often");
    }
    if (!allocate(reader, keys, total))
        return false;
    size_t out = 0;
    for (size_t i = 0; i < written; i++) {
        const size_t from = i > 0 ? i - 1 : 0, steps = i > 0 ? (size_t)degrees[i][3] : 1;
        for (size_t step = 1; step <= steps; step++, out++) {
            const double t = (double)step / (double)steps;
            double angles[3];
            for (unsigned k = 0; k < 3; k++)
                angles[k] = (double)degrees[from][k] + t * ((double)degrees[i][k] - (double)degrees[from][k]);
            keys->times[out] = (float)((double)times[from] + t * ((double)times[i] - (double)times[from]));
            if (step == steps)
                keys->times[out] = times[i];
            quaternion_of_angles(angles, keys->values + 4 * out);
        }
    }
    return true;
}

static bool read_keys(const struct shot_reader *reader, const struct shot_value *at, struct keys *keys)
{
    static const char *const known[] = {"times", "values", "interpolation", "handles", NULL};
    const struct shot_value times = shot_member(at, "times"), values = shot_member(at, "values"),
                            handles = shot_member(at, "handles");
    if (!shot_is_object(reader, at, known) || !read_interpolation(reader, at, keys))
        return false;
    const char *remedy = "{\"times\": [0, 2], \"values\": [.., ..]}";
    if (!times.value || !values.value)
        return shot_wrong(reader, at, remedy, "\"%s\" is missing", !times.value ? "times" : "values");
    if (!shot_is_array(reader, &times, KEYS_MAX) || !shot_is_array(reader, &values, KEYS_MAX))
        return false;
    const size_t count = json_array_size(times.value);
    if (count == 0)
        return shot_wrong(reader, &times, remedy, "is empty");
    if (json_array_size(values.value) != count)
        return shot_wrong(reader, &values, "give one value for each time", "has %zu values for %zu times",
                          json_array_size(values.value), count);
    if (handles.value && !has_handles(keys->interpolation))
        return shot_wrong(reader, &handles, "use \"interpolation\": \"bezier\" or \"cubic-spline\"",
                          "needs the interpolation bezier or cubic-spline");
    if (handles.value && !shot_is_array(reader, &handles, KEYS_MAX))
        return false;
    if (handles.value && json_array_size(handles.value) != count)
        return shot_wrong(reader, &handles, "give one pair for each time", "has %zu pairs for %zu times",
                          json_array_size(handles.value), count);
    if (!allocate(reader, keys, count) || !read_times(reader, &times, keys->times))
        return false;
    return keys->property->kind == SHOT_ANGLES ? read_angles(reader, &values, keys)
                                               : read_values(reader, &values, &handles, keys);
}

static bool read_single(const struct shot_reader *reader, const struct shot_value *at, struct keys *keys)
{
    float value[4];
    keys->interpolation = PROTOCOL_INTERPOLATION_STEP;
    if (!allocate(reader, keys, 1) || !read_value(reader, at, keys->property, value))
        return false;
    if (keys->property->kind == SHOT_ANGLES) {
        const double degrees[3] = {(double)value[0], (double)value[1], (double)value[2]};
        quaternion_of_angles(degrees, value);
    }
    memcpy(keys->values, value, keys->numbers * sizeof(float));
    return true;
}

bool shot_channel(const struct shot_reader *reader, const struct shot_value *at,
                  const struct shot_property *property, struct fl_channel *channel)
{
    struct keys keys = {.property = property};
    if (!(shot_is_keyed(at) ? read_keys(reader, at, &keys) : read_single(reader, at, &keys)))
        return false;
    *channel = (struct fl_channel){.path = property->path,
                                   .interpolation = keys.interpolation,
                                   .width = keys.numbers,
                                   .key_count = (uint32_t)keys.count,
                                   .times = keys.times,
                                   .values = keys.values};
    return true;
}

/* Copies a place, for as long as the shot lives; NULL: out of memory. Lines are counted only for a message, as
 * that scans the file. */
static const struct fl_json_place *keep_place(const struct shot_reader *reader, const struct fl_json_place *place)
{
    struct fl_json_place *kept = shot_allocate(reader, 1, sizeof(*kept));
    if (!kept)
        return NULL;
    *kept = *place;
    if (place->outer && !(kept->outer = keep_place(reader, place->outer)))
        return NULL;
    return kept;
}

bool shot_add_channel(const struct shot_reader *reader, const struct shot_value *at,
                      const struct fl_channel *channel, enum protocol_object_kind kind, const char *target)
{
    struct cli_job *job = reader->job;
    if (!job->clips.channels)
        job->clips.channels = shot_allocate(reader, CHANNELS_MAX, sizeof(*job->clips.channels));
    if (!job->clips.channels)
        return false;
    if (job->clips.channel_count == CHANNELS_MAX)
        return shot_wrong(reader, at, "leave some out", "exceeds the maximum of %u values that change",
                          CHANNELS_MAX);
    struct cli_channel *added = &job->clips.channels[job->clips.channel_count++];
    *added = (struct cli_channel){
        .channel = *channel, .kind = kind, .target = target, .place = keep_place(reader, &at->place)};
    return added->place != NULL;
}
