/* SPDX-License-Identifier: MIT */
/* Encoding of JPEG files with comment and Exif. */
#include "jpeg_encode.h"
#include "protocol/version.h"

#include <libexif/exif-data.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <turbojpeg.h>

#define MARKER_COMMENT 0xfe
#define MARKER_EXIF 0xe1
#define MARKER_HEAD_BYTES 4u
#define SEGMENT_BYTES_MAX (65535u - 2)
/* Start of image and the JFIF segment; further segments may follow them. */
#define START_BYTES 20u

static bool fail(char *reason, size_t reason_bytes, const char *text)
{
    snprintf(reason, reason_bytes, "%s", text);
    return false;
}

/* ---- Exif ---- */

/* False: out of memory. */
static bool add_text(ExifData *exif, ExifTag tag, const char *text)
{
    const size_t count = strlen(text) + 1;
    ExifEntry *entry = count > 1 ? exif_entry_new() : NULL;
    if (!entry)
        return count == 1;
    entry->tag = tag;
    entry->format = EXIF_FORMAT_ASCII;
    entry->data = malloc(count); /* malloc, because libexif frees it */
    if (entry->data) {
        memcpy(entry->data, text, count);
        entry->components = count;
        entry->size = (unsigned)count;
        exif_content_add_entry(exif->ifd[EXIF_IFD_0], entry);
    }
    const bool added = entry->data != NULL;
    exif_entry_unref(entry);
    return added;
}

/* The caller frees *bytes. False: out of memory. */
static bool make_exif(const struct jpeg *jpeg, unsigned char **bytes, unsigned *count)
{
    ExifData *exif = exif_data_new();
    if (!exif)
        return false;
    exif_data_set_byte_order(exif, EXIF_BYTE_ORDER_INTEL);
    if (add_text(exif, EXIF_TAG_IMAGE_DESCRIPTION, jpeg->description) &&
        add_text(exif, EXIF_TAG_SOFTWARE, "farlight " FARLIGHT_VERSION) &&
        add_text(exif, EXIF_TAG_DATE_TIME, jpeg->date))
        exif_data_save_data(exif, bytes, count);
    exif_data_unref(exif);
    return *bytes != NULL;
}

/* ---- the file ---- */

/* Size of a segment; contents that are too long for a segment are omitted. */
static size_t segment_bytes(size_t count)
{
    return count > 0 && count <= SEGMENT_BYTES_MAX ? MARKER_HEAD_BYTES + count : 0;
}

static uint8_t *put_segment(uint8_t *at, uint8_t marker, const void *bytes, size_t count)
{
    if (segment_bytes(count) == 0)
        return at;
    const size_t length = count + 2;
    const uint8_t head[MARKER_HEAD_BYTES] = {0xff, marker, (uint8_t)(length >> 8), (uint8_t)length};
    memcpy(at, head, sizeof(head));
    memcpy(at + sizeof(head), bytes, count);
    return at + sizeof(head) + count;
}

/* Inserts comment and Exif into the coded picture. */
static bool join(const struct jpeg *jpeg, const uint8_t *coded, size_t coded_bytes, uint8_t **file,
                 size_t *file_bytes)
{
    const size_t comment_bytes = strlen(jpeg->description);
    unsigned char *exif = NULL;
    unsigned exif_bytes = 0;
    uint8_t *made = NULL;
    if (make_exif(jpeg, &exif, &exif_bytes))
        made = malloc(coded_bytes + segment_bytes(comment_bytes) + segment_bytes(exif_bytes));
    if (made) {
        memcpy(made, coded, START_BYTES);
        uint8_t *at = put_segment(made + START_BYTES, MARKER_COMMENT, jpeg->description, comment_bytes);
        at = put_segment(at, MARKER_EXIF, exif, exif_bytes);
        memcpy(at, coded + START_BYTES, coded_bytes - START_BYTES);
        *file = made;
        *file_bytes = (size_t)(at - made) + coded_bytes - START_BYTES;
    }
    free(exif);
    return made;
}

static bool encode_with(tjhandle handle, const struct jpeg *jpeg, uint8_t **file, size_t *file_bytes, char *reason,
                        size_t reason_bytes)
{
    const struct raster *raster = &jpeg->raster;
    unsigned char *coded = NULL;
    unsigned long coded_bytes = 0;
    const int packed = tjCompress2(handle, raster->pixels, (int)raster->width, 0, (int)raster->height,
                                   raster->channels == 4 ? TJPF_RGBX : TJPF_RGB, &coded, &coded_bytes, TJSAMP_420,
                                   (int)jpeg->quality, TJFLAG_ACCURATEDCT);
    bool made = false;
    if (packed < 0)
        fail(reason, reason_bytes, tjGetErrorStr2(handle));
    else
        made = join(jpeg, coded, coded_bytes, file, file_bytes) || fail(reason, reason_bytes, "out of memory");
    tjFree(coded);
    return made;
}

bool jpeg_encode(const struct jpeg *jpeg, uint8_t **file, size_t *file_bytes, char *reason, size_t reason_bytes)
{
    tjhandle handle = tjInitCompress();
    if (!handle)
        return fail(reason, reason_bytes, tjGetErrorStr2(NULL));
    const bool made = encode_with(handle, jpeg, file, file_bytes, reason, reason_bytes);
    tjDestroy(handle);
    return made;
}
