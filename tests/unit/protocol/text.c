/* SPDX-License-Identifier: MIT */
/* What people read of the protocol: the texts of enums, printed messages. */
#include <stdlib.h>

#include "tests/unit/protocol/cases.h"
#include "tests/harness/test.h"

static struct case_maker maker;

TEST(every_value_of_every_enum_has_a_text_that_parses_back)
{
    size_t index = 0;
#define ENUMERATION(NAME, lower, doc)                                                                             \
    {                                                                                                             \
        const struct enum_desc *desc = &protocol_enums[index++];                                                  \
        enum protocol_##lower value = PROTOCOL_##NAME##_COUNT;                                                    \
        assert_string_equal(desc->name, #lower);                                                                  \
        assert_string_equal(protocol_##lower##_text(value), "?");                                                 \
        assert_false(protocol_##lower##_parse("no such value", &value));                                          \
        assert_false(protocol_##lower##_parse("", &value));                                                       \
        assert_false(protocol_##lower##_parse(NULL, &value));                                                     \
        assert_int_equal(value, PROTOCOL_##NAME##_COUNT);                                                         \
        for (size_t k = 0; k < desc->value_count; k++) {                                                          \
            assert_true(protocol_##lower##_parse(desc->values[k].text, &value));                                  \
            assert_int_equal(value, desc->values[k].number);                                                      \
            assert_string_equal(protocol_##lower##_text(value), desc->values[k].text);                            \
        }                                                                                                         \
    }
#include "protocol/words.def"
    for (size_t i = 0; i < protocol_enum_count; i++) {
        const struct enum_desc *desc = &protocol_enums[i];
        assert_int_equal(desc->values[0].number, 0); /* zero is the default, so it must be a value */
        for (size_t k = 0; k < desc->value_count; k++) {
            assert_string_equal(enum_desc_text(desc, desc->values[k].number), desc->values[k].text);
            for (size_t l = 0; l < k; l++) {
                assert_true(desc->values[l].number < desc->values[k].number);
                assert_string_not_equal(desc->values[l].text, desc->values[k].text);
            }
        }
    }
    enum protocol_tracer tracer = PROTOCOL_TRACER_BVH;
    assert_true(protocol_tracer_parse("naive", &tracer));
    assert_int_equal(tracer, PROTOCOL_TRACER_NAIVE);
    assert_string_equal(protocol_tracer_text(tracer), "naive");
}

TEST(the_list_of_an_enum_is_cut_where_it_does_not_fit)
{
    char list[64];
    assert_string_equal(protocol_enum_list("quadtree_hits", list, sizeof(list)), "auto, primitive, plane");
    assert_string_equal(protocol_enum_list("quadtree_hits", list, 16), "auto, primitive");
    assert_string_equal(protocol_enum_list("quadtree_hits", list, 1), "");
    assert_string_equal(protocol_enum_list("no such enum", list, sizeof(list)), "");
}

TEST(messages_print_as_one_line)
{
    struct message message;
    for (size_t i = 0; i < protocol_message_count; i++) {
        char *text = NULL;
        size_t count = 0;
        FILE *stream = open_memstream(&text, &count);
        assert_non_null(stream);
        case_make(&maker, &message, &protocol_messages[i], CASE_MAX, 9);
        message_print(stream, &message);
        assert_int_equal(fclose(stream), 0);
        assert_null(strchr(text, '\n'));
        assert_memory_equal(text, protocol_messages[i].info.name, strlen(protocol_messages[i].info.name));
        free(text);
    }
    struct record_camera_key keys[6] = {
        {.time_s = 1.0f, .eye_world = {1, 2, 3}, .up_world = {0, 1, 0}, .fov_y = 1.0f}};
    char *text = NULL;
    size_t count = 0;
    FILE *stream = open_memstream(&text, &count);
    assert_non_null(stream);
    struct message blocked = {.type = MESSAGE_BLOCKED, .blocked = {.channel = 3, .total = 9, .text = "a\n\"b\""}};
    message_print(stream, &blocked);
    fputc('\n', stream);
    message_init(&message, MESSAGE_RENDER);
    message.render.tracer = PROTOCOL_TRACER_NAIVE;
    message.render.keys = keys;
    message.render.keys_count = 6;
    message_print(stream, &message);
    assert_int_equal(fclose(stream), 0);
    assert_non_null(strstr(text, "blocked channel=3 total=9 text=\"a\\x0a\\\"b\\\"\"\n"));
    assert_non_null(strstr(text, "tracer=naive"));
    assert_non_null(
        strstr(text, "keys=[6: {time_s=1 eye_world=1,2,3 look_at_world=0,0,0 up_world=0,1,0 fov_y=1}, {"));
    assert_non_null(strstr(text, ", ..]"));
    free(text);
}
