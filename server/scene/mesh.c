/* SPDX-License-Identifier: MIT */
/* Checks of triangle meshes. They run over every element on the thread that owns GL: a loop per array and
 * nothing else in it. */
#include "scene/edit.h"

#include <float.h>

struct array_row {
    const char *path;
    unsigned components; /* 4 bytes each; 0: 4 bytes a vertex that need no check */
    bool per_triangle, required;
};
static const struct array_row array_rows[MESH_ARRAY_COUNT] = {
    [MESH_POSITIONS] = {.path = ".arrays[0] (positions)", .components = 3, .required = true},
    [MESH_INDICES] = {.path = ".arrays[1] (indices)", .components = 3, .per_triangle = true, .required = true},
    [MESH_NORMALS] = {.path = ".arrays[2] (normals)", .components = 3},
    [MESH_TANGENTS] = {.path = ".arrays[3] (tangents)", .components = 4},
    [MESH_TEXCOORDS_0] = {.path = ".arrays[4] (texture coordinates 0)", .components = 2},
    [MESH_TEXCOORDS_1] = {.path = ".arrays[5] (texture coordinates 1)", .components = 2},
    [MESH_COLOURS] = {.path = ".arrays[6] (colours)", .components = 0},
};

static bool sizes_check(const struct scene_mesh *mesh, const struct edit_place *place)
{
    for (int i = 0; i < MESH_ARRAY_COUNT; i++) {
        const struct array_row *row = &array_rows[i];
        if (!mesh->arrays[i]) {
            if (row->required)
                return edit_error(place, ERROR_INVALID, row->path, "a mesh needs this array");
            continue;
        }
        uint64_t element_bytes = row->components ? row->components * 4u : 4u;
        uint32_t count = row->per_triangle ? mesh->triangle_count : mesh->vertex_count;
        if (!array_size_check(mesh->arrays[i], count, element_bytes, row->path, place))
            return false;
    }
    return true;
}

static bool floats_check(const struct scene_mesh *mesh, const struct edit_place *place)
{
    for (int i = 0; i < MESH_ARRAY_COUNT; i++) {
        const struct array_row *row = &array_rows[i];
        if (!mesh->arrays[i] || !row->components || i == MESH_INDICES)
            continue;
        const float *values = (const float *)(const void *)mesh->arrays[i]->data;
        size_t count = (size_t)mesh->vertex_count * row->components;
        float greatest = i == MESH_POSITIONS ? COORDINATE_MAX : FLT_MAX;
        size_t bad = first_bad_float(values, count, greatest);
        if (bad == count)
            continue;
        edit_error(place, ERROR_INVALID, row->path, "vertex %zu has %g as component %zu", bad / row->components,
                   (double)values[bad], bad % row->components);
        return error_remedy(place->error, "numbers must be finite%s",
                            i == MESH_POSITIONS ? " and not beyond 1e18" : "");
    }
    return true;
}

/* A block has a constant length, so that the compiler does several indices at a time. */
#define INDEX_BLOCK 1536

static uint32_t greatest_index(const uint32_t *indices, size_t count)
{
    uint32_t greatest = 0;
    if (count == INDEX_BLOCK) {
        for (size_t i = 0; i < INDEX_BLOCK; i++)
            greatest = indices[i] > greatest ? indices[i] : greatest;
        return greatest;
    }
    for (size_t i = 0; i < count; i++)
        greatest = indices[i] > greatest ? indices[i] : greatest;
    return greatest;
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

/* The indices' range check and the bounds of the vertices that triangles use: arrays may be shared between
 * meshes, so that most vertices belong to others. */
static bool indices_check(struct scene_mesh *mesh, const struct edit_place *place)
{
    const uint32_t *indices = (const uint32_t *)(const void *)mesh->arrays[MESH_INDICES]->data;
    const float *positions = (const float *)(const void *)mesh->arrays[MESH_POSITIONS]->data;
    size_t count = (size_t)mesh->triangle_count * 3;
    struct bounds bounds = {FLT_MAX, FLT_MAX, FLT_MAX, -FLT_MAX, -FLT_MAX, -FLT_MAX};
    for (size_t begin = 0; begin < count; begin += INDEX_BLOCK) {
        size_t length = count - begin < INDEX_BLOCK ? count - begin : INDEX_BLOCK;
        if (greatest_index(indices + begin, length) >= mesh->vertex_count) {
            size_t bad = begin;
            while (indices[bad] < mesh->vertex_count)
                bad++;
            return edit_error(place, ERROR_INVALID, array_rows[MESH_INDICES].path,
                              "triangle %zu refers to vertex %u of %u", bad / 3, indices[bad], mesh->vertex_count);
        }
        extend(&bounds, positions, indices + begin, length);
    }
    mesh->lower[0] = bounds.x_lower, mesh->lower[1] = bounds.y_lower, mesh->lower[2] = bounds.z_lower;
    mesh->upper[0] = bounds.x_upper, mesh->upper[1] = bounds.y_upper, mesh->upper[2] = bounds.z_upper;
    return true;
}

bool mesh_check(struct scene_mesh *mesh, const struct edit_place *place)
{
    if (!mesh->vertex_count || !mesh->triangle_count)
        return edit_error(place, ERROR_INVALID, mesh->vertex_count ? ".triangle_count" : ".vertex_count",
                          "a mesh has at least one triangle");
    return sizes_check(mesh, place) && floats_check(mesh, place) && indices_check(mesh, place) &&
           ranges_check(mesh->ranges, mesh->range_count, mesh->triangle_count, place);
}
