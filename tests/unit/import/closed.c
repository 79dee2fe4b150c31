/* SPDX-License-Identifier: MIT */
/* Which meshes bound a body. */
#include "import/model/closed.h"
#include "tests/harness/test.h"

#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

/* Corner i is at (bit 0, bit 1, bit 2) of i; triangles are counter-clockwise from outside. */
#define CUBE_VERTICES 8
#define CUBE_TRIANGLES 12
static const uint32_t cube[CUBE_TRIANGLES][3] = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                                                 {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};

struct mesh {
    float positions[128][3];
    uint32_t indices[128][3];
    uint32_t vertex_count, triangle_count;
};

static uint32_t add_vertex(struct mesh *mesh, float x, float y, float z)
{
    assert_true(mesh->vertex_count < 128);
    memcpy(mesh->positions[mesh->vertex_count], (float[3]){x, y, z}, sizeof(mesh->positions[0]));
    return mesh->vertex_count++;
}

static void add_triangle(struct mesh *mesh, uint32_t a, uint32_t b, uint32_t c)
{
    assert_true(mesh->triangle_count < 128);
    memcpy(mesh->indices[mesh->triangle_count++], (uint32_t[3]){a, b, c}, sizeof(mesh->indices[0]));
}

static void add_cube(struct mesh *mesh, float x, float size)
{
    const uint32_t first = mesh->vertex_count;
    for (uint32_t i = 0; i < CUBE_VERTICES; i++)
        add_vertex(mesh, x + size * (float)(i & 1), size * (float)(i >> 1 & 1), size * (float)(i >> 2));
    for (uint32_t t = 0; t < CUBE_TRIANGLES; t++)
        add_triangle(mesh, first + cube[t][0], first + cube[t][1], first + cube[t][2]);
}

static bool closed(const struct mesh *mesh)
{
    return import_triangles_closed(mesh->positions[0], mesh->vertex_count, mesh->indices[0], mesh->triangle_count);
}

static void flip(struct mesh *mesh, uint32_t triangle)
{
    const uint32_t kept = mesh->indices[triangle][1];
    mesh->indices[triangle][1] = mesh->indices[triangle][2];
    mesh->indices[triangle][2] = kept;
}

TEST(a_cube_is_closed_and_open_without_any_of_its_triangles)
{
    struct mesh whole = {0};
    add_cube(&whole, 0, 1);
    assert_true(closed(&whole));
    for (uint32_t missing = 0; missing < CUBE_TRIANGLES; missing++) {
        struct mesh mesh = whole;
        mesh.triangle_count--;
        memcpy(mesh.indices[missing], mesh.indices[mesh.triangle_count], sizeof(mesh.indices[0]));
        assert_false(closed(&mesh));
    }
}

TEST(faces_have_to_be_wound_the_same_way_whichever_it_is)
{
    struct mesh mesh = {0};
    add_cube(&mesh, 0, 1);
    flip(&mesh, 4);
    assert_false(closed(&mesh));
    flip(&mesh, 5); /* with it the whole face looks inside */
    assert_false(closed(&mesh));
    flip(&mesh, 4);
    flip(&mesh, 5);
    for (uint32_t t = 0; t < CUBE_TRIANGLES; t++)
        flip(&mesh, t);
    assert_true(closed(&mesh));
}

TEST(several_bodies_are_closed_if_each_is)
{
    struct mesh mesh = {0};
    add_cube(&mesh, 0, 1);
    add_cube(&mesh, 3, 2);        /* apart */
    add_cube(&mesh, 0.25f, 0.5f); /* within the first */
    assert_true(closed(&mesh));
    mesh.triangle_count--;
    assert_false(closed(&mesh));
}

/* Two bodies that share an edge: four triangles at it. */
TEST(an_edge_may_have_four_triangles)
{
    struct mesh mesh = {0};
    add_cube(&mesh, 0, 1);
    add_cube(&mesh, 1, 1);
    for (uint32_t i = CUBE_VERTICES; i < mesh.vertex_count; i++)
        mesh.positions[i][1] += 1; /* up and aside: the edge from (1, 1, 0) to (1, 1, 1) is both's */
    assert_true(closed(&mesh));
}

TEST(what_counts_is_where_corners_are_not_their_numbers)
{
    struct mesh mesh = {0}, seams = {0};
    add_cube(&mesh, 0, 1);
    for (uint32_t t = 0; t < CUBE_TRIANGLES; t++) { /* a vertex of its own for every corner */
        for (int c = 0; c < 3; c++) {
            const float *p = mesh.positions[cube[t][c]];
            add_vertex(&seams, p[0], p[1], p[2]);
        }
        add_triangle(&seams, 3 * t, 3 * t + 1, 3 * t + 2);
    }
    assert_true(closed(&seams));
    for (uint32_t i = 0; i < seams.vertex_count; i += 2)
        for (int c = 0; c < 3; c++)
            if (seams.positions[i][c] == 0)
                seams.positions[i][c] = -0.0f;
    assert_true(closed(&seams));
    seams.positions[7][0] = nextafterf(seams.positions[7][0], 2); /* the smallest of cracks is one */
    assert_false(closed(&seams));
}

TEST(a_corner_on_an_edge_leaves_a_gap_until_a_sliver_closes_it)
{
    struct mesh mesh = {0};
    add_cube(&mesh, 0, 1);
    /* The edge from 0 to 1 belongs to (0, 3, 1) and (0, 1, 5): the latter is cut in two at its middle. */
    const uint32_t middle = add_vertex(&mesh, 0.5f, 0, 0);
    mesh.indices[4][1] = middle;
    add_triangle(&mesh, middle, 1, 5);
    assert_false(closed(&mesh));
    add_triangle(&mesh, 0, 1, middle);
    assert_true(closed(&mesh));
}

TEST(triangles_with_two_corners_at_one_place_are_not_there)
{
    struct mesh mesh = {0}, nothing = {0};
    add_cube(&mesh, 0, 1);
    const uint32_t again = add_vertex(&mesh, 1, 1, 1);
    add_triangle(&mesh, 7, again, 0);
    add_triangle(&mesh, 2, 2, 6);
    add_triangle(&mesh, 2, 2, 6); /* twice: it is still no sheet */
    add_triangle(&mesh, 5, 5, 5);
    assert_true(closed(&mesh));
    add_vertex(&nothing, 1, 2, 3);
    add_triangle(&nothing, 0, 0, 0);
    assert_false(closed(&nothing)); /* bounds no body */
}

TEST(sheets_with_two_sides_bound_nothing)
{
    struct mesh sheet = {0}, beside = {0};
    for (uint32_t i = 0; i < 4; i++)
        add_vertex(&sheet, (float)(i & 1), (float)(i >> 1), 0);
    add_triangle(&sheet, 0, 1, 3);
    add_triangle(&sheet, 0, 3, 2);
    assert_false(closed(&sheet));
    add_triangle(&sheet, 3, 1, 0);
    add_triangle(&sheet, 2, 3, 0);
    assert_false(closed(&sheet));
    add_cube(&beside, 0, 1);
    const uint32_t a = add_vertex(&beside, 5, 0, 0);
    const uint32_t b = add_vertex(&beside, 6, 0, 0), c = add_vertex(&beside, 5, 1, 0);
    add_triangle(&beside, a, b, c);
    add_triangle(&beside, a, c, b);
    assert_false(closed(&beside));
}

TEST(two_coincident_bodies_are_closed)
{
    struct mesh mesh = {0};
    add_cube(&mesh, 0, 1);
    add_cube(&mesh, 0, 1);
    for (uint32_t t = 0; t < CUBE_TRIANGLES; t++) { /* with other corners first */
        uint32_t *corners = mesh.indices[CUBE_TRIANGLES + t], first = corners[0];
        corners[0] = corners[1], corners[1] = corners[2], corners[2] = first;
    }
    assert_true(closed(&mesh));
    for (uint32_t t = 0; t < CUBE_TRIANGLES; t++) /* inside out: nothing is left of it */
        flip(&mesh, t);
    assert_false(closed(&mesh));
}

TEST(a_moebius_strip_is_open_and_has_no_sides)
{
    enum { STEPS = 12 };
    struct mesh strip = {0};
    for (uint32_t i = 0; i < STEPS; i++) {
        const float turn = 6.2831853f * (float)i / STEPS;
        for (int side = 0; side < 2; side++) {
            const float across = side ? 0.3f : -0.3f, radius = 1 + across * cosf(turn / 2);
            add_vertex(&strip, radius * cosf(turn), radius * sinf(turn), across * sinf(turn / 2));
        }
    }
    for (uint32_t i = 0; i < STEPS; i++) {
        const bool last = i + 1 == STEPS; /* joined upside down */
        const uint32_t a = 2 * i, b = a + 1, c = last ? 1 : a + 2, d = last ? 0 : a + 3;
        add_triangle(&strip, a, c, b);
        add_triangle(&strip, b, c, d);
    }
    assert_false(closed(&strip));
}

/* A torus of a million triangles whose last row and column are vertices of their own: no table that is too small,
 * no sum that runs over, nothing quadratic. */
TEST(a_million_triangles_are_looked_at)
{
    enum { STEPS = 720, EACH = STEPS + 1 };
    const uint32_t triangle_count = 2 * STEPS * STEPS;
    float(*positions)[3] = malloc(sizeof(*positions) * EACH * EACH);
    uint32_t(*indices)[3] = malloc(sizeof(*indices) * triangle_count), (*out)[3] = indices;
    assert_true(positions && indices);
    for (uint32_t i = 0; i < EACH * EACH; i++) {
        const float u = 6.2831853f * (float)(i % EACH % STEPS) / STEPS;
        const float v = 6.2831853f * (float)(i / EACH % STEPS) / STEPS, across = 3 + cosf(v);
        memcpy(positions[i], (float[3]){across * cosf(u), sinf(v), across * sinf(u)}, sizeof(*positions));
    }
    for (uint32_t i = 0; i < STEPS * STEPS; i++) {
        const uint32_t a = i / STEPS * EACH + i % STEPS, b = a + EACH;
        memcpy(*out++, (uint32_t[3]){a, a + 1, b}, sizeof(*out));
        memcpy(*out++, (uint32_t[3]){a + 1, b + 1, b}, sizeof(*out));
    }
    assert_true(import_triangles_closed(positions[0], EACH * EACH, indices[0], triangle_count));
    assert_false(import_triangles_closed(positions[0], EACH * EACH, indices[0], triangle_count - 1));
    memcpy(indices[1234], indices[77777], sizeof(*indices));
    assert_false(import_triangles_closed(positions[0], EACH * EACH, indices[0], triangle_count));
    free(positions);
    free(indices);
}
