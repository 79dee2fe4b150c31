/* SPDX-License-Identifier: MIT */
/* Dispatch: one row per message. */
#ifndef FARLIGHT_SESSION_DISPATCH_H
#define FARLIGHT_SESSION_DISPATCH_H

#include "protocol/framing.h"
#include "session/requests.h"

#include <stdbool.h>
#include <stddef.h>

/* The requirement on the header's request number. */
enum dispatch_request {
    DISPATCH_ANY,       /* the handler checks it */
    DISPATCH_STARTS,    /* a new one; the handler gets it */
    DISPATCH_CONTINUES, /* a request in flight of the row's kind; the handler gets it */
};

struct dispatch_row {
    enum message_type type;
    enum dispatch_request rule;
    enum request_kind kind;
    void (*handle)(struct session *session, struct request *request, const struct framing_header *header,
                   const struct message *message);
};

const struct dispatch_row *dispatch_find(uint32_t type); /* NULL: no message of clients */

/* Calls of a connection; `context` is the session. */
void dispatch_message(void *context, const struct framing_header *header, const struct message *message);
void dispatch_invalid(void *context, const struct framing_header *header, const struct decode_error *error);

#endif
