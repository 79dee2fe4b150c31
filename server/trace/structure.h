/* SPDX-License-Identifier: MIT */
/* Description of a tracer's structure and of its waves: rows in the tracer's own words, on which no other room
 * depends. They are sent as structure_row of protocol/messages.def. */
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
    uint64_t number;   /* the value, for UNIT_NUMBER and UNIT_BUILT */
    float measure;     /* the value, for other units */
    char warning[256]; /* defect of the picture due to this value, and the remedy; empty: none */
};

struct structure_rows {
    struct structure_row rows[STRUCTURE_ROWS_MAX];
    uint32_t count;
    /* Number and name of the structure's part that the next rows belong to; NULL: it has no parts. */
    uint32_t part;
    const char *part_name;
};

/* These add a row and return it, for a warning. Rows beyond STRUCTURE_ROWS_MAX overwrite the last one. */
struct structure_row *structure_number(struct structure_rows *rows, const char *name, uint64_t number);
struct structure_row *structure_metres(struct structure_rows *rows, const char *name, float metres);
struct structure_row *structure_pixels(struct structure_rows *rows, const char *name, float pixels);
struct structure_row *structure_per_ray(struct structure_rows *rows, const char *name, float mean);
/* Says whether the last update built the part: the times of a build with its number are then its own. */
void structure_built(struct structure_rows *rows, bool built);

#endif
