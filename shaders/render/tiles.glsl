// SPDX-License-Identifier: MIT
// Pixels of a slice's slots. Defines: HAS_TILES the picture has only some of the tiles of its view (shared/key_view.h).
#include "shared/key_view.h"
#include "common/slots.glsl"

#ifdef HAS_TILES
layout(binding = UNIT_KEY_TILES) uniform usamplerBuffer key_tiles;
uniform uint first_tile; // first tile of the layer
#endif

uvec2 pixel_of_picture_slot(uint slot)
{
#ifdef HAS_TILES
    slot = texelFetch(key_tiles, int(first_tile + (slot >> 6))).x << 6 | (slot & 63u);
#endif
    return pixel_of_slot(slot);
}
