/* SPDX-License-Identifier: MIT */
/* Fields of objects and their values in messages. */
#include "edit/field.h"
#include "edit/turn.h"
#include "protocol/describe.h"
#include "tests/harness/test.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static struct fl_error error;

static struct message made(enum protocol_object_kind kind)
{
    struct message message;
    message_init(&message, edit_message_type(kind));
    if (kind == PROTOCOL_OBJECT_NODE)
        for (int i = 0; i < 3; i++)
            message.set_node.value.parent_from_node[5 * i] = 1;
    return message;
}

static void set(struct message *message, enum protocol_object_kind kind, const char *name, const double *values)
{
    struct fl_field field;
    if (!edit_field_find(kind, name, &field, &error))
        fail_msg("%s", error.text);
    edit_field_store(&field, message, values);
}

TEST(every_value_of_a_material_is_a_field)
{
    struct fl_field fields[FL_FIELDS_MAX];
    const size_t count = fl_fields(PROTOCOL_OBJECT_MATERIAL, fields);
    struct field_desc leaves[FL_FIELDS_MAX];
    const size_t wires = struct_leaves(message_describe(MESSAGE_SET_MATERIAL)->body(), leaves, FL_FIELDS_MAX);
    for (size_t i = 0; i < count; i++)
        assert_true(fields[i].unit && fields[i].doc && fields[i].min < fields[i].max);
    assert_int_equal(count, wires - 1); /* the identifier is no field */
    assert_int_equal(fl_fields(PROTOCOL_OBJECT_MESH, fields), 0);
}

TEST(a_field_that_is_stored_is_loaded_and_leaves_the_others)
{
    static const enum protocol_object_kind kinds[] = {PROTOCOL_OBJECT_MATERIAL, PROTOCOL_OBJECT_LIGHT,
                                                      PROTOCOL_OBJECT_CAMERA, PROTOCOL_OBJECT_ENVIRONMENT};
    for (size_t k = 0; k < sizeof(kinds) / sizeof(kinds[0]); k++) {
        struct fl_field fields[FL_FIELDS_MAX];
        const size_t count = fl_fields(kinds[k], fields);
        assert_true(count > 2);
        for (size_t i = 0; i < count; i++) {
            struct message message = made(kinds[k]), before = message;
            double values[FL_FIELD_VALUES_MAX], loaded[FL_FIELD_VALUES_MAX], kept[FL_FIELD_VALUES_MAX];
            edit_field_load(&fields[i], &message, kept);
            for (unsigned v = 0; v < fields[i].count; v++)
                values[v] = fields[i].max < 100 ? fields[i].max : 7 + v;
            edit_field_store(&fields[i], &message, values);
            edit_field_load(&fields[i], &message, loaded);
            for (unsigned v = 0; v < fields[i].count; v++)
                if (fabs(loaded[v] - values[v]) > 1e-6 * fabs(values[v])) /* a float has 24 bits */
                    fail_msg("%s[%u] is %g, not %g", fields[i].name, v, loaded[v], values[v]);
            if (fields[i].source == EDIT_INTENSITY)
                continue; /* black has no hue to come back to */
            edit_field_store(&fields[i], &message, kept);
            if (memcmp(&message, &before, sizeof(message)) != 0)
                fail_msg("%s changes other fields", fields[i].name);
        }
    }
}

TEST(the_intensity_of_a_light_keeps_its_hue)
{
    struct message light = made(PROTOCOL_OBJECT_LIGHT);
    set(&light, PROTOCOL_OBJECT_LIGHT, "colour", (double[]){4, 2, 1});
    set(&light, PROTOCOL_OBJECT_LIGHT, "intensity", (double[]){8});
    assert_true(light.set_light.value.colour[0] == 8 && light.set_light.value.colour[1] == 4 &&
                light.set_light.value.colour[2] == 2);
    set(&light, PROTOCOL_OBJECT_LIGHT, "intensity", (double[]){0});
    set(&light, PROTOCOL_OBJECT_LIGHT, "intensity", (double[]){3});
    assert_true(light.set_light.value.colour[0] == 3 &&
                light.set_light.value.colour[2] == 3); /* multiples of black are white */
}

TEST(the_environment_turns_as_the_command_line_turns_it)
{
    struct message environment = made(PROTOCOL_OBJECT_ENVIRONMENT);
    struct fl_field field;
    double degrees[FL_FIELD_VALUES_MAX];
    /* The import's: radians, from -z on. */
    static const float turns[] = {-1.57079633f, 0.0f, 1.57079633f}, degrees_of[] = {0.0f, 90.0f, 180.0f};
    assert_true(edit_field_find(PROTOCOL_OBJECT_ENVIRONMENT, "rotation", &field, &error));
    for (size_t i = 0; i < 3; i++) {
        environment.set_environment.value.rotation = turns[i];
        edit_field_load(&field, &environment, degrees);
        assert_true(degrees[0] == (double)degrees_of[i]);
        edit_field_store(&field, &environment, degrees);
        assert_true(environment.set_environment.value.rotation == turns[i]);
    }
}

TEST(lights_have_the_fields_of_their_kind)
{
    static const char *const fields[] = {"range", "outer_cone", "size", "intensity"};
    static const bool has[PROTOCOL_LIGHT_COUNT][4] = {[PROTOCOL_LIGHT_POINT] = {true, false, false, true},
                                                      [PROTOCOL_LIGHT_SPOT] = {true, true, false, true},
                                                      [PROTOCOL_LIGHT_DIRECTIONAL] = {false, false, false, true},
                                                      [PROTOCOL_LIGHT_RECTANGLE] = {false, false, true, true},
                                                      [PROTOCOL_LIGHT_SPHERE] = {false, false, true, true},
                                                      [PROTOCOL_LIGHT_STEADY] = {false, false, false, true}};
    for (int kind = 0; kind < PROTOCOL_LIGHT_COUNT; kind++) {
        struct message light = made(PROTOCOL_OBJECT_LIGHT);
        light.set_light.value.kind = (enum protocol_light_kind)kind;
        for (size_t i = 0; i < 4; i++) {
            struct fl_field field;
            assert_true(edit_field_find(PROTOCOL_OBJECT_LIGHT, fields[i], &field, &error));
            if (edit_field_applies(&field, &light) != has[kind][i])
                fail_msg("%s light, %s", protocol_light_kind_text(light.set_light.value.kind), fields[i]);
        }
    }
}

TEST(angles_and_scales_come_back_from_a_matrix)
{
    static const double angles[][3] = {{0, 0, 0},    {30, 0, 0},    {0, 30, 0},    {0, 0, 30},
                                       {10, 20, 30}, {-170, 80, 5}, {120, -89, 7}, {0, 90, 0}};
    static const double scales[][3] = {{1, 1, 1}, {2, 3, 4}, {-1, 1, 1}, {0.001, 1, 1000}};
    for (size_t a = 0; a < sizeof(angles) / sizeof(angles[0]); a++)
        for (size_t s = 0; s < sizeof(scales) / sizeof(scales[0]); s++) {
            float matrix[12] = {[3] = 5, [7] = 6, [11] = 7}, again[12] = {[3] = 5, [7] = 6, [11] = 7};
            double degrees[3], scale[3];
            edit_turn_store(matrix, angles[a], scales[s]);
            edit_turn_load(matrix, degrees, scale);
            edit_turn_store(again, degrees, scale);
            for (int i = 0; i < 12; i++) /* floats of up to 1000 */
                if (fabsf(matrix[i] - again[i]) > 1e-3f)
                    fail_msg("angles %zu, scale %zu: entry %d is %g, not %g", a, s, i, (double)again[i],
                             (double)matrix[i]);
            for (int i = 0; i < 3; i++)
                assert_true(fabs(scale[i] - scales[s][i]) < 1e-6 * fabs(scales[s][i]) + 1e-9);
        }
}

/* Rotations are as in the shots of animations: about x, then y, then z. */
TEST(a_node_turns_about_x_then_y_then_z)
{
    struct message node = made(PROTOCOL_OBJECT_NODE);
    const float *m = node.set_node.value.parent_from_node;
    set(&node, PROTOCOL_OBJECT_NODE, "translate", (double[]){1, 2, 3});
    set(&node, PROTOCOL_OBJECT_NODE, "rotate", (double[]){90, 0, 90});
    set(&node, PROTOCOL_OBJECT_NODE, "scale", (double[]){2, 1, 1});
    /* x, doubled, goes to y; y goes to z; z goes to -y, and by the second turn to x. */
    static const float expected[12] = {0, 0, 1, 1, 2, 0, 0, 2, 0, 1, 0, 3};
    for (int i = 0; i < 12; i++)
        if (fabsf(m[i] - expected[i]) > 1e-6f)
            fail_msg("entry %d is %g, not %g", i, (double)m[i], (double)expected[i]);
}
