/* SPDX-License-Identifier: MIT */
/* Sorted nodes, and positions of their parents. */
#include "scene/hierarchy.h"

#include <stdlib.h>

static int compare_ids(const void *a, const void *b)
{
    uint32_t id_a = (*(const struct scene_node *const *)a)->base.id;
    uint32_t id_b = (*(const struct scene_node *const *)b)->base.id;
    return (id_a > id_b) - (id_a < id_b);
}

static bool is_sorted(const struct scene_node *const *nodes, size_t count)
{
    for (size_t i = 1; i < count; i++) {
        if (nodes[i - 1]->base.id > nodes[i]->base.id)
            return false;
    }
    return true;
}

static uint32_t position_of(const struct hierarchy *hierarchy, uint32_t id)
{
    const struct scene_node **nodes = hierarchy->nodes;
    /* The guess is usually right: most clients number their nodes from 1 without gaps. */
    size_t guess = (size_t)id - nodes[0]->base.id;
    if (id >= nodes[0]->base.id && guess < hierarchy->count && nodes[guess]->base.id == id)
        return (uint32_t)guess;
    size_t low = 0, high = hierarchy->count;
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        if (nodes[middle]->base.id < id)
            low = middle + 1;
        else
            high = middle;
    }
    return low < hierarchy->count && nodes[low]->base.id == id ? (uint32_t)low : HIERARCHY_NONE;
}

bool hierarchy_init(struct hierarchy *hierarchy, const struct scene_node **nodes, size_t count)
{
    *hierarchy = (struct hierarchy){.nodes = nodes, .count = count};
    if (!count)
        return true;
    hierarchy->parents = malloc(count * sizeof(*hierarchy->parents));
    if (!hierarchy->parents) {
        hierarchy_finish(hierarchy);
        return false;
    }
    if (!is_sorted(nodes, count))
        qsort(nodes, count, sizeof(const struct scene_node *), compare_ids);
    for (size_t i = 0; i < count; i++)
        hierarchy->parents[i] =
            nodes[i]->value.parent ? position_of(hierarchy, nodes[i]->value.parent) : HIERARCHY_NONE;
    return true;
}

void hierarchy_finish(struct hierarchy *hierarchy)
{
    free(hierarchy->nodes);
    free(hierarchy->parents);
    *hierarchy = (struct hierarchy){0};
}

bool hierarchy_of_scene(struct hierarchy *hierarchy, const struct scene *scene)
{
    *hierarchy = (struct hierarchy){0};
    const struct hashmap *map = &scene->objects[OBJECT_NODE];
    if (!map->count)
        return true;
    const struct scene_node **nodes = malloc(map->count * sizeof(*nodes));
    if (!nodes)
        return false;
    size_t cursor = 0, count = 0;
    void *value;
    while (hashmap_next(map, &cursor, NULL, &value))
        nodes[count++] = value;
    return hierarchy_init(hierarchy, nodes, count);
}
