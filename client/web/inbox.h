/* SPDX-License-Identifier: MIT */
/* The newest requests of a browser that its seat has not begun. The seat's lock guards it. */
#ifndef FARLIGHT_CLIENT_WEB_INBOX_H
#define FARLIGHT_CLIENT_WEB_INBOX_H

#include "web/request.h"

/* All zero at first: a request of the kind WEB_NONE is none. */
struct web_inbox {
    struct web_request show, look, key, compare, edit;
};

/* False: the browser may not ask that, or its last edit still waits; nothing is changed. WEB_SHOWN is no request
 * for the seat. */
bool web_inbox_put(struct web_inbox *inbox, const struct web_request *request, bool may_edit);
/* The request, which leaves the inbox; WEB_NONE where there is none or it is not `wanted` yet. */
struct web_request web_inbox_take(struct web_request *request, bool wanted);

#endif
