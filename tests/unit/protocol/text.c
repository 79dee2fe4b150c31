/* SPDX-License-Identifier: MIT */
/* Texts of enums, which people read. */
#include "tests/unit/protocol/cases.h"
#include "tests/harness/test.h"

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
