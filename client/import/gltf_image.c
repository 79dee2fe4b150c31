/* SPDX-License-Identifier: MIT */
#include "gltf_image.h"

#include "texture_plain.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#define NAME_BYTES_MAX 4096

static bool begins_with(const char *text, size_t length, const char *start)
{
    return length >= strlen(start) && strncmp(text, start, strlen(start)) == 0;
}

static bool has_ending(const char *text, size_t length, const char *const *endings)
{
    for (; *endings; endings++)
        if (length >= strlen(*endings) &&
            strncasecmp(text + length - strlen(*endings), *endings, strlen(*endings)) == 0)
            return true;
    return false;
}

static bool is_plain(const unsigned char *head, size_t head_bytes)
{
    const struct texture_job job = {.bytes = head, .size_bytes = head_bytes};
    return texture_is_plain(&job);
}

/* ---- of a string ---- */

/* Behind the comma of a data URI. Other characters than those of base64 end it. Returns how many bytes
 * it has written. */
static size_t read_base64(const char *text, size_t length, unsigned char *bytes, size_t bytes_max)
{
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const char *comma = memchr(text, ',', length < 100 ? length : 100);
    size_t count = 0;
    uint32_t bits = 0;

    for (size_t i = comma ? (size_t)(comma - text) + 1 : length, used = 0; i < length && count < bytes_max; i++) {
        const char *digit = text[i] != '\0' ? strchr(digits, text[i]) : NULL;
        if (!digit)
            break;
        bits = bits << 6 | (uint32_t)(digit - digits);
        used += 6;
        if (used >= 8) {
            used -= 8;
            bytes[count++] = (unsigned char)(bits >> used);
        }
    }
    return count;
}

static bool is_plain_base64(const char *text, size_t length)
{
    unsigned char head[FILES_HEAD_BYTES];
    return is_plain(head, read_base64(text, length, head, sizeof(head)));
}

/* "my%20wood.png" becomes "my wood.png". False: it is too long for a name. */
static bool resolve_percents(const char *text, size_t length, char name[NAME_BYTES_MAX])
{
    size_t used = 0;

    if (length >= NAME_BYTES_MAX)
        return false;
    for (size_t i = 0; i < length; i++) {
        unsigned code;
        char hex[3] = "";
        int read = 0;

        if (text[i] == '%' && length - i > 2) {
            memcpy(hex, text + i + 1, 2);
            if (sscanf(hex, "%2x%n", &code, &read) != 1 || read != 2 || code == 0)
                read = 0;
        }
        name[used++] = read > 0 ? (char)code : text[i];
        i += (size_t)read;
    }
    name[used] = '\0';
    return true;
}

/* What is not there, or may not be read, is told when the image is. */
static bool is_other_file(const struct files *files, const char *text, size_t length)
{
    char name[NAME_BYTES_MAX];
    unsigned char head[FILES_HEAD_BYTES];
    const size_t head_bytes = resolve_percents(text, length, name) ? files_read_head(files, name, head) : 0;

    return head_bytes > 0 && !is_plain(head, head_bytes);
}

static const char *const plain_endings[] = {".png", ".jpg", ".jpeg", NULL};

/* Strings with escapes may be anything. */
static bool may_be_other(const struct files *files, const char *text, size_t length)
{
    static const char *const others[] = {".webp", ".exr", ".hdr",  ".pic", ".tif", ".tiff", ".bmp",
                                         ".gif",  ".tga", ".tpic", ".ppm", ".pnm", NULL};
    const bool is_data = begins_with(text, length, "data:");
    const size_t skipped = is_data ? strlen("data:") : 0;

    if (begins_with(text + skipped, length - skipped, "image/")) {
        if (!begins_with(text + skipped, length - skipped, "image/png") &&
            !begins_with(text + skipped, length - skipped, "image/jp"))
            return true;
        return is_data && !is_plain_base64(text, length);
    }
    if (is_data)
        return false;
    return has_ending(text, length, others) || memchr(text, '\\', length) ||
           (has_ending(text, length, plain_endings) && is_other_file(files, text, length));
}

/* ---- of a buffer ---- */

/* Where images begin among the vertices only the JSON says: these signatures are long enough to be found. */
static bool holds_other(const unsigned char *binary, size_t size_bytes)
{
    return memmem(binary, size_bytes, "WEBPVP8", 7) || memmem(binary, size_bytes, "GIF89a", 6);
}

static bool base64_holds_other(const char *text, size_t length)
{
    unsigned char *bytes = malloc(length);
    const bool found = bytes && holds_other(bytes, read_base64(text, length, bytes, length));

    free(bytes);
    return found;
}

/* Of what "uri" names, in the file or beside it. What ends as an image is one, whose head has been looked at. */
static bool buffer_may_hold_other(const struct files *files, const char *text, size_t length)
{
    char name[NAME_BYTES_MAX];

    if (begins_with(text, length, "data:"))
        return !begins_with(text, length, "data:image/") && base64_holds_other(text, length);
    return !has_ending(text, length, plain_endings) && resolve_percents(text, length, name) &&
           files_hold(files, name, holds_other);
}

/* ---- of the file ---- */

static uint32_t number_at(const unsigned char *bytes)
{
    return (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 | (uint32_t)bytes[3] << 24;
}

/* Of a binary one the first chunk, after two headers. */
static size_t text_bytes(const unsigned char *bytes, size_t size_bytes)
{
    if (size_bytes < 20 || memcmp(bytes, "glTF", 4) != 0)
        return size_bytes;
    const uint32_t chunk_bytes = number_at(bytes + 12);
    return chunk_bytes < size_bytes - 20 ? 20 + (size_t)chunk_bytes : size_bytes;
}

bool gltf_may_have_other_images(const struct files *files, const unsigned char *bytes, size_t size_bytes)
{
    const size_t json_bytes = text_bytes(bytes, size_bytes);
    const char *at = (const char *)bytes, *const end = at + json_bytes;
    /* An image in a buffer has a MIME type, which may be another's. */
    const bool has_images = memmem(bytes, json_bytes, "\"images\"", 8),
               in_buffers = has_images && memmem(bytes, json_bytes, "\"mimeType\"", 10);
    bool is_uri = false;

    while ((at = memchr(at, '"', (size_t)(end - at)))) {
        const char *text = at + 1, *quote = memchr(text, '"', (size_t)(end - text));
        if (!quote)
            break;
        const size_t length = (size_t)(quote - text);
        if (may_be_other(files, text, length) ||
            (is_uri && in_buffers && buffer_may_hold_other(files, text, length)))
            return true;
        is_uri = length == 3 && memcmp(text, "uri", 3) == 0;
        at = quote + 1;
    }
    return has_images && holds_other(bytes + json_bytes, size_bytes - json_bytes);
}
