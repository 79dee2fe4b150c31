/* SPDX-License-Identifier: MIT */
#ifndef FARLIGHT_PROTOCOL_PLAIN_TEXT_H
#define FARLIGHT_PROTOCOL_PLAIN_TEXT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

/* Text from outside (names of peers, models and files), made harmless where a person reads it: on a terminal and
 * in a log. No state, any thread. */

/* The length in bytes of the UTF-8 character at `text`, of which `bytes` may be read, and its number; 0 if it is
 * none or zero. A terminated text may be given as UTF8_BYTES_MAX: nothing is read behind its end. */
size_t utf8_read(const void *text, size_t bytes, uint32_t *code);

/* Whether the character shows itself and nothing else: no control character (C0, DEL, C1), no override, embedding,
 * isolate or mark of direction, no line or paragraph separator, and nothing without width that makes two names
 * look the same. */
bool plain_text_allows(uint32_t code);

#define UTF8_BYTES_MAX 4

/* Moves *text, which does not end there, behind its next character and returns how many bytes of `shown` show it:
 * the character if it is plain; '?' if it is not, or is a byte that is no UTF-8. */
size_t plain_text_next(const char **text, char shown[UTF8_BYTES_MAX]);

/* Copies as much as fits in whole characters, as plain_text_next shows them. `out` may be `text`, as nothing
 * becomes longer. Returns the length in bytes. */
size_t plain_text_copy(char *out, size_t out_bytes, const char *text);

/* Prints it likewise. */
void plain_text_print(FILE *stream, const char *text);

#endif
