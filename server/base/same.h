/* SPDX-License-Identifier: MIT */
/* Equality of the protocol's values, field by field: record_same_<name>(a, b). */
#ifndef FARLIGHT_BASE_SAME_H
#define FARLIGHT_BASE_SAME_H

#include <stdbool.h>
#include <string.h>

#include "protocol/values.h"

/* clang-format off */
#define RECORD(name, doc)                                                                                             \
    static inline bool record_same_##name(const struct record_##name *a, const struct record_##name *b)               \
    {                                                                                                                 \
        return true
#define RECORD_END(name) ; }
#define INT(type, field, min, max, doc) && a->field == b->field
#define ENUM(enum_name, field, doc) && a->field == b->field
#define REAL(field, min, max, doc) && a->field == b->field
#define TRACER_SETTINGS(field) && memcmp(&a->field, &b->field, sizeof(a->field)) == 0
#define REALS(field, count, min, max, doc) && memcmp(a->field, b->field, sizeof(a->field)) == 0
#define NESTED(record, field, doc) && record_same_##record(&a->field, &b->field)
#include "protocol/values.def"
/* clang-format on */

#endif
