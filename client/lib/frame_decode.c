/* SPDX-License-Identifier: MIT */
/* Decoding of a frame's colours, depth, normals and marks of sticking. */
#include "lib/frame_decode.h"

#include "lib/sticking.h"
#include "protocol/pixels/coarse_depth.h"
#include "protocol/pixels/inverse_depth.h"
#include "protocol/pixels/predicted.h"

#include <stdlib.h>
#include <string.h>
#include <turbojpeg.h>
#include <xxhash.h>
#include <zstd.h>

#define ATTACHMENT_PIXEL_BYTES 4u

uint32_t fl_bytes_per_pixel(enum protocol_pixel_format format)
{
    return (unsigned)format < PROTOCOL_PIXEL_FORMAT_COUNT ? protocol_pixel_format_bytes(format) : 0;
}

/* ---- colours ---- */

static size_t colours_come(const struct fl_encoded *encoded)
{
    return (size_t)encoded->come.of[PROTOCOL_FRAME_PART_COLOURS];
}

static bool decode_zstd(struct fl_frame *frame, const struct fl_encoded *encoded, struct fl_error *error)
{
    const size_t made =
        ZSTD_decompress(frame->pixels, frame->pixels_bytes, encoded->colours, colours_come(encoded));
    if (ZSTD_isError(made))
        return fl_error_set(error, FL_ERROR_PROTOCOL, "frame", "cannot be decompressed: %s",
                            ZSTD_getErrorName(made));
    if (made != frame->pixels_bytes)
        return fl_error_set(error, FL_ERROR_PROTOCOL, "frame", "it decompresses to %zu bytes, not %zu", made,
                            frame->pixels_bytes);
    return true;
}

static bool decode_predicted(const struct predicted_form *form, const uint8_t *encoded, size_t encoded_bytes,
                             uint8_t *pixels, struct fl_error *error)
{
    const struct predicted_result result = predicted_decode(form, encoded, encoded_bytes, pixels);
    if (result.status == PREDICTED_NO_MEMORY)
        return fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    return result.status == PREDICTED_DONE ||
           fl_error_set(error, FL_ERROR_PROTOCOL, "frame", "cannot be decompressed: %s", result.reason);
}

static bool decode_predicted_pixels(struct fl_frame *frame, const struct fl_encoded *encoded,
                                    struct fl_error *error)
{
    const struct predicted_form form = {.width = frame->width,
                                        .rows = frame->height * (uint32_t)__builtin_popcount(frame->layers),
                                        .pixel_bytes = fl_bytes_per_pixel(frame->format)};
    return decode_predicted(&form, encoded->colours, colours_come(encoded), frame->pixels, error);
}

static bool decode_whole_jpeg(struct fl_frame *frame, const uint8_t *jpeg, size_t bytes, struct fl_error *error)
{
    const tjhandle decoder = tjInitDecompress();
    if (!decoder)
        return fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    int width = 0, height = 0, subsampling = 0, colours = 0;
    bool good =
        tjDecompressHeader3(decoder, jpeg, (unsigned long)bytes, &width, &height, &subsampling, &colours) == 0;
    if (good && (width != (int)frame->width || height != (int)frame->height)) {
        fl_error_set(error, FL_ERROR_PROTOCOL, "frame", "a JPEG of %dx%d arrived, but %ux%u was expected", width,
                     height, frame->width, frame->height);
    } else {
        /* A hostile JPEG may have any number of scans, each of which costs time for all pixels. */
        good = good && tjDecompress2(decoder, jpeg, (unsigned long)bytes, frame->pixels, width, 0, height,
                                     TJPF_RGBA, TJFLAG_STOPONWARNING | TJFLAG_LIMITSCANS) == 0;
        if (!good)
            fl_error_set(error, FL_ERROR_PROTOCOL, "frame", "the JPEG is damaged: %s", tjGetErrorStr2(decoder));
    }
    good = good && error->code == FL_ERROR_NONE;
    tjDestroy(decoder);
    return good;
}

/* Decodes the first scans of a progressive JPEG, which lack only the end marker. */
static bool decode_jpeg(struct fl_frame *frame, const struct fl_encoded *encoded, struct fl_error *error)
{
    static const uint8_t end_of_image[] = {0xff, 0xd9};
    const size_t bytes = colours_come(encoded);
    if (bytes == encoded->all.of[PROTOCOL_FRAME_PART_COLOURS])
        return decode_whole_jpeg(frame, encoded->colours, bytes, error);
    uint8_t *jpeg = malloc(bytes + sizeof(end_of_image));
    if (!jpeg)
        return fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    memcpy(jpeg, encoded->colours, bytes);
    memcpy(jpeg + bytes, end_of_image, sizeof(end_of_image));
    const bool good = decode_whole_jpeg(frame, jpeg, bytes + sizeof(end_of_image), error);
    free(jpeg);
    return good;
}

static bool decode_pixels(struct fl_frame *frame, const struct fl_encoded *encoded, struct fl_error *error)
{
    if (!frame->pixels) /* the caller decodes it */
        return true;
    if (frame->encoding == PROTOCOL_ENCODING_JPEG)
        return decode_jpeg(frame, encoded, error);
    if (frame->encoding == PROTOCOL_ENCODING_RAW && encoded->colours != frame->pixels)
        memcpy(frame->pixels, encoded->colours, frame->pixels_bytes);
    if (frame->encoding == PROTOCOL_ENCODING_ZSTD && !decode_zstd(frame, encoded, error))
        return false;
    if (frame->encoding == PROTOCOL_ENCODING_PREDICTED && !decode_predicted_pixels(frame, encoded, error))
        return false;
    if (XXH3_64bits(frame->pixels, frame->pixels_bytes) != frame->digest)
        return fl_error_set(error, FL_ERROR_PROTOCOL, "frame.digest",
                            "the pixels of frame %u differ from those that were rendered", frame->frame);
    frame->digest_checked = true;
    return true;
}

/* ---- attachments ---- */

/* The result is malloc'ed; NULL on failure. */
static void *decode_attachment(const struct fl_frame *frame, const uint8_t *encoded, uint64_t bytes,
                               uint32_t pixel_bytes, struct fl_error *error)
{
    const struct predicted_form form = {frame->width, frame->height, pixel_bytes};
    uint8_t *made = malloc((size_t)frame->width * frame->height * pixel_bytes);
    if (!made)
        fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    if (made && decode_predicted(&form, encoded, (size_t)bytes, made, error))
        return made;
    free(made);
    return NULL;
}

/* The result is malloc'ed, with an error of at most *off steps; NULL on failure. */
static uint16_t *decode_coarse_depth(const struct fl_frame *frame, const struct fl_encoded *encoded, uint16_t *off,
                                     struct fl_error *error)
{
    const size_t bytes = (size_t)encoded->come.of[PROTOCOL_FRAME_PART_COARSE_DEPTH];
    uint16_t *made = malloc((size_t)frame->width * frame->height * sizeof(*made));
    const struct predicted_result result =
        made ? coarse_depth_decode(frame->width, frame->height, encoded->coarse_depth, bytes, made, off)
             : (struct predicted_result){.status = PREDICTED_NO_MEMORY};
    if (result.status == PREDICTED_DONE)
        return made;
    if (result.status == PREDICTED_NO_MEMORY)
        fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    else
        fl_error_set(error, FL_ERROR_PROTOCOL, "frame", "coarse depths cannot be decompressed: %s", result.reason);
    free(made);
    return NULL;
}

static float *decode_depth(struct fl_frame *frame, const struct fl_encoded *encoded, struct fl_error *error)
{
    const size_t count = (size_t)frame->width * frame->height;
    const uint64_t bytes = encoded->come.of[PROTOCOL_FRAME_PART_DEPTH];
    uint16_t off = 0;
    if (!(frame->depth_step > 0.0f))
        return decode_attachment(frame, encoded->depth, bytes, ATTACHMENT_PIXEL_BYTES, error);
    uint16_t *rounded = bytes > 0 ? decode_attachment(frame, encoded->depth, bytes, sizeof(*rounded), error)
                                  : decode_coarse_depth(frame, encoded, &off, error);
    float *depth = rounded ? malloc(count * sizeof(*depth)) : NULL;
    if (depth)
        inverse_depth_restore(rounded, count, frame->depth_step, depth);
    else if (rounded)
        fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    free(rounded);
    frame->depth_is_coarse = bytes == 0;
    frame->depth_error = ((float)off + 0.5f) * frame->depth_step;
    return depth;
}

static bool decode_attachments(struct fl_frame *frame, const struct fl_encoded *encoded, struct fl_error *error)
{
    const uint64_t *bytes = encoded->come.of;
    const bool has_depth = bytes[PROTOCOL_FRAME_PART_DEPTH] > 0 || bytes[PROTOCOL_FRAME_PART_COARSE_DEPTH] > 0;
    if (has_depth && !(frame->depth = decode_depth(frame, encoded, error)))
        return false;
    if (bytes[PROTOCOL_FRAME_PART_NORMALS] > 0 &&
        !(frame->normals = decode_attachment(frame, encoded->normals, bytes[PROTOCOL_FRAME_PART_NORMALS],
                                             ATTACHMENT_PIXEL_BYTES, error)))
        return false;
    if (bytes[PROTOCOL_FRAME_PART_STICKING] > 0)
        frame->sticking = fl_sticking_decode(encoded->sticking, bytes[PROTOCOL_FRAME_PART_STICKING], frame->width,
                                             frame->height, error);
    return frame->sticking || bytes[PROTOCOL_FRAME_PART_STICKING] == 0;
}

bool fl_frame_decode(struct fl_frame *frame, const struct fl_encoded *encoded, struct fl_error *error)
{
    *error = (struct fl_error){0};
    return decode_pixels(frame, encoded, error) && decode_attachments(frame, encoded, error);
}
