/* SPDX-License-Identifier: MIT */
/* The timeline: stages of the last frames on one axis of time, at the bottom of the window. */
#include "hud.h"
#include "mark.h"

#include <math.h>

#define ROW 12.0 /* height of a row of the timeline */
#define TIMELINE_FRAMES 8u
#define TIMELINE_MIN_NS 20e6

static const struct hud_colour lane_colours[LANE_COUNT] = {
    {173, 181, 191, 255}, {240, 137, 98, 255},  {247, 188, 86, 255},  {122, 200, 118, 255}, {80, 190, 178, 255},
    {92, 160, 232, 255},  {141, 135, 235, 255}, {205, 130, 220, 255}, {236, 120, 164, 255}, {200, 200, 208, 255}};

struct axis {
    double x, width; /* pixels */
    int64_t begin_ns;
    double length_ns;
};

static double place_on(const struct axis *axis, int64_t at_ns)
{
    return axis->x + fmax(0, fmin(1, (double)(at_ns - axis->begin_ns) / axis->length_ns)) * axis->width;
}

/* 1, 2 or 5 times a power of ten: the smallest that fits into the length at most `maximum` times. */
static double tick_ns(double length_ns, double maximum)
{
    const double minimum = length_ns / maximum, power = pow(10, floor(log10(minimum)));
    return minimum <= power       ? power
           : minimum <= 2 * power ? 2 * power
           : minimum <= 5 * power ? 5 * power
                                  : 10 * power;
}

static bool choose_axis(const struct metrics *metrics, int64_t offset_ns, struct axis *axis)
{
    int64_t begin_ns = INT64_MAX, end_ns = INT64_MIN;
    for (size_t back = 0; back < TIMELINE_FRAMES; back++) {
        const struct metrics_frame *frame = metrics_frame(metrics, back);
        for (int lane = 0; frame && lane < LANE_COUNT; lane++) {
            struct span span;
            if (!metrics_span(frame, (enum lane)lane, offset_ns, &span))
                continue;
            begin_ns = span.begin_ns < begin_ns ? span.begin_ns : begin_ns;
            end_ns = span.end_ns > end_ns ? span.end_ns : end_ns;
        }
        /* A pause between frames would waste space. */
        const struct metrics_frame *before = metrics_frame(metrics, back + 1);
        if (!frame || !before || (double)(begin_ns - (int64_t)before->shown_ns) > TIMELINE_MIN_NS * 4)
            break;
    }
    if (end_ns <= begin_ns)
        return false;
    axis->length_ns = fmax((double)(end_ns - begin_ns), TIMELINE_MIN_NS);
    axis->begin_ns = end_ns - (int64_t)axis->length_ns;
    return true;
}

static void draw_span(struct hud_layout *layout, const struct axis *axis, double top, enum lane lane,
                      const struct span *span, bool is_even)
{
    const double s = layout->scale, from = place_on(axis, span->begin_ns), to = place_on(axis, span->end_ns);
    struct hud_colour colour = lane_colours[lane];
    if (span->end_ns < axis->begin_ns)
        return;
    colour.a = is_even ? 255 : 150; /* distinguishes neighbouring frames */
    hud_box(layout, from, top + (double)lane * ROW * s + 2 * s, fmax(to - from, s), ROW * s - 3 * s, colour);
}

static void draw_frames(struct hud_layout *layout, const struct axis *axis, double top, int64_t offset_ns)
{
    const struct metrics *metrics = layout->state->metrics;
    const double s = layout->scale;
    for (size_t back = 0; back < METRICS_FRAMES; back++) {
        const struct metrics_frame *frame = metrics_frame(metrics, back);
        if (!frame || (int64_t)frame->shown_ns < axis->begin_ns)
            break;
        const bool is_even = frame->frame % 2 == 0;
        for (int lane = 0; lane < LANE_COUNT; lane++) {
            struct span span;
            if (metrics_span(frame, (enum lane)lane, offset_ns, &span))
                draw_span(layout, axis, top, (enum lane)lane, &span, is_even);
        }
        hud_box(layout, place_on(axis, (int64_t)frame->shown_ns), top, s, ROW * s * LANE_COUNT,
                (struct hud_colour){255, 255, 255, 60});
    }
}

void hud_draw_timeline(struct hud_layout *layout, double top_min)
{
    const struct hud_state *state = layout->state;
    const double s = layout->scale, inner = HUD_PADDING * s, line = HUD_LINE * s;
    const double rows = ROW * s * LANE_COUNT, height = rows + line + 2 * inner;
    const double x = HUD_MARGIN * s, width = layout->right - 2 * HUD_MARGIN * s,
                 y = state->height - HUD_MARGIN * s - height;
    const int64_t offset_ns = metrics_clock_offset_ns(state->metrics);
    struct axis axis = {.x = x + inner + 62 * s};
    axis.width = x + width - inner - axis.x;
    if (axis.width < 40 * s || y < top_min + HUD_MARGIN * s || !choose_axis(state->metrics, offset_ns, &axis))
        return;
    hud_box(layout, x, y, width, height, hud_panel);
    const double top = y + inner;
    layout->line = (ROW + 2) * s;
    for (int lane = 0; lane < LANE_COUNT; lane++)
        hud_text(layout, x + inner, top + lane * ROW * s - 1 * s, HUD_PLAIN, lane_colours[lane], "%s",
                 lane_names[lane]);
    layout->line = line;
    const double label = hud_text_width(layout, HUD_PLAIN, "0000 ms") + 10 * s;
    const double tick = tick_ns(axis.length_ns, fmax(1, axis.width / label));
    for (double at = tick; at <= axis.length_ns; at += tick) {
        const double place = axis.x + at / axis.length_ns * axis.width;
        hud_box(layout, place, top, s, rows, hud_rule);
        hud_text_to(layout, place, top + rows + 2 * s, HUD_PLAIN, hud_faint, "%g ms", at * 1e-6);
    }
    draw_frames(layout, &axis, top, offset_ns);
}
