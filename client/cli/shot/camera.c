/* SPDX-License-Identifier: MIT */
/* The camera of a shot file: one of the model's, or eye, look_at, up and fov, each constant or keyed; an orbit
 * or a dolly; the lens. */
#include "read.h"
#include "script.h"
#include "options/job.h"

#include <string.h>

#define RADIANS_PER_DEGREE 0.017453292519943295

enum view { EYE, LOOK_AT, UP, FOV, APERTURE, FOCUS, EXPOSURE, VIEW_COUNT };

static const struct shot_property properties[VIEW_COUNT] = {
    {"eye", PROTOCOL_CHANNEL_VIEW_EYE, SHOT_NUMBERS, 3, -1e12, 1e12, 1, "[3, 2, 4]"},
    {"look_at", PROTOCOL_CHANNEL_VIEW_LOOK_AT, SHOT_NUMBERS, 3, -1e12, 1e12, 1, "[0, 1, 0]"},
    {"up", PROTOCOL_CHANNEL_VIEW_UP, SHOT_NUMBERS, 3, -1e6, 1e6, 1, "[0, 1, 0]"},
    {"fov", PROTOCOL_CHANNEL_VIEW_FOV_Y, SHOT_NUMBERS, 1, 0.1, 177, RADIANS_PER_DEGREE, "40"},
    {"aperture", PROTOCOL_CHANNEL_VIEW_APERTURE, SHOT_NUMBERS, 1, 0, 1e6, 1, "0.05"},
    {"focus", PROTOCOL_CHANNEL_VIEW_FOCUS, SHOT_NUMBERS, 1, 0, 1e12, 1, "3.2"},
    {"exposure", PROTOCOL_CHANNEL_VIEW_EXPOSURE, SHOT_NUMBERS, 1, -64, 64, 1, "-0.5"}};

/* The value of the first key. */
static const float *first_value(const struct fl_channel *channel)
{
    const bool has_handles = channel->interpolation == PROTOCOL_INTERPOLATION_CUBIC_SPLINE ||
                             channel->interpolation == PROTOCOL_INTERPOLATION_BEZIER;
    return channel->values + (has_handles ? channel->width : 0);
}

/* Reads a property: its first value, and a channel if it changes. */
static bool read_view(const struct shot_reader *reader, const struct shot_value *at, enum view which, float *first)
{
    struct fl_channel channel;
    if (!shot_channel(reader, at, &properties[which], &channel))
        return false;
    memcpy(first, first_value(&channel), channel.width * sizeof(*first));
    return (!shot_is_keyed(at) && which != EXPOSURE) ||
           shot_add_channel(reader, at, &channel, PROTOCOL_OBJECT_CAMERA, NULL);
}

/* ---- where it is ---- */

static bool read_orbit(const struct shot_reader *reader, const struct shot_value *at)
{
    static const char *const known[] = {"degrees", "seconds", NULL};
    struct cli_series *series = &reader->job->series;
    const struct shot_value degrees = shot_member(at, "degrees"), seconds = shot_member(at, "seconds");
    reader->job->camera.is_orbit = !json_is_false(at->value);
    if (json_is_boolean(at->value))
        return true;
    if (json_is_number(at->value))
        return shot_number(reader, at, -1e6, 1e6, &series->orbit_degrees);
    if (!json_is_object(at->value))
        return shot_wrong(reader, at, "\"orbit\": {\"degrees\": 360, \"seconds\": 10}",
                          "must be true, degrees, or an object");
    return shot_is_object(reader, at, known) &&
           (!degrees.value || shot_number(reader, &degrees, -1e6, 1e6, &series->orbit_degrees)) &&
           (!seconds.value || shot_number(reader, &seconds, 1e-3, 1e6, &series->orbit_seconds));
}

/* Reads the end of a dolly: a point, or a share of the distance to the target. */
static bool dolly_end(const struct shot_reader *reader, const struct shot_value *at, float to[3])
{
    const struct record_camera_key *key = &reader->job->camera.key;
    const struct shot_value place = shot_member(at, "to"), by = shot_member(at, "by");
    double metres = 0, length2 = 0;
    if (!place.value == !by.value)
        return shot_wrong(reader, at, "\"dolly\": {\"to\": [1, 2, 3]}, or {\"by\": 2}",
                          "needs either \"to\" or \"by\"");
    if (place.value) {
        struct fl_channel channel;
        if (shot_is_keyed(&place))
            return shot_wrong(reader, &place, "key \"eye\" instead", "must be a single position");
        if (!shot_channel(reader, &place, &properties[EYE], &channel))
            return false;
        memcpy(to, channel.values, 3 * sizeof(*to));
        return true;
    }
    if (!shot_number(reader, &by, -1e12, 1e12, &metres))
        return false;
    for (unsigned i = 0; i < 3; i++) {
        const double part = (double)key->look_at_world[i] - (double)key->eye_world[i];
        length2 += part * part;
    }
    if (!(length2 > 0))
        return shot_wrong(reader, at, "move one of them", "\"look_at\" and \"eye\" are the same point");
    for (unsigned i = 0; i < 3; i++) {
        const double part = (double)key->look_at_world[i] - (double)key->eye_world[i];
        to[i] = (float)((double)key->eye_world[i] + metres * part / __builtin_sqrt(length2));
    }
    return true;
}

/* Reads a dolly as two keys of the eye; the time of the second may depend on the range of frames. */
static bool read_dolly(const struct shot_reader *reader, const struct shot_value *at)
{
    static const char *const known[] = {"to", "by", "seconds", "ease", NULL};
    struct cli_series *series = &reader->job->series;
    const struct shot_value seconds = shot_member(at, "seconds"), ease = shot_member(at, "ease");
    float to[3];
    if (!shot_is_object(reader, at, known) || !dolly_end(reader, at, to) ||
        (seconds.value && !shot_number(reader, &seconds, 1e-3, 1e6, &series->dolly_seconds)))
        return false;
    if (ease.value && !json_is_boolean(ease.value))
        return shot_wrong(reader, &ease, "\"ease\": true", "must be true or false");
    float *times = shot_allocate(reader, 2, sizeof(*times));
    float(*values)[3] = times ? shot_allocate(reader, 6, sizeof(*values)) : NULL;
    if (!values)
        return false;
    series->dolly_times = times;
    times[1] = 1; /* replaced when the range is settled */
    const bool eases = json_is_true(ease.value);
    const size_t parts =
        /* A Bezier key has three equal values, before, itself and after: the velocity is zero there */
        eases ? 3 : 1;
    for (size_t i = 0; i < parts; i++) {
        memcpy(values[i], reader->job->camera.key.eye_world, sizeof(*values));
        memcpy(values[parts + i], to, sizeof(*values));
    }
    const struct fl_channel channel = {.path = PROTOCOL_CHANNEL_VIEW_EYE,
                                       .interpolation =
                                           eases ? PROTOCOL_INTERPOLATION_BEZIER : PROTOCOL_INTERPOLATION_LINEAR,
                                       .width = 3,
                                       .key_count = 2,
                                       .times = times,
                                       .values = values[0]};
    return shot_add_channel(reader, at, &channel, PROTOCOL_OBJECT_CAMERA, NULL);
}

/* Checks for members that exclude each other. */
static bool check_place(const struct shot_reader *reader, const struct shot_value *at,
                        const struct shot_value view[VIEW_COUNT])
{
    const struct shot_value name = shot_member(at, "name"), orbit = shot_member(at, "orbit"),
                            dolly = shot_member(at, "dolly");
    const bool has_place = view[EYE].value || view[LOOK_AT].value;
    const bool orbits = orbit.value && !json_is_false(orbit.value);
    if (name.value && (has_place || view[UP].value || view[FOV].value || orbits || dolly.value))
        return shot_wrong(reader, &name, "leave \"name\" out, or eye, look_at, up, fov, orbit and dolly",
                          "a camera of the model has its own position and view");
    if (!view[EYE].value != !view[LOOK_AT].value)
        return shot_wrong(reader, at, "give both \"eye\" and \"look_at\"", "\"%s\" is missing",
                          !view[EYE].value ? "eye" : "look_at");
    if (!has_place && (view[UP].value || view[FOV].value || dolly.value))
        return shot_wrong(reader, at, "give the position of the camera", "\"eye\" and \"look_at\" are missing");
    for (enum view which = EYE; which <= FOV; which++)
        if (orbits && shot_is_keyed(&view[which]))
            return shot_wrong(reader, &view[which],
                              "leave \"orbit\" out and key the whole path, or give a single value",
                              "cannot change on an orbit");
    if (dolly.value && (orbits || shot_is_keyed(&view[EYE])))
        return shot_wrong(reader, &dolly, "leave one of them out",
                          "cannot be combined with an orbit or a keyed eye");
    return true;
}

static bool read_place(const struct shot_reader *reader, const struct shot_value *at,
                       const struct shot_value view[VIEW_COUNT])
{
    struct cli_job *job = reader->job;
    const struct shot_value name = shot_member(at, "name"), orbit = shot_member(at, "orbit"),
                            dolly = shot_member(at, "dolly");
    if (!check_place(reader, at, view))
        return false;
    if (name.value && !shot_name(reader, &name, &job->camera.name))
        return false;
    if (view[EYE].value) {
        job->camera.has_eye = job->camera.has_look_at = true;
        if (!read_view(reader, &view[EYE], EYE, job->camera.key.eye_world) ||
            !read_view(reader, &view[LOOK_AT], LOOK_AT, job->camera.key.look_at_world))
            return false;
    }
    if (view[UP].value && !read_view(reader, &view[UP], UP, job->camera.key.up_world))
        return false;
    if (view[FOV].value && !read_view(reader, &view[FOV], FOV, &job->camera.key.fov_y))
        return false;
    return (!orbit.value || read_orbit(reader, &orbit)) && (!dolly.value || read_dolly(reader, &dolly));
}

/* Applies the command line's values instead, after the whole file was read, so that every mistake in it is
 * reported. */
static void override(const struct shot_reader *reader, const struct cli_job *before)
{
    struct cli_job *job = reader->job;
    const struct cli_shot_given *given = reader->given;
    size_t kept = 0;
    if (given->camera) {
        job->camera.name = before->camera.name;
        job->camera.key = before->camera.key;
        job->camera.has_eye = before->camera.has_eye;
        job->camera.has_look_at = before->camera.has_look_at;
        job->camera.is_orbit = before->camera.is_orbit;
        job->series = before->series;
    }
    for (size_t i = 0; i < job->clips.channel_count; i++) {
        const enum protocol_channel_path path = job->clips.channels[i].channel.path;
        const bool is_place = path == PROTOCOL_CHANNEL_VIEW_EYE || path == PROTOCOL_CHANNEL_VIEW_LOOK_AT ||
                              path == PROTOCOL_CHANNEL_VIEW_UP || path == PROTOCOL_CHANNEL_VIEW_FOV_Y;
        const bool is_dropped = (is_place && given->camera) || (path == PROTOCOL_CHANNEL_VIEW_UP && given->up) ||
                                (path == PROTOCOL_CHANNEL_VIEW_FOV_Y && given->fov) ||
                                (path == PROTOCOL_CHANNEL_VIEW_APERTURE && given->aperture) ||
                                (path == PROTOCOL_CHANNEL_VIEW_FOCUS && given->focus);
        if (!is_dropped)
            job->clips.channels[kept++] = job->clips.channels[i];
        else if (path == PROTOCOL_CHANNEL_VIEW_APERTURE)
            job->clips.change_lens = false;
    }
    job->clips.channel_count = kept;
}

bool shot_camera(const struct shot_reader *reader, const struct shot_value *at)
{
    static const char *const known[] = {"name",  "eye",      "look_at", "up",    "fov", "aperture",
                                        "focus", "exposure", "orbit",   "dolly", NULL};
    struct cli_job *job = reader->job;
    const struct cli_job before = *job;
    struct shot_value view[VIEW_COUNT];
    float exposure = 0;
    if (json_is_string(at->value) || json_is_number(at->value)) {
        const char *name = NULL;
        const bool read = shot_name(reader, at, &name);
        job->camera.name = reader->given->camera ? job->camera.name : name;
        return read;
    }
    if (!shot_is_object(reader, at, known))
        return false;
    for (enum view which = EYE; which < VIEW_COUNT; which++)
        view[which] = shot_member(at, properties[which].name);
    if (!read_place(reader, at, view) ||
        (view[APERTURE].value && !read_view(reader, &view[APERTURE], APERTURE, &job->options.camera.aperture)) ||
        (view[FOCUS].value && !read_view(reader, &view[FOCUS], FOCUS, &job->options.camera.focus)) ||
        (view[EXPOSURE].value && !read_view(reader, &view[EXPOSURE], EXPOSURE, &exposure)))
        return false;
    job->clips.change_lens = shot_is_keyed(&view[APERTURE]);
    override(reader, &before);
    return true;
}
