/* SPDX-License-Identifier: MIT */
/* A file beside each picture, PATH.sha256, in the format of sha256sum(1): whether a picture is still what was
 * written can then be told on any host, by `farlight verify` or by `sha256sum -c`. */
#ifndef FARLIGHT_CLI_JOBS_DIGEST_H
#define FARLIGHT_CLI_JOBS_DIGEST_H

#include "lib/farlight.h"

#define DIGEST_ENDING ".sha256"

enum digest_state {
    DIGEST_AGREES,
    DIGEST_NO_PICTURE,
    DIGEST_MISSING, /* of a picture that is there */
    DIGEST_DIFFERS, /* the picture is not what was written, or the digest is of another one */
    DIGEST_UNREADABLE,
    DIGEST_STATE_COUNT
};
const char *digest_state_text(enum digest_state state);

/* Reads the picture at `path`, and replaces its digest. */
bool digest_write(const char *path, struct fl_error *error);
enum digest_state digest_check(const char *path);

#endif
