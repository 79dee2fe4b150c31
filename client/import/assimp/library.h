/* SPDX-License-Identifier: MIT */
/* Formats that are read through Assimp. The library is in a module, like the one of image/texture.h, because
 * linking it would slow down every import; only its structures are known here. */
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
    bool z_up;             /* default if files do not state it or the library does not pass it on */
    double metres;         /* default length of a unit */
    bool has_facets;       /* each triangle has its own corners and normal, which hold no further information */
    bool colours_are_srgb; /* colours of materials */
};

/* Finds a format by the ending of a file's name; NULL: none. */
const struct assimp_format *assimp_format_of(const char *name);
/* The format with this number; NULL after the last one. */
const struct assimp_format *assimp_format_at(size_t number);

/* Functions that the module exports under the name `assimp_library`. They neither throw nor open files. */
struct assimp_library {
    /* Reads a model; only the ending of `name` matters. *keep owns the scene. NULL: `reason` is the library's
     * message. */
    const struct aiScene *(*read)(const char *name, const struct assimp_format *format, const unsigned char *bytes,
                                  size_t size_bytes, void **keep, char reason[ASSIMP_REASON_BYTES]);
    void (*release)(void *keep);
};
extern const struct assimp_library assimp_library __attribute__((visibility("default")));

/* Loads the module, once. NULL: failure, with `reason`. */
const struct assimp_library *assimp_load(char reason[ASSIMP_REASON_BYTES]);

#ifdef __cplusplus
}
#endif

#endif
