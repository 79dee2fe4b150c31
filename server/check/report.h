/* SPDX-License-Identifier: MIT */
/* Report of the checks, row by row as they finish: a table for people, or JSON, one object per line. */
#ifndef FARLIGHT_CHECK_REPORT_H
#define FARLIGHT_CHECK_REPORT_H

#include "base/error.h"

#include <stdbool.h>
#include <stdio.h>

enum check_verdict { CHECK_OK, CHECK_NOTE, CHECK_FAILED }; /* a note is a fact without a requirement */

struct check_report {
    FILE *stream;
    bool json;
    unsigned rows, failed;
};

/* A row: a number beside its bound. */
struct check_row {
    enum check_verdict verdict;
    const char *check, *name; /* "limit", "storage bindings" */
    const char *unit;         /* "" for plain numbers; NULL: no number, only text */
    double value;
    double bound;       /* NAN: none */
    const char *remedy; /* for a failed row; may be NULL */
};

/* Writes a row; `format` is the last column for people. */
void check_report_row(struct check_report *report, const struct check_row *row, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
/* Writes a failed row with an error. */
void check_report_error(struct check_report *report, const char *check, const char *name,
                        const struct error *error);
/* Writes the summary. False: the stream fails. */
bool check_report_end(struct check_report *report);

#endif
