/* SPDX-License-Identifier: MIT */
/* The reader of the 3D Manufacturing Format. As those of formats.h. */
#ifndef FARLIGHT_IMPORT_THREEMF_H
#define FARLIGHT_IMPORT_THREEMF_H

#include "import.h"

#ifdef __cplusplus
extern "C" {
#endif

bool threemf_import(struct import_scene *scene, const unsigned char *bytes, size_t size_bytes);

#ifdef __cplusplus
}
#endif

#endif
