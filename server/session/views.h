/* SPDX-License-Identifier: MIT */
/* What a session keeps of a view beside what it keeps of every job: the wishes that the engine looks at, and the
 * views that are to take its place.
 *
 * The views that follow each other on a channel are one struct job: its credit, frame count and wishes go on. A
 * view takes the place of the one before when the engine says so, in the order in which the client asked for them;
 * frames of the one before that have not begun on the wire are dropped then, one that has is finished, and then
 * its request is answered. */
#ifndef FARLIGHT_SESSION_VIEWS_H
#define FARLIGHT_SESSION_VIEWS_H

#include "job/view_wishes.h"
#include "protocol/messages.h"
#include "session/jobs.h"

/* Frames of a view that are rendered, encoded or sent at once: while one is sent, the next one is made. */
#define VIEW_WINDOW_FRAMES 2

/* A view that is to take the place of the one that is there. */
struct view_change {
    struct view_change *next;
    uint32_t request, scene;
    uint64_t credit, window, frame_bytes; /* as of struct job */
    bool cancelled;
};

struct session_view {
    struct view_wishes *wishes;
    struct view_change *changes, **changes_end; /* the engine has not answered them yet; in order */
    uint64_t last_command;
};

struct session_view *session_view_create(void); /* NULL: out of memory */
void session_view_destroy(struct job *job);     /* of a job that ends; accepts one that is no view */

/* Takes `change` over. */
void view_add_change(struct job *job, struct view_change *change);
struct view_change *view_find_change(const struct job *job, uint32_t request); /* NULL: it is none */
/* The engine refused it: the view that is there goes on. */
void view_drop_change(struct job *job, struct view_change *change);
/* The first change is what the job is from now on. */
void view_switch(struct job *job);

/* VIEW_CAMERA and FRAME_ACK */
void views_look(struct session *session, const struct message_view_camera *message);
void views_acknowledge(struct session *session, const struct message_frame_ack *message);

#endif
