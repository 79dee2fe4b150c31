/* SPDX-License-Identifier: MIT */
#include "assimp.h"
#include "helper/module.h"

#include <stdio.h>
#include <string.h>
#include <strings.h>

/* Of what the library can read, the formats that its version in Debian 12 reads well. STL files of
 * printers and scanners have their layers along z, and do not say their unit. */
static const struct assimp_format formats[] = {
    {.ending = ".3ds", .name = "3DS", .metres = 1, .may_name_images = true, .colours_are_srgb = true},
    {.ending = ".ac", .name = "AC3D", .metres = 1, .may_name_images = true},
    {.ending = ".dae", .name = "COLLADA", .metres = 1, .may_name_images = true},
    {.ending = ".fbx", .name = "FBX", .metres = 0.01, .may_name_images = true},
    {.ending = ".off", .name = "OFF", .metres = 1},
    {.ending = ".ply", .name = "PLY", .metres = 1, .may_name_images = true},
    {.ending = ".stl", .name = "STL", .z_up = true, .metres = 1, .has_facets = true},
    {.ending = ".x3d", .name = "X3D", .metres = 1, .may_name_images = true},
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

bool assimp_may_name_images(const struct assimp_format *format, const unsigned char *bytes, size_t size_bytes)
{
    static const char *const endings[] = {"png", "jpg", "jpe", "tga", "bmp", "tif", "gif",
                                          "hdr", "exr", "web", "dds", "psd", "ppm"};
    const unsigned char *at = bytes, *const end = bytes + size_bytes;

    while (format->may_name_images && (at = memchr(at, '.', (size_t)(end - at)))) {
        at++;
        for (size_t i = 0; i < sizeof(endings) / sizeof(endings[0]); i++)
            if (strncasecmp((const char *)at, endings[i], 3) == 0)
                return true;
    }
    return false;
}

#pragma weak assimp_library
/* NULL, unless the module is linked to the program itself. */
static const struct assimp_library *library = &assimp_library;
static char why_none[ASSIMP_REASON_BYTES] = "the module that reads this format is not loaded";

void assimp_load(void)
{
    if (!library)
        library = module_load("farlight-assimp.so", "assimp_library", why_none, sizeof(why_none));
}

const struct assimp_library *assimp_loaded(char reason[ASSIMP_REASON_BYTES])
{
    if (!library)
        snprintf(reason, ASSIMP_REASON_BYTES, "%s", why_none);
    return library;
}
