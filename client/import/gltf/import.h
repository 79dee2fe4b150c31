/* SPDX-License-Identifier: MIT */
/* The reader of glTF 2.0, JSON or binary: model/scene.h has the duties of readers. */
#ifndef FARLIGHT_IMPORT_GLTF_IMPORT_H
#define FARLIGHT_IMPORT_GLTF_IMPORT_H

#include "import/model/files.h"
#include "import/model/scene.h"

#ifdef __cplusplus
extern "C" {
#endif

/* `bytes` has a NUL behind it, as files.h promises. */
bool gltf_import(struct import_scene *scene, struct files *files, const unsigned char *bytes, size_t size_bytes);

#ifdef __cplusplus
}
#endif

#endif
