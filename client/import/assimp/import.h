/* SPDX-License-Identifier: MIT */
/* The reader of library.h's formats: model/scene.h has the duties of readers. */
#ifndef FARLIGHT_IMPORT_ASSIMP_IMPORT_H
#define FARLIGHT_IMPORT_ASSIMP_IMPORT_H

#include "library.h"
#include "import/model/files.h"
#include "import/model/scene.h"

#ifdef __cplusplus
extern "C" {
#endif

bool assimp_import(struct import_scene *scene, struct files *files, const struct assimp_format *format,
                   const unsigned char *bytes, size_t size_bytes);

#ifdef __cplusplus
}
#endif

#endif
