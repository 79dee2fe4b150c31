/* SPDX-License-Identifier: MIT */
/* Writing of frames into files. */
#include "sink.h"
#include "digest.h"
#include "lib/frame_part.h"
#include "lib/image_size.h"
#include "lib/rate.h"
#include "lib/text.h"
#include "options/image_path.h"
#include "options/interrupt.h"
#include "options/job.h"
#include "options/talk.h"
#include "options/views.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* ---- checks before rendering ---- */

/* Prepares a temporary file for standard output and devices, which a rename cannot replace: the complete file
 * is copied there. */
static bool prepare_temporary(struct cli_sink *sink, struct fl_error *error)
{
    if (!cli_temporary_folder(sink->folder, sizeof(sink->folder), error))
        return false;
    sink->has_temporary = true;
    snprintf(sink->path, sizeof(sink->path), "%s/image.%s", sink->folder, cli_image_name(sink->output.image));
    return true;
}

static bool prepare_stdout(struct cli_sink *sink, struct fl_error *error)
{
    sink->to_stdout = true;
    if (sink->part != CLI_PART_ALL) {
        fl_error_set(error, FL_ERROR_ARGUMENT, "--stereo-layout", "standard output is a single file");
        return fl_error_remedy(error, "name a file, or use the layout side");
    }
    const bool is_video = cli_image_is_video(sink->output.image);
    if (!cli_check_stdout(is_video ? "a video" : "an image", error))
        return is_video && fl_error_remedy(error, "pipe it into a program, for example 'ffmpeg -i - movie.webm'");
    return sink->output.image == CLI_IMAGE_Y4M || prepare_temporary(sink, error);
}

/* True for a character device, such as /dev/null. */
static bool is_device(const char *path)
{
    struct stat status;
    return stat(path, &status) == 0 && S_ISCHR(status.st_mode);
}

static bool prepare(struct cli_sink *sink, struct fl_error *error)
{
    const char *path = sink->output.path;
    if (strcmp(path, "-") == 0)
        return prepare_stdout(sink, error);
    if (is_device(path) && sink->output.image != CLI_IMAGE_Y4M) {
        sink->device = path;
        return prepare_temporary(sink, error);
    }
    if (!sink->is_series || cli_image_is_video(sink->output.image))
        return cli_check_output(path, sink->folder, sizeof(sink->folder), error) &&
               cli_check_folder(path, sink->folder, sink->job->output.parents, error) &&
               snprintf(sink->path, sizeof(sink->path), "%s", path) > 0;
    if (!fl_pattern_parse(path, &sink->pattern, error)) {
        snprintf(error->field, sizeof(error->field), "--output");
        return false;
    }
    /* The highest possible frame number gives the longest path. */
    if (!fl_pattern_path(&sink->pattern, 10000000, sink->path, sizeof(sink->path)))
        return fl_error_set(error, FL_ERROR_ARGUMENT, "--output", "the path of a frame is too long");
    if (cli_check_output(sink->path, sink->folder, sizeof(sink->folder), error) &&
        cli_check_folder(path, sink->folder, sink->job->output.parents, error))
        return true;
    /* The series may lack a frame with this number, so the error names the pattern. */
    fl_text_utf8(path, error->field, sizeof(error->field));
    return false;
}

/* Turns "pair.png" into "pair-left.png", "frames/%04d.exr" into "frames/%04d-left.exr". */
static bool name_part(struct cli_sink *sink, struct fl_error *error)
{
    const char *path = sink->output.path, *slash = strrchr(path, '/'), *dot = strrchr(path, '.');
    if (sink->part == CLI_PART_ALL || strcmp(path, "-") == 0)
        return true;
    if (!dot || (slash && dot < slash))
        dot = path + strlen(path);
    const int length = snprintf(sink->part_path, sizeof(sink->part_path), "%.*s-%s%s", (int)(dot - path), path,
                                sink->part == CLI_PART_LEFT ? "left" : "right", dot);
    if (length < 0 || (size_t)length >= sizeof(sink->part_path))
        return fl_error_set(error, FL_ERROR_FILE, "", "the path of the image is too long");
    sink->output.path = sink->part_path;
    return true;
}

bool cli_sinks_prepare(struct cli_sinks *sinks, const struct cli_job *job, bool is_series, struct fl_error *error)
{
    const bool are_parts = cli_views_are_files(job);
    sinks->items = calloc(job->output.count * (are_parts ? 2 : 1), sizeof(*sinks->items));
    if (!sinks->items)
        return fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    for (size_t i = 0; i < job->output.count; i++) {
        const enum cli_part last = are_parts ? CLI_PART_RIGHT : CLI_PART_ALL;
        for (enum cli_part part = are_parts ? CLI_PART_LEFT : CLI_PART_ALL; part <= last; part++) {
            struct cli_sink *sink = &sinks->items[sinks->count++];
            *sink =
                (struct cli_sink){.job = job, .output = job->output.list[i], .is_series = is_series, .part = part};
            if (!name_part(sink, error) || !prepare(sink, error))
                return false;
        }
    }
    return true;
}

/* ---- frames ---- */

/* Opens a .y4m file under a temporary name. */
static bool open_y4m(struct cli_sink *sink, struct fl_error *error)
{
    const int length = snprintf(sink->path, sizeof(sink->path), "%s/.farlight-XXXXXX", sink->folder);
    sink->y4m_fd = length > 0 && (size_t)length < sizeof(sink->path) ? mkostemp(sink->path, O_CLOEXEC) : -1;
    if (sink->y4m_fd >= 0)
        return true;
    sink->y4m_fd = 0;
    return fl_text_write_error(error, sink->output.path, "cannot be written", errno);
}

/* The model's name without its folders, which differ from host to host. */
static const char *model_name(const struct cli_job *job)
{
    const char *model = job->input.model ? job->input.model : job->input.scene;
    return strcmp(model, "-") == 0 ? "standard input" : job->output.full_metadata ? model : cli_base_name(model);
}

/* Notes that a GIF file is shown at the nearest possible rate. */
static void note_rate(const struct cli_sink *sink)
{
    char text[160];
    const double wanted = (double)sink->job->options.frames_per_second;
    const double shown = 100.0 / fl_rate_gif_delay(sink->job->options.frames_per_second);
    if (sink->output.image != CLI_IMAGE_MOVING_GIF || sink->job->talk.quiet ||
        fabs(shown - wanted) < 1e-3 * wanted)
        return;
    snprintf(text, sizeof(text), "GIF files count hundredths of a second: %g frames per second become %.4g",
             wanted, shown);
    cli_note(&(struct fl_note){.severity = PROTOCOL_SEVERITY_INFO, .where = sink->output.path, .text = text},
             true);
}

static bool start_video(struct cli_sink *sink, struct fl_error *error)
{
    const struct cli_job *job = sink->job;
    if (sink->output.image == CLI_IMAGE_Y4M) {
        if (!sink->to_stdout && !open_y4m(sink, error))
            return false;
        const struct fl_y4m_options options = {.fd = sink->to_stdout ? STDOUT_FILENO : sink->y4m_fd,
                                               .frames_per_second = job->options.frames_per_second,
                                               .chroma = FL_Y4M_420,
                                               .interrupt_fd = cli_interrupt_fd()};
        sink->y4m = fl_y4m_begin(&options, error);
        return sink->y4m != NULL;
    }
    note_rate(sink);
    const struct fl_video_options options = {.path = sink->path,
                                             .format = cli_image_name(sink->output.image),
                                             .model = model_name(job),
                                             .frames_per_second = job->options.frames_per_second,
                                             .quality = job->output.quality,
                                             .lossless = job->output.lossless,
                                             .interrupt_fd = cli_interrupt_fd()};
    sink->video = fl_video_start(&options, error);
    return sink->video != NULL;
}

static bool start(struct cli_sink *sink, struct fl_error *error)
{
    if (!sink->to_stdout && !cli_make_folder(sink->folder, error))
        return false;
    if (cli_image_is_video(sink->output.image))
        return start_video(sink, error);
    const struct cli_job *job = sink->job;
    const struct message_render *wanted = &job->options;
    char names[CLI_LIGHT_GROUPS * CLI_LIGHT_GROUP_NAME] = "";
    for (size_t i = 0, used = 0; i < job->light_groups.count; i++)
        used += (size_t)snprintf(names + used, sizeof(names) - used, "%s%s", i > 0 ? "," : "",
                                 job->light_groups.names[i]);
    /* An interruption is the normal end of progressive pictures, so a file in progress is finished. */
    const struct fl_exporter_options options = {
        .folder = sink->folder,
        .model = model_name(job),
        .full_metadata = job->output.full_metadata,
        .light_groups = names[0] != '\0' ? names : NULL,
        .dwaa = job->output.dwaa,
        .colour_space = job->output.colour_space,
        .display_view = job->output.display_view,
        .ocio = job->output.ocio,
        .frames_per_second = sink->is_series ? job->options.frames_per_second : 0,
        .interrupt_fd = job->sampling.progressive ? 0 : cli_interrupt_fd(),
        .format = cli_image_name(sink->output.image),
        .window = {wanted->picture.crop_x, wanted->picture.crop_y,
                   wanted->picture.crop_width > 0 ? wanted->picture.width : 0, wanted->picture.height}};
    sink->exporter = fl_exporter_start(&options, error);
    if (sink->exporter)
        return true;
    const char *const named[][2] = {{"colour_space", "--colour-space"}, {"display_view", "--display-view"}};
    for (size_t i = 0; i < 2; i++)
        if (strcmp(error->field, named[i][0]) == 0)
            snprintf(error->field, sizeof(error->field), "%s", named[i][1]);
    return false;
}

bool cli_sinks_start(struct cli_sinks *sinks, struct fl_error *error)
{
    for (size_t i = 0; i < sinks->count; i++)
        if (!start(&sinks->items[i], error))
            return false;
    return true;
}

bool cli_sinks_names(struct cli_sinks *sinks, struct fl_scene *scene, struct fl_error *error)
{
    unsigned named = 0;
    (void)protocol_layers_parse("crypto-object", &named);
    (void)protocol_layers_parse("crypto-material", &named);
    for (size_t i = 0; i < sinks->count; i++) {
        const struct cli_sink *sink = &sinks->items[i];
        if (sink->exporter && sink->job->options.picture.layers & named &&
            !fl_exporter_names(sink->exporter, scene, error))
            return false;
    }
    return true;
}

static bool have(struct cli_sink *sink, uint32_t frame)
{
    const struct message_render *wanted = &sink->job->options;
    const uint32_t across = sink->part == CLI_PART_ALL ? wanted->picture.views_across : 1;
    uint32_t width = 0, height = 0;
    if (!sink->is_series || !fl_pattern_path(&sink->pattern, frame, sink->path, sizeof(sink->path)) ||
        !fl_image_size(sink->path, &width, &height))
        return false;
    const bool has_size = wanted->picture.crop_width > 0
                              ? width == wanted->picture.crop_width && height == wanted->picture.crop_height
                              : width == wanted->picture.width * across &&
                                    height == wanted->picture.height * wanted->picture.views_down;
    const enum digest_state digest = has_size ? digest_check(sink->path) : DIGEST_DIFFERS;
    return digest == DIGEST_AGREES || (digest == DIGEST_MISSING && !sink->job->series.digests);
}

bool cli_sinks_have(struct cli_sinks *sinks, uint32_t frame)
{
    for (size_t i = 0; i < sinks->count; i++)
        if (!have(&sinks->items[i], frame))
            return false;
    return true;
}

/* Writes the digest of the previous image, which is complete now. */
static bool write_digest(struct cli_sink *sink, struct fl_error *error)
{
    const bool done = sink->undigested[0] == '\0' || digest_write(sink->undigested, error);
    sink->undigested[0] = '\0';
    return done;
}

static bool write_image(struct cli_sink *sink, const struct fl_frame *frame, struct fl_error *error)
{
    const struct cli_job *job = sink->job;
    if (sink->is_series && !fl_pattern_path(&sink->pattern, frame->frame, sink->path, sizeof(sink->path)))
        return fl_error_set(error, FL_ERROR_FILE, sink->output.path, "the path of frame %u is too long",
                            frame->frame);
    const struct fl_export_options options = {
        .path = sink->path,
        .format = cli_image_name(sink->output.image),
        .half = !job->output.float_pixels && sink->output.image == CLI_IMAGE_EXR,
        .part = job->part.name,
        .origin = {job->camera.origin[0], job->camera.origin[1], job->camera.origin[2]},
        .quality = sink->output.image == CLI_IMAGE_JPEG || sink->output.image == CLI_IMAGE_WEBP
                       ? job->output.quality
                       : 0};
    if (!fl_exporter_write(sink->exporter, frame, &options, error) || !write_digest(sink, error))
        return false;
    if (job->series.digests)
        memcpy(sink->undigested, sink->path, sizeof(sink->undigested));
    return true;
}

static bool write_all(struct cli_sink *sink, const struct fl_frame *frame, struct fl_error *error)
{
    return sink->y4m     ? fl_y4m_write(sink->y4m, frame, error)
           : sink->video ? fl_video_write(sink->video, frame, error)
                         : write_image(sink, frame, error);
}

/* Writes one of two views. */
static bool write_part(struct cli_sink *sink, const struct fl_frame *frame, struct fl_error *error)
{
    const bool is_right = sink->part == CLI_PART_RIGHT;
    const float aside = sink->job->options.picture.baseline / 2;
    const struct fl_frame_part part = {.x = is_right ? frame->width / 2 : 0,
                                       .width = frame->width / 2,
                                       .height = frame->height,
                                       .eye = {is_right ? aside : -aside, 0}};
    struct fl_frame *cut = fl_frame_cut(frame, &part, error);
    const bool written = cut && write_all(sink, cut, error);
    fl_frame_destroy(cut);
    return written;
}

void cli_sinks_path(const struct cli_sinks *sinks, char *path, size_t path_bytes)
{
    const struct cli_sink *sink = &sinks->items[0];
    const bool is_series = !sink->to_stdout && sink->y4m_fd == 0 && !sink->video && sink->path[0] != '\0';
    snprintf(path, path_bytes, "%s", is_series ? sink->path : sink->output.path);
}

bool cli_sinks_write(struct cli_sinks *sinks, const struct fl_frame *frame, struct fl_error *error)
{
    for (size_t i = 0; i < sinks->count; i++) {
        struct cli_sink *sink = &sinks->items[i];
        if (!(sink->part == CLI_PART_ALL ? write_all : write_part)(sink, frame, error))
            return false;
    }
    return true;
}

/* Renames the file, with the rights of a new file. */
static bool finish_y4m(struct cli_sink *sink, struct fl_error *error)
{
    const mode_t mask = umask(0);
    umask(mask);
    const bool good = fchmod(sink->y4m_fd, 0666 & ~mask) == 0 && fsync(sink->y4m_fd) == 0 &&
                      rename(sink->path, sink->output.path) == 0;
    const int failure = errno;
    if (!good)
        unlink(sink->path);
    close(sink->y4m_fd);
    sink->y4m_fd = 0;
    return good || fl_text_write_error(error, sink->output.path, "cannot be written", failure);
}

static bool copy_out(const struct cli_sink *sink, struct fl_error *error)
{
    return sink->to_stdout ? cli_copy_to(NULL, sink->path, error)
                           : !sink->device || cli_copy_to(sink->device, sink->path, error);
}

static bool finish(struct cli_sink *sink, struct fl_error *error)
{
    if (sink->video)
        return fl_video_finish(sink->video, error) && copy_out(sink, error);
    if (sink->y4m)
        return sink->to_stdout || finish_y4m(sink, error);
    return fl_exporter_wait(sink->exporter, error) && write_digest(sink, error) && copy_out(sink, error);
}

bool cli_sinks_finish(struct cli_sinks *sinks, struct fl_error *error)
{
    for (size_t i = 0; i < sinks->count; i++)
        if (!finish(&sinks->items[i], error))
            return false;
    return true;
}

void cli_sinks_close(struct cli_sinks *sinks)
{
    for (size_t i = 0; i < sinks->count; i++) {
        struct cli_sink *sink = &sinks->items[i];
        fl_exporter_destroy(sink->exporter);
        fl_video_destroy(sink->video);
        fl_y4m_end(sink->y4m);
        if (sink->y4m_fd > 0) {
            unlink(sink->path);
            close(sink->y4m_fd);
        }
        if (sink->has_temporary) {
            unlink(sink->path);
            rmdir(sink->folder);
        }
    }
    free(sinks->items);
    *sinks = (struct cli_sinks){0};
}
