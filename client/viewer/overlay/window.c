/* SPDX-License-Identifier: MIT */
/* The window, with SDL. */
#include "window.h"
#include "paint.h"

#include <SDL2/SDL.h>
#include <ctype.h>
#include <stdlib.h>
#include <string.h>

struct window {
    SDL_Window *window;
    SDL_Renderer *renderer;
    struct painter *painter;
    bool wants_drawing, is_full_screen;
    char *dropped; /* SDL's: the last dropped file */
};

/* False without a display: SDL draws off-screen then, even if that was not requested. */
static bool is_seen(const char *driver)
{
    const char *asked = getenv("SDL_VIDEODRIVER");
    return (asked && asked[0] != '\0') || (driver && strcmp(driver, "offscreen") != 0 &&
                                           strcmp(driver, "dummy") != 0 && strcmp(driver, "evdev") != 0);
}

/* A saved place on a screen that no longer exists is rejected: the middle of the title bar must be visible. */
static bool is_on_a_display(const struct window_place *place)
{
    const SDL_Point middle = {place->x + place->width / 2, place->y};
    SDL_Rect bounds;
    for (int i = 0; i < SDL_GetNumVideoDisplays(); i++)
        if (SDL_GetDisplayBounds(i, &bounds) == 0 && SDL_PointInRect(&middle, &bounds))
            return true;
    return false;
}

struct window *window_create(const char *title, const struct window_place *place, struct fl_error *error)
{
    struct window *made = calloc(1, sizeof(*made));
    if (!made) {
        fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
        return NULL;
    }
    SDL_SetHint(SDL_HINT_NO_SIGNAL_HANDLERS, "1"); /* the program has its own handlers */
    SDL_SetHint(SDL_HINT_VIDEO_X11_NET_WM_BYPASS_COMPOSITOR, "0");
    if (SDL_Init(SDL_INIT_VIDEO) != 0 || !is_seen(SDL_GetCurrentVideoDriver())) {
        fl_error_set(error, FL_ERROR_SYSTEM, "", "no display for a window");
        fl_error_remedy(error, "set DISPLAY or WAYLAND_DISPLAY, or use --headless --replay");
        window_destroy(made);
        return NULL;
    }
    SDL_EnableScreenSaver();
    const bool is_placed = place->has_place && is_on_a_display(place);
    made->is_full_screen = place->full_screen;
    made->window =
        SDL_CreateWindow(title, is_placed ? place->x : (int)SDL_WINDOWPOS_CENTERED,
                         is_placed ? place->y : (int)SDL_WINDOWPOS_CENTERED, place->width, place->height,
                         SDL_WINDOW_RESIZABLE | SDL_WINDOW_ALLOW_HIGHDPI |
                             (place->full_screen ? SDL_WINDOW_FULLSCREEN_DESKTOP : 0u));
    if (made->window)
        made->renderer = SDL_CreateRenderer(made->window, -1, SDL_RENDERER_PRESENTVSYNC);
    if (!made->renderer)
        fl_error_set(error, FL_ERROR_SYSTEM, "", "the window cannot be made: %s", SDL_GetError());
    else
        made->painter = painter_create(made->renderer, error);
    if (!made->painter) {
        window_destroy(made);
        return NULL;
    }
    made->wants_drawing = true;
    return made;
}

void window_set_title(struct window *window, const char *title)
{
    SDL_SetWindowTitle(window->window, title);
}

bool window_get_place(const struct window *window, struct window_place *place)
{
    place->full_screen = window->is_full_screen;
    if (window->is_full_screen)
        return false;
    SDL_GetWindowSize(window->window, &place->width, &place->height);
    SDL_GetWindowPosition(window->window, &place->x, &place->y);
    place->has_place = true;
    return true;
}

void window_size(const struct window *window, int *width, int *height, double *scale)
{
    int desktop_width = 1, desktop_height = 1;
    SDL_GetWindowSize(window->window, &desktop_width, &desktop_height);
    if (SDL_GetRendererOutputSize(window->renderer, width, height) != 0) {
        *width = desktop_width;
        *height = desktop_height;
    }
    *scale = desktop_width > 0 ? (double)*width / desktop_width : 1;
}

uint64_t window_frame_ns(const struct window *window)
{
    SDL_DisplayMode mode;
    const int display = SDL_GetWindowDisplayIndex(window->window);
    const bool known = display >= 0 && SDL_GetCurrentDisplayMode(display, &mode) == 0 && mode.refresh_rate > 0;
    return UINT64_C(1000000000) / (uint64_t)(known ? mode.refresh_rate : 60);
}

/* ---- events ---- */

static void take_key(const SDL_Event *event, struct input *input)
{
    const char *name = SDL_GetKeyName(event->key.keysym.sym);
    size_t length = 0;
    for (; name[length] != '\0' && length + 1 < sizeof(input->key); length++)
        input->key[length] = (char)tolower((unsigned char)name[length]);
    input->kind = event->type == SDL_KEYDOWN ? INPUT_KEY_DOWN : INPUT_KEY_UP;
}

static bool take_button(const SDL_Event *event, double scale, struct input *input)
{
    const Uint8 button = event->button.button;
    if (button != SDL_BUTTON_LEFT && button != SDL_BUTTON_MIDDLE && button != SDL_BUTTON_RIGHT)
        return false;
    input->kind = event->type == SDL_MOUSEBUTTONDOWN ? INPUT_BUTTON_DOWN : INPUT_BUTTON_UP;
    input->button = (enum input_button)(button - SDL_BUTTON_LEFT);
    input->clicks = event->button.clicks;
    input->x = event->button.x * scale;
    input->y = event->button.y * scale;
    /* A drag continues beyond the window's edge. */
    SDL_CaptureMouse(event->type == SDL_MOUSEBUTTONDOWN ? SDL_TRUE : SDL_FALSE);
    return true;
}

static bool take_window_event(struct window *window, const SDL_Event *event, struct input *input)
{
    window->wants_drawing = true;
    switch (event->window.event) {
    case SDL_WINDOWEVENT_SIZE_CHANGED:
        input->kind = INPUT_RESIZE;
        window_size(window, &input->width, &input->height, &input->scale);
        return true;
    case SDL_WINDOWEVENT_FOCUS_LOST:
        input->kind = INPUT_FOCUS_LOST;
        return true;
    case SDL_WINDOWEVENT_CLOSE:
        input->kind = INPUT_QUIT;
        return true;
    default:
        return false;
    }
}

/* Converts an event; false: it has no meaning here. */
static bool take_event(struct window *window, const SDL_Event *event, struct input *input)
{
    int width = 0, height = 0;
    double scale = 1;
    window_size(window, &width, &height, &scale);
    const SDL_Keymod held = SDL_GetModState();
    *input = (struct input){.shift = (held & KMOD_SHIFT) != 0, .ctrl = (held & KMOD_CTRL) != 0, .scale = scale};
    switch (event->type) {
    case SDL_QUIT:
        input->kind = INPUT_QUIT;
        return true;
    case SDL_KEYDOWN:
    case SDL_KEYUP:
        take_key(event, input);
        return event->key.repeat == 0;
    case SDL_TEXTINPUT:
        input->kind = INPUT_TEXT;
        snprintf(input->text, sizeof(input->text), "%.15s", event->text.text);
        return true;
    case SDL_MOUSEBUTTONDOWN:
    case SDL_MOUSEBUTTONUP:
        return take_button(event, scale, input);
    case SDL_MOUSEMOTION:
        input->kind = INPUT_MOTION;
        input->x = event->motion.x * scale;
        input->y = event->motion.y * scale;
        return true;
    case SDL_MOUSEWHEEL:
        input->kind = INPUT_WHEEL;
        input->wheel = (double)event->wheel.preciseY;
        return true;
    case SDL_DROPFILE:
        SDL_free(window->dropped);
        window->dropped = event->drop.file;
        input->kind = INPUT_DROP;
        input->path = window->dropped;
        return input->path != NULL;
    case SDL_DROPTEXT:
        SDL_free(event->drop.file);
        return false;
    case SDL_WINDOWEVENT:
        return take_window_event(window, event, input);
    default:
        return false;
    }
}

bool window_poll(struct window *window, struct input *input)
{
    SDL_Event event;
    while (SDL_PollEvent(&event) != 0)
        if (take_event(window, &event, input))
            return true;
    return false;
}

bool window_wants_drawing(struct window *window)
{
    const bool wants = window->wants_drawing;
    window->wants_drawing = false;
    return wants;
}

/* ---- drawing ---- */

void window_show(struct window *window, const struct pixmap *picture, const struct hud_state *state)
{
    painter_draw(window->painter, (int)state->width, (int)state->height, picture, state);
    SDL_RenderPresent(window->renderer);
}

void window_toggle_full_screen(struct window *window)
{
    window->is_full_screen = !window->is_full_screen;
    SDL_SetWindowFullscreen(window->window, window->is_full_screen ? SDL_WINDOW_FULLSCREEN_DESKTOP : 0);
}

void window_destroy(struct window *window)
{
    if (!window)
        return;
    painter_destroy(window->painter);
    if (window->renderer)
        SDL_DestroyRenderer(window->renderer);
    if (window->window)
        SDL_DestroyWindow(window->window);
    SDL_free(window->dropped);
    SDL_Quit();
    free(window);
}
