/* SPDX-License-Identifier: MIT */
/* The window's side of SDL: what its events become, and what is painted; with drivers that need no display. */
#include "viewer/overlay/paint.h"
#include "viewer/overlay/window.h"
#include "tests/harness/test.h"

#include <SDL2/SDL.h>
#include <stdlib.h>
#include <string.h>

#define WIDTH 320
#define HEIGHT 200

static struct fl_error error;
static struct settings settings;
static struct tour tour;
static struct metrics metrics;

static int begin(void **state)
{
    (void)state;
    setenv("SDL_VIDEODRIVER", "dummy", 1);
    setenv("SDL_RENDER_DRIVER", "software", 1);
    error = (struct fl_error){0};
    settings = (struct settings){0};
    return 0;
}

static struct hud_state some_state(void)
{
    tour = (struct tour){.camera = TOUR_NONE, .clip = TOUR_NONE, .speed = 1};
    return (struct hud_state){.width = WIDTH,
                              .height = HEIGHT,
                              .scale = 1,
                              .status = HUD_LIVE,
                              .status_text = "",
                              .notice = "",
                              .scene = "teapot.glb",
                              .server = "",
                              .camera = "",
                              .clip = "",
                              .settings = &settings,
                              .tour = &tour,
                              .metrics = &metrics};
}

static struct window *open_window(void)
{
    struct window *window =
        window_create("test", &(struct window_place){.width = WIDTH, .height = HEIGHT}, &error);
    struct input input;
    if (!window)
        fail_msg("%s", error.text);
    while (window_poll(window, &input)) /* those of its opening */
        continue;
    return window;
}

static struct input next(struct window *window)
{
    struct input input = {0};
    /* SDL says once that there is nothing between what was there and what came meanwhile. */
    if (!window_poll(window, &input) && !window_poll(window, &input))
        fail_msg("nothing happened");
    return input;
}

static void push_key(Uint32 type, SDL_Keycode key, bool repeats)
{
    SDL_Event event;
    SDL_zero(event); /* clears the whole union */
    event.type = type;
    event.key.keysym.sym = key;
    event.key.repeat = repeats;
    assert_int_equal(SDL_PushEvent(&event), 1);
}

EACH_TEST(begin, NULL)

TEST(keys_have_the_names_of_the_list)
{
    static const struct {
        SDL_Keycode key;
        const char *name;
    } keys[] = {{SDLK_t, "t"},           {SDLK_F1, "f1"},    {SDLK_SPACE, "space"}, {SDLK_ESCAPE, "escape"},
                {SDLK_LEFTBRACKET, "["}, {SDLK_EQUALS, "="}, {SDLK_MINUS, "-"},     {SDLK_LEFT, "left"},
                {SDLK_HOME, "home"},     {SDLK_COMMA, ","},  {SDLK_PERIOD, "."},    {SDLK_w, "w"}};
    struct window *window = open_window();
    struct input input;
    for (size_t i = 0; i < sizeof(keys) / sizeof(keys[0]); i++) {
        push_key(SDL_KEYDOWN, keys[i].key, false);
        push_key(SDL_KEYDOWN, keys[i].key, true); /* held down: not again and again */
        push_key(SDL_KEYUP, keys[i].key, false);
        input = next(window);
        assert_int_equal(input.kind, INPUT_KEY_DOWN);
        assert_string_equal(input.key, keys[i].name);
        assert_false(input.shift);
        assert_int_equal(next(window).kind, INPUT_KEY_UP);
    }
    SDL_SetModState(KMOD_LSHIFT);
    push_key(SDL_KEYDOWN, SDLK_t, false);
    input = next(window);
    assert_int_equal(input_action(&input), ACTION_PREVIOUS_TRACER);
    SDL_SetModState(KMOD_LCTRL);
    push_key(SDL_KEYDOWN, SDLK_z, false);
    input = next(window);
    assert_true(input.ctrl && !input.shift && input_action(&input) == ACTION_UNDO);
    SDL_SetModState(KMOD_NONE);
    assert_false(window_poll(window, &input));
    window_destroy(window);
}

TEST(mouse_and_window_events_come_as_they_are)
{
    struct window *window = open_window();
    SDL_Event event;
    SDL_zero(event);
    event.type = SDL_MOUSEBUTTONDOWN;
    event.button.button = SDL_BUTTON_RIGHT;
    event.button.clicks = 2;
    event.button.x = 30;
    event.button.y = 40;
    SDL_PushEvent(&event);
    event.button.button = 7; /* an unbound button */
    SDL_PushEvent(&event);
    SDL_zero(event);
    event.type = SDL_MOUSEWHEEL;
    event.wheel.preciseY = -1.5f;
    SDL_PushEvent(&event);
    SDL_zero(event);
    event.type = SDL_TEXTINPUT;
    strcpy(event.text.text, "5");
    SDL_PushEvent(&event);
    SDL_zero(event);
    event.type = SDL_WINDOWEVENT;
    event.window.event = SDL_WINDOWEVENT_FOCUS_LOST;
    SDL_PushEvent(&event);
    event.window.event = SDL_WINDOWEVENT_CLOSE;
    SDL_PushEvent(&event);
    struct input input = next(window);
    assert_int_equal(input.kind, INPUT_BUTTON_DOWN);
    assert_int_equal(input.button, INPUT_RIGHT);
    assert_int_equal(input.clicks, 2);
    assert_true(input.x == 30 && input.y == 40);
    input = next(window);
    assert_true(input.kind == INPUT_WHEEL && input.wheel == -1.5);
    input = next(window);
    assert_int_equal(input.kind, INPUT_TEXT);
    assert_string_equal(input.text, "5");
    assert_int_equal(next(window).kind, INPUT_FOCUS_LOST);
    assert_int_equal(next(window).kind, INPUT_QUIT);
    assert_true(window_wants_drawing(window)); /* for the events of the window */
    assert_false(window_wants_drawing(window));
    window_destroy(window);
}

TEST(a_window_tells_its_size_and_shows_something)
{
    struct window *window = open_window();
    int width = 0, height = 0;
    double scale = 0;
    window_size(window, &width, &height, &scale);
    assert_true(width == WIDTH && height == HEIGHT && scale == 1);
    const struct hud_state shown = some_state();
    const struct pixmap none = {0};
    window_show(window, &none, &shown);
    window_destroy(window);
}

TEST(a_file_that_is_dropped_comes_with_its_path)
{
    struct window *window = open_window();
    SDL_Event event;
    for (int i = 0; i < 2; i++) { /* the second is remembered in place of the first */
        SDL_zero(event);
        event.type = SDL_DROPFILE;
        event.drop.file = SDL_strdup(i == 0 ? "/tmp/a b.glb" : "/tmp/c.glb");
        SDL_PushEvent(&event);
        const struct input input = next(window);
        assert_int_equal(input.kind, INPUT_DROP);
        assert_string_equal(input.path, i == 0 ? "/tmp/a b.glb" : "/tmp/c.glb");
    }
    window_destroy(window);
}

TEST(a_window_is_where_it_was_if_a_display_is_there)
{
    struct window_place place = {.width = WIDTH, .height = HEIGHT, .has_place = true, .x = 30, .y = 40}, now = {0};
    for (int i = 0; i < 2; i++) {
        struct window *window = window_create("test", &place, &error);
        assert_non_null(window);
        assert_true(window_get_place(window, &now) && now.width == WIDTH && now.height == HEIGHT);
        assert_int_equal(now.x == 30 && now.y == 40, i == 0);
        window_destroy(window);
        place.x = place.y = 30000;
    }
}

static uint8_t value_at(const struct pixmap *made, int x, int y, int channel)
{
    return made->pixels[((size_t)y * (size_t)made->width + (size_t)x) * 4 + (size_t)channel];
}

TEST(a_picture_is_painted_pixel_by_pixel_or_as_large_as_it_fits)
{
    struct pixmap picture = {0}, made = {0};
    const struct hud_state shown = some_state();
    settings.overlay = OVERLAY_NONE;
    assert_true(pixmap_resize(&picture, WIDTH, HEIGHT, &error));
    for (size_t i = 0; i < WIDTH * HEIGHT * 4; i++)
        picture.pixels[i] = i % 4 == 3 ? 255 : (uint8_t)(i * 7 / 3);
    assert_true(paint_in_memory(WIDTH, HEIGHT, &picture, &shown, &made, &error));
    assert_memory_equal(made.pixels, picture.pixels, WIDTH * HEIGHT * 4);
    /* Half as large each way, and narrower: even colour in the middle, black to both sides. */
    assert_true(pixmap_resize(&picture, 100, 100, &error));
    memset(picture.pixels, 255, 100 * 100 * 4);
    assert_true(paint_in_memory(WIDTH, HEIGHT, &picture, &shown, &made, &error));
    for (int y = 0; y < HEIGHT; y++) {
        assert_int_equal(value_at(&made, WIDTH / 2, y, 1), 255);
        assert_int_equal(value_at(&made, 59, y, 1), 0);
        assert_int_equal(value_at(&made, 61, y, 1), 255);
        assert_int_equal(value_at(&made, 261, y, 1), 0);
    }
    pixmap_finish(&picture);
    pixmap_finish(&made);
}

TEST(a_picture_without_its_margin_is_its_middle)
{
    struct pixmap whole = {0}, middle = {0};
    assert_true(pixmap_resize(&whole, 7, 5, &error));
    for (int i = 0; i < 7 * 5 * 4; i++)
        whole.pixels[i] = (uint8_t)i;
    assert_true(pixmap_crop(&middle, &whole, 2, 1, &error));
    assert_true(middle.width == 3 && middle.height == 3);
    for (int y = 0; y < 3; y++)
        assert_memory_equal(middle.pixels + y * 3 * 4, whole.pixels + ((y + 1) * 7 + 2) * 4, 3 * 4);
    const uint64_t versions[] = {whole.version, middle.version};
    pixmap_exchange(&whole, &middle);
    assert_true(whole.width == 3 && middle.width == 7);
    assert_true(whole.version > versions[0] && middle.version > versions[1]);
    pixmap_finish(&whole);
    pixmap_finish(&middle);
}

TEST(the_overlay_is_painted_over_the_picture)
{
    struct pixmap picture = {0}, made = {0};
    const struct hud_state shown = some_state();
    unsigned dark = 0, bright = 0;
    settings.overlay = OVERLAY_FIGURES;
    assert_true(pixmap_resize(&picture, WIDTH, HEIGHT, &error));
    memset(picture.pixels, 128, WIDTH * HEIGHT * 4);
    assert_true(paint_in_memory(WIDTH, HEIGHT, &picture, &shown, &made, &error));
    for (int y = 12; y < 60; y++)
        for (int x = 12; x < 120; x++) {
            dark += value_at(&made, x, y, 1) < 64;
            bright += value_at(&made, x, y, 1) > 200;
        }
    assert_true(dark > 2000 && bright > 50); /* a panel, and letters on it */
    assert_int_equal(value_at(&made, WIDTH / 2, HEIGHT - 5, 1), 128);
    pixmap_finish(&picture);
    pixmap_finish(&made);
}

TEST(another_picture_of_the_same_version_is_painted)
{
    uint8_t out[4 * 4 * 4] = {0};
    struct pixmap pictures[2] = {{0}};
    struct hud_state shown = some_state();
    shown.width = shown.height = 4;
    settings.overlay = OVERLAY_NONE;
    SDL_Surface *surface = SDL_CreateRGBSurfaceWithFormatFrom(out, 4, 4, 32, 16, SDL_PIXELFORMAT_RGBA32);
    SDL_Renderer *renderer = SDL_CreateSoftwareRenderer(surface);
    struct painter *painter = painter_create(renderer, &error);
    assert_non_null(painter);
    for (int i = 0; i < 2; i++) {
        assert_true(pixmap_resize(&pictures[i], 4, 4, &error));
        memset(pictures[i].pixels, 100 + 100 * i, sizeof(out));
    }
    assert_int_equal(pictures[0].version, pictures[1].version);
    for (int i = 0; i < 2; i++) {
        painter_draw(painter, 4, 4, &pictures[i], &shown);
        SDL_RenderFlush(renderer);
        assert_int_equal(out[0], 100 + 100 * i);
    }
    painter_destroy(painter);
    SDL_DestroyRenderer(renderer);
    SDL_FreeSurface(surface);
    for (int i = 0; i < 2; i++)
        pixmap_finish(&pictures[i]);
}
