/* SPDX-License-Identifier: MIT */
/* Detection of closed meshes by sums of hashes. */
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
 * a collision cannot open a closed mesh, and hardly closes an open one. */
static uint64_t place_of(const float *position)
{
    uint32_t bits[3];

    for (int i = 0; i < 3; i++) {
        float value = position[i] + 0.0f; /* -0 becomes 0 */

        memcpy(&bits[i], &value, sizeof(value));
    }
    return mix_two(bits[0] | (uint64_t)bits[1] << 32, bits[2]);
}

/* A hash of the edge, and its negative for the reversed edge; 0 for an edge without length. The order of the
 * ends is unpredictable, so nothing branches on it. Positions are hashes already: their sum, with one end times
 * an odd number, is as good a hash. */
static uint64_t edge_of(uint64_t from, uint64_t to)
{
    const uint64_t lesser = from < to ? from : to, greater = from < to ? to : from;
    const uint64_t hash = mix(lesser * 0x9e3779b97f4a7c15u + greater);
    const uint64_t reversed = 0 - (uint64_t)(from > to), has_length = 0 - (uint64_t)(from != to);
    return ((hash ^ reversed) - reversed) & has_length;
}

/* Triangles, and the hash of each vertex, which is computed once instead of at each triangle. */
struct places {
    const uint64_t *of_vertex;
    const uint32_t *indices;
    uint32_t triangle_count;
};

static void corners_of(const struct places *places, size_t triangle, uint64_t corners[3])
{
    for (size_t c = 0; c < 3; c++)
        corners[c] = places->of_vertex[places->indices[triangle * 3 + c]];
}

static bool degenerate(const uint64_t corners[3])
{
    return corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0];
}

/* The hashes of all edges add up to 0 if each edge occurs equally often in both directions, and otherwise to
 * another value except with probability 2^-64, so no edge has to be stored. (The edges of a degenerate triangle
 * add up to 0.) */
static bool edges_paired(const struct places *places)
{
    uint64_t sum = 0;

    for (size_t t = 0; t < places->triangle_count; t++) {
        uint64_t corners[3];

        corners_of(places, t, corners);
        sum += edge_of(corners[0], corners[1]) + edge_of(corners[1], corners[2]) + edge_of(corners[2], corners[0]);
    }
    return sum == 0;
}

/* An empty slot. The value is not 0: the kernel maps zeroed memory that is read before it is written twice, and
 * notifies the other thread's processor each time, which took longer than everything else. */
#define EMPTY UINT64_MAX

/* A hash independent of the first corner, as a sum of hashes; the lowest bit is the orientation. Never EMPTY. */
static uint64_t triangle_of(const uint64_t corners[3])
{
    bool turned = (corners[0] < corners[1]) ^ (corners[1] < corners[2]) ^ (corners[2] < corners[0]);

    return ((corners[0] + corners[1] + corners[2]) & ~(uint64_t)3) | turned;
}

/* Inserts a triangle. False: the table has it with the other orientation. The table's size is a power of two
 * and greater than the number of triangles. */
static bool put(uint64_t *table, uint64_t mask, uint64_t triangle)
{
    uint64_t at = triangle >> 2 & mask;

    for (; table[at] != EMPTY; at = (at + 1) & mask)
        if ((table[at] ^ triangle) <= 1)
            return table[at] == triangle;
    table[at] = triangle;
    return true;
}

/* Number of triangles that are hashed before the first lookup, as each lookup is a cache miss. */
#define LOOKED_UP_TOGETHER 32u

/* True if there are triangles, and none in both orientations. */
static bool no_sheets(const struct places *places, const atomic_bool *stop)
{
    const size_t triangle_count = places->triangle_count;
    uint64_t slots = 16, together[LOOKED_UP_TOGETHER];
    uint64_t *table;
    bool any = false, single = true;

    while (slots * 4 < (uint64_t)triangle_count * 5)
        slots *= 2;
    table = malloc(slots * sizeof(*table));
    if (!table)
        return false;
    memset(table, 0xff, slots * sizeof(*table));
    for (size_t t = 0; single && t < triangle_count && !atomic_load_explicit(stop, memory_order_relaxed);) {
        size_t count = 0;

        for (; count < LOOKED_UP_TOGETHER && t < triangle_count; t++) {
            uint64_t corners[3];

            corners_of(places, t, corners);
            if (degenerate(corners))
                continue;
            together[count] = triangle_of(corners);
            __builtin_prefetch(&table[together[count++] >> 2 & (slots - 1)], 1);
        }
        any = any || count > 0;
        for (size_t i = 0; single && i < count; i++)
            single = put(table, slots - 1, together[i]);
    }
    free(table);
    return any && single;
}

/* Minimum number of triangles for which a thread is worth its start. */
#define TRIANGLES_SHARED 20000u

struct sheets {
    const struct places *places;
    atomic_bool stop; /* the result is not needed any more */
    bool none;
};

static void *find_sheets(void *context)
{
    struct sheets *sheets = context;

    sheets->none = no_sheets(sheets->places, &sheets->stop);
    return NULL;
}

bool import_triangles_closed(const float *positions, uint32_t vertex_count, const uint32_t *indices,
                             uint32_t triangle_count)
{
    uint64_t *of_vertex = malloc((size_t)vertex_count * sizeof(*of_vertex) + 1);
    const struct places places = {of_vertex, indices, triangle_count};
    struct sheets sheets = {.places = &places};
    pthread_t helper;

    if (!of_vertex)
        return false;
    for (size_t v = 0; v < vertex_count; v++)
        of_vertex[v] = place_of(positions + v * 3);
    bool helped = triangle_count >= TRIANGLES_SHARED && pthread_create(&helper, NULL, find_sheets, &sheets) == 0;
    bool paired = edges_paired(&places);

    atomic_store(&sheets.stop, !paired);
    if (helped)
        pthread_join(helper, NULL);
    else if (paired)
        find_sheets(&sheets);
    free(of_vertex);
    return paired && sheets.none;
}
