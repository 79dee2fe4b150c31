/* SPDX-License-Identifier: MIT */
/* words.def and messages.def as constant data, for code that handles all messages alike: codec, printer,
 * document, tests, fuzzers. */
#ifndef FARLIGHT_PROTOCOL_DESCRIBE_H
#define FARLIGHT_PROTOCOL_DESCRIBE_H

#include "protocol/framing.h"

#ifdef __cplusplus
extern "C" {
#endif

struct value_desc {
    const char *name; /* "BVH" */
    uint32_t number;
    const char *text; /* "bvh" */
    const char *doc;
};

struct enum_desc {
    const char *name; /* "tracer" */
    const char *doc;
    const struct value_desc *values; /* ascending numbers */
    size_t value_count;
};

enum field_kind {
    FIELD_INT,    /* width_bytes 1, 2, 4, 8; min, max */
    FIELD_ENUM,   /* enumeration */
    FIELD_REAL,   /* `count` floats (1: REAL, else REALS); real_min, real_max */
    FIELD_BYTES,  /* `count` bytes */
    FIELD_RECORD, /* a nested `record` with fixed fields only */
    FIELD_STRING, /* `max` bytes; counted from here on */
    FIELD_ARRAY,  /* `max` records of `record` */
    FIELD_BULK,   /* `max` bytes */
};

struct field_desc {
    const char *name;
    const char *doc;
    enum field_kind kind;
    uint32_t
        width_bytes; /* size of one element of a fixed field, in memory and on the wire; of a record on the wire */
    uint32_t count;  /* elements of a fixed field */
    size_t offset;   /* offset of the field in its struct */
    size_t count_offset; /* offset of <field>_count or <field>_bytes */
    uint64_t min, max;
    const char *numbers; /* list of allowed numbers within min and max, "2, 4, 8"; NULL: all */
    bool
        /* 0 is allowed in addition and stands for the default; if that is 0 itself, for 'auto' */
        zero_is_default;
    uint64_t default_int;
    float real_min, real_max, default_real;
    const char *unit;   /* unit of the value, "metres"; "" or NULL: none */
    const char *tracer; /* the tracer of the setting; NULL: none */
    const struct enum_desc *enumeration;
    const struct struct_desc *(*record)(void);
};

/* A record, or the fields of a message. */
struct struct_desc {
    const char *name;
    const char *doc;
    const struct field_desc *fields; /* fixed fields first; the entry after the last has name NULL */
    size_t size_bytes;               /* size of the struct in memory */
    uint32_t wire_fixed_bytes;       /* size of the fixed fields */
    uint32_t wire_min_bytes;         /* the fixed fields, and 4 for each counted field */
};

struct message_desc {
    struct message_info info;
    const char *constant; /* "SET_NODE" */
    const char *doc;
    const struct struct_desc *(*body)(void);
};

extern const struct enum_desc protocol_enums[];
extern const size_t protocol_enum_count;
extern const struct struct_desc *(*const protocol_records[])(void);
extern const size_t protocol_record_count;
extern const struct message_desc protocol_messages[]; /* same order as in the table */
extern const size_t protocol_message_count;

const struct message_desc *message_describe(uint32_t type); /* NULL: unknown */
bool field_is_counted(const struct field_desc *field);
/* Finds a field by its name; NULL: there is none. */
const struct field_desc *struct_field(const struct struct_desc *desc, const char *name);
/* Fills the array with the struct's fixed fields, where a nested record is replaced by its own fields; offsets
 * count from the start of the struct. Returns how many there are, or `max`. */
size_t struct_leaves(const struct struct_desc *desc, struct field_desc *leaves, size_t max);
/* Lists the allowed values for people: "16 to 4096", "auto, 1, 4", "overlap, one". Cut off where it does not
 * fit. */
const char *field_allowed_text(const struct field_desc *field, char *out, size_t out_bytes);
const char *field_default_text(const struct field_desc *field, char *out, size_t out_bytes); /* "1024", "auto" */
/* True if an INT field may have this value. */
bool field_has_number(const struct field_desc *field, uint64_t value);
/* The text of an enum's value; NULL: no such value. */
const char *enum_desc_text(const struct enum_desc *desc, uint32_t number);

/* Offset of the fields of a message's struct, which is the offset of its union member. */
#define MESSAGE_BODY_OFFSET offsetof(struct message, ok)

/* Read and write an INT or ENUM field in memory. */
uint64_t field_load_int(const struct field_desc *field, const void *place);
void field_store_int(const struct field_desc *field, void *place, uint64_t value);
/* Sets a field to its default; `place` must be zeroed. */
void field_default(const struct field_desc *field, void *place);
/* Sets every fixed field to the table's default and empties counted fields; strings become "". */
void struct_defaults(const struct struct_desc *desc, void *body);

/* True for UTF-8 without NUL, over-long forms, surrogates and numbers above U+10FFFF. */
bool utf8_valid(const uint8_t *bytes, size_t count);

#ifdef __cplusplus
}
#endif
#endif
