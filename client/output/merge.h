/* SPDX-License-Identifier: MIT */
/* The parts of a picture, as `farlight render --part` writes them, become one file. */
#ifndef FARLIGHT_CLIENT_OUTPUT_MERGE_H
#define FARLIGHT_CLIENT_OUTPUT_MERGE_H

#include "compare.h"

#ifdef __cplusplus
extern "C" {
#endif

struct merge_result {
    char field[128]; /* the end of the path of the file at fault; empty: it is none of them */
    char reason[512];
    const char *remedy; /* may be NULL */
};

/* Checks that the files are all parts of one picture, each once, and writes it: with the bytes that a render of
 * the whole would have, but for the digest of its pixels. False: the result says why, and no file is written. */
bool merge_images(const struct message_merge_images *wanted, const struct compare_file *files, size_t count,
                  struct merge_result *result);

#ifdef __cplusplus
}
#endif

#endif
