/* SPDX-License-Identifier: MIT */
/* The panel that edits an object, at the right of the window: contents and layout. */
#ifndef FARLIGHT_VIEWER_OVERLAY_EDIT_PANEL_H
#define FARLIGHT_VIEWER_OVERLAY_EDIT_PANEL_H

#include <stdbool.h>
#include <stddef.h>

#define HUD_EDIT_ROWS_MAX 96u
#define HUD_EDIT_TABS 4u

/* A number, or a component of a vector. */
struct hud_edit_row {
    char name[40], value[40];
    double share; /* position of the slider; below 0: the value has no bounds, and no slider */
    bool has_colour;
    bool is_shown_as_it_is; /* the colour is a display value, else linear */
    float colour[3];        /* colour whose first number this row is; drawn as a swatch, brightest at 1 */
};

struct hud_edit {
    bool shown;
    const char *tabs[HUD_EDIT_TABS]; /* "node", "material" and so on */
    size_t tab;
    char title[80];    /* the object's name and number */
    const char *hint;  /* meaning of the chosen row, or advice */
    const char *typed; /* typed text that replaces the chosen row's value; NULL: none */
    size_t count, chosen;
    struct hud_edit_row rows[HUD_EDIT_ROWS_MAX];
};

/* The part of the panel at a place of the window. */
enum hud_edit_part {
    HUD_EDIT_OUTSIDE,
    HUD_EDIT_TAB,   /* tab `index` */
    HUD_EDIT_ROW,   /* row `index` */
    HUD_EDIT_SLIDER /* slider of row `index`, at `share` of it */
};
struct hud_edit_hit {
    enum hud_edit_part part; /* OUTSIDE with is_panel: a passive part of the panel */
    bool is_panel;
    size_t index;
    double share; /* may be outside of 0 to 1 */
};

/* Finds the part at a place. `width`, `height` and `scale` are as in struct hud_state. */
void hud_edit_find(const struct hud_edit *edit, double width, double height, double scale, double x, double y,
                   struct hud_edit_hit *hit);
/* The share of a slider at a place, the same for all rows; a drag may leave the slider. */
double hud_edit_share(double width, double scale, double x);
struct hud_layout;
/* Draws the panel if it is shown. NULL: no panel. */
void hud_draw_edit(struct hud_layout *layout, const struct hud_edit *edit, double width, double height);
/* The panel's share of the window's width in pixels, including its margin. */
double hud_edit_width(const struct hud_edit *edit, double width, double scale);

#endif
