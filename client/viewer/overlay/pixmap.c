/* SPDX-License-Identifier: MIT */
/* Pictures for display. */
#include "pixmap.h"

#include <stdlib.h>
#include <string.h>

bool pixmap_resize(struct pixmap *picture, int width, int height, struct fl_error *error)
{
    picture->version++;
    if (picture->width == width && picture->height == height)
        return true;
    const uint64_t version = picture->version;
    pixmap_finish(picture);
    picture->version = version;
    picture->pixels = malloc((size_t)width * (size_t)height * 4);
    if (!picture->pixels)
        return fl_error_set(error, FL_ERROR_MEMORY, "", "no memory for a picture of %dx%d", width, height);
    picture->width = width;
    picture->height = height;
    return true;
}

void pixmap_take(struct pixmap *picture, struct fl_frame *frame)
{
    const uint64_t version = picture->version + 1;
    pixmap_finish(picture);
    *picture = (struct pixmap){
        .width = (int)frame->width, .height = (int)frame->height, .pixels = frame->pixels, .version = version};
    frame->pixels = NULL;
    uint8_t *pixel = picture->pixels;
    for (size_t left = (size_t)frame->width * frame->height; left > 0; left--, pixel += 4) {
        if (pixel[3] == 255)
            continue;
        for (int c = 0; c < 3; c++)
            pixel[c] = (uint8_t)((pixel[c] * pixel[3] + 127) / 255);
        pixel[3] = 255;
    }
}

bool pixmap_copy(struct pixmap *to, const struct pixmap *from, struct fl_error *error)
{
    if (!pixmap_resize(to, from->width, from->height, error))
        return false;
    memcpy(to->pixels, from->pixels, (size_t)from->width * (size_t)from->height * 4);
    return true;
}

bool pixmap_crop(struct pixmap *to, const struct pixmap *from, int margin_x, int margin_y, struct fl_error *error)
{
    if (!pixmap_resize(to, from->width - 2 * margin_x, from->height - 2 * margin_y, error))
        return false;
    const size_t row_bytes = (size_t)to->width * 4, from_bytes = (size_t)from->width * 4;
    const uint8_t *row = from->pixels + (size_t)margin_y * from_bytes + (size_t)margin_x * 4;
    for (int y = 0; y < to->height; y++, row += from_bytes)
        memcpy(to->pixels + (size_t)y * row_bytes, row, row_bytes);
    return true;
}

void pixmap_exchange(struct pixmap *a, struct pixmap *b)
{
    const struct pixmap before = *a;
    *a = *b;
    *b = before;
    b->version = a->version + 1;
    a->version = before.version + 1;
}

void pixmap_finish(struct pixmap *picture)
{
    free(picture->pixels);
    *picture = (struct pixmap){0};
}
