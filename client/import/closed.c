/* SPDX-License-Identifier: MIT */
#include "closed.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

/* The finaliser of splitmix64 (Steele, Lea and Flood: Fast splittable pseudorandom number generators. 2014): a
 * bijection in which every bit of the result depends on every bit of the input. */
static uint64_t mix(uint64_t bits)
{
    bits = (bits ^ bits >> 30) * 0xbf58476d1ce4e5b9u;
    bits = (bits ^ bits >> 27) * 0x94d049bb133111ebu;
    return bits ^ bits >> 31;
}

static uint64_t mix_two(uint64_t first, uint64_t second)
{
    return mix(mix(first + 0x9e3779b97f4a7c15u) + second);
}

/* The 64-bit hash of a position. Two positions may collide, at 10 million vertices once in some 100,000 meshes;
 * that cannot open a closed mesh, and hardly close an open one. */
static uint64_t place_of(const float *position)
{
    uint32_t bits[3];

    for (int i = 0; i < 3; i++) {
        float value = position[i] + 0.0f; /* -0 becomes 0 */

        memcpy(&bits[i], &value, sizeof(value));
    }
    return mix_two(bits[0] | (uint64_t)bits[1] << 32, bits[2]);
}

/* A hash of the edge, and its negative for the reversed edge; 0 for one without length. */
static uint64_t edge_of(uint64_t from, uint64_t to)
{
    if (from == to)
        return 0;
    return from < to ? mix_two(from, to) : 0 - mix_two(to, from);
}

static void places_of(const float *positions, const uint32_t *corners, uint64_t places[3])
{
    for (int c = 0; c < 3; c++)
        places[c] = place_of(positions + (size_t)corners[c] * 3);
}

static bool degenerate(const uint64_t places[3])
{
    return places[0] == places[1] || places[1] == places[2] || places[2] == places[0];
}

/* The edges' hashes add up to 0 if each edge occurs equally often in both directions, and otherwise, but for one
 * chance in 2^64, they do not. So no edge need be stored. (The edges of a degenerate triangle add up to 0.) */
static bool edges_paired(const float *positions, const uint32_t *indices, uint32_t triangle_count)
{
    uint64_t sum = 0;

    for (size_t t = 0; t < triangle_count; t++) {
        uint64_t places[3];

        places_of(positions, indices + t * 3, places);
        sum += edge_of(places[0], places[1]) + edge_of(places[1], places[2]) + edge_of(places[2], places[0]);
    }
    return sum == 0;
}

/* A hash independent of the first corner; the lowest bit is the orientation. Never 0, which is an empty slot. */
static uint64_t triangle_of(const uint64_t places[3])
{
    bool turned = (places[0] < places[1]) ^ (places[1] < places[2]) ^ (places[2] < places[0]);

    return ((mix(places[0]) + mix(places[1]) + mix(places[2])) & ~(uint64_t)1) | 2 | turned;
}

/* False: it is in the table with the other orientation. The table's size is a power of two and greater than the
 * number of triangles.
 */
static bool put(uint64_t *table, uint64_t mask, uint64_t triangle)
{
    uint64_t at = triangle >> 2 & mask;

    for (; table[at] != 0; at = (at + 1) & mask)
        if ((table[at] ^ triangle) <= 1)
            return table[at] == triangle;
    table[at] = triangle;
    return true;
}

/* There are triangles, and none with both orientations. */
static bool no_sheets(const float *positions, const uint32_t *indices, uint32_t triangle_count,
                      const atomic_bool *stop)
{
    uint64_t slots = 16;
    uint64_t *table;
    bool any = false, single = true;

    while (slots * 4 < (uint64_t)triangle_count * 5)
        slots *= 2;
    table = calloc(slots, sizeof(*table));
    if (!table)
        return false;
    for (size_t t = 0; single && t < triangle_count && !atomic_load_explicit(stop, memory_order_relaxed); t++) {
        uint64_t places[3];

        places_of(positions, indices + t * 3, places);
        if (degenerate(places))
            continue;
        any = true;
        single = put(table, slots - 1, triangle_of(places));
    }
    free(table);
    return any && single;
}

/* Fewer are looked at before a thread has started. */
#define TRIANGLES_SHARED 20000u

struct sheets {
    const float *positions;
    const uint32_t *indices;
    uint32_t triangle_count;
    atomic_bool stop; /* the result is not needed any more */
    bool none;
};

static void *look_for_sheets(void *context)
{
    struct sheets *sheets = context;

    sheets->none = no_sheets(sheets->positions, sheets->indices, sheets->triangle_count, &sheets->stop);
    return NULL;
}

bool import_triangles_closed(const float *positions, const uint32_t *indices, uint32_t triangle_count)
{
    struct sheets sheets = {.positions = positions, .indices = indices, .triangle_count = triangle_count};
    pthread_t helper;
    bool helped =
        triangle_count >= TRIANGLES_SHARED && pthread_create(&helper, NULL, look_for_sheets, &sheets) == 0;
    bool paired = edges_paired(positions, indices, triangle_count);

    atomic_store(&sheets.stop, !paired);
    if (helped)
        pthread_join(helper, NULL);
    else if (paired)
        look_for_sheets(&sheets);
    return paired && sheets.none;
}
