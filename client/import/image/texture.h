/* SPDX-License-Identifier: MIT */
/* Decoding of images to texels: PNG and JPEG by plain.h, the rest by a module (module.cpp), because loading
 * OpenImageIO with its libraries takes longer than importing most models. */
#ifndef FARLIGHT_IMPORT_IMAGE_TEXTURE_H
#define FARLIGHT_IMPORT_IMAGE_TEXTURE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#ifdef __cplusplus
extern "C" {
#endif

/* An image to decode. */
struct texture_job {
    const unsigned char *bytes; /* the encoded file; not owned; NULL: the result stays unchanged */
    size_t size_bytes;
    bool srgb; /* true for sRGB-encoded texels: matters for float images only, which are linear */
    /* The result. */
    unsigned char *texels; /* malloc'd, 4 bytes each, rows from the top; NULL: `reason` is set */
    uint32_t width, height;
    uint32_t
        /* Side of the square of the file's texels whose mean a texel is, for too large images; 0 or 1: not
         * reduced */
        reduced;
    bool has_alpha;
    char reason[200];
};

#define TEXTURE_KTX2_REMEDY                                                                                       \
    "convert its textures to PNG, as 'gltf-transform ktxdecompress IN OUT' does, or to WebP or JPEG"

/* Limits to which images are reduced, by powers of 2; images that cannot be read within a minute are refused. */
#define TEXTURE_EDGE_MAX 16384u
#define TEXTURE_TEXELS_MAX (UINT64_C(1) << 26)
#define TEXTURE_FILE_EDGE_MAX 65536u
#define TEXTURE_FILE_TEXELS_MAX (UINT64_C(1) << 30)
/* The factor by which an image is reduced; 0: it is too large for that, and the job has the reason. */
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
/* Writes "is 16384 x 16384 texels, too large: it is shown at 8192 x 8192", for a note. */
void texture_explain_reduction(const struct texture_job *job, char text[200]);

/* Functions that the module exports under the name `texture_reader`. */
struct texture_reader {
    /* Decodes all jobs that have neither texels nor a reason, with two threads if there are several. Never
     * fails as a whole. */
    void (*decode)(struct texture_job *jobs, size_t count);
    /* Decodes to texels of 4 half floats, linear light; alpha is 0. */
    void (*decode_environment)(struct texture_job *job);
};
extern const struct texture_reader texture_reader __attribute__((visibility("default")));

/* Name of the module, which the first image that needs it loads. */
#define TEXTURE_MODULE "farlight-textures.so"

/* Decode with plain.h and the module. If the module cannot be loaded, each image that needs it has this as its
 * reason. */
void texture_decode(struct texture_job *jobs, size_t count);
void texture_decode_environment(struct texture_job *job);
/* Makes the replacement of a missing image: 2x2 texels, magenta and black. NULL: out of memory. */
unsigned char *texture_marker(void);

#ifdef __cplusplus
}
#endif

#endif
