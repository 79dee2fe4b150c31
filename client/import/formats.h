/* SPDX-License-Identifier: MIT */
/* The readers of the formats: bytes of the model file to edits of the scene. Each returns false, with the scene
 * failed, if the model cannot be used; parts that merely cannot be shown become notes. None throws, none reads a
 * file but through `files`, and every index, count and number of the input is checked before it is used. */
#ifndef FARLIGHT_IMPORT_FORMATS_H
#define FARLIGHT_IMPORT_FORMATS_H

#include "assimp.h"
#include "files.h"
#include "import.h"

#ifdef __cplusplus
extern "C" {
#endif

/* glTF 2.0, JSON or binary. `bytes` has a NUL behind it, as files.h promises. */
bool gltf_import(struct import_scene *scene, struct files *files, const unsigned char *bytes, size_t size_bytes);
/* Wavefront OBJ with its MTL files. */
bool obj_import(struct import_scene *scene, struct files *files, const unsigned char *bytes, size_t size_bytes);
/* Neutral File Format of the Standard Procedural Databases. */
bool nff_import(struct import_scene *scene, const unsigned char *bytes, size_t size_bytes);
/* Any of assimp.h's formats. */
bool assimp_import(struct import_scene *scene, struct files *files, const struct assimp_format *format,
                   const unsigned char *bytes, size_t size_bytes);

#ifdef __cplusplus
}
#endif

#endif
