/* SPDX-License-Identifier: MIT */
/* The size of an image file and whether it is complete, from its first and last bytes. */
#ifndef FARLIGHT_CLIENT_LIB_IMAGE_SIZE_H
#define FARLIGHT_CLIENT_LIB_IMAGE_SIZE_H

#include <stdbool.h>
#include <stdint.h>

/* Recognises PNG, JPEG, EXR (one part, scan lines), HDR, WebP, TIFF (strips) and GIF by their content. False:
 * there is no such file, it cannot be read, has another format, or is cut short as far as the file shows
 * without decoding (an HDR file does not). */
bool fl_image_size(const char *path, uint32_t *width, uint32_t *height);

#endif
