/* SPDX-License-Identifier: MIT */
/* The rays of a picture in the key view's space (x, y, w). A surface at depth w on a pixel's ray lies at
 *
 *   (x, y) = vanishing + w * shift,
 *
 * where the vanishing point is the place of infinitely distant objects, and the shift is the displacement from
 * there of an object at the unit's distance. The ray leaves the eye with decreasing w, so w serves as its
 * parameter. */
#ifndef FARLIGHT_CLIENT_WARP_RAYS_H
#define FARLIGHT_CLIENT_WARP_RAYS_H

#include "warp/lanes.h"

/* Rays that point away from the key view's direction by more than this have no vanishing point and are outside. */
#define RAYS_FORWARD_MIN 1e-4f
#define RAYS_PLACE_MAX 1e6f /* texels: limit of coordinates, which is far outside anyway */

struct warp_rays {
    /* Matrix for (x, y, 1) of the picture: the vanishing point's texel coordinates times rows[2] */
    float rows[3][3];
    float origin[3]; /* the eye in the same coordinates, per unit */
    float w_limit;   /* surfaces of larger w are behind the eye's plane */
};

/* Rays of LANES pixels. */
struct warp_packet {
    float x[LANES], y[LANES], shift_x[LANES], shift_y[LANES];
};

/* A ray of a packet. */
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
    const float counts = (float)is_forward; /* a product, since lanes have no branches */
    ray.shift_x = counts * (rays->origin[0] - rays->origin[2] * ray.x);
    ray.shift_y = counts * (rays->origin[1] - rays->origin[2] * ray.y);
    return ray;
}

/* The texel that contains a coordinate, clamped to 0 .. `last`. */
LANES_INLINE int texel_of(float place, int last)
{
    return (int)clamp(place, 0, (float)last);
}

#endif
