/* SPDX-License-Identifier: MIT */
/* The client's side of the exporter program: frames go in, one answer per file comes back. */
#include "lib/helper.h"
#include "lib/names.h"
#include "lib/text.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct fl_exporter {
    struct fl_helper helper;
    bool waiting; /* the answer to the last request has not arrived */
    char model[4096];
    char path[160]; /* path of the requested file, or the end of a long one */
};

/* Checks the program's first answer, about the colours that it can write. */
static bool has_colours(struct fl_exporter *exporter, const struct fl_exporter_options *options,
                        struct fl_error *error)
{
    struct message message;
    if (!options->colour_space && !options->display_view)
        return true;
    if (!fl_helper_receive(&exporter->helper, &message, error))
        return false;
    if (message.type != MESSAGE_ERROR)
        return true;
    fl_error_from_message(error, &message.error);
    error->code = FL_ERROR_ARGUMENT;
    return false;
}

struct fl_exporter *fl_exporter_start(const struct fl_exporter_options *options, struct fl_error *error)
{
    struct fl_exporter *exporter = calloc(1, sizeof(*exporter));
    if (!exporter) {
        fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
        return NULL;
    }
    exporter->helper = (struct fl_helper){
        .program = "farlight-export", .what = "the image writer", .interrupt_fd = options->interrupt_fd};
    fl_text_utf8(options->model ? options->model : "", exporter->model, sizeof(exporter->model));
    char rate[32], window[48];
    snprintf(window, sizeof(window), "%u,%u,%u,%u", options->window.x, options->window.y, options->window.width,
             options->window.height);
    snprintf(rate, sizeof(rate), "%.9g", (double)options->frames_per_second);
    const char *const values[][2] = {{"--folder", options->folder},
                                     {"--fps", options->frames_per_second > 0 ? rate : NULL},
                                     {"--window", options->window.width > 0 ? window : NULL},
                                     {"--ocio", options->ocio},
                                     {"--colour-space", options->colour_space},
                                     {"--display-view", options->display_view},
                                     {"--light-groups", options->light_groups},
                                     {"--format", options->format}};
    const char *const flags[] = {options->full_metadata ? "--full-metadata" : NULL,
                                 options->dwaa ? "--dwaa" : NULL, options->draws_text ? "--text" : NULL};
    const size_t value_count = sizeof(values) / sizeof(values[0]), flag_count = sizeof(flags) / sizeof(flags[0]);
    const char *arguments[20] = {NULL}; /* ends with NULL */
    size_t count = 0;
    for (size_t i = 0; i < value_count; i++)
        if (values[i][1]) {
            arguments[count++] = values[i][0];
            arguments[count++] = values[i][1];
        }
    for (size_t i = 0; i < flag_count; i++)
        if (flags[i])
            arguments[count++] = flags[i];
    if (!fl_helper_start(&exporter->helper, arguments, error) || !has_colours(exporter, options, error)) {
        fl_exporter_destroy(exporter);
        return NULL;
    }
    return exporter;
}

bool fl_exporter_wait(struct fl_exporter *exporter, struct fl_error *error)
{
    struct message message;
    if (!exporter->waiting || exporter->helper.lost)
        return true;
    if (!fl_helper_receive(&exporter->helper, &message, error))
        return false;
    exporter->waiting = false;
    if (message.type == MESSAGE_OK)
        return true;
    if (message.type != MESSAGE_ERROR)
        return fl_error_set(error, FL_ERROR_PROTOCOL, "farlight-export",
                            "the answer to an image file has the wrong type: %s", message_type_text(message.type));
    fl_error_from_message(error, &message.error);
    error->code = FL_ERROR_FILE;
    memcpy(error->field, exporter->path, sizeof(error->field));
    return false;
}

static bool send_texts(struct fl_exporter *exporter, const struct fl_export_options *options,
                       struct fl_error *error)
{
    struct message message = {.type = MESSAGE_EXPORT_TEXT};
    char text[257];
    for (size_t i = 0; i < options->text_count; i++) {
        const struct fl_export_text *wanted = &options->texts[i];
        fl_text_utf8(wanted->text, text, sizeof(text));
        message.export_text.x = wanted->x;
        message.export_text.y = wanted->baseline;
        message.export_text.width = wanted->width;
        message.export_text.colour = wanted->colour;
        message.export_text.text = text;
        if (!fl_helper_send(&exporter->helper, &message, error))
            return false;
    }
    return true;
}

static bool send_names(struct fl_exporter *exporter, const struct fl_object *objects, size_t count,
                       enum protocol_object_kind kind, struct fl_error *error)
{
    struct message message = {.type = MESSAGE_EXPORT_NAME, .export_name = {.kind = kind}};
    char **names = NULL;
    bool sent = fl_names_make(objects, count, kind, &names, error);
    for (size_t i = 0; sent && i < count; i++) {
        message.export_name.object = objects[i].id;
        message.export_name.name = names[i];
        sent = !names[i] || fl_helper_send(&exporter->helper, &message, error);
    }
    fl_names_free(names, count);
    return sent;
}

bool fl_exporter_names(struct fl_exporter *exporter, struct fl_scene *scene, struct fl_error *error)
{
    static const enum protocol_object_kind kinds[] = {PROTOCOL_OBJECT_NODE, PROTOCOL_OBJECT_MATERIAL};
    bool sent = fl_exporter_wait(exporter, error);
    for (size_t i = 0; sent && i < sizeof(kinds) / sizeof(kinds[0]); i++) {
        struct fl_object *objects = NULL;
        size_t count = 0;
        sent = fl_scene_objects(scene, kinds[i], &objects, &count, error) &&
               send_names(exporter, objects, count, kinds[i], error);
        free(objects);
    }
    const struct message unnamed = {.type = MESSAGE_EXPORT_NAME,
                                    .export_name = {.kind = PROTOCOL_OBJECT_MATERIAL, .name = "default"}};
    return sent && fl_helper_send(&exporter->helper, &unnamed, error) && fl_helper_flush(&exporter->helper, error);
}

bool fl_exporter_write(struct fl_exporter *exporter, const struct fl_frame *frame,
                       const struct fl_export_options *options, struct fl_error *error)
{
    if (!fl_exporter_wait(exporter, error))
        return false;
    struct message message = {.type = MESSAGE_EXPORT_IMAGE};
    message.export_image.half = options->half ? 1 : 0;
    message.export_image.quality = options->quality > 0 ? options->quality : 95;
    message.export_image.path = options->path;
    message.export_image.format = options->format ? options->format : "";
    message.export_image.model = exporter->model;
    message.export_image.part = options->part ? options->part : "";
    for (unsigned i = 0; i < 3; i++)
        message.export_image.origin[i] = (float)options->origin[i];
    fl_shorten_path(options->path, exporter->path, sizeof(exporter->path));
    exporter->helper.request++;
    exporter->waiting = true;
    return fl_helper_send(&exporter->helper, &message, error) && send_texts(exporter, options, error) &&
           fl_helper_send_frame(&exporter->helper, frame, error) && fl_helper_flush(&exporter->helper, error);
}

void fl_exporter_destroy(struct fl_exporter *exporter)
{
    if (!exporter)
        return;
    fl_helper_finish(&exporter->helper);
    free(exporter);
}
