/* SPDX-License-Identifier: MIT */
/* Images to texels. PNG and JPEG are decoded by texture_plain.h; the rest by a module (texture.cpp), because
 * loading OpenImageIO with its libraries takes longer than importing most models. */
#ifndef FARLIGHT_IMPORT_TEXTURE_H
#define FARLIGHT_IMPORT_TEXTURE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* One image to decode. */
struct texture_job {
    const unsigned char *bytes; /* the encoded file; not owned; NULL: the result stays as it is */
    size_t size_bytes;
    bool srgb; /* texels are wanted sRGB-encoded: matters for float images only, which are linear */
    /* Result. */
    unsigned char *texels; /* malloc'd, 4 bytes each, rows from the top; NULL: `reason` says why */
    uint32_t width, height;
    bool has_alpha;
    char reason[200];
};

#define TEXTURE_KTX2_REMEDY                                                                                       \
    "convert its textures to PNG, as 'gltf-transform ktxdecompress IN OUT' does, or to WebP or JPEG"

/* What the module exports, under the name `texture_reader`. */
struct texture_reader {
    /* Decodes all that have neither texels nor a reason, with two threads if there are several. Never fails as a
     * whole. */
    void (*decode)(struct texture_job *jobs, size_t count);
    /* Texels of 4 half floats, linear light; alpha is 0. */
    void (*decode_environment)(struct texture_job *job);
};
extern const struct texture_reader texture_reader __attribute__((visibility("default")));

/* The module, which is in this file, is loaded by the first image that needs it. */
#define TEXTURE_MODULE "farlight-textures.so"

/* As the module's. If it cannot be loaded, that is the reason of every image that needs it. */
void texture_decode(struct texture_job *jobs, size_t count);
void texture_decode_environment(struct texture_job *job);
/* The replacement of a missing image: 2x2 texels, magenta and black. NULL: out of memory. */
unsigned char *texture_marker(void);

#ifdef __cplusplus
}
#endif

#endif
