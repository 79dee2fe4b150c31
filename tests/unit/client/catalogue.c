/* SPDX-License-Identifier: MIT */
/* Names of an import's objects: their order, numbers and look-up. */
#include "lib/catalogue.h"
#include "tests/harness/test.h"

#include <stdio.h>
#include <string.h>

static struct fl_catalogue catalogue;
static struct fl_error error;

static int empty(void **state)
{
    (void)state;
    fl_catalogue_finish(&catalogue);
    error = (struct fl_error){0};
    return 0;
}

static void add_node(uint32_t id, const char *name, enum protocol_node_kind kind, uint32_t object)
{
    struct message message;
    message_init(&message, MESSAGE_SET_NODE);
    message.set_node.node = id;
    message.set_node.name = name;
    message.set_node.value.kind = kind;
    message.set_node.value.object = object;
    assert_true(fl_catalogue_observe(&catalogue, &message, &error));
}

static void add_light(uint32_t id, const char *name, enum protocol_light_kind kind)
{
    struct message message;
    message_init(&message, MESSAGE_SET_LIGHT);
    message.set_light.light = id;
    message.set_light.name = name;
    message.set_light.value.kind = kind;
    assert_true(fl_catalogue_observe(&catalogue, &message, &error));
}

static void add_clip(uint32_t id, const char *name, float duration_s)
{
    struct message message;
    message_init(&message, MESSAGE_IMPORT_CLIP);
    message.import_clip.clip = id;
    message.import_clip.name = name;
    message.import_clip.duration_s = duration_s;
    assert_true(fl_catalogue_observe(&catalogue, &message, &error));
}

static uint32_t find(enum protocol_object_kind kind, const char *which)
{
    uint32_t id = 0;
    error = (struct fl_error){0};
    return fl_catalogue_find(&catalogue, kind, which, &id, &error) ? id : 0;
}

EACH_TEST(empty, NULL)

TEST(an_object_is_found_by_name_before_number)
{
    add_node(10, "arm", PROTOCOL_NODE_GROUP, 0);
    add_node(20, "", PROTOCOL_NODE_GROUP, 0);
    add_node(30, "0", PROTOCOL_NODE_GROUP, 0);
    add_node(40, "arm", PROTOCOL_NODE_GROUP, 0);
    assert_int_equal(find(PROTOCOL_OBJECT_NODE, "arm"), 10);
    assert_int_equal(find(PROTOCOL_OBJECT_NODE, "0"), 30);
    assert_int_equal(find(PROTOCOL_OBJECT_NODE, "1"), 20);
    assert_int_equal(find(PROTOCOL_OBJECT_NODE, "4"), 0);
    assert_int_equal(find(PROTOCOL_OBJECT_NODE, ""), 0);
    assert_int_equal(find(PROTOCOL_OBJECT_MATERIAL, "arm"), 0);
    assert_int_equal(find(PROTOCOL_OBJECT_MESH, "0"), 0);
}

TEST(a_light_is_also_known_by_the_node_that_shows_it)
{
    add_light(7, "", PROTOCOL_LIGHT_POINT);
    add_light(8, "light", PROTOCOL_LIGHT_SPHERE);
    add_node(1, "ceiling", PROTOCOL_NODE_LIGHT, 7);
    add_node(2, "light", PROTOCOL_NODE_LIGHT, 7);
    assert_int_equal(find(PROTOCOL_OBJECT_LIGHT, "ceiling"), 7);
    assert_int_equal(find(PROTOCOL_OBJECT_LIGHT, "light"), 8);
    assert_int_equal(find(PROTOCOL_OBJECT_LIGHT, "0"), 7);
}

TEST(lights_and_environments_light_a_scene)
{
    const struct message environment = {.type = MESSAGE_SET_ENVIRONMENT};
    add_node(1, "ceiling", PROTOCOL_NODE_GROUP, 0);
    assert_false(catalogue.is_lit);
    assert_true(fl_catalogue_observe(&catalogue, &environment, &error));
    assert_true(catalogue.is_lit);
    fl_catalogue_finish(&catalogue);
    add_light(7, "", PROTOCOL_LIGHT_POINT);
    assert_true(catalogue.is_lit);
}

TEST(only_some_lights_have_a_size)
{
    for (int kind = 0; kind < PROTOCOL_LIGHT_COUNT; kind++) {
        bool has_size = kind == PROTOCOL_LIGHT_RECTANGLE || kind == PROTOCOL_LIGHT_SPHERE;
        add_light(10 + (uint32_t)kind, "", (enum protocol_light_kind)kind);
        assert_int_equal(fl_catalogue_light_has_size(&catalogue, 10 + (uint32_t)kind), has_size);
    }
    assert_false(fl_catalogue_light_has_size(&catalogue, 1));
}

TEST(an_unknown_name_is_refused_with_the_known_ones)
{
    uint32_t clip = 0;
    assert_false(fl_catalogue_find_clip(&catalogue, "0", &clip, NULL, &error));
    assert_string_equal(error.remedy, "it has no clip at all");
    add_clip(1, "Survey", 1);
    assert_false(fl_catalogue_find_clip(&catalogue, "Jump", &clip, NULL, &error));
    assert_int_equal(error.code, FL_ERROR_ARGUMENT);
    assert_string_equal(error.text, "the model has no clip 'Jump'");
    assert_string_equal(error.remedy, "it has 1 clip: 'Survey'");
    add_clip(2, "", 1);
    add_clip(3, "Walk", 1);
    assert_false(fl_catalogue_find_clip(&catalogue, "3", &clip, NULL, &error));
    assert_string_equal(error.remedy, "it has 3 clips: 'Survey', 'Walk'");
    for (uint32_t i = 0; i < 100; i++) {
        char name[129];
        memset(name, 'a' + (int)i % 26, 128);
        name[128 - i] = '\0';
        add_node(i + 1, name, PROTOCOL_NODE_GROUP, 0);
    }
    assert_int_equal(find(PROTOCOL_OBJECT_NODE, "?"), 0);
    assert_memory_equal(error.remedy, "it has 100 nodes: 'aaa", 22);
    assert_string_equal(error.remedy + strlen(error.remedy) - 5, "', ..");
}

TEST(a_clip_tells_its_identifier_and_length)
{
    const struct fl_clip_info *info = NULL;
    uint32_t clip = 0;
    add_clip(0, "nothing", 2);
    add_clip(5, "1", 3);
    add_clip(6, "run", 4);
    assert_true(fl_catalogue_find_clip(&catalogue, "run", &clip, &info, &error));
    assert_int_equal(clip, 6);
    assert_float_equal(info->duration_s, 4, 0);
    assert_true(fl_catalogue_find_clip(&catalogue, "2", &clip, NULL, &error));
    assert_int_equal(clip, 6);
    assert_true(fl_catalogue_find_clip(&catalogue, "1", &clip, NULL, &error));
    assert_int_equal(clip, 5);
    assert_false(fl_catalogue_find_clip(&catalogue, "nothing", &clip, NULL, &error));
    assert_string_equal(error.text, "clip 'nothing' moves nothing in the scene");
}

TEST(a_new_identifier_is_one_that_the_import_has_not_used)
{
    add_node(9, "a", PROTOCOL_NODE_GROUP, 0);
    add_node(4, "b", PROTOCOL_NODE_GROUP, 0);
    assert_int_equal(fl_catalogue_new_id(&catalogue, PROTOCOL_OBJECT_NODE), 10);
    assert_int_equal(fl_catalogue_new_id(&catalogue, PROTOCOL_OBJECT_NODE), 11);
    assert_int_equal(fl_catalogue_new_id(&catalogue, PROTOCOL_OBJECT_CLIP), 1);
    add_node(UINT32_MAX, "c", PROTOCOL_NODE_GROUP, 0);
    assert_int_equal(fl_catalogue_new_id(&catalogue, PROTOCOL_OBJECT_NODE), 0);
}

TEST_WITH(a_flood_of_names_is_held_in_bounded_memory, empty, empty)
{
    char name[129];
    memset(name, 'x', 128);
    name[128] = '\0';
    for (uint32_t i = 1; i <= (1u << 20) + 10; i++) {
        snprintf(name, 9, "%08u", i);
        name[8] = 'x';
        add_node(i, name, PROTOCOL_NODE_GROUP, 0);
    }
    assert_in_range(catalogue.text_capacity, 1, 64u << 20);
    assert_int_equal(catalogue.lists[FL_CATALOGUE_NODES].count, 1u << 20);
    assert_int_equal(find(PROTOCOL_OBJECT_NODE, "1048575"), 1u << 20);
    snprintf(name, 9, "%08u", 200000);
    name[8] = 'x';
    assert_int_equal(find(PROTOCOL_OBJECT_NODE, name), 200000);
    assert_int_equal(find(PROTOCOL_OBJECT_NODE, "1048576"), 0);
    assert_non_null(strstr(error.remedy, "only its first 1048576 nodes can be named"));
}
