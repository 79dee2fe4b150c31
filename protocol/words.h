/* SPDX-License-Identifier: MIT */
/* The enumerations of words.def under the protocol's names: enum protocol_<name>, PROTOCOL_<PREFIX>_<VALUE> and
 * PROTOCOL_<PREFIX>_COUNT, one past the largest number; the texts that people read and type. */
#ifndef FARLIGHT_PROTOCOL_WORDS_H
#define FARLIGHT_PROTOCOL_WORDS_H

#include <stdbool.h>
#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/* clang-format off */
#define ENUMERATION(PREFIX, name, doc) enum protocol_##name {
#define VALUE(PREFIX, VALUE_NAME, number, text, doc) PROTOCOL_##PREFIX##_##VALUE_NAME = (number),
#define ENUMERATION_END(PREFIX, name) PROTOCOL_##PREFIX##_COUNT };
#include "protocol/words.def"
/* clang-format on */

/* For each enum: the value's text ("bvh"; "?" outside the enum), and the value of a text (false: no such text;
 * *out is unchanged). */
#define ENUMERATION(PREFIX, name, doc)                                                                            \
    const char *protocol_##name##_text(enum protocol_##name value);                                               \
    bool protocol_##name##_parse(const char *text, enum protocol_##name *out);
#include "protocol/words.def"

/* Adds the layer `text` to a set, or all layers named `text` and a digit. */
bool protocol_layers_parse(const char *text, unsigned *layers);

/* Lists an enum's texts for help and errors: "bvh, naive" for the enum called "tracer"; "x" for the words "x0",
 * "x1". Writes at most out_bytes with the NUL, cut off if too long; empty for an unknown enum. Returns out. */
const char *protocol_enum_list(const char *enum_name, char *out, size_t out_bytes);

#ifdef __cplusplus
}
#endif
#endif
