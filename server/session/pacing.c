/* SPDX-License-Identifier: MIT */
#include "session/pacing.h"

#include <math.h>
#include <string.h>

#define WINDOW_NS UINT64_C(10000000000)
/* Share of the link's estimate that stays with each frame: the last eight frames count most. */
#define CARRIED_FADES 0.875
/* A client says when frames have come, however late; this long is for ever, and still a time that can be added to
 * one. */
#define WAIT_MAX_NS 0x1p61
/* A local socket takes no time that could be measured; this keeps the rate finite. */
#define CARRIED_MIN_NS 1000.0
/* Share of the link that frames may fill: the rest drains other queues, and the connection's own. */
#define LINK_SHARE 0.9
#define LEARN_SHARE 0.25
/* Share of the rendering estimate that stays with each frame. */
#define RENDER_FADES 0.9
/* Frames have shown how much of rendering depends on their size when their areas deviate by this part of the mean.
 */
#define AREA_DEVIATION 0.25
/* Factor by which a frame may take longer than the time that no size can reduce. */
#define OF_FIXED 1.5
/* How many times in a row the next better step must fit, with this margin. */
#define BETTER_TIMES 8
#define BETTER_ROOM 1.25

static const unsigned scales_eighths[] = {8, 6, 4, 3, 2};
#define SCALES (sizeof(scales_eighths) / sizeof(scales_eighths[0]))

void pacing_init(struct pacing *pacing, uint64_t frame_ns)
{
    *pacing = (struct pacing){.frame_ns = frame_ns, .scale_eighths = PACING_SCALE_FULL};
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

/* Bytes that the link drains in one frame time and the minimum round trip. */
static double room_bytes(const struct pacing *pacing)
{
    return pacing->carried_bytes / pacing->carried_ns *
           ((double)pacing->frame_ns + (double)pacing_round_trip_ns(pacing));
}

uint64_t pacing_wait_ns(const struct pacing *pacing, unsigned coming)
{
    if (!pacing->in_flight_count && !coming)
        return 0;
    if (!(pacing->carried_ns > 0.0) || pacing->in_flight_count + coming >= PACING_IN_FLIGHT_MAX)
        return UINT64_MAX;
    double before_bytes = (double)pacing->in_flight_bytes + (double)pacing->last_bytes * coming;
    double over_bytes = before_bytes + (double)pacing->last_bytes - room_bytes(pacing);
    if (!(over_bytes > 0.0))
        return 0;
    /* However large it is, it may go when nothing else is under way. */
    double wait_ns = ceil(fmin(over_bytes, before_bytes) / pacing->carried_bytes * pacing->carried_ns);
    return (uint64_t)fmin(wait_ns, WAIT_MAX_NS);
}

bool pacing_may_send(const struct pacing *pacing)
{
    return pacing_wait_ns(pacing, 0) == 0;
}

void pacing_sent(struct pacing *pacing, uint32_t frame, uint64_t bytes, uint64_t now_ns)
{
    if (pacing->in_flight_count == PACING_IN_FLIGHT_MAX)
        return;
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

static void remove_oldest(struct pacing *pacing, size_t count)
{
    for (size_t i = 0; i < count; i++)
        pacing->in_flight_bytes -= pacing->in_flight[i].bytes;
    pacing->in_flight_count -= count;
    memmove(pacing->in_flight, pacing->in_flight + count, pacing->in_flight_count * sizeof(pacing->in_flight[0]));
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
    remove_oldest(pacing, place + 1); /* bytes come in order: those before it have come too */
}

bool pacing_is_long(const struct pacing *pacing, uint64_t bytes)
{
    /* Of a link that is not known yet: it is. */
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
    /* The next one is not like it. */
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

void pacing_forget(struct pacing *pacing)
{
    if (!pacing->acknowledges)
        remove_oldest(pacing, pacing->in_flight_count);
}

/* ---- size and quality -------------------------------------------------------------------------------- */

/* Bytes of a JPEG beside those at PACING_QUALITY_REFERENCE: each step of 12 is a factor of about 1.35 (rendered
 * pictures, libjpeg-turbo, 4:2:0). */
static double bytes_of_quality(unsigned quality)
{
    return pow(1.35, ((double)quality - PACING_QUALITY_REFERENCE) / 12.0);
}

static double area_of(unsigned scale_eighths)
{
    double side = (double)scale_eighths / PACING_SCALE_FULL;
    return side * side;
}

static void learn(double *known, double seen)
{
    *known = *known > 0.0 ? *known + LEARN_SHARE * (seen - *known) : seen;
}

/* A straight line through the times by area, as soon as there are times of different areas. */
static void learn_render(struct pacing *pacing, double area, double render_ns)
{
    pacing->render_frames = pacing->render_frames * RENDER_FADES + 1.0;
    pacing->render_areas = pacing->render_areas * RENDER_FADES + area;
    pacing->render_ns = pacing->render_ns * RENDER_FADES + render_ns;
    pacing->render_areas_areas = pacing->render_areas_areas * RENDER_FADES + area * area;
    pacing->render_areas_ns = pacing->render_areas_ns * RENDER_FADES + area * render_ns;
    double mean_area = pacing->render_areas / pacing->render_frames;
    double mean_ns = pacing->render_ns / pacing->render_frames;
    double variance = pacing->render_areas_areas / pacing->render_frames - mean_area * mean_area;
    double minimum = AREA_DEVIATION * mean_area;
    if (variance > minimum * minimum) {
        double slope = (pacing->render_areas_ns / pacing->render_frames - mean_area * mean_ns) / variance;
        pacing->render_fixed_ns = fmax(mean_ns - slope * mean_area, 0.0);
    }
    pacing->render_fixed_ns = fmin(pacing->render_fixed_ns, mean_ns);
}

static double render_ns_of(const struct pacing *pacing, unsigned scale_eighths)
{
    if (!(pacing->render_frames > 0.0))
        return 0.0;
    double mean_ns = pacing->render_ns / pacing->render_frames;
    double mean_area = pacing->render_areas / pacing->render_frames;
    return pacing->render_fixed_ns + (mean_ns - pacing->render_fixed_ns) / mean_area * area_of(scale_eighths);
}

void pacing_learn(struct pacing *pacing, unsigned scale_eighths, unsigned quality, uint64_t render_ns,
                  uint64_t bytes)
{
    double area = area_of(scale_eighths);
    learn_render(pacing, area, (double)render_ns);
    if (quality)
        learn(&pacing->bytes_full, (double)bytes / area / bytes_of_quality(quality));
}

static double bytes_of(const struct pacing *pacing, unsigned scale_eighths, unsigned quality)
{
    return pacing->bytes_full * area_of(scale_eighths) * bytes_of_quality(quality);
}

/* So that the sending rule passes one frame in each frame time: earlier frames that are not acknowledged yet must
 * fit too. */
static double bytes_a_frame(const struct pacing *pacing)
{
    if (!(pacing->carried_ns > 0.0))
        return INFINITY;
    double of_link = LINK_SHARE * pacing->carried_bytes / pacing->carried_ns * (double)pacing->frame_ns;
    double way_frames = (double)pacing_round_trip_ns(pacing) / (double)pacing->frame_ns;
    double of_room = LINK_SHARE * room_bytes(pacing) / (floor(LINK_SHARE + way_frames) + 1.0);
    return fmin(of_link, of_room);
}

/* The best step that fits `room` times. */
static struct pacing_advice best_that_fits(const struct pacing *pacing, unsigned quality_wanted, double room)
{
    double bytes_max = bytes_a_frame(pacing) / room;
    /* Where even the smallest picture would be late, it would not be worth its size. */
    double render_max_ns = fmax((double)pacing->frame_ns, OF_FIXED * pacing->render_fixed_ns);
    unsigned minimum = quality_wanted < PACING_QUALITY_MIN ? quality_wanted : PACING_QUALITY_MIN;
    struct pacing_advice advice = {.scale_eighths = scales_eighths[SCALES - 1], .quality = minimum};
    for (size_t i = 0; i < SCALES; i++) {
        unsigned scale = scales_eighths[i];
        bool rendered_in_time = render_ns_of(pacing, scale) * room <= render_max_ns || i == SCALES - 1;
        if (!rendered_in_time || (bytes_of(pacing, scale, minimum) > bytes_max && i < SCALES - 1))
            continue;
        advice.scale_eighths = scale;
        advice.quality = quality_wanted;
        while (advice.quality > minimum && bytes_of(pacing, scale, advice.quality) > bytes_max)
            advice.quality--;
        break;
    }
    return advice;
}

static bool is_better(const struct pacing_advice *a, unsigned scale_eighths, unsigned quality)
{
    return a->scale_eighths > scale_eighths || (a->scale_eighths == scale_eighths && a->quality > quality);
}

struct pacing_advice pacing_advise(struct pacing *pacing, unsigned quality_wanted)
{
    if (!pacing->quality)
        pacing->quality = quality_wanted;
    struct pacing_advice now = best_that_fits(pacing, quality_wanted, 1.0);
    struct pacing_advice with_room = best_that_fits(pacing, quality_wanted, BETTER_ROOM);
    if (!is_better(&now, pacing->scale_eighths, pacing->quality)) {
        pacing->better_count = 0;
    } else if (!is_better(&with_room, pacing->scale_eighths, pacing->quality)) {
        pacing->better_count = 0;
        now.scale_eighths = pacing->scale_eighths;
        now.quality = pacing->quality;
    } else if (++pacing->better_count < BETTER_TIMES) {
        now.scale_eighths = pacing->scale_eighths;
        now.quality = pacing->quality;
    } else {
        pacing->better_count = 0;
        now = with_room;
    }
    pacing->scale_eighths = now.scale_eighths;
    pacing->quality = now.quality;
    double bytes = fmin(bytes_a_frame(pacing), 0x1p40);
    now.bytes = (uint64_t)bytes;
    return now;
}
