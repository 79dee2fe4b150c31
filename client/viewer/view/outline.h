/* SPDX-License-Identifier: MIT */
/* Outline of the object edited in the panel: requested once the picture is at rest, and drawn over that picture
 * alone. */
#ifndef FARLIGHT_VIEWER_VIEW_OUTLINE_H
#define FARLIGHT_VIEWER_VIEW_OUTLINE_H

#include "lib/farlight.h"
#include "viewer/overlay/pixmap.h"

struct view;

enum edit_tab { EDIT_NODE, EDIT_MATERIAL, EDIT_LIGHT, EDIT_ENVIRONMENT, EDIT_TABS };

/* The edited object, as far as the view needs it. */
struct edit_choice {
    bool shown; /* the panel is visible */
    size_t tab;
    uint32_t ids[EDIT_TABS]; /* 0: none */
    bool dragging;           /* a value is being dragged */
    bool has_pending;        /* a value is not yet sent to the daemon */
};

struct view_outline {
    uint64_t command, change, revision; /* identity of the picture outlined last .. */
    size_t tab;
    uint32_t id; /* .. and the object in it */
    bool is_answered;
    uint8_t *marks; /* pixels of the outline; NULL: none */
    int width, height;
    struct pixmap picture; /* the live picture with the outline, .. */
    uint64_t of_version;   /* .. made from this version of it, .. */
    bool is_drawn;         /* .. if it is drawn already */
};

bool view_outline_is_due(const struct view *view);   /* an outline can be requested, and was not yet */
bool view_outline_is_asked(const struct view *view); /* the last request is for the outline that is wanted */
/* Completes a request for identifiers. */
void view_outline_ask(struct view *view, struct message_render *job);
void view_outline_take(struct view *view, const struct fl_frame *frame);
void view_outline_refuse(struct view *view); /* this picture gets no outline */
bool view_outline_is_shown(const struct view *view);
void view_step_outline(struct view *view);
void view_outline_forget(struct view *view);

#endif
