/* SPDX-License-Identifier: MIT */
/* The outline of what the panel changes: asked for once the picture is at rest, and drawn over that picture alone.
 */
#ifndef FARLIGHT_VIEWER_VIEW_OUTLINE_H
#define FARLIGHT_VIEWER_VIEW_OUTLINE_H

#include "lib/farlight.h"
#include "viewer/overlay/pixmap.h"

struct view;

enum edit_tab { EDIT_NODE, EDIT_MATERIAL, EDIT_LIGHT, EDIT_ENVIRONMENT, EDIT_TABS };

/* The object that is edited. */
struct edit_choice {
    bool shown; /* the panel */
    size_t tab;
    uint32_t ids[EDIT_TABS]; /* 0: none */
    bool dragging;           /* a value */
    bool has_pending;        /* a value that the daemon is not told yet */
};

struct view_outline {
    uint64_t command, change, revision; /* of the picture .. */
    size_t tab;
    uint32_t id; /* .. and the object that it was asked for last */
    bool is_answered;
    uint8_t *marks; /* its pixels; NULL: there is none */
    int width, height;
    struct pixmap picture; /* the live one with it, .. */
    uint64_t of_version;   /* .. of which it is this version, .. */
    bool is_drawn;         /* .. once it is there */
};

bool view_outline_is_due(const struct view *view);   /* it can be asked for, and was not yet */
bool view_outline_is_asked(const struct view *view); /* what was asked for is what is wanted */
/* Completes a request for identifiers. */
void view_outline_ask(struct view *view, struct message_render *job);
void view_outline_take(struct view *view, const struct fl_frame *frame);
void view_outline_refuse(struct view *view); /* this picture has none */
bool view_outline_is_shown(const struct view *view);
void view_step_outline(struct view *view);
void view_outline_forget(struct view *view);

#endif
