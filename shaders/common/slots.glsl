// SPDX-License-Identifier: MIT
// Order of the frame's pixels (shared/frame.h), and its views.

#include "common/frame.glsl"
#include "common/math.glsl"

// Pixel of a slot: x to the right, y down. It may lie outside the picture at its right and lower edges.
uvec2 pixel_of_slot(uint slot)
{
    uint tile = slot >> 6, m = slot & 63u;
    uvec2 in_tile = uvec2((m & 1u) | (m >> 1 & 2u) | (m >> 2 & 4u), (m >> 1 & 1u) | (m >> 2 & 2u) | (m >> 3 & 4u));
    uint row = quotient(tile, frame.tiles_across);
    return uvec2(tile - row * frame.tiles_across, row) * 8u + in_tile;
}

uint slot_of_pixel(uvec2 pixel)
{
    uvec2 tile = pixel >> 3, p = pixel & 7u;
    uint m = (p.x & 1u) | (p.y & 1u) << 1 | (p.x & 2u) << 1 | (p.y & 2u) << 2 | (p.x & 4u) << 2 | (p.y & 4u) << 3;
    return (tile.y * frame.tiles_across + tile.x) << 6 | m;
}

// View of the picture that a pixel belongs to: its number from the left and from above.
uvec2 view_of_pixel(uvec2 pixel)
{
    if (frame.view_width == frame.width && frame.view_height == frame.height)
        return uvec2(0u);
    return uvec2(quotient(pixel.x, frame.view_width), quotient(pixel.y, frame.view_height));
}

// Place of a pixel within its view, by which it has the random numbers of a picture of that view alone.
uvec2 pixel_in_view(uvec2 pixel)
{
    return pixel - view_of_pixel(pixel) * uvec2(frame.view_width, frame.view_height);
}
