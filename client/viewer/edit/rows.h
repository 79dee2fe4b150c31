/* SPDX-License-Identifier: MIT */
/* The fields of an object as rows of one number each: what they show, and what keys, drags and typed numbers make
 * of them. Independent of window and daemon. */
#ifndef FARLIGHT_VIEWER_EDIT_ROWS_H
#define FARLIGHT_VIEWER_EDIT_ROWS_H

#include "lib/farlight.h"
#include "viewer/overlay/edit_panel.h"

struct edit_row {
    size_t field;       /* of the state's */
    unsigned component; /* of its values */
};

/* Returns how many there are, at most `max`. Matrices have none. */
size_t edit_rows(const struct fl_object_state *state, struct edit_row *rows, size_t max);
double edit_row_value(const struct fl_object_state *state, struct edit_row row);
/* What the panel shows of it. */
void edit_row_show(const struct fl_object_state *state, struct edit_row row, struct hud_edit_row *shown);
const char *edit_row_hint(const struct fl_object_state *state, struct edit_row row);

/* A flag or a word: it goes around, and cannot be dragged. */
bool edit_row_is_choice(const struct fl_object_state *state, struct edit_row row);

/* The functions below return a new value, within the field's range. `metre`: a length that is a step in the scene.
 */

/* `steps` of a key: choices go around, bounded numbers move by a share of their range, others grow. */
double edit_row_step(const struct fl_object_state *state, struct edit_row row, double steps, double metre);
/* Its slider at that share. */
double edit_row_slide(const struct fl_object_state *state, struct edit_row row, double share);
/* Dragged so far from where it was `from`, pixels of the desktop: without a slider there is no end to it. */
double edit_row_drag(const struct fl_object_state *state, struct edit_row row, double from, double pixels,
                     double metre);
/* A typed number. False: it is none, and *error says what it may be. */
bool edit_row_read(const struct fl_object_state *state, struct edit_row row, const char *text, double *value,
                   struct fl_error *error);

/* The row's field with that value in the row's place. */
void edit_row_assign(const struct fl_object_state *state, struct edit_row row, double value,
                     struct fl_assignment *assignment);

#endif
