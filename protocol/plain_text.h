/* SPDX-License-Identifier: MIT */
/* Text from outside, made harmless for terminals and logs. */
#ifndef FARLIGHT_PROTOCOL_PLAIN_TEXT_H
#define FARLIGHT_PROTOCOL_PLAIN_TEXT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

/* Texts from outside are the names of peers, models and files. The functions have no state; any thread. */

/* Reads the UTF-8 character at `text`, where `bytes` may be read: returns its length in bytes and sets *code; 0
 * if the bytes are invalid or the character is zero. For a terminated text, UTF8_BYTES_MAX may be passed:
 * nothing is read beyond its end. */
size_t utf8_read(const void *text, size_t bytes, uint32_t *code);

/* True for a character that shows itself and nothing else: no control character (C0, DEL, C1), no override,
 * embedding, isolate or mark of direction, no separator of lines or paragraphs, and no zero-width character
 * that makes two names look the same. */
bool plain_text_allows(uint32_t code);

#define UTF8_BYTES_MAX 4

/* Moves *text, which must not be at its end, past the next character, and writes its visible form to `shown`:
 * the character if it is plain, else '?', also for bytes that are not UTF-8. Returns the length of that form. */
size_t plain_text_next(const char **text, char shown[UTF8_BYTES_MAX]);

/* Copies whole characters as plain_text_next shows them, as many as fit. `out` may be `text`, as nothing
 * becomes longer. Returns the length in bytes. */
size_t plain_text_copy(char *out, size_t out_bytes, const char *text);

/* Prints text as plain_text_next shows it. */
void plain_text_print(FILE *stream, const char *text);

#endif
