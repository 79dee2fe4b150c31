/* SPDX-License-Identifier: MIT */
#include "session/pacing.h"

#include <math.h>
#include <string.h>

#define WINDOW_NS UINT64_C(10000000000)
/* Share of the link's estimate that stays with each frame: the last eight frames count most. */
#define CARRIED_FADES 0.875
/* Maximum wait: practically forever, since a client acknowledges frames however late, and still safe to add to a
 * time. */
#define WAIT_MAX_NS 0x1p61
/* A local socket takes no time that could be measured; this keeps the rate finite. */
#define CARRIED_MIN_NS 1000.0

void pacing_init(struct pacing *pacing, uint64_t frame_ns)
{
    *pacing = (struct pacing){.frame_ns = frame_ns};
}

void pacing_set_terms(struct pacing *pacing, uint64_t frame_ns, const struct pacing_terms *terms)
{
    pacing->frame_ns = frame_ns;
    if (memcmp(&pacing->terms, terms, sizeof(*terms)) == 0)
        return;
    pacing->terms = *terms;
    pacing->advised = (struct pacing_advice){0};
}

bool pacing_makes_views(const struct pacing_terms *terms)
{
    return terms->margin > 0.0f || terms->hidden_layers > 0;
}

/* ---- the link ---------------------------------------------------------------------------------------- */

uint64_t pacing_bytes_per_second(const struct pacing *pacing)
{
    return pacing->carried_ns > 0.0 ? (uint64_t)(pacing->carried_bytes / pacing->carried_ns * 1e9) : 0;
}

uint64_t pacing_round_trip_ns(const struct pacing *pacing)
{
    uint64_t before_ns = pacing->round_trip_before_ns, now_ns = pacing->round_trip_ns;
    return !now_ns || (before_ns && before_ns < now_ns) ? before_ns : now_ns;
}

double pacing_room_bytes(const struct pacing *pacing)
{
    return pacing->carried_bytes / pacing->carried_ns *
           ((double)pacing->frame_ns + (double)pacing_round_trip_ns(pacing));
}

uint64_t pacing_wait_ns(const struct pacing *pacing, unsigned coming)
{
    if (!coming && (pacing->silent || !pacing->in_flight_count))
        return 0;
    if (!(pacing->carried_ns > 0.0) || pacing->in_flight_count + coming >= PACING_IN_FLIGHT_MAX)
        return UINT64_MAX;
    double before_bytes = (double)pacing->in_flight_bytes + (double)pacing->last_bytes * coming;
    double over_bytes = before_bytes + (double)pacing->last_bytes - pacing_room_bytes(pacing);
    if (!(over_bytes > 0.0))
        return 0;
    /* A frame of any size may go when nothing else is under way. */
    double wait_ns = ceil(fmin(over_bytes, before_bytes) / pacing->carried_bytes * pacing->carried_ns);
    return (uint64_t)fmin(wait_ns, WAIT_MAX_NS);
}

bool pacing_may_send(const struct pacing *pacing)
{
    return pacing_wait_ns(pacing, 0) == 0;
}

static void remove_oldest(struct pacing *pacing, size_t count)
{
    for (size_t i = 0; i < count; i++)
        pacing->in_flight_bytes -= pacing->in_flight[i].bytes;
    pacing->in_flight_count -= count;
    memmove(pacing->in_flight, pacing->in_flight + count, pacing->in_flight_count * sizeof(pacing->in_flight[0]));
}

void pacing_sent(struct pacing *pacing, uint32_t frame, uint64_t bytes, uint64_t now_ns)
{
    if (pacing->in_flight_count == PACING_IN_FLIGHT_MAX) {
        if (!pacing->silent)
            return;
        remove_oldest(pacing, 1);
    }
    pacing->in_flight[pacing->in_flight_count++] =
        (struct pacing_frame){.frame = frame, .bytes = bytes, .sent_ns = now_ns};
    pacing->in_flight_bytes += bytes;
    pacing->last_bytes = bytes;
}

static void learn_round_trip(struct pacing *pacing, uint64_t taken_ns, uint64_t now_ns)
{
    if (now_ns - pacing->window_begun_ns >= WINDOW_NS) {
        pacing->round_trip_before_ns = pacing->round_trip_ns;
        pacing->round_trip_ns = 0;
        pacing->window_begun_ns = now_ns;
    }
    taken_ns = taken_ns ? taken_ns : 1;
    if (!pacing->round_trip_ns || taken_ns < pacing->round_trip_ns)
        pacing->round_trip_ns = taken_ns;
}

/* The link worked on a frame from the arrival of its first bytes to that of its last; behind a queued frame, from
 * that frame's arrival at the latest. For a client that does not acknowledge the first bytes, the latency counts
 * too: the rate is then too low unless frames queue. */
static void learn_rate(struct pacing *pacing, const struct pacing_frame *frame, uint64_t now_ns)
{
    uint64_t since_ns = frame->begun_ns ? frame->begun_ns : frame->sent_ns;
    bool in_line = frame->sent_ns + pacing_round_trip_ns(pacing) < pacing->last_whole_ns;
    if (in_line && (!frame->begun_ns || pacing->last_whole_ns < since_ns))
        since_ns = pacing->last_whole_ns;
    double taken_ns = now_ns > since_ns ? (double)(now_ns - since_ns) : 0.0;
    pacing->carried_bytes = pacing->carried_bytes * CARRIED_FADES + (double)frame->bytes;
    pacing->carried_ns = pacing->carried_ns * CARRIED_FADES + fmax(taken_ns, CARRIED_MIN_NS);
}

void pacing_acknowledged(struct pacing *pacing, uint32_t frame, bool whole, uint64_t now_ns)
{
    size_t place = 0;
    while (place < pacing->in_flight_count && pacing->in_flight[place].frame != frame)
        place++;
    if (place == pacing->in_flight_count)
        return;
    struct pacing_frame *acknowledged = &pacing->in_flight[place];
    pacing->acknowledges = true;
    pacing->silent = false;
    if (!whole) {
        if (!acknowledged->begun_ns)
            learn_round_trip(pacing, now_ns - acknowledged->sent_ns, now_ns);
        acknowledged->begun_ns = now_ns;
        return;
    }
    if (!acknowledged->begun_ns)
        learn_round_trip(pacing, now_ns - acknowledged->sent_ns, now_ns);
    learn_rate(pacing, acknowledged, now_ns);
    pacing->last_whole_ns = now_ns;
    remove_oldest(pacing, place + 1); /* bytes arrive in order: earlier frames have arrived too */
}

bool pacing_is_long(const struct pacing *pacing, uint64_t bytes)
{
    /* Always true while nothing is known of the link. */
    return (double)bytes * pacing->carried_ns >= (double)pacing->frame_ns * pacing->carried_bytes;
}

bool pacing_takes_longer(const struct pacing *pacing, uint64_t bytes, uint64_t than_ns)
{
    return (double)bytes * pacing->carried_ns > (double)than_ns * pacing->carried_bytes;
}

void pacing_abandoned(struct pacing *pacing, uint32_t frame)
{
    size_t kept = 0;
    for (size_t i = 0; i < pacing->in_flight_count; i++) {
        if (pacing->in_flight[i].frame == frame)
            pacing->in_flight_bytes -= pacing->in_flight[i].bytes;
        else
            pacing->in_flight[kept++] = pacing->in_flight[i];
    }
    pacing->in_flight_count = kept;
    /* The next frame is not expected to be like it. */
    pacing->last_bytes = kept ? pacing->in_flight[kept - 1].bytes : 0;
}

void pacing_cut(struct pacing *pacing, uint32_t frame, uint64_t bytes)
{
    for (size_t i = 0; i < pacing->in_flight_count; i++) {
        struct pacing_frame *cut = &pacing->in_flight[i];
        if (cut->frame != frame)
            continue;
        pacing->in_flight_bytes -= cut->bytes - bytes;
        cut->bytes = bytes;
    }
}

void pacing_note_silence(struct pacing *pacing)
{
    pacing->silent = !pacing->acknowledges;
}
