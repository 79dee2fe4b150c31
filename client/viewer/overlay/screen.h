/* SPDX-License-Identifier: MIT */
/* Screen: the window or, without one, a picture of its size, and a notice over it. */
#ifndef FARLIGHT_VIEWER_OVERLAY_SCREEN_H
#define FARLIGHT_VIEWER_OVERLAY_SCREEN_H

#include "hud.h"
#include "window.h"

struct screen {
    struct window *window; /* NULL: headless */
    int width, height;     /* pixels */
    double scale;          /* pixels per pixel of the desktop */
    double pointer_x, pointer_y;
    bool must_draw;
    uint64_t drawn_ns;
    char notice[HUD_TEXT_MAX];
    uint64_t notice_ns; /* time until which the notice is shown */
};

/* Shows a notice for a while. */
__attribute__((format(printf, 2, 3))) void screen_say(struct screen *screen, const char *format, ...);

#endif
