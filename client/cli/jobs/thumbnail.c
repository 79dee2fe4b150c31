/* SPDX-License-Identifier: MIT */
/* farlight thumbnail: pictures of many models by one daemon, in a contact sheet, or a file for each. */
#include "commands.h"
#include "options/arguments.h"
#include "options/complete.h"
#include "options/daemon.h"
#include "options/image_path.h"
#include "options/interrupt.h"
#include "options/job.h"
#include "options/parse.h"
#include "options/progress.h"
#include "options/talk.h"
#include "model_list.h"
#include "sheet.h"
#include "lib/text.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#define CELL_PIXELS 256u
#define SAMPLES 4u /* smooth edges */
#define COLUMNS_MAX 512u

enum key { KEY_OUTPUT = 'o', KEY_COLUMNS = 0x400 };

struct thumbnails {
    struct cli_job job; /* options of each picture */
    struct model_list models;
    const char *output;
    uint32_t columns;
    bool to_folder;
    char folder[4097]; /* folder of the files */
    struct fl_connection *connection;
    struct fl_import *ahead;   /* importer of the next model */
    struct fl_model placed[2]; /* this model and the next one, turned by --up */
    struct fl_exporter *exporter;
    struct sheet sheet;
    struct cli_progress progress;
    uint32_t failed;
};

static const struct argp_option option_rows[] = {
    {"output", KEY_OUTPUT, "SHEET|FOLDER/", 0,
     "The sheet, a PNG or JPEG file or '-'; or a folder, with '/' at its end, that gets a PNG file for each model",
     -1},
    {"columns", KEY_COLUMNS, "N", 0, "Pictures in a row (default: about 1600 pixels)", -1},
    {0}};

static error_t parse(int key, char *value, struct argp_state *state)
{
    struct thumbnails *wanted = state->input;
    struct cli_job *job = &wanted->job;
    uint64_t number = 0;
    switch (key) {
    case ARGP_KEY_INIT:
        state->child_inputs[0] = job;
        return 0;
    case KEY_OUTPUT:
        wanted->output = value;
        return 0;
    case KEY_COLUMNS:
        if (!fl_text_integer(value, 1, COLUMNS_MAX, &number, &job->error)) {
            snprintf(job->error.field, sizeof(job->error.field), "--columns");
            return EINVAL;
        }
        wanted->columns = (uint32_t)number;
        return 0;
    case ARGP_KEY_ARG:
        return model_list_add(&wanted->models, value, &job->error) ? 0 : EINVAL;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

static bool is_folder(const char *path)
{
    struct stat status;
    const size_t length = strlen(path);
    return (length > 0 && path[length - 1] == '/') || (stat(path, &status) == 0 && S_ISDIR(status.st_mode));
}

static bool complete(struct thumbnails *wanted)
{
    struct cli_job *job = &wanted->job;
    if (wanted->models.count == 0) {
        cli_usage(job, "MODEL", "no model file is named, and no folder that has one");
        return fl_error_remedy(&job->error, "farlight thumbnail FOLDER -o sheet.png");
    }
    if (!wanted->output) {
        cli_usage(job, "--output", "no sheet is named");
        return fl_error_remedy(&job->error, "-o sheet.png, or -o FOLDER/ for a file for each model");
    }
    wanted->to_folder = is_folder(wanted->output);
    if (!job->sampling.has_samples && !job->given.integrator) {
        job->options.sampling.samples = SAMPLES;
        job->sampling.has_samples = true;
    }
    job->sampling.filters = true;
    job->input.model = wanted->models.entries[0].path;
    if (job->camera.has_up && !job->camera.has_eye)
        /* --up turns it like all others */
        job->input.models[job->input.count++] = (struct fl_model){.path = job->input.model};
    job->output.path = wanted->to_folder ? "model.png" : wanted->output;
    if (!cli_job_complete(job, false))
        return false;
    if (job->options.picture.format == PROTOCOL_PIXEL_FORMAT_RGBA8)
        return true;
    cli_usage(job, wanted->output, "a sheet has 8 bits a colour");
    return fl_error_remedy(&job->error, "name a .png or .jpg file");
}

/* ---- where pictures go ---- */

static bool prepare_sheet(struct thumbnails *wanted, struct fl_error *error)
{
    const uint32_t cell[2] = {wanted->job.options.picture.width, wanted->job.options.picture.height};
    return sheet_begin(&wanted->sheet, cell, wanted->columns, (uint32_t)wanted->models.count, error);
}

static bool start_exporter(struct thumbnails *wanted, const char *folder, enum cli_image image,
                           struct fl_error *error)
{
    const struct fl_exporter_options options = {.folder = folder,
                                                .model = "",
                                                .interrupt_fd = cli_interrupt_fd(),
                                                .draws_text = !wanted->to_folder,
                                                .format = cli_image_name(image)};
    wanted->exporter = fl_exporter_start(&options, error);
    return wanted->exporter != NULL;
}

static bool prepare_folder(struct thumbnails *wanted, struct fl_error *error)
{
    snprintf(wanted->folder, sizeof(wanted->folder), "%s", wanted->output);
    return cli_make_folder(wanted->folder, error) && start_exporter(wanted, wanted->folder, CLI_IMAGE_PNG, error);
}

/* Writes "FOLDER/fbx/monkey.fbx.png", so that models of one name and several formats do not collide. */
static bool write_file(struct thumbnails *wanted, const char *name, const struct fl_frame *picture,
                       struct fl_error *error)
{
    char path[4097], folder[4097];
    const int length = snprintf(path, sizeof(path), "%s/%s.png", wanted->folder, name);
    if (length < 0 || (size_t)length >= sizeof(path))
        return fl_error_set(error, FL_ERROR_FILE, name, "the path of its picture is too long");
    return cli_check_output(path, folder, sizeof(folder), error) && cli_make_folder(folder, error) &&
           fl_exporter_write(wanted->exporter, picture, &(struct fl_export_options){.path = path}, error);
}

static bool write_sheet(struct thumbnails *wanted, const char *path, struct fl_error *error)
{
    const enum cli_image image = wanted->job.output.list[0].image;
    const struct fl_export_options options = {.path = path,
                                              .format = cli_image_name(image),
                                              .quality = wanted->job.output.quality,
                                              .texts = wanted->sheet.texts,
                                              .text_count = wanted->sheet.text_count};
    return fl_exporter_write(wanted->exporter, &wanted->sheet.frame, &options, error) &&
           fl_exporter_wait(wanted->exporter, error);
}

/* ---- one model ---- */

static struct fl_load_options load_options(struct thumbnails *wanted, size_t index)
{
    struct fl_model *placed = &wanted->placed[index % 2];
    if (wanted->job.input.count > 0) {
        *placed = wanted->job.input.models[0];
        placed->path = wanted->models.entries[index].path;
    }
    return (struct fl_load_options){.model = wanted->models.entries[index].path,
                                    .models = placed,
                                    .model_count = wanted->job.input.count,
                                    .environment = wanted->job.input.environment,
                                    .environment_degrees = wanted->job.input.environment_degrees,
                                    .without_studio = wanted->job.input.without_studio,
                                    .point_size = wanted->job.input.point_size};
}

static bool connect_to(struct thumbnails *wanted, struct fl_error *error)
{
    const struct cli_job *job = &wanted->job;
    const struct fl_connect_options connect = {.server = job->daemon.server,
                                               .key_file = cli_key_file(job->daemon.server, job->daemon.key_file),
                                               .name = "farlight",
                                               .interrupt_fd = cli_interrupt_fd(),
                                               .lost_after_ms = job->daemon.retries.lost_after_ms};
    wanted->connection = fl_connect(&connect, error);
    return wanted->connection != NULL;
}

static struct fl_frame *render(const struct thumbnails *wanted, struct fl_scene *scene, struct fl_error *error)
{
    struct message_render options = wanted->job.options;
    if (!cli_find_camera(&options, wanted->job.camera.name, NULL, wanted->job.camera.has_framing, scene, error))
        return NULL;
    cli_choose_ground(&wanted->job, &options, scene);
    struct fl_job *job = fl_render_start(scene, &options, error);
    struct fl_frame *frame = job ? fl_render_next(job, error) : NULL;
    fl_render_destroy(job);
    return frame;
}

/* Renders a model while the importer of the next one reads. */
static struct fl_frame *make(struct thumbnails *wanted, size_t index, struct fl_error *error)
{
    struct fl_load_options load = load_options(wanted, index);
    load.started = wanted->ahead;
    wanted->ahead = NULL;
    struct fl_scene *scene = fl_scene_load(wanted->connection, &load, error);
    if (index + 1 < wanted->models.count) {
        struct fl_error later; /* reported when it is that model's turn */
        const struct fl_load_options next = load_options(wanted, index + 1);
        wanted->ahead = fl_import_start(&next, &later);
    }
    if (!scene)
        return NULL;
    struct fl_frame *frame = render(wanted, scene, error);
    fl_scene_destroy(scene);
    return frame;
}

/* ---- all of them ---- */

/* Reports a fault of one model, which does not stop the others. False: another error. */
static bool report(struct thumbnails *wanted, size_t index, const struct fl_error *why, struct fl_error *error)
{
    const struct model_list_entry *entry = &wanted->models.entries[index];
    char text[1200];
    wanted->failed++;
    cli_progress_clear(&wanted->progress);
    cli_report(why);
    snprintf(text, sizeof(text), "%s", why->text);
    if (!wanted->to_folder &&
        !sheet_put_failure(&wanted->sheet, (uint32_t)index, cli_base_name(entry->path), text, error))
        return false;
    if (why->code != FL_ERROR_CONNECTION)
        return true;
    fl_connection_destroy(wanted->connection);
    return connect_to(wanted, error);
}

/* Refuses a name that is not UTF-8, since the picture's file is named after the model. */
static bool check_name(const char *name, struct fl_error *error)
{
    char plain[4097];
    fl_text_utf8(name, plain, sizeof(plain));
    return strcmp(name, plain) == 0 ||
           fl_error_set(error, FL_ERROR_FILE, plain, "its name is not UTF-8, and so no name of a picture");
}

static bool take(struct thumbnails *wanted, size_t index, struct fl_error *error)
{
    const struct model_list_entry *entry = &wanted->models.entries[index];
    const char *name = entry->path + entry->name_at;
    struct fl_error why = {0};
    struct fl_frame *frame = make(wanted, index, &why);
    if (why.code == FL_ERROR_INTERRUPTED) {
        *error = why;
        return false;
    }
    if (!frame || (wanted->to_folder && !check_name(name, &why))) {
        fl_frame_destroy(frame);
        return report(wanted, index, &why, error);
    }
    const bool taken = wanted->to_folder
                           ? write_file(wanted, name, frame, error)
                           : sheet_put(&wanted->sheet, (uint32_t)index, cli_base_name(name), frame, error);
    fl_frame_destroy(frame);
    return taken;
}

static bool make_all(struct thumbnails *wanted, struct fl_error *error)
{
    const uint32_t count = (uint32_t)wanted->models.count;
    for (uint32_t i = 0; i < count; i++) {
        const struct model_list_entry *entry = &wanted->models.entries[i];
        cli_progress_step(&wanted->progress, i, count, entry->path + entry->name_at);
        if (!take(wanted, i, error))
            return false;
    }
    cli_progress_step(&wanted->progress, count, count, "done");
    return true;
}

static bool finish(struct thumbnails *wanted, const struct cli_job *sheet_job, struct fl_error *error)
{
    char folder[4097], path[4200];
    const struct cli_output *output = &sheet_job->output.list[0];
    const bool to_stdout = strcmp(output->path, "-") == 0;
    if (wanted->to_folder)
        return fl_exporter_wait(wanted->exporter, error);
    if (!to_stdout)
        return cli_check_output(output->path, folder, sizeof(folder), error) && cli_make_folder(folder, error) &&
               start_exporter(wanted, folder, output->image, error) && write_sheet(wanted, output->path, error);
    if (!cli_temporary_folder(folder, sizeof(folder), error))
        return false;
    snprintf(path, sizeof(path), "%s/sheet.%s", folder, cli_image_name(output->image));
    const bool done = start_exporter(wanted, folder, output->image, error) && write_sheet(wanted, path, error) &&
                      cli_copy_to(NULL, path, error);
    remove(path);
    remove(folder);
    return done;
}

/* Checks everything that can fail before the first model is loaded. */
static bool run(struct thumbnails *wanted, struct fl_error *error)
{
    char folder[4097];
    const bool to_stdout = cli_writes_to_stdout(&wanted->job);
    if (to_stdout && !cli_check_stdout("a sheet", error))
        return false;
    return (wanted->to_folder || to_stdout ||
            (cli_check_output(wanted->job.output.list[0].path, folder, sizeof(folder), error) &&
             cli_check_folder(wanted->job.output.list[0].path, folder, wanted->job.output.parents, error))) &&
           (wanted->to_folder ? prepare_folder(wanted, error) : prepare_sheet(wanted, error)) &&
           connect_to(wanted, error) && make_all(wanted, error) && finish(wanted, &wanted->job, error);
}

static void close_all(struct thumbnails *wanted)
{
    fl_import_destroy(wanted->ahead);
    if (wanted->connection)
        fl_connection_set_interrupt(wanted->connection, 0);
    fl_connection_destroy(wanted->connection);
    fl_exporter_destroy(wanted->exporter);
    sheet_end(&wanted->sheet);
}

static int thumbnails(struct thumbnails *wanted)
{
    struct fl_error error = {0};
    if (!cli_interrupt_begin(&error))
        return cli_report(&error);
    cli_progress_begin(&wanted->progress, &wanted->job.talk);
    const bool done = run(wanted, &error);
    cli_progress_end(&wanted->progress, done);
    close_all(wanted);
    if (!done)
        return cli_report(&error);
    if (wanted->failed > 0 && !wanted->job.talk.quiet)
        fprintf(stderr, "farlight: %u of %zu models could not be shown\n", wanted->failed, wanted->models.count);
    return wanted->failed > 0 ? CLI_FAILED : CLI_DONE;
}

int cli_thumbnail(int argc, char **argv)
{
    const struct argp_child children[] = {{cli_options_argp(CLI_OPTIONS_THUMBNAIL), 0, NULL, 0}, {0}};
    const struct argp argp = {.options = option_rows,
                              .parser = parse,
                              .args_doc = "FOLDER|MODEL... -o SHEET.png\nFOLDER|MODEL... -o FOLDER/",
                              .doc =
                                  "Render a contact sheet of the named models, and of all models in and below the "
                                  "named folders.\v"
                                  "In place of a model that cannot be read stands the reason; the others are "
                                  "rendered, and the exit status is 1.",
                              .children = children};
    struct message_render defaults = fl_render_defaults();
    struct thumbnails wanted = {.columns = 0};
    defaults.picture.width = defaults.picture.height = CELL_PIXELS;
    const bool good =
        cli_job_begin(&wanted.job, defaults) && cli_parse(&argp, argc, argv, 0, &wanted) == 0 && complete(&wanted);
    const int status = good ? thumbnails(&wanted) : cli_report(&wanted.job.error);
    model_list_finish(&wanted.models);
    return status;
}
