/* SPDX-License-Identifier: MIT */
/* Images to texels. PNG and JPEG are decoded by plain.h; the rest by a module (module.cpp), because
 * loading OpenImageIO with its libraries takes longer than importing most models. */
#ifndef FARLIGHT_IMPORT_IMAGE_TEXTURE_H
#define FARLIGHT_IMPORT_IMAGE_TEXTURE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

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
    uint32_t
        reduced; /* each texel is the mean of so many by so many of the file, as it is too large; 0 or 1: of one */
    bool has_alpha;
    char reason[200];
};

#define TEXTURE_KTX2_REMEDY                                                                                       \
    "convert its textures to PNG, as 'gltf-transform ktxdecompress IN OUT' does, or to WebP or JPEG"

/* Images are reduced to this, by powers of 2, but none beyond what can be read within a minute. */
#define TEXTURE_EDGE_MAX 16384u
#define TEXTURE_TEXELS_MAX (UINT64_C(1) << 26)
#define TEXTURE_FILE_EDGE_MAX 65536u
#define TEXTURE_FILE_TEXELS_MAX (UINT64_C(1) << 30)
/* The factor of an image of a file; 0: it is too large for that, and the job says so. */
static inline uint32_t texture_reduction(struct texture_job *job, uint64_t width, uint64_t height)
{
    uint32_t factor = 1;
    if (width < 1 || height < 1)
        return (void)snprintf(job->reason, sizeof(job->reason), "is not a flat image"), 0u;
    if (width > TEXTURE_FILE_EDGE_MAX || height > TEXTURE_FILE_EDGE_MAX ||
        width * height > TEXTURE_FILE_TEXELS_MAX)
        return (void)snprintf(job->reason, sizeof(job->reason),
                              "is %llu x %llu texels; up to %u in one direction and %llu in all are read",
                              (unsigned long long)width, (unsigned long long)height, TEXTURE_FILE_EDGE_MAX,
                              (unsigned long long)TEXTURE_FILE_TEXELS_MAX),
               0u;
    while ((width + factor - 1) / factor > TEXTURE_EDGE_MAX || (height + factor - 1) / factor > TEXTURE_EDGE_MAX ||
           width * height / factor / factor > TEXTURE_TEXELS_MAX)
        factor *= 2;
    return factor;
}
/* "is 16384 x 16384 texels, too large: it is shown at 8192 x 8192", for a note. */
void texture_explain_reduction(const struct texture_job *job, char text[200]);

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
