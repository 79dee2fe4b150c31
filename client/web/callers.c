/* SPDX-License-Identifier: MIT */
/* The list of connections. */
#include "web/callers.h"

#include <stdio.h>
#include <string.h>

bool web_callers_has_room(const struct web_callers *callers, const char *peer, unsigned most)
{
    unsigned count = 0;
    bool has_room = false;
    for (size_t i = 0; i < CALLERS_MAX; i++) {
        const struct web_caller *caller = &callers->all[i];
        has_room = has_room || !caller->is_there;
        count += caller->is_there && strcmp(caller->peer, peer) == 0;
    }
    return has_room && count < most;
}

struct web_caller *web_callers_add(struct web_callers *callers, const char *peer)
{
    for (size_t i = 0; i < CALLERS_MAX; i++) {
        struct web_caller *caller = &callers->all[i];
        if (caller->is_there)
            continue;
        *caller = (struct web_caller){.is_there = true, .right = WEB_READS};
        snprintf(caller->peer, sizeof(caller->peer), "%s", peer);
        return caller;
    }
    return NULL;
}
