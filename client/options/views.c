/* SPDX-License-Identifier: MIT */
/* Options of several views in a picture, of lenses and of frames made from depth layers. */
#include "views.h"
#include "lib/text.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

#define VIEWS_MAX 64u /* across and down; also between two rendered frames */
#define DISTANCE_MAX_M 1e6

/* ---- parsing ---- */

static error_t name_field(struct cli_job *job, const char *field)
{
    snprintf(job->error.field, sizeof(job->error.field), "%s", field);
    return EINVAL;
}

static error_t set_distance(struct cli_job *job, const char *field, const char *value, float *metres)
{
    double number = 0;
    if (!fl_text_real(value, 0, DISTANCE_MAX_M, &number, &job->error))
        return name_field(job, field);
    *metres = (float)number;
    if (*metres > 0)
        return 0;
    cli_usage(job, field, "%s m: all views would be from one place", value);
    fl_error_remedy(&job->error, "give the distance of neighbouring eyes, such as 0.065");
    return EINVAL;
}

static error_t set_layout(struct cli_job *job, const char *field, const char *value)
{
    static const char *const names[] = {
        [CLI_STEREO_SIDE] = "side", [CLI_STEREO_OVER] = "over", [CLI_STEREO_FILES] = "files"};
    for (unsigned i = 0; i < sizeof(names) / sizeof(names[0]); i++) {
        if (strcmp(names[i], value) != 0)
            continue;
        job->views.layout = (enum cli_stereo)i;
        return 0;
    }
    return cli_usage(job, field, "'%s' is not known (known: side, over, files)", value);
}

static error_t set_light_field(struct cli_job *job, const char *field, const char *value)
{
    uint32_t *across = &job->views.across, *down = &job->views.down;
    if (fl_text_size(value, across, down, &job->error) && *across <= VIEWS_MAX && *down <= VIEWS_MAX &&
        *across * *down > 1)
        return 0;
    return cli_usage(job, field, "'%s' is not a number of views from 2x1 to %ux%u", value, VIEWS_MAX, VIEWS_MAX);
}

static error_t set_source(struct cli_job *job, const char *field, const char *value,
                          enum protocol_view_source *source)
{
    *source = strcmp(value, "quadtree") == 0 ? PROTOCOL_VIEW_SOURCE_LAYERS : PROTOCOL_VIEW_SOURCE_RAYS;
    return *source == PROTOCOL_VIEW_SOURCE_LAYERS || strcmp(value, "rays") == 0
               ? 0
               : cli_usage(job, field, "'%s' is not known (known: rays, quadtree)", value);
}

error_t cli_views_set(struct cli_job *job, const char *option, const char *value)
{
    struct cli_views *views = &job->views;
    const char *name = strncmp(option, "--", 2) == 0 ? option + 2 : option;
    if (strcmp(name, "stereo") == 0) {
        views->has_stereo = true;
        return set_distance(job, option, value, &views->stereo_m);
    }
    if (strcmp(name, "stereo-layout") == 0) {
        views->has_layout = true;
        return set_layout(job, option, value);
    }
    if (strcmp(name, "light-field") == 0) {
        views->has_light_field = true;
        return set_light_field(job, option, value);
    }
    if (strcmp(name, "baseline") == 0) {
        views->has_baseline = true;
        return set_distance(job, option, value, &views->baseline_m);
    }
    if (strcmp(name, "views") == 0 || strcmp(name, "eyes") == 0) { /* the viewer calls it eyes */
        views->has_views = true;
        return set_source(job, option, value, &views->views);
    }
    if (strcmp(name, "lens") == 0) {
        views->has_lens = true;
        return set_source(job, option, value, &views->lens);
    }
    return ARGP_ERR_UNKNOWN;
}

/* ---- all of it ---- */

static bool refuse(struct cli_job *job, const char *field, const char *text, const char *remedy)
{
    cli_usage(job, field, "%s", text);
    return fl_error_remedy(&job->error, "%s", remedy);
}

static bool complete_eyes(struct cli_job *job)
{
    const struct cli_views *views = &job->views;
    struct message_render *wanted = &job->options;
    if (views->has_stereo && views->has_light_field)
        return refuse(job, "--stereo", "cannot be combined with --light-field", "leave out one of them");
    if (views->has_layout && !views->has_stereo)
        return refuse(job, "--stereo-layout", "there are not two views", "add --stereo 0.065");
    if (views->has_light_field && !views->has_baseline)
        return refuse(job, "--light-field", "the distance between its eyes is missing", "add --baseline 0.1");
    if (views->has_baseline && !views->has_light_field)
        return refuse(job, "--baseline", "there is no light field",
                      "add --light-field 5x5; --stereo gives the distance between two eyes");
    if (views->has_light_field) {
        wanted->picture.views_across = views->across;
        wanted->picture.views_down = views->down;
        wanted->picture.baseline = views->baseline_m;
    } else if (views->has_stereo) {
        wanted->picture.eyes_over = views->layout == CLI_STEREO_OVER;
        wanted->picture.views_across = wanted->picture.eyes_over ? 1 : 2;
        wanted->picture.views_down = wanted->picture.eyes_over ? 2 : 1;
        wanted->picture.baseline = views->stereo_m;
    }
    return true;
}

/* Chooses the source. By default views and frames are made from layers, and a lens is not. Pictures from layers
 * are not filtered and have neither motion nor light layers (those from PROTOCOL_LAYER_MOTION on): if one of
 * these is requested, views are rendered. */
static bool complete_source(struct cli_job *job)
{
    const struct cli_views *views = &job->views;
    struct message_render *wanted = &job->options;
    const bool has_views = views->has_stereo || views->has_light_field || wanted->picture.upsample > 1;
    const bool has_lens = wanted->camera.aperture > 0 || job->clips.change_lens;
    const bool is_filtered = wanted->picture.denoise == PROTOCOL_DENOISE_ON;
    const bool is_rendered = is_filtered || wanted->picture.layers >> PROTOCOL_LAYER_MOTION != 0;
    if (views->has_views && !has_views)
        return refuse(job, "--views", "the picture has a single view",
                      "add --stereo 0.065; a picture may have --light-field 5x5, an animation --upsample 4");
    if (views->has_lens && !has_lens)
        return refuse(job, "--lens", "everything is sharp", "add --aperture 0.05");
    if (views->has_views && views->has_lens && views->views != views->lens)
        return refuse(job, "--lens", "a picture has a single source, and --views gives another one",
                      "leave out one of them");
    if (views->has_views)
        wanted->picture.view_source = views->views;
    else if (views->has_lens)
        wanted->picture.view_source = views->lens;
    else
        wanted->picture.view_source = has_views && (!is_rendered || wanted->picture.upsample > 1)
                                          ? PROTOCOL_VIEW_SOURCE_LAYERS
                                          : PROTOCOL_VIEW_SOURCE_RAYS;
    if (wanted->picture.view_source == PROTOCOL_VIEW_SOURCE_RAYS && wanted->picture.upsample > 1)
        return refuse(job, "--upsample", "frames between rendered frames are not made of rays",
                      views->has_views ? "add --views quadtree" : "leave out --lens rays");
    if (wanted->picture.view_source == PROTOCOL_VIEW_SOURCE_LAYERS && is_filtered)
        return refuse(job, "--denoise", "pictures made from depth layers are not denoised",
                      wanted->picture.upsample > 1 ? "leave out --denoise or --upsample"
                      : has_views                  ? "leave it out, or add --views rays"
                                                   : "leave it out, or add --lens rays");
    if (wanted->picture.view_source == PROTOCOL_VIEW_SOURCE_LAYERS && wanted->camera.shutter > 0)
        return refuse(job, "--shutter", "depth layers show the scene at one time",
                      wanted->picture.upsample > 1 ? "leave out --shutter or --upsample"
                      : has_views                  ? "leave it out, or add --views rays"
                                                   : "leave it out, or add --lens rays");
    return true;
}

bool cli_views_check_range(const struct cli_job *job, struct fl_error *error)
{
    if (job->options.picture.upsample == 1 || fl_frame_run_count(&job->series.range) > 1)
        return true;
    fl_error_set(error, FL_ERROR_ARGUMENT, "--upsample", "a single frame is rendered: there are none between");
    return fl_error_remedy(error, "leave it out, or use a range of --frames such as 1-120");
}

/* Renders every N-th frame of a range that has a step itself. */
static bool complete_upsample(struct cli_job *job)
{
    const struct cli_series *series = &job->series;
    struct message_render *wanted = &job->options;
    if (series->has_range && !cli_views_check_range(job, &job->error))
        return false;
    const uint64_t step = series->has_range ? series->range.step : 1, frames = wanted->picture.upsample * step;
    if (wanted->picture.upsample == 1)
        return true;
    if (frames <= VIEWS_MAX) {
        wanted->picture.upsample = (uint32_t)frames;
        return true;
    }
    cli_usage(job, "--upsample", "every %u-th of every %llu-th frame is beyond every %u-th",
              wanted->picture.upsample, (unsigned long long)step, VIEWS_MAX);
    return fl_error_remedy(&job->error, "use a smaller one, or a smaller step of --frames");
}

bool cli_views_are_files(const struct cli_job *job)
{
    return job->views.has_stereo && job->views.layout == CLI_STEREO_FILES;
}

bool cli_views_complete(struct cli_job *job, bool is_series)
{
    return complete_eyes(job) && complete_source(job) && (!is_series || complete_upsample(job));
}
