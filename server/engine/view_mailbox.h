/* SPDX-License-Identifier: MIT */
/* The latest requests of a view's client: its camera, and whether the next frame must be a key frame. Newer
 * requests replace older ones, so none can queue however fast they arrive. */
#ifndef FARLIGHT_ENGINE_VIEW_MAILBOX_H
#define FARLIGHT_ENGINE_VIEW_MAILBOX_H

#include "engine/engine.h"

struct view_camera {
    uint64_t command;             /* the client's number for it; 0: none has come */
    uint64_t received_ns;         /* clock_now_ns() when the network thread read it */
    bool moving;                  /* more will follow soon */
    struct record_camera_key key; /* its time is that of the job */
    uint32_t node;                /* node whose camera overrides the key's, except for the time; 0: none */
};

struct view_mailbox;

struct view_mailbox *view_mailbox_create(void); /* NULL: out of memory */
struct view_mailbox *view_mailbox_ref(struct view_mailbox *mailbox);
void view_mailbox_unref(struct view_mailbox *mailbox); /* accepts NULL */

/* True: the caller must notify the engine by ENGINE_VIEW_CHANGED. False: it was notified, and has not read the
 * requests since. */
bool view_mailbox_set_camera(struct view_mailbox *mailbox, const struct view_camera *camera);
bool view_mailbox_request_key_frame(struct view_mailbox *mailbox);

/* Effort for frames of views that adapt to the link or keep a rate. */
struct view_effort {
    /* Frames while the camera moves. */
    unsigned scale_32nds; /* share of width and height; 0: as the job says */
    unsigned quality;     /* 0: as the job says */
    uint64_t bytes;       /* target size of a frame; 0: not known */
    unsigned samples;     /* maximum of samples; 0: as the job says */
    unsigned depth_less;  /* bounces fewer than the job says */
    /* Reductions of margin and hidden layers, from which a client makes its own views. */
    unsigned margin_halves_less; /* 1: half of the margin, 2: none */
    bool no_hidden;              /* whether hidden layers wait until nothing else is to be done */
    /* Frames in the encoding of rest would still occupy the link when motion begins: only the frame with all
     * samples uses it. */
    bool sparing;
    /* Whether frames while the camera moves, and those at rest, occupy the link for so long that they must come in
     * parts. */
    bool parts, still_parts;
};
/* Sets the effort without notifying the engine: it applies when the next frame begins for another reason. */
void view_mailbox_set_effort(struct view_mailbox *mailbox, const struct view_effort *effort);

struct view_request {
    struct view_camera camera;
    bool key_frame;
    struct view_effort effort;
};
/* The latest mailbox, which stay in force. */
struct view_request view_mailbox_latest(struct view_mailbox *mailbox);
/* The latest requests for a frame that is about to begin; clears the request for a key frame. */
struct view_request view_mailbox_begin_frame(struct view_mailbox *mailbox);

#endif
