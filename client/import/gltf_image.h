/* SPDX-License-Identifier: MIT */
/* Which images a glTF file has, before anything is parsed: the module of those that are neither PNG nor JPEG is to
 * be loaded by then (texture.h). */
#ifndef FARLIGHT_IMPORT_GLTF_IMAGE_H
#define FARLIGHT_IMPORT_GLTF_IMAGE_H

#include "files.h"

/* Whether some image may be neither PNG nor JPEG: by the ending or MIME type that the file states, or, as many
 * files state another than it is, by the image's first bytes, in a data URI, in the binary part or beside the
 * model. */
bool gltf_may_have_other_images(const struct files *files, const unsigned char *bytes, size_t size_bytes);

#endif
