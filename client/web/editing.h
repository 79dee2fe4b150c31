/* SPDX-License-Identifier: MIT */
/* Requests of browsers that may edit: lists of objects, one object, a change, undo and redo. */
#ifndef FARLIGHT_CLIENT_WEB_EDITING_H
#define FARLIGHT_CLIENT_WEB_EDITING_H

#include "options/edit_history.h"
#include "web/request.h"

/* Answers such a request, as malloc'ed JSON: {"objects": ..}, {"object": ..} or {"edited": ..}. NULL: an error.
 * The history is the browser's own, which undoes only its own changes. */
char *web_editing_answer(struct edit_history *history, struct fl_scene *scene, const struct web_request *request,
                         struct fl_error *error);

#endif
