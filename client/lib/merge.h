/* SPDX-License-Identifier: MIT */
/* Merging the parts of a picture, which several commands have rendered, into one file. */
#ifndef FARLIGHT_CLIENT_LIB_MERGE_H
#define FARLIGHT_CLIENT_LIB_MERGE_H

#include "lib/farlight.h"

struct fl_merge_options {
    const char *const *parts; /* paths, in any order */
    size_t part_count;        /* at most SQUARES_PARTS_MAX */
    const char *folder;       /* folder of the picture */
    const char *path;         /* the picture's, EXR */
    bool any_device;          /* parts of different devices are no error */
    int interrupt_fd;
};

/* The program that writes images checks the parts and merges them; it may read these files and write into the
 * folder. The picture is complete when this returns true. `field` of an error names the part at fault. */
bool fl_merge(const struct fl_merge_options *options, struct fl_error *error);

#endif
