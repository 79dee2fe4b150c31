/* SPDX-License-Identifier: MIT */
#include "gltf_image.h"

#include "texture_plain.h"

#include <stdint.h>
#include <stdio.h>
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

/* Behind the comma of a data URI. Other characters than those of base64 end it. */
static bool is_plain_base64(const char *text, size_t length)
{
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const char *comma = memchr(text, ',', length < 100 ? length : 100);
    unsigned char head[FILES_HEAD_BYTES];
    size_t count = 0;
    uint32_t bits = 0;

    for (size_t i = comma ? (size_t)(comma - text) + 1 : length, used = 0; i < length && count < sizeof(head);
         i++) {
        const char *digit = text[i] != '\0' ? strchr(digits, text[i]) : NULL;
        if (!digit)
            break;
        bits = bits << 6 | (uint32_t)(digit - digits);
        used += 6;
        if (used >= 8) {
            used -= 8;
            head[count++] = (unsigned char)(bits >> used);
        }
    }
    return is_plain(head, count);
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

/* Strings with escapes may be anything. */
static bool may_be_other(const struct files *files, const char *text, size_t length)
{
    static const char *const plain[] = {".png", ".jpg", ".jpeg", NULL}, *const others[] = {
                                                                            ".webp", ".exr",  ".hdr", ".pic",
                                                                            ".tif",  ".tiff", ".bmp", ".gif",
                                                                            ".tga",  ".tpic", ".ppm", ".pnm",
                                                                            NULL};
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
           (has_ending(text, length, plain) && is_other_file(files, text, length));
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

/* Where images begin among the vertices only the JSON says: these signatures are long enough to be found. */
static bool holds_other(const unsigned char *binary, size_t size_bytes)
{
    return memmem(binary, size_bytes, "WEBPVP8", 7) || memmem(binary, size_bytes, "GIF89a", 6);
}

bool gltf_may_have_other_images(const struct files *files, const unsigned char *bytes, size_t size_bytes)
{
    const size_t json_bytes = text_bytes(bytes, size_bytes);
    const char *at = (const char *)bytes, *const end = at + json_bytes;

    while ((at = memchr(at, '"', (size_t)(end - at)))) {
        const char *text = at + 1, *quote = memchr(text, '"', (size_t)(end - text));
        if (!quote)
            break;
        if (may_be_other(files, text, (size_t)(quote - text)))
            return true;
        at = quote + 1;
    }
    return memmem(bytes, json_bytes, "\"images\"", 8) && holds_other(bytes + json_bytes, size_bytes - json_bytes);
}
