/* SPDX-License-Identifier: MIT */
/* Lists visible nodes with geometry, and discs, and bounds all of them. */
#include "gpu_scene/state.h"

#include "scene/affine.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static int compare_ids(uint32_t a, uint32_t b)
{
    return a < b ? -1 : a > b;
}

/* Finds a geometry that does not deform; these are sorted by id, meshes before sphere sets. */
static bool find_rigid(const struct gpu_scene *gpu, bool is_mesh, uint32_t id, uint32_t *index)
{
    uint32_t low = 0, high = gpu->state->rigid_count;
    while (low < high) {
        uint32_t middle = low + (high - low) / 2;
        const struct gpu_scene_geometry *geometry = &gpu->geometries[middle];
        int order = (geometry->mesh != NULL) == is_mesh ? compare_ids(geometry->id, id) : (is_mesh ? 1 : -1);
        if (order == 0) {
            *index = middle;
            return true;
        }
        if (order < 0)
            low = middle + 1;
        else
            high = middle;
    }
    return false;
}

/* Finds a geometry that deforms; these follow, sorted by node. */
static bool find_deforming(const struct gpu_scene *gpu, uint32_t node, uint32_t *index)
{
    uint32_t low = gpu->state->rigid_count, high = gpu->geometry_count;
    while (low < high) {
        uint32_t middle = low + (high - low) / 2;
        if (gpu->geometries[middle].node == node) {
            *index = middle;
            return true;
        }
        if (gpu->geometries[middle].node < node)
            low = middle + 1;
        else
            high = middle;
    }
    return false;
}

static double determinant(const float m[12])
{
    return (double)m[0] * ((double)m[5] * m[10] - (double)m[6] * m[9]) -
           (double)m[1] * ((double)m[4] * m[10] - (double)m[6] * m[8]) +
           (double)m[2] * ((double)m[4] * m[9] - (double)m[5] * m[8]);
}

/* New instances, and their matrices over the shutter's time. */
struct fresh {
    struct instance *instances;
    uint32_t count;
    float (*motions)[12];
    uint32_t motion_count;
};

/* Visible instances of one kind, in each of the poses; by node ids. */
struct posed {
    uint32_t pose_count;
    struct scene_instance *list[MOTION_POSES_MAX];
    size_t count[MOTION_POSES_MAX];
    size_t cursor[MOTION_POSES_MAX];
};

static void posed_finish(struct posed *posed)
{
    for (uint32_t p = 0; p < posed->pose_count; p++)
        free(posed->list[p]);
}

static bool posed_init(struct posed *posed, const struct scene *scene, const struct scene_motion *motion,
                       enum node_kind kind)
{
    *posed = (struct posed){.pose_count = motion ? motion->pose_count : 1};
    if (scene->objects[kind == NODE_MESH ? OBJECT_MESH : OBJECT_SPHERES].count == 0)
        return true;
    for (uint32_t p = 0; p < posed->pose_count; p++)
        if (!scene_flatten(scene, motion ? &motion->poses[p] : NULL, kind, &posed->list[p], &posed->count[p]))
            return false;
    return true;
}

/* Transforms in each pose of the first pose's i-th instance. False: one of them is singular. An instance that a
 * later pose hides stays at its last transform: it is visible while the shutter is open if it is when it opens. */
static bool matrices_of(struct posed *posed, size_t i, const float *matrices[MOTION_POSES_MAX])
{
    const struct scene_instance *first = &posed->list[0][i];
    bool regular = !first->singular;
    matrices[0] = first->world_from_object;
    for (uint32_t p = 1; p < posed->pose_count; p++) {
        const struct scene_instance *list = posed->list[p];
        size_t *at = &posed->cursor[p];
        while (*at < posed->count[p] && list[*at].node->base.id < first->node->base.id)
            ++*at;
        bool shown = *at < posed->count[p] && list[*at].node == first->node;
        matrices[p] = shown ? list[*at].world_from_object : matrices[p - 1];
        regular = regular && !(shown && list[*at].singular);
    }
    return regular;
}

static void add_motion(struct fresh *fresh, struct instance *instance, const float *const *matrices,
                       uint32_t pose_count)
{
    bool moves = false;
    for (uint32_t p = 1; p < pose_count; p++)
        moves = moves || memcmp(matrices[p], matrices[0], 12 * sizeof(float)) != 0;
    if (!moves)
        return;
    instance->motion = fresh->motion_count * MOTION_TEXELS + 1;
    instance->flags |= pose_count << INSTANCE_POSES_SHIFT;
    for (uint32_t p = 0; p < pose_count; p++)
        memcpy(fresh->motions[fresh->motion_count++], matrices[p], 12 * sizeof(float));
}

static void pack_instances(const struct gpu_scene *gpu, struct posed *posed, bool is_mesh, struct fresh *fresh)
{
    for (size_t i = 0; i < posed->count[0]; i++) {
        const struct scene_instance *in = &posed->list[0][i];
        const float *matrices[MOTION_POSES_MAX];
        uint32_t geometry;
        bool found = (is_mesh && find_deforming(gpu, in->node->base.id, &geometry)) ||
                     find_rigid(gpu, is_mesh, in->node->value.object, &geometry);
        if (!found || !matrices_of(posed, i, matrices))
            continue;
        struct instance *instance = &fresh->instances[fresh->count++];
        *instance = (struct instance){.geometry = geometry, .node = in->node->base.id};
        instance->flags = determinant(in->world_from_object) < 0.0 ? INSTANCE_MIRRORED : 0;
        instance->flags |= (uint32_t)in->light_group << INSTANCE_LIGHT_GROUP_SHIFT;
        memcpy(instance->world_from_object, in->world_from_object, sizeof(instance->world_from_object));
        memcpy(instance->object_from_world, in->object_from_world, sizeof(instance->object_from_world));
        add_motion(fresh, instance, matrices, posed->pose_count);
    }
}

static bool same_set(const struct gpu_scene *gpu, const struct fresh *fresh)
{
    if (!gpu->state->any_update || fresh->count != gpu->instance_count)
        return false;
    for (uint32_t i = 0; i < fresh->count; i++)
        if (fresh->instances[i].node != gpu->instances[i].node ||
            fresh->instances[i].geometry != gpu->instances[i].geometry)
            return false;
    return true;
}

/* Maximum of unchanged instances between two changed ones that are uploaded with them: a call costs more than
 * their bytes. */
#define GAP_INSTANCES_MAX 4u

/* Writes the runs that differ from the mirror. */
static void write_changed(struct gpu_scene *gpu, const struct instance *fresh, uint32_t count,
                          struct scene_changes *changes)
{
    for (uint32_t i = 0; i < count; i++) {
        if (memcmp(&fresh[i], &gpu->instances[i], sizeof(*fresh)) == 0)
            continue;
        uint32_t end = i + 1;
        for (uint32_t k = end; k < count && k - end <= GAP_INSTANCES_MAX; k++)
            if (memcmp(&fresh[k], &gpu->instances[k], sizeof(*fresh)) != 0)
                end = k + 1;
        size_t bytes = (end - i) * sizeof(*fresh);
        gpu_buffer_write(gpu->device, &gpu->instance_buffer, i * sizeof(*fresh), &fresh[i], bytes);
        changes->bits |= CHANGED_INSTANCES;
        changes->uploaded_bytes += bytes;
        i = end;
    }
}

static bool flatten(struct gpu_scene *gpu, const struct scene *scene, const struct scene_motion *motion,
                    struct fresh *fresh, struct error *error)
{
    struct posed meshes = {0}, sets = {0};
    *fresh = (struct fresh){0};
    bool ok = posed_init(&meshes, scene, motion, NODE_MESH) && posed_init(&sets, scene, motion, NODE_SPHERES);
    if (ok) {
        size_t count = meshes.count[0] + sets.count[0];
        fresh->instances = calloc(count + 1, sizeof(*fresh->instances));
        fresh->motions = malloc((meshes.pose_count > 1 ? count * meshes.pose_count : 1) * sizeof(*fresh->motions));
        ok = fresh->instances && fresh->motions;
    }
    if (ok) {
        pack_instances(gpu, &meshes, true, fresh);
        pack_instances(gpu, &sets, false, fresh);
    }
    posed_finish(&meshes);
    posed_finish(&sets);
    return ok || error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for the instances of a scene");
}

static bool check_fresh(const struct gpu_scene *gpu, const struct fresh *fresh, struct error *error)
{
    return gpu_scene_check_texels(gpu, (uint64_t)fresh->count * INSTANCE_TEXELS, "texels of instances", error) &&
           gpu_scene_check_texels(gpu, (uint64_t)fresh->motion_count * MOTION_TEXELS,
                                  "texels of what moves while the shutter is open", error);
}

static bool upload(struct gpu_scene *gpu, const struct fresh *fresh, struct scene_changes *changes,
                   struct error *error)
{
    if (same_set(gpu, fresh)) {
        write_changed(gpu, fresh->instances, fresh->count, changes);
    } else {
        size_t bytes = fresh->count * sizeof(*fresh->instances);
        if (!gpu_buffer_upload(gpu->device, &gpu->instance_buffer, fresh->instances, bytes, error))
            return false;
        changes->bits |= CHANGED_INSTANCES;
        changes->uploaded_bytes += bytes;
    }
    size_t bytes = fresh->motion_count * sizeof(*fresh->motions);
    if (fresh->motion_count == gpu->motion_count && (!bytes || memcmp(fresh->motions, gpu->motions, bytes) == 0))
        return true;
    if (!gpu_buffer_upload(gpu->device, &gpu->motion_buffer, fresh->motions, bytes, error))
        return false;
    changes->bits |= CHANGED_INSTANCES;
    changes->uploaded_bytes += bytes;
    return true;
}

bool gpu_scene_upload_instances(struct gpu_scene *gpu, const struct scene *scene,
                                const struct scene_motion *motion, struct scene_changes *changes,
                                struct error *error)
{
    struct fresh fresh;
    if (!flatten(gpu, scene, motion, &fresh, error) || !check_fresh(gpu, &fresh, error) ||
        !upload(gpu, &fresh, changes, error)) {
        free(fresh.instances);
        free(fresh.motions);
        return false;
    }
    free(gpu->instances);
    free(gpu->motions);
    gpu->instances = fresh.instances;
    gpu->instance_count = fresh.count;
    gpu->motions = fresh.motions;
    gpu->motion_count = fresh.motion_count;
    return true;
}

static int by_id(const void *a, const void *b)
{
    return compare_ids((*(const struct scene_disc *const *)a)->base.id,
                       (*(const struct scene_disc *const *)b)->base.id);
}

static void pack_disc(const struct gpu_scene *gpu, const struct scene_disc *in, struct disc *out)
{
    *out = (struct disc){.material = gpu_scene_material_index(gpu, in->value.material)};
    memcpy(out->centre_radius, in->value.centre_world, 3 * sizeof(float));
    out->centre_radius[3] = in->value.radius;
    float length = sqrtf(in->value.normal_world[0] * in->value.normal_world[0] +
                         in->value.normal_world[1] * in->value.normal_world[1] +
                         in->value.normal_world[2] * in->value.normal_world[2]);
    for (int i = 0; i < 3; i++)
        out->normal[i] = length > 0.0f ? in->value.normal_world[i] / length : 0.0f;
}

bool gpu_scene_pack_discs(struct gpu_scene *gpu, const struct scene *scene, struct scene_changes *changes,
                          struct error *error)
{
    uint64_t signature = gpu_scene_signature(scene, OBJECT_DISC), id;
    size_t count = scene->objects[OBJECT_DISC].count, cursor = 0, n = 0;
    void *value;
    if (gpu->state->any_update && signature == gpu->state->discs_signature)
        return true;
    const struct scene_disc **sorted = calloc(count + 1, sizeof(const struct scene_disc *));
    struct disc *discs = calloc(count + 1, sizeof(*discs));
    bool ok = sorted && discs;
    if (!ok)
        error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for %zu discs", count);
    while (ok && hashmap_next(&scene->objects[OBJECT_DISC], &cursor, &id, &value))
        sorted[n++] = value;
    if (ok)
        qsort(sorted, n, sizeof(*sorted), by_id);
    for (size_t i = 0; i < n; i++)
        pack_disc(gpu, sorted[i], &discs[i]);
    free(sorted);
    if (!ok) {
        free(discs);
        return false;
    }
    free(gpu->discs);
    gpu->discs = discs;
    gpu->disc_count = (uint32_t)count;
    gpu->state->discs_signature = signature;
    gpu->state->stale_tables = true;
    changes->bits |= CHANGED_DISCS;
    return true;
}

static void grow(float lower[3], float upper[3], const float low[3], const float high[3])
{
    for (int k = 0; k < 3; k++) {
        lower[k] = low[k] < lower[k] ? low[k] : lower[k];
        upper[k] = high[k] > upper[k] ? high[k] : upper[k];
    }
}

const float (*gpu_scene_poses(const struct gpu_scene *gpu, const struct instance *instance,
                              uint32_t *pose_count))[12]
{
    *pose_count = 1;
    if (instance->motion == 0)
        return (const float(*)[12])(const void *)instance->world_from_object;
    *pose_count = instance->flags >> INSTANCE_POSES_SHIFT & INSTANCE_POSES_MASK;
    return (const float(*)[12]) & gpu->motions[(instance->motion - 1) / MOTION_TEXELS];
}

void gpu_scene_instance_bounds(const struct gpu_scene *gpu, uint32_t index, float lower_world[3],
                               float upper_world[3])
{
    const struct instance *instance = &gpu->instances[index];
    const struct gpu_scene_geometry *geometry = &gpu->geometries[instance->geometry];
    uint32_t pose_count;
    const float(*poses)[12] = gpu_scene_poses(gpu, instance, &pose_count);
    affine_bounds(lower_world, upper_world, poses[0], geometry->lower, geometry->upper);
    /* Between two poses a point moves linearly. */
    for (uint32_t p = 1; p < pose_count; p++) {
        float low[3], high[3];
        affine_bounds(low, high, poses[p], geometry->lower, geometry->upper);
        grow(lower_world, upper_world, low, high);
    }
}

void gpu_scene_all_instance_bounds(const struct gpu_scene *gpu, float lower[3], float upper[3])
{
    for (int k = 0; k < 3; k++) {
        lower[k] = FLT_MAX;
        upper[k] = -FLT_MAX;
    }
    for (uint32_t i = 0; i < gpu->instance_count; i++) {
        float low[3], high[3];
        gpu_scene_instance_bounds(gpu, i, low, high);
        grow(lower, upper, low, high);
    }
}
