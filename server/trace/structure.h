/* SPDX-License-Identifier: MIT */
/* The description of a tracer's structure and of its waves: rows in the tracer's own words, on which no other room
 * depends. They are sent as in protocol/messages.def (structure_row). */
#ifndef FARLIGHT_TRACE_STRUCTURE_H
#define FARLIGHT_TRACE_STRUCTURE_H

#include "base/words.h"

#include <stdbool.h>
#include <stdint.h>

#define STRUCTURE_ROWS_MAX 32u

struct structure_row {
    char name[48]; /* "static/resolution" */
    uint32_t part;
    enum unit unit;
    uint64_t number;   /* the value, of UNIT_NUMBER and UNIT_BUILT */
    float measure;     /* the value, of other units */
    char warning[256]; /* what the picture lacks because of this value, and the remedy; empty: nothing */
};

struct structure_rows {
    struct structure_row rows[STRUCTURE_ROWS_MAX];
    uint32_t count;
    /* Of the rows that are added next: number and name of the part of the structure; NULL: it has no parts. */
    uint32_t part;
    const char *part_name;
};

/* These add a row and return it, for a warning. Rows beyond STRUCTURE_ROWS_MAX overwrite the last one. */
struct structure_row *structure_number(struct structure_rows *rows, const char *name, uint64_t number);
struct structure_row *structure_metres(struct structure_rows *rows, const char *name, float metres);
struct structure_row *structure_pixels(struct structure_rows *rows, const char *name, float pixels);
struct structure_row *structure_per_ray(struct structure_rows *rows, const char *name, float mean);
/* Whether the part was built by the last update: then the times of a build with its number are its own. */
void structure_built(struct structure_rows *rows, bool built);

#endif
