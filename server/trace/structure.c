/* SPDX-License-Identifier: MIT */
/* Rows that describe a structure. */
#include "trace/structure.h"

#include <stdio.h>

static struct structure_row *add(struct structure_rows *rows, const char *name, enum unit unit)
{
    if (rows->count < STRUCTURE_ROWS_MAX)
        rows->count++;
    struct structure_row *row = &rows->rows[rows->count - 1];
    *row = (struct structure_row){.part = rows->part, .unit = unit};
    snprintf(row->name, sizeof(row->name), "%s%s%s", rows->part_name ? rows->part_name : "",
             rows->part_name ? "/" : "", name);
    return row;
}

struct structure_row *structure_number(struct structure_rows *rows, const char *name, uint64_t number)
{
    struct structure_row *row = add(rows, name, UNIT_NUMBER);
    row->number = number;
    return row;
}

struct structure_row *structure_metres(struct structure_rows *rows, const char *name, float metres)
{
    struct structure_row *row = add(rows, name, UNIT_METRES);
    row->measure = metres;
    return row;
}

struct structure_row *structure_pixels(struct structure_rows *rows, const char *name, float pixels)
{
    struct structure_row *row = add(rows, name, UNIT_PIXELS);
    row->measure = pixels;
    return row;
}

struct structure_row *structure_per_ray(struct structure_rows *rows, const char *name, float mean)
{
    struct structure_row *row = add(rows, name, UNIT_PER_RAY);
    row->measure = mean;
    return row;
}

void structure_built(struct structure_rows *rows, bool built)
{
    add(rows, "built", UNIT_BUILT)->number = built;
}
