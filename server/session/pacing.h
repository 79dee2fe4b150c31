/* SPDX-License-Identifier: MIT */
/* When the next frame of a view may go to its client, and how good it can be. Pure: no clock, no socket; times
 * are what the caller says, of one clock that never goes back.
 *
 * The link is learned from the client's acknowledgements. That of a frame's first message gives the round trip,
 * as it is small; the time from it to that of the last byte is what the link took for the frame. The rule for
 * sending is neatvnc's: a frame is skipped rather than let the bytes in flight exceed what the link drains in one
 * frame time and the least round trip, so that what a client sees is never older than that. */
#ifndef FARLIGHT_SESSION_PACING_H
#define FARLIGHT_SESSION_PACING_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define PACING_IN_FLIGHT_MAX 64
#define PACING_SCALE_FULL 8 /* of pacing_advice.scale_eighths */

struct pacing_frame {
    uint32_t frame;
    uint64_t bytes;
    uint64_t sent_ns;  /* when its first byte was about to go */
    uint64_t begun_ns; /* acknowledgement of its first message; 0: none yet */
};

struct pacing {
    uint64_t frame_ns;                                   /* between frames, as the client asked for */
    struct pacing_frame in_flight[PACING_IN_FLIGHT_MAX]; /* oldest first */
    size_t in_flight_count;
    uint64_t in_flight_bytes;
    bool acknowledges; /* the client has acknowledged a frame */
    uint64_t last_whole_ns;
    /* Least round trip of this window of time and of the one before it; 0: none. */
    uint64_t round_trip_ns, round_trip_before_ns, window_begun_ns;
    /* Bytes that came and the time that the link took for them, older ones fading. */
    double carried_bytes, carried_ns;
    uint64_t last_bytes; /* of the frame that was sent last */
    /* What a picture of full size costs, learned from those of any size. */
    double bytes_full; /* at PACING_QUALITY_REFERENCE; 0: not known */
    /* Rendering takes a part that does not depend on the picture's size, and one that grows with its area, of
     * which the full picture has 1. Sums over the frames so far, older ones fading. */
    double render_frames, render_areas, render_ns, render_areas_areas, render_areas_ns;
    double render_fixed_ns;          /* as far as frames of several sizes have shown it */
    unsigned scale_eighths, quality; /* last advice */
    unsigned better_count;           /* times in a row that a better one would have been possible */
};

struct pacing_advice {
    unsigned scale_eighths; /* of width and height: 8, 6, 4, 3, 2 */
    unsigned quality;       /* as JPEG has it, PACING_QUALITY_LEAST .. the wanted one */
    uint64_t bytes;         /* that a frame may have, for an encoder that can be told */
};

#define PACING_QUALITY_LEAST 40
#define PACING_QUALITY_REFERENCE 75

void pacing_init(struct pacing *pacing, uint64_t frame_ns);

/* Whether the next frame may be begun. False: an acknowledgement will change that. Of a client that has never
 * acknowledged anything: one frame at a time, so its credit is what moves it on; tell pacing_forget() then. */
bool pacing_may_send(const struct pacing *pacing);
/* How long until the next frame may go if `coming` others of its size go before it, as far as can be told: 0: it
 * may now; UINT64_MAX: only an acknowledgement will tell. */
uint64_t pacing_wait_ns(const struct pacing *pacing, unsigned coming);
/* A frame's first byte is about to go; `bytes` is all that it takes. */
void pacing_sent(struct pacing *pacing, uint32_t frame, uint64_t bytes, uint64_t now_ns);
/* FRAME_ACK; of a frame that is not in flight: ignored. */
void pacing_acknowledged(struct pacing *pacing, uint32_t frame, bool whole, uint64_t now_ns);
/* Whether the rest of a frame keeps the link for longer than the next frame should wait. */
bool pacing_is_long(const struct pacing *pacing, uint64_t bytes);
/* The rest of it will not be sent. What has gone of it is ahead of the next frame whenever that one goes, which
 * therefore need not wait. */
void pacing_abandoned(struct pacing *pacing, uint32_t frame);
/* Nothing is in flight any more, as far as is known: credit has come from a client that does not acknowledge. */
void pacing_forget(struct pacing *pacing);

/* 0: not known yet. */
uint64_t pacing_bytes_per_second(const struct pacing *pacing);
uint64_t pacing_round_trip_ns(const struct pacing *pacing);

/* What a frame of that size took to render, and what came of it at that quality (0: lossless, not learned from).
 */
void pacing_learn(struct pacing *pacing, unsigned scale_eighths, unsigned quality, uint64_t render_ns,
                  uint64_t bytes);
/* Size and quality of the next frame while things move, so that frame_ns is met by the renderer and by the link;
 * at most `quality_wanted`. Worse at once, better step by step, so that it does not flicker between two. */
struct pacing_advice pacing_advise(struct pacing *pacing, unsigned quality_wanted);

#endif
