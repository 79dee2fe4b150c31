/* SPDX-License-Identifier: MIT */
/* The format of a model file, recognised by the ending of its name, or else by its first bytes. */
#ifndef FARLIGHT_IMPORT_FORMAT_H
#define FARLIGHT_IMPORT_FORMAT_H

#include "import/assimp/library.h"

#include <stdbool.h>
#include <stddef.h>

#define FORMAT_REASON_BYTES 400

enum format_reader {
    FORMAT_UNKNOWN,
    FORMAT_GLTF,
    FORMAT_OBJ,
    FORMAT_NFF,
    FORMAT_3MF,
    FORMAT_ASSIMP,
};

struct format {
    enum format_reader reader;
    const struct assimp_format *assimp; /* FORMAT_ASSIMP only */
};

/* Recognises a format by a name's ending alone. */
struct format format_of_name(const char *name);
/* Recognises a format by name and bytes; a GLB file may have any name. */
struct format format_of(const char *name, const unsigned char *bytes, size_t size_bytes);
/* Explains why a file of unknown format is not read, with advice. `format`: the user's choice, or NULL. */
void format_explain_unknown(const char *name, const char *format, const unsigned char *bytes, size_t size_bytes,
                            char out[FORMAT_REASON_BYTES]);

#endif
