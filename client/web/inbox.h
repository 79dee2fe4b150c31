/* SPDX-License-Identifier: MIT */
/* Requests of a browser that its seat has not begun; only the newest of each kind is kept. The seat's lock
 * guards it. */
#ifndef FARLIGHT_CLIENT_WEB_INBOX_H
#define FARLIGHT_CLIENT_WEB_INBOX_H

#include "web/request.h"

/* Slots by kind; WEB_NONE, zero, means empty. */
struct web_inbox {
    struct web_request show, camera, key, compare, edit;
};

/* Stores a request. False: the browser may not make it, or its last edit is still waiting; nothing is changed.
 * WEB_SHOWN is not for the seat. */
bool web_inbox_put(struct web_inbox *inbox, const struct web_request *request, bool may_edit);
/* Takes a request out of its slot; WEB_NONE if the slot is empty or the request is not `wanted` yet. */
struct web_request web_inbox_take(struct web_request *request, bool wanted);

#endif
