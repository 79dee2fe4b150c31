/* SPDX-License-Identifier: MIT */
/* Meshes and sphere sets of the scene under construction, with the server's checks. */
#include "closed.h"
#include "edits.h"
#include "ranges.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

void import_mesh_finish(struct import_mesh *mesh)
{
    free(mesh->positions);
    free(mesh->indices);
    free(mesh->normals);
    free(mesh->tangents);
    free(mesh->texcoords[0]);
    free(mesh->texcoords[1]);
    free(mesh->colours);
    free(mesh->joints);
    free(mesh->joint_weights);
    for (int i = 0; i < 3; i++)
        free(mesh->target_offsets[i]);
    free(mesh->ranges);
    memset(mesh, 0, sizeof(*mesh));
}

#define SIDE_BY_SIDE 8u /* additions that the processor may run in parallel */

static bool all_finite(const float *values, size_t count)
{
    /* x * 0 is 0 for finite x and NaN for others; a sum of zeros stays 0. */
    float sums[SIDE_BY_SIDE] = {0}, sum = 0;
    size_t i = 0;

    for (; count - i >= SIDE_BY_SIDE; i += SIDE_BY_SIDE)
        for (size_t k = 0; k < SIDE_BY_SIDE; k++)
            sums[k] += values[i + k] * 0.0f;
    for (; i < count; i++)
        sum += values[i] * 0.0f;
    for (size_t k = 0; k < SIDE_BY_SIDE; k++)
        sum += sums[k];
    return sum == 0;
}

static uint32_t greatest(const uint32_t *values, size_t count)
{
    uint32_t greatest_of[SIDE_BY_SIDE] = {0}, greatest = 0;
    size_t i = 0;

    for (; count - i >= SIDE_BY_SIDE; i += SIDE_BY_SIDE)
        for (size_t k = 0; k < SIDE_BY_SIDE; k++)
            greatest_of[k] = values[i + k] > greatest_of[k] ? values[i + k] : greatest_of[k];
    for (; i < count; i++)
        greatest = values[i] > greatest ? values[i] : greatest;
    for (size_t k = 0; k < SIDE_BY_SIDE; k++)
        greatest = greatest_of[k] > greatest ? greatest_of[k] : greatest;
    return greatest;
}

/* Shading data that is not finite becomes 0. */
static void mend(struct import_scene *scene, const char *where, float *values, size_t count, const char *what)
{
    if (!values || all_finite(values, count))
        return;
    for (size_t i = 0; i < count; i++)
        if (!isfinite(values[i]))
            values[i] = 0;
    import_note(scene, PROTOCOL_SEVERITY_WARNING, where, "%s that are NaN or infinite were set to 0", what);
}

static bool triangle_whole(const struct import_mesh *mesh, uint32_t triangle)
{
    const uint32_t *corners = mesh->indices + (size_t)triangle * 3;
    bool whole = true;

    for (int c = 0; c < 3; c++)
        whole = whole && all_finite(mesh->positions + (size_t)corners[c] * 3, 3);
    return whole;
}

/* Moves the whole triangles of from .. to - 1 forwards, to number `kept` and on; returns the number after them. */
static uint32_t keep_whole(struct import_mesh *mesh, uint32_t from, uint32_t to, uint32_t kept)
{
    for (uint32_t t = from; t < to; t++)
        if (triangle_whole(mesh, t))
            memmove(mesh->indices + (size_t)kept++ * 3, mesh->indices + (size_t)t * 3, 12);
    return kept;
}

/* Removes triangles with a corner that is NaN or infinite; such corners become 0, so that later code can rely
 * on finite ones. */
static void drop_broken(struct import_scene *scene, const char *where, struct import_mesh *mesh)
{
    uint32_t at = 0, kept = 0;

    for (uint32_t i = 0; i < mesh->range_count; i++) {
        struct record_material_range *range = &mesh->ranges[i];
        uint32_t first = keep_whole(mesh, at, range->first, kept);

        at = range->first + range->count;
        kept = keep_whole(mesh, range->first, at, first);
        range->first = first;
        range->count = kept - first;
    }
    kept = keep_whole(mesh, at, mesh->triangle_count, kept);
    import_note(scene, PROTOCOL_SEVERITY_WARNING, where,
                "%u of %u triangles have corners that are NaN or infinite and were left out",
                mesh->triangle_count - kept, mesh->triangle_count);
    mesh->triangle_count = kept;
    for (size_t i = 0; i < (size_t)mesh->vertex_count * 3; i++)
        if (!isfinite(mesh->positions[i]))
            mesh->positions[i] = 0;
}

static void add_face_normals(const struct import_mesh *mesh, const unsigned char *bad, double *sums)
{
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        const uint32_t *corners = mesh->indices + (size_t)t * 3;
        double edges[2][3], normal[3];

        if (!bad[corners[0]] && !bad[corners[1]] && !bad[corners[2]])
            continue;
        for (int e = 0; e < 2; e++)
            for (int c = 0; c < 3; c++)
                edges[e][c] = (double)mesh->positions[(size_t)corners[e + 1] * 3 + (size_t)c] -
                              (double)mesh->positions[(size_t)corners[0] * 3 + (size_t)c];
        for (int c = 0; c < 3; c++)
            normal[c] =
                edges[0][(c + 1) % 3] * edges[1][(c + 2) % 3] - edges[0][(c + 2) % 3] * edges[1][(c + 1) % 3];
        for (int k = 0; k < 3; k++)
            for (int c = 0; bad[corners[k]] && c < 3; c++)
                sums[(size_t)corners[k] * 3 + (size_t)c] += normal[c];
    }
}

static bool normal_usable(const float *normal)
{
    return all_finite(normal, 3) && normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2] > 1e-12f;
}

/* Replaces normals that are missing, zero or not finite by ones from the triangles around the vertex. */
static bool mend_normals(struct import_scene *scene, const char *where, struct import_mesh *mesh)
{
    size_t count = mesh->vertex_count, broken = 0;
    unsigned char *bad;
    double *sums;

    for (size_t v = 0; v < count; v++)
        broken += !normal_usable(mesh->normals + v * 3);
    if (broken == 0)
        return true;
    bad = calloc(count, 1);
    sums = calloc(count * 3, sizeof(*sums));
    if (!bad || !sums) {
        free(bad);
        free(sums);
        return import_fail(scene, NULL, "out of memory");
    }
    for (size_t v = 0; v < count; v++)
        bad[v] = !normal_usable(mesh->normals + v * 3);
    add_face_normals(mesh, bad, sums);
    for (size_t v = 0; v < count; v++) {
        const double *sum = sums + v * 3;
        double length = sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]);

        for (size_t c = 0; bad[v] && c < 3; c++)
            mesh->normals[v * 3 + c] = length > 0 ? (float)(sum[c] / length) : c == 2 ? 1.0f : 0.0f;
    }
    free(bad);
    free(sums);
    import_note(scene, PROTOCOL_SEVERITY_INFO, where,
                "%zu normals are missing or unusable and were made from the faces", broken);
    return true;
}

static bool mesh_valid(struct import_scene *scene, struct import_mesh *mesh)
{
    const char *where = mesh->where ? mesh->where : mesh->name;
    size_t index_count = (size_t)mesh->triangle_count * 3;
    uint32_t maximum;

    if (scene->failed)
        return false;
    if (!mesh->positions || !mesh->indices || mesh->vertex_count == 0 || mesh->triangle_count == 0)
        return import_fail(scene, where, "a mesh without vertices or triangles");
    maximum = greatest(mesh->indices, index_count);
    if (maximum >= mesh->vertex_count)
        return import_fail(scene, where, "index %u is beyond the %u vertices", maximum, mesh->vertex_count);
    mesh->range_count = import_ranges_merge(mesh->ranges, mesh->range_count);
    if (mesh->range_count > IMPORT_RANGES_MAX)
        return import_fail(scene, where, "more than %d changes of material in one mesh", IMPORT_RANGES_MAX);
    if (!import_ranges_valid(mesh->ranges, mesh->range_count, mesh->triangle_count))
        return import_fail(scene, where, "material ranges overlap or exceed the triangles");
    if (!all_finite(mesh->positions, (size_t)mesh->vertex_count * 3)) {
        drop_broken(scene, where, mesh);
        mesh->range_count = import_ranges_merge(mesh->ranges, mesh->range_count);
        if (mesh->triangle_count == 0)
            return import_fail(scene, where, "every triangle has corners that are NaN or infinite");
    }
    if (mesh->influence_count > IMPORT_INFLUENCES_MAX || mesh->target_count > IMPORT_TARGETS_MAX ||
        (mesh->influence_count > 0) != (mesh->joints && mesh->joint_weights) ||
        (mesh->target_count > 0) != (mesh->target_offsets[0] != NULL))
        return import_fail(scene, where, "joints or morph targets do not fit their number");
    return !mesh->normals || mend_normals(scene, where, mesh);
}

static uint32_t add_array(struct import_scene *scene, void *bytes, uint64_t count, size_t element_bytes)
{
    return import_add_blob(scene, bytes, count * element_bytes);
}

/* Records the bounds of points with `stride` floats each; a fourth float is a radius. */
static void add_bounds(struct import_scene *scene, const struct import_bounds *object, const float *points,
                       size_t count, size_t stride)
{
    struct import_bounds *grown =
        import_grow(scene, scene->bounds, scene->bounds_count, &scene->bounds_capacity, sizeof(*grown));
    if (!grown)
        return;
    struct import_bounds box = {.kind = object->kind,
                                .object = object->object,
                                .lower = {FLT_MAX, FLT_MAX, FLT_MAX},
                                .upper = {-FLT_MAX, -FLT_MAX, -FLT_MAX}};
    for (size_t i = 0; i < count; i++) {
        const float *point = points + i * stride, radius = stride > 3 ? point[3] : 0;
        for (unsigned axis = 0; axis < 3; axis++) {
            const float lower = point[axis] - radius, upper = point[axis] + radius;
            /* The values are finite, and fminf() and fmaxf() would be calls. */
            box.lower[axis] = lower < box.lower[axis] ? lower : box.lower[axis];
            box.upper[axis] = upper > box.upper[axis] ? upper : box.upper[axis];
        }
    }
    for (unsigned axis = 0; axis < 3; axis++) { /* clamped to the message's range */
        box.lower[axis] = fmaxf(box.lower[axis], -3e38f);
        box.upper[axis] = fminf(box.upper[axis], 3e38f);
    }
    scene->bounds = grown;
    scene->bounds[scene->bounds_count++] = box;
}

/* Converts colours to bytes if that loses nothing, as with most colours of glTF and constant ones. Returns the
 * bytes of a colour. */
static uint64_t narrow_colours(uint16_t *colours, uint64_t vertices)
{
    uint8_t *bytes = (uint8_t *)(void *)colours;
    if (!colours)
        return 4;
    for (uint64_t i = 0; i < vertices * 4; i++)
        if (colours[i] % 257 != 0)
            return 4 * sizeof(*colours);
    for (uint64_t i = 0; i < vertices * 4; i++)
        bytes[i] = (uint8_t)(colours[i] / 257);
    return 4;
}

uint32_t import_add_mesh(struct import_scene *scene, struct import_mesh *mesh)
{
    const char *where = mesh->where ? mesh->where : mesh->name;
    uint64_t vertices = mesh->vertex_count;
    struct import_edit *edit = NULL;
    uint32_t count = 0;

    if (!mesh_valid(scene, mesh)) {
        import_mesh_finish(mesh);
        return 0;
    }
    mend(scene, where, mesh->tangents, (size_t)vertices * 4, "tangents");
    mend(scene, where, mesh->texcoords[0], (size_t)vertices * 2, "texture coordinates");
    mend(scene, where, mesh->texcoords[1], (size_t)vertices * 2, "texture coordinates");
    for (int i = 0; i < 3; i++)
        mend(scene, where, mesh->target_offsets[i], (size_t)(vertices * mesh->target_count) * 3, "morph targets");
    /* Colours of vertices multiply the material's, so a mesh with colours keeps the protocol's white default. */
    if (mesh->colours || import_ranges_fill(scene, &mesh->ranges, &mesh->range_count, mesh->triangle_count))
        edit = import_append(scene, MESSAGE_SET_MESH);
    if (!edit) {
        import_mesh_finish(mesh);
        return 0;
    }
    edit->message.set_mesh.value.vertex_count = mesh->vertex_count;
    edit->message.set_mesh.value.triangle_count = mesh->triangle_count;
    edit->message.set_mesh.name = import_copy_name(scene, mesh->name);
    edit->message.set_mesh.ranges = mesh->ranges;
    edit->message.set_mesh.ranges_count = mesh->range_count;
    edit->message.set_mesh.value.influence_count = mesh->influence_count;
    edit->message.set_mesh.value.target_count = mesh->target_count;
    edit->message.set_mesh.weights = import_copy_weights(scene, mesh->weights, mesh->weight_count);
    edit->message.set_mesh.weights_count = mesh->weight_count;
    edit->message.set_mesh.mesh = import_next_id(scene, PROTOCOL_OBJECT_MESH);
    add_bounds(scene, &(struct import_bounds){PROTOCOL_NODE_MESH, edit->message.set_mesh.mesh, {0}, {0}},
               mesh->positions, mesh->vertex_count, 3);
    edit->blobs[0] = add_array(scene, mesh->positions, vertices, 12);
    edit->blobs[1] = add_array(scene, mesh->indices, mesh->triangle_count, 12);
    edit->blobs[2] = add_array(scene, mesh->normals, vertices, 12);
    edit->blobs[3] = add_array(scene, mesh->tangents, vertices, 16);
    edit->blobs[4] = add_array(scene, mesh->texcoords[0], vertices, 8);
    edit->blobs[5] = add_array(scene, mesh->texcoords[1], vertices, 8);
    edit->blobs[6] = add_array(scene, mesh->colours, vertices, narrow_colours(mesh->colours, vertices));
    edit->blobs[7] = add_array(scene, mesh->joints, vertices * mesh->influence_count, 2);
    edit->blobs[8] = add_array(scene, mesh->joint_weights, vertices * mesh->influence_count, 4);
    for (uint32_t i = 0; i < 3; i++)
        edit->blobs[9 + i] = add_array(scene, mesh->target_offsets[i], vertices * mesh->target_count, 12);
    for (uint32_t i = 0; i < IMPORT_ARRAYS_MAX; i++)
        if (edit->blobs[i] != 0)
            count = i + 1;
    edit->message.set_mesh.arrays_count = count;
    memset(mesh, 0, sizeof(*mesh));
    return edit->message.set_mesh.mesh;
}

void import_mark_closed(struct import_scene *scene)
{
    for (size_t i = 0; i < scene->edit_count; i++) {
        const struct import_edit *edit = &scene->edits[i];
        struct message_set_mesh *mesh = &scene->edits[i].message.set_mesh;

        if (edit->message.type == MESSAGE_SET_MESH && edit->blobs[0] != 0 && edit->blobs[1] != 0)
            mesh->value.closed = import_triangles_closed(
                (const float *)(const void *)scene->blobs[edit->blobs[0] - 1].bytes, mesh->value.vertex_count,
                (const uint32_t *)(const void *)scene->blobs[edit->blobs[1] - 1].bytes,
                mesh->value.triangle_count);
    }
}

/* ---- bodies of glass ---- */

struct body {
    double volume, area;
};

static void add_tetrahedra(struct body *body, const float *positions, const uint32_t *indices, uint32_t count)
{
    for (uint32_t t = 0; t < count; t++) {
        const float *a = positions + (size_t)indices[t * 3] * 3, *b = positions + (size_t)indices[t * 3 + 1] * 3,
                    *c = positions + (size_t)indices[t * 3 + 2] * 3;
        double across[3], squared = 0;

        for (int i = 0; i < 3; i++) {
            const int j = (i + 1) % 3, k = (i + 2) % 3;

            across[i] = ((double)b[j] - (double)a[j]) * ((double)c[k] - (double)a[k]) -
                        ((double)b[k] - (double)a[k]) * ((double)c[j] - (double)a[j]);
            squared += across[i] * across[i];
            body->volume += across[i] * (double)a[i] / 6;
        }
        body->area += sqrt(squared) / 2;
    }
}

/* Sets the thickness of bodies, by which shadow rays are tinted. Files have it for programs that trace no rays,
 * often as the maximum of an image. A closed mesh has a thickness of its own: the mean length of lines through
 * it, four times its volume over its area (Cauchy). */
void import_measure_bodies(struct import_scene *scene)
{
    struct body *bodies = calloc((size_t)scene->last_id[PROTOCOL_OBJECT_MATERIAL] + 1, sizeof(*bodies));

    if (!bodies)
        return; /* the files' values stay */
    for (size_t i = 0; i < scene->edit_count; i++) {
        const struct import_edit *edit = &scene->edits[i];
        const struct message_set_mesh *mesh = &scene->edits[i].message.set_mesh;

        if (edit->message.type == MESSAGE_SET_MESH && mesh->value.closed && mesh->ranges_count == 1)
            add_tetrahedra(&bodies[mesh->ranges[0].material],
                           (const float *)(const void *)scene->blobs[edit->blobs[0] - 1].bytes,
                           (const uint32_t *)(const void *)scene->blobs[edit->blobs[1] - 1].bytes,
                           mesh->value.triangle_count);
    }
    for (size_t i = 0; i < scene->edit_count; i++) {
        struct message_set_material *material = &scene->edits[i].message.set_material;

        if (scene->edits[i].message.type != MESSAGE_SET_MATERIAL || !(material->value.attenuation_distance > 0) ||
            !(material->value.thickness > 0))
            continue;
        const struct body *body = &bodies[material->material];
        const double thickness = body->area > 0 ? 4 * fabs(body->volume) / body->area : 0;

        if (thickness > 0 && thickness <= 1e12)
            material->value.thickness = (float)thickness;
    }
    free(bodies);
}

static bool spheres_valid(struct import_scene *scene, const char *name, const float *spheres, uint32_t count,
                          const struct record_material_range *ranges, uint32_t range_count)
{
    if (scene->failed)
        return false;
    if (!spheres || count == 0)
        return import_fail(scene, name, "a sphere set without spheres");
    for (size_t i = 0; i < count; i++)
        if (!all_finite(spheres + i * 4, 4) || !(spheres[i * 4 + 3] > 0))
            return import_fail(scene, name, "sphere %zu is not finite or has no radius", i);
    if (!import_ranges_valid(ranges, range_count, count))
        return import_fail(scene, name, "material ranges overlap, exceed the spheres or are more than %d",
                           IMPORT_RANGES_MAX);
    return true;
}

uint32_t import_add_spheres(struct import_scene *scene, const char *name, float *spheres, uint32_t count,
                            struct record_material_range *ranges, uint32_t range_count)
{
    struct import_edit *edit = NULL;

    range_count = import_ranges_merge(ranges, range_count);
    if (spheres_valid(scene, name, spheres, count, ranges, range_count) &&
        import_ranges_fill(scene, &ranges, &range_count, count))
        edit = import_append(scene, MESSAGE_SET_SPHERES);
    if (!edit) {
        free(spheres);
        free(ranges);
        return 0;
    }
    edit->message.set_spheres.value.sphere_count = count;
    edit->message.set_spheres.name = import_copy_name(scene, name);
    edit->message.set_spheres.ranges = ranges;
    edit->message.set_spheres.ranges_count = range_count;
    edit->message.set_spheres.arrays_count = 1;
    edit->message.set_spheres.spheres = import_next_id(scene, PROTOCOL_OBJECT_SPHERES);
    add_bounds(scene, &(struct import_bounds){PROTOCOL_NODE_SPHERES, edit->message.set_spheres.spheres, {0}, {0}},
               spheres, count, 4);
    edit->blobs[0] = add_array(scene, spheres, count, 16);
    return edit->message.set_spheres.spheres;
}
