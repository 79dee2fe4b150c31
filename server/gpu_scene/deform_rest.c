/* SPDX-License-Identifier: MIT */
/* Lists the nodes that deform meshes, and stores those meshes at rest: in the buffers of
 * shaders/gpu_scene/deform.comp, and as boxes that bound any pose without its vertices. */
#include "gpu_scene/state.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static void drop_meshes(struct gpu_scene_deform *deform)
{
    for (uint32_t i = 0; i < deform->mesh_count; i++) {
        free(deform->meshes[i].joints);
        free(deform->meshes[i].targets);
    }
    free(deform->meshes);
    deform->meshes = NULL;
    deform->mesh_count = 0;
}

static void drop_uses(struct deform_use *uses, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) {
        free(uses[i].open);
        free(uses[i].close);
    }
    free(uses);
}

size_t gpu_scene_deform_buffers(struct gpu_scene_deform *deform, struct gpu_buffer *buffers[DEFORM_BUFFERS_MAX])
{
    struct gpu_buffer *all[DEFORM_BUFFERS_MAX] = {
        &deform->positions,      &deform->normals,         &deform->tangents,
        &deform->joints,         &deform->joint_weights,   &deform->target_positions,
        &deform->target_normals, &deform->target_tangents, &deform->parameters,
    };
    memcpy(buffers, all, sizeof(all));
    return DEFORM_BUFFERS_MAX;
}

void gpu_scene_deform_finish(struct gpu_scene_deform *deform, struct gpu_device *device)
{
    struct gpu_buffer *buffers[DEFORM_BUFFERS_MAX];
    size_t count = gpu_scene_deform_buffers(deform, buffers);
    for (size_t i = 0; i < count; i++)
        gpu_buffer_finish(device, buffers[i]);
    drop_meshes(deform);
    drop_uses(deform->uses, deform->use_count);
    *deform = (struct gpu_scene_deform){0};
}

/* ---- nodes ---- */

static bool can_deform(const struct scene *scene)
{
    size_t cursor = 0;
    uint64_t id;
    void *value;
    while (hashmap_next(&scene->objects[OBJECT_MESH], &cursor, &id, &value)) {
        const struct scene_mesh *mesh = value;
        if (mesh->value.influence_count || mesh->value.target_count)
            return true;
    }
    return false;
}

static const struct scene_mesh *deformed_mesh(const struct scene *scene, const struct scene_node *node)
{
    const struct scene_mesh *mesh = node->value.kind == NODE_MESH ? scene_mesh(scene, node->value.object) : NULL;
    return mesh && scene_node_deforms(node, mesh) ? mesh : NULL;
}

uint64_t gpu_scene_deform_signature(const struct scene *scene)
{
    uint64_t signature = 0, id;
    size_t cursor = 0;
    void *value;
    if (!can_deform(scene))
        return 0;
    while (hashmap_next(&scene->objects[OBJECT_NODE], &cursor, &id, &value)) {
        const struct scene_node *node = value;
        if (deformed_mesh(scene, node))
            signature +=
                gpu_scene_mix(gpu_scene_mix(id + 1) + ((uint64_t)node->value.object << 32 | node->value.skin));
    }
    return signature;
}

static int by_node(const void *a, const void *b)
{
    uint32_t node_a = ((const struct deform_use *)a)->node, node_b = ((const struct deform_use *)b)->node;
    return node_a < node_b ? -1 : node_a > node_b;
}

/* An unchanged use keeps its state, except that its vertices are no longer in place. */
static void inherit(struct deform_use *use, struct gpu_scene_deform *old)
{
    struct deform_use *before = NULL;
    if (old->use_count)
        before = bsearch(use, old->uses, old->use_count, sizeof(*use), by_node);
    if (!before || before->mesh_id != use->mesh_id || before->mesh_revision != use->mesh_revision ||
        before->skin != use->skin)
        return;
    use->open = before->open;
    use->close = before->close;
    use->value_count = before->value_count;
    use->revision = before->revision;
    use->box = before->box;
    before->open = before->close = NULL;
}

bool gpu_scene_deform_list(struct gpu_scene_deform *deform, const struct scene *scene, struct error *error)
{
    const struct hashmap *nodes = &scene->objects[OBJECT_NODE];
    struct deform_use *uses = NULL;
    uint32_t count = 0;
    if (can_deform(scene)) {
        size_t cursor = 0;
        uint64_t id;
        void *value;
        uses = calloc(nodes->count + 1, sizeof(*uses));
        if (!uses)
            return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for %zu nodes", nodes->count);
        while (hashmap_next(nodes, &cursor, &id, &value)) {
            const struct scene_node *node = value;
            const struct scene_mesh *mesh = deformed_mesh(scene, node);
            if (mesh)
                uses[count++] = (struct deform_use){.node = (uint32_t)id,
                                                    .mesh_id = node->value.object,
                                                    .mesh_revision = mesh->base.revision,
                                                    .skin = mesh->value.influence_count ? node->value.skin : 0};
        }
        qsort(uses, count, sizeof(*uses), by_node);
    }
    for (uint32_t i = 0; i < count; i++)
        inherit(&uses[i], deform);
    drop_uses(deform->uses, deform->use_count);
    deform->uses = uses;
    deform->use_count = count;
    return true;
}

/* ---- boxes ---- */

static const struct deform_box empty_box = {{FLT_MAX, FLT_MAX, FLT_MAX}, {-FLT_MAX, -FLT_MAX, -FLT_MAX}};

static void grow(struct deform_box *box, const float point[3])
{
    for (int k = 0; k < 3; k++) {
        box->lower[k] = fminf(box->lower[k], point[k]);
        box->upper[k] = fmaxf(box->upper[k], point[k]);
    }
}

static const float *floats_of(const struct scene_mesh *mesh, enum mesh_array array)
{
    return mesh->arrays[array] ? (const float *)(const void *)mesh->arrays[array]->data : NULL;
}

static const uint16_t *joints_of(const struct scene_mesh *mesh)
{
    return mesh->value.influence_count ? (const uint16_t *)(const void *)mesh->arrays[MESH_JOINTS]->data : NULL;
}

static bool reserve_boxes(struct deform_mesh *rest, const struct scene_mesh *mesh)
{
    const uint16_t *joints = joints_of(mesh);
    uint32_t joint_count = 0; /* a single variable lets the compiler vectorise the loop */
    for (size_t i = 0; i < (size_t)mesh->value.vertex_count * mesh->value.influence_count; i++)
        joint_count = joints[i] >= joint_count ? joints[i] + 1u : joint_count;
    rest->joint_count = joint_count;
    rest->joints = malloc(((size_t)joint_count + 1) * sizeof(*rest->joints));
    rest->targets = calloc((size_t)mesh->value.target_count + 1, sizeof(*rest->targets));
    return rest->joints && rest->targets;
}

static void find_joint_boxes(struct deform_mesh *rest, const struct scene_mesh *mesh)
{
    const float *positions = floats_of(mesh, MESH_POSITIONS), *weights = floats_of(mesh, MESH_WEIGHTS);
    const uint16_t *joints = joints_of(mesh);
    size_t per_vertex = mesh->value.influence_count;
    for (uint32_t joint = 0; joint < rest->joint_count; joint++)
        rest->joints[joint] = empty_box;
    rest->unmoved = empty_box;
    for (size_t vertex = 0; vertex < mesh->value.vertex_count; vertex++) {
        float sum = 0.0f;
        for (size_t k = vertex * per_vertex; k < (vertex + 1) * per_vertex; k++) {
            if (weights[k] > 0.0f)
                grow(&rest->joints[joints[k]], &positions[3 * vertex]);
            sum += weights[k];
        }
        if (!(sum > 0.0f))
            grow(&rest->unmoved, &positions[3 * vertex]);
    }
}

static void find_target_boxes(struct deform_mesh *rest, const struct scene_mesh *mesh)
{
    const float *added = floats_of(mesh, MESH_TARGET_POSITIONS);
    for (uint32_t target = 0; added && target < mesh->value.target_count; target++)
        for (size_t vertex = 0; vertex < mesh->value.vertex_count; vertex++, added += 3)
            grow(&rest->targets[target], added);
}

/* ---- the buffers ---- */

struct rest_totals {
    uint64_t vertices, influences, target_vertices;
    uint32_t arrays; /* bit by mesh_array: arrays that some mesh has */
};

static bool add_mesh(struct gpu_scene_deform *deform, const struct scene_mesh *mesh, struct rest_totals *totals)
{
    struct deform_mesh *rest = &deform->meshes[deform->mesh_count++];
    *rest = (struct deform_mesh){
        .id = mesh->base.id,
        .first_vertex = (uint32_t)totals->vertices,
        .first_influence = (uint32_t)totals->influences,
        .first_target_vertex = (uint32_t)totals->target_vertices,
    };
    totals->vertices += mesh->value.vertex_count;
    totals->influences += (uint64_t)mesh->value.vertex_count * mesh->value.influence_count;
    totals->target_vertices += (uint64_t)mesh->value.vertex_count * mesh->value.target_count;
    for (int array = 0; array < MESH_ARRAY_COUNT; array++)
        totals->arrays |= mesh->arrays[array] ? 1u << array : 0;
    return reserve_boxes(rest, mesh);
}

static bool list_meshes(struct gpu_scene *gpu, const struct scene *scene, struct rest_totals *totals)
{
    struct gpu_scene_deform *deform = &gpu->state->deform;
    struct hashmap place_by_id = {0}; /* place plus 1 */
    drop_meshes(deform);
    deform->meshes = calloc((size_t)deform->use_count + 1, sizeof(*deform->meshes));
    bool ok = deform->meshes != NULL;
    for (uint32_t i = 0; ok && i < deform->use_count; i++) {
        struct deform_use *use = &deform->uses[i];
        uintptr_t place = (uintptr_t)hashmap_get(&place_by_id, use->mesh_id);
        use->is_placed = false;
        if (!place) {
            place = (uintptr_t)deform->mesh_count + 1;
            ok = add_mesh(deform, scene_mesh(scene, use->mesh_id), totals) &&
                 hashmap_put(&place_by_id, use->mesh_id, (void *)place);
        }
        use->mesh = (uint32_t)(place - 1);
    }
    hashmap_finish(&place_by_id);
    return ok;
}

static bool check_totals(const struct gpu_scene *gpu, const struct rest_totals *totals, struct error *error)
{
    return gpu_scene_check_texels(gpu, totals->vertices, "vertices that deform", error) &&
           gpu_scene_check_texels(gpu, totals->influences, "weights of joints", error) &&
           gpu_scene_check_texels(gpu, totals->target_vertices, "vertices of morph targets", error);
}

/* Parts of a buffer that meshes have, by the unit of their items. */
enum rest_place { REST_VERTEX, REST_INFLUENCE, REST_TARGET };

static size_t place_of(const struct deform_mesh *rest, enum rest_place place)
{
    return place == REST_VERTEX      ? rest->first_vertex
           : place == REST_INFLUENCE ? rest->first_influence
                                     : rest->first_target_vertex;
}

static size_t count_of(const struct scene_mesh *mesh, enum rest_place place)
{
    size_t vertices = mesh->value.vertex_count;
    return place == REST_VERTEX
               ? vertices
               : vertices * (place == REST_INFLUENCE ? mesh->value.influence_count : mesh->value.target_count);
}

/* Bytes of an item; joints are 16 bits. */
static size_t item_bytes(enum mesh_array array)
{
    return array == MESH_JOINTS     ? sizeof(uint16_t)
           : array == MESH_WEIGHTS  ? sizeof(float)
           : array == MESH_TANGENTS ? 4 * sizeof(float)
                                    : 3 * sizeof(float);
}

/* Bytes of an item on the device. Three components are padded to four: a texel of three has no image format,
 * and no driver stores it so. */
static size_t packed_bytes(enum mesh_array array)
{
    return item_bytes(array) == 3 * sizeof(float) ? 4 * sizeof(float) : item_bytes(array);
}

/* Writes one array of all meshes; boxes are found with the positions. */
static void write_array(const struct gpu_scene *gpu, const struct packing_part *part, const atomic_bool *stop)
{
    struct gpu_scene_deform *deform = &gpu->state->deform;
    const enum mesh_array array = (enum mesh_array)part->array;
    const enum rest_place place = (enum rest_place)part->place;
    const size_t in_bytes = item_bytes(array), out_bytes = packed_bytes(array);
    memset(part->out, 0, part->bytes);
    for (uint32_t m = 0; m < deform->mesh_count && !atomic_load(stop); m++) {
        const struct scene_mesh *mesh = scene_mesh(gpu->scene, deform->meshes[m].id);
        char *to = (char *)part->out + place_of(&deform->meshes[m], place) * out_bytes;
        if (array == MESH_POSITIONS) {
            find_joint_boxes(&deform->meshes[m], mesh);
            find_target_boxes(&deform->meshes[m], mesh);
        }
        if (!mesh->arrays[array])
            continue;
        const char *from = (const char *)mesh->arrays[array]->data;
        size_t count = count_of(mesh, place);
        if (in_bytes == out_bytes)
            memcpy(to, from, count * in_bytes);
        else
            for (size_t i = 0; i < count; i++)
                memcpy(to + i * out_bytes, from + i * in_bytes, in_bytes);
    }
}

bool gpu_scene_deform_list_rest(struct gpu_scene *gpu, const struct scene *scene, struct error *error)
{
    struct gpu_scene_deform *deform = &gpu->state->deform;
    struct rest_totals totals = {0};
    if (!list_meshes(gpu, scene, &totals))
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for the meshes that deform");
    if (!check_totals(gpu, &totals, error))
        return false;
    const struct {
        struct gpu_buffer *buffer;
        enum mesh_array array;
        enum rest_place place;
        uint64_t total;
    } rows[] = {
        {&deform->positions, MESH_POSITIONS, REST_VERTEX, totals.vertices},
        {&deform->normals, MESH_NORMALS, REST_VERTEX, totals.vertices},
        {&deform->tangents, MESH_TANGENTS, REST_VERTEX, totals.vertices},
        {&deform->joints, MESH_JOINTS, REST_INFLUENCE, totals.influences},
        {&deform->joint_weights, MESH_WEIGHTS, REST_INFLUENCE, totals.influences},
        {&deform->target_positions, MESH_TARGET_POSITIONS, REST_TARGET, totals.target_vertices},
        {&deform->target_normals, MESH_TARGET_NORMALS, REST_TARGET, totals.target_vertices},
        {&deform->target_tangents, MESH_TARGET_TANGENTS, REST_TARGET, totals.target_vertices},
    };
    for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++) {
        const bool needed = totals.arrays >> rows[i].array & 1u;
        packing_add(&gpu->state->packing,
                    &(struct packing_part){
                        .buffer = rows[i].buffer,
                        .bytes = needed ? (size_t)rows[i].total * packed_bytes(rows[i].array) : 0,
                        .write = write_array,
                        .array = (int)rows[i].array,
                        .place = (int)rows[i].place,
                    });
    }
    return true;
}
