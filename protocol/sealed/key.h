/* SPDX-License-Identifier: MIT */
/* The file of a key: 32 random bytes and nothing else, for its owner alone. */
#ifndef FARLIGHT_PROTOCOL_SEALED_KEY_H
#define FARLIGHT_PROTOCOL_SEALED_KEY_H

#include "protocol/sealed/sealed.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A regular file of the user's own that nobody else may read or write. Error field: the path; code DENIED where
 * others could have come by the key or have put it there, which the text says, else INVALID. */
bool sealed_key_read(struct sealed_key *key, const char *path, struct decode_error *error);
/* Makes a new key in a new file of mode 0600; one that is there is left alone. */
bool sealed_key_create(const char *path, struct decode_error *error);

#ifdef __cplusplus
}
#endif
#endif
