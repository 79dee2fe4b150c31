/* SPDX-License-Identifier: MIT */
/* Why bytes are no valid message, or why a struct cannot be sent. */
#ifndef FARLIGHT_PROTOCOL_DECODE_ERROR_H
#define FARLIGHT_PROTOCOL_DECODE_ERROR_H

#include "protocol/messages.h"

/* code PROTOCOL: the bytes cannot be cut into fields; the connection is no longer to be trusted.
 * code INVALID:  one field's value or count is not allowed; the message can be answered by an error.
 * code VERSION:  handshake only.
 * code LIMIT:    the caller's buffer or scratch is too small, or the message too large to be sent. */
struct decode_error {
    enum protocol_error_code code; /* PROTOCOL_ERROR_NONE: no error */
    char field[128];               /* "render.keys[3].fov_y"; empty: the message as a whole */
    char text[192];                /* "4 is not within 0.001 .. 3.1" */
};

#ifdef __cplusplus
extern "C" {
#endif

/* Fills *error (may be NULL) and returns false. The first error wins. */
bool decode_error_set(struct decode_error *error, enum protocol_error_code code, const char *field,
                      const char *format, ...) __attribute__((format(printf, 4, 5)));

#ifdef __cplusplus
}
#endif
#endif
