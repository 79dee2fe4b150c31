/* SPDX-License-Identifier: MIT */
#include "viewer/picture.h"

#include <stdlib.h>
#include <string.h>

bool picture_resize(struct picture *picture, int width, int height, struct fl_error *error)
{
    picture->version++;
    if (picture->width == width && picture->height == height)
        return true;
    const uint64_t version = picture->version;
    picture_finish(picture);
    picture->version = version;
    picture->pixels = malloc((size_t)width * (size_t)height * 4);
    if (picture->pixels == NULL)
        return fl_error_set(error, FL_ERROR_MEMORY, "", "no memory for a picture of %dx%d", width, height);
    picture->width = width;
    picture->height = height;
    return true;
}

void picture_take(struct picture *picture, struct fl_frame *frame)
{
    const uint64_t version = picture->version + 1;
    picture_finish(picture);
    *picture = (struct picture){
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

bool picture_copy(struct picture *to, const struct picture *from, struct fl_error *error)
{
    if (!picture_resize(to, from->width, from->height, error))
        return false;
    memcpy(to->pixels, from->pixels, (size_t)from->width * (size_t)from->height * 4);
    return true;
}

void picture_finish(struct picture *picture)
{
    free(picture->pixels);
    *picture = (struct picture){0};
}
