/* SPDX-License-Identifier: MIT */
/* The state of a view beyond that of any job: the requests that the engine reads, the pace of its link, and the
 * views that are to replace it.
 *
 * Successive views of a channel are one struct job: its credit, frame count and requests continue. A view replaces
 * the one before when the engine says so, in the order of the client's requests. Frames of the old view that have
 * not begun on the wire are dropped then, one that has begun is finished, and then the old request is answered. */
#ifndef FARLIGHT_SESSION_VIEWS_H
#define FARLIGHT_SESSION_VIEWS_H

#include "engine/view_mailbox.h"
#include "protocol/messages.h"
#include "session/jobs.h"
#include "session/pacing.h"

/* A view's terms, as its render has them. */
struct view_terms {
    uint64_t frame_ns; /* interval of frames, to which they are adapted */
    uint32_t samples;  /* samples of a complete picture */
    struct pacing_terms moving;
    enum encoding still_encoding;
    unsigned quality; /* quality while the camera moves; 0: lossless */
    bool adapt;
    bool parts; /* frames may come in parts */
};

/* A view that will replace the current one. */
struct view_change {
    struct view_change *next;
    uint32_t request, scene;
    enum protocol_tracer tracer;
    uint64_t credit, frame_bytes; /* its engine_credit and frame_bytes for struct job */
    struct view_terms terms;
    bool cancelled;
};

struct session_view {
    struct view_mailbox *mailbox;
    struct view_terms terms;
    struct view_change *changes, **changes_end; /* changes that the engine has not answered yet, in order */
    struct pacing pacing;
    struct loop_timer pace_timer; /* begins the next frame, if nothing happens before .. */
    bool due;                     /* .. whether its time has come */
    struct loop_timer silence_timer;
    struct view_effort effort; /* the engine's present effort */
    uint64_t made_ns;          /* time of the last frame from its begin until it was encoded */
    /* The client's last command, and the last one whose frame was sent. */
    uint64_t last_command, shown_command;
    bool last_moving, shown_moving;
    unsigned dropped; /* frames dropped or abandoned since the last one that went whole */
    uint32_t shown_samples;
};

struct view_terms view_terms_of(const struct message_render *render);
struct session_view *session_view_create(const struct view_terms *terms); /* NULL: out of memory */
void session_view_destroy(struct job *job); /* for a job that ends; accepts one that is no view */

/* Adds a change, which it takes over. */
void view_add_change(struct job *job, struct view_change *change);
struct view_change *view_find_change(const struct job *job, uint32_t request); /* NULL: the request is no change */
/* Removes a change that the engine refused; the current view continues. */
void view_drop_change(struct job *job, struct view_change *change);
/* Makes the first pending change the job's state. */
void view_switch(struct job *job);
/* Forgets frames under way that were dropped: they will not be acknowledged. */
void view_forget_frames(struct job *job);

/* Number of frames that the engine may begin by now, so that each is ready when the link is. */
uint64_t view_allowed_credit(struct job *job);

/* Called when the engine has made a frame. */
void view_frame_made(struct job *job, const struct engine_frame *frame);
/* Whether the client was sent less than it asked for. */
bool view_wants_more(const struct job *job);
/* Whether no frame may go before the client acknowledges one. */
bool view_is_unacknowledged(const struct job *job);
bool view_may_send(const struct job *job);
/* Whether the frame has waited for the link so long that a new one of the current requests is better, and
 * possible.
 */
bool view_is_outdated(const struct job *job, const struct engine_frame *frame);
/* Whether motion overtakes the frame: it is a picture at rest or a hidden layer, and no later frame needs it. */
bool view_is_overtaken(const struct job *job, const struct engine_frame *frame);
/* Whether its remaining bytes would occupy the link for long. */
bool view_is_long(const struct job *job, uint64_t left_bytes);
void view_frame_dropped(struct job *job);
/* Called when the rest of a begun frame is abandoned. */
void view_frame_abandoned(struct job *job, const struct engine_frame *frame);
/* Called when the frame is cut; a frame that yields to motion delays no other. */
void view_frame_cut(struct job *job, const struct engine_frame *frame, size_t end_bytes, bool yields);
/* Called when the frame's first byte has gone; `end_bytes`: its size on the wire. */
void view_frame_begun(struct job *job, const struct engine_frame *frame, size_t end_bytes, uint64_t begun_ns);
void view_frame_sent(struct job *job);

/* Handle VIEW_CAMERA and FRAME_ACK. */
void views_set_camera(struct session *session, const struct message_view_camera *message);
void views_acknowledge(struct session *session, const struct message_frame_ack *message);

#endif
