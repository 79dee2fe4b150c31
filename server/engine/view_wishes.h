/* SPDX-License-Identifier: MIT */
/* The latest wishes of a view's client: its camera, and whether the next frame must be a key frame. Newer wishes
 * replace older ones, so none can queue however fast they arrive. */
#ifndef FARLIGHT_ENGINE_VIEW_WISHES_H
#define FARLIGHT_ENGINE_VIEW_WISHES_H

#include "engine/engine.h"

struct view_camera {
    uint64_t command;             /* the client's number for it; 0: none has come */
    uint64_t received_ns;         /* clock_now_ns() when the network thread read it */
    bool moving;                  /* more will follow soon */
    struct record_camera_key key; /* its time is that of the job */
    uint32_t node;                /* node whose camera overrides the key's, except for the time; 0: none */
};

struct view_wishes;

struct view_wishes *view_wishes_create(void); /* NULL: out of memory */
struct view_wishes *view_wishes_ref(struct view_wishes *wishes);
void view_wishes_unref(struct view_wishes *wishes); /* accepts NULL */

/* True: the caller must notify the engine by ENGINE_VIEW_CHANGED. False: it was notified, and has not read the
 * wishes since. */
bool view_wishes_set_camera(struct view_wishes *wishes, const struct view_camera *camera);
bool view_wishes_request_key_frame(struct view_wishes *wishes);

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
void view_wishes_set_effort(struct view_wishes *wishes, const struct view_effort *effort);

struct view_wish {
    struct view_camera camera;
    bool key_frame;
    struct view_effort effort;
};
/* The latest wishes, which stay in force. */
struct view_wish view_wishes_latest(struct view_wishes *wishes);
/* The latest wishes for a frame that is about to begin; clears the request for a key frame. */
struct view_wish view_wishes_begin_frame(struct view_wishes *wishes);

#endif
