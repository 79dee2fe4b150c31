/* SPDX-License-Identifier: MIT */
/* Draws a picture and the overlay with SDL: into a window, or in software into memory. */
#ifndef FARLIGHT_VIEWER_OVERLAY_PAINT_H
#define FARLIGHT_VIEWER_OVERLAY_PAINT_H

#include "hud.h"
#include "pixmap.h"

struct SDL_Renderer;
struct painter;

/* The renderer stays the caller's and must outlive it. */
struct painter *painter_create(struct SDL_Renderer *renderer, struct fl_error *error);
/* Draws the whole window: the picture as large as it fits, the overlay over it. It is not presented yet. */
void painter_draw(struct painter *painter, int width, int height, const struct pixmap *picture,
                  const struct hud_state *state);
void painter_destroy(struct painter *painter);

/* Draws a window of this size in software, into `made`, independent of the window's renderer. */
bool paint_in_memory(int width, int height, const struct pixmap *picture, const struct hud_state *state,
                     struct pixmap *made, struct fl_error *error);

#endif
