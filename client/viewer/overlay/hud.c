/* SPDX-License-Identifier: MIT */
/* Layout of the overlay. */
#include "hud.h"
#include "mark.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Maximum share of the window's width and height for the tracer's report: longer lines are broken, and rows
 * below are left out. */
#define STRUCTURE_SHARE_MAX 0.6
#define STRUCTURE_LINES_MAX 10u

/* ---- scene and status, at the top left ---- */

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

/* The lower right corner of a panel. */
struct corner {
    double right, bottom;
};

/* Length of a text's beginning that fits into a line, up to a comma or the end; at least up to the first comma. */
static size_t line_length(const struct hud_layout *layout, const char *said)
{
    size_t length = 0, next;
    char line[HUD_TEXT_MAX];
    do {
        next = length + strspn(said + length, ", ");
        next += strcspn(said + next, ",");
        if (length > 0 && next >= HUD_TEXT_MAX)
            break;
        snprintf(line, sizeof(line), "%.*s", (int)next, said);
        if (length > 0 && hud_text_width(layout, HUD_PLAIN, line) >= STRUCTURE_SHARE_MAX * layout->state->width)
            break;
        length = next;
    } while (said[length] != '\0');
    return length;
}

/* Adds the report as rows. */
static size_t break_structure(const struct hud_layout *layout, const char *said, struct row *rows, size_t room)
{
    size_t count = 0;
    while (*said != '\0' && count < room) {
        const size_t length = line_length(layout, said);
        snprintf(rows[count].value, HUD_TEXT_MAX, "%.*s", (int)length, said);
        said += length + strspn(said + length, ", ");
        if (hud_text_width(layout, HUD_PLAIN, rows[count].value) >= STRUCTURE_SHARE_MAX * layout->state->width)
            continue;
        rows[count].name = count == 0 ? "structure" : "";
        count++;
    }
    return count;
}

static struct corner draw_scene(struct hud_layout *layout)
{
    const struct hud_state *state = layout->state;
    const struct settings *settings = state->settings;
    const double s = layout->scale, line = HUD_LINE * s;
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
    double names = 0, widest = hud_text_width(layout, HUD_BOLD, state->scene);
    for (size_t i = 0; i < count; i++)
        names = fmax(names, hud_text_width(layout, HUD_PLAIN, rows[i].name));
    names += 12 * s;
    for (size_t i = 0; i < count; i++)
        widest = fmax(widest, names + hud_text_width(layout, HUD_PLAIN, rows[i].value));
    const double x = HUD_MARGIN * s, y = HUD_MARGIN * s, inner = HUD_PADDING * s;
    const double bar = state->samples_wanted > 1 ? 5 * s : 0;
    hud_box(layout, x, y, widest + 2 * inner, ((double)count + 1) * line + 2 * inner + 3 * s + bar, hud_panel);
    hud_text(layout, x + inner, y + inner, HUD_BOLD, hud_ink, "%s", state->scene);
    for (size_t i = 0; i < count; i++) {
        const double at = y + inner + 3 * s + line * ((double)i + 1);
        hud_text(layout, x + inner, at, HUD_PLAIN, hud_faint, "%s", rows[i].name);
        hud_text(layout, x + inner + names, at, HUD_PLAIN, hud_ink, "%s", rows[i].value);
    }
    if (bar > 0) { /* progress of the refinement */
        const double at = y + inner + 3 * s + line * ((double)count + 1) + 2 * s;
        const double share = state->moving ? 0 : fmin(1, (double)state->samples / state->samples_wanted);
        hud_box(layout, x + inner, at, widest, 3 * s, hud_rule);
        hud_box(layout, x + inner, at, widest * share, 3 * s, share < 1 ? hud_accent : hud_calm);
    }
    return (struct corner){x + widest + 2 * inner, y + ((double)count + 1) * line + 2 * inner + 3 * s + bar};
}

/* ---- all of it in one line ---- */

static void draw_line(struct hud_layout *layout)
{
    const struct hud_state *state = layout->state;
    const double s = layout->scale, inner = HUD_PADDING * s, gap = 18 * s;
    struct metrics_summary summary;
    struct {
        char value[HUD_TEXT_MAX];
    } items[7];
    size_t count = 0;
    metrics_summarise(state->metrics, state->now_ns, &summary);
    const double rate = state->local.shown ? summary.views_per_second : summary.frames_per_second;
    snprintf(items[count++].value, HUD_TEXT_MAX, "%.*f fps", rate > 0 && rate < 9.95 ? 1 : 0, rate);
    snprintf(items[count++].value, HUD_TEXT_MAX, "%s", state->scene);
    if (state->camera[0] != '\0')
        snprintf(items[count++].value, HUD_TEXT_MAX, "%s", state->camera);
    if (state->clip[0] != '\0')
        print_clip(state, items[count++].value, HUD_TEXT_MAX);
    snprintf(items[count++].value, HUD_TEXT_MAX, "%s, %s", protocol_tracer_text(state->settings->tracer),
             protocol_integrator_text(state->settings->integrator));
    print_samples(state, items[count++].value, HUD_TEXT_MAX);
    snprintf(items[count++].value, HUD_TEXT_MAX, "F1: keys");
    double widths[7], width = 0;
    size_t shown = 0;
    for (; shown < count; shown++) {
        widths[shown] = hud_text_width(layout, HUD_PLAIN, items[shown].value) + (shown > 0 ? gap : 0);
        /* The line is beside the panel, if that is open. */
        if (shown > 0 && width + widths[shown] + 2 * (inner + HUD_MARGIN * s) > layout->right)
            break;
        width += widths[shown];
    }
    double x = HUD_MARGIN * s;
    const double y = HUD_MARGIN * s;
    hud_box(layout, x, y, width + 2 * inner, layout->line + inner, hud_panel);
    x += inner;
    for (size_t i = 0; i < shown; x += widths[i++])
        hud_text(layout, i > 0 ? x + gap : x, y + inner / 2, HUD_PLAIN,
                 i == 0   ? hud_accent
                 : i == 1 ? hud_ink
                          : hud_faint,
                 "%s", items[i].value);
}

/* ---- performance, at the top right ---- */

static void print_amount(double amount, const char *unit, char *out, size_t bytes)
{
    const char *const factors[] = {"", "k", "M", "G"};
    size_t factor = 0;
    for (; amount >= 999.5 && factor < 3; factor++)
        amount /= 1000;
    snprintf(out, bytes, amount < 9.95 && factor > 0 ? "%.1f %s%s" : "%.0f %s%s", amount, factors[factor], unit);
}

/* Prints a frame's bytes by part, and the encoding of its picture. */
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

/* Fills rows about views made in the client; returns their number. */
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

/* Draws the figures, if they fit beside `left`; returns their lower edge. */
static double draw_figures(struct hud_layout *layout, double left)
{
    const struct hud_state *state = layout->state;
    const double s = layout->scale, line = HUD_LINE * s, inner = HUD_PADDING * s;
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
    double names = 0, values = hud_text_width(layout, HUD_PLAIN, "000 kB, predicted");
    for (size_t i = 0; i < count; i++) {
        names = fmax(names, hud_text_width(layout, HUD_PLAIN, rows[i].name));
        values = fmax(values, hud_text_width(layout, HUD_PLAIN, rows[i].value));
    }
    const double width = names + values + 12 * s + 2 * inner, x = layout->right - HUD_MARGIN * s - width,
                 y = HUD_MARGIN * s;
    if (x < left + HUD_MARGIN * s)
        return 0;
    hud_box(layout, x, y, width, (double)count * line + 2 * inner, hud_panel);
    for (size_t i = 0; i < count; i++) {
        const double at = y + inner + line * (double)i;
        hud_text(layout, x + inner, at, HUD_PLAIN, hud_faint, "%s", rows[i].name);
        hud_text_to(layout, x + width - inner, at, HUD_PLAIN, i == 0 ? hud_accent : hud_ink, "%s", rows[i].value);
    }
    return y + (double)count * line + 2 * inner;
}

/* ---- errors, help, state ---- */

static double draw_legend(struct hud_layout *layout, double bottom)
{
    const struct hud_state *state = layout->state;
    const double s = layout->scale, inner = HUD_PADDING * s, line = HUD_LINE * s, bar = 220 * s;
    char figures[HUD_TEXT_MAX];
    if (state->heat == HUD_HEAT_NONE)
        return bottom;
    if (state->heat == HUD_HEAT_WAITING)
        snprintf(figures, sizeof(figures), "tracing the reference ..");
    else
        snprintf(figures, sizeof(figures), "mean %.2g, maximum %.2g; %.2g %% of the pixels beyond %g",
                 state->heat_figures.mean, state->heat_figures.max, state->heat_figures.beyond * 100, HEAT_BEYOND);
    const double width = fmax(bar, hud_text_width(layout, HUD_PLAIN, figures)) + 2 * inner;
    const double height = 2 * line + 9 * s + 2 * inner, x = HUD_MARGIN * s, y = bottom - height;
    hud_box(layout, x, y, width, height, hud_panel);
    hud_text(layout, x + inner, y + inner, HUD_PLAIN, hud_ink, "errors against the reference");
    for (int i = 0; i < 64; i++) {
        struct hud_colour colour = {.a = 255};
        uint8_t rgb[3];
        heat_colour((i + 0.5) / 64, rgb);
        colour.r = rgb[0];
        colour.g = rgb[1];
        colour.b = rgb[2];
        hud_box(layout, x + inner + bar * i / 64, y + inner + line + s, bar / 64 + 0.5, 6 * s, colour);
    }
    hud_text_to(layout, x + width - inner, y + inner, HUD_PLAIN, hud_faint, "0 .. %g", state->heat_top);
    hud_text(layout, x + inner, y + inner + line + 9 * s, HUD_PLAIN, hud_ink, "%s", figures);
    return y - HUD_MARGIN * s;
}

static void draw_help(struct hud_layout *layout)
{
    const struct hud_state *state = layout->state;
    const double s = layout->scale, inner = 14 * s, gap = 24 * s, usual = layout->line;
    double keys = 0, docs = 0;
    size_t count = 0;
    for (size_t i = 0; i < input_binding_count; i++)
        count += input_bindings[i].keys != NULL;
    /* In a small window the lines move closer together, and the letters become smaller. */
    double line = fmin(usual + 3 * s, (state->height - 2 * inner) / (double)count);
    layout->line = fmin(usual, line);
    for (size_t i = 0; i < input_binding_count; i++) {
        if (!input_bindings[i].keys)
            continue;
        keys = fmax(keys, hud_text_width(layout, HUD_BOLD, input_bindings[i].keys));
        docs = fmax(docs, hud_text_width(layout, HUD_PLAIN, input_bindings[i].doc));
    }
    const double width = keys + docs + gap + 2 * inner, height = line * (double)count + 2 * inner;
    const double x = (state->width - width) / 2, y = (state->height - height) / 2;
    double at = y + inner;
    hud_box(layout, x, y, width, height, (struct hud_colour){14, 17, 22, 235});
    for (size_t i = 0; i < input_binding_count; i++) {
        if (!input_bindings[i].keys)
            continue;
        hud_text(layout, x + inner, at, HUD_BOLD, hud_accent, "%s", input_bindings[i].keys);
        hud_text(layout, x + inner + keys + gap, at, HUD_PLAIN, hud_ink, "%s", input_bindings[i].doc);
        at += line;
    }
    layout->line = usual;
}

/* Draws the status in the middle of the window, where it is most visible. */
static void draw_status(struct hud_layout *layout)
{
    const struct hud_state *state = layout->state;
    const double s = layout->scale, inner = 16 * s, line = HUD_LINE * s;
    const bool is_lost = state->status != HUD_LOADING; /* lost or refused */
    const char *title = state->status == HUD_REFUSED ? "This scene cannot be shown"
                        : is_lost                    ? "The connection is lost"
                                                     : "Loading";
    char what[HUD_TEXT_MAX];
    snprintf(what, sizeof(what), "%s", state->status_text);
    const double maximum = state->width - 2 * inner - 2 * HUD_MARGIN * s;
    hud_fit(layout, HUD_PLAIN, what, maximum);
    const double bar = fmin(320 * s, maximum);
    const double width =
        fmax(fmax(bar, hud_text_width(layout, HUD_PLAIN, what)), hud_text_width(layout, HUD_BOLD, title));
    const double height = 2 * line + (is_lost ? 4 : 14) * s + 2 * inner;
    const double x = (state->width - width) / 2 - inner, y = (state->height - height) / 2;
    hud_box(layout, x, y, width + 2 * inner, height, hud_panel);
    hud_box(layout, x, y, 3 * s, height, is_lost ? hud_alarm : hud_accent);
    hud_text(layout, x + inner, y + inner, HUD_BOLD, is_lost ? hud_alarm : hud_ink, "%s", title);
    hud_text(layout, x + inner, y + inner + line + 2 * s, HUD_PLAIN, is_lost ? hud_ink : hud_faint, "%s", what);
    if (!is_lost) {
        hud_box(layout, x + inner, y + height - inner - 4 * s, width, 4 * s, hud_rule);
        hud_box(layout, x + inner, y + height - inner - 4 * s, width * fmin(1, state->progress), 4 * s,
                hud_accent);
    }
}

/* Draws the tracer's settings below `top`; the chosen one with its explanation. */
static void draw_panel(struct hud_layout *layout, double top)
{
    const struct hud_state *state = layout->state;
    const struct settings *settings = state->settings;
    const double s = layout->scale, line = HUD_LINE * s, inner = HUD_PADDING * s;
    const size_t count = panel_setting_count(settings->tracer);
    const struct field_desc *chosen = panel_setting(settings->tracer, settings->setting);
    char value[40], doc[HUD_TEXT_MAX];
    double names = 0, values = 0;
    snprintf(doc, sizeof(doc), "%s", chosen ? chosen->doc : "this tracer has no settings");
    for (size_t i = 0; i < count; i++) {
        const struct field_desc *setting = panel_setting(settings->tracer, i);
        panel_value(setting, &settings->tracers, value, sizeof(value));
        names = fmax(names, hud_text_width(layout, HUD_PLAIN, setting->name));
        values = fmax(values, hud_text_width(layout, HUD_BOLD, value));
    }
    names += 12 * s;
    const double width = fmin(fmax(names + values, hud_text_width(layout, HUD_PLAIN, doc)) + 2 * inner,
                              state->width - 2 * HUD_MARGIN * s);
    const double x = HUD_MARGIN * s, height = line * (double)(count + 1) + 2 * inner + 3 * s;
    const double y = fmax(0, fmin(top + HUD_MARGIN * s, state->height - height));
    hud_box(layout, x, y, width, height, hud_panel);
    for (size_t i = 0; i < count; i++) {
        const struct field_desc *setting = panel_setting(settings->tracer, i);
        const bool is_chosen = i == settings->setting;
        panel_value(setting, &settings->tracers, value, sizeof(value));
        hud_text(layout, x + inner, y + inner + line * (double)i, HUD_PLAIN, is_chosen ? hud_accent : hud_faint,
                 "%s", setting->name);
        hud_text(layout, x + inner + names, y + inner + line * (double)i, is_chosen ? HUD_BOLD : HUD_PLAIN,
                 hud_ink, "%s", value);
    }
    while (doc[0] != '\0' && hud_text_width(layout, HUD_PLAIN, doc) > width - 2 * inner)
        doc[strlen(doc) - 1] = '\0';
    hud_text(layout, x + inner, y + inner + line * (double)count + 3 * s, HUD_PLAIN, hud_faint, "%s", doc);
}

static void draw_notice(struct hud_layout *layout, double bottom)
{
    const struct hud_state *state = layout->state;
    const double s = layout->scale, inner = HUD_PADDING * s, line = HUD_LINE * s;
    char notice[HUD_TEXT_MAX];
    snprintf(notice, sizeof(notice), "%s", state->notice);
    hud_fit(layout, HUD_PLAIN, notice, state->width - 2 * inner - 2 * HUD_MARGIN * s);
    const double width = hud_text_width(layout, HUD_PLAIN, notice) + 2 * inner;
    const double x = (state->width - width) / 2, y = bottom - line - 2 * inner;
    hud_box(layout, x, y, width, line + 2 * inner, hud_panel);
    hud_text(layout, x + inner, y + inner, HUD_PLAIN, hud_accent, "%s", notice);
}

void hud_layout(struct hud *hud, const struct hud_state *state, hud_measure *measure, void *user)
{
    struct hud_layout layout = {.hud = hud,
                                .state = state,
                                .measure = measure,
                                .user = user,
                                .scale = state->scale,
                                .right = state->width - hud_edit_width(state->edit, state->width, state->scale),
                                .line = HUD_LINE * state->scale};
    const enum overlay_mode overlay = state->settings->overlay;
    double bottom = state->height - HUD_MARGIN * state->scale, top = 0;
    hud->count = 0;
    if (state->status != HUD_LOADING && overlay == OVERLAY_LINE) {
        draw_line(&layout);
        top = (HUD_MARGIN + HUD_PADDING + HUD_LINE) * state->scale;
    } else if (state->status != HUD_LOADING && overlay != OVERLAY_NONE) {
        const struct corner corner = draw_scene(&layout);
        top = corner.bottom;
        const double figures = draw_figures(&layout, corner.right);
        const size_t before = hud->count;
        if (overlay == OVERLAY_ALL)
            hud_draw_timeline(&layout, fmax(corner.bottom, figures));
        if (hud->count > before) /* the first mark is the panel itself */
            bottom = hud->marks[before].y - HUD_MARGIN * state->scale;
    }
    if (overlay != OVERLAY_NONE)
        bottom = draw_legend(&layout, bottom);
    hud_draw_edit(&layout, state->edit, state->width, state->height);
    if (state->settings->panel)
        draw_panel(&layout, top);
    if (state->notice[0] != '\0')
        draw_notice(&layout, bottom);
    if (state->status != HUD_LIVE)
        draw_status(&layout);
    if (state->settings->help)
        draw_help(&layout);
}
