/* SPDX-License-Identifier: MIT */
/* Meshes and spheres grouped by material. */
#include "grouping.h"

#include <stdlib.h>
#include <string.h>

struct keyed {
    uint32_t material, position;
};

static int compare_keyed(const void *a, const void *b)
{
    const struct keyed *left = a, *right = b;

    if (left->material != right->material)
        return left->material < right->material ? -1 : 1;
    return left->position < right->position ? -1 : left->position > right->position;
}

/* Sorts primitives by material; NULL: out of memory. */
static struct keyed *sort_by_material(const uint32_t *materials, uint32_t count)
{
    struct keyed *order = malloc(((size_t)count + 1) * sizeof(*order));
    bool sorted = true;

    if (!order)
        return NULL;
    for (uint32_t i = 0; i < count; i++) {
        order[i] = (struct keyed){materials[i], i};
        sorted = sorted && (i == 0 || materials[i - 1] <= materials[i]);
    }
    if (!sorted)
        qsort(order, count, sizeof(*order), compare_keyed);
    return order;
}

/* Makes ranges of the primitives from `first` on, at most IMPORT_RANGES_MAX; *end is the first primitive after
 * them. */
static struct record_material_range *make_ranges(const struct keyed *order, uint32_t first, uint32_t count,
                                                 uint32_t *range_count, uint32_t *end)
{
    struct record_material_range *ranges = malloc(IMPORT_RANGES_MAX * sizeof(*ranges));
    uint32_t used = 0, at = first;

    if (!ranges)
        return NULL;
    for (; at < count; at++) {
        if (used == 0 || ranges[used - 1].material != order[at].material) {
            if (used == IMPORT_RANGES_MAX)
                break;
            ranges[used++] = (struct record_material_range){at - first, 0, order[at].material};
        }
        ranges[used - 1].count++;
    }
    *range_count = used;
    *end = at;
    return ranges;
}

static bool show(struct import_scene *scene, uint32_t parent, enum protocol_node_kind kind, uint32_t object,
                 const char *name)
{
    struct message_set_node node = {
        .value.parent = parent, .value.kind = kind, .value.object = object, .name = name};

    import_identity(node.value.parent_from_node);
    return object != 0 && import_add_node(scene, &node) != 0;
}

static void *copy_array(const void *from, size_t bytes)
{
    void *copy = from ? malloc(bytes + 1) : NULL;

    if (copy)
        memcpy(copy, from, bytes);
    return copy;
}

/* Copies a mesh with other triangles. The vertices are the same bytes, so they are sent once. */
static void copy_vertices(struct import_mesh *to, const struct import_mesh *from)
{
    size_t count = from->vertex_count;

    *to = *from;
    to->positions = copy_array(from->positions, count * 12);
    to->normals = copy_array(from->normals, count * 12);
    to->tangents = copy_array(from->tangents, count * 16);
    to->texcoords[0] = copy_array(from->texcoords[0], count * 8);
    to->texcoords[1] = copy_array(from->texcoords[1], count * 8);
    to->colours = copy_array(from->colours, count * 4 * sizeof(*from->colours));
}

static bool add_lot(struct import_scene *scene, uint32_t parent, const struct import_mesh *mesh,
                    const struct keyed *order, uint32_t *first)
{
    struct import_mesh lot;
    uint32_t end = *first, range_count = 0;
    struct record_material_range *ranges = make_ranges(order, *first, mesh->triangle_count, &range_count, &end);

    copy_vertices(&lot, mesh);
    lot.ranges = ranges;
    lot.range_count = range_count;
    lot.triangle_count = end - *first;
    lot.indices = malloc(((size_t)lot.triangle_count + 1) * 12);
    if (!ranges || !lot.indices) {
        import_mesh_finish(&lot);
        return import_fail(scene, NULL, "out of memory");
    }
    for (uint32_t i = 0; i < lot.triangle_count; i++)
        memcpy(lot.indices + (size_t)i * 3, mesh->indices + (size_t)order[*first + i].position * 3, 12);
    *first = end;
    return show(scene, parent, PROTOCOL_NODE_MESH, import_add_mesh(scene, &lot), mesh->name);
}

bool import_add_grouped_mesh(struct import_scene *scene, uint32_t parent, struct import_mesh *mesh,
                             const uint32_t *materials)
{
    struct keyed *order = sort_by_material(materials, mesh->triangle_count);
    bool added = order || import_fail(scene, NULL, "out of memory");

    for (uint32_t first = 0; added && first < mesh->triangle_count;)
        added = add_lot(scene, parent, mesh, order, &first);
    free(order);
    import_mesh_finish(mesh);
    return added;
}

bool import_add_grouped_spheres(struct import_scene *scene, uint32_t parent, const char *name,
                                const float *spheres, const uint32_t *materials, uint32_t count)
{
    struct keyed *order = sort_by_material(materials, count);
    bool added = order || import_fail(scene, NULL, "out of memory");

    for (uint32_t first = 0; added && first < count;) {
        uint32_t end = first, range_count = 0;
        struct record_material_range *ranges = make_ranges(order, first, count, &range_count, &end);
        float *lot = malloc(((size_t)(end - first) + 1) * 16);

        if (!ranges || !lot) {
            free(ranges);
            free(lot);
            added = import_fail(scene, NULL, "out of memory");
            break;
        }
        for (uint32_t i = first; i < end; i++)
            memcpy(lot + (size_t)(i - first) * 4, spheres + (size_t)order[i].position * 4, 16);
        added = show(scene, parent, PROTOCOL_NODE_SPHERES,
                     import_add_spheres(scene, name, lot, end - first, ranges, range_count), name);
        first = end;
    }
    free(order);
    return added;
}
