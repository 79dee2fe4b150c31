/* SPDX-License-Identifier: MIT */
/* Which pixels of a picture belong to which of several parts, as the command that renders a part and the program
 * that merges them have it. Squares of whole tiles are numbered so that those with numbers close together lie far
 * apart; a part has a run of numbers, and so squares all over the picture: as many as any other part, or one more.
 */
#ifndef FARLIGHT_PROTOCOL_COMMON_SQUARES_H
#define FARLIGHT_PROTOCOL_COMMON_SQUARES_H

#include <stdint.h>

#define SQUARES_TILE 8u /* pixels; a part renders whole tiles */
/* A part has at least so many, where the picture is large enough, so that parts take about as long as each other.
 */
#define SQUARES_EACH 8u
#define SQUARES_PARTS_MAX 512u /* all of whose files are open at once */

struct squares {
    uint32_t width, height; /* of the picture */
    uint32_t side, across, count;
    uint32_t step; /* from a number's square to the next one's, row by row; prime to count */
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

/* `width` and `height` at most 8192, `parts` at least 1. There may be fewer squares than parts. */
static inline struct squares squares_of(uint32_t width, uint32_t height, uint32_t parts)
{
    struct squares squares = {width, height, SQUARES_TILE, 0, 0, 1};
    const uint64_t wanted = (uint64_t)SQUARES_EACH * parts;
    for (uint64_t side = SQUARES_TILE; side * side * wanted <= (uint64_t)width * height; side += SQUARES_TILE)
        squares.side = (uint32_t)side;
    squares.across = squares_along(width, squares.side);
    squares.count = squares.across * squares_along(height, squares.side);
    /* Multiples of the golden ratio are spread evenly, however many there are (Knuth. The Art of Computer
     * Programming 3, section 6.4, theorem S). As the step is prime to `across`, too, a run of so many is in as
     * many columns. */
    squares.step = (uint32_t)((uint64_t)squares.count * 618034 / 1000000);
    while (squares_common_divisor(squares.step, squares.count) != 1)
        squares.step++;
    return squares;
}

/* The first number of a part, counted from 0; that of the part behind the last one: how many there are. */
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
