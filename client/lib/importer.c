/* SPDX-License-Identifier: MIT */
#include "lib/importer.h"
#include "protocol/common/clock.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define DEFAULT_TIMEOUT_MS 600000u
/* Further cameras cannot be chosen by name; this bounds the work that a hostile model can cause. */
#define CAMERAS_MAX 4096u

/* Named here, before a program is started for it. */
static bool check_file(const char *path, struct fl_error *error)
{
    struct stat status;
    if (stat(path, &status) < 0 || access(path, R_OK) < 0)
        return fl_error_set(error, FL_ERROR_FILE, path, "cannot be read: %s", strerror(errno));
    if (!S_ISREG(status.st_mode))
        return fl_error_set(error, FL_ERROR_FILE, path, "is not a file");
    return true;
}

bool fl_importer_start(struct fl_importer *importer, const struct fl_load_options *options, struct fl_error *error)
{
    const unsigned timeout_ms = options->timeout_ms > 0 ? options->timeout_ms : DEFAULT_TIMEOUT_MS;
    *importer = (struct fl_importer){.options = *options, .begin_ns = monotonic_now_ns()};
    importer->stream.fd = -1;
    importer->process.talk_fd = -1;
    importer->deadline_ns = importer->begin_ns + timeout_ms * 1000000ull;
    if (!options->model && !options->environment)
        return fl_error_set(error, FL_ERROR_ARGUMENT, "model", "a file name is needed");
    if ((options->model && !check_file(options->model, error)) ||
        (options->environment && !check_file(options->environment, error)))
        return false;
    const char *arguments[14] = {"--scene", "1"};
    char degrees[48], point_size[48];
    size_t count = 2;
    if (options->environment) {
        arguments[count++] = "--environment";
        arguments[count++] = options->environment;
        snprintf(degrees, sizeof(degrees), "--environment-rotation=%.9g", options->environment_degrees);
        arguments[count++] = degrees;
    }
    if (options->variant) {
        arguments[count++] = "--variant";
        arguments[count++] = options->variant;
    }
    if (options->point_size > 0) {
        snprintf(point_size, sizeof(point_size), "--point-size=%.9g", options->point_size);
        arguments[count++] = point_size;
    }
    if (!options->model) {
        arguments[count++] = "--no-model";
    } else {
        arguments[count++] = "--"; /* a model's name may begin with '-' */
        arguments[count++] = options->model;
    }
    int fd = -1;
    if (!fl_process_start(&importer->process, "farlight-import", FL_WIRING_DESCRIPTOR, arguments, &fd, error))
        return false;
    if (fl_stream_init(&importer->stream, fd, MESSAGE_FROM_CLIENT | MESSAGE_FROM_LOCAL, "the importer", error))
        return true;
    fl_importer_finish(importer);
    return false;
}

static bool remember_camera(struct fl_importer *importer, const struct message_set_node *node,
                            struct fl_error *error)
{
    if (importer->camera_count >= CAMERAS_MAX)
        return true;
    size_t capacity = importer->camera_capacity;
    if (!fl_grow((void **)&importer->cameras, &capacity, importer->camera_count, sizeof(*importer->cameras),
                 error))
        return false;
    if (!fl_grow((void **)&importer->camera_objects, &importer->camera_capacity, importer->camera_count,
                 sizeof(*importer->camera_objects), error))
        return false;
    struct fl_camera_info *camera = &importer->cameras[importer->camera_count];
    importer->camera_objects[importer->camera_count++] = node->object;
    camera->node = node->node;
    snprintf(camera->name, sizeof(camera->name), "%s", node->name);
    return true;
}

static bool remember_object(struct fl_importer *importer, const struct message_set_camera *camera,
                            struct fl_error *error)
{
    if (importer->object_count >= CAMERAS_MAX)
        return true;
    if (!fl_grow((void **)&importer->objects, &importer->object_capacity, importer->object_count,
                 sizeof(*importer->objects), error))
        return false;
    struct fl_camera_object *object = &importer->objects[importer->object_count++];
    object->camera = camera->camera;
    snprintf(object->name, sizeof(object->name), "%s", camera->name);
    return true;
}

static void take_note(struct fl_importer *importer, const struct message_import_note *note)
{
    if (note->severity == PROTOCOL_SEVERITY_ERROR)
        fl_error_set(&importer->complaint, FL_ERROR_MODEL, note->where, "%s", note->text);
    if (importer->options.note)
        importer->options.note(
            importer->options.user,
            &(struct fl_note){.severity = note->severity, .where = note->where, .text = note->text});
}

bool fl_importer_observe(struct fl_importer *importer, const struct message *message, struct fl_error *error)
{
    if (!fl_catalogue_observe(&importer->catalogue, message, error))
        return false;
    switch (message->type) {
    case MESSAGE_SET_NODE:
        return message->set_node.kind != PROTOCOL_NODE_CAMERA ||
               remember_camera(importer, &message->set_node, error);
    case MESSAGE_SET_CAMERA:
        return remember_object(importer, &message->set_camera, error);
    case MESSAGE_IMPORT_NOTE:
        take_note(importer, &message->import_note);
        return true;
    case MESSAGE_IMPORT_PROGRESS:
        if (importer->options.progress)
            importer->options.progress(importer->options.user, message->import_progress.done_bytes,
                                       message->import_progress.total_bytes, message->import_progress.text);
        return true;
    case MESSAGE_IMPORT_DONE:
        importer->done = true;
        importer->stats.read_bytes = message->import_done.read_bytes;
        importer->stats.read_ns = message->import_done.read_ns;
        importer->stats.parse_ns = message->import_done.parse_ns;
        importer->stats.hash_ns = message->import_done.hash_ns;
        importer->stats.import_ns = message->import_done.total_ns;
        return true;
    default:
        return true;
    }
}

bool fl_importer_explain(struct fl_importer *importer, struct fl_error *error)
{
    const char *model = importer->options.model ? importer->options.model : importer->options.environment;
    if (importer->complaint.code != FL_ERROR_NONE) {
        *error = importer->complaint;
        return false;
    }
    char words[520];
    fl_process_last_words(&importer->process, 1000, words, sizeof(words));
    return fl_error_set(error, FL_ERROR_MODEL, model, "the importer failed without a message%s%s",
                        words[0] != '\0' ? ": " : "", words);
}

/* Nodes without a name have their camera's. */
static void complete_names(struct fl_importer *importer)
{
    for (size_t i = 0; i < importer->camera_count; i++) {
        if (importer->cameras[i].name[0] != '\0')
            continue;
        for (size_t j = 0; j < importer->object_count; j++)
            if (importer->objects[j].camera == importer->camera_objects[i])
                memcpy(importer->cameras[i].name, importer->objects[j].name, sizeof(importer->objects[j].name));
    }
}

void fl_importer_stop(struct fl_importer *importer)
{
    fl_stream_finish(&importer->stream);
    /* After `done` it only has to end. */
    if (importer->process.pid > 0 && (!importer->done || !fl_process_has_ended(&importer->process, 100)))
        fl_process_kill(&importer->process);
    fl_process_end(&importer->process, 2000);
    importer->stats.load_ns = monotonic_now_ns() - importer->begin_ns;
    complete_names(importer);
}

void fl_importer_finish(struct fl_importer *importer)
{
    fl_importer_stop(importer);
    free(importer->cameras);
    free(importer->camera_objects);
    free(importer->objects);
    fl_catalogue_finish(&importer->catalogue);
    *importer = (struct fl_importer){.stream = {.fd = -1}, .process = {.talk_fd = -1}};
}
