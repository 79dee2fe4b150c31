/* SPDX-License-Identifier: MIT */
/* What a tracer's structure says of itself: rows in the tracer's own words, which nobody else knows. They reach
 * people and scripts as protocol/messages.def has them (structure_row). */
#ifndef FARLIGHT_TRACE_STRUCTURE_H
#define FARLIGHT_TRACE_STRUCTURE_H

#include "base/words.h"

#include <stdbool.h>
#include <stdint.h>

#define STRUCTURE_ROWS_MAX 16u

struct structure_row {
    char name[48]; /* "static/resolution" */
    uint32_t part;
    enum unit unit;
    uint64_t number;   /* the value, of UNIT_NUMBER and UNIT_BUILT */
    float measure;     /* the value, of other units */
    char warning[256]; /* what the picture lacks for this reason, and the remedy; empty: nothing */
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
/* Whether the part was built by the last update: then the times of a build with its number are its own. */
void structure_built(struct structure_rows *rows, bool built);

#endif
