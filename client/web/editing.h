/* SPDX-License-Identifier: MIT */
/* What a browser that may edit asks of the scene: lists of objects, one object, a change, and its undoing. */
#ifndef FARLIGHT_CLIENT_WEB_EDITING_H
#define FARLIGHT_CLIENT_WEB_EDITING_H

#include "web/request.h"

#define UNDOS_MAX 64u /* older changes stay */

struct web_undo {
    struct fl_assignment *assignments; /* malloc'ed */
    size_t count;
};

/* Of one browser, which undoes its own changes. Zero: none. */
struct web_editing {
    struct web_undo undos[UNDOS_MAX];
    size_t undo_count;
};

/* The answer to a WEB_LIST, WEB_READ, WEB_EDIT or WEB_UNDO, for free(): {"objects": ..}, {"object": ..} or
 * {"edited": ..}. NULL: an error. */
char *web_editing_answer(struct web_editing *editing, struct fl_scene *scene, const struct web_request *request,
                         struct fl_error *error);
void web_editing_finish(struct web_editing *editing);

#endif
