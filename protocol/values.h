/* SPDX-License-Identifier: MIT */
/* The values of values.def as plain structs, struct record_<name>, for every room of client and server. They own
 * nothing and can be copied by assignment. All-zero has every field 0. */
#ifndef FARLIGHT_PROTOCOL_VALUES_H
#define FARLIGHT_PROTOCOL_VALUES_H

#include <stdint.h>

#include "protocol/tracers.h"

/* clang-format off */
#define PROTOCOL_INT_u8 uint8_t
#define PROTOCOL_INT_u16 uint16_t
#define PROTOCOL_INT_u32 uint32_t
#define PROTOCOL_INT_u64 uint64_t

#define RECORD(name, doc) struct record_##name {
#define RECORD_END(name) };
#define INT(type, field, min, max, doc) PROTOCOL_INT_##type field;
#define ENUM(enum_name, field, doc) uint32_t field;
#define REAL(field, min, max, doc) float field;
#define TRACER_SETTINGS(field) struct tracer_settings field;
#define REALS(field, count, min, max, doc) float field[count];
#define NESTED(record, field, doc) struct record_##record field;
#include "protocol/values.def"
/* clang-format on */

#endif
