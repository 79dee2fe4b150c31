/* SPDX-License-Identifier: MIT */
/* The numbers that samples choose by: how evenly they are spread, and that pixels and choices do not follow each
 * other.
 */
#include "render/picture/sequence.h"
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
static void expect_net(struct sequence_seed seed, uint32_t dimension, uint32_t first, int log2, int columns)
{
    uint8_t seen[SAMPLES] = {0};
    for (uint32_t i = 0; i < 1u << log2; i++) {
        float pair[2];
        sequence_pair(pair, seed, dimension, first + i);
        assert_true(pair[0] >= 0.0f && pair[0] < 1.0f && pair[1] >= 0.0f && pair[1] < 1.0f);
        uint32_t x = (uint32_t)ldexpf(pair[0], columns), y = (uint32_t)ldexpf(pair[1], log2 - columns);
        uint32_t cell = x << (log2 - columns) | y;
        if (seen[cell]++)
            fail_msg("block %u, dimension %u, samples %u + 2^%d: two in cell %u,%u of 2^%d columns", seed.block,
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
                        expect_net(sequence_seed(s, 3 * s, 7), dimensions[d],
                                   (block * 5 * SAMPLES) & ~((1u << log2) - 1), log2, columns);
    expect_net(sequence_seed(1, 0, 1), 0, 0xffffff00u, 8, 4); /* up to the last numbers of samples */
}

TEST(every_aligned_block_of_numbers_has_one_in_each_interval)
{
    for (uint32_t s = 0; s < SEEDS; s++)
        for (int log2 = 0; log2 <= SAMPLES_LOG2; log2++) {
            uint8_t seen[SAMPLES] = {0};
            for (uint32_t i = 0; i < 1u << log2; i++) {
                float number = sequence_number(sequence_seed(s, 3 * s, 7), SEQUENCE_TIME, (s << log2) + i);
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
                const struct sequence_seed seed = sequence_seed(s, 3 * s, 7);
                uint32_t count = 1u << shift, taken = 0;
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
            sequence_pair(pair, sequence_seed(p, 5 * p, 3), SEQUENCE_LENS, i);
            sum += sin(3.0 * (double)pair[0] + 2.0 * (double)pair[1]);
        }
        /* integral of sin(3 x + 2 y) over the unit square */
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

/* Expects pairs (x, y) of independent, uniform numbers: chi-squared over 16 x 16 cells. */
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

static struct sequence_seed seed_of(uint32_t pixel, uint32_t seed)
{
    return sequence_seed(pixel % PIXELS_ACROSS, pixel / PIXELS_ACROSS, seed);
}

static float first_of(uint32_t pixel, uint32_t seed, uint32_t dimension, uint32_t index)
{
    float pair[2];
    sequence_pair(pair, seed_of(pixel, seed), dimension, index);
    return pair[0];
}

TEST(pixels_of_neighbouring_blocks_are_independent)
{
    static const uint32_t steps[] = {8, 8 * PIXELS_ACROSS, 8 * PIXELS_ACROSS + 8};
    for (uint32_t index = 0; index < 3; index++)
        for (size_t k = 0; k < sizeof(steps) / sizeof(steps[0]); k++) {
            for (uint32_t i = 0; i < PIXELS; i++) {
                pairs[i][0] = first_of(i, 5, SEQUENCE_LENS, index);
                pairs[i][1] = first_of(i + steps[k], 5, SEQUENCE_LENS, index);
            }
            expect_independent("neighbours", (const float(*)[2])pairs, PIXELS);
        }
}

/* The first 2^log2 samples of an aligned square of 2^edge pixels a side, as of one pixel. */
static void expect_shared_net(uint32_t x, uint32_t y, uint32_t edge, uint32_t log2, uint32_t dimension)
{
    const uint32_t all = log2 + 2 * edge;
    for (uint32_t columns = 0; columns <= all; columns++) {
        static uint8_t seen[1 << 12];
        memset(seen, 0, sizeof(seen));
        for (uint32_t i = 0; i < 1u << all; i++) {
            const uint32_t pixel = i >> log2;
            float pair[2];
            sequence_pair(pair, sequence_seed(x + (pixel & ((1u << edge) - 1)), y + (pixel >> edge), 7), dimension,
                          i & ((1u << log2) - 1));
            const uint32_t across = (uint32_t)ldexpf(pair[0], (int)columns);
            const uint32_t cell = across << (all - columns) | (uint32_t)ldexpf(pair[1], (int)(all - columns));
            if (seen[cell]++)
                fail_msg("%u samples of %ux%u pixels from %u,%u: two in cell %u of 2^%u columns", 1u << log2,
                         1u << edge, 1u << edge, x, y, cell, columns);
        }
    }
}

TEST(the_samples_of_neighbours_are_stratified_together)
{
    for (uint32_t block = 0; block < 4; block++)
        for (uint32_t edge = 1; edge <= 3; edge++)
            for (uint32_t log2 = 0; log2 <= 6; log2++)
                expect_shared_net(24 * block + (8 - (1u << edge)), 8 * block, edge, log2, dimensions[block]);
}

/* A choice at a pixel, which changes from pixel to pixel as slowly as a picture does: whether a light is
 * hidden by an edge, and the cosine of a smooth light. */
static double chosen(int what, const float pair[2], double where)
{
    const double x = (double)pair[0], y = (double)pair[1];
    return what ? sin(3.0 * x + 2.0 * y) : 0.7 * x + 0.5 * y < 0.5 + 0.2 * where;
}

static double chosen_exactly(int what, double where)
{
    /* The area below the edge: a trapezium, as it meets both vertical sides of the square or its top. */
    const double level = 0.5 + 0.2 * where, left = level / 0.5, right = (level - 0.7) / 0.5;
    const double top = left > 1.0 ? (level - 0.5) / 0.7 : 0.0, end = right < 0.0 ? level / 0.7 : 1.0;
    const double low = right > 0.0 ? right : 0.0, high = left > 1.0 ? 1.0 : left;
    return what ? (sin(3.0) + sin(2.0) - sin(5.0)) / 6.0 : top + (end - top) * (high + low) / 2.0;
}

/* Errors of a picture: the mean square of a pixel's, and that of the means of 4 x 4 pixels wherever they
 * begin, times 16, which is the same number where errors are white noise. */
static void measure_errors(int what, uint32_t samples, double *pixel, double *low)
{
    enum { SIZE = 96, BOX = 4 };
    static double error[SIZE][SIZE];
    *pixel = *low = 0.0;
    for (uint32_t y = 0; y < SIZE; y++)
        for (uint32_t x = 0; x < SIZE; x++) {
            const double where = (double)x / SIZE;
            error[y][x] = -chosen_exactly(what, where);
            for (uint32_t i = 0; i < samples; i++) {
                float pair[2];
                sequence_pair(pair, sequence_seed(x, y, 11), SEQUENCE_LENS, i);
                error[y][x] += chosen(what, pair, where) / samples;
            }
            *pixel += error[y][x] * error[y][x] / (SIZE * SIZE);
        }
    for (uint32_t y = 0; y + BOX <= SIZE; y++)
        for (uint32_t x = 0; x + BOX <= SIZE; x++) {
            double sum = 0.0;
            for (uint32_t k = 0; k < BOX * BOX; k++)
                sum += error[y + k / BOX][x + k % BOX];
            *low += sum * sum / (BOX * BOX) / ((SIZE - BOX + 1) * (SIZE - BOX + 1));
        }
}

TEST(the_error_of_few_samples_is_blue_noise)
{
    for (int what = 0; what < 2; what++)
        for (uint32_t samples = 1; samples <= 16; samples *= 4) {
            double pixel, low;
            measure_errors(what, samples, &pixel, &low);
            print_message("%s, %u samples: %.2f of white noise's power in means of 4 x 4 pixels\n",
                          what ? "smooth" : "an edge", samples, low / pixel);
            /* A box anywhere has whole 2 x 2 on a third of it and more, whose errors all but cancel: 0.4 is left
             * of a smooth choice's, 0.55 of an edge's, as counted over 2^18 pixels. 9216 pixels have some 600
             * independent boxes, which know a variance to 6 %; three of those. */
            assert_true(low / pixel < (what ? 0.4 : 0.55) * 1.18);
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
        pairs[i][1] = sequence_number(seed_of(i, 5), SEQUENCE_TIME, 1);
    expect_independent("lens and time", (const float(*)[2])pairs, PIXELS);
    for (uint32_t i = 0; i < PIXELS; i++)
        pairs[i][1] = first_of(i, 6, SEQUENCE_LENS, 1);
    expect_independent("one seed and the next", (const float(*)[2])pairs, PIXELS);
    for (uint32_t i = 0; i < PIXELS; i++) /* the two of a pair, of one sample */
        sequence_pair(pairs[i], seed_of(i, 5), SEQUENCE_LENS, 2);
    expect_independent("x and y", (const float(*)[2])pairs, PIXELS);
}

/* Dimensions beside each other in a pixel: in 16 samples of a pixel two choices must not be correlated, which
 * is the purpose of the shuffled order. */
TEST(the_order_of_one_choice_says_nothing_of_anothers)
{
    for (uint32_t i = 0; i < PIXELS; i++) {
        uint32_t pixel = i / 16, index = i % 16;
        pairs[i][0] = first_of(pixel, 9, SEQUENCE_LENS, index);
        pairs[i][1] = first_of(pixel, 9, SEQUENCE_PIXEL, index);
    }
    expect_independent("16 of a pixel", (const float(*)[2])pairs, PIXELS);
}
