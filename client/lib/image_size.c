/* SPDX-License-Identifier: MIT */
/* Formats: PNG (W3C, 3rd edition, 11.2.2), JPEG (ITU-T T.81, B.2.2), OpenEXR ("File Layout"), Radiance HDR (Ward,
 * "Radiance File Formats"), WebP (RFC 9649, 2.3 to 2.7), TIFF (6.0, section 2), GIF (89a, 17 to 27). The input is
 * not trusted: every position is checked against the number of bytes. */
#include "lib/image_size.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* Our EXR headers are some 4 KB; others' may carry a preview. */
#define HEAD_BYTES 65536u

struct head {
    int fd;
    uint64_t file_bytes;
    size_t count;
    uint8_t bytes[HEAD_BYTES];
};

static size_t read_at(int fd, void *bytes, size_t count, uint64_t offset)
{
    size_t done = 0;
    while (done < count) {
        const ssize_t got = pread(fd, (uint8_t *)bytes + done, count - done, (off_t)(offset + done));
        if (got == 0 || (got < 0 && errno != EINTR))
            break;
        done += got > 0 ? (size_t)got : 0;
    }
    return done;
}

static uint32_t big_endian(const uint8_t *at, unsigned count)
{
    uint32_t value = 0;
    for (unsigned i = 0; i < count; i++)
        value = value << 8 | at[i];
    return value;
}

static uint64_t little_endian(const uint8_t *at, unsigned count)
{
    uint64_t value = 0;
    for (unsigned i = count; i-- > 0;)
        value = value << 8 | at[i];
    return value;
}

/* True if the file ends with these bytes. */
static bool ends_with(const struct head *head, const void *bytes, size_t count)
{
    uint8_t tail[16];
    return head->file_bytes >= count && read_at(head->fd, tail, count, head->file_bytes - count) == count &&
           memcmp(tail, bytes, count) == 0;
}

static bool png_size(const struct head *head, uint32_t *width, uint32_t *height)
{
    static const uint8_t begin[] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
    static const uint8_t end[] = {0, 0, 0, 0, 'I', 'E', 'N', 'D', 0xae, 'B', '`', 0x82};
    if (head->count < 24 || memcmp(head->bytes, begin, sizeof(begin)) != 0 ||
        memcmp(head->bytes + 12, "IHDR", 4) != 0)
        return false;
    *width = big_endian(head->bytes + 16, 4);
    *height = big_endian(head->bytes + 20, 4);
    return ends_with(head, end, sizeof(end));
}

/* Segments up to the frame header: marker, length, content. */
static bool jpeg_size(const struct head *head, uint32_t *width, uint32_t *height)
{
    if (head->count < 4 || head->bytes[0] != 0xff || head->bytes[1] != 0xd8)
        return false;
    for (size_t at = 2; head->count - at >= 9;) {
        const uint8_t *segment = head->bytes + at, marker = segment[1];
        if (segment[0] != 0xff)
            return false;
        const bool is_frame =
            marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
        if (is_frame) {
            *height = big_endian(segment + 5, 2);
            *width = big_endian(segment + 7, 2);
            return ends_with(head, "\xff\xd9", 2);
        }
        const size_t length = big_endian(segment + 2, 2);
        if (length < 2 || length + 2 > head->count - at)
            return false;
        at += length + 2;
    }
    return false;
}

struct exr_header {
    bool has_window, has_compression;
    uint32_t width, height;
    uint32_t lines; /* lines of a chunk */
    size_t end;     /* offset of the table of chunks */
};

static bool exr_window(const uint8_t *value, struct exr_header *header)
{
    const int64_t left = (int32_t)little_endian(value, 4), top = (int32_t)little_endian(value + 4, 4);
    const int64_t right = (int32_t)little_endian(value + 8, 4), bottom = (int32_t)little_endian(value + 12, 4);
    if (right < left || bottom < top || right - left >= UINT32_MAX || bottom - top >= UINT32_MAX)
        return false;
    header->has_window = true;
    header->width = (uint32_t)(right - left + 1);
    header->height = (uint32_t)(bottom - top + 1);
    return true;
}

/* Attributes: name, type, both with NUL, four bytes of length, value; an empty name ends them. */
static bool exr_attributes(const struct head *head, struct exr_header *header)
{
    static const uint16_t chunk_lines[] = {1, 1, 1, 16, 32, 16, 32, 32, 32, 256};
    size_t at = 8;
    while (at < head->count && head->bytes[at] != 0) {
        const char *name = (const char *)head->bytes + at;
        const size_t name_bytes = strnlen(name, head->count - at);
        const size_t type_at = at + name_bytes + 1;
        if (type_at >= head->count)
            return false;
        const size_t type_bytes = strnlen((const char *)head->bytes + type_at, head->count - type_at);
        const size_t size_at = type_at + type_bytes + 1;
        if (size_at > head->count || head->count - size_at < 4)
            return false;
        const uint64_t size = little_endian(head->bytes + size_at, 4);
        const uint8_t *value = head->bytes + size_at + 4;
        if (size > head->count - size_at - 4)
            return false;
        if (strcmp(name, "dataWindow") == 0 && (size != 16 || !exr_window(value, header)))
            return false;
        if (strcmp(name, "compression") == 0) {
            if (size != 1 || value[0] >= sizeof(chunk_lines) / sizeof(chunk_lines[0]))
                return false;
            header->has_compression = true;
            header->lines = chunk_lines[value[0]];
        }
        at = size_at + 4 + (size_t)size;
    }
    header->end = at + 1;
    return at < head->count && header->has_window && header->has_compression;
}

/* The table's last chunk must end within the file: it is written last, but for the table itself. */
static bool exr_size(const struct head *head, uint32_t *width, uint32_t *height)
{
    struct exr_header header = {0};
    uint8_t word[8];
    if (head->count < 9 || little_endian(head->bytes, 4) != 0x01312f76)
        return false;
    /* Version 2; our files have no tiles, deep data or several parts. */
    if ((little_endian(head->bytes + 4, 4) & ~0x400ull) != 2 || !exr_attributes(head, &header))
        return false;
    const uint64_t chunks = ((uint64_t)header.height + header.lines - 1) / header.lines;
    if (read_at(head->fd, word, 8, header.end + (chunks - 1) * 8) != 8)
        return false;
    const uint64_t last = little_endian(word, 8);
    if (last < header.end || last > head->file_bytes || read_at(head->fd, word, 8, last) != 8)
        return false;
    *width = header.width;
    *height = header.height;
    return little_endian(word + 4, 4) <= head->file_bytes - last - 8;
}

static bool hdr_size(const struct head *head, uint32_t *width, uint32_t *height)
{
    char line[64];
    if (head->count < 10 || memcmp(head->bytes, "#?", 2) != 0)
        return false;
    const uint8_t *end = memmem(head->bytes, head->count, "\n\n", 2);
    if (!end)
        return false;
    const size_t left = head->count - (size_t)(end + 2 - head->bytes);
    snprintf(line, sizeof(line), "%.*s", (int)(left < sizeof(line) ? left : sizeof(line) - 1),
             (const char *)end + 2);
    return sscanf(line, "-Y %9u +X %9u", height, width) == 2;
}

/* The RIFF container holds its length; its first chunk is one of three. */
static bool webp_size(const struct head *head, uint32_t *width, uint32_t *height)
{
    const uint8_t *bytes = head->bytes, *chunk = bytes + 12;
    if (head->count < 30 || memcmp(bytes, "RIFF", 4) != 0 || memcmp(bytes + 8, "WEBP", 4) != 0 ||
        little_endian(bytes + 4, 4) + 8 > head->file_bytes)
        return false;
    if (memcmp(chunk, "VP8X", 4) == 0) {
        *width = (uint32_t)little_endian(bytes + 24, 3) + 1;
        *height = (uint32_t)little_endian(bytes + 27, 3) + 1;
    } else if (memcmp(chunk, "VP8L", 4) == 0 && bytes[20] == 0x2f) {
        const uint32_t sizes = (uint32_t)little_endian(bytes + 21, 4);
        *width = (sizes & 0x3fff) + 1;
        *height = (sizes >> 14 & 0x3fff) + 1;
    } else if (memcmp(chunk, "VP8 ", 4) == 0 && memcmp(bytes + 23, "\x9d\x01\x2a", 3) == 0) {
        *width = (uint32_t)little_endian(bytes + 26, 2) & 0x3fff;
        *height = (uint32_t)little_endian(bytes + 28, 2) & 0x3fff;
    } else {
        return false;
    }
    return true;
}

static bool gif_size(const struct head *head, uint32_t *width, uint32_t *height)
{
    if (head->count < 13 || (memcmp(head->bytes, "GIF87a", 6) != 0 && memcmp(head->bytes, "GIF89a", 6) != 0))
        return false;
    *width = (uint32_t)little_endian(head->bytes + 6, 2);
    *height = (uint32_t)little_endian(head->bytes + 8, 2);
    return ends_with(head, ";", 1);
}

static uint32_t tiff_number(const struct head *head, const uint8_t *at, unsigned count)
{
    return head->bytes[0] == 'M' ? big_endian(at, count) : (uint32_t)little_endian(at, count);
}

/* The last number of an entry: one of 4 bytes, or of 2, stands in the entry itself. */
static bool tiff_last(const struct head *head, const uint8_t entry[12], uint32_t *value)
{
    const uint32_t type = tiff_number(head, entry + 2, 2), count = tiff_number(head, entry + 4, 4);
    const unsigned bytes = type == 3 ? 2 : 4;
    uint8_t number[4];
    if ((type != 3 && type != 4) || count == 0)
        return false;
    const uint64_t skipped = (uint64_t)(count - 1) * bytes;
    if ((uint64_t)count * bytes <= 4)
        memcpy(number, entry + 8 + skipped, bytes);
    else if (read_at(head->fd, number, bytes, tiff_number(head, entry + 8, 4) + skipped) != bytes)
        return false;
    *value = tiff_number(head, number, bytes);
    return true;
}

/* The first directory, which may be anywhere. Pixels are in strips, and the last one must end within the file. */
static bool tiff_size(const struct head *head, uint32_t *width, uint32_t *height)
{
    uint32_t strip = 0, strip_bytes = 0;
    uint8_t entry[12];
    if (head->count < 8 || (memcmp(head->bytes, "II*", 4) != 0 && memcmp(head->bytes, "MM\0*", 4) != 0))
        return false;
    const uint64_t directory = tiff_number(head, head->bytes + 4, 4);
    if (read_at(head->fd, entry, 2, directory) != 2)
        return false;
    const uint32_t count = tiff_number(head, entry, 2);
    bool known = true;
    *width = *height = 0;
    for (uint32_t i = 0; i < count && known; i++) {
        if (read_at(head->fd, entry, sizeof(entry), directory + 2 + i * sizeof(entry)) != sizeof(entry))
            return false;
        const uint32_t tag = tiff_number(head, entry, 2);
        if (tag == 256 || tag == 257)
            known = tiff_last(head, entry, tag == 256 ? width : height);
        else if (tag == 273 || tag == 279)
            known = tiff_last(head, entry, tag == 273 ? &strip : &strip_bytes);
    }
    return known && *width > 0 && *height > 0 && strip > 0 && (uint64_t)strip + strip_bytes <= head->file_bytes;
}

bool fl_image_size(const char *path, uint32_t *width, uint32_t *height)
{
    struct head head;
    struct stat status;
    head.fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (head.fd < 0)
        return false;
    bool known = fstat(head.fd, &status) == 0 && S_ISREG(status.st_mode);
    if (known) {
        head.file_bytes = (uint64_t)status.st_size;
        head.count = read_at(head.fd, head.bytes, sizeof(head.bytes), 0);
        known = png_size(&head, width, height) || jpeg_size(&head, width, height) ||
                exr_size(&head, width, height) || hdr_size(&head, width, height) ||
                webp_size(&head, width, height) || gif_size(&head, width, height) ||
                tiff_size(&head, width, height);
    }
    close(head.fd);
    return known;
}
