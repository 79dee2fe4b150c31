/* SPDX-License-Identifier: MIT */
/* Fields of objects that can be edited. Fields of materials, lights and cameras come from the records
 * of values.def, so that new ones need no code here; fields of nodes and of the environment, and the intensity of
 * lights, are computed from messages. */
#include "edit/field.h"

#include "edit/turn.h"
#include "lib/text.h"
#include "protocol/describe.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define RADIANS_PER_DEGREE 0.017453292519943295
#define COORDINATE_MAX 1e12 /* the protocol's limit */
#define SCALE_MAX 1e6
#define ANGLE_MAX 3.6e6
#define TURN_MAX 3600.0    /* degrees, environment; the protocol allows 100 radians */
#define TURN_OF_IMAGE 90.0 /* the middle column is +x, as for --environment-rotation; in the protocol it is -z */
#define ANGLE_STEP 1e-4    /* degrees: an angle from a matrix of floats is no more precise */

/* ---- units ---- */

/* Units of fields that have none in values.def. */
static const struct {
    const char *name, *unit;
    double scale; /* value in the message of one unit */
} units[] = {
    {"anisotropy_rotation", "degrees", RADIANS_PER_DEGREE},
    {"inner_cone", "degrees", RADIANS_PER_DEGREE},
    {"outer_cone", "degrees", RADIANS_PER_DEGREE},
    {"fov_y", "degrees", RADIANS_PER_DEGREE},
    {"attenuation_distance", "metres", 1},
    {"thickness", "metres", 1},
    {"range", "metres", 1},
    {"size", "metres", 1},
    {"height", "metres", 1},
    {"near", "metres", 1},
    {"emission", "W/(m2 sr)", 1},
};

static void set_unit(struct fl_field *field)
{
    field->scale = 1;
    if (!field->unit)
        field->unit = "";
    for (size_t i = 0; i < sizeof(units) / sizeof(units[0]); i++) {
        if (strcmp(units[i].name, field->name) != 0)
            continue;
        field->unit = units[i].unit;
        field->scale = units[i].scale;
        field->min /= field->scale;
        field->max /= field->scale;
    }
}

/* ---- the tables ---- */

enum message_type edit_message_type(enum protocol_object_kind kind)
{
    return kind == PROTOCOL_OBJECT_NODE          ? MESSAGE_SET_NODE
           : kind == PROTOCOL_OBJECT_MATERIAL    ? MESSAGE_SET_MATERIAL
           : kind == PROTOCOL_OBJECT_LIGHT       ? MESSAGE_SET_LIGHT
           : kind == PROTOCOL_OBJECT_CAMERA      ? MESSAGE_SET_CAMERA
           : kind == PROTOCOL_OBJECT_ENVIRONMENT ? MESSAGE_SET_ENVIRONMENT
                                                 : MESSAGE_OK;
}

/* True for three numbers that cannot be negative, or four with an alpha, which are colours in all messages of
 * objects. */
static bool is_colour(const struct fl_field *field)
{
    return (field->count == 3 || field->count == 4) && field->min >= 0;
}

static struct fl_field of_wire(const struct field_desc *wire)
{
    struct fl_field field = {.count = 1, .source = EDIT_WIRE, .wire = wire, .doc = wire->doc, .unit = wire->unit};
    snprintf(field.name, sizeof(field.name), "%s", wire->name);
    if (wire->kind == FIELD_ENUM) {
        field.form = FL_FIELD_WORD;
        field.max = (double)wire->enumeration->values[wire->enumeration->value_count - 1].number;
    } else if (wire->kind == FIELD_INT) {
        field.form = wire->min == 0 && wire->max == 1 ? FL_FIELD_FLAG : FL_FIELD_NUMBERS;
        field.min = (double)wire->min;
        field.max = (double)wire->max;
    } else {
        field.count = wire->count;
        field.min = (double)wire->real_min;
        field.max = (double)wire->real_max;
    }
    field.form = is_colour(&field) ? FL_FIELD_COLOUR : field.form;
    set_unit(&field);
    return field;
}

static struct fl_field made(const char *name, enum edit_source source, unsigned count, double max)
{
    struct fl_field field = {.source = source, .count = count, .min = -max, .max = max, .scale = 1, .unit = ""};
    snprintf(field.name, sizeof(field.name), "%s", name);
    return field;
}

static size_t node_fields(const struct struct_desc *record, struct fl_field fields[FL_FIELDS_MAX])
{
    fields[0] = made("translate", EDIT_TRANSLATE, 3, COORDINATE_MAX);
    fields[0].unit = "metres";
    fields[0].doc = "from the place of its parent";
    fields[1] = made("rotate", EDIT_ROTATE, 3, ANGLE_MAX);
    fields[1].unit = "degrees";
    fields[1].doc = "about x, then y, then z";
    fields[2] = made("scale", EDIT_SCALE, 3, SCALE_MAX);
    fields[2].doc = "along x, y and z; one number: along all";
    fields[3] = of_wire(struct_field(record, "hidden"));
    fields[4] = made("matrix", EDIT_MATRIX, 12, COORDINATE_MAX);
    fields[4].doc = "the whole transform: 3x4, row by row";
    fields[5] = of_wire(struct_field(record, "light_group"));
    return 6;
}

static struct fl_field intensity(double max, const char *doc)
{
    struct fl_field field = made("intensity", EDIT_INTENSITY, 1, max);
    field.min = 0;
    field.doc = doc;
    return field;
}

/* Fields of the environment, without its image. */
static size_t environment_fields(const struct struct_desc *record, struct fl_field fields[FL_FIELDS_MAX])
{
    fields[1] = of_wire(struct_field(record, "colour"));
    fields[0] = intensity(fields[1].max, "the largest of the colour's numbers");
    fields[2] = made("rotation", EDIT_TURN, 1, TURN_MAX);
    fields[2].unit = "degrees";
    fields[2].doc = "turn of the image about +y; 0: its middle column is +x";
    fields[3] = of_wire(struct_field(record, "backdrop"));
    fields[4] = of_wire(struct_field(record, "display_values"));
    fields[5] = of_wire(struct_field(record, "light_group"));
    return 6;
}

size_t fl_fields(enum protocol_object_kind kind, struct fl_field fields[FL_FIELDS_MAX])
{
    const enum message_type type = edit_message_type(kind);
    size_t count = 0;
    if (type == MESSAGE_OK)
        return 0;
    const struct struct_desc *record = struct_field(message_describe(type)->body(), "value")->record();
    if (type == MESSAGE_SET_NODE)
        return node_fields(record, fields);
    if (type == MESSAGE_SET_ENVIRONMENT)
        return environment_fields(record, fields);
    if (type == MESSAGE_SET_LIGHT)
        fields[count++] =
            intensity(COORDINATE_MAX, "the largest of the colour's numbers, in the unit of the light's kind");
    for (const struct field_desc *wire = record->fields; wire->name && count < FL_FIELDS_MAX; wire++)
        if (strcmp(wire->name, "kind") != 0) /* an object keeps its kind */
            fields[count++] = of_wire(wire);
    return count;
}

/* Sets the remedy: "it has translate, rotate, ..", as far as the names fit. */
static void list_fields(const struct fl_field *fields, size_t count, struct fl_error *error)
{
    size_t used = (size_t)snprintf(error->remedy, sizeof(error->remedy), "it has");
    for (size_t i = 0; i < count; i++) {
        const size_t room = sizeof(error->remedy) - used;
        if (strlen(fields[i].name) + sizeof(", ..") + 2 > room) {
            snprintf(error->remedy + used, room, ", ..");
            return;
        }
        used += (size_t)snprintf(error->remedy + used, room, "%s %s", i > 0 ? "," : "", fields[i].name);
    }
}

bool edit_field_find(enum protocol_object_kind kind, const char *name, struct fl_field *field,
                     struct fl_error *error)
{
    struct fl_field fields[FL_FIELDS_MAX];
    struct fl_nearest nearest = {0};
    const size_t count = fl_fields(kind, fields);
    for (size_t i = 0; i < count; i++) {
        if (strcmp(fields[i].name, name) == 0) {
            *field = fields[i];
            return true;
        }
        fl_nearest_try(&nearest, name, fields[i].name);
    }
    fl_error_set(error, FL_ERROR_ARGUMENT, "", "%s %s has no field '%s'",
                 kind == PROTOCOL_OBJECT_ENVIRONMENT ? "an" : "a", protocol_object_kind_text(kind), name);
    if (nearest.name)
        return fl_error_remedy(error, "did you mean '%s'?", nearest.name);
    if (error)
        list_fields(fields, count, error);
    return false;
}

bool edit_field_applies(const struct fl_field *field, const struct message *object)
{
    if (object->type != MESSAGE_SET_LIGHT)
        return true;
    const enum protocol_light_kind kind = object->set_light.value.kind;
    if (strcmp(field->name, "range") == 0)
        return kind == PROTOCOL_LIGHT_POINT || kind == PROTOCOL_LIGHT_SPOT;
    if (strcmp(field->name, "inner_cone") == 0 || strcmp(field->name, "outer_cone") == 0)
        return kind == PROTOCOL_LIGHT_SPOT;
    return strcmp(field->name, "size") != 0 || kind == PROTOCOL_LIGHT_RECTANGLE || kind == PROTOCOL_LIGHT_SPHERE;
}

const char *fl_field_word(const struct fl_field *field, unsigned number)
{
    return field->form == FL_FIELD_WORD ? enum_desc_text(field->wire->enumeration, number) : NULL;
}

/* ---- values ---- */

/* Where the value of the field is; the object is a message of the field's kind. */
static char *place_of(const struct fl_field *field, const struct message *object)
{
    const struct struct_desc *body = message_describe(object->type)->body();
    return (char *)object + MESSAGE_BODY_OFFSET + struct_field(body, "value")->offset + field->wire->offset;
}

static void load_wire(const struct fl_field *field, const struct message *object, double *values)
{
    const char *place = place_of(field, object);
    for (unsigned i = 0; i < field->count; i++, place += sizeof(float)) {
        float real;
        if (field->wire->kind != FIELD_REAL) {
            values[i] = (double)field_load_int(field->wire, place);
            continue;
        }
        memcpy(&real, place, sizeof(real));
        values[i] = (double)real / field->scale;
    }
}

static void store_wire(const struct fl_field *field, struct message *object, const double *values)
{
    const struct field_desc *wire = field->wire;
    char *place = place_of(field, object);
    for (unsigned i = 0; i < field->count; i++, place += sizeof(float)) {
        if (wire->kind != FIELD_REAL) {
            field_store_int(wire, place, (uint64_t)llround(values[i]));
            continue;
        }
        const float real = fminf(fmaxf((float)(values[i] * field->scale), wire->real_min), wire->real_max);
        memcpy(place, &real, sizeof(real));
    }
}

static double intensity_of(const float colour[3])
{
    return (double)fmaxf(colour[0], fmaxf(colour[1], colour[2]));
}

void edit_field_load(const struct fl_field *field, const struct message *object,
                     double values[FL_FIELD_VALUES_MAX])
{
    const float *matrix = object->set_node.value.parent_from_node; /* nodes only */
    double unused[3];
    switch ((enum edit_source)field->source) {
    case EDIT_WIRE:
        load_wire(field, object, values);
        return;
    case EDIT_TRANSLATE:
        for (int i = 0; i < 3; i++)
            values[i] = (double)matrix[4 * i + 3];
        return;
    case EDIT_ROTATE:
        edit_turn_load(matrix, values, unused);
        for (int i = 0; i < 3; i++)
            values[i] = rint(values[i] / ANGLE_STEP) * ANGLE_STEP + 0.0; /* avoids -0 */
        return;
    case EDIT_SCALE:
        edit_turn_load(matrix, unused, values);
        return;
    case EDIT_MATRIX:
        for (int i = 0; i < 12; i++)
            values[i] = (double)matrix[i];
        return;
    case EDIT_INTENSITY:
        values[0] = intensity_of(object->type == MESSAGE_SET_LIGHT ? object->set_light.value.colour
                                                                   : object->set_environment.value.colour);
        return;
    case EDIT_TURN:
        values[0] = (double)object->set_environment.value.rotation / RADIANS_PER_DEGREE + TURN_OF_IMAGE;
        values[0] = rint(values[0] / ANGLE_STEP) * ANGLE_STEP + 0.0;
        return;
    }
}

static void store_intensity(float colour[3], double intensity)
{
    const double before = intensity_of(colour);
    for (int i = 0; i < 3; i++)
        colour[i] = (float)(before > 0 ? (double)colour[i] / before * intensity : intensity);
}

void edit_field_store(const struct fl_field *field, struct message *object, const double *values)
{
    float *matrix = object->set_node.value.parent_from_node;
    double degrees[3], scale[3];
    switch ((enum edit_source)field->source) {
    case EDIT_WIRE:
        store_wire(field, object, values);
        return;
    case EDIT_TRANSLATE:
        for (int i = 0; i < 3; i++)
            matrix[4 * i + 3] = (float)values[i];
        return;
    case EDIT_ROTATE:
        edit_turn_load(matrix, degrees, scale);
        edit_turn_store(matrix, values, scale);
        return;
    case EDIT_SCALE:
        edit_turn_load(matrix, degrees, scale);
        edit_turn_store(matrix, degrees, values);
        return;
    case EDIT_MATRIX:
        for (int i = 0; i < 12; i++)
            matrix[i] = (float)values[i];
        return;
    case EDIT_INTENSITY:
        store_intensity(object->type == MESSAGE_SET_LIGHT ? object->set_light.value.colour
                                                          : object->set_environment.value.colour,
                        values[0]);
        return;
    case EDIT_TURN:
        object->set_environment.value.rotation = (float)((values[0] - TURN_OF_IMAGE) * RADIANS_PER_DEGREE);
        return;
    }
}

static bool has_one_for_all(const struct fl_field *field)
{
    return field->form == FL_FIELD_COLOUR || field->source == EDIT_SCALE || strcmp(field->name, "size") == 0;
}

bool edit_field_takes(const struct fl_field *field, unsigned count)
{
    return count == field->count || (count == 1 && has_one_for_all(field)) ||
           (count == 3 && field->form == FL_FIELD_COLOUR);
}

bool edit_field_check(const struct fl_field *field, const double *values, unsigned count, struct fl_error *error)
{
    for (unsigned i = 0; i < count; i++) {
        if (values[i] >= field->min && values[i] <= field->max)
            continue;
        return fl_error_set(error, FL_ERROR_ARGUMENT, "", "%s is %.9g%s%s, but must be %.9g to %.9g", field->name,
                            values[i], field->unit[0] ? " " : "", field->unit, field->min, field->max);
    }
    return true;
}

const char *edit_field_to_restore(const struct fl_field *field)
{
    const enum edit_source source = (enum edit_source)field->source;
    return source == EDIT_TRANSLATE || source == EDIT_ROTATE || source == EDIT_SCALE ? "matrix"
           : source == EDIT_INTENSITY                                                ? "colour"
                                                                                     : field->name;
}
