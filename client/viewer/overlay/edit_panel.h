/* SPDX-License-Identifier: MIT */
/* The panel in which an object is edited, at the right of the window: what is in it, and where. */
#ifndef FARLIGHT_VIEWER_OVERLAY_EDIT_PANEL_H
#define FARLIGHT_VIEWER_OVERLAY_EDIT_PANEL_H

#include <stdbool.h>
#include <stddef.h>

#define HUD_EDIT_ROWS_MAX 96u
#define HUD_EDIT_TABS 4u

/* A number, or one of a vector. */
struct hud_edit_row {
    char name[40], value[40];
    double share; /* of its range, on the slider; below 0: it has no ends, and no slider */
    bool has_colour;
    bool is_shown_as_it_is; /* the colour is a display's, else linear */
    float colour[3];        /* of which this is the first number; drawn as a swatch, brightest at 1 */
};

struct hud_edit {
    bool shown;
    const char *tabs[HUD_EDIT_TABS]; /* "node", "material" and so on */
    size_t tab;
    char title[80];    /* the object's name and number */
    const char *hint;  /* what the chosen row means, or what to do */
    const char *typed; /* in place of the chosen row's value; NULL: nothing is */
    size_t count, chosen;
    struct hud_edit_row rows[HUD_EDIT_ROWS_MAX];
};

/* What of it a place of the window is. */
enum hud_edit_part {
    HUD_EDIT_OUTSIDE,
    HUD_EDIT_TAB,   /* `index` */
    HUD_EDIT_ROW,   /* `index` */
    HUD_EDIT_SLIDER /* of the row `index`, at `share` of it */
};
struct hud_edit_hit {
    enum hud_edit_part part; /* OUTSIDE: also what of the panel does nothing, where is_panel */
    bool is_panel;
    size_t index;
    double share; /* may be beyond 0 to 1 */
};

/* `width`, `height` and `scale` as of struct hud_state. */
void hud_edit_find(const struct hud_edit *edit, double width, double height, double scale, double x, double y,
                   struct hud_edit_hit *hit);
/* The share that a place is on the slider of any row: a drag goes on beyond it. */
double hud_edit_share(double width, double scale, double x);
/* Draws it, if it is shown; NULL: there is none. */
struct hud_layout;
void hud_draw_edit(struct hud_layout *layout, const struct hud_edit *edit, double width, double height);
/* What it takes of the window's width, with its margin. */
double hud_edit_width(const struct hud_edit *edit, double width, double scale);

#endif
