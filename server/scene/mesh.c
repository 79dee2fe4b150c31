/* SPDX-License-Identifier: MIT */
/* Checks triangle meshes. Each check runs over every element: a loop per array and nothing else in it. */
#include "scene/edit.h"

#include "base/parallel.h"

#include <float.h>
#include <stdio.h>
#include <stdlib.h>

/* Counts that the sizes of arrays depend on. */
enum array_of { PER_VERTEX, PER_TRIANGLE, PER_INFLUENCE, PER_TARGET };

struct array_row {
    const char *path;
    unsigned components; /* 4 bytes each, floats except for the indices; 0: `bytes` per element, no floats */
    unsigned bytes;
    enum array_of of;
    bool required;
    float max; /* 0: any finite number */
};
static const struct array_row array_rows[MESH_ARRAY_COUNT] = {
    [MESH_POSITIONS] = {.path = ".arrays[0] (positions)",
                        .components = 3,
                        .required = true,
                        .max = COORDINATE_MAX},
    [MESH_INDICES] = {.path = ".arrays[1] (indices)", .components = 3, .of = PER_TRIANGLE, .required = true},
    [MESH_NORMALS] = {.path = ".arrays[2] (normals)", .components = 3},
    [MESH_TANGENTS] = {.path = ".arrays[3] (tangents)", .components = 4},
    [MESH_TEXCOORDS_0] = {.path = ".arrays[4] (texture coordinates 0)", .components = 2},
    [MESH_TEXCOORDS_1] = {.path = ".arrays[5] (texture coordinates 1)", .components = 2},
    [MESH_COLOURS] = {.path = ".arrays[6] (colours)", .bytes = 4},
    [MESH_JOINTS] = {.path = ".arrays[7] (joints)", .bytes = 2, .of = PER_INFLUENCE},
    [MESH_WEIGHTS] = {.path = ".arrays[8] (joint weights)",
                      .components = 1,
                      .of = PER_INFLUENCE,
                      .max = COORDINATE_MAX},
    [MESH_TARGET_POSITIONS] = {.path = ".arrays[9] (target positions)",
                               .components = 3,
                               .of = PER_TARGET,
                               .max = COORDINATE_MAX},
    [MESH_TARGET_NORMALS] = {.path = ".arrays[10] (target normals)",
                             .components = 3,
                             .of = PER_TARGET,
                             .max = COORDINATE_MAX},
    [MESH_TARGET_TANGENTS] = {.path = ".arrays[11] (target tangents)",
                              .components = 3,
                              .of = PER_TARGET,
                              .max = COORDINATE_MAX},
};

bool mesh_has_wide_colours(const struct scene_mesh *mesh)
{
    return mesh->arrays[MESH_COLOURS] &&
           mesh->arrays[MESH_COLOURS]->size_bytes == 4 * sizeof(uint16_t) * (uint64_t)mesh->value.vertex_count;
}

/* Elements of an array; neither product overflows 64 bits. */
static uint64_t element_count(const struct scene_mesh *mesh, const struct array_row *row)
{
    switch (row->of) {
    case PER_TRIANGLE:
        return mesh->value.triangle_count;
    case PER_INFLUENCE:
        return (uint64_t)mesh->value.vertex_count * mesh->value.influence_count;
    case PER_TARGET:
        return (uint64_t)mesh->value.vertex_count * mesh->value.target_count;
    case PER_VERTEX:
        break;
    }
    return mesh->value.vertex_count;
}

/* Whether arrays and counts agree: joints come with weights, targets with offsets. */
static bool company_check(const struct scene_mesh *mesh, const struct edit_place *place)
{
    for (int i = MESH_JOINTS; i < MESH_ARRAY_COUNT; i++) {
        bool of_joints = i == MESH_JOINTS || i == MESH_WEIGHTS;
        const char *count_name = of_joints ? "influence_count" : "target_count";
        uint32_t count = of_joints ? mesh->value.influence_count : mesh->value.target_count;
        bool needed = of_joints || i == MESH_TARGET_POSITIONS;
        if (count && needed && !mesh->arrays[i])
            return edit_error(place, ERROR_INVALID, array_rows[i].path, "%s is %u, so a mesh needs this array",
                              count_name, count);
        if (!count && mesh->arrays[i])
            return edit_error(place, ERROR_INVALID, array_rows[i].path, "%s is 0, so this array must be missing",
                              count_name);
    }
    if (mesh->value.influence_count > MESH_INFLUENCES_MAX)
        return edit_error(place, ERROR_INVALID, ".influence_count", "%u is more than %d",
                          mesh->value.influence_count, MESH_INFLUENCES_MAX);
    if (mesh->value.target_count > MESH_TARGETS_MAX)
        return edit_error(place, ERROR_INVALID, ".target_count", "%u is more than %d", mesh->value.target_count,
                          MESH_TARGETS_MAX);
    return true;
}

static bool sizes_check(const struct scene_mesh *mesh, const struct edit_place *place)
{
    for (int i = 0; i < MESH_ARRAY_COUNT; i++) {
        const struct array_row *row = &array_rows[i];
        if (!mesh->arrays[i]) {
            if (row->required)
                return edit_error(place, ERROR_INVALID, row->path, "a mesh needs this array");
            continue;
        }
        uint64_t element_bytes = row->components ? row->components * 4u : row->bytes;
        if (i == MESH_COLOURS && mesh_has_wide_colours(mesh))
            element_bytes = 4 * sizeof(uint16_t);
        if (!array_size_check(mesh->arrays[i], element_count(mesh, row), element_bytes, row->path, place))
            return false;
    }
    return true;
}

/* Names an element: "vertex 7", in a target "vertex 7 of target 2". */
static void name_element(const struct scene_mesh *mesh, const struct array_row *row, size_t element, char name[64])
{
    if (row->of == PER_TARGET)
        snprintf(name, 64, "vertex %zu of target %zu", element % mesh->value.vertex_count,
                 element / mesh->value.vertex_count);
    else
        snprintf(name, 64, "vertex %zu",
                 row->of == PER_INFLUENCE ? element / mesh->value.influence_count : element);
}

static bool floats_check(const struct scene_mesh *mesh, const struct edit_place *place)
{
    for (int i = 0; i < MESH_ARRAY_COUNT; i++) {
        const struct array_row *row = &array_rows[i];
        if (!mesh->arrays[i] || !row->components || i == MESH_INDICES)
            continue;
        const float *values = (const float *)(const void *)mesh->arrays[i]->data;
        size_t count = (size_t)element_count(mesh, row) * row->components;
        size_t bad = first_bad_float(values, count, row->max > 0.0f ? row->max : FLT_MAX);
        if (bad == count)
            continue;
        char name[64];
        name_element(mesh, row, bad / row->components, name);
        edit_error(place, ERROR_INVALID, row->path, "%s has %g as component %zu", name, (double)values[bad],
                   row->of == PER_INFLUENCE ? bad % mesh->value.influence_count : bad % row->components);
        return error_remedy(place->error, "numbers must be finite%s",
                            row->max > 0.0f ? " and not beyond 1e18" : "");
    }
    return true;
}

/* Checks that weights are not negative, and notes the greatest joint, as a skin must have that many. */
static bool influences_check(struct scene_mesh *mesh, const struct edit_place *place)
{
    mesh->joint_places = 0;
    if (!mesh->value.influence_count)
        return true;
    const uint16_t *joints = (const uint16_t *)(const void *)mesh->arrays[MESH_JOINTS]->data;
    const float *weights = (const float *)(const void *)mesh->arrays[MESH_WEIGHTS]->data;
    size_t count = (size_t)mesh->value.vertex_count * mesh->value.influence_count;
    uint16_t maximum = 0;
    float minimum = 0.0f;
    for (size_t i = 0; i < count; i++)
        maximum = joints[i] > maximum ? joints[i] : maximum;
    for (size_t i = 0; i < count; i++)
        minimum = weights[i] < minimum ? weights[i] : minimum;
    mesh->joint_places = maximum + 1u;
    if (minimum >= 0.0f)
        return true;
    size_t bad = 0;
    while (weights[bad] >= 0.0f)
        bad++;
    return edit_error(place, ERROR_INVALID, array_rows[MESH_WEIGHTS].path, "vertex %zu has the weight %g",
                      bad / mesh->value.influence_count, (double)weights[bad]);
}

/* Length of a block: it is constant, so that the compiler processes several indices at a time. */
#define INDEX_BLOCK 1536

static uint32_t max_index(const uint32_t *indices, size_t count)
{
    uint32_t maximum = 0;
    if (count == INDEX_BLOCK) {
        for (size_t i = 0; i < INDEX_BLOCK; i++)
            maximum = indices[i] > maximum ? indices[i] : maximum;
        return maximum;
    }
    for (size_t i = 0; i < count; i++)
        maximum = indices[i] > maximum ? indices[i] : maximum;
    return maximum;
}

struct bounds {
    float x_lower, y_lower, z_lower, x_upper, y_upper, z_upper;
};

static void extend(struct bounds *bounds, const float *positions, const uint32_t *indices, size_t count)
{
    struct bounds b = *bounds;
    for (size_t i = 0; i < count; i++) {
        const float *p = positions + (size_t)indices[i] * 3;
        b.x_lower = p[0] < b.x_lower ? p[0] : b.x_lower;
        b.y_lower = p[1] < b.y_lower ? p[1] : b.y_lower;
        b.z_lower = p[2] < b.z_lower ? p[2] : b.z_lower;
        b.x_upper = p[0] > b.x_upper ? p[0] : b.x_upper;
        b.y_upper = p[1] > b.y_upper ? p[1] : b.y_upper;
        b.z_upper = p[2] > b.z_upper ? p[2] : b.z_upper;
    }
    *bounds = b;
}

/* Part of a large mesh that a thread checks. */
#define PART (128u * INDEX_BLOCK)

struct part {
    struct bounds bounds;
    size_t bad; /* first index out of range; SIZE_MAX: none */
};

struct parts {
    const uint32_t *indices;
    const float *positions;
    size_t count; /* indices */
    uint32_t vertex_count;
    struct part *parts;
};

static void check_part(void *context, uint32_t number)
{
    const struct parts *of = context;
    struct part *part = &of->parts[number];
    const size_t first = (size_t)number * PART, end = of->count - first < PART ? of->count : first + PART;
    *part = (struct part){{FLT_MAX, FLT_MAX, FLT_MAX, -FLT_MAX, -FLT_MAX, -FLT_MAX}, SIZE_MAX};
    for (size_t begin = first; begin < end; begin += INDEX_BLOCK) {
        const size_t length = end - begin < INDEX_BLOCK ? end - begin : INDEX_BLOCK;
        if (max_index(of->indices + begin, length) >= of->vertex_count) {
            part->bad = begin;
            while (of->indices[part->bad] < of->vertex_count)
                part->bad++;
            return;
        }
        extend(&part->bounds, of->positions, of->indices + begin, length);
    }
}

static void unite(struct scene_mesh *mesh, const struct bounds *bounds)
{
    const float lower[3] = {bounds->x_lower, bounds->y_lower, bounds->z_lower};
    const float upper[3] = {bounds->x_upper, bounds->y_upper, bounds->z_upper};
    for (int axis = 0; axis < 3; axis++) {
        mesh->lower[axis] = lower[axis] < mesh->lower[axis] ? lower[axis] : mesh->lower[axis];
        mesh->upper[axis] = upper[axis] > mesh->upper[axis] ? upper[axis] : mesh->upper[axis];
    }
}

/* Checks the range of indices, and finds the bounds of the vertices that triangles use: arrays may be shared
 * between meshes, so that most vertices belong to others. */
static bool indices_check(struct scene_mesh *mesh, const struct edit_place *place)
{
    struct parts parts = {.indices = (const uint32_t *)(const void *)mesh->arrays[MESH_INDICES]->data,
                          .positions = (const float *)(const void *)mesh->arrays[MESH_POSITIONS]->data,
                          .count = (size_t)mesh->value.triangle_count * 3,
                          .vertex_count = mesh->value.vertex_count};
    const uint32_t part_count = (uint32_t)((parts.count + PART - 1) / PART);
    parts.parts = malloc(part_count * sizeof(*parts.parts));
    if (!parts.parts)
        return edit_error(place, ERROR_OUT_OF_MEMORY, "", "no memory to check a mesh");
    parallel_run(part_count > 1 ? parallel_processors() : 1, part_count, check_part, &parts);
    for (int axis = 0; axis < 3; axis++) {
        mesh->lower[axis] = FLT_MAX;
        mesh->upper[axis] = -FLT_MAX;
    }
    size_t bad = SIZE_MAX;
    for (uint32_t i = 0; i < part_count && bad == SIZE_MAX; i++) {
        bad = parts.parts[i].bad;
        unite(mesh, &parts.parts[i].bounds);
    }
    free(parts.parts);
    return bad == SIZE_MAX || edit_error(place, ERROR_INVALID, array_rows[MESH_INDICES].path,
                                         "triangle %zu refers to vertex %u of %u", bad / 3, parts.indices[bad],
                                         mesh->value.vertex_count);
}

bool mesh_check_shape(const struct scene_mesh *mesh, const struct edit_place *place)
{
    if (!mesh->value.vertex_count || !mesh->value.triangle_count)
        return edit_error(place, ERROR_INVALID, mesh->value.vertex_count ? ".triangle_count" : ".vertex_count",
                          "a mesh has at least one triangle");
    return company_check(mesh, place) && sizes_check(mesh, place) &&
           weights_check(mesh->weights, mesh->weight_count, place) &&
           ranges_check(mesh->ranges, mesh->range_count, mesh->value.triangle_count, place);
}

bool mesh_check_content(struct scene_mesh *mesh, const struct edit_place *place)
{
    return floats_check(mesh, place) && influences_check(mesh, place) && indices_check(mesh, place);
}
