/* SPDX-License-Identifier: MIT */
/* The loop of requests: pictures to write, files to compare or merge. */
#ifndef FARLIGHT_CLIENT_OUTPUT_SERVE_H
#define FARLIGHT_CLIENT_OUTPUT_SERVE_H

#include "colour.h"
#include "compare.h"
#include "image.h"

#include <stdbool.h>
#include <stddef.h>

struct serve_options {
    int fd;                   /* connected stream socket */
    float frames_per_second;  /* metadata; 0: none */
    const char *light_groups; /* names of light groups; NULL: none */
    bool full_metadata, dwaa;
    /* If set, the first answer says whether these colours exist, before any request. */
    struct colour_wanted colour;
    struct image_window window;       /* window of EXR files */
    const struct compare_file *files; /* the only files that requests may compare or merge */
    size_t file_count;
};

/* Answers requests until the other side closes. False, with a line on standard error: it broke the protocol, or
 * there is no memory. */
bool serve(const struct serve_options *options);

#endif
