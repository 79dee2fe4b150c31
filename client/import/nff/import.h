/* SPDX-License-Identifier: MIT */
/* The reader of the Neutral File Format of the Standard Procedural Databases: model/scene.h has the duties of
 * readers. */
#ifndef FARLIGHT_IMPORT_NFF_IMPORT_H
#define FARLIGHT_IMPORT_NFF_IMPORT_H

#include "import/model/scene.h"

bool nff_import(struct import_scene *scene, const unsigned char *bytes, size_t size_bytes);

#endif
