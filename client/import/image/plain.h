/* SPDX-License-Identifier: MIT */
/* Decoding of PNG and JPEG by libpng and libjpeg-turbo, and of HDR environments by stb. Nearly all scenes have
 * only these, and loading OpenImageIO takes longer than decoding most of them. Texels equal OpenImageIO's. */
#ifndef FARLIGHT_IMPORT_IMAGE_PLAIN_H
#define FARLIGHT_IMPORT_IMAGE_PLAIN_H

#include "texture.h"

/* Decodes all images of these formats, by their first bytes, with two threads if there are several; others are
 * left unchanged. */
void texture_plain_decode(struct texture_job *jobs, size_t count);
/* Decodes an HDR image like texture_reader.decode_environment. False: it is not one, or stb cannot read it. */
bool texture_plain_decode_environment(struct texture_job *job);

#endif
