/* SPDX-License-Identifier: MIT */
/* Small tables of a scene in one buffer of RGBA32UI texels: geometries, materials, texture slots, textures,
 * discs and the tables of shared/emitter.h, one after the other. Each struct is whole texels. */
#ifndef FARLIGHT_SHARED_TABLES_H
#define FARLIGHT_SHARED_TABLES_H
#include "shared/types.h"

/* Head of the buffer: the texels where the tables begin, and struct emitter_starts. The table of the geometries
 * follows the head. */
struct table_starts {
    uint materials, texture_slots, textures, discs;
};
SHARED_SIZE(table_starts, 16)
#define TABLES_HEAD_TEXELS 3u

#define GEOMETRY_TEXELS 2u
#define MATERIAL_TEXELS 15u
#define TEXTURE_SLOT_TEXELS 2u
#define TEXTURE_TEXELS 1u
#define DISC_TEXELS 3u

#endif
