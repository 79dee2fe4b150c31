/* SPDX-License-Identifier: MIT */
/* The rays of a picture in the key view's space (x, y, w). What a pixel's ray meets at the depth w lies at
 *
 *   (x, y) = vanishing + w * shift,
 *
 * where the vanishing point is what the pixel would see of things infinitely far away, and the shift is how far
 * what is at the unit's distance lies from there. The ray comes from the eye with decreasing w: so w is its
 * parameter. */
#ifndef FARLIGHT_CLIENT_WARP_RAYS_H
#define FARLIGHT_CLIENT_WARP_RAYS_H

#include "warp/lanes.h"

/* Rays that lead away from what the key view sees by more than this have no vanishing point: they are outside. */
#define RAYS_FORWARD_MIN 1e-4f
#define RAYS_PLACE_MAX 1e6f /* texels: what is so far outside may as well be here */

struct warp_rays {
    float rows[3][3]; /* of (x, y, 1) of the picture: the vanishing point's texel coordinates times rows[2] */
    float origin[3];  /* the eye in the same coordinates, per unit */
    float w_limit;    /* surfaces of greater w are behind the eye's plane */
};

/* Of LANES pixels. */
struct warp_packet {
    float x[LANES], y[LANES], shift_x[LANES], shift_y[LANES];
};

/* One of them. */
struct warp_ray {
    float x, y, shift_x, shift_y;
};

LANES_INLINE struct warp_ray rays_at(const struct warp_rays *rays, float x, float y)
{
    const float z = rays->rows[2][0] * x + rays->rows[2][1] * y + rays->rows[2][2];
    const float over = 1 / max_of(z, RAYS_FORWARD_MIN);
    const float across = (rays->rows[0][0] * x + rays->rows[0][1] * y + rays->rows[0][2]) * over;
    const float down = (rays->rows[1][0] * x + rays->rows[1][1] * y + rays->rows[1][2]) * over;
    const int is_forward = z >= RAYS_FORWARD_MIN;
    struct warp_ray ray;
    ray.x = is_forward ? clamp(across, -RAYS_PLACE_MAX, RAYS_PLACE_MAX) : -RAYS_PLACE_MAX;
    ray.y = is_forward ? clamp(down, -RAYS_PLACE_MAX, RAYS_PLACE_MAX) : -RAYS_PLACE_MAX;
    const float counts = (float)is_forward; /* a product, as lanes do without a condition then */
    ray.shift_x = counts * (rays->origin[0] - rays->origin[2] * ray.x);
    ray.shift_y = counts * (rays->origin[1] - rays->origin[2] * ray.y);
    return ray;
}

/* The texel that a coordinate lies in, of 0 to `last`. */
LANES_INLINE int texel_of(float place, int last)
{
    return (int)clamp(place, 0, (float)last);
}

#endif
