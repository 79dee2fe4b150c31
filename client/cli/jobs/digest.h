/* SPDX-License-Identifier: MIT */
/* Files with digests beside pictures, PATH.sha256, in the format of sha256sum(1), by which `farlight verify` or
 * `sha256sum -c` detects changed pictures on any host. */
#ifndef FARLIGHT_CLI_JOBS_DIGEST_H
#define FARLIGHT_CLI_JOBS_DIGEST_H

#include "lib/farlight.h"

#define DIGEST_ENDING ".sha256"

enum digest_state {
    DIGEST_AGREES,
    DIGEST_NO_PICTURE,
    DIGEST_MISSING, /* the picture exists */
    DIGEST_DIFFERS, /* the picture has changed, or the digest is of another one */
    DIGEST_UNREADABLE,
    DIGEST_STATE_COUNT
};
const char *digest_state_text(enum digest_state state);

/* Reads the picture at `path`, and replaces its digest. */
bool digest_write(const char *path, struct fl_error *error);
enum digest_state digest_check(const char *path);

#endif
