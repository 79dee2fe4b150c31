/* SPDX-License-Identifier: MIT */
/* Keys as structures for warping. */
#include "warped_key.h"

#include "layer.h"
#include "plan.h"

#include <stdlib.h>

#define KEY_PIXELS 0.5f /* additional error of planes, invisible in motion */

void views_key_finish(struct views_key *key)
{
    pixmap_finish(&key->picture);
    free(key->depth);
    free(key->sticking);
    key->depth = NULL;
    key->sticking = NULL;
}

/* Inverts depths in place. */
static void invert(float *depths, size_t count, float unit)
{
    for (size_t i = 0; i < count; i++)
        depths[i] = depths[i] > 0 ? unit / depths[i] : 0;
}

/* Scales numbers to the order of one. */
static float unit_of(const struct views_key *key)
{
    return key->radius / (float)PLAN_RADIUS_SHARE;
}

bool warped_key_set(struct warped_key *warped, struct views_key *came, struct fl_warp_error *error)
{
    const struct pixmap *picture = &came->picture;
    const float unit = unit_of(came);
    warped->width = picture->width;
    warped->height = picture->height;
    invert(came->depth, (size_t)picture->width * (size_t)picture->height, unit);
    const struct fl_warp_key key = {.width = (uint32_t)picture->width,
                                    .height = (uint32_t)picture->height,
                                    .camera = came->camera,
                                    .unit = unit,
                                    .w_error = unit * came->depth_step / 2,
                                    .radius = came->radius,
                                    .pixels = KEY_PIXELS,
                                    .is_smeared = came->is_smeared,
                                    .layer_count = 1,
                                    .layers[0] = {.colours = (const uint32_t *)(const void *)picture->pixels,
                                                  .w = came->depth,
                                                  .sticking = came->sticking}};
    const bool set = fl_warp_set_key(warped->warp, &key, error);
    views_key_finish(came);
    warped->key = *came;
    return set;
}

bool warped_key_add(struct warped_key *warped, struct views_layer *came, bool *added, struct fl_warp_error *error)
{
    const struct pixmap *picture = &came->picture;
    const bool fits = views_layer_fit(came, warped->width, warped->height);
    const struct fl_warp_layer layer = {.colours = (const uint32_t *)(const void *)picture->pixels,
                                        .w = came->depth};
    if (fits)
        invert(came->depth, (size_t)picture->width * (size_t)picture->height, unit_of(&warped->key));
    *added = fits && fl_warp_add_layer(warped->warp, &layer, error);
    views_layer_finish(came);
    return *added || !fits;
}
