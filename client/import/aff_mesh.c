/* SPDX-License-Identifier: MIT */
/* `m`, `tt` and `ttp`. */
#include "aff.h"

#include <stdlib.h>
#include <string.h>

/* What comes next has the fill with a texture on it; the caller restores the material. */
static bool use_texture(struct aff *aff, uint32_t texture)
{
    bool used;

    aff->nff.fill.texture = texture;
    used = nff_use_fill(&aff->nff);
    aff->nff.fill.texture = 0;
    aff->nff.shapes->textured = true;
    return used;
}

bool aff_read_textured_triangle(struct aff *aff, bool patch)
{
    const char *of = patch ? "ttp" : "tt";
    struct shapes *shapes = aff->nff.shapes;
    struct shape_vertex corners[3] = {0};
    uint32_t texture, material = shapes->material;
    bool read;

    if (!aff_read_texture(aff, &texture, of))
        return false;
    for (int i = 0; i < 3; i++)
        if (!word_reader_numbers(&aff->nff.reader, corners[i].position, 3, of) ||
            (patch && !word_reader_numbers(&aff->nff.reader, corners[i].normal, 3, of)) ||
            !word_reader_numbers(&aff->nff.reader, corners[i].texcoord, 2, of))
            return false;
    read = use_texture(aff, texture) &&
           shapes_add_polygon(shapes, corners, 3, !patch, word_reader_where(&aff->nff.reader));
    shapes->material = material;
    return read;
}

/* ---- indexed meshes ---- */

/* A vertex that was made of a position with a normal and texture coordinates. */
struct made {
    uint32_t normal, texcoord, vertex;
    uint32_t next; /* of the same position: number of `made`, from 1 on; 0: none */
};

struct mesh {
    float *positions, *normals, *texcoords; /* NULL: the file has none */
    uint32_t position_count, normal_count, texcoord_count;
    uint32_t texture;
    uint32_t *newest; /* for each position: number of `made` */
    struct made *made;
    uint32_t made_count;
};

static void mesh_finish(struct mesh *mesh)
{
    free(mesh->positions);
    free(mesh->normals);
    free(mesh->texcoords);
    free(mesh->newest);
    free(mesh->made);
}

/* NULL: the scene has failed. */
static float *read_array(struct aff *aff, uint32_t count, uint32_t width, const char *of)
{
    float *floats;

    if (!word_reader_can_hold(&aff->nff.reader, (uint64_t)count * width, of))
        return NULL;
    floats = malloc((size_t)count * width * sizeof(*floats));
    if (!floats) {
        import_fail(aff->nff.scene, NULL, "out of memory");
        return NULL;
    }
    if (word_reader_numbers(&aff->nff.reader, floats, count * width, of))
        return floats;
    free(floats);
    return NULL;
}

static bool read_arrays(struct aff *aff, struct mesh *mesh)
{
    struct word_reader *reader = &aff->nff.reader;
    struct word word;

    if (!word_reader_get(reader, &word, "m"))
        return false;
    if (!word_is(word, "vertices"))
        return import_fail(aff->nff.scene, word_reader_where(reader),
                           "'m' begins with 'vertices', but there is '%.*s'", word_shown(word), word.text);
    if (!word_reader_count(reader, &mesh->position_count, 1, SHAPES_TRIANGLES_MAX, "vertices"))
        return false;
    mesh->positions = read_array(aff, mesh->position_count, 3, "vertices");
    if (!mesh->positions || !word_reader_get(reader, &word, "m"))
        return false;
    if (word_is(word, "normals")) {
        if (!word_reader_count(reader, &mesh->normal_count, 1, SHAPES_TRIANGLES_MAX, "normals"))
            return false;
        mesh->normals = read_array(aff, mesh->normal_count, 3, "normals");
        if (!mesh->normals || !word_reader_get(reader, &word, "m"))
            return false;
    }
    if (word_is(word, "texturecoords")) {
        if (!word_reader_count(reader, &mesh->texcoord_count, 1, SHAPES_TRIANGLES_MAX, "texturecoords") ||
            !aff_read_texture(aff, &mesh->texture, "texturecoords"))
            return false;
        mesh->texcoords = read_array(aff, mesh->texcoord_count, 2, "texturecoords");
        if (!mesh->texcoords || !word_reader_get(reader, &word, "m"))
            return false;
    }
    return word_is(word, "triangles") ||
           import_fail(aff->nff.scene, word_reader_where(reader), "'triangles' should follow, but there is '%.*s'",
                       word_shown(word), word.text);
}

struct triangle {
    uint32_t positions[3], normals[3], texcoords[3];
};

static bool read_corners(struct aff *aff, uint32_t corners[3], uint32_t count, const char *of)
{
    for (int i = 0; i < 3; i++)
        if (!word_reader_count(&aff->nff.reader, &corners[i], 0, count - 1, of))
            return false;
    return true;
}

static bool read_triangle(struct aff *aff, const struct mesh *mesh, struct triangle *triangle)
{
    return read_corners(aff, triangle->positions, mesh->position_count, "a corner's vertex") &&
           (!mesh->normals || read_corners(aff, triangle->normals, mesh->normal_count, "a corner's normal")) &&
           (!mesh->texcoords ||
            read_corners(aff, triangle->texcoords, mesh->texcoord_count, "a corner's texture coordinates"));
}

static struct shape_vertex vertex_of(const struct mesh *mesh, const struct triangle *triangle, int corner)
{
    struct shape_vertex vertex = {0};

    memcpy(vertex.position, mesh->positions + (size_t)triangle->positions[corner] * 3, 12);
    if (mesh->normals)
        memcpy(vertex.normal, mesh->normals + (size_t)triangle->normals[corner] * 3, 12);
    if (mesh->texcoords)
        memcpy(vertex.texcoord, mesh->texcoords + (size_t)triangle->texcoords[corner] * 2, 8);
    return vertex;
}

/* Corners that are alike share a vertex; of those at one position only the newest are looked at, or a file of many
 * normals at one place would take the square of their number. */
static uint32_t share_vertex(struct shapes *shapes, struct mesh *mesh, const struct triangle *triangle, int corner)
{
    uint32_t *newest = &mesh->newest[triangle->positions[corner]];
    struct made made = {triangle->normals[corner], triangle->texcoords[corner], 0, *newest};
    struct shape_vertex vertex;
    uint32_t at = *newest;

    for (int looked = 0; at != 0 && looked < 8; looked++, at = mesh->made[at - 1].next)
        if (mesh->made[at - 1].normal == made.normal && mesh->made[at - 1].texcoord == made.texcoord)
            return mesh->made[at - 1].vertex;
    vertex = vertex_of(mesh, triangle, corner);
    made.vertex = shapes_add_vertex(shapes, &vertex);
    mesh->made[mesh->made_count++] = made;
    *newest = mesh->made_count;
    return made.vertex;
}

static void add_smooth(struct shapes *shapes, struct mesh *mesh, const struct triangle *triangle)
{
    uint32_t corners[3];

    for (int i = 0; i < 3; i++)
        corners[i] = share_vertex(shapes, mesh, triangle, i);
    shapes_add_triangle(shapes, corners[0], corners[1], corners[2]);
}

static bool add_flat(struct aff *aff, const struct mesh *mesh, const struct triangle *triangle)
{
    struct shape_vertex corners[3];

    for (int i = 0; i < 3; i++)
        corners[i] = vertex_of(mesh, triangle, i);
    return shapes_add_polygon(aff->nff.shapes, corners, 3, true, word_reader_where(&aff->nff.reader));
}

static bool read_triangles(struct aff *aff, struct mesh *mesh)
{
    struct shapes *shapes = aff->nff.shapes;
    uint32_t count, numbers = 3;
    struct triangle triangle = {0};
    bool read = true;

    if (mesh->normals)
        numbers += 3;
    if (mesh->texcoords)
        numbers += 3;
    if (!word_reader_count(&aff->nff.reader, &count, 1, SHAPES_TRIANGLES_MAX, "triangles") ||
        !word_reader_can_hold(&aff->nff.reader, (uint64_t)count * numbers, "triangles") ||
        !shapes_reserve(shapes, (size_t)count * 3, count))
        return false;
    mesh->newest = calloc(mesh->position_count, sizeof(*mesh->newest));
    mesh->made = malloc((size_t)count * 3 * sizeof(*mesh->made));
    if (!mesh->newest || !mesh->made)
        return import_fail(aff->nff.scene, NULL, "out of memory");
    for (uint32_t i = 0; read && i < count; i++) {
        read = read_triangle(aff, mesh, &triangle);
        if (read && mesh->normals)
            add_smooth(shapes, mesh, &triangle);
        else
            read = read && add_flat(aff, mesh, &triangle);
    }
    return read;
}

bool aff_read_mesh(struct aff *aff)
{
    struct shapes *shapes = aff->nff.shapes;
    uint32_t material = shapes->material;
    struct mesh mesh = {0};
    bool read = read_arrays(aff, &mesh);

    if (read && mesh.texcoords)
        read = use_texture(aff, mesh.texture);
    read = read && read_triangles(aff, &mesh);
    shapes->material = material;
    mesh_finish(&mesh);
    return read;
}
