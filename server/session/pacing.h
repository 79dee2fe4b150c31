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
#define PACING_SCALE_FULL 32 /* full size in pacing_advice.scale_32nds */
#define PACING_WAVES 33      /* waves of a picture: first hits, and one for each bounce */

struct pacing_frame {
    uint32_t frame;
    uint64_t bytes;
    uint64_t sent_ns;  /* time at which its first byte was about to go */
    uint64_t begun_ns; /* acknowledgement of its first message; 0: none yet */
};

/* Terms of a view's frames while the camera moves. All-zero: only pictures of one sample. */
struct pacing_terms {
    float margin;           /* share of width and height on each side */
    uint32_t hidden_layers; /* hidden layers that follow each picture */
    uint32_t samples;
    uint32_t depth;       /* bounces */
    uint64_t deadline_ns; /* maximum time of rendering a frame; 0: only the size follows frame_ns */
    bool ignores_link;    /* frames follow the renderer only */
};

/* Advice for the next frame. */
struct pacing_advice {
    unsigned scale_32nds; /* share of width and height: 32, 24, 16, 12, 8; for a deadline finer, down to 5 */
    unsigned quality;     /* JPEG quality, PACING_QUALITY_MIN .. the wanted one */
    uint64_t bytes;       /* target size, for an encoder with rate control */
    unsigned margin_halves_less, samples, depth_less;
    bool no_hidden;
};

struct pacing {
    uint64_t frame_ns;                                   /* interval of frames that the client requested */
    struct pacing_frame in_flight[PACING_IN_FLIGHT_MAX]; /* oldest first */
    size_t in_flight_count;
    uint64_t in_flight_bytes;
    bool acknowledges; /* whether the client has ever acknowledged a frame */
    bool silent;       /* has acknowledged none, so frames do not wait for it */
    uint64_t last_whole_ns;
    /* Minimum round trip of this time window and of the one before it; 0: none. */
    uint64_t round_trip_ns, round_trip_before_ns, window_begun_ns;
    /* Bytes that arrived and the link's time for them, with fading weights. */
    double carried_bytes, carried_ns;
    uint64_t last_bytes; /* size of the frame that was sent last */
    /* The cost of a full-size picture, estimated from pictures of any size. */
    double bytes_full; /* at PACING_QUALITY_REFERENCE; 0: not known */
    /* Rendering time has a part that does not depend on the picture's size, and one that grows with its area, of
     * which the full picture has 1. Sums over the frames so far, with fading weights. */
    double render_frames, render_areas, render_ns, render_areas_areas, render_areas_ns;
    double render_fixed_ns; /* estimate of the fixed part, from frames of several sizes */
    /* Time of each bounce in a full picture with all samples; 0: not known. With a deadline the sums above leave
     * out bounces. */
    double bounce_ns[PACING_WAVES];
    bool guessed; /* whether the rendering estimates are a guess, to be replaced by the first measured frame */
    unsigned surprises;  /* frames in a row that took far more or less than expected */
    double hidden_bytes; /* size of a hidden layer; 0: not known */
    struct pacing_terms terms;
    struct pacing_advice advised; /* the last advice */
    unsigned better_count;        /* times in a row that a better advice was possible */
};

#define PACING_QUALITY_MIN 40
#define PACING_QUALITY_REFERENCE 75

void pacing_init(struct pacing *pacing, uint64_t frame_ns);
/* Sets the terms; keeps the estimates of link and renderer. */
void pacing_set_terms(struct pacing *pacing, uint64_t frame_ns, const struct pacing_terms *terms);
/* Whether the client makes its own views. */
bool pacing_makes_views(const struct pacing_terms *terms);

/* Whether the next frame may begin. False: an acknowledgement will change that. A client that has never
 * acknowledged a frame gets one, and further ones once it counts as silent. */
bool pacing_may_send(const struct pacing *pacing);
/* Expected time until the next frame may go if `coming` others of its size go before it. 0: now; UINT64_MAX: not
 * before an acknowledgement. */
uint64_t pacing_wait_ns(const struct pacing *pacing, unsigned coming);
/* Notes that a frame's first byte is about to go; `bytes`: its whole size. */
void pacing_sent(struct pacing *pacing, uint32_t frame, uint64_t bytes, uint64_t now_ns);
/* Handles a FRAME_ACK; ignores one of a frame that is not in flight. */
void pacing_acknowledged(struct pacing *pacing, uint32_t frame, bool whole, uint64_t now_ns);
/* Whether the rest of a frame keeps the link for longer than the next frame should wait. */
bool pacing_is_long(const struct pacing *pacing, uint64_t bytes);
/* Whether the link takes longer than `than_ns` for the bytes. False while nothing is known of the link. */
bool pacing_takes_longer(const struct pacing *pacing, uint64_t bytes, uint64_t than_ns);
/* Cuts a frame to that many bytes. The next one is expected to have the size of the whole frame. */
void pacing_cut(struct pacing *pacing, uint32_t frame, uint64_t bytes);
/* Abandons the rest of a frame. Its sent bytes are ahead of the next frame anyway, so the next need not wait. */
void pacing_abandoned(struct pacing *pacing, uint32_t frame);
/* Called when the time for acknowledging the first frame is over. If the client has not, only its credit releases
 * frames until an acknowledgement arrives after all, which informs of the link like any other: a slow link may
 * take longer for that frame. */
void pacing_note_silence(struct pacing *pacing);

/* 0: not known yet. */
uint64_t pacing_bytes_per_second(const struct pacing *pacing);
uint64_t pacing_round_trip_ns(const struct pacing *pacing);
/* Bytes that the link drains in one frame time and the minimum round trip; requires a known link. */
double pacing_room_bytes(const struct pacing *pacing);

/* Learns from a frame's size, rendering time and bytes at that quality (0: lossless, from which bytes are not
 * learned). */
void pacing_learn(struct pacing *pacing, unsigned scale_32nds, unsigned quality, uint64_t render_ns,
                  uint64_t bytes);
/* Learns from a frame made by the advice `made`. */
void pacing_learn_picture(struct pacing *pacing, const struct pacing_advice *made, uint64_t render_ns,
                          uint64_t bytes);
/* Learns from a frame with the times of its waves, which a deadline needs. `bytes` 0: bytes are not learned from.
 */
void pacing_learn_waves(struct pacing *pacing, const struct pacing_advice *made, uint64_t render_ns,
                        const uint64_t wave_ns[PACING_WAVES], uint64_t bytes);
/* Sets the rendering estimates to a guess, which counts until something is learned. */
void pacing_guess_waves(struct pacing *pacing, const struct pacing_advice *made, uint64_t render_ns,
                        const uint64_t wave_ns[PACING_WAVES]);
void pacing_learn_hidden(struct pacing *pacing, uint64_t bytes);
/* Size and quality of the next frame while the camera or the scene moves, so that renderer and link meet frame_ns;
 * at most `quality_wanted`. It gets worse at once and better step by step, so that it does not flicker between
 * two. For a client that makes its own views (it has asked for a margin or hidden layers) a late picture is better
 * than a tiny one. Reductions go in this order: samples beyond one, hidden layers, half of the margin, all of it,
 * quality; and size only where a picture would take longer than a quarter of a second. With a deadline rendering
 * meets that: samples beyond one go first, then size, and bounces only where the smallest picture is late. Bounces
 * that take time are visible: for the bundled teapot, which is of glass, two bounces in full size are farther from
 * the picture than all eight in a quarter of the width; for the carousel two are as good as eight, and take nearly
 * as long. Without any bounce both look wrong. The denoiser stays (server/render/passes/denoise/README.md); its
 * time counts as the rest of a picture does, by area. */
struct pacing_advice pacing_advise(struct pacing *pacing, unsigned quality_wanted);

#endif
