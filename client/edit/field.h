/* SPDX-License-Identifier: MIT */
/* Fields of objects under the names that people use: the values in set_node, set_material, set_light,
 * set_camera and set_environment. Pure. */
#ifndef FARLIGHT_CLIENT_EDIT_FIELD_H
#define FARLIGHT_CLIENT_EDIT_FIELD_H

#include "lib/farlight.h"

/* Storage of a field's values: fl_field.source. */
enum edit_source {
    EDIT_WIRE,      /* the field `wire` of the message's record, divided by `scale` */
    EDIT_TRANSLATE, /* a node's matrix */
    EDIT_ROTATE,
    EDIT_SCALE,
    EDIT_MATRIX,
    EDIT_INTENSITY, /* the largest colour channel of a light or the environment */
    EDIT_TURN,      /* rotation of the environment's image */
};

/* Finds a field by name. False and *error, with field empty: there is none. */
bool edit_field_find(enum protocol_object_kind kind, const char *name, struct fl_field *field,
                     struct fl_error *error);
/* True if the object has the field: a light lacks the fields of other kinds of lights. */
bool edit_field_applies(const struct fl_field *field, const struct message *object);
/* The message that creates an object of this kind; MESSAGE_OK: the kind has no fields. */
enum message_type edit_message_type(enum protocol_object_kind kind);

void edit_field_load(const struct fl_field *field, const struct message *object,
                     double values[FL_FIELD_VALUES_MAX]);
/* Stores field->count values. */
void edit_field_store(const struct fl_field *field, struct message *object, const double *values);
/* True if this number of values may be assigned: all, one for all, or a colour without its alpha. */
bool edit_field_takes(const struct fl_field *field, unsigned count);
/* Checks the values. False and *error, with field empty: one is not allowed. */
bool edit_field_check(const struct fl_field *field, const double *values, unsigned count, struct fl_error *error);
/* The name of the field that restores the values exactly: for angles and scales the whole matrix. */
const char *edit_field_to_restore(const struct fl_field *field);

#endif
