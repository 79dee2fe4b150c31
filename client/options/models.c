/* SPDX-License-Identifier: MIT */
/* The models of a command line: several of them, their places, and one from standard input. */
#include "models.h"
#include "image_path.h"
#include "interrupt.h"
#include "job.h"
#include "lib/importer.h"
#include "lib/text.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#define INPUT_BYTES_MAX (UINT64_C(2) << 30) /* the importer's limit for any file of a model */
#define SCALE_MIN 1e-6
#define SCALE_MAX 1e6

error_t cli_set_model(struct cli_job *job, const char *path)
{
    for (size_t i = 0; strcmp(path, "-") == 0 && i < job->input.count; i++)
        if (strcmp(job->input.models[i].path, "-") == 0)
            return cli_usage(job, "MODEL", "standard input can be read only once");
    if (job->input.count == FL_MODELS_MAX)
        return cli_usage(job, path, "at most %d models can be shown at once", FL_MODELS_MAX);
    job->input.models[job->input.count++] = (struct fl_model){.path = path};
    job->input.model = job->input.models[0].path;
    return 0;
}

/* Reads "X,Y,Z", "X,Y,Z:RX,RY,RZ", "X,Y,Z:RX,RY,RZ:SCALE" or "X,Y,Z::SCALE". */
static bool read_place(const char *value, struct fl_model *model, struct fl_error *error)
{
    char text[200], *rest = text;
    double scale = 1;
    if ((size_t)snprintf(text, sizeof(text), "%s", value) >= sizeof(text))
        return fl_error_set(error, FL_ERROR_ARGUMENT, "", "the place is too long");
    const char *position = strsep(&rest, ":"), *degrees = strsep(&rest, ":"), *factor = strsep(&rest, ":");
    if (rest)
        return fl_error_set(error, FL_ERROR_ARGUMENT, "", "'%s' has more than position, rotation and scale",
                            value);
    if (!fl_text_vector(position, model->position, error) ||
        (degrees && degrees[0] != '\0' && !fl_text_vector(degrees, model->degrees, error)) ||
        (factor && !fl_text_real(factor, SCALE_MIN, SCALE_MAX, &scale, error)))
        return false;
    model->scale = (float)scale;
    model->is_placed = true;
    return true;
}

error_t cli_set_place(struct cli_job *job, const char *field, const char *value)
{
    struct fl_model placed = {.path = NULL};
    if (job->input.count == 0) {
        cli_usage(job, field, "no model is named before it");
        fl_error_remedy(&job->error, "room.glb chair.glb %s %s", field, value);
        return EINVAL;
    }
    if (!read_place(value, &placed, &job->error)) {
        snprintf(job->error.field, sizeof(job->error.field), "%s", field);
        fl_error_remedy(&job->error, "X,Y,Z, X,Y,Z:RX,RY,RZ or X,Y,Z:RX,RY,RZ:SCALE");
        return EINVAL;
    }
    struct fl_model *last = &job->input.models[job->input.count - 1];
    placed.path = last->path;
    /* A further place adds another instance of the model. */
    if (last->is_placed && job->input.count == FL_MODELS_MAX)
        return cli_usage(job, field, "at most %d models can be shown at once", FL_MODELS_MAX);
    if (last->is_placed)
        last = &job->input.models[job->input.count++];
    *last = placed;
    return 0;
}

bool cli_turn_models(struct cli_job *job)
{
    static const float degrees[3][2][3] = {
        {{0, 0, 90}, {0, 0, -90}}, {{0, 0, 0}, {180, 0, 0}}, {{-90, 0, 0}, {90, 0, 0}}};
    const float *up = job->camera.key.up_world;
    int axis = -1;
    for (int i = 0; i < 3; i++)
        if (up[i] != 0 && up[(i + 1) % 3] == 0 && up[(i + 2) % 3] == 0)
            axis = i;
    if (axis < 0 || job->input.count == 0) {
        cli_usage(job, "--up",
                  axis < 0 ? "is no axis, and there is no --eye"
                           : "this option turns model files, and no model file is given");
        return fl_error_remedy(&job->error,
                               "use x, y, z, -x, -y or -z, or any direction with --eye and --look-at");
    }
    for (size_t i = 0; i < job->input.count; i++) {
        struct fl_model *model = &job->input.models[i];
        if (model->is_placed)
            continue;
        memcpy(model->degrees, degrees[axis][up[axis] < 0], sizeof(model->degrees));
        model->is_placed = true;
    }
    return true;
}

static bool is_input(const char *path)
{
    return strcmp(path, "-") == 0;
}

bool cli_has_input(const struct cli_job *job)
{
    for (size_t i = 0; i < job->input.count; i++)
        if (is_input(job->input.models[i].path))
            return true;
    return false;
}

bool cli_check_models(const struct cli_job *job, struct fl_error *error)
{
    for (size_t i = 0; i < job->input.count; i++)
        if (!is_input(job->input.models[i].path) && !fl_importer_check_file(job->input.models[i].path, error))
            return false;
    if (job->input.count == 0 && job->input.model && !fl_importer_check_file(job->input.model, error))
        return false;
    return !job->input.environment || fl_importer_check_file(job->input.environment, error);
}

bool cli_check_watch(struct cli_job *job)
{
    return !job->input.watch || (!job->input.scene && !cli_has_input(job)) ||
           cli_usage(job, "--watch", "%s cannot be watched like a file",
                     job->input.scene ? "a shared scene" : "standard input") == 0;
}

/* ---- standard input ---- */

/* 0: the end, or *error is set. */
static size_t read_some(char *bytes, size_t count, struct fl_error *error)
{
    for (;;) {
        struct pollfd polled[2] = {{.fd = STDIN_FILENO, .events = POLLIN},
                                   {.fd = cli_interrupt_fd(), .events = POLLIN}};
        poll(polled, cli_interrupt_fd() > 0 ? 2 : 1, -1);
        if (polled[1].revents != 0) {
            fl_error_set(error, FL_ERROR_INTERRUPTED, "", "interrupted");
            return 0;
        }
        const ssize_t got = read(STDIN_FILENO, bytes, count);
        if (got >= 0)
            return (size_t)got;
        if (errno == EINTR || errno == EAGAIN)
            continue;
        fl_error_set(error, FL_ERROR_FILE, "standard input", "cannot be read: %s", strerror(errno));
        return 0;
    }
}

static bool copy_input(int fd, struct fl_error *error)
{
    static char piece[1 << 16];
    uint64_t total = 0;
    for (size_t got = 0; (got = read_some(piece, sizeof(piece), error)) > 0; total += got) {
        if (total + got > INPUT_BYTES_MAX)
            return fl_error_set(error, FL_ERROR_FILE, "standard input", "is larger than %llu MiB",
                                (unsigned long long)(INPUT_BYTES_MAX >> 20));
        if (!cli_write_all(fd, piece, got))
            return fl_error_set(error, FL_ERROR_MEMORY, "standard input", "cannot be kept: %s", strerror(errno));
    }
    if (error->code != FL_ERROR_NONE)
        return false;
    return total > 0 || fl_error_set(error, FL_ERROR_FILE, "standard input", "is empty: it has no model");
}

bool cli_open_input(int *input_fd, struct fl_error *error)
{
    if (isatty(STDIN_FILENO) == 1) {
        fl_error_set(error, FL_ERROR_ARGUMENT, "MODEL", "a model would be read from the terminal");
        return fl_error_remedy(error,
                               "pipe it in, for example 'curl -s ADDRESS | farlight render - -o picture.png'");
    }
    const int fd = memfd_create("farlight-model", MFD_CLOEXEC | MFD_ALLOW_SEALING);
    if (fd < 0)
        return fl_error_set(error, FL_ERROR_SYSTEM, "", "memfd_create: %s", strerror(errno));
    if (!copy_input(fd, error)) {
        close(fd);
        return false;
    }
    fcntl(fd, F_ADD_SEALS, F_SEAL_WRITE | F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL);
    *input_fd = fd;
    return true;
}

bool cli_read_input(struct cli_job *job, struct fl_error *error)
{
    return !cli_has_input(job) || job->input.fd > 0 || cli_open_input(&job->input.fd, error);
}
