/* SPDX-License-Identifier: MIT */
#include "cli/sink.h"
#include "lib/image_size.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* ---- what can be known before ---- */

static bool prepare_stdout(struct cli_sink *sink, struct fl_error *error)
{
    sink->to_stdout = true;
    if (isatty(STDOUT_FILENO) == 1) {
        fl_error_set(error, FL_ERROR_ARGUMENT, "--output", "an image would be written to the terminal");
        return fl_error_remedy(error, "redirect it, or name a file");
    }
    if (!cli_temporary_folder(sink->folder, sizeof sink->folder, error))
        return false;
    sink->has_temporary = true;
    snprintf(sink->path, sizeof sink->path, "%s/image.%s", sink->folder, cli_image_name(sink->output.image));
    return true;
}

static bool prepare(struct cli_sink *sink, struct fl_error *error)
{
    const char *path = sink->output.path;
    if (strcmp(path, "-") == 0)
        return prepare_stdout(sink, error);
    if (!sink->is_series)
        return cli_check_output(path, sink->folder, sizeof sink->folder, error) &&
               snprintf(sink->path, sizeof sink->path, "%s", path) > 0;
    if (!fl_pattern_parse(path, &sink->pattern, error)) {
        snprintf(error->field, sizeof error->field, "--output");
        return false;
    }
    /* The greatest number that a frame can have: its path is the longest. */
    if (!fl_pattern_path(&sink->pattern, 10000000, sink->path, sizeof sink->path))
        return fl_error_set(error, FL_ERROR_ARGUMENT, "--output", "the path of a frame is too long");
    return cli_check_output(sink->path, sink->folder, sizeof sink->folder, error);
}

bool cli_sinks_prepare(struct cli_sinks *sinks, const struct cli_job *job, bool is_series, struct fl_error *error)
{
    sinks->items = calloc(job->output_count, sizeof *sinks->items);
    if (sinks->items == NULL)
        return fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    for (size_t i = 0; i < job->output_count; i++) {
        struct cli_sink *sink = &sinks->items[sinks->count++];
        *sink = (struct cli_sink){.job = job, .output = job->outputs[i], .is_series = is_series};
        if (!prepare(sink, error))
            return false;
    }
    return true;
}

/* ---- frames ---- */

static bool start(struct cli_sink *sink, struct fl_error *error)
{
    const struct cli_job *job = sink->job;
    const struct fl_exporter_options options = {.folder = sink->folder,
                                                .model = job->model,
                                                .frames_per_second =
                                                    sink->is_series ? job->options.frames_per_second : 0,
                                                .interrupt_fd = cli_interrupt_fd()};
    sink->exporter = fl_exporter_start(&options, error);
    return sink->exporter != NULL;
}

bool cli_sinks_start(struct cli_sinks *sinks, struct fl_error *error)
{
    for (size_t i = 0; i < sinks->count; i++)
        if (!start(&sinks->items[i], error))
            return false;
    return true;
}

static bool have(struct cli_sink *sink, uint32_t frame)
{
    const struct fl_job_options *wanted = &sink->job->options;
    uint32_t width = 0, height = 0;
    return sink->is_series && fl_pattern_path(&sink->pattern, frame, sink->path, sizeof sink->path) &&
           fl_image_size(sink->path, &width, &height) && width == wanted->width && height == wanted->height;
}

bool cli_sinks_have(struct cli_sinks *sinks, uint32_t frame)
{
    for (size_t i = 0; i < sinks->count; i++)
        if (!have(&sinks->items[i], frame))
            return false;
    return true;
}

static bool write_image(struct cli_sink *sink, const struct fl_frame *frame, struct fl_error *error)
{
    const struct cli_job *job = sink->job;
    if (sink->is_series && !fl_pattern_path(&sink->pattern, frame->frame, sink->path, sizeof sink->path))
        return fl_error_set(error, FL_ERROR_FILE, sink->output.path, "the path of frame %u is too long",
                            frame->frame);
    const struct fl_export_options options = {.path = sink->path,
                                              .format = cli_image_name(sink->output.image),
                                              .half = !job->float_pixels && sink->output.image == CLI_IMAGE_EXR,
                                              .quality =
                                                  sink->output.image == CLI_IMAGE_JPEG ? job->file_quality : 0};
    return fl_exporter_write(sink->exporter, frame, &options, error);
}

bool cli_sinks_write(struct cli_sinks *sinks, const struct fl_frame *frame, struct fl_error *error)
{
    for (size_t i = 0; i < sinks->count; i++)
        if (!write_image(&sinks->items[i], frame, error))
            return false;
    return true;
}

bool cli_sinks_finish(struct cli_sinks *sinks, struct fl_error *error)
{
    for (size_t i = 0; i < sinks->count; i++) {
        struct cli_sink *sink = &sinks->items[i];
        if (!fl_exporter_wait(sink->exporter, error) ||
            (sink->to_stdout && !cli_copy_to_stdout(sink->path, error)))
            return false;
    }
    return true;
}

void cli_sinks_close(struct cli_sinks *sinks)
{
    for (size_t i = 0; i < sinks->count; i++) {
        struct cli_sink *sink = &sinks->items[i];
        fl_exporter_destroy(sink->exporter);
        if (sink->has_temporary) {
            unlink(sink->path);
            rmdir(sink->folder);
        }
    }
    free(sinks->items);
    *sinks = (struct cli_sinks){0};
}
