/* SPDX-License-Identifier: MIT */
/* The client's side of the importer program. */
#include "lib/importer.h"
#include "protocol/common/clock.h"

#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define DEFAULT_TIMEOUT_MS 600000u
/* Further cameras cannot be chosen by name; this bounds the work that a hostile model can cause. */
#define CAMERAS_MAX 4096u
/* Bounds the files that a hostile model can name. */
#define FILES_MAX 65536u

bool fl_importer_check_file(const char *path, struct fl_error *error)
{
    struct stat status;
    if (stat(path, &status) < 0 || access(path, R_OK) < 0)
        return fl_error_set(error, FL_ERROR_FILE, path, "cannot be read: %s", strerror(errno));
    if (!S_ISREG(status.st_mode))
        return fl_error_set(error, FL_ERROR_FILE, path, "is not a file");
    return true;
}

/* ---- start ---- */

#define ARGUMENTS_MAX (16 + 4 * FL_MODELS_MAX)

/* Arguments of the program; `made` ones are freed with it. */
struct command {
    const char *words[ARGUMENTS_MAX];
    size_t count;
    char *made[2 + 2 * FL_MODELS_MAX];
    size_t made_count;
};

static void add_word(struct command *command, const char *word)
{
    command->words[command->count++] = word;
}

static bool add_made(struct command *command, struct fl_error *error, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

static bool add_made(struct command *command, struct fl_error *error, const char *format, ...)
{
    char *made = NULL;
    va_list arguments;
    va_start(arguments, format);
    const int length = vasprintf(&made, format, arguments);
    va_end(arguments);
    if (length < 0)
        return fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    command->made[command->made_count++] = made;
    add_word(command, made);
    return true;
}

static bool is_input(const struct fl_load_options *options, const char *path)
{
    return options->input_fd > 0 && strcmp(path, "-") == 0;
}

/* Adds a model's arguments; a path may begin with '-'. */
static bool add_model(struct command *command, const struct fl_load_options *options, const struct fl_model *model,
                      struct fl_error *error)
{
    const float *p = model->position, *d = model->degrees;
    const double scale = model->scale > 0 ? (double)model->scale : 1;
    const bool is_option = model->path[0] == '-' && !is_input(options, model->path);
    if (!add_made(command, error, "%s%s", is_option ? "./" : "", model->path))
        return false;
    if (is_input(options, model->path) && options->input_format) {
        add_word(command, "--format");
        add_word(command, options->input_format);
    }
    return !model->is_placed ||
           add_made(command, error, "--at=%.9g,%.9g,%.9g:%.9g,%.9g,%.9g:%.9g", (double)p[0], (double)p[1],
                    (double)p[2], (double)d[0], (double)d[1], (double)d[2], scale);
}

static bool fill_command(struct command *command, const struct fl_load_options *options, struct fl_error *error)
{
    add_word(command, "--scene");
    add_word(command, "1");
    if (options->environment) {
        add_word(command, "--environment");
        add_word(command, options->environment);
        if (!add_made(command, error, "--environment-rotation=%.9g", options->environment_degrees))
            return false;
    }
    if (options->without_studio)
        add_word(command, "--no-sky");
    if (options->variant) {
        add_word(command, "--variant");
        add_word(command, options->variant);
    }
    if (options->point_size > 0 && !add_made(command, error, "--point-size=%.9g", options->point_size))
        return false;
    if (options->model_count == 0)
        add_word(command, "--no-model");
    for (size_t i = 0; i < options->model_count; i++)
        if (!add_model(command, options, &options->models[i], error))
            return false;
    return true;
}

static bool remember_file(struct fl_importer *importer, const char *folder_of, const char *name,
                          struct fl_error *error)
{
    const char *slash = folder_of ? strrchr(folder_of, '/') : NULL;
    const int folder_bytes = slash ? (int)(slash - folder_of) + 1 : 0;
    if (importer->file_count >= FILES_MAX)
        return true;
    if (!fl_grow((void **)&importer->files, &importer->file_capacity, importer->file_count,
                 sizeof(*importer->files), error))
        return false;
    if (asprintf(&importer->files[importer->file_count], "%.*s%s", folder_bytes, folder_of ? folder_of : "",
                 name) < 0)
        return fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    importer->file_count++;
    return true;
}

static bool take_model(struct fl_importer *importer, const struct fl_model *model, struct fl_error *error)
{
    return is_input(&importer->options, model->path) ||
           (fl_importer_check_file(model->path, error) && remember_file(importer, NULL, model->path, error));
}

/* Treats a single model as the only one of several. */
static bool take_models(struct fl_importer *importer, struct fl_error *error)
{
    struct fl_load_options *options = &importer->options;
    importer->only = (struct fl_model){.path = options->model};
    if (options->model_count == 0 && options->model) {
        options->models = &importer->only;
        options->model_count = 1;
    }
    if (options->model_count > FL_MODELS_MAX)
        return fl_error_set(error, FL_ERROR_ARGUMENT, "model", "%zu models; at most %d are allowed",
                            options->model_count, FL_MODELS_MAX);
    if (options->model_count == 0 && !options->environment)
        return fl_error_set(error, FL_ERROR_ARGUMENT, "model", "a file name is needed");
    for (size_t i = 0; i < options->model_count; i++)
        if (!take_model(importer, &options->models[i], error))
            return false;
    return !options->environment || (fl_importer_check_file(options->environment, error) &&
                                     remember_file(importer, NULL, options->environment, error));
}

static bool start(struct fl_importer *importer, struct fl_error *error)
{
    struct command command = {.count = 0};
    int fd = -1;
    /* The program reads the input from its beginning on every start. */
    importer->process.input_fd = importer->options.input_fd;
    importer->process.has_large_arrays = true;
    if (importer->process.input_fd > 0)
        lseek(importer->process.input_fd, 0, SEEK_SET);
    const bool started =
        fill_command(&command, &importer->options, error) &&
        fl_process_start(&importer->process, "farlight-import", FL_WIRING_DESCRIPTOR, command.words, &fd, error);
    for (size_t i = 0; i < command.made_count; i++)
        free(command.made[i]);
    return started &&
           fl_stream_init(&importer->stream, fd, MESSAGE_FROM_CLIENT | MESSAGE_FROM_LOCAL, "the importer", error);
}

bool fl_importer_start(struct fl_importer *importer, const struct fl_load_options *options, struct fl_error *error)
{
    const unsigned timeout_ms = options->timeout_ms > 0 ? options->timeout_ms : DEFAULT_TIMEOUT_MS;
    *importer = (struct fl_importer){.options = *options, .begin_ns = monotonic_now_ns()};
    importer->stream.fd = -1;
    importer->process.talk_fd = -1;
    importer->deadline_ns = importer->begin_ns + timeout_ms * 1000000ull;
    if (take_models(importer, error) && start(importer, error))
        return true;
    fl_importer_finish(importer);
    return false;
}

/* ---- its messages ---- */

const char *fl_importer_name(const struct fl_importer *importer)
{
    const struct fl_load_options *options = &importer->options;
    const char *path = options->model_count > 0 ? options->models[0].path : options->environment;
    return is_input(options, path) ? "standard input" : path;
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
    importer->camera_objects[importer->camera_count++] = node->value.object;
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
        return message->set_node.value.kind != PROTOCOL_NODE_CAMERA ||
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
    case MESSAGE_IMPORT_FILE:
        if (message->import_file.model >= importer->options.model_count)
            return true;
        return remember_file(importer, importer->options.models[message->import_file.model].path,
                             message->import_file.name, error);
    case MESSAGE_IMPORT_DONE:
        importer->done = true;
        importer->stats.read_bytes = message->import_done.read_bytes;
        importer->stats.read_ns = message->import_done.read_ns;
        importer->stats.parse_ns = message->import_done.parse_ns;
        importer->stats.hash_ns = message->import_done.hash_ns;
        importer->stats.import_ns = message->import_done.total_ns;
        for (unsigned i = 0; i < 3; i++)
            importer->stats.origin[i] = (double)message->import_done.origin[i];
        return true;
    default:
        return true;
    }
}

bool fl_importer_explain(struct fl_importer *importer, struct fl_error *error)
{
    if (importer->complaint.code != FL_ERROR_NONE) {
        *error = importer->complaint;
        return false;
    }
    char words[520];
    fl_process_last_words(&importer->process, 1000, words, sizeof(words));
    fl_error_set(error, FL_ERROR_MODEL, fl_importer_name(importer), "the importer failed without a message%s%s",
                 words[0] != '\0' ? ": " : "", words);
    return fl_error_remedy(error, "the file may be broken in a way that its reader does not survive; if other "
                                  "programs can read it, write it with one of them as glTF");
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
    for (size_t i = 0; i < importer->file_count; i++)
        free(importer->files[i]);
    free(importer->files);
    fl_catalogue_finish(&importer->catalogue);
    *importer = (struct fl_importer){.stream = {.fd = -1}, .process = {.talk_fd = -1}};
}
