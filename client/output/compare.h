/* SPDX-License-Identifier: MIT */
/* Comparison of two image files: figures, and a picture of the errors. */
#ifndef FARLIGHT_CLIENT_OUTPUT_COMPARE_H
#define FARLIGHT_CLIENT_OUTPUT_COMPARE_H

#include "protocol/messages.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A file that was opened before the sandbox was entered. */
struct compare_file {
    const char *path; /* the path in the request */
    int fd;           /* -1: `reason` is set */
    char reason[160];
};

/* The answer, the storage of its string, and the reason of a failure. */
struct compare_result {
    struct message_images_compared answer;
    char channel_names[256];
    char field[128]; /* end of the path of the file at fault */
    char reason[512];
    const char *remedy; /* may be NULL */
};

/* Folders of fonts, for titles; nothing else is read within the sandbox. */
#define COMPARE_FONT_FOLDER "/usr/share/fonts"
#define COMPARE_LOCAL_FONT_FOLDER "/usr/local/share/fonts"
/* Reads the files and writes the requested picture. False: `field` and `reason` are set, and there is no
 * picture. */
bool compare_images(const struct message_compare_images *wanted, const struct compare_file *a,
                    const struct compare_file *b, struct compare_result *result);

#ifdef __cplusplus
}
#endif

#endif
