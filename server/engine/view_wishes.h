/* SPDX-License-Identifier: MIT */
/* The newest wishes of a view's client: its camera, and whether the next frame must be a key frame. Newer wishes
 * replace older ones, so none can queue however fast they arrive.
 *
 * The network thread writes, the thread that owns GL reads. Reference-counted: the session, each command and each
 * job hold one. Successive views of a channel share one object: by it the engine knows which view a new one
 * replaces, and keeps the camera. */
#ifndef FARLIGHT_ENGINE_VIEW_WISHES_H
#define FARLIGHT_ENGINE_VIEW_WISHES_H

#include "engine/engine.h"

struct view_camera {
    uint64_t command;      /* the client's number for it; 0: none has come */
    uint64_t received_ns;  /* clock_now_ns() when the network thread read it */
    bool moving;           /* more will follow soon */
    struct camera_key key; /* its time is that of the job */
    uint32_t node;         /* that shows a camera, which counts instead of the key's, but for the time; 0: none */
};

struct view_wishes;

struct view_wishes *view_wishes_create(void); /* NULL: out of memory */
struct view_wishes *view_wishes_ref(struct view_wishes *wishes);
void view_wishes_unref(struct view_wishes *wishes); /* accepts NULL */

/* True: the engine is to be told by ENGINE_VIEW_LOOK. False: it was, and has not looked since. */
bool view_wishes_look(struct view_wishes *wishes, const struct view_camera *camera);
bool view_wishes_want_key_frame(struct view_wishes *wishes);

/* For views that adapt or keep a rate. */
struct view_effort {
    /* Of frames while it moves. */
    unsigned scale_32nds; /* of width and height; 0: as the job says */
    unsigned quality;     /* 0: as the job says */
    uint64_t bytes;       /* that a frame may have; 0: not known */
    unsigned samples;     /* at most; 0: as the job says */
    unsigned depth_less;  /* bounces fewer than the job says */
    /* Of what a client makes its own views from, not what the job says: */
    unsigned margin_halves_less; /* 1: half of the margin, 2: none */
    bool no_hidden;              /* what is hidden waits until nothing else is to be done */
    /* Frames in the encoding of rest would occupy the link when motion begins: only the frame with all samples
     * uses it. */
    bool sparing;
    /* Frames while it moves, and those at rest, take the link so long that they are to come in parts. */
    bool parts, still_parts;
};
/* Nothing is to be told: it counts when the next frame is begun for another reason. */
void view_wishes_set_effort(struct view_wishes *wishes, const struct view_effort *effort);

struct view_wish {
    struct view_camera camera;
    bool key_frame;
    struct view_effort effort;
};
/* The current wishes, which stay in force. */
struct view_wish view_wishes_see(struct view_wishes *wishes);
/* The same for a frame that is about to show it: a key frame is wished no longer. */
struct view_wish view_wishes_take(struct view_wishes *wishes);

#endif
