/* SPDX-License-Identifier: MIT */
/* Connections, for the limit of those of one address. No I/O. */
#ifndef FARLIGHT_CLIENT_WEB_CALLERS_H
#define FARLIGHT_CLIENT_WEB_CALLERS_H

#include "web/links.h"

#define CALLERS_MAX 512u
#define CALLER_PEER_BYTES 64

struct web_caller {
    bool is_there;
    enum web_right right; /* of its WebSocket */
    char peer[CALLER_PEER_BYTES];
};

/* Zero: none. */
struct web_callers {
    struct web_caller all[CALLERS_MAX];
};

/* Whether one more may come of this address, which may have `most`. */
bool web_callers_has_room(const struct web_callers *callers, const char *peer, unsigned most);
/* NULL: there is no room at all. It stays where it is until is_there is false. */
struct web_caller *web_callers_add(struct web_callers *callers, const char *peer);

#endif
