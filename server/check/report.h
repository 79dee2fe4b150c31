/* SPDX-License-Identifier: MIT */
/* What was found, row by row, as it is found: a table for people, or JSON, one object a line. */
#ifndef FARLIGHT_CHECK_REPORT_H
#define FARLIGHT_CHECK_REPORT_H

#include "base/error.h"

#include <stdbool.h>
#include <stdio.h>

enum check_verdict { CHECK_OK, CHECK_NOTE, CHECK_FAILED }; /* a note is a fact that nothing is asked of */

struct check_report {
    FILE *stream;
    bool json;
    unsigned rows, failed;
};

/* A number beside what it must be. */
struct check_row {
    enum check_verdict verdict;
    const char *check, *name; /* "limit", "storage bindings" */
    const char *unit;         /* "" for plain numbers; NULL: there is no number, the text says all */
    double value;
    double bound;       /* NAN: none */
    const char *remedy; /* of one that failed; may be NULL */
};

/* `format` is what people read in the last column. */
void check_report_row(struct check_report *report, const struct check_row *row, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
/* One that failed with an error. */
void check_report_error(struct check_report *report, const char *check, const char *name,
                        const struct error *error);
/* The sum. False: the stream fails. */
bool check_report_end(struct check_report *report);

#endif
