/* SPDX-License-Identifier: MIT */
/* Rendering a job in two ways, and comparing the pictures. */
#include "pair.h"
#include "lib/text.h"
#include "cli/jobs/series.h"
#include "cli/jobs/settle.h"
#include "options/complete.h"
#include "options/interrupt.h"
#include "options/models.h"

#include <errno.h>
#include <string.h>
#include <unistd.h>

#define PATH_BYTES 4224u

enum key { KEY_PICTURE = 'o', KEY_TIME = 0x600, KEY_THRESHOLD, KEY_HEAT_TOP, KEY_JSON };

/* ---- command line ---- */

static const struct argp_option options[] = {
    {"time", KEY_TIME, "SECONDS", 0, "Compare at this time of the clips (default 0)", 0},
    {"output", KEY_PICTURE, "PICTURE", 0,
     "Write the reference, the compared picture and the errors side by side, PNG or JPEG", 0},
    {"heat-top", KEY_HEAT_TOP, "ERROR", 0,
     "Set the error that gets the brightest colour (default: the maximum error, at most 1)", 0},
    {"threshold", KEY_THRESHOLD, "ERROR", 0, "Count a pixel as beyond if a channel differs by more (default 0.01)",
     0},
    {"json", KEY_JSON, NULL, 0, "Print one JSON object on one line", 0},
    {0}};

static error_t name_field(struct cli_job *job, const char *field)
{
    snprintf(job->error.field, sizeof(job->error.field), "%s", field);
    return EINVAL;
}

static error_t set_error(struct cli_job *job, const char *field, const char *value, float *error)
{
    double real = 0;
    if (!fl_text_real(value, 0, 1e9, &real, &job->error))
        return name_field(job, field);
    *error = (float)real;
    return 0;
}

static error_t parse(int key, char *value, struct argp_state *state)
{
    struct cli_pair *pair = state->input;
    struct cli_job *job = &pair->job;
    error_t status = 0;
    switch (key) {
    case KEY_TIME:
        return fl_text_real(value, -1e6, 1e6, &job->clips.time_s, &job->error) ? 0 : name_field(job, "--time");
    case KEY_THRESHOLD:
        status = set_error(job, "--threshold", value, &pair->images.threshold);
        if (!(pair->images.threshold > 0))
            pair->images.threshold = FL_THRESHOLD_NONE;
        return status;
    case KEY_HEAT_TOP:
        return set_error(job, "--heat-top", value, &pair->images.heat_top);
    case KEY_PICTURE:
        pair->images.picture = value;
        return 0;
    case KEY_JSON:
        pair->json = true;
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

const struct argp cli_pair_argp = {.options = options, .parser = parse};

error_t cli_pair_set_limit(struct cli_pair *pair, const char *name, const char *value, double *share)
{
    const size_t length = strlen(name);
    struct fl_error *error = &pair->job.error;
    const bool is_share = strncmp(value, name, length) == 0 && value[length] == '=';
    return (is_share ? cli_share_parse(value + length + 1, share, error)
                     : cli_limits_add(&pair->limits, value, error))
               ? 0
               : name_field(&pair->job, "--fail-above");
}

bool cli_pair_complete(struct cli_pair *pair, bool is_series)
{
    struct cli_job *job = &pair->job;
    if (job->clips.time_s != 0 && (is_series || job->clips.count == 0)) {
        cli_usage(job, "--time", is_series ? "every frame has its own time" : "no clip is played");
        return fl_error_remedy(&job->error, "%s", is_series ? "use --clip-start" : "add --clip NAME");
    }
    job->output.path = "picture";
    job->output.image = pair->image;
    job->output.float_pixels = pair->image == CLI_IMAGE_EXR;
    return is_series ? cli_series_complete(job) : cli_job_complete(job, false);
}

/* ---- rendering ---- */

static void name_file(const struct cli_pair *pair, enum cli_pair_side side, uint32_t frame, char *path)
{
    snprintf(path, PATH_BYTES, "%s/%s-%u.%s", pair->folder, side == CLI_PAIR_REFERENCE ? "reference" : "compared",
             frame, cli_image_name(pair->image));
}

bool cli_pair_begin(struct cli_pair *pair, bool is_series, struct fl_error *error)
{
    struct cli_job *job = &pair->job;
    char folder[sizeof(pair->folder)];
    pair->loading = (struct cli_loading){.job = job, .progress = &pair->progress};
    if (!cli_temporary_folder(folder, sizeof(folder), error))
        return false;
    memcpy(pair->folder, folder, sizeof(folder));
    const struct fl_exporter_options export = {.folder = pair->folder,
                                               .model = cli_base_name(job->input.model),
                                               .interrupt_fd = cli_interrupt_fd(),
                                               .format = cli_image_name(pair->image)};
    if (!cli_read_input(job, error) || !cli_loading_begin(&pair->loading, error))
        return false;
    pair->exporter = fl_exporter_start(&export, error);
    if (!pair->exporter || !cli_loading_end(&pair->loading, error) ||
        !cli_choose_camera(job, pair->loading.scene, error) ||
        !cli_settle(job, pair->loading.scene, is_series, error))
        return false;
    pair->frames = is_series ? job->series.range : (struct fl_frame_run){.step = 1};
    return true;
}

bool cli_pair_render(struct cli_pair *pair, enum cli_pair_side side, struct fl_error *error)
{
    struct message_render *wanted = &pair->job.options;
    wanted->first_frame = pair->frames.first;
    wanted->last_frame = pair->frames.last;
    wanted->frame_step = pair->frames.step;
    pair->side = side;
    fl_render_destroy(pair->rendering);
    pair->rendering = fl_render_start(pair->loading.scene, wanted, error);
    return pair->rendering != NULL;
}

struct fl_frame *cli_pair_next(struct cli_pair *pair, struct fl_error *error)
{
    char path[PATH_BYTES];
    struct fl_frame *frame = fl_render_next(pair->rendering, error);
    if (!frame)
        return NULL;
    name_file(pair, pair->side, frame->frame, path);
    if (fl_exporter_write(pair->exporter, frame, &(struct fl_export_options){.path = path}, error))
        return frame;
    fl_frame_destroy(frame);
    return NULL;
}

static void remove_files(const struct cli_pair *pair, uint32_t frame)
{
    char path[PATH_BYTES];
    for (int side = 0; side < CLI_PAIR_SIDES; side++) {
        name_file(pair, (enum cli_pair_side)side, frame, path);
        unlink(path);
    }
}

bool cli_pair_compare(struct cli_pair *pair, uint32_t frame, const char *picture, struct fl_comparison *figures,
                      struct fl_error *error)
{
    char reference[PATH_BYTES], compared[PATH_BYTES];
    struct fl_compare_options images = pair->images;
    name_file(pair, CLI_PAIR_REFERENCE, frame, reference);
    name_file(pair, CLI_PAIR_COMPARED, frame, compared);
    images.a = reference;
    images.b = compared;
    images.picture = picture;
    images.layout = PROTOCOL_COMPARISON_LAYOUT_SIDE;
    images.tone_map = pair->job.options.picture.tone_map;
    images.label_a = pair->labels[CLI_PAIR_REFERENCE];
    images.label_b = pair->labels[CLI_PAIR_COMPARED];
    images.interrupt_fd = cli_interrupt_fd();
    if (!fl_exporter_wait(pair->exporter, error) || !fl_compare(&images, figures, error))
        return false;
    remove_files(pair, frame);
    return true;
}

void cli_pair_finish(struct cli_pair *pair)
{
    if (pair->loading.connection)
        fl_connection_set_interrupt(pair->loading.connection, 0);
    fl_render_destroy(pair->rendering);
    fl_exporter_destroy(pair->exporter);
    cli_loading_close(&pair->loading);
    cli_series_finish(&pair->job);
    if (pair->folder[0] == '\0')
        return;
    if (pair->frames.step > 0) /* the command may have ended between two frames */
        for (uint64_t frame = pair->frames.first; frame <= pair->frames.last; frame += pair->frames.step)
            remove_files(pair, (uint32_t)frame);
    rmdir(pair->folder);
}
