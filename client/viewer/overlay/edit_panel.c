/* SPDX-License-Identifier: MIT */
/* Drawing of the editing panel, and hits in it. */
#include "edit_panel.h"
#include "mark.h"
#include "protocol/common/srgb.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Lengths in pixels of the desktop. */
#define WIDTH 376.0
#define HEADER 46.0 /* tabs and title */
#define SLIDER_BEGIN 190.0
#define SLIDER_WIDTH 96.0
#define FOOTER 22.0

/* The widths do not depend on texts, so hits can be found without a font. */
struct edit_place {
    double x, y, width, height;
    double line, rows_y;
    size_t first, shown; /* index of the first row, and number of shown rows */
};

static struct edit_place place(const struct hud_edit *edit, double width, double height, double s)
{
    struct edit_place frame = {
        .width = fmin(WIDTH * s, width - 2 * HUD_MARGIN * s), .y = HUD_MARGIN * s, .line = HUD_LINE * s};
    frame.x = width - HUD_MARGIN * s - frame.width;
    frame.rows_y = frame.y + HUD_PADDING * s + HEADER * s;
    const double room = height - HUD_MARGIN * s - (FOOTER + HUD_PADDING) * s - frame.rows_y;
    const size_t most = (size_t)fmax(room / frame.line, 1);
    frame.shown = edit->count < most ? edit->count : most;
    /* The chosen row is in the middle if not all fit. */
    const size_t above = frame.shown / 2, last = edit->count - frame.shown;
    frame.first = edit->chosen > above ? edit->chosen - above : 0;
    frame.first = frame.first < last ? frame.first : last;
    frame.height = frame.rows_y + (double)frame.shown * frame.line + (FOOTER + HUD_PADDING) * s - frame.y;
    return frame;
}

double hud_edit_width(const struct hud_edit *edit, double width, double scale)
{
    return edit && edit->shown ? place(edit, width, 0, scale).width + HUD_MARGIN * scale : 0;
}

double hud_edit_share(double width, double scale, double x)
{
    const struct edit_place frame = place(&(struct hud_edit){0}, width, 0, scale);
    return (x - frame.x - SLIDER_BEGIN * scale) / (SLIDER_WIDTH * scale);
}

void hud_edit_find(const struct hud_edit *edit, double width, double height, double scale, double x, double y,
                   struct hud_edit_hit *hit)
{
    const struct edit_place frame = place(edit, width, height, scale);
    *hit = (struct hud_edit_hit){0};
    if (!edit->shown || x < frame.x || x >= frame.x + frame.width || y < frame.y || y >= frame.y + frame.height)
        return;
    hit->is_panel = true;
    const double inner = HUD_PADDING * scale, row = floor((y - frame.rows_y) / frame.line);
    if (y < frame.y + inner + frame.line) {
        hit->part = HUD_EDIT_TAB;
        hit->index = (size_t)fmin(fmax((x - frame.x - inner) / (frame.width - 2 * inner), 0) * HUD_EDIT_TABS,
                                  HUD_EDIT_TABS - 1);
    } else if (row >= 0 && row < (double)frame.shown) {
        hit->index = frame.first + (size_t)row;
        hit->share = hud_edit_share(width, scale, x);
        const bool is_slider = hit->share > -0.05 && hit->share < 1.05 && edit->rows[hit->index].share >= 0;
        hit->part = is_slider ? HUD_EDIT_SLIDER : HUD_EDIT_ROW;
    }
}

/* ---- drawing ---- */

static struct hud_colour swatch(const struct hud_edit_row *row)
{
    const float top = fmaxf(1, fmaxf(row->colour[0], fmaxf(row->colour[1], row->colour[2])));
    uint8_t shown[3];
    for (int i = 0; i < 3; i++) {
        const float value = row->colour[i] / top;
        shown[i] = (uint8_t)lroundf(255 * (row->is_shown_as_it_is ? value : srgb_from_linear_f(value)));
    }
    return (struct hud_colour){shown[0], shown[1], shown[2], 255};
}

static void draw_header(struct hud_layout *layout, const struct hud_edit *edit, const struct edit_place *frame)
{
    const double s = layout->scale, inner = HUD_PADDING * s, tab = (frame->width - 2 * inner) / HUD_EDIT_TABS;
    for (size_t i = 0; i < HUD_EDIT_TABS; i++) {
        const bool is_chosen = i == edit->tab;
        const double x = frame->x + inner + tab * (double)i, y = frame->y + inner + frame->line + 1 * s;
        hud_text(layout, x, frame->y + inner, is_chosen ? HUD_BOLD : HUD_PLAIN, is_chosen ? hud_accent : hud_faint,
                 "%s", edit->tabs[i]);
        hud_box(layout, x, y, tab - 4 * s, is_chosen ? 2 * s : 1 * s, is_chosen ? hud_accent : hud_rule);
    }
    char title[sizeof(edit->title)];
    snprintf(title, sizeof(title), "%s", edit->title);
    hud_fit(layout, HUD_BOLD, title, frame->width - 2 * inner);
    hud_text(layout, frame->x + inner, frame->y + inner + frame->line + 7 * s, HUD_BOLD, hud_ink, "%s", title);
}

static void draw_row(struct hud_layout *layout, const struct hud_edit *edit, const struct edit_place *frame,
                     size_t index)
{
    const struct hud_edit_row *row = &edit->rows[index];
    const double s = layout->scale, inner = HUD_PADDING * s;
    const double y = frame->rows_y + frame->line * (double)(index - frame->first);
    const bool is_chosen = index == edit->chosen;
    const double track = frame->x + SLIDER_BEGIN * s, width = SLIDER_WIDTH * s, middle = y + frame->line / 2;
    char name[sizeof(row->name)];
    snprintf(name, sizeof(name), "%s", row->name);
    hud_fit(layout, HUD_PLAIN, name, (SLIDER_BEGIN - HUD_PADDING - 16) * s);
    if (is_chosen)
        hud_box(layout, frame->x + 3 * s, y, frame->width - 6 * s, frame->line, hud_rule);
    hud_text(layout, frame->x + inner, y, HUD_PLAIN, is_chosen ? hud_accent : hud_faint, "%s", name);
    if (row->has_colour)
        hud_box(layout, track - 15 * s, middle - 5 * s, 10 * s, 10 * s, swatch(row));
    if (row->share >= 0) {
        const double share = fmin(row->share, 1);
        hud_box(layout, track, middle - 1 * s, width, 2 * s, (struct hud_colour){255, 255, 255, 60});
        hud_box(layout, track, middle - 1 * s, width * share, 2 * s, is_chosen ? hud_accent : hud_faint);
        hud_box(layout, track + width * share - 2 * s, middle - 5 * s, 4 * s, 10 * s,
                is_chosen ? hud_accent : hud_ink);
    }
    if (is_chosen && edit->typed)
        hud_text_to(layout, frame->x + frame->width - inner, y, HUD_BOLD, hud_accent, "%s_", edit->typed);
    else
        hud_text_to(layout, frame->x + frame->width - inner, y, is_chosen ? HUD_BOLD : HUD_PLAIN, hud_ink, "%s",
                    row->value);
}

void hud_draw_edit(struct hud_layout *layout, const struct hud_edit *edit, double width, double height)
{
    if (!edit || !edit->shown)
        return;
    const double s = layout->scale, inner = HUD_PADDING * s;
    const struct edit_place frame = place(edit, width, height, s);
    char hint[HUD_TEXT_MAX];
    snprintf(hint, sizeof(hint), "%s", edit->hint);
    hud_fit(layout, HUD_PLAIN, hint, frame.width - 2 * inner);
    hud_box(layout, frame.x, frame.y, frame.width, frame.height, hud_panel);
    draw_header(layout, edit, &frame);
    for (size_t i = frame.first; i < frame.first + frame.shown; i++)
        draw_row(layout, edit, &frame, i);
    hud_text(layout, frame.x + inner, frame.y + frame.height - inner - frame.line, HUD_PLAIN, hud_faint, "%s",
             hint);
}
