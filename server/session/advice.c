/* SPDX-License-Identifier: MIT */
/* Cost of pictures, and the advice for the next one: a single deadline for rendering and bytes together. */
#include "session/pacing.h"

#include <math.h>
#include <string.h>

/* Share of the link that frames may fill: the rest drains other queues, and the connection's own. */
#define LINK_SHARE 0.9
#define LEARN_SHARE 0.25
/* Share of the rendering estimate that stays with each frame. */
#define RENDER_FADES 0.9
/* Frames have shown how much of rendering depends on their size when their areas deviate by this part of the mean.
 */
#define AREA_DEVIATION 0.25
/* A frame may always take this many times the part of its time that no size can reduce. */
#define OF_FIXED 1.5
/* Bounces that are never dropped: light goes into glass and out again. */
#define DEPTH_MIN 2u
/* Number of times in a row that the next better step must fit, and the room that it must leave: less than a step
 * of a deadline's sizes, or unused time would stay unused. */
#define BETTER_TIMES 8
#define BETTER_ROOM 1.25
#define BETTER_ROOM_OF_DEADLINE 1.1
/* Maximum time between two pictures of a client that makes its own views while it moves: a picture that is there
 * by then is better large than early. */
#define LATE_NS 250e6

/* Share of a deadline for rendering; the rest is the picture's way to its client. */
#define DEADLINE_SHARE 0.85
/* Factor between a frame's time and the expected one. After two such frames in a row the scene counts as another
 * one; a single frame was disturbed. */
#define SURPRISE 2.0

/* Steps of about half the area: each costs a stream of pictures a key frame. */
static const unsigned scales_32nds[] = {32, 24, 16, 12, 8, 0};
/* Finer steps, of at most a fifth of the area, so that a deadline's time is used. */
static const unsigned scales_of_deadline_32nds[] = {32, 30, 28, 26, 24, 22, 20, 18, 16, 15, 14,
                                                    13, 12, 11, 10, 9,  8,  7,  6,  5,  0};

/* ---- what pictures cost ------------------------------------------------------------------------------ */

/* Bytes of a JPEG beside those at PACING_QUALITY_REFERENCE: each step of 12 is a factor of about 1.35 (rendered
 * pictures, libjpeg-turbo, 4:2:0). */
static double bytes_of_quality(unsigned quality)
{
    return pow(1.35, ((double)quality - PACING_QUALITY_REFERENCE) / 12.0);
}

/* Area, relative to a full picture without a margin. */
static double area_of(const struct pacing *pacing, const struct pacing_advice *advice)
{
    const double side = (double)advice->scale_32nds / PACING_SCALE_FULL;
    const double grown = 1.0 + (double)pacing->terms.margin * (2 - advice->margin_halves_less);
    return side * side * grown * grown;
}

static unsigned samples_of(const struct pacing *pacing)
{
    return pacing->terms.samples > 1 ? pacing->terms.samples : 1;
}

/* Work, relative to a full picture with all samples. */
static double work_of(const struct pacing *pacing, const struct pacing_advice *advice)
{
    const unsigned samples = samples_of(pacing);
    const unsigned taken = advice->samples > 0 && advice->samples < samples ? advice->samples : samples;
    return area_of(pacing, advice) * taken / samples;
}

static void learn(double *known, double seen)
{
    *known = *known > 0.0 ? *known + LEARN_SHARE * (seen - *known) : seen;
}

/* Fits a straight line through times by area, as soon as there are times of different areas. */
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

static unsigned depth_of(const struct pacing *pacing, const struct pacing_advice *advice)
{
    const unsigned depth = pacing->terms.depth < PACING_WAVES ? pacing->terms.depth : PACING_WAVES - 1;
    return depth - (advice->depth_less < depth ? advice->depth_less : depth);
}

/* Time of the bounces of a full picture with all samples. */
static double bounces_ns(const struct pacing *pacing, const struct pacing_advice *advice)
{
    double sum_ns = 0.0;
    for (unsigned wave = 1; wave <= depth_of(pacing, advice); wave++)
        sum_ns += pacing->bounce_ns[wave];
    return sum_ns;
}

static double render_ns_of(const struct pacing *pacing, const struct pacing_advice *advice)
{
    if (!(pacing->render_frames > 0.0))
        return 0.0;
    double mean_ns = pacing->render_ns / pacing->render_frames;
    double mean_area = pacing->render_areas / pacing->render_frames;
    const double of_work_ns = (mean_ns - pacing->render_fixed_ns) / mean_area + bounces_ns(pacing, advice);
    return pacing->render_fixed_ns + of_work_ns * work_of(pacing, advice);
}

static void forget_render(struct pacing *pacing)
{
    pacing->surprises = 0;
    pacing->guessed = false;
    pacing->render_frames = pacing->render_areas = pacing->render_ns = 0.0;
    pacing->render_areas_areas = pacing->render_areas_ns = pacing->render_fixed_ns = 0.0;
    memset(pacing->bounce_ns, 0, sizeof(pacing->bounce_ns));
}

/* Whether a frame was disturbed. Forgets estimates that no longer hold. */
static bool is_disturbed(struct pacing *pacing, const struct pacing_advice *made, double render_ns)
{
    const double expected_ns = render_ns_of(pacing, made);
    const bool surprises =
        expected_ns > 0.0 && (render_ns > SURPRISE * expected_ns || render_ns < expected_ns / SURPRISE);
    pacing->surprises = surprises ? pacing->surprises + 1 : 0;
    if (pacing->surprises < 2)
        return surprises;
    forget_render(pacing);
    return false;
}

void pacing_learn_waves(struct pacing *pacing, const struct pacing_advice *made, uint64_t render_ns,
                        const uint64_t wave_ns[PACING_WAVES], uint64_t bytes)
{
    const double work = work_of(pacing, made);
    double rest_ns = (double)render_ns;
    if (pacing->guessed)
        forget_render(pacing);
    if (made->quality && bytes > 0)
        learn(&pacing->bytes_full, (double)bytes / area_of(pacing, made) / bytes_of_quality(made->quality));
    if (pacing->terms.deadline_ns && is_disturbed(pacing, made, (double)render_ns))
        return;
    for (unsigned wave = 1; wave <= depth_of(pacing, made); wave++) {
        learn(&pacing->bounce_ns[wave], (double)wave_ns[wave] / work);
        rest_ns -= (double)wave_ns[wave];
    }
    learn_render(pacing, work, fmax(rest_ns, 0.0));
}

void pacing_guess_waves(struct pacing *pacing, const struct pacing_advice *made, uint64_t render_ns,
                        const uint64_t wave_ns[PACING_WAVES])
{
    if (render_ns == 0 || pacing->render_frames > 0.0)
        return;
    /* Hidden layers, of which views are made, take as long again. */
    const unsigned times = pacing_makes_views(&pacing->terms) ? 2 : 1;
    uint64_t guessed_ns[PACING_WAVES];
    for (unsigned wave = 0; wave < PACING_WAVES; wave++)
        guessed_ns[wave] = times * wave_ns[wave];
    pacing_learn_waves(pacing, made, times * render_ns, guessed_ns, 0);
    pacing->guessed = true;
}

void pacing_learn_picture(struct pacing *pacing, const struct pacing_advice *made, uint64_t render_ns,
                          uint64_t bytes)
{
    static const uint64_t unknown[PACING_WAVES];
    pacing_learn_waves(pacing, made, render_ns, unknown, bytes);
}

void pacing_learn(struct pacing *pacing, unsigned scale_32nds, unsigned quality, uint64_t render_ns,
                  uint64_t bytes)
{
    const struct pacing_advice made = {.scale_32nds = scale_32nds, .quality = quality};
    pacing_learn_picture(pacing, &made, render_ns, bytes);
}

void pacing_learn_hidden(struct pacing *pacing, uint64_t bytes)
{
    learn(&pacing->hidden_bytes, (double)bytes);
}

/* Bytes of a picture and of the hidden layers that follow it. */
static double bytes_of(const struct pacing *pacing, const struct pacing_advice *advice)
{
    const double hidden = advice->no_hidden ? 0.0 : pacing->hidden_bytes * pacing->terms.hidden_layers;
    return pacing->bytes_full * area_of(pacing, advice) * bytes_of_quality(advice->quality) + hidden;
}

/* Bytes with which the sending rule passes one frame in each frame time: earlier frames that are not acknowledged
 * yet must fit too. */
static double bytes_a_frame(const struct pacing *pacing)
{
    if (!(pacing->carried_ns > 0.0) || pacing->terms.ignores_link)
        return INFINITY;
    double of_link = LINK_SHARE * pacing->carried_bytes / pacing->carried_ns * (double)pacing->frame_ns;
    double way_frames = (double)pacing_round_trip_ns(pacing) / (double)pacing->frame_ns;
    double of_room = LINK_SHARE * pacing_room_bytes(pacing) / (floor(LINK_SHARE + way_frames) + 1.0);
    return fmin(of_link, of_room);
}

/* ---- reductions, in their order ---------------------------------------------------------------------- */

/* Limits that a picture must fit. */
struct limits {
    double bytes;
    double render_ns;
    double samples_ns;    /* limit for a picture with more than one sample */
    double smaller_bytes; /* size in bytes above which the picture is made smaller */
};

static struct limits limits_of(const struct pacing *pacing, double room)
{
    const double frame_ns = (double)pacing->frame_ns, bytes = bytes_a_frame(pacing) / room;
    const bool makes_views = pacing_makes_views(&pacing->terms);
    const double deadline_ns = DEADLINE_SHARE * (double)pacing->terms.deadline_ns;
    const double late_ns = deadline_ns > 0.0 ? deadline_ns : makes_views ? fmax(frame_ns, LATE_NS) : frame_ns;
    return (struct limits){
        .bytes = bytes,
        /* Where even the smallest picture would be late, it would not be worth its size. */
        .render_ns = fmax(late_ns, OF_FIXED * pacing->render_fixed_ns) / room,
        .samples_ns = (deadline_ns > 0.0 ? deadline_ns : frame_ns) / room,
        .smaller_bytes = makes_views ? bytes * fmax(frame_ns, LATE_NS) / frame_ns : bytes,
    };
}

static void lower_quality(const struct pacing *pacing, const struct limits *limits, unsigned minimum,
                          struct pacing_advice *advice)
{
    while (advice->quality > minimum && bytes_of(pacing, advice) > limits->bytes)
        advice->quality--;
}

static void drop_samples(const struct pacing *pacing, const struct limits *limits, struct pacing_advice *advice)
{
    while (advice->samples > 1 && render_ns_of(pacing, advice) > limits->samples_ns)
        advice->samples--;
}

static void drop_bounces(const struct pacing *pacing, const struct limits *limits, struct pacing_advice *advice)
{
    while (depth_of(pacing, advice) > DEPTH_MIN && render_ns_of(pacing, advice) > limits->render_ns)
        advice->depth_less++;
}

/* Drops samples, hidden layers and the margin until the rest fits; not every picture can fit. */
static void drop_extras(const struct pacing *pacing, const struct limits *limits, struct pacing_advice *advice)
{
    const bool has_margin = pacing->terms.margin > 0.0f;
    drop_samples(pacing, limits, advice);
    advice->no_hidden = pacing->terms.hidden_layers > 0 && bytes_of(pacing, advice) > limits->bytes;
    while (has_margin && advice->margin_halves_less < 2 &&
           (bytes_of(pacing, advice) > limits->bytes || render_ns_of(pacing, advice) > limits->render_ns))
        advice->margin_halves_less++;
}

static struct pacing_advice full_advice(const struct pacing *pacing, unsigned quality_wanted)
{
    return (struct pacing_advice){
        .scale_32nds = PACING_SCALE_FULL, .quality = quality_wanted, .samples = samples_of(pacing)};
}

/* Whether the picture fits at minimum quality. */
static bool fits(const struct pacing *pacing, const struct limits *limits, unsigned minimum,
                 struct pacing_advice advice)
{
    advice.quality = minimum;
    return render_ns_of(pacing, &advice) <= limits->render_ns &&
           bytes_of(pacing, &advice) <= limits->smaller_bytes;
}

/* Best step that fits `room` times; if none fits, the smallest. */
static struct pacing_advice best_that_fits(const struct pacing *pacing, unsigned quality_wanted, double room)
{
    const struct limits limits = limits_of(pacing, room);
    const unsigned minimum = quality_wanted < PACING_QUALITY_MIN ? quality_wanted : PACING_QUALITY_MIN;
    struct pacing_advice advice = full_advice(pacing, quality_wanted);
    for (const unsigned *scale = pacing->terms.deadline_ns ? scales_of_deadline_32nds : scales_32nds; *scale;
         scale++) {
        advice = full_advice(pacing, quality_wanted);
        advice.scale_32nds = *scale;
        if (pacing_makes_views(&pacing->terms))
            drop_extras(pacing, &limits, &advice); /* a smaller picture may have what a larger one did not */
        if (pacing->terms.deadline_ns)
            drop_samples(pacing, &limits, &advice);
        if (fits(pacing, &limits, minimum, advice))
            break;
    }
    if (pacing->terms.deadline_ns)
        drop_bounces(pacing, &limits, &advice);
    lower_quality(pacing, &limits, minimum, &advice);
    return advice;
}

/* ---- steadily ---------------------------------------------------------------------------------------- */

/* Compares reductions, the last resort first. */
static bool is_better(const struct pacing_advice *a, const struct pacing_advice *b)
{
    if (a->depth_less != b->depth_less)
        return a->depth_less < b->depth_less;
    if (a->scale_32nds != b->scale_32nds)
        return a->scale_32nds > b->scale_32nds;
    if (a->quality != b->quality)
        return a->quality > b->quality;
    if (a->margin_halves_less != b->margin_halves_less)
        return a->margin_halves_less < b->margin_halves_less;
    if (a->no_hidden != b->no_hidden)
        return b->no_hidden;
    return a->samples > b->samples;
}

struct pacing_advice pacing_advise(struct pacing *pacing, unsigned quality_wanted)
{
    if (!pacing->advised.quality)
        pacing->advised = full_advice(pacing, quality_wanted);
    struct pacing_advice now = best_that_fits(pacing, quality_wanted, 1.0);
    const double room = pacing->terms.deadline_ns ? BETTER_ROOM_OF_DEADLINE : BETTER_ROOM;
    const struct pacing_advice with_room = best_that_fits(pacing, quality_wanted, room);
    if (!is_better(&now, &pacing->advised)) {
        pacing->better_count = 0;
    } else if (!is_better(&with_room, &pacing->advised)) {
        pacing->better_count = 0;
        now = pacing->advised;
    } else if (++pacing->better_count < BETTER_TIMES) {
        now = pacing->advised;
    } else {
        pacing->better_count = 0;
        now = with_room;
    }
    now.bytes = (uint64_t)fmin(bytes_a_frame(pacing), 0x1p40);
    pacing->advised = now;
    return now;
}
