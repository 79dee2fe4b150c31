/* SPDX-License-Identifier: MIT */
/* The reader of the 3D Manufacturing Format: model/scene.h has the duties of readers. */
#ifndef FARLIGHT_IMPORT_THREEMF_IMPORT_H
#define FARLIGHT_IMPORT_THREEMF_IMPORT_H

#include "import/model/scene.h"

#ifdef __cplusplus
extern "C" {
#endif

bool threemf_import(struct import_scene *scene, const unsigned char *bytes, size_t size_bytes);

#ifdef __cplusplus
}
#endif

#endif
