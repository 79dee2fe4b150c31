/* SPDX-License-Identifier: MIT */
/* JPEG, baseline or progressive, through libjpeg-turbo. Alpha is dropped. Planes, which have half the chroma, are
 * accepted where the JPEG has no more. */
#include "encode/encoder.h"

#include <limits.h>
#include <turbojpeg.h>

/* Quality from which fine detail matters, which halved chroma blurs. */
#define QUALITY_FULL_CHROMA 90
/* Limit of the format for an edge. */
#define EDGE_MAX 65500

static int subsampling(unsigned quality)
{
    return quality >= QUALITY_FULL_CHROMA ? TJSAMP_444 : TJSAMP_420;
}

static enum ycbcr jpeg_takes(unsigned quality)
{
    return subsampling(quality) == TJSAMP_420 ? YCBCR_JPEG : YCBCR_NONE;
}

static size_t jpeg_bound(const struct picture *picture)
{
    if (picture->bytes_per_pixel != 4 || picture->width > EDGE_MAX || picture->height > EDGE_MAX)
        return 0;
    /* Maximum over both kinds of chroma, whatever the quality: tiny pictures have more padding where chroma is
     * halved. */
    unsigned long full = tjBufSize((int)picture->width, (int)picture->height, TJSAMP_444);
    unsigned long halved = tjBufSize((int)picture->width, (int)picture->height, TJSAMP_420);
    return full == ULONG_MAX || halved == ULONG_MAX ? 0 : full > halved ? full : halved;
}

/* Compresses a picture; returns libjpeg-turbo's result, 0 for success. */
static int compress(tjhandle handle, const struct picture *picture, uint8_t *out, unsigned long *bytes,
                    int quality)
{
    int width = (int)picture->width, height = (int)picture->height, chroma = subsampling((unsigned)quality);
    int flags = TJFLAG_NOREALLOC | (picture->in_scans ? TJFLAG_PROGRESSIVE : 0);
    if (picture->ycbcr == YCBCR_NONE)
        return tjCompress2(handle, picture->pixels, width, 0, height, TJPF_RGBX, &out, bytes, chroma, quality,
                           flags);
    const struct ycbcr_planes *planes = &picture->planes;
    const unsigned char *starts[] = {planes->y, planes->cb, planes->cr};
    int c_stride = (int)planes->c_stride_bytes, strides[] = {(int)planes->y_stride_bytes, c_stride, c_stride};
    return tjCompressFromYUVPlanes(handle, starts, width, strides, height, chroma, &out, bytes, quality, flags);
}

static size_t jpeg_encode(const struct picture *picture, unsigned quality, uint8_t *out, size_t capacity,
                          struct error *error)
{
    int width = (int)picture->width, height = (int)picture->height;
    int clamped = quality < 1 ? 1 : quality > 100 ? 100 : (int)quality;
    int chroma = subsampling((unsigned)clamped);
    if (capacity < tjBufSize(width, height, chroma)) {
        error_set(error, ERROR_INTERNAL, "encoding", "%zu bytes are too few for a JPEG of %dx%d", capacity, width,
                  height);
        return 0;
    }
    tjhandle handle = tjInitCompress();
    if (!handle) {
        error_set(error, ERROR_OUT_OF_MEMORY, "encoding", "libjpeg-turbo: %s", tjGetErrorStr2(NULL));
        return 0;
    }
    unsigned long used = capacity;
    if (compress(handle, picture, out, &used, clamped)) {
        error_set(error, ERROR_INTERNAL, "encoding", "libjpeg-turbo: %s", tjGetErrorStr2(handle));
        used = 0;
    }
    tjDestroy(handle);
    return used;
}

const struct encoder_impl encoder_jpeg_impl = {
    .name = "jpeg", .takes = jpeg_takes, .bound = jpeg_bound, .encode = jpeg_encode};
