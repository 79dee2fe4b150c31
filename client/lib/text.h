/* SPDX-License-Identifier: MIT */
/* Reading of text that people type: sizes, vectors, numbers, ranges of frames, names of files with a frame
 * number.
 *
 * Each function accepts the whole of `text` or nothing: trailing characters are a failure. On failure it
 * returns false, sets *error (field left empty: the caller knows the option) and leaves its results unchanged.
 * No locale is consulted, nothing is allocated, and user text is never used as a format. Any thread. */
#ifndef FARLIGHT_CLIENT_LIB_TEXT_H
#define FARLIGHT_CLIENT_LIB_TEXT_H

#include "lib/farlight.h"

/* Reads decimal digits only. */
bool fl_text_integer(const char *text, uint64_t minimum, uint64_t maximum, uint64_t *value,
                     struct fl_error *error);
/* Reads a finite decimal number within [minimum, maximum]. */
bool fl_text_real(const char *text, double minimum, double maximum, double *value, struct fl_error *error);
/* Reads seconds: "90", "1.5s", "5m" or "2h"; at most `max_s`. */
/* Sets the error "WHAT: reason" for a file that cannot be written, from errno; lack of space is retryable. */
bool fl_text_write_error(struct fl_error *error, const char *field, const char *what, int number);
bool fl_text_duration(const char *text, double max_s, double *seconds, struct fl_error *error);
/* "1280x720", each edge 1..8192. */
bool fl_text_size(const char *text, uint32_t *width, uint32_t *height, struct fl_error *error);
/* "X,Y,Z" */
bool fl_text_vector(const char *text, float vector[3], struct fl_error *error);
bool fl_text_place(const char *text, double place[3], struct fl_error *error);
/* Reads "#RRGGBB", a displayed colour, and converts it to linear light. */
bool fl_text_colour(const char *text, float linear[3], struct fl_error *error);
/* Reads "A", "A-B" or "A-B:STEP"; A <= B, STEP >= 1. */
bool fl_text_range(const char *text, uint32_t *first, uint32_t *last, uint32_t *step, struct fl_error *error);

/* The known word that was probably meant: at most two letters differ. Initially zero. */
struct fl_nearest {
    const char *name; /* NULL: no known word is near */
    unsigned distance;
};
void fl_nearest_try(struct fl_nearest *nearest, const char *typed, const char *known);

/* Copies as much of `text` as fits, without cutting a character; bytes that are not UTF-8 become '?'. */
void fl_text_utf8(const char *text, char *out, size_t out_bytes);

/* A file name with a place for the frame's number: "%d" or "%0Nd" (N digits, 1..9, filled with zeros) once,
 * in the last component of the path; "%%" is a percent sign. */
struct fl_pattern {
    char before[4096];
    char after[256];
    unsigned digits;
};
bool fl_pattern_parse(const char *text, struct fl_pattern *pattern, struct fl_error *error);
/* The path of one frame; false when it does not fit. */
bool fl_pattern_path(const struct fl_pattern *pattern, uint32_t frame, char *path, size_t path_bytes);

#endif
