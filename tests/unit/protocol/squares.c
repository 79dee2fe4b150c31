/* SPDX-License-Identifier: MIT */
/* Parts of a picture: each pixel is of one of them, and none has much more of the picture than another. */
#include "tests/harness/test.h"

#include "protocol/common/squares.h"

#include <stdlib.h>

static const struct {
    uint32_t width, height;
} sizes[] = {{1, 1}, {8, 8}, {100, 7}, {640, 360}, {1920, 1080}, {3840, 2160}, {8192, 1}};
#define SIZES (sizeof(sizes) / sizeof(sizes[0]))

TEST(each_pixel_is_in_one_square)
{
    for (size_t i = 0; i < SIZES; i++) {
        for (uint32_t parts = 1; parts <= SQUARES_PARTS_MAX; parts = parts < 9 ? parts + 1 : 2 * parts - 3) {
            const struct squares all = squares_of(sizes[i].width, sizes[i].height, parts);
            uint8_t *seen = calloc(all.count, 1);
            uint64_t pixels = 0;
            for (uint32_t number = 0; number < all.count; number++) {
                const struct square square = squares_at(&all, number);
                assert_true(square.x % SQUARES_TILE == 0 && square.y % SQUARES_TILE == 0);
                assert_true(square.width > 0 && square.width <= all.width - square.x);
                assert_true(square.height > 0 && square.height <= all.height - square.y);
                assert_int_equal(seen[square.y / all.side * all.across + square.x / all.side]++, 0);
                pixels += (uint64_t)square.width * square.height;
            }
            assert_int_equal(pixels, (uint64_t)sizes[i].width * sizes[i].height);
            free(seen);
        }
    }
}

TEST(a_part_has_several_squares_where_the_picture_is_large_enough)
{
    for (uint32_t parts = 1; parts <= SQUARES_PARTS_MAX; parts++)
        assert_true(squares_of(3840, 2160, parts).count >= parts * SQUARES_EACH);
    assert_int_equal(squares_of(16, 16, 8).count, 4);
}

/* Else one that has what is slow to render would take much longer than the others. */
TEST(a_part_has_squares_of_all_columns_and_of_each_third_of_the_rows)
{
    for (size_t i = 0; i < SIZES; i++) {
        for (uint32_t parts = 2; parts <= SQUARES_PARTS_MAX; parts++) {
            const struct squares all = squares_of(sizes[i].width, sizes[i].height, parts);
            if (all.count < SQUARES_EACH * parts || all.height < 4 * all.side)
                continue;
            uint32_t columns[8192 / SQUARES_TILE] = {0}, thirds[3] = {0}, used = 0;
            const uint32_t first = squares_first(&all, parts / 2, parts),
                           end = squares_first(&all, parts / 2 + 1, parts);
            for (uint32_t number = first; number < end; number++) {
                const struct square square = squares_at(&all, number);
                used += columns[square.x / all.side]++ == 0;
                thirds[3 * square.y / all.height]++;
            }
            assert_int_equal(used, end - first < all.across ? end - first : all.across);
            for (int third = 0; third < 3; third++)
                assert_true(thirds[third] > 0);
        }
    }
}

TEST(parts_have_as_many_squares_as_each_other_or_one_more)
{
    const struct squares all = squares_of(1920, 1080, 64);
    uint32_t sum = 0;
    for (uint32_t part = 0; part < 64; part++) {
        const uint32_t count = squares_first(&all, part + 1, 64) - squares_first(&all, part, 64);
        assert_true(count == all.count / 64 || count == all.count / 64 + 1);
        sum += count;
    }
    assert_int_equal(sum, all.count);
}
