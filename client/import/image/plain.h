/* SPDX-License-Identifier: MIT */
/* PNG and JPEG to texels, by libpng and libjpeg-turbo, and HDR environments, by stb: what nearly all scenes have,
 * without OpenImageIO, whose loading takes longer than decoding most of them. The texels are those that
 * OpenImageIO gives. */
#ifndef FARLIGHT_IMPORT_IMAGE_PLAIN_H
#define FARLIGHT_IMPORT_IMAGE_PLAIN_H

#include "texture.h"

/* Decodes all that are, by their first bytes, with two threads if there are several; leaves the others as they
 * are. */
void texture_plain_decode(struct texture_job *jobs, size_t count);
/* Of an HDR image, texels as texture_reader.decode_environment has them. False: it is none, or stb cannot read it.
 */
bool texture_plain_decode_environment(struct texture_job *job);

#endif
