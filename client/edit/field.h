/* SPDX-License-Identifier: MIT */
/* Fields of objects: the values of a set_node, set_material, set_light, set_camera or set_environment as
 * people name them. Pure. */
#ifndef FARLIGHT_CLIENT_EDIT_FIELD_H
#define FARLIGHT_CLIENT_EDIT_FIELD_H

#include "lib/farlight.h"

/* Where a field's values are: fl_field.source. */
enum edit_source {
    EDIT_WIRE,        /* in the message's field `wire`, divided by `scale` */
    EDIT_WIRE_TRIPLE, /* in `wire` and the two fields after it */
    EDIT_TRANSLATE,   /* in a node's matrix */
    EDIT_ROTATE,
    EDIT_SCALE,
    EDIT_MATRIX,
    EDIT_INTENSITY, /* the largest colour channel of a light or the environment */
    EDIT_TURN,      /* of the environment's image */
};

/* False and *error, with field empty: there is none of that name. */
bool edit_field_find(enum protocol_object_kind kind, const char *name, struct fl_field *field,
                     struct fl_error *error);
/* Whether the object has the field: lights do not have those of other kinds of lights. */
bool edit_field_applies(const struct fl_field *field, const struct message *object);
/* The message that makes an object of the kind; MESSAGE_OK: it has no fields. */
enum message_type edit_message_type(enum protocol_object_kind kind);

void edit_field_load(const struct fl_field *field, const struct message *object,
                     double values[FL_FIELD_VALUES_MAX]);
/* field->count values. */
void edit_field_store(const struct fl_field *field, struct message *object, const double *values);
/* Whether so many values may be assigned to it: all, one for all, or a colour without its alpha. */
bool edit_field_takes(const struct fl_field *field, unsigned count);
/* False and *error, with field empty: one of the values is not allowed. */
bool edit_field_check(const struct fl_field *field, const double *values, unsigned count, struct fl_error *error);
/* The name of the field that brings the values back exactly: of angles and scales that is the whole matrix. */
const char *edit_field_to_restore(const struct fl_field *field);

#endif
