/* SPDX-License-Identifier: MIT */
/* Text from outside, made harmless. */
#include "protocol/plain_text.h"

#include <string.h>

size_t utf8_read(const void *text, size_t bytes, uint32_t *code)
{
    const uint8_t *at = text;
    const uint8_t first = bytes > 0 ? at[0] : 0;
    if (first >= 0x01 && first <= 0x7f) {
        *code = first;
        return 1;
    }
    if (first < 0xc2 || first > 0xf4)
        return 0;
    /* Table 3-7 of the Unicode standard: the second byte's range excludes over-long forms and surrogates. */
    const size_t length = first >= 0xf0 ? 4 : first >= 0xe0 ? 3 : 2;
    uint8_t low = first == 0xe0 ? 0xa0 : first == 0xf0 ? 0x90 : 0x80;
    uint8_t high = first == 0xed ? 0x9f : first == 0xf4 ? 0x8f : 0xbf;
    if (length > bytes)
        return 0;
    uint32_t read = first & (0x7fu >> length);
    for (size_t i = 1; i < length; i++) {
        if (at[i] < low || at[i] > high)
            return 0;
        read = read << 6 | (at[i] & 0x3fu);
        low = 0x80;
        high = 0xbf;
    }
    *code = read;
    return length;
}

bool plain_text_allows(uint32_t code)
{
    static const struct {
        uint32_t first, last;
    } refused[] = {
        {0x00, 0x1f},       /* C0 */
        {0x7f, 0x9f},       /* DEL and C1: some terminals take U+009B for ESC [ */
        {0x61c, 0x61c},     /* Arabic letter mark */
        {0x200b, 0x200f},   /* zero width; marks of direction */
        {0x2028, 0x202e},   /* separators of lines and paragraphs, embeddings, overrides */
        {0x2060, 0x206f},   /* invisible operators, isolates, deprecated format characters */
        {0xfeff, 0xfeff},   /* byte order mark */
        {0xfff9, 0xfffb},   /* interlinear annotation */
        {0xe0000, 0xe0fff}, /* tags */
    };
    for (size_t i = 0; i < sizeof(refused) / sizeof(refused[0]); i++) {
        if (code >= refused[i].first && code <= refused[i].last)
            return false;
    }
    return true;
}

size_t plain_text_next(const char **text, char shown[UTF8_BYTES_MAX])
{
    uint32_t code = 0;
    const size_t length = utf8_read(*text, UTF8_BYTES_MAX, &code);
    const bool plain = length > 0 && plain_text_allows(code);
    const size_t bytes = plain ? length : 1;
    memcpy(shown, plain ? *text : "?", bytes);
    *text += length > 0 ? length : 1;
    return bytes;
}

size_t plain_text_copy(char *out, size_t out_bytes, const char *text)
{
    size_t used = 0;
    char shown[UTF8_BYTES_MAX];
    if (out_bytes == 0)
        return 0;
    while (*text != '\0') {
        const size_t bytes = plain_text_next(&text, shown);
        if (bytes >= out_bytes - used)
            break;
        memcpy(out + used, shown, bytes);
        used += bytes;
    }
    out[used] = '\0';
    return used;
}

void plain_text_print(FILE *stream, const char *text)
{
    char shown[UTF8_BYTES_MAX];
    while (*text != '\0') {
        const size_t bytes = plain_text_next(&text, shown);
        fwrite(shown, 1, bytes, stream);
    }
}
