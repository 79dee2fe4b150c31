/* SPDX-License-Identifier: MIT */
/* The reader of Wavefront OBJ with its MTL files: model/scene.h has the duties of readers. */
#ifndef FARLIGHT_IMPORT_OBJ_IMPORT_H
#define FARLIGHT_IMPORT_OBJ_IMPORT_H

#include "import/model/files.h"
#include "import/model/scene.h"

#ifdef __cplusplus
extern "C" {
#endif

bool obj_import(struct import_scene *scene, struct files *files, const unsigned char *bytes, size_t size_bytes);

#ifdef __cplusplus
}
#endif

#endif
