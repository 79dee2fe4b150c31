/* SPDX-License-Identifier: MIT */
/* Connections, counted to limit those of one address. No I/O. */
#ifndef FARLIGHT_CLIENT_WEB_CALLERS_H
#define FARLIGHT_CLIENT_WEB_CALLERS_H

#include "web/links.h"

#define CALLERS_MAX 512u
#define CALLER_PEER_BYTES 64

struct web_caller {
    bool is_there;
    enum web_right right; /* right of its WebSocket */
    char peer[CALLER_PEER_BYTES];
};

/* The open connections; zero: none. */
struct web_callers {
    struct web_caller all[CALLERS_MAX];
};

/* True if this address, which may have `most`, can have another connection. */
bool web_callers_has_room(const struct web_callers *callers, const char *peer, unsigned most);
/* Adds a connection, which keeps its place until is_there is false. NULL: the list is full. */
struct web_caller *web_callers_add(struct web_callers *callers, const char *peer);

#endif
