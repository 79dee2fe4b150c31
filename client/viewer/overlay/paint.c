/* SPDX-License-Identifier: MIT */
/* Painting of picture and overlay with SDL. */
#include "paint.h"

#include <SDL2/SDL.h>
#include <SDL2/SDL_ttf.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define TEXTS_KEPT 256u
#define FONTS_KEPT 8u
#define BASELINE 0.77 /* share of a line's height from its top */

/* A rendered text, cached because most texts are the same in the next picture. */
struct drawn_text {
    char text[HUD_TEXT_MAX];
    TTF_Font *font;
    SDL_Texture *texture; /* white */
    int width, height;
    uint64_t used; /* number of the last picture with it */
};

struct kept_font {
    enum hud_font font;
    int pixels;
    TTF_Font *loaded;
};

struct painter {
    SDL_Renderer *renderer;
    SDL_Texture *texture; /* texture of the picture */
    int texture_width, texture_height;
    const struct pixmap *picture; /* the picture in the texture, .. */
    uint64_t version;             /* .. and its version */
    struct kept_font fonts[FONTS_KEPT];
    size_t font_count;
    struct drawn_text texts[TEXTS_KEPT];
    uint64_t drawn; /* number of drawn pictures */
    struct hud hud;
};

/* ---- text ---- */

static TTF_Font *open_font(enum hud_font font, int pixels)
{
    static const char *const names[HUD_FONT_COUNT] = {"DejaVuSans.ttf", "DejaVuSans-Bold.ttf",
                                                      "DejaVuSansMono.ttf"};
    static const char *const folders[] = {"/usr/share/fonts/truetype/dejavu", "/usr/share/fonts/dejavu",
                                          "/usr/share/fonts/TTF", "/usr/local/share/fonts"};
    const char *chosen = getenv("FARLIGHT_FONT");
    TTF_Font *opened = chosen && chosen[0] != '\0' ? TTF_OpenFont(chosen, pixels) : NULL;
    char path[256];
    for (size_t i = 0; i < sizeof(folders) / sizeof(folders[0]) && !opened; i++) {
        snprintf(path, sizeof(path), "%s/%s", folders[i], names[font]);
        opened = TTF_OpenFont(path, pixels);
    }
    return opened;
}

/* Opens the font for a line's height. NULL: there is no font, and no text is drawn. */
static TTF_Font *font_of(struct painter *painter, enum hud_font font, double height)
{
    const int pixels = (int)fmax(6, floor(height * 0.76));
    for (size_t i = 0; i < painter->font_count; i++)
        if (painter->fonts[i].font == font && painter->fonts[i].pixels == pixels)
            return painter->fonts[i].loaded;
    if (painter->font_count == FONTS_KEPT)
        return painter->fonts[0].loaded;
    TTF_Font *loaded = open_font(font, pixels);
    painter->fonts[painter->font_count++] = (struct kept_font){.font = font, .pixels = pixels, .loaded = loaded};
    return loaded;
}

static double measure(void *user, enum hud_font font, double height, const char *text)
{
    int width = 0;
    TTF_Font *loaded = font_of(user, font, height);
    if (!loaded || TTF_SizeUTF8(loaded, text, &width, NULL) != 0)
        return 0;
    return width;
}

static struct drawn_text *find_text(struct painter *painter, TTF_Font *font, const char *text)
{
    struct drawn_text *oldest = &painter->texts[0];
    for (size_t i = 0; i < TEXTS_KEPT; i++) {
        struct drawn_text *drawn = &painter->texts[i];
        if (drawn->texture && drawn->font == font && strcmp(drawn->text, text) == 0)
            return drawn;
        if (drawn->used < oldest->used)
            oldest = drawn;
    }
    SDL_Surface *surface = TTF_RenderUTF8_Blended(font, text, (SDL_Color){255, 255, 255, 255});
    if (!surface)
        return NULL;
    if (oldest->texture)
        SDL_DestroyTexture(oldest->texture);
    *oldest = (struct drawn_text){.font = font, .width = surface->w, .height = surface->h};
    oldest->texture = SDL_CreateTextureFromSurface(painter->renderer, surface);
    snprintf(oldest->text, sizeof(oldest->text), "%s", text);
    SDL_FreeSurface(surface);
    return oldest->texture ? oldest : NULL;
}

static void draw_text(struct painter *painter, const struct hud_mark *mark)
{
    TTF_Font *font = font_of(painter, mark->font, mark->height);
    struct drawn_text *drawn = font ? find_text(painter, font, mark->text) : NULL;
    if (!drawn)
        return;
    drawn->used = painter->drawn;
    const double x = mark->is_right ? mark->x - drawn->width : mark->x;
    const int baseline = (int)lround(mark->y + mark->height * BASELINE);
    const SDL_Rect place = {(int)lround(x), baseline - TTF_FontAscent(font), drawn->width, drawn->height};
    SDL_SetTextureColorMod(drawn->texture, mark->colour.r, mark->colour.g, mark->colour.b);
    SDL_SetTextureAlphaMod(drawn->texture, mark->colour.a);
    SDL_RenderCopy(painter->renderer, drawn->texture, NULL, &place);
}

/* ---- the picture ---- */

static bool load_picture(struct painter *painter, const struct pixmap *picture)
{
    if (!painter->texture || painter->texture_width != picture->width ||
        painter->texture_height != picture->height) {
        if (painter->texture)
            SDL_DestroyTexture(painter->texture);
        painter->texture = SDL_CreateTexture(painter->renderer, SDL_PIXELFORMAT_RGBA32,
                                             SDL_TEXTUREACCESS_STREAMING, picture->width, picture->height);
        if (!painter->texture)
            return false;
        SDL_SetTextureBlendMode(painter->texture, SDL_BLENDMODE_NONE);
        SDL_SetTextureScaleMode(painter->texture, SDL_ScaleModeLinear);
        painter->texture_width = picture->width;
        painter->texture_height = picture->height;
        painter->picture = NULL;
    }
    if ((painter->picture != picture || painter->version != picture->version) &&
        SDL_UpdateTexture(painter->texture, NULL, picture->pixels, picture->width * 4) == 0) {
        painter->picture = picture;
        painter->version = picture->version;
    }
    return true;
}

/* The largest rectangle for the picture, in the middle. */
static SDL_Rect picture_place(int width, int height, const struct pixmap *picture)
{
    const double across = (double)width / picture->width, down = (double)height / picture->height;
    const double scale = across < down ? across : down;
    const int w = (int)lround(picture->width * scale), h = (int)lround(picture->height * scale);
    return (SDL_Rect){(width - w) / 2, (height - h) / 2, w, h};
}

void painter_draw(struct painter *painter, int width, int height, const struct pixmap *picture,
                  const struct hud_state *state)
{
    painter->drawn++;
    SDL_SetRenderDrawBlendMode(painter->renderer, SDL_BLENDMODE_NONE);
    SDL_SetRenderDrawColor(painter->renderer, 0, 0, 0, 255);
    SDL_RenderClear(painter->renderer);
    if (picture->width > 0 && load_picture(painter, picture)) {
        const SDL_Rect place = picture_place(width, height, picture);
        SDL_RenderCopy(painter->renderer, painter->texture, NULL, &place);
    }
    hud_layout(&painter->hud, state, measure, painter);
    SDL_SetRenderDrawBlendMode(painter->renderer, SDL_BLENDMODE_BLEND);
    for (size_t i = 0; i < painter->hud.count; i++) {
        const struct hud_mark *mark = &painter->hud.marks[i];
        if (mark->text[0] != '\0') {
            draw_text(painter, mark);
            continue;
        }
        /* Edges fall on pixels, so that neighbours neither overlap nor leave a gap. */
        const int left = (int)lround(mark->x), top = (int)lround(mark->y);
        const SDL_Rect place = {left, top, SDL_max(1, (int)lround(mark->x + mark->width) - left),
                                SDL_max(1, (int)lround(mark->y + mark->height) - top)};
        SDL_SetRenderDrawColor(painter->renderer, mark->colour.r, mark->colour.g, mark->colour.b, mark->colour.a);
        if (mark->width > 0)
            SDL_RenderFillRect(painter->renderer, &place);
    }
}

/* ---- beginning and end ---- */

struct painter *painter_create(SDL_Renderer *renderer, struct fl_error *error)
{
    struct painter *painter = calloc(1, sizeof(*painter));
    if (!painter) {
        fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
        return NULL;
    }
    painter->renderer = renderer;
    if (TTF_Init() == 0 && font_of(painter, HUD_PLAIN, 17))
        return painter;
    fl_error_set(error, FL_ERROR_FILE, "DejaVuSans.ttf", "this font is not installed");
    fl_error_remedy(error, "install the package fonts-dejavu-core, or name a font in FARLIGHT_FONT");
    painter_destroy(painter);
    return NULL;
}

void painter_destroy(struct painter *painter)
{
    if (!painter)
        return;
    for (size_t i = 0; i < TEXTS_KEPT; i++)
        if (painter->texts[i].texture)
            SDL_DestroyTexture(painter->texts[i].texture);
    for (size_t i = 0; i < painter->font_count; i++)
        if (painter->fonts[i].loaded)
            TTF_CloseFont(painter->fonts[i].loaded);
    if (painter->texture)
        SDL_DestroyTexture(painter->texture);
    if (TTF_WasInit() > 0)
        TTF_Quit();
    free(painter);
}

bool paint_in_memory(int width, int height, const struct pixmap *picture, const struct hud_state *state,
                     struct pixmap *made, struct fl_error *error)
{
    if (!pixmap_resize(made, width, height, error))
        return false;
    SDL_Surface *surface =
        SDL_CreateRGBSurfaceWithFormatFrom(made->pixels, width, height, 32, width * 4, SDL_PIXELFORMAT_RGBA32);
    SDL_Renderer *renderer = surface ? SDL_CreateSoftwareRenderer(surface) : NULL;
    struct painter *painter = NULL;
    if (!renderer)
        fl_error_set(error, FL_ERROR_SYSTEM, "", "drawing failed: %s", SDL_GetError());
    else
        painter = painter_create(renderer, error);
    if (painter) {
        painter_draw(painter, width, height, picture, state);
        SDL_RenderFlush(renderer);
        SDL_RenderPresent(renderer);
    }
    const bool done = painter != NULL;
    painter_destroy(painter);
    if (renderer)
        SDL_DestroyRenderer(renderer);
    SDL_FreeSurface(surface);
    return done;
}
