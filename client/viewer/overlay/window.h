/* SPDX-License-Identifier: MIT */
/* The window: its events and its display. */
#ifndef FARLIGHT_VIEWER_OVERLAY_WINDOW_H
#define FARLIGHT_VIEWER_OVERLAY_WINDOW_H

#include "hud.h"
#include "pixmap.h"

struct window;

/* Of the desktop, whose pixels may be larger than the window's. */
struct window_place {
    int width, height;
    bool has_place; /* x and y are known; in the middle otherwise, and where no display would show it */
    int x, y;
    bool full_screen; /* the rest is of the window without it */
};

struct window *window_create(const char *title, const struct window_place *place, struct fl_error *error);
void window_set_title(struct window *window, const char *title);
/* Where it is now; false: it is full screen, and only that is said. */
bool window_get_place(const struct window *window, struct window_place *place);
/* The next event; false: there is none. */
bool window_poll(struct window *window, struct input *input);
/* Whether the window must be redrawn though nothing of ours has changed, as after it was covered. */
bool window_wants_drawing(struct window *window);
uint64_t window_frame_ns(const struct window *window); /* between two pictures of its display */
void window_size(const struct window *window, int *width, int *height, double *scale); /* as of struct input */
/* Draws and shows it: waits for the screen. */
void window_show(struct window *window, const struct pixmap *picture, const struct hud_state *state);
void window_toggle_full_screen(struct window *window);
void window_destroy(struct window *window);

#endif
