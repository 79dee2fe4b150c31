/* SPDX-License-Identifier: MIT */
/* A part of a picture, `farlight render --part K/N`: all samples of some squares of it, each of which is rendered
 * as a crop. No pixel's samples are divided, so nothing is rounded twice: the picture of all parts has the bytes
 * of one that is rendered as a whole, for any number of parts and with all layers. */
#ifndef FARLIGHT_CLI_JOBS_PICTURE_PART_H
#define FARLIGHT_CLI_JOBS_PICTURE_PART_H

#include "options/job.h"
#include "protocol/common/squares.h"

/* A part while its squares come; zeroed before the first use. */
struct cli_picture_part {
    struct squares squares;
    uint32_t first, next, end; /* its squares, and the one that is to be rendered */
    char name[400];            /* for the file: "K/N DIGEST DEVICE" */
    struct fl_frame *frame;    /* the whole picture, black where no square has come; NULL: none has */
};

/* After the command line: whether the job's options go with parts. True, if none is asked for. */
bool cli_picture_part_complete(struct cli_job *job);
/* The scene is settled. Squares that have come before stay, if device and scene are still the same. */
bool cli_picture_part_begin(struct cli_picture_part *part, struct cli_job *job, struct fl_connection *connection,
                            const struct fl_scene *scene, struct fl_error *error);
/* Whether the file is this part of this picture, by this device. */
bool cli_picture_part_is_there(const struct cli_picture_part *part, const char *path);
/* Sets what is to be rendered next; false: all squares have come. */
bool cli_picture_part_next(const struct cli_picture_part *part, struct message_render *render);
/* Puts the square into the picture. */
bool cli_picture_part_take(struct cli_picture_part *part, struct fl_frame *square, struct fl_error *error);
void cli_picture_part_finish(struct cli_picture_part *part);

#endif
