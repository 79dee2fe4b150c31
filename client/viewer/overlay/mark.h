/* SPDX-License-Identifier: MIT */
/* What the parts of the overlay are drawn with: boxes, texts, and their common measures and colours. */
#ifndef FARLIGHT_VIEWER_OVERLAY_MARK_H
#define FARLIGHT_VIEWER_OVERLAY_MARK_H

#include "hud.h"

/* Pixels of the desktop. */
#define HUD_LINE 17.0 /* height of a line of text */
#define HUD_MARGIN 12.0
#define HUD_PADDING 10.0

extern const struct hud_colour hud_panel, hud_ink, hud_faint, hud_accent, hud_alarm, hud_calm, hud_rule;

struct hud_layout {
    struct hud *hud;
    const struct hud_state *state;
    hud_measure *measure;
    void *user;
    double scale;
    double right; /* where the panel begins in which an object is edited, else the window's width */
    double line;  /* height of the texts that follow */
};

void hud_box(struct hud_layout *layout, double x, double y, double width, double height, struct hud_colour colour);
double hud_text_width(const struct hud_layout *layout, enum hud_font font, const char *text);
/* Cuts a text that is wider. */
void hud_fit(const struct hud_layout *layout, enum hud_font font, char *text, double width);
void hud_text(struct hud_layout *layout, double x, double y, enum hud_font font, struct hud_colour colour,
              const char *format, ...) __attribute__((format(printf, 6, 7)));
/* The same, ending at x. */
void hud_text_to(struct hud_layout *layout, double x, double y, enum hud_font font, struct hud_colour colour,
                 const char *format, ...) __attribute__((format(printf, 6, 7)));

/* At the bottom of the window; not drawn where it would come above `top_min`. */
void hud_draw_timeline(struct hud_layout *layout, double top_min);
/* At the right of the window, if it is shown. */
void hud_draw_edit(struct hud_layout *layout);

#endif
