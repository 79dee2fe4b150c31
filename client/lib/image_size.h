/* SPDX-License-Identifier: MIT */
/* Whether an image file exists, and the size of its picture, from its first and last bytes. */
#ifndef FARLIGHT_CLIENT_LIB_IMAGE_SIZE_H
#define FARLIGHT_CLIENT_LIB_IMAGE_SIZE_H

#include <stdbool.h>
#include <stdint.h>

/* PNG, JPEG, EXR (one part, scan lines), HDR, WebP, TIFF (strips) and GIF, by their content. False: there is no
 * such file, it cannot be read, is none of these, or is cut short as far as can be seen without decoding it (an
 * HDR file does not show it). */
bool fl_image_size(const char *path, uint32_t *width, uint32_t *height);

#endif
