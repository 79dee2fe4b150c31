/* SPDX-License-Identifier: MIT */
/* Depths that come first: within what they say of themselves, sharp at edges, in few bytes, and refused where they
 * are damaged. */
#include "tests/harness/test.h"

#include "protocol/pixels/coarse_depth.h"

#include <stdlib.h>
#include <string.h>

struct depths {
    uint32_t width, height;
    uint16_t *all, *coarse;
    uint8_t *encoded;
    size_t bytes, capacity;
    uint16_t off;
};

/* A wall that is far away, a floor, and discs in front of both. */
static uint16_t depth_at(uint32_t x, uint32_t y, uint32_t height)
{
    uint32_t depth = 0;
    if (y > height / 4)
        depth = y > height / 2 ? 100 + 300 * (y - height / 2) / height : 100;
    for (uint32_t disc = 0; disc < 5; disc++) {
        const int away_x = (int)x - (int)(70 * disc), away_y = (int)y - (int)(40 * disc);
        if (away_x * away_x + away_y * away_y < 900)
            depth = 300 + 20 * disc + x / 8;
    }
    return (uint16_t)depth;
}

static struct predicted_source source_of(const struct depths *depths)
{
    return (struct predicted_source){
        .form = {depths->width, depths->height, 2}, .pixels = (const uint8_t *)depths->all, .level = 1};
}

static struct depths make(uint32_t width, uint32_t height)
{
    const size_t count = (size_t)width * height;
    struct depths depths = {width, height, .capacity = coarse_depth_bound(width, height)};
    depths.all = malloc(count * sizeof(*depths.all));
    depths.coarse = malloc(count * sizeof(*depths.coarse));
    depths.encoded = malloc(depths.capacity);
    assert_true(depths.all && depths.coarse && depths.encoded);
    for (size_t i = 0; i < count; i++)
        depths.all[i] = depth_at((uint32_t)(i % width), (uint32_t)(i / width), height);
    return depths;
}

static void drop(struct depths *depths)
{
    free(depths->all);
    free(depths->coarse);
    free(depths->encoded);
}

static void encode(struct depths *depths)
{
    const struct predicted_source source = source_of(depths);
    const struct predicted_result result = coarse_depth_encode(&source, depths->encoded, depths->capacity);
    assert_int_equal(result.status, PREDICTED_DONE);
    depths->bytes = result.bytes;
}

/* From a block of its own size, so that a sanitizer sees a read beyond it. */
static enum predicted_status decode(struct depths *depths, size_t bytes)
{
    uint8_t *encoded = malloc(bytes ? bytes : 1);
    assert_non_null(encoded);
    memcpy(encoded, depths->encoded, bytes);
    const struct predicted_result result =
        coarse_depth_decode(depths->width, depths->height, encoded, bytes, depths->coarse, &depths->off);
    free(encoded);
    assert_true(result.status == PREDICTED_DONE || result.reason);
    return result.status;
}

/* Sizes about those of squares. */
TEST(no_coarse_depth_is_further_off_than_it_says)
{
    const uint32_t widths[] = {1, 7, 8, 9, 17, 321}, heights[] = {1, 4, 8, 15, 200};
    for (unsigned i = 0; i < 6 * 5; i++) {
        struct depths depths = make(widths[i % 6], heights[i / 6]);
        encode(&depths);
        assert_int_equal(decode(&depths, depths.bytes), PREDICTED_DONE);
        int most = 0;
        for (size_t k = 0; k < (size_t)depths.width * depths.height; k++)
            most = abs(depths.coarse[k] - depths.all[k]) > most ? abs(depths.coarse[k] - depths.all[k]) : most;
        assert_int_equal(most, depths.off);
        drop(&depths);
    }
}

TEST(coarse_depths_keep_edges_sharp_and_the_nearest_of_each_square)
{
    struct depths depths = make(64, 48);
    for (uint32_t i = 0; i < 64 * 48; i++)
        depths.all[i] = i % 64 < 21 ? 900 : i / 64 < 20 ? 0 : 100;
    encode(&depths);
    assert_int_equal(decode(&depths, depths.bytes), PREDICTED_DONE);
    for (uint32_t i = 0; i < 64 * 48; i++)
        assert_int_equal(depths.coarse[i], i % 64 < 24 ? 900 : i / 64 < 16 ? 0 : 100);
    drop(&depths);
}

/* The nearest of a square of a slope of 1 by 2 steps a texel lies 10.5 steps in front of its middle; bilinear
 * depths are so far off all over it, where squares alone would leap by 8. */
TEST(coarse_depths_of_a_slope_are_a_slope)
{
    struct depths depths = make(80, 64);
    for (uint32_t i = 0; i < 80 * 64; i++)
        depths.all[i] = (uint16_t)(2000 + i % 80 + 2 * (i / 80));
    encode(&depths);
    assert_int_equal(decode(&depths, depths.bytes), PREDICTED_DONE);
    for (uint32_t y = 4; y < 60; y++)
        for (uint32_t x = 4; x < 76; x++)
            assert_in_range(depths.coarse[y * 80 + x] - depths.all[y * 80 + x], 10, 11);
    drop(&depths);
}

TEST(coarse_depths_take_few_bytes)
{
    struct depths depths = make(640, 360);
    encode(&depths);
    const struct predicted_source source = source_of(&depths);
    const size_t capacity = predicted_bound(&source.form);
    uint8_t *all = malloc(capacity);
    assert_non_null(all);
    const struct predicted_result result = predicted_encode(&source, all, capacity);
    assert_int_equal(result.status, PREDICTED_DONE);
    print_message("%zu bytes coarsely, %zu of all\n", depths.bytes, result.bytes);
    assert_true(depths.bytes * 10 <= result.bytes * 3); /* both together: at most 1.3 times */
    free(all);
    drop(&depths);
}

TEST(damaged_coarse_depths_are_refused)
{
    struct depths depths = make(100, 60);
    encode(&depths);
    const size_t bytes = depths.bytes;
    for (size_t left = 0; left < bytes; left++)
        assert_int_equal(decode(&depths, left), PREDICTED_FAILED);
    for (size_t i = 2; i < bytes; i++) { /* some bits decode to other depths; none may lead outside */
        depths.encoded[i] ^= 0x55;
        decode(&depths, bytes);
        depths.encoded[i] ^= 0x55;
    }
    depths.width -= 8;
    assert_int_equal(decode(&depths, bytes), PREDICTED_FAILED);
    depths.width += 8;
    const struct predicted_source source = source_of(&depths);
    for (size_t capacity = 0; capacity < bytes; capacity++)
        assert_int_equal(coarse_depth_encode(&source, depths.encoded, capacity).status, PREDICTED_FAILED);
    drop(&depths);
}
