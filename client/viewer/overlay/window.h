/* SPDX-License-Identifier: MIT */
/* The window: its events and its display. */
#ifndef FARLIGHT_VIEWER_OVERLAY_WINDOW_H
#define FARLIGHT_VIEWER_OVERLAY_WINDOW_H

#include "hud.h"
#include "pixmap.h"

struct window;

/* Place on the desktop, whose pixels may be larger than the window's. */
struct window_place {
    int width, height;
    bool has_place; /* x and y are known; else the window is in the middle, also if no display would show it */
    int x, y;
    bool full_screen; /* the other members describe the window without it */
};

struct window *window_create(const char *title, const struct window_place *place, struct fl_error *error);
void window_set_title(struct window *window, const char *title);
/* The current place; false: the window is full screen, and only that is set. */
bool window_get_place(const struct window *window, struct window_place *place);
/* The next event; false: there is none. */
bool window_poll(struct window *window, struct input *input);
/* True if the window must be redrawn without changes of ours, as after it was covered. */
bool window_wants_drawing(struct window *window);
uint64_t window_frame_ns(const struct window *window); /* time between two pictures of the display */
void window_size(const struct window *window, int *width, int *height, double *scale); /* see struct input */
/* Draws and shows the picture; waits for the screen. */
void window_show(struct window *window, const struct pixmap *picture, const struct hud_state *state);
void window_toggle_full_screen(struct window *window);
void window_destroy(struct window *window);

#endif
