/* SPDX-License-Identifier: MIT */
/* The numbers that samples choose by: how evenly they are spread, and that pixels and choices do not follow each
 * other.
 */
#include "render/sequence.h"
#include "shared/frame.h"
#include "tests/harness/test.h"

#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

enum { SEEDS = 40, SAMPLES_LOG2 = 8, SAMPLES = 1 << SAMPLES_LOG2 };
static const uint32_t dimensions[] = {SEQUENCE_PIXEL, SEQUENCE_LENS, SEQUENCE_WAVE + SEQUENCE_LIGHT,
                                      SEQUENCE_WAVE + SEQUENCE_LOBE_DIRECTION, SEQUENCE_EVERY_LIGHT + 3};
enum { DIMENSIONS = sizeof(dimensions) / sizeof(dimensions[0]) };

/* The block of 2^log2 samples that begins at `first`: one in each of the 2^columns x 2^(log2 - columns) cells. */
static void expect_net(uint32_t seed, uint32_t dimension, uint32_t first, int log2, int columns)
{
    uint8_t seen[SAMPLES] = {0};
    for (uint32_t i = 0; i < 1u << log2; i++) {
        float pair[2];
        sequence_pair(pair, seed, dimension, first + i);
        assert_true(pair[0] >= 0.0f && pair[0] < 1.0f && pair[1] >= 0.0f && pair[1] < 1.0f);
        uint32_t x = (uint32_t)ldexpf(pair[0], columns), y = (uint32_t)ldexpf(pair[1], log2 - columns);
        uint32_t cell = x << (log2 - columns) | y;
        if (seen[cell]++)
            fail_msg("seed %u, dimension %u, samples %u + 2^%d: two in cell %u,%u of 2^%d columns", seed,
                     dimension, first, log2, x, y, columns);
    }
}

TEST(every_aligned_block_of_pairs_has_one_in_each_elementary_cell)
{
    for (uint32_t s = 0; s < SEEDS; s++)
        for (int d = 0; d < DIMENSIONS; d++)
            for (int log2 = 0; log2 <= SAMPLES_LOG2; log2++)
                for (int columns = 0; columns <= log2; columns++)
                    for (uint32_t block = 0; block < 3; block++)
                        expect_net(sequence_seed(s, 7), dimensions[d], (block * 5 * SAMPLES) & ~((1u << log2) - 1),
                                   log2, columns);
    expect_net(sequence_seed(1, 1), 0, 0xffffff00u, 8, 4); /* to the end of the numbers of samples */
}

TEST(every_aligned_block_of_numbers_has_one_in_each_interval)
{
    for (uint32_t s = 0; s < SEEDS; s++)
        for (int log2 = 0; log2 <= SAMPLES_LOG2; log2++) {
            uint8_t seen[SAMPLES] = {0};
            for (uint32_t i = 0; i < 1u << log2; i++) {
                float number = sequence_number(sequence_seed(s, 7), SEQUENCE_TIME, (s << log2) + i);
                assert_true(number >= 0.0f && number < 1.0f);
                assert_int_equal(seen[(uint32_t)ldexpf(number, log2)]++, 0);
            }
        }
}

TEST(in_order_they_are_the_same_numbers_and_neighbours_are_close_together)
{
    for (uint32_t s = 0; s < SEEDS; s++)
        for (uint32_t shift = 0; shift <= 4; shift++)
            for (uint32_t first = 0; first < 48; first += 16) {
                uint32_t count = 1u << shift, taken = 0, seed = sequence_seed(s, 7);
                float sum = 0.0f, sorted_sum = 0.0f;
                for (uint32_t i = 0; i < count; i++) {
                    float pair[2], sorted[2];
                    sequence_pair(pair, seed, SEQUENCE_LIGHT, first + i);
                    sequence_pair_sorted(sorted, seed, SEQUENCE_LIGHT, first + i, shift);
                    /* neighbours to the left half of the group, the half of that, .. share an interval of that
                     * size */
                    uint32_t interval = (uint32_t)ldexpf(sorted[0], (int)shift);
                    taken |= 1u << interval;
                    for (uint32_t half = 1; half < count; half *= 2) {
                        float other[2];
                        sequence_pair_sorted(other, seed, SEQUENCE_LIGHT, first + (i ^ (half - 1)), shift);
                        assert_int_equal((uint32_t)ldexpf(other[0], (int)shift) / half, interval / half);
                    }
                    sum += pair[0] + 2.0f * pair[1];
                    sorted_sum += sorted[0] + 2.0f * sorted[1];
                }
                assert_int_equal(taken, (1ull << count) - 1);
                assert_true(fabsf(sum - sorted_sum) < 1e-4f);
            }
}

/* Root mean square over pixels of a mean of `samples` less the integral, of a smooth bump that is no product. */
static double error_of(uint32_t samples)
{
    double squares = 0.0;
    enum { PIXELS = 400 };
    for (uint32_t p = 0; p < PIXELS; p++) {
        double sum = 0.0;
        for (uint32_t i = 0; i < samples; i++) {
            float pair[2];
            sequence_pair(pair, sequence_seed(p, 3), SEQUENCE_LENS, i);
            sum += sin(3.0 * (double)pair[0] + 2.0 * (double)pair[1]);
        }
        /* of sin(3 x + 2 y) over the unit square */
        double exact = (sin(3.0) + sin(2.0) - sin(5.0)) / 6.0;
        squares += (sum / samples - exact) * (sum / samples - exact);
    }
    return sqrt(squares / PIXELS);
}

TEST(the_error_of_a_pixels_mean_falls_faster_than_that_of_independent_numbers)
{
    double few = error_of(16), many = error_of(1024), slope = log(many / few) / log(1024.0 / 16.0);
    print_message("16 samples are off by %.2e, 1024 by %.2e: n^%.2f\n", few, many, slope);
    /* Independent samples differ by 0.45 / sqrt(n), n^-0.5. A scrambled (0, 2)-net has n^-1.5 (Owen. Scrambled Net
     * Variance for Integrals of Smooth Functions. 1997) times a root of a logarithm; 800 pixels know each error to
     * 4 %, which makes 0.013 of the slope. */
    assert_true(few < 0.45 / 4.0 / 4.0);
    assert_true(slope < -1.3);
}

/* Of pairs (x, y) of numbers that are to be independent and uniform: chi-squared over 16 x 16 cells. */
static void expect_independent(const char *what, const float (*pairs)[2], uint32_t count)
{
    enum { CELLS = 16 };
    double counts[CELLS][CELLS] = {{0}}, sum = 0.0, expected = (double)count / (CELLS * CELLS);
    for (uint32_t i = 0; i < count; i++)
        counts[(int)(pairs[i][0] * CELLS)][(int)(pairs[i][1] * CELLS)] += 1.0;
    for (int x = 0; x < CELLS; x++)
        for (int y = 0; y < CELLS; y++)
            sum += (counts[x][y] - expected) * (counts[x][y] - expected) / expected;
    /* 255 degrees of freedom: mean 255, standard deviation sqrt(510) = 22.6; five of those */
    print_message("%s: chi-squared %.0f of 255\n", what, sum);
    assert_true(sum < 255.0 + 5.0 * 22.6);
}

enum { PIXELS_ACROSS = 256, PIXELS = PIXELS_ACROSS * PIXELS_ACROSS };
static float pairs[PIXELS][2];

static float first_of(uint32_t pixel, uint32_t seed, uint32_t dimension, uint32_t index)
{
    float pair[2];
    sequence_pair(pair, sequence_seed(pixel, seed), dimension, index);
    return pair[0];
}

TEST(neighbouring_pixels_are_independent)
{
    static const uint32_t steps[] = {1, PIXELS_ACROSS, PIXELS_ACROSS + 1};
    for (uint32_t index = 0; index < 3; index++)
        for (size_t k = 0; k < sizeof(steps) / sizeof(steps[0]); k++) {
            for (uint32_t i = 0; i < PIXELS; i++) {
                pairs[i][0] = first_of(i, 5, SEQUENCE_LENS, index);
                pairs[i][1] = first_of(i + steps[k], 5, SEQUENCE_LENS, index);
            }
            expect_independent("neighbours", (const float(*)[2])pairs, PIXELS);
        }
}

TEST(choices_samples_and_seeds_are_independent)
{
    for (uint32_t i = 0; i < PIXELS; i++) {
        pairs[i][0] = first_of(i, 5, SEQUENCE_LENS, 1);
        pairs[i][1] = first_of(i, 5, SEQUENCE_PIXEL, 1);
    }
    expect_independent("lens and pixel", (const float(*)[2])pairs, PIXELS);
    for (uint32_t i = 0; i < PIXELS; i++)
        pairs[i][1] = sequence_number(sequence_seed(i, 5), SEQUENCE_TIME, 1);
    expect_independent("lens and time", (const float(*)[2])pairs, PIXELS);
    for (uint32_t i = 0; i < PIXELS; i++)
        pairs[i][1] = first_of(i, 6, SEQUENCE_LENS, 1);
    expect_independent("one seed and the next", (const float(*)[2])pairs, PIXELS);
    for (uint32_t i = 0; i < PIXELS; i++) /* the two of a pair, of one sample */
        sequence_pair(pairs[i], sequence_seed(i, 5), SEQUENCE_LENS, 2);
    expect_independent("x and y", (const float(*)[2])pairs, PIXELS);
}

/* What a dimension shows beside the others of its own pixel: in 16 samples of a pixel two choices must not go hand
 * in hand, which is what the shuffled order is for. */
TEST(the_order_of_one_choice_says_nothing_of_anothers)
{
    for (uint32_t i = 0; i < PIXELS; i++) {
        uint32_t pixel = i / 16, index = i % 16;
        pairs[i][0] = first_of(pixel, 9, SEQUENCE_LENS, index);
        pairs[i][1] = first_of(pixel, 9, SEQUENCE_PIXEL, index);
    }
    expect_independent("16 of a pixel", (const float(*)[2])pairs, PIXELS);
}
