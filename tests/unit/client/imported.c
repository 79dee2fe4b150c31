/* SPDX-License-Identifier: MIT */
/* Differences from one import of a model to the next. */
#include "lib/imported.h"
#include "tests/harness/test.h"

static struct fl_error error;

/* An edit of a node; its content stands in place of the payload. */
static bool add(struct fl_imported *imported, uint32_t node, uint32_t content)
{
    const struct message message = {.type = MESSAGE_SET_NODE, .set_node.node = node};
    const struct frame frame = {.header.payload_bytes = sizeof(content), .payload = (const uint8_t *)&content};
    return fl_imported_add(imported, &frame, &message, &error);
}

static bool has(const struct fl_imported *imported, enum message_type type, uint32_t object, uint32_t content)
{
    struct message message = {.type = type};
    const struct frame frame = {.header.payload_bytes = sizeof(content), .payload = (const uint8_t *)&content};
    if (type == MESSAGE_SET_NODE)
        message.set_node.node = object;
    else
        message.set_material.material = object;
    return fl_imported_has(imported, &frame, &message);
}

TEST(an_edit_is_known_while_its_object_is_as_it_was)
{
    struct fl_imported imported = {0};
    assert_false(has(&imported, MESSAGE_SET_NODE, 1, 7));
    for (uint32_t node = 1; node <= 1000; node++)
        assert_true(add(&imported, node, node + 6));
    assert_int_equal(imported.count, 1000);
    assert_true(has(&imported, MESSAGE_SET_NODE, 1, 7));
    assert_true(has(&imported, MESSAGE_SET_NODE, 1000, 1006));
    assert_false(has(&imported, MESSAGE_SET_NODE, 1, 8));
    assert_false(has(&imported, MESSAGE_SET_NODE, 1001, 7));
    assert_false(has(&imported, MESSAGE_SET_MATERIAL, 1, 7));
    assert_true(add(&imported, 1, 8));
    assert_int_equal(imported.count, 1000);
    assert_true(has(&imported, MESSAGE_SET_NODE, 1, 8));
    fl_imported_finish(&imported);
}

TEST(objects_that_are_gone_are_named)
{
    struct fl_imported before = {0}, now = {0};
    size_t cursor = 0;
    assert_null(fl_imported_gone(&now, &before, &cursor));
    assert_true(add(&before, 1, 7) && add(&before, 2, 7));
    assert_true(add(&now, 2, 8) && add(&now, 3, 8));
    const struct fl_imported_object *gone = fl_imported_gone(&now, &before, &cursor);
    assert_non_null(gone);
    assert_int_equal(gone->kind, PROTOCOL_OBJECT_NODE);
    assert_int_equal(gone->id, 1);
    assert_null(fl_imported_gone(&now, &before, &cursor));
    fl_imported_finish(&now);
    now = (struct fl_imported){0};
    cursor = 0;
    for (int i = 0; i < 2; i++)
        assert_non_null(fl_imported_gone(&now, &before, &cursor));
    assert_null(fl_imported_gone(&now, &before, &cursor));
    fl_imported_finish(&before);
}
