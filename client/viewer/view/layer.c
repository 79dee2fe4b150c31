/* SPDX-License-Identifier: MIT */
/* Layers of hidden surfaces. */
#include "layer.h"

#include <stdlib.h>
#include <string.h>

void views_layer_finish(struct views_layer *layer)
{
    pixmap_finish(&layer->picture);
    free(layer->depth);
    layer->depth = NULL;
}

/* Index in a picture of half the size, rounded up, of the pixel that covers a pixel of the full size. */
static int half_of(int pixel, int pixels)
{
    const int half = (pixels + 1) / 2;
    return (2 * pixel + 1 - pixels + 2 * half) / 4;
}

static void spread(const struct views_layer *from, struct views_layer *to)
{
    const int width = to->picture.width, height = to->picture.height;
    for (int y = 0; y < height; y++) {
        const size_t row = (size_t)half_of(y, height) * (size_t)from->picture.width;
        for (int x = 0; x < width; x++) {
            const size_t at = (size_t)y * (size_t)width + (size_t)x, of = row + (size_t)half_of(x, width);
            memcpy(to->picture.pixels + 4 * at, from->picture.pixels + 4 * of, 4);
            to->depth[at] = from->depth[of];
        }
    }
}

bool views_layer_fit(struct views_layer *layer, int width, int height)
{
    struct views_layer whole = {0};
    struct fl_error ignored;
    if (layer->picture.width == width && layer->picture.height == height)
        return true;
    if (layer->picture.width != (width + 1) / 2 || layer->picture.height != (height + 1) / 2)
        return false;
    whole.depth = malloc((size_t)width * (size_t)height * sizeof(*whole.depth));
    const bool made = whole.depth && pixmap_resize(&whole.picture, width, height, &ignored);
    if (made)
        spread(layer, &whole);
    views_layer_finish(made ? layer : &whole);
    if (made)
        *layer = whole;
    return made;
}
