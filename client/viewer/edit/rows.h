/* SPDX-License-Identifier: MIT */
/* The fields of an object as rows of one number each: their display, and the effects of keys, drags and typed
 * numbers. Independent of window and daemon. */
#ifndef FARLIGHT_VIEWER_EDIT_ROWS_H
#define FARLIGHT_VIEWER_EDIT_ROWS_H

#include "lib/farlight.h"
#include "viewer/overlay/edit_panel.h"

struct edit_row {
    size_t field;       /* index among the object's fields */
    unsigned component; /* index among the field's values */
};

/* Lists the rows, at most `max`, and returns their number. Matrices have none. */
size_t edit_rows(const struct fl_object_state *state, struct edit_row *rows, size_t max);
double edit_row_value(const struct fl_object_state *state, struct edit_row row);
/* Fills in the panel's row. */
void edit_row_show(const struct fl_object_state *state, struct edit_row row, struct hud_edit_row *shown);
const char *edit_row_hint(const struct fl_object_state *state, struct edit_row row);

/* True for a flag or a word, which cycles and cannot be dragged. */
bool edit_row_is_choice(const struct fl_object_state *state, struct edit_row row);

/* The functions below return a new value, within the field's range. `metre`: a suitable step of lengths in the
 * scene. */

/* Applies `steps` of a key: choices cycle, bounded numbers move by a share of their range, others grow. */
double edit_row_step(const struct fl_object_state *state, struct edit_row row, double steps, double metre);
/* Sets the slider to a share. */
double edit_row_slide(const struct fl_object_state *state, struct edit_row row, double share);
/* Applies a drag of `pixels` of the desktop from the value `from`; without a slider it is unlimited. */
double edit_row_drag(const struct fl_object_state *state, struct edit_row row, double from, double pixels,
                     double metre);
/* Reads a typed number. False: it is invalid, and *error has the allowed values. */
bool edit_row_read(const struct fl_object_state *state, struct edit_row row, const char *text, double *value,
                   struct fl_error *error);

/* Makes an assignment of the row's field, with this value in the row's component. */
void edit_row_assign(const struct fl_object_state *state, struct edit_row row, double value,
                     struct fl_assignment *assignment);

#endif
