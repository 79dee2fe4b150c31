/* SPDX-License-Identifier: MIT */
/* What a browser that may edit asks of the scene: lists of objects, one object, a change, undoing it, and making
 * it again. */
#ifndef FARLIGHT_CLIENT_WEB_EDITING_H
#define FARLIGHT_CLIENT_WEB_EDITING_H

#include "options/edit_history.h"
#include "web/request.h"

/* The answer to a request of those that edit, for free(): {"objects": ..}, {"object": ..} or {"edited": ..}. NULL:
 * an error. The history is that of the browser, which undoes its own changes. */
char *web_editing_answer(struct edit_history *history, struct fl_scene *scene, const struct web_request *request,
                         struct fl_error *error);

#endif
