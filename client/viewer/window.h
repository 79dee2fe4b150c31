/* SPDX-License-Identifier: MIT */
/* The window: its events and its display. */
#ifndef FARLIGHT_CLIENT_VIEWER_WINDOW_H
#define FARLIGHT_CLIENT_VIEWER_WINDOW_H

#include "viewer/hud.h"
#include "viewer/pixmap.h"

struct window;

/* `width` and `height` as of the desktop: on a fine screen it has more pixels. */
struct window *window_create(const char *title, int width, int height, struct fl_error *error);
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
