/* SPDX-License-Identifier: MIT */
/* Options that depend on the loaded scene. */
#include "settle.h"
#include "options/views.h"
#include "lib/json_text.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define RADIANS_PER_DEGREE 0.017453292519943295
#define FRAME_MAX 10000000u
#define ORBIT_SECONDS 4 /* a full turn */

/* Adds the script's name to an error in one of its values. */
static bool in_script(const struct cli_job *job, unsigned line, const char *path, struct fl_error *error)
{
    const struct fl_error why = *error;
    const size_t length = strlen(job->script);
    fl_error_set(error, why.code, job->script + (length > 150 ? length - 150 : 0), "line %u: %s: %s", line, path,
                 why.text);
    return fl_error_remedy(error, "%s", why.remedy[0] != '\0' ? why.remedy : "'farlight info' lists the names");
}

static bool in_script_at(const struct cli_job *job, const struct fl_json_place *place, struct fl_error *error)
{
    char path[96];
    fl_json_path(place, path, sizeof(path));
    return in_script(job, fl_json_line(job->script_json, place), path, error);
}

/* ---- clips ---- */

/* Settles the clips. *longest_s: the maximum duration of a pass at their speeds. */
static bool settle_clips(struct cli_job *job, struct fl_scene *scene, double *longest_s, struct fl_error *error)
{
    for (size_t i = 0; i < job->clips.count; i++) {
        const struct cli_clip *clip = &job->clips.list[i];
        struct record_clip_use *use = &job->clips.uses[i];
        const struct fl_clip_info *info = NULL;
        if (!fl_scene_find_clip(scene, clip->which, &use->clip, &info, error))
            return clip->line > 0 ? in_script(job, clip->line, "clips", error) : false;
        /* The first rendered frame is at time 0. */
        use->start_s = (float)((double)clip->start_s - job->clips.time_s);
        use->speed = clip->speed;
        use->loop = clip->loop ? 1 : 0;
        *longest_s = fmax(*longest_s, (double)info->duration_s / (double)clip->speed);
    }
    return true;
}

/* Finds the object of a channel, and checks that the channel can change it. */
static bool settle_target(const struct cli_channel *given, struct fl_scene *scene, uint32_t *object,
                          struct fl_error *error)
{
    if (!given->target)
        return true;
    if (!fl_scene_find_object(scene, given->kind, given->target, object, error))
        return false;
    if (given->channel.path != PROTOCOL_CHANNEL_LIGHT_SIZE || fl_scene_light_has_size(scene, *object))
        return true;
    fl_error_set(error, FL_ERROR_ARGUMENT, "light",
                 "the light '%s' has no size: it is neither a rectangle nor a sphere", given->target);
    return fl_error_remedy(
        error, "give a point light of a glTF file \"extras\": {\"radius\": 0.1}, which makes it a sphere");
}

/* Adds the script's channels as a clip of our own, which is played last. */
static bool settle_channels(struct cli_job *job, struct fl_scene *scene, struct fl_error *error)
{
    struct record_clip_use *use = &job->clips.uses[job->clips.count];
    struct fl_channel *channels = calloc(job->clips.channel_count + 1, sizeof(*channels));
    if (!channels)
        return fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    bool good = true;
    for (size_t i = 0; i < job->clips.channel_count && good; i++) {
        const struct cli_channel *given = &job->clips.channels[i];
        channels[i] = given->channel;
        if (!settle_target(given, scene, &channels[i].object, error))
            good = in_script_at(job, given->place, error);
    }
    *use = (struct record_clip_use){.speed = 1};
    good = good && fl_scene_add_clip(scene, "script", channels, job->clips.channel_count, &use->clip, error);
    free(channels);
    return good;
}

/* ---- the range ---- */

static double last_key_s(const struct cli_job *job)
{
    double last_s = 0;
    for (size_t i = 0; i < job->clips.channel_count; i++) {
        const struct fl_channel *channel = &job->clips.channels[i].channel;
        if (channel->times != job->series.dolly_times)
            last_s = fmax(last_s, (double)channel->times[channel->key_count - 1]);
    }
    return fmax(last_s, job->series.dolly_seconds);
}

/* Chooses the range if none is given: a pass of the clips, of the script's keys, or of the orbit. A repeated
 * clip and an orbit start again one frame after the last. */
static bool choose_range(struct cli_job *job, double clips_s, struct fl_error *error)
{
    struct cli_series *series = &job->series;
    const double fps = (double)job->options.frames_per_second, keys_s = last_key_s(job);
    const double orbit_s = series->orbit_seconds > 0 ? series->orbit_seconds : ORBIT_SECONDS;
    const bool by_clips = clips_s > 0, by_orbit = !by_clips && keys_s <= 0 && job->camera.is_orbit;
    bool loops = by_orbit;
    for (size_t i = 0; i < job->clips.count; i++)
        loops = loops || job->clips.list[i].loop;
    const double seconds = by_clips ? clips_s : by_orbit ? orbit_s : keys_s;
    const double frames = floor(seconds * fps + 0.5) + ((by_clips || by_orbit) && loops ? 0 : 1);
    if (series->has_range)
        return true;
    if (!by_clips && !by_orbit && keys_s <= 0) {
        fl_error_set(error, FL_ERROR_ARGUMENT, "--frames",
                     "no range of frames is given, and the duration is unknown");
        return fl_error_remedy(error, "--frames 1-120");
    }
    if (!(frames < FRAME_MAX)) {
        fl_error_set(error, FL_ERROR_ARGUMENT, "--frames", "once through the clips takes more than %u frames",
                     FRAME_MAX);
        return fl_error_remedy(error, "give a range of frames, for example --frames 1-120");
    }
    series->has_range = true;
    series->range = (struct fl_frame_run){.first = 1, .last = frames > 1 ? (uint32_t)frames : 1, .step = 1};
    return true;
}

/* Settles motions that last as long as the range. An orbit ends one frame after the last, so that a full turn
 * repeats without a doubled frame; a dolly arrives at the last frame. */
static void settle_camera(struct cli_job *job)
{
    struct message_render *wanted = &job->options;
    const struct cli_series *series = &job->series;
    const double step_s = (double)series->range.step / (double)wanted->frames_per_second;
    const uint32_t frames = fl_frame_run_count(&series->range);
    wanted->time_origin_frame = series->range.first;
    if (job->camera.is_orbit) {
        wanted->camera.orbit_turn = (float)(series->orbit_degrees * RADIANS_PER_DEGREE);
        wanted->camera.orbit_seconds =
            (float)(series->orbit_seconds > 0 ? series->orbit_seconds : frames * step_s);
    }
    if (series->dolly_times)
        series->dolly_times[1] = (float)(series->dolly_seconds > 0 ? series->dolly_seconds
                                         : frames > 1              ? (frames - 1) * step_s
                                                                   : step_s);
}

bool cli_settle(struct cli_job *job, struct fl_scene *scene, bool is_series, struct fl_error *error)
{
    double clips_s = 0;
    if (!settle_clips(job, scene, &clips_s, error))
        return false;
    if (is_series) {
        if (!choose_range(job, clips_s, error) || !cli_views_check_range(job, error))
            return false;
        settle_camera(job);
    }
    if (job->clips.channel_count > 0 && !settle_channels(job, scene, error))
        return false;
    job->options.clips = job->clips.uses;
    job->options.clips_count = (uint32_t)job->clips.count + (job->clips.channel_count > 0 ? 1 : 0);
    return true;
}
