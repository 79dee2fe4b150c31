/* SPDX-License-Identifier: MIT */
/* The division of a picture's pixels into parts, shared by the command that renders a part and the program that
 * merges them. Squares of whole tiles are numbered so that consecutive numbers lie far apart; a part has a run
 * of numbers, and so squares all over the picture. The numbers of squares of two parts differ by at most one. */
#ifndef FARLIGHT_PROTOCOL_COMMON_SQUARES_H
#define FARLIGHT_PROTOCOL_COMMON_SQUARES_H

#include <stdint.h>

#define SQUARES_TILE 8u /* pixels; a part renders whole tiles */
/* Minimum number of squares of a part, if the picture is large enough, so that parts take about equally long. */
#define SQUARES_EACH 8u
#define SQUARES_PARTS_MAX 512u /* the files of all parts are open at once */

struct squares {
    uint32_t width, height; /* size of the picture */
    uint32_t side, across, count;
    uint32_t step; /* distance, row by row, from a number's square to the next number's; coprime with count */
};

/* Pixels from the picture's top left. */
struct square {
    uint32_t x, y, width, height;
};

static inline uint32_t squares_along(uint32_t pixels, uint32_t side)
{
    return (pixels + side - 1) / side;
}

static inline uint32_t squares_common_divisor(uint32_t a, uint32_t b)
{
    while (b != 0) {
        const uint32_t rest = a % b;
        a = b;
        b = rest;
    }
    return a;
}

/* Divides a picture of at most 8192 x 8192 pixels into squares for at least one part. There may be fewer
 * squares than parts. */
static inline struct squares squares_of(uint32_t width, uint32_t height, uint32_t parts)
{
    struct squares squares = {width, height, SQUARES_TILE, 0, 0, 1};
    const uint64_t wanted = (uint64_t)SQUARES_EACH * parts;
    for (uint64_t side = SQUARES_TILE; side * side * wanted <= (uint64_t)width * height; side += SQUARES_TILE)
        squares.side = (uint32_t)side;
    squares.across = squares_along(width, squares.side);
    squares.count = squares.across * squares_along(height, squares.side);
    /* Multiples of the golden ratio are spread evenly, for any number of them (Knuth. The Art of Computer
     * Programming 3, section 6.4, theorem S). The step is coprime with `across`, too, so a run of `across`
     * numbers visits every column once. */
    squares.step = (uint32_t)((uint64_t)squares.count * 618034 / 1000000);
    while (squares_common_divisor(squares.step, squares.count) != 1)
        squares.step++;
    return squares;
}

/* The first number of a part, counted from 0. For the part behind the last one: the number of squares. */
static inline uint32_t squares_first(const struct squares *squares, uint32_t part, uint32_t parts)
{
    return (uint32_t)((uint64_t)part * squares->count / parts);
}

static inline struct square squares_at(const struct squares *squares, uint32_t number)
{
    const uint32_t place = (uint32_t)((uint64_t)number * squares->step % squares->count);
    struct square square = {place % squares->across * squares->side, place / squares->across * squares->side,
                            squares->side, squares->side};
    if (square.width > squares->width - square.x)
        square.width = squares->width - square.x;
    if (square.height > squares->height - square.y)
        square.height = squares->height - square.y;
    return square;
}

#endif
