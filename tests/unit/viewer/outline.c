/* SPDX-License-Identifier: MIT */
/* The outline of what is chosen: what belongs to it, and where its line is. */
#include "viewer/overlay/outline.h"
#include "tests/harness/test.h"

#include <stdlib.h>
#include <string.h>

#define WIDTH 12
#define HEIGHT 6

TEST(a_family_is_a_node_with_all_that_is_below_it)
{
    /* Parents need not come before their children; 20 and 21 are a circle, and 8 hangs on a node that is gone. */
    const struct fl_object nodes[] = {{.id = 2, .parent = 9},  {.id = 3},
                                      {.id = 5, .parent = 3},  {.id = 8, .parent = 4},
                                      {.id = 9, .parent = 5},  {.id = 20, .parent = 21},
                                      {.id = 21, .parent = 20}};
    const struct {
        uint32_t node;
        size_t count;
        uint32_t ids[4];
    } cases[] = {{3, 4, {2, 3, 5, 9}}, {9, 2, {2, 9}}, {8, 1, {8}}, {20, 2, {20, 21}}, {7, 0, {0}}};
    for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
        size_t count = 77;
        uint32_t *ids = outline_family(nodes, sizeof(nodes) / sizeof(nodes[0]), cases[i].node, &count);
        assert_int_equal(count, cases[i].count);
        assert_memory_equal(ids, cases[i].ids, count * sizeof(*ids));
        free(ids);
    }
}

TEST(pixels_of_the_chosen_objects_are_marked)
{
    /* The third is covered by nothing; no identifier is 0, and what is none must not be taken for one. */
    const float pixels[][4] = {{7, 1, 0, 1}, {7, 2, 0, 1},      {7, 1, 0, 0}, {8, 1, 0, 1},
                               {0, 0, 0, 1}, {-1, 1e30f, 0, 1}, {9, 2, 0, 1}};
    const uint32_t nodes[] = {7, 9}, materials[] = {1};
    const uint8_t by_node[] = {1, 1, 0, 0, 0, 0, 1}, by_material[] = {1, 0, 0, 1, 0, 0, 0};
    uint8_t marks[7];
    outline_mark((const uint8_t *)pixels, 7, OUTLINE_BY_NODE, nodes, 2, marks);
    assert_memory_equal(marks, by_node, sizeof(marks));
    outline_mark((const uint8_t *)pixels, 7, OUTLINE_BY_MATERIAL, materials, 1, marks);
    assert_memory_equal(marks, by_material, sizeof(marks));
}

/* Marks as text: '#'. */
static void check(const struct outline_size *size, const char *object, const char *line)
{
    uint8_t marks[WIDTH * HEIGHT];
    char text[WIDTH * HEIGHT + 1] = "";
    for (size_t i = 0; i < sizeof(marks); i++)
        marks[i] = object[i] == '#';
    assert_true(outline_trace(marks, size, 2));
    for (size_t i = 0; i < sizeof(marks); i++)
        text[i] = marks[i] ? '#' : '.';
    assert_string_equal(text, line);
}

TEST(the_line_is_around_what_is_marked_and_stays_in_its_view)
{
    static const char object[] = "............"
                                 "............"
                                 "....##......"
                                 "....##......"
                                 "............"
                                 "............";
    check(&(struct outline_size){WIDTH, HEIGHT, 1, 1}, object,
          "..######...."
          "..######...."
          "..##..##...."
          "..##..##...."
          "..######...."
          "..######....");
    check(&(struct outline_size){WIDTH, HEIGHT, 2, 1}, object,
          "..####......"
          "..####......"
          "..##........"
          "..##........"
          "..####......"
          "..####......");
    static const char above_the_seam[] = "............"
                                         "............"
                                         ".....#......"
                                         "............"
                                         "............"
                                         "............";
    check(&(struct outline_size){WIDTH, HEIGHT, 1, 2}, above_the_seam,
          "...#####...."
          "...#####...."
          "...##.##...."
          "............"
          "............"
          "............");
}

TEST(only_the_line_is_drawn)
{
    const uint8_t marks[] = {0, 1};
    uint8_t picture[] = {1, 2, 3, 4, 1, 2, 3, 4};
    outline_draw(marks, 2, picture);
    assert_memory_equal(picture, ((uint8_t[]){1, 2, 3, 4}), 4);
    assert_int_not_equal(picture[4], 1);
    assert_int_equal(picture[7], 255);
}
