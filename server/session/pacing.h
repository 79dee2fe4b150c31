/* SPDX-License-Identifier: MIT */
/* When the next frame of a view may be sent, and at which quality and size. Pure: no clock, no socket; the caller
 * passes the times of one monotonic clock.
 *
 * The link is learned from the client's acknowledgements. The acknowledgement of a frame's small first message
 * gives the round trip; the time from it to that of the last byte is the link's time for the frame. The sending
 * rule is neatvnc's: a frame is skipped if the bytes in flight would exceed what the link drains in one frame time
 * and the minimum round trip, so no client sees a picture older than that. */
#ifndef FARLIGHT_SESSION_PACING_H
#define FARLIGHT_SESSION_PACING_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define PACING_IN_FLIGHT_MAX 64
#define PACING_SCALE_FULL 32 /* of pacing_advice.scale_32nds */
#define PACING_WAVES 33      /* of a picture: first hits, and one for each bounce */

struct pacing_frame {
    uint32_t frame;
    uint64_t bytes;
    uint64_t sent_ns;  /* when its first byte was about to go */
    uint64_t begun_ns; /* acknowledgement of its first message; 0: none yet */
};

/* What a view's client has asked for, of frames while it moves. All-zero: nothing but pictures of one sample. */
struct pacing_terms {
    float margin;           /* share on each side */
    uint32_t hidden_layers; /* that follow each picture */
    uint32_t samples;
    uint32_t depth;       /* bounces */
    uint64_t deadline_ns; /* that rendering a frame may take; 0: size alone follows frame_ns */
    bool ignores_link;    /* it is the renderer alone that frames follow */
};

/* What the next frame is to be. */
struct pacing_advice {
    unsigned scale_32nds; /* of width and height: 32, 24, 16, 12, 8; for a deadline finer, down to 5 */
    unsigned quality;     /* as JPEG has it, PACING_QUALITY_MIN .. the wanted one */
    uint64_t bytes;       /* that a frame may have, for an encoder that can be told */
    unsigned margin_halves_less, samples, depth_less;
    bool no_hidden;
};

struct pacing {
    uint64_t frame_ns;                                   /* between frames, as the client asked for */
    struct pacing_frame in_flight[PACING_IN_FLIGHT_MAX]; /* oldest first */
    size_t in_flight_count;
    uint64_t in_flight_bytes;
    bool acknowledges; /* the client has acknowledged a frame */
    bool silent;       /* it has not, and frames do not wait for it */
    uint64_t last_whole_ns;
    /* Minimum round trip of this time window and of the one before it; 0: none. */
    uint64_t round_trip_ns, round_trip_before_ns, window_begun_ns;
    /* Bytes that came and the time that the link took for them, older ones fading. */
    double carried_bytes, carried_ns;
    uint64_t last_bytes; /* of the frame that was sent last */
    /* The cost of a full-size picture, estimated from pictures of any size. */
    double bytes_full; /* at PACING_QUALITY_REFERENCE; 0: not known */
    /* Rendering takes a part that does not depend on the picture's size, and one that grows with its area, of
     * which the full picture has 1. Sums over the frames so far, older ones fading. */
    double render_frames, render_areas, render_ns, render_areas_areas, render_areas_ns;
    double render_fixed_ns; /* as far as frames of several sizes have shown it */
    /* Of a full picture with all samples, what each bounce takes; not known: 0. With a deadline the sums above are
     * of the rest. */
    double bounce_ns[PACING_WAVES];
    bool guessed;        /* what is known of rendering is a guess, until a frame tells */
    unsigned surprises;  /* frames in a row that took far more or less than expected */
    double hidden_bytes; /* of a layer of what a picture hides; 0: not known */
    struct pacing_terms terms;
    struct pacing_advice advised; /* last */
    unsigned better_count;        /* times in a row that a better one would have been possible */
};

#define PACING_QUALITY_MIN 40
#define PACING_QUALITY_REFERENCE 75

void pacing_init(struct pacing *pacing, uint64_t frame_ns);
/* What is known of link and renderer stays. */
void pacing_set_terms(struct pacing *pacing, uint64_t frame_ns, const struct pacing_terms *terms);
/* Its client makes views of its own. */
bool pacing_makes_views(const struct pacing_terms *terms);

/* Whether the next frame may begin. False: an acknowledgement will change that. A client that has never
 * acknowledged a frame gets one, and those behind it once it is called silent. */
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
/* Whether the link would take so long for the bytes. One that is not known yet would not. */
bool pacing_takes_longer(const struct pacing *pacing, uint64_t bytes, uint64_t than_ns);
/* Of the frame only so many bytes will go. The next one is expected to be like all of it. */
void pacing_cut(struct pacing *pacing, uint32_t frame, uint64_t bytes);
/* The rest of the frame is abandoned. Its sent bytes are ahead of the next frame at any time, so the next need not
 * wait. */
void pacing_abandoned(struct pacing *pacing, uint32_t frame);
/* The client has had its time to acknowledge its first frame. If it has not, its credit alone releases frames,
 * until an acknowledgement comes after all, which tells of the link as any other does: a slow one may take longer
 * for that frame. */
void pacing_note_silence(struct pacing *pacing);

/* 0: not known yet. */
uint64_t pacing_bytes_per_second(const struct pacing *pacing);
uint64_t pacing_round_trip_ns(const struct pacing *pacing);
/* Bytes that the link drains in one frame time and the minimum round trip; of a link that is known. */
double pacing_room_bytes(const struct pacing *pacing);

/* What a frame of that size took to render, and what came of it at that quality (0: lossless, not learned from).
 */
void pacing_learn(struct pacing *pacing, unsigned scale_32nds, unsigned quality, uint64_t render_ns,
                  uint64_t bytes);
/* The same of a frame as it was advised, and of a layer that followed one. */
void pacing_learn_picture(struct pacing *pacing, const struct pacing_advice *made, uint64_t render_ns,
                          uint64_t bytes);
/* The same, of a frame of which the waves took so long; they are what a deadline needs to know. `bytes` 0: nothing
 * is learned of them. */
void pacing_learn_waves(struct pacing *pacing, const struct pacing_advice *made, uint64_t render_ns,
                        const uint64_t wave_ns[PACING_WAVES], uint64_t bytes);
/* The same, where that is a guess: it counts until something is learned. */
void pacing_guess_waves(struct pacing *pacing, const struct pacing_advice *made, uint64_t render_ns,
                        const uint64_t wave_ns[PACING_WAVES]);
void pacing_learn_hidden(struct pacing *pacing, uint64_t bytes);
/* Size and quality of the next frame while things move, so that frame_ns is met by the renderer and by the link;
 * at most `quality_wanted`. Worse at once, better step by step, so that it does not flicker between two.
 *
 * For a client that makes its own views (it has asked for a margin or hidden layers) a late picture is better than
 * a tiny one. What it does not need first goes first: samples beyond one, what is hidden, half of the margin, all
 * of it, quality; and size only where a picture would take longer than a quarter of a second.
 *
 * With a deadline rendering meets that: samples beyond one go first, then size, and bounces only where the
 * smallest picture is late. Bounces that take time are those that are seen: of the bundled teapot, which is of
 * glass, two bounces in full size are farther from the picture than all eight in a quarter of the width; of the
 * carousel two are as good as eight, and take nearly as long. Without any bounce either looks wrong. The denoiser
 * stays (server/render/passes/denoise/README.md); what it takes counts as the rest of a picture does, by the area.
 */
struct pacing_advice pacing_advise(struct pacing *pacing, unsigned quality_wanted);

#endif
