/* SPDX-License-Identifier: MIT */
/* Names of objects for mattes. */
#include "lib/names.h"

#include "tests/harness/test.h"

static void expect(const struct fl_object *objects, size_t count, enum protocol_object_kind kind,
                   const char *const *expected)
{
    struct fl_error error = {0};
    char **names = NULL;
    assert_true(fl_names_make(objects, count, kind, &names, &error));
    for (size_t i = 0; i < count; i++) {
        if (expected[i])
            assert_string_equal(names[i], expected[i]);
        else
            assert_null(names[i]);
    }
    fl_names_free(names, count);
}

TEST(nodes_that_share_a_name_are_told_apart_by_what_they_hang_below_then_by_their_numbers)
{
    const struct fl_object objects[] = {
        {.id = 1, .name = "car", .shows_kind = PROTOCOL_NODE_MESH},
        {.id = 2, .name = "front", .parent = 1},
        {.id = 3, .name = "wheel", .parent = 2, .shows_kind = PROTOCOL_NODE_MESH},
        {.id = 4, .parent = 1},
        {.id = 5, .name = "wheel", .parent = 4, .shows_kind = PROTOCOL_NODE_SPHERES},
        {.id = 6, .name = "wheel", .parent = 2, .shows_kind = PROTOCOL_NODE_MESH},
        {.id = 7, .parent = 1, .shows_kind = PROTOCOL_NODE_MESH},
        {.id = 8, .name = "car", .parent = 99, .shows_kind = PROTOCOL_NODE_LIGHT},
        {.id = 9, .name = "chair", .shows_kind = PROTOCOL_NODE_GROUP},
        {.id = 10, .name = "chair/seat", .parent = 9, .shows_kind = PROTOCOL_NODE_MESH},
        {.id = 11, .name = "chair/seat", .parent = 9, .shows_kind = PROTOCOL_NODE_MESH},
    };
    const char *const expected[] = {
        "car", NULL, "car/front/wheel#3", NULL,           "car/wheel", "car/front/wheel#6", "#7",
        NULL,  NULL, "chair/seat#10",     "chair/seat#11"};
    expect(objects, sizeof(objects) / sizeof(objects[0]), PROTOCOL_OBJECT_NODE, expected);
}

TEST(nodes_that_hang_below_one_another_in_a_circle_have_names)
{
    const struct fl_object objects[] = {{.id = 1, .name = "a", .parent = 2, .shows_kind = PROTOCOL_NODE_MESH},
                                        {.id = 2, .name = "a", .parent = 1, .shows_kind = PROTOCOL_NODE_MESH}};
    struct fl_error error = {0};
    char **names = NULL;
    assert_true(fl_names_make(objects, 2, PROTOCOL_OBJECT_NODE, &names, &error));
    assert_string_not_equal(names[0], names[1]);
    fl_names_free(names, 2);
}

TEST(materials_have_their_names_and_numbers_where_these_are_missing_or_shared)
{
    const struct fl_object objects[] = {
        {.id = 1, .name = "red"}, {.id = 2}, {.id = 4, .name = "red"}, {.id = 5, .name = "blue"}};
    const char *const expected[] = {"red#1", "#2", "red#4", "blue"};
    expect(objects, 4, PROTOCOL_OBJECT_MATERIAL, expected);
}
