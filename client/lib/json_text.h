/* SPDX-License-Identifier: MIT */
/* A JSON file together with its text, so that errors can name the line; Jansson knows lines only of syntax
 * errors. Any thread. */
#ifndef FARLIGHT_CLIENT_LIB_JSON_TEXT_H
#define FARLIGHT_CLIENT_LIB_JSON_TEXT_H

#include "lib/farlight.h"

#include <jansson.h>

struct fl_json {
    char *text; /* text of the file */
    size_t length;
    json_t *root;
};

/* Reads a file of at most `max_bytes`. An error names the file, the line and the column. */
bool fl_json_load(struct fl_json *json, const char *path, size_t max_bytes, struct fl_error *error);
void fl_json_finish(struct fl_json *json);

/* A step on the path from the root to a value: a member of an object or an element of an array. NULL: the root. */
struct fl_json_place {
    const struct fl_json_place *outer;
    const char *key; /* NULL: an element */
    size_t index;
};

/* The line, from 1, of the member's key or the element; if it is missing, the line of the innermost existing
 * place. */
unsigned fl_json_line(const struct fl_json *json, const struct fl_json_place *place);
/* Writes "lights[2].colour", cut off where it does not fit; empty for the root. */
void fl_json_path(const struct fl_json_place *place, char *path, size_t path_bytes);

#endif
