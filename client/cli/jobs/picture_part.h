/* SPDX-License-Identifier: MIT */
/* Parts of a picture, `farlight render --part K/N`: all samples of some squares, each rendered as a crop. A
 * pixel's samples are never divided, so nothing is rounded twice: the merged picture has the bytes of one that
 * is rendered whole, for any number of parts and with all layers. */
#ifndef FARLIGHT_CLI_JOBS_PICTURE_PART_H
#define FARLIGHT_CLI_JOBS_PICTURE_PART_H

#include "options/job.h"
#include "protocol/common/squares.h"

/* A part under construction; zeroed before the first use. */
struct cli_picture_part {
    struct squares squares;
    uint32_t first, next, end; /* range of its squares, and the next one to render */
    char name[400];            /* name for the file: "K/N DIGEST DEVICE" */
    struct fl_frame *frame;    /* the whole picture, black for missing squares; NULL: no square has arrived */
};

/* Checks, after the command line, that the job's options are compatible with parts. True if no part is
 * requested. */
bool cli_picture_part_complete(struct cli_job *job);
/* Begins after the scene was settled. Earlier squares are kept if device and scene are unchanged. */
bool cli_picture_part_begin(struct cli_picture_part *part, struct cli_job *job, struct fl_connection *connection,
                            const struct fl_scene *scene, struct fl_error *error);
/* True if the file is this part of this picture, by this device. */
bool cli_picture_part_is_there(const struct cli_picture_part *part, const char *path);
/* Sets the request for the next square; false: all squares have arrived. */
bool cli_picture_part_next(const struct cli_picture_part *part, struct message_render *render);
/* Stores the square in the picture. */
bool cli_picture_part_take(struct cli_picture_part *part, struct fl_frame *square, struct fl_error *error);
void cli_picture_part_finish(struct cli_picture_part *part);

#endif
