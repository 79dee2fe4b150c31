/* SPDX-License-Identifier: MIT */
/* The stream of requests: pictures to be written, files to be compared. */
#ifndef FARLIGHT_CLIENT_OUTPUT_SERVE_H
#define FARLIGHT_CLIENT_OUTPUT_SERVE_H

#include "colour.h"
#include "compare.h"
#include "image.h"

#include <stdbool.h>
#include <stddef.h>

struct serve_options {
    int fd;                   /* connected stream socket */
    float frames_per_second;  /* for the metadata of images; 0: none */
    const char *light_groups; /* NULL: they have no names */
    bool full_metadata, dwaa;
    struct colour_wanted colour; /* with it, the first answer says whether there is that, before any request */
    struct image_window window;  /* of EXR files */
    const struct compare_file *files; /* that may be compared or merged: a message opens nothing */
    size_t file_count;
};

/* Answers requests until the other side ends. False, with a line on standard error: it broke the protocol, or
 * there is no memory. */
bool serve(const struct serve_options *options);

#endif
