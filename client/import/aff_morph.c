/* SPDX-License-Identifier: MIT */
/* Triangles whose vertices move (`tpa`) as morph targets: the first time is the mesh at rest, each later one a
 * target. Weights that go linearly from one target to the next move vertices and normals linearly, as AFF wants.
 */
#include "aff.h"

#include "model.h"

#include <stdlib.h>
#include <string.h>

#define CORNER_FLOATS 6 /* position, normal */
#define TIME_FLOATS (3 * CORNER_FLOATS)
#define TIMES_MAX (IMPORT_TARGETS_MAX + 1)

void aff_morph_finish(struct aff_morph *morph)
{
    free(morph->times);
    free(morph->floats);
}

/* One triangle's times, and its floats. False: the scene has failed. */
static bool read_times(struct aff *aff, float *times, float *floats, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) {
        if (!word_reader_numbers(&aff->nff.reader, &times[i], 1, "tpa") ||
            !word_reader_numbers(&aff->nff.reader, floats + (size_t)i * TIME_FLOATS, TIME_FLOATS, "tpa"))
            return false;
        if (i > 0 && times[i] <= times[i - 1])
            return import_fail(aff->nff.scene, word_reader_where(&aff->nff.reader),
                               "time %g of 'tpa' follows %g; times must ascend", (double)times[i],
                               (double)times[i - 1]);
    }
    return true;
}

static void place(const struct shapes *shapes, float *floats, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++, floats += TIME_FLOATS) {
        float swapped[CORNER_FLOATS];

        for (int k = 0; k < 3; k++) {
            float *corner = floats + k * CORNER_FLOATS, in[CORNER_FLOATS];

            memcpy(in, corner, sizeof(in));
            placement_point(&shapes->to_shapes, in, corner);
            placement_normal(&shapes->to_shapes, in + 3, corner + 3);
        }
        if (shapes->mirrors) {
            memcpy(swapped, floats + CORNER_FLOATS, sizeof(swapped));
            memcpy(floats + CORNER_FLOATS, floats + 2 * CORNER_FLOATS, sizeof(swapped));
            memcpy(floats + 2 * CORNER_FLOATS, swapped, sizeof(swapped));
        }
    }
}

/* Those of the same times and material; NULL: the scene has failed. Takes `times` if it is a new one. */
static struct aff_morph *find_morph(struct aff *aff, struct aff_group *group, float **times, uint32_t count)
{
    struct aff_morph *grown, *found;

    for (size_t i = group->morph_count; i-- > 0;) {
        found = &group->morphs[i];
        if (found->time_count == count && found->material == group->shapes.material &&
            memcmp(found->times, *times, count * sizeof(**times)) == 0)
            return found;
    }
    if (aff->morph_count == AFF_MORPHS_MAX) {
        import_fail(aff->nff.scene, word_reader_where(&aff->nff.reader),
                    "'tpa' with more than %u different lists of times or materials", AFF_MORPHS_MAX);
        return NULL;
    }
    grown = import_grow(aff->nff.scene, group->morphs, group->morph_count, &group->morph_capacity, sizeof(*grown));
    if (!grown)
        return NULL;
    group->morphs = grown;
    aff->morph_count++;
    found = &grown[group->morph_count++];
    *found = (struct aff_morph){.times = *times, .time_count = count, .material = group->shapes.material};
    *times = NULL;
    return found;
}

/* Takes `times` if need be. */
static bool keep(struct aff *aff, float **times, const float *floats, uint32_t count)
{
    struct aff_group *group = aff->groups[aff->blocks[aff->block].group];
    struct aff_morph *morph = find_morph(aff, group, times, count);
    size_t triangle_floats = (size_t)count * TIME_FLOATS;
    float *grown;

    if (!morph)
        return false;
    grown = import_grow(aff->nff.scene, morph->floats, morph->triangle_count, &morph->triangle_capacity,
                        triangle_floats * sizeof(*grown));
    if (!grown)
        return false;
    morph->floats = grown;
    memcpy(grown + morph->triangle_count++ * triangle_floats, floats, triangle_floats * sizeof(*grown));
    return true;
}

bool aff_read_moving_triangle(struct aff *aff)
{
    uint32_t count;
    float *times, *floats;
    bool read;

    if (!word_reader_count(&aff->nff.reader, &count, 1, TIMES_MAX, "tpa") ||
        !word_reader_can_hold(&aff->nff.reader, (uint64_t)count * (TIME_FLOATS + 1), "'tpa'"))
        return false;
    times = malloc(count * sizeof(*times));
    floats = malloc((size_t)count * TIME_FLOATS * sizeof(*floats));
    read = (times && floats) || import_fail(aff->nff.scene, NULL, "out of memory");
    read = read && read_times(aff, times, floats, count);
    if (read) {
        place(aff->nff.shapes, floats, count);
        read = keep(aff, &times, floats, count);
    }
    free(times);
    free(floats);
    return read;
}

/* ---- the mesh ---- */

void aff_morph_weights(const struct aff_morph *morph, double time_s, float *weights)
{
    uint32_t i = 0;
    float part;

    memset(weights, 0, (morph->time_count - 1) * sizeof(*weights));
    while (i + 1 < morph->time_count && (double)morph->times[i + 1] <= time_s)
        i++;
    part =
        i + 1 < morph->time_count && time_s > (double)morph->times[i]
            ? (float)((time_s - (double)morph->times[i]) / ((double)morph->times[i + 1] - (double)morph->times[i]))
            : 0;
    if (i > 0)
        weights[i - 1] = 1 - part;
    if (part > 0)
        weights[i] = part;
}

static bool fill_mesh(struct aff *aff, const struct aff_morph *morph, struct import_mesh *mesh)
{
    size_t vertices = morph->triangle_count * 3, targets = morph->time_count - 1;

    if (vertices > SHAPES_TRIANGLES_MAX)
        return import_fail(aff->nff.scene, NULL, "more than %u moving triangles", SHAPES_TRIANGLES_MAX / 3);
    mesh->vertex_count = (uint32_t)vertices;
    mesh->triangle_count = (uint32_t)morph->triangle_count;
    mesh->target_count = (uint32_t)targets;
    mesh->range_count = 1;
    mesh->positions = malloc(vertices * 12);
    mesh->normals = malloc(vertices * 12);
    mesh->indices = malloc(vertices * 4);
    mesh->ranges = malloc(sizeof(*mesh->ranges));
    for (int i = 0; i < 2 && targets > 0; i++)
        mesh->target_offsets[i] = malloc(vertices * targets * 12);
    if (!mesh->positions || !mesh->normals || !mesh->indices || !mesh->ranges ||
        (targets > 0 && (!mesh->target_offsets[0] || !mesh->target_offsets[1])))
        return import_fail(aff->nff.scene, NULL, "out of memory");
    mesh->ranges[0] =
        (struct record_material_range){0, mesh->triangle_count, aff->nff.material_ids[morph->material]};
    for (size_t v = 0; v < vertices; v++) {
        const float *at_rest = morph->floats + v / 3 * morph->time_count * TIME_FLOATS + v % 3 * CORNER_FLOATS;

        mesh->indices[v] = (uint32_t)v;
        memcpy(mesh->positions + v * 3, at_rest, 12);
        memcpy(mesh->normals + v * 3, at_rest + 3, 12);
        for (size_t t = 0; t < targets; t++)
            for (size_t c = 0; c < 3; c++) {
                const float *moved = at_rest + (t + 1) * TIME_FLOATS;

                mesh->target_offsets[0][(t * vertices + v) * 3 + c] = moved[c] - at_rest[c];
                mesh->target_offsets[1][(t * vertices + v) * 3 + c] = moved[3 + c] - at_rest[3 + c];
            }
    }
    return true;
}

bool aff_add_morph(struct aff *aff, struct aff_group *group, struct aff_morph *morph)
{
    struct message_set_node node = {.parent = group->node, .kind = PROTOCOL_NODE_MESH, .name = "moving triangles"};
    struct import_mesh mesh = {.name = "moving triangles"};
    struct record_morph_weight records[IMPORT_TARGETS_MAX];
    float weights[IMPORT_TARGETS_MAX];

    if (!fill_mesh(aff, morph, &mesh)) {
        import_mesh_finish(&mesh);
        return false;
    }
    node.object = import_add_mesh(aff->nff.scene, &mesh);
    aff_morph_weights(morph, (double)aff->start_s, weights);
    for (uint32_t i = 0; i + 1 < morph->time_count; i++)
        records[i] = (struct record_morph_weight){.weight = weights[i]};
    node.weights = records;
    node.weights_count = morph->time_count - 1;
    import_identity(node.parent_from_node);
    morph->node = node.object != 0 ? import_add_node(aff->nff.scene, &node) : 0;
    return morph->node != 0;
}
