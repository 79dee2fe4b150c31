/* SPDX-License-Identifier: MIT */
/* The state of a view beyond that of any job: the wishes that the engine reads, the pace of its link, and the
 * views that are to replace it.
 *
 * The views that follow each other on a channel are one struct job: its
 * credit, frame count and wishes continue. A view replaces the one before when the engine says so, in the order of
 * the client's requests; frames of the old view that have not begun on the wire are dropped then, one that has is
 * finished, and then the old request is answered. */
#ifndef FARLIGHT_SESSION_VIEWS_H
#define FARLIGHT_SESSION_VIEWS_H

#include "engine/view_wishes.h"
#include "protocol/messages.h"
#include "session/jobs.h"
#include "session/pacing.h"

/* A view's terms, as its render has them. */
struct view_terms {
    uint64_t frame_ns; /* that frames are adapted to: the interval between them */
    uint32_t samples;  /* that a picture is to have */
    struct pacing_terms moving;
    enum encoding still_encoding;
    unsigned quality; /* of motion; 0: lossless */
    bool adapt;
    bool parts; /* frames may come in parts */
};

/* A view that is to take the place of the one that is there. */
struct view_change {
    struct view_change *next;
    uint32_t request, scene;
    enum protocol_tracer tracer;
    uint64_t credit, frame_bytes; /* as of struct job: engine_credit, frame_bytes */
    struct view_terms terms;
    bool cancelled;
};

struct session_view {
    struct view_wishes *wishes;
    struct view_terms terms;
    struct view_change *changes, **changes_end; /* the engine has not answered them yet; in order */
    struct pacing pacing;
    struct loop_timer pace_timer; /* until the next frame is begun, if nothing happens before .. */
    bool due;                     /* .. which it is now */
    struct loop_timer silence_timer;
    struct view_effort effort; /* as the engine has it */
    uint64_t made_ns;          /* time of the last frame from its start until it was encoded */
    /* The client's last command, and the last one that it was shown. */
    uint64_t last_command, shown_command;
    bool last_moving, shown_moving;
    unsigned given_up; /* frames dropped or abandoned since the last one that went whole */
    uint32_t shown_samples;
};

struct view_terms view_terms_of(const struct message_render *render);
struct session_view *session_view_create(const struct view_terms *terms); /* NULL: out of memory */
void session_view_destroy(struct job *job); /* of a job that ends; accepts one that is no view */

/* Takes `change` over. */
void view_add_change(struct job *job, struct view_change *change);
struct view_change *view_find_change(const struct job *job, uint32_t request); /* NULL: it is none */
/* The engine refused it: the view that is there goes on. */
void view_drop_change(struct job *job, struct view_change *change);
/* The first pending change becomes the job's state. */
void view_switch(struct job *job);
/* Frames under way were dropped: they will not be acknowledged. */
void view_forget_frames(struct job *job);

/* Frames that the engine may have begun by now, so that each comes when the link takes it. */
uint64_t view_allowed_credit(struct job *job);

/* A frame has come from the engine; its first byte is about to go; its last one is with the kernel. */
void view_frame_made(struct job *job, const struct engine_frame *frame);
/* The client has seen less than it asked for, as far as is known here. */
bool view_wants_more(const struct job *job);
/* Nothing goes before its client acknowledges a frame. */
bool view_is_unacknowledged(const struct job *job);
bool view_may_send(const struct job *job);
/* It has waited for the link so long that a new frame of the current wishes is better, and possible.
 */
bool view_is_outdated(const struct job *job, const struct engine_frame *frame);
/* It is a picture at rest, which nothing that follows needs, and motion goes on. */
bool view_is_overtaken(const struct job *job, const struct engine_frame *frame);
/* Its remaining bytes would occupy the link for long. */
bool view_is_long(const struct job *job, uint64_t left_bytes);
void view_frame_dropped(struct job *job);
/* The rest of a begun frame is abandoned. */
void view_frame_abandoned(struct job *job, const struct engine_frame *frame);
/* It ends before its end: nothing waits for one that gives way to motion. */
void view_frame_cut(struct job *job, const struct engine_frame *frame, size_t end_bytes, bool gives_way);
/* `end_bytes` of it are to go. */
void view_frame_begun(struct job *job, const struct engine_frame *frame, size_t end_bytes, uint64_t begun_ns);
void view_frame_sent(struct job *job);

/* VIEW_CAMERA and FRAME_ACK */
void views_set_camera(struct session *session, const struct message_view_camera *message);
void views_acknowledge(struct session *session, const struct message_frame_ack *message);

#endif
