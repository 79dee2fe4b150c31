/* SPDX-License-Identifier: MIT */
/* The formats of Assimp, and loading of its module. */
#include "library.h"
#include "helper/module.h"

#include <string.h>
#include <strings.h>

/* Formats that the library's version in Debian 12 reads well. STL files of printers and scanners have layers
 * along z, and do not state their unit. */
static const struct assimp_format formats[] = {
    {.ending = ".3ds", .name = "3DS", .metres = 1, .colours_are_srgb = true},
    {.ending = ".ac", .name = "AC3D", .metres = 1},
    {.ending = ".dae", .name = "COLLADA", .metres = 1},
    {.ending = ".fbx", .name = "FBX", .metres = 0.01},
    {.ending = ".off", .name = "OFF", .metres = 1},
    {.ending = ".ply", .name = "PLY", .metres = 1},
    {.ending = ".stl", .name = "STL", .z_up = true, .metres = 1, .has_facets = true},
    {.ending = ".x3d", .name = "X3D", .metres = 1},
};

#define FORMAT_COUNT (sizeof(formats) / sizeof(formats[0]))

const struct assimp_format *assimp_format_of(const char *name)
{
    const char *dot = strrchr(name, '.');

    for (size_t i = 0; dot && i < FORMAT_COUNT; i++)
        if (strcasecmp(dot, formats[i].ending) == 0)
            return &formats[i];
    return NULL;
}

const struct assimp_format *assimp_format_at(size_t number)
{
    return number < FORMAT_COUNT ? &formats[number] : NULL;
}

#pragma weak assimp_library
/* NULL, unless the module is linked into the program itself. */
static const struct assimp_library *library = &assimp_library;

const struct assimp_library *assimp_load(char reason[ASSIMP_REASON_BYTES])
{
    if (!library)
        library = module_load("farlight-assimp.so", "assimp_library", reason, ASSIMP_REASON_BYTES);
    return library;
}
