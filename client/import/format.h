/* SPDX-License-Identifier: MIT */
/* The format of a model file: by the ending of its name, and where that says nothing by its first bytes. */
#ifndef FARLIGHT_IMPORT_FORMAT_H
#define FARLIGHT_IMPORT_FORMAT_H

#include "assimp.h"

#include <stdbool.h>
#include <stddef.h>

enum format_reader {
    FORMAT_UNKNOWN,
    FORMAT_GLTF,
    FORMAT_OBJ,
    FORMAT_NFF,
    FORMAT_AFF,
    FORMAT_ASSIMP,
};

struct format {
    enum format_reader reader;
    const struct assimp_format *assimp; /* of FORMAT_ASSIMP */
};

/* By a name's ending alone. */
struct format format_of_name(const char *name);
/* A GLB file is one under any name. */
struct format format_of(const char *name, const unsigned char *bytes, size_t size_bytes);
/* By the bytes alone, for nothing may be parsed yet. */
bool format_may_name_images(const struct format *format, const unsigned char *bytes, size_t size_bytes);
/* The endings of all formats, for people. */
const char *format_endings(char out[256]);

#endif
