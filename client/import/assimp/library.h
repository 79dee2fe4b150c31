/* SPDX-License-Identifier: MIT */
/* Formats that are read through Assimp. The library is in a module, as that of image/texture.h is, because linking
 * it would make every import slower; only its structures are known here. */
#ifndef FARLIGHT_IMPORT_ASSIMP_LIBRARY_H
#define FARLIGHT_IMPORT_ASSIMP_LIBRARY_H

#include <stdbool.h>
#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

struct aiScene;

#define ASSIMP_REASON_BYTES 300

struct assimp_format {
    const char *ending; /* ".ply" */
    const char *name;
    bool z_up;             /* where files do not say it, or the library does not pass it on */
    double metres;         /* of a unit, likewise */
    bool has_facets;       /* every triangle has its own corners and normal, which say nothing more */
    bool colours_are_srgb; /* of materials */
};

/* By the ending of a file's name; NULL: it is none of them. */
const struct assimp_format *assimp_format_of(const char *name);
/* By number, NULL behind the last one. */
const struct assimp_format *assimp_format_at(size_t number);

/* What the module exports, under the name `assimp_library`. Nothing throws, and no file is opened. */
struct assimp_library {
    /* `name` is only looked at for its ending. *keep owns the scene. NULL: `reason` is what the library says. */
    const struct aiScene *(*read)(const char *name, const struct assimp_format *format, const unsigned char *bytes,
                                  size_t size_bytes, void **keep, char reason[ASSIMP_REASON_BYTES]);
    void (*release)(void *keep);
};
extern const struct assimp_library assimp_library __attribute__((visibility("default")));

/* Loads the module, once. NULL: it cannot be loaded; `reason` says why. */
const struct assimp_library *assimp_load(char reason[ASSIMP_REASON_BYTES]);

#ifdef __cplusplus
}
#endif

#endif
