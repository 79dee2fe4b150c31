/* SPDX-License-Identifier: MIT */
/* The parts of a tracer's structure, as lines for people. */
#include "lib/farlight.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "protocol/plain_text.h"

/* The row's own name, which follows the name of the part. */
static const char *own_name(const struct record_structure_row *row)
{
    const char *slash = strchr(row->name, '/');
    return slash ? slash + 1 : row->name;
}

static void append(char *text, size_t text_bytes, const char *more)
{
    const size_t length = strlen(text);
    snprintf(text + length, text_bytes - length, "%s", more);
}

/* Prints a length with a suitable unit. */
static void print_length(char *text, size_t text_bytes, double metres)
{
    if (metres >= 1000)
        snprintf(text, text_bytes, "%.4g km", metres * 1e-3);
    else if (metres >= 0.1)
        snprintf(text, text_bytes, "%.4g m", metres);
    else
        snprintf(text, text_bytes, "%.4g mm", metres * 1e3);
}

/* Appends a row, as "layers kept 6". */
static void append_row(char *text, size_t text_bytes, const struct record_structure_row *row)
{
    char name[FL_STRUCTURE_NAME_BYTES], value[32];
    snprintf(name, sizeof(name), "%s%s", text[0] != '\0' ? ", " : "", own_name(row));
    for (char *c = name; *c != '\0'; c++)
        *c = *c == '_' ? ' ' : *c;
    plain_text_copy(name, sizeof(name), name); /* text from a daemon must not control the terminal */
    if (row->unit == PROTOCOL_UNIT_METRES)
        print_length(value, sizeof(value), (double)row->measure);
    else if (row->unit == PROTOCOL_UNIT_PIXELS)
        snprintf(value, sizeof(value), "%.3g pixels", (double)row->measure);
    else if (row->unit == PROTOCOL_UNIT_PER_RAY)
        snprintf(value, sizeof(value), row->measure < 100 ? "%.3g a ray" : "%.0f a ray", (double)row->measure);
    else
        snprintf(value, sizeof(value), "%" PRIu64, row->number);
    append(text, text_bytes, name);
    append(text, text_bytes, " ");
    append(text, text_bytes, value);
}

bool fl_structure_next(const struct fl_frame *frame, size_t *at, struct fl_structure_part *part)
{
    if (*at >= frame->structure_count)
        return false;
    const struct record_structure_row *row = &frame->structure[*at];
    *part = (struct fl_structure_part){.number = row->part};
    snprintf(part->name, sizeof(part->name), "%.*s", (int)(own_name(row) - row->name), row->name);
    if (part->name[0] != '\0')
        part->name[strlen(part->name) - 1] = '\0'; /* the slash */
    plain_text_copy(part->name, sizeof(part->name), part->name);
    for (; *at < frame->structure_count && frame->structure[*at].part == part->number; ++*at) {
        row = &frame->structure[*at];
        if (row->unit != PROTOCOL_UNIT_BUILT) {
            append_row(part->text, sizeof(part->text), row);
            continue;
        }
        part->is_kept = true;
        part->built = row->number != 0;
    }
    return true;
}
