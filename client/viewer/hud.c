/* SPDX-License-Identifier: MIT */
#include "viewer/hud.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#define LINE 17.0 /* height of a line of text, pixels of the desktop */
#define MARGIN 12.0
#define PADDING 10.0
#define ROW 12.0 /* of the timeline */
#define TIMELINE_FRAMES 8u
#define TIMELINE_MIN_NS 20e6
/* Of the window's width and height, for what a tracer says: longer lines are broken, those below are left out. */
#define STRUCTURE_SHARE_MAX 0.6
#define STRUCTURE_LINES_MAX 10u

static const struct hud_colour panel = {14, 17, 22, 205}, ink = {232, 236, 241, 255}, faint = {148, 158, 170, 255},
                               accent = {255, 190, 92, 255}, alarm = {255, 110, 92, 255},
                               calm = {120, 214, 140, 255}, rule = {255, 255, 255, 26};

static const struct hud_colour lane_colours[LANE_COUNT] = {
    {173, 181, 191, 255}, {240, 137, 98, 255},  {247, 188, 86, 255},  {122, 200, 118, 255}, {80, 190, 178, 255},
    {92, 160, 232, 255},  {141, 135, 235, 255}, {205, 130, 220, 255}, {236, 120, 164, 255}, {200, 200, 208, 255}};

struct layout {
    struct hud *hud;
    const struct hud_state *state;
    hud_measure *measure;
    void *user;
    double scale;
    double line; /* height of the texts that follow */
};

/* ---- marks ---- */

static struct hud_mark *add(struct layout *layout)
{
    struct hud *hud = layout->hud;
    /* The last one is drawn over and over where there are too many. */
    struct hud_mark *mark = &hud->marks[hud->count < HUD_MARKS_MAX ? hud->count++ : HUD_MARKS_MAX - 1];
    *mark = (struct hud_mark){0};
    return mark;
}

static void box(struct layout *layout, double x, double y, double width, double height, struct hud_colour colour)
{
    struct hud_mark *mark = add(layout);
    mark->x = x;
    mark->y = y;
    mark->width = width;
    mark->height = height;
    mark->colour = colour;
}

static double text_width(const struct layout *layout, enum hud_font font, const char *text)
{
    return layout->measure(layout->user, font, layout->line, text);
}

__attribute__((format(printf, 6, 0))) static struct hud_mark *add_text(struct layout *layout, double x, double y,
                                                                       enum hud_font font,
                                                                       struct hud_colour colour,
                                                                       const char *format, va_list arguments)
{
    struct hud_mark *mark = add(layout);
    vsnprintf(mark->text, sizeof(mark->text), format, arguments);
    mark->x = x;
    mark->y = y;
    mark->height = layout->line;
    mark->font = font;
    mark->colour = colour;
    return mark;
}

__attribute__((format(printf, 6, 7))) static void text(struct layout *layout, double x, double y,
                                                       enum hud_font font, struct hud_colour colour,
                                                       const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    add_text(layout, x, y, font, colour, format, arguments);
    va_end(arguments);
}

/* The same, ending at x. */
__attribute__((format(printf, 6, 7))) static void text_to(struct layout *layout, double x, double y,
                                                          enum hud_font font, struct hud_colour colour,
                                                          const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    add_text(layout, x, y, font, colour, format, arguments)->is_right = true;
    va_end(arguments);
}

/* ---- what is shown, at the top left ---- */

static void print_samples(const struct hud_state *state, char *out, size_t bytes)
{
    if (state->samples == 0)
        snprintf(out, bytes, "no picture yet");
    else if (state->moving && state->depth_less > 0)
        snprintf(out, bytes, "moving: %u of %u bounces", state->depth - state->depth_less, state->depth);
    else if (state->moving)
        snprintf(out, bytes, "moving");
    else if (state->samples < state->samples_wanted)
        snprintf(out, bytes, "refining: %u of %u samples", state->samples, state->samples_wanted);
    else
        snprintf(out, bytes, "at rest: %u sample%s", state->samples, state->samples == 1 ? "" : "s");
}

static void print_clip(const struct hud_state *state, char *out, size_t bytes)
{
    const struct tour *tour = state->tour;
    snprintf(out, bytes, "%s  %.2f of %.2f s%s", state->clip, tour->time_s, tour->duration_s,
             tour->playing ? "" : "  paused");
    if (tour->speed != 1)
        snprintf(out + strlen(out), bytes - strlen(out), "  x%g", tour->speed);
}

struct row {
    const char *name;
    char value[HUD_TEXT_MAX];
};

/* Where its panel ends. */
struct corner {
    double right, bottom;
};

/* As much of a text as fits into a line, behind which commas follow or nothing; at least up to the first one. */
static size_t line_length(const struct layout *layout, const char *said)
{
    size_t length = 0, next;
    char line[HUD_TEXT_MAX];
    do {
        next = length + strspn(said + length, ", ");
        next += strcspn(said + next, ",");
        if (length > 0 && next >= HUD_TEXT_MAX)
            break;
        snprintf(line, sizeof(line), "%.*s", (int)next, said);
        if (length > 0 && text_width(layout, HUD_PLAIN, line) >= STRUCTURE_SHARE_MAX * layout->state->width)
            break;
        length = next;
    } while (said[length] != '\0');
    return length;
}

/* Adds rows that say it. */
static size_t break_structure(const struct layout *layout, const char *said, struct row *rows, size_t room)
{
    size_t count = 0;
    while (*said != '\0' && count < room) {
        const size_t length = line_length(layout, said);
        snprintf(rows[count].value, HUD_TEXT_MAX, "%.*s", (int)length, said);
        said += length + strspn(said + length, ", ");
        if (text_width(layout, HUD_PLAIN, rows[count].value) >= STRUCTURE_SHARE_MAX * layout->state->width)
            continue;
        rows[count].name = count == 0 ? "structure" : "";
        count++;
    }
    return count;
}

static struct corner draw_scene(struct layout *layout)
{
    const struct hud_state *state = layout->state;
    const struct settings *settings = state->settings;
    const double s = layout->scale, line = LINE * s;
    struct row rows[7 + STRUCTURE_LINES_MAX];
    size_t count = 0;
    snprintf(rows[count].value, HUD_TEXT_MAX, "%s, %s", protocol_tracer_text(settings->tracer),
             protocol_integrator_text(settings->integrator));
    rows[count++].name = "method";
    snprintf(rows[count].value, HUD_TEXT_MAX, "%+.1f stops, %s", state->exposure_stops,
             protocol_tone_map_text(settings->tone_map));
    rows[count++].name = "exposure";
    if (settings->stereo) {
        snprintf(rows[count].value, HUD_TEXT_MAX, "%.4g mm apart, %s", state->stereo_m * 1e3,
                 settings->views == PROTOCOL_VIEW_SOURCE_RAYS ? "rendered" : "from layers");
        rows[count++].name = "eyes";
    }
    if (state->camera[0] != '\0') {
        snprintf(rows[count].value, HUD_TEXT_MAX, "%s", state->camera);
        rows[count++].name = "camera";
    }
    if (state->clip[0] != '\0') {
        print_clip(state, rows[count].value, HUD_TEXT_MAX);
        rows[count++].name = "clip";
    }
    print_samples(state, rows[count].value, HUD_TEXT_MAX);
    rows[count++].name = "picture";
    const double lines = fmax(STRUCTURE_SHARE_MAX * state->height / line - (double)count - 1, 1);
    const size_t end = count + (size_t)fmin(lines, STRUCTURE_LINES_MAX);
    for (size_t i = 0; i < HUD_STRUCTURE_MAX && state->structure[i]; i++)
        count += break_structure(layout, state->structure[i], rows + count, end - count);
    double names = 0, widest = text_width(layout, HUD_BOLD, state->scene);
    for (size_t i = 0; i < count; i++)
        names = fmax(names, text_width(layout, HUD_PLAIN, rows[i].name));
    names += 12 * s;
    for (size_t i = 0; i < count; i++)
        widest = fmax(widest, names + text_width(layout, HUD_PLAIN, rows[i].value));
    const double x = MARGIN * s, y = MARGIN * s, inner = PADDING * s;
    const double bar = state->samples_wanted > 1 ? 5 * s : 0;
    box(layout, x, y, widest + 2 * inner, ((double)count + 1) * line + 2 * inner + 3 * s + bar, panel);
    text(layout, x + inner, y + inner, HUD_BOLD, ink, "%s", state->scene);
    for (size_t i = 0; i < count; i++) {
        const double at = y + inner + 3 * s + line * ((double)i + 1);
        text(layout, x + inner, at, HUD_PLAIN, faint, "%s", rows[i].name);
        text(layout, x + inner + names, at, HUD_PLAIN, ink, "%s", rows[i].value);
    }
    if (bar > 0) { /* how far it is refined */
        const double at = y + inner + 3 * s + line * ((double)count + 1) + 2 * s;
        const double share = state->moving ? 0 : fmin(1, (double)state->samples / state->samples_wanted);
        box(layout, x + inner, at, widest, 3 * s, rule);
        box(layout, x + inner, at, widest * share, 3 * s, share < 1 ? accent : calm);
    }
    return (struct corner){x + widest + 2 * inner, y + ((double)count + 1) * line + 2 * inner + 3 * s + bar};
}

/* ---- how fast, at the top right ---- */

static void print_amount(double amount, const char *unit, char *out, size_t bytes)
{
    const char *const factors[] = {"", "k", "M", "G"};
    size_t factor = 0;
    for (; amount >= 999.5 && factor < 3; factor++)
        amount /= 1000;
    snprintf(out, bytes, amount < 9.95 && factor > 0 ? "%.1f %s%s" : "%.0f %s%s", amount, factors[factor], unit);
}

/* Its bytes by part, and how the picture was encoded. */
static void print_frame(const struct hud_state *state, char out[HUD_TEXT_MAX])
{
    char amount[40], depth[40];
    print_amount((double)(state->wire_bytes - state->local.depth_bytes), "B", amount, sizeof(amount));
    print_amount((double)state->local.depth_bytes, "B", depth, sizeof(depth));
    int length = snprintf(out, HUD_TEXT_MAX, "%s, %s", amount, protocol_encoding_text(state->encoding));
    if (state->quality > 0)
        length += snprintf(out + length, HUD_TEXT_MAX - (size_t)length, " %u", state->quality);
    if (state->local.depth_bytes > 0)
        snprintf(out + length, HUD_TEXT_MAX - (size_t)length, "; depth %s", depth);
}

#define LOCAL_ROWS 4u

/* What is made here: how many rows. */
static size_t print_local(const struct hud_state *state, const struct metrics_summary *summary, struct row *rows)
{
    const struct hud_local *local = &state->local;
    if (!local->on)
        return 0;
    rows[0].name = "views made here";
    snprintf(rows[0].value, HUD_TEXT_MAX, "none: the newest picture");
    if (!local->shown)
        return 1;
    snprintf(rows[0].value, HUD_TEXT_MAX, "%.0f a second, %.1f ms%s", summary->views_per_second,
             summary->view_latency_s * 1e3, local->quality == FL_WARP_TREE ? "" : ", iterative");
    rows[1].name = "from a picture";
    const bool has_bound = local->bound_pixels < 1e3;
    const int length = snprintf(rows[1].value, HUD_TEXT_MAX, "%.2f s old, ", local->age_s);
    snprintf(rows[1].value + length, HUD_TEXT_MAX - (size_t)length, has_bound ? "off by %.2g pixels" : "no bound",
             local->bound_pixels);
    rows[2].name = "not seen yet";
    snprintf(rows[2].value, HUD_TEXT_MAX, "%.1f %%", local->unseen * 100);
    rows[3].name = "mirrors, glass";
    snprintf(rows[3].value, HUD_TEXT_MAX, "%.1f %%", local->sticking * 100);
    return LOCAL_ROWS;
}

/* Its bottom; not drawn where it does not fit beside `left`. */
static double draw_figures(struct layout *layout, double left)
{
    const struct hud_state *state = layout->state;
    const double s = layout->scale, line = LINE * s, inner = PADDING * s;
    struct metrics_summary summary;
    struct row rows[6 + LOCAL_ROWS];
    size_t count = 0;
    metrics_summarise(state->metrics, state->now_ns, &summary);
    snprintf(rows[count].value, HUD_TEXT_MAX, "%.0f", summary.frames_per_second);
    rows[count++].name = "frames per second";
    if (summary.has_latency)
        snprintf(rows[count].value, HUD_TEXT_MAX, "%.1f ms", summary.latency_s * 1e3);
    else
        snprintf(rows[count].value, HUD_TEXT_MAX, "-");
    rows[count++].name = "input to picture";
    print_amount(summary.bits_per_second, "bit/s", rows[count].value, HUD_TEXT_MAX);
    rows[count++].name = "bandwidth";
    print_frame(state, rows[count].value);
    rows[count++].name = "frame";
    count += print_local(state, &summary, rows + count);
    snprintf(rows[count].value, HUD_TEXT_MAX, "%ux%u", state->picture_width, state->picture_height);
    rows[count++].name = "size";
    snprintf(rows[count].value, HUD_TEXT_MAX, "%llu", (unsigned long long)state->revision);
    rows[count++].name = "revision";
    double names = 0, values = text_width(layout, HUD_PLAIN, "000 kB, predicted");
    for (size_t i = 0; i < count; i++) {
        names = fmax(names, text_width(layout, HUD_PLAIN, rows[i].name));
        values = fmax(values, text_width(layout, HUD_PLAIN, rows[i].value));
    }
    const double width = names + values + 12 * s + 2 * inner, x = state->width - MARGIN * s - width,
                 y = MARGIN * s;
    if (x < left + MARGIN * s)
        return 0;
    box(layout, x, y, width, (double)count * line + 2 * inner, panel);
    for (size_t i = 0; i < count; i++) {
        const double at = y + inner + line * (double)i;
        text(layout, x + inner, at, HUD_PLAIN, faint, "%s", rows[i].name);
        text_to(layout, x + width - inner, at, HUD_PLAIN, i == 0 ? accent : ink, "%s", rows[i].value);
    }
    return y + (double)count * line + 2 * inner;
}

/* ---- the timeline, at the bottom ---- */

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
        /* A pause between frames is not worth its room. */
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

static void draw_span(struct layout *layout, const struct axis *axis, double top, enum lane lane,
                      const struct span *span, bool is_even)
{
    const double s = layout->scale, from = place_on(axis, span->begin_ns), to = place_on(axis, span->end_ns);
    struct hud_colour colour = lane_colours[lane];
    if (span->end_ns < axis->begin_ns)
        return;
    colour.a = is_even ? 255 : 150; /* neighbours are told apart */
    box(layout, from, top + (double)lane * ROW * s + 2 * s, fmax(to - from, s), ROW * s - 3 * s, colour);
}

static void draw_frames(struct layout *layout, const struct axis *axis, double top, int64_t offset_ns)
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
        box(layout, place_on(axis, (int64_t)frame->shown_ns), top, s, ROW * s * LANE_COUNT,
            (struct hud_colour){255, 255, 255, 60});
    }
}

/* Not drawn where it would come above `top_min`. */
static void draw_timeline(struct layout *layout, double top_min)
{
    const struct hud_state *state = layout->state;
    const double s = layout->scale, inner = PADDING * s, line = LINE * s;
    const double rows = ROW * s * LANE_COUNT, height = rows + line + 2 * inner;
    const double x = MARGIN * s, width = state->width - 2 * MARGIN * s, y = state->height - MARGIN * s - height;
    const int64_t offset_ns = metrics_clock_offset_ns(state->metrics);
    struct axis axis = {.x = x + inner + 62 * s};
    axis.width = x + width - inner - axis.x;
    if (axis.width < 40 * s || y < top_min + MARGIN * s || !choose_axis(state->metrics, offset_ns, &axis))
        return;
    box(layout, x, y, width, height, panel);
    const double top = y + inner;
    layout->line = (ROW + 2) * s;
    for (int lane = 0; lane < LANE_COUNT; lane++)
        text(layout, x + inner, top + lane * ROW * s - 1 * s, HUD_PLAIN, lane_colours[lane], "%s",
             lane_names[lane]);
    layout->line = line;
    const double label = text_width(layout, HUD_PLAIN, "0000 ms") + 10 * s;
    const double tick = tick_ns(axis.length_ns, fmax(1, axis.width / label));
    for (double at = tick; at <= axis.length_ns; at += tick) {
        const double place = axis.x + at / axis.length_ns * axis.width;
        box(layout, place, top, s, rows, rule);
        text_to(layout, place, top + rows + 2 * s, HUD_PLAIN, faint, "%g ms", at * 1e-6);
    }
    draw_frames(layout, &axis, top, offset_ns);
}

/* ---- errors, help, state ---- */

static double draw_legend(struct layout *layout, double bottom)
{
    const struct hud_state *state = layout->state;
    const double s = layout->scale, inner = PADDING * s, line = LINE * s, bar = 220 * s;
    char figures[HUD_TEXT_MAX];
    if (state->heat == HUD_HEAT_NONE)
        return bottom;
    if (state->heat == HUD_HEAT_WAITING)
        snprintf(figures, sizeof(figures), "tracing the reference ..");
    else
        snprintf(figures, sizeof(figures), "mean %.2g, maximum %.2g; %.2g %% of the pixels beyond %g",
                 state->heat_figures.mean, state->heat_figures.max, state->heat_figures.beyond * 100, HEAT_BEYOND);
    const double width = fmax(bar, text_width(layout, HUD_PLAIN, figures)) + 2 * inner;
    const double height = 2 * line + 9 * s + 2 * inner, x = MARGIN * s, y = bottom - height;
    box(layout, x, y, width, height, panel);
    text(layout, x + inner, y + inner, HUD_PLAIN, ink, "errors against the reference");
    for (int i = 0; i < 64; i++) {
        struct hud_colour colour = {.a = 255};
        uint8_t rgb[3];
        heat_colour((i + 0.5) / 64, rgb);
        colour.r = rgb[0];
        colour.g = rgb[1];
        colour.b = rgb[2];
        box(layout, x + inner + bar * i / 64, y + inner + line + s, bar / 64 + 0.5, 6 * s, colour);
    }
    text_to(layout, x + width - inner, y + inner, HUD_PLAIN, faint, "0 .. %g", state->heat_top);
    text(layout, x + inner, y + inner + line + 9 * s, HUD_PLAIN, ink, "%s", figures);
    return y - MARGIN * s;
}

static void draw_help(struct layout *layout)
{
    const struct hud_state *state = layout->state;
    const double s = layout->scale, inner = 14 * s, gap = 24 * s, usual = layout->line;
    double keys = 0, docs = 0;
    size_t count = 0;
    for (size_t i = 0; i < input_binding_count; i++)
        count += input_bindings[i].keys != NULL;
    /* In a small window the lines move together, and the letters become smaller. */
    double line = fmin(usual + 3 * s, (state->height - 2 * inner) / (double)count);
    layout->line = fmin(usual, line);
    for (size_t i = 0; i < input_binding_count; i++) {
        if (!input_bindings[i].keys)
            continue;
        keys = fmax(keys, text_width(layout, HUD_BOLD, input_bindings[i].keys));
        docs = fmax(docs, text_width(layout, HUD_PLAIN, input_bindings[i].doc));
    }
    const double width = keys + docs + gap + 2 * inner, height = line * (double)count + 2 * inner;
    const double x = (state->width - width) / 2, y = (state->height - height) / 2;
    double at = y + inner;
    box(layout, x, y, width, height, (struct hud_colour){14, 17, 22, 235});
    for (size_t i = 0; i < input_binding_count; i++) {
        if (!input_bindings[i].keys)
            continue;
        text(layout, x + inner, at, HUD_BOLD, accent, "%s", input_bindings[i].keys);
        text(layout, x + inner + keys + gap, at, HUD_PLAIN, ink, "%s", input_bindings[i].doc);
        at += line;
    }
    layout->line = usual;
}

/* In the middle of the window: nothing else is as important. */
static void draw_status(struct layout *layout)
{
    const struct hud_state *state = layout->state;
    const double s = layout->scale, inner = 16 * s, line = LINE * s;
    const bool is_lost = state->status == HUD_LOST;
    const char *title = is_lost ? "The connection is lost" : "Loading";
    char what[HUD_TEXT_MAX];
    snprintf(what, sizeof(what), "%s", state->status_text);
    const double maximum = state->width - 2 * inner - 2 * MARGIN * s;
    for (size_t length = strlen(what); length > 4 && text_width(layout, HUD_PLAIN, what) > maximum; length--)
        strcpy(what + length - 4, "..");
    const double bar = fmin(320 * s, maximum);
    const double width = fmax(fmax(bar, text_width(layout, HUD_PLAIN, what)), text_width(layout, HUD_BOLD, title));
    const double height = 2 * line + (is_lost ? 4 : 14) * s + 2 * inner;
    const double x = (state->width - width) / 2 - inner, y = (state->height - height) / 2;
    box(layout, x, y, width + 2 * inner, height, panel);
    box(layout, x, y, 3 * s, height, is_lost ? alarm : accent);
    text(layout, x + inner, y + inner, HUD_BOLD, is_lost ? alarm : ink, "%s", title);
    text(layout, x + inner, y + inner + line + 2 * s, HUD_PLAIN, is_lost ? ink : faint, "%s", what);
    if (!is_lost) {
        box(layout, x + inner, y + height - inner - 4 * s, width, 4 * s, rule);
        box(layout, x + inner, y + height - inner - 4 * s, width * fmin(1, state->progress), 4 * s, accent);
    }
}

/* The settings of the tracer, below `top`; the chosen one with what it means. */
static void draw_panel(struct layout *layout, double top)
{
    const struct hud_state *state = layout->state;
    const struct settings *settings = state->settings;
    const double s = layout->scale, line = LINE * s, inner = PADDING * s;
    const size_t count = panel_setting_count(settings->tracer);
    const struct field_desc *chosen = panel_setting(settings->tracer, settings->setting);
    char value[40], doc[HUD_TEXT_MAX];
    double names = 0, values = 0;
    snprintf(doc, sizeof(doc), "%s", chosen ? chosen->doc : "this tracer has no settings");
    for (size_t i = 0; i < count; i++) {
        const struct field_desc *setting = panel_setting(settings->tracer, i);
        panel_value(setting, &settings->tracers, value, sizeof(value));
        names = fmax(names, text_width(layout, HUD_PLAIN, setting->name));
        values = fmax(values, text_width(layout, HUD_BOLD, value));
    }
    names += 12 * s;
    const double width =
        fmin(fmax(names + values, text_width(layout, HUD_PLAIN, doc)) + 2 * inner, state->width - 2 * MARGIN * s);
    const double x = MARGIN * s, height = line * (double)(count + 1) + 2 * inner + 3 * s;
    const double y = fmax(0, fmin(top + MARGIN * s, state->height - height));
    box(layout, x, y, width, height, panel);
    for (size_t i = 0; i < count; i++) {
        const struct field_desc *setting = panel_setting(settings->tracer, i);
        const bool is_chosen = i == settings->setting;
        panel_value(setting, &settings->tracers, value, sizeof(value));
        text(layout, x + inner, y + inner + line * (double)i, HUD_PLAIN, is_chosen ? accent : faint, "%s",
             setting->name);
        text(layout, x + inner + names, y + inner + line * (double)i, is_chosen ? HUD_BOLD : HUD_PLAIN, ink, "%s",
             value);
    }
    while (doc[0] != '\0' && text_width(layout, HUD_PLAIN, doc) > width - 2 * inner)
        doc[strlen(doc) - 1] = '\0';
    text(layout, x + inner, y + inner + line * (double)count + 3 * s, HUD_PLAIN, faint, "%s", doc);
}

static void draw_notice(struct layout *layout, double bottom)
{
    const struct hud_state *state = layout->state;
    const double s = layout->scale, inner = PADDING * s, line = LINE * s;
    const double width = text_width(layout, HUD_PLAIN, state->notice) + 2 * inner;
    const double x = (state->width - width) / 2, y = bottom - line - 2 * inner;
    box(layout, x, y, width, line + 2 * inner, panel);
    text(layout, x + inner, y + inner, HUD_PLAIN, accent, "%s", state->notice);
}

void hud_layout(struct hud *hud, const struct hud_state *state, hud_measure *measure, void *user)
{
    struct layout layout = {.hud = hud,
                            .state = state,
                            .measure = measure,
                            .user = user,
                            .scale = state->scale,
                            .line = LINE * state->scale};
    const enum overlay_mode overlay = state->settings->overlay;
    double bottom = state->height - MARGIN * state->scale, top = 0;
    hud->count = 0;
    if (state->status != HUD_LOADING && overlay != OVERLAY_NONE) {
        const struct corner corner = draw_scene(&layout);
        top = corner.bottom;
        const double figures = draw_figures(&layout, corner.right);
        const size_t before = hud->count;
        if (overlay == OVERLAY_ALL)
            draw_timeline(&layout, fmax(corner.bottom, figures));
        if (hud->count > before) /* its first mark is its panel */
            bottom = hud->marks[before].y - MARGIN * state->scale;
    }
    if (overlay != OVERLAY_NONE)
        bottom = draw_legend(&layout, bottom);
    if (state->settings->panel)
        draw_panel(&layout, top);
    if (state->notice[0] != '\0')
        draw_notice(&layout, bottom);
    if (state->status != HUD_LIVE)
        draw_status(&layout);
    if (state->settings->help)
        draw_help(&layout);
}
