/* SPDX-License-Identifier: MIT */
/* Outlines of objects. */
#include "outline.h"

#include <stdlib.h>
#include <string.h>

/* Limit of a hierarchy's depth: a list that other clients change while it is read may have a cycle */
#define LEVELS_MAX 1000u

static const uint8_t colour[4] = {255, 190, 92, 255}; /* colour of the chosen object in the panel */

static int by_id(const void *key, const void *object)
{
    const uint32_t left = *(const uint32_t *)key, right = ((const struct fl_object *)object)->id;
    return left < right ? -1 : left > right;
}

static bool is_below(const struct fl_object *nodes, size_t node_count, uint32_t id, uint32_t node)
{
    for (unsigned level = 0; id != 0 && id != node && level < LEVELS_MAX; level++) {
        const struct fl_object *found = bsearch(&id, nodes, node_count, sizeof(*nodes), by_id);
        id = found ? found->parent : 0;
    }
    return id == node;
}

uint32_t *outline_family(const struct fl_object *nodes, size_t node_count, uint32_t node, size_t *count)
{
    uint32_t *ids = malloc((node_count + 1) * sizeof(*ids));
    *count = 0;
    for (size_t i = 0; i < node_count && ids; i++)
        if (is_below(nodes, node_count, nodes[i].id, node))
            ids[(*count)++] = nodes[i].id;
    return ids;
}

static int by_number(const void *a, const void *b)
{
    const uint32_t left = *(const uint32_t *)a, right = *(const uint32_t *)b;
    return left < right ? -1 : left > right;
}

void outline_mark(const uint8_t *pixels, size_t pixel_count, enum outline_by by, const uint32_t *ids, size_t count,
                  uint8_t *marks)
{
    uint32_t last = 0; /* neighbours mostly show the same object */
    bool is_last_meant = false;
    for (size_t i = 0; i < pixel_count; i++) {
        float numbers[4];
        memcpy(numbers, pixels + i * sizeof(numbers), sizeof(numbers));
        const float number = numbers[by];
        /* Invalid identifiers match no object. */
        const uint32_t id = numbers[3] > 0 && number >= 1 && number < 4294967296.0f ? (uint32_t)number : 0;
        if (id != last)
            is_last_meant = id != 0 && bsearch(&id, ids, count, sizeof(*ids), by_number);
        last = id;
        marks[i] = is_last_meant;
    }
}

/* Marks pixels of a row or column that are marked, or have a mark within reach. */
static void spread(const uint8_t *from, uint8_t *to, size_t count, size_t stride, unsigned reach)
{
    unsigned left = 0;
    for (size_t i = 0; i < count; i++) {
        left = from[i * stride] ? reach + 1 : left;
        to[i * stride] = left > 0;
        left -= left > 0;
    }
    left = 0;
    for (size_t i = count; i-- > 0;) {
        left = from[i * stride] ? reach + 1 : left;
        to[i * stride] |= left > 0;
        left -= left > 0;
    }
}

bool outline_trace(uint8_t *marks, const struct outline_size *size, unsigned reach)
{
    const size_t width = size->width, height = size->height, count = width * height;
    const size_t across = width / size->views_across, down = height / size->views_down; /* size of a view */
    uint8_t *rows = malloc(2 * count + 1);
    if (!rows)
        return false;
    uint8_t *both = rows + count;
    for (size_t i = 0; i < count; i += across)
        spread(marks + i, rows + i, across, 1, reach);
    for (size_t view = 0; view < count; view += down * width)
        for (size_t x = 0; x < width; x++)
            spread(rows + view + x, both + view + x, down, width, reach);
    for (size_t i = 0; i < count; i++)
        marks[i] = both[i] && !marks[i];
    free(rows);
    return true;
}

void outline_draw(const uint8_t *marks, size_t pixel_count, uint8_t *picture)
{
    for (size_t i = 0; i < pixel_count; i++)
        if (marks[i])
            memcpy(picture + 4 * i, colour, sizeof(colour));
}
