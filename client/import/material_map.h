/* SPDX-License-Identifier: MIT */
/* A material's maps, by position among the textures of the message set_material. A test compares this list with
 * what messages.def says of them. */
#ifndef FARLIGHT_IMPORT_MATERIAL_MAP_H
#define FARLIGHT_IMPORT_MATERIAL_MAP_H

/* MAP(NAME, its words in messages.def). */
#define MATERIAL_MAPS(MAP)                                                                                        \
    MAP(BASE_COLOUR, "base colour")                                                                               \
    MAP(NORMAL, "normal")                                                                                         \
    MAP(METALLIC_ROUGHNESS, "metallic (blue) and roughness (green)")                                              \
    MAP(OCCLUSION, "occlusion (red)")                                                                             \
    MAP(EMISSION, "emission")                                                                                     \
    MAP(TRANSMISSION, "transmission (red)")                                                                       \
    MAP(BUMP, "bump height (red)")                                                                                \
    MAP(SPECULAR, "specular (alpha)")                                                                             \
    MAP(SPECULAR_COLOUR, "colour of specular")                                                                    \
    MAP(CLEARCOAT, "clearcoat (red)")                                                                             \
    MAP(CLEARCOAT_ROUGHNESS, "its roughness (green)")                                                             \
    MAP(CLEARCOAT_NORMAL, "its normal")                                                                           \
    MAP(SHEEN, "sheen")                                                                                           \
    MAP(SHEEN_ROUGHNESS, "its roughness (alpha)")                                                                 \
    MAP(IRIDESCENCE, "iridescence (red)")                                                                         \
    MAP(IRIDESCENCE_THICKNESS, "thickness of its film (green)")                                                   \
    MAP(DIFFUSE_TRANSMISSION, "diffuse transmission (alpha)")                                                     \
    MAP(DIFFUSE_TRANSMISSION_COLOUR, "its colour")                                                                \
    MAP(ANISOTROPY, "anisotropy (red and green: direction from the tangent, -1 to 1; blue: strength)")

enum material_map {
#define MATERIAL_MAP_VALUE(NAME, words) MAP_##NAME,
    MATERIAL_MAPS(MATERIAL_MAP_VALUE)
#undef MATERIAL_MAP_VALUE
        MAP_COUNT
};

#endif
