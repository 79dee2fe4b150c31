/* SPDX-License-Identifier: MIT */
/* Drawing of the overlay's parts: boxes, texts, and common lengths and colours. */
#ifndef FARLIGHT_VIEWER_OVERLAY_MARK_H
#define FARLIGHT_VIEWER_OVERLAY_MARK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define HUD_MARKS_MAX 2048u
#define HUD_TEXT_MAX 128u

struct hud_colour {
    uint8_t r, g, b, a; /* straight alpha */
};

enum hud_font { HUD_PLAIN, HUD_BOLD, HUD_MONO, HUD_FONT_COUNT };

/* A filled box, or a text in it: from its left, or to its right edge with `is_right`. */
struct hud_mark {
    double x, y, width, height; /* pixels; for a text the height is the line's */
    struct hud_colour colour;
    enum hud_font font;
    bool is_right;
    char text[HUD_TEXT_MAX]; /* empty: a box */
};

struct hud {
    struct hud_mark marks[HUD_MARKS_MAX]; /* in drawing order */
    size_t count;
};

/* Measures the width of a text in pixels, for this height of a line. */
typedef double hud_measure(void *user, enum hud_font font, double height, const char *text);

/* Lengths in pixels of the desktop. */
#define HUD_LINE 17.0 /* height of a line of text */
#define HUD_MARGIN 12.0
#define HUD_PADDING 10.0

extern const struct hud_colour hud_panel, hud_ink, hud_faint, hud_accent, hud_alarm, hud_calm, hud_rule;

struct hud_state;
struct hud_layout {
    struct hud *hud;
    const struct hud_state *state;
    hud_measure *measure;
    void *user;
    double scale;
    double right; /* left edge of the editing panel, else the window's width */
    double line;  /* height of the following texts */
};

void hud_box(struct hud_layout *layout, double x, double y, double width, double height, struct hud_colour colour);
double hud_text_width(const struct hud_layout *layout, enum hud_font font, const char *text);
/* Cuts a text that is too wide. */
void hud_fit(const struct hud_layout *layout, enum hud_font font, char *text, double width);
void hud_text(struct hud_layout *layout, double x, double y, enum hud_font font, struct hud_colour colour,
              const char *format, ...) __attribute__((format(printf, 6, 7)));
/* Draws a text that ends at x. */
void hud_text_to(struct hud_layout *layout, double x, double y, enum hud_font font, struct hud_colour colour,
                 const char *format, ...) __attribute__((format(printf, 6, 7)));

/* Draws the timeline at the bottom of the window, unless it would reach above `top_min`. */
void hud_draw_timeline(struct hud_layout *layout, double top_min);

#endif
