/* SPDX-License-Identifier: MIT */
/* Requests of a browser that its seat has not begun. */
#include "web/inbox.h"

/* The slot for a request of this kind; NULL: none. */
static struct web_request *place_of(struct web_inbox *inbox, enum web_request_kind kind)
{
    switch (kind) {
    case WEB_SHOW:
        return &inbox->show;
    case WEB_CAMERA:
        return &inbox->camera;
    case WEB_KEY:
        return &inbox->key;
    case WEB_COMPARE:
        return &inbox->compare;
    default:
        return web_request_edits(kind) ? &inbox->edit : NULL;
    }
}

bool web_inbox_put(struct web_inbox *inbox, const struct web_request *request, bool may_edit)
{
    struct web_request *place = place_of(inbox, request->kind);
    if (!place || (place == &inbox->edit && (!may_edit || inbox->edit.kind != WEB_NONE)))
        return false;
    *place = *request;
    return true;
}

struct web_request web_inbox_take(struct web_request *request, bool wanted)
{
    const struct web_request taken = wanted ? *request : (struct web_request){0};
    if (wanted)
        *request = (struct web_request){0};
    return taken;
}
