/* SPDX-License-Identifier: MIT */
/* Visible nodes with geometry, discs, and the bounds of everything. */
#include "trace/scene_gpu_state.h"

#include "scene/affine.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static int compare_ids(uint32_t a, uint32_t b)
{
    return a < b ? -1 : a > b;
}

/* Geometries are sorted by id, meshes before sphere sets. */
static bool find_geometry(const struct scene_gpu *gpu, bool is_mesh, uint32_t id, uint32_t *index)
{
    uint32_t low = 0, high = gpu->geometry_count;
    while (low < high) {
        uint32_t middle = low + (high - low) / 2;
        const struct scene_gpu_geometry *geometry = &gpu->geometries[middle];
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

static double determinant(const float m[12])
{
    return (double)m[0] * ((double)m[5] * m[10] - (double)m[6] * m[9]) -
           (double)m[1] * ((double)m[4] * m[10] - (double)m[6] * m[8]) +
           (double)m[2] * ((double)m[4] * m[9] - (double)m[5] * m[8]);
}

static uint32_t pack_instances(const struct scene_gpu *gpu, const struct scene_instance *list, size_t count,
                               bool is_mesh, struct instance *out)
{
    uint32_t n = 0;
    for (size_t i = 0; i < count; i++) {
        uint32_t geometry;
        if (list[i].singular || !find_geometry(gpu, is_mesh, list[i].node->object, &geometry))
            continue;
        struct instance *instance = &out[n++];
        *instance = (struct instance){
            .geometry = geometry,
            .node = list[i].node->base.id,
            .flags = determinant(list[i].world_from_object) < 0.0 ? INSTANCE_MIRRORED : 0,
        };
        memcpy(instance->world_from_object, list[i].world_from_object, sizeof(instance->world_from_object));
        memcpy(instance->object_from_world, list[i].object_from_world, sizeof(instance->object_from_world));
    }
    return n;
}

static bool same_set(const struct scene_gpu *gpu, const struct instance *fresh, uint32_t count)
{
    if (!gpu->state->any_update || count != gpu->instance_count)
        return false;
    for (uint32_t i = 0; i < count; i++)
        if (fresh[i].node != gpu->instances[i].node || fresh[i].geometry != gpu->instances[i].geometry)
            return false;
    return true;
}

/* Writes the runs that differ from the mirror. */
static void write_changed(struct scene_gpu *gpu, const struct instance *fresh, uint32_t count,
                          struct scene_changes *changes)
{
    for (uint32_t i = 0; i < count;) {
        uint32_t end = i;
        while (end < count && memcmp(&fresh[end], &gpu->instances[end], sizeof(*fresh)) != 0)
            end++;
        if (end == i) {
            i++;
            continue;
        }
        size_t bytes = (end - i) * sizeof(*fresh);
        gpu_buffer_write(gpu->device, &gpu->instance_buffer, i * sizeof(*fresh), &fresh[i], bytes);
        changes->instances = true;
        changes->uploaded_bytes += bytes;
        i = end;
    }
}

static bool flatten(struct scene_gpu *gpu, const struct scene *scene, struct instance **fresh, uint32_t *count,
                    struct error *error)
{
    struct scene_instance *meshes = NULL, *sets = NULL;
    size_t mesh_count = 0, set_count = 0;
    *fresh = NULL;
    if (scene_flatten(scene, NULL, NODE_MESH, &meshes, &mesh_count) &&
        scene_flatten(scene, NULL, NODE_SPHERES, &sets, &set_count))
        *fresh = calloc(mesh_count + set_count + 1, sizeof(**fresh));
    if (*fresh) {
        *count = pack_instances(gpu, meshes, mesh_count, true, *fresh);
        *count += pack_instances(gpu, sets, set_count, false, *fresh + *count);
    }
    free(meshes);
    free(sets);
    return *fresh || error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for the instances of a scene");
}

bool scene_gpu_upload_instances(struct scene_gpu *gpu, const struct scene *scene, struct scene_changes *changes,
                                struct error *error)
{
    struct instance *fresh;
    uint32_t count = 0;
    if (!flatten(gpu, scene, &fresh, &count, error))
        return false;
    if (same_set(gpu, fresh, count)) {
        write_changed(gpu, fresh, count, changes);
    } else {
        if (!gpu_buffer_upload(gpu->device, &gpu->instance_buffer, fresh, count * sizeof(*fresh), error)) {
            free(fresh);
            return false;
        }
        changes->instances = true;
        changes->uploaded_bytes += count * sizeof(*fresh);
    }
    free(gpu->instances);
    gpu->instances = fresh;
    gpu->instance_count = count;
    return true;
}

static int by_id(const void *a, const void *b)
{
    return compare_ids((*(const struct scene_disc *const *)a)->base.id,
                       (*(const struct scene_disc *const *)b)->base.id);
}

static void pack_disc(const struct scene_gpu *gpu, const struct scene_disc *in, struct disc *out)
{
    *out = (struct disc){.material = scene_gpu_material_index(gpu, in->material)};
    memcpy(out->centre_radius, in->centre_world, 3 * sizeof(float));
    out->centre_radius[3] = in->radius;
    float length = sqrtf(in->normal_world[0] * in->normal_world[0] + in->normal_world[1] * in->normal_world[1] +
                         in->normal_world[2] * in->normal_world[2]);
    for (int i = 0; i < 3; i++)
        out->normal[i] = length > 0.0f ? in->normal_world[i] / length : 0.0f;
}

bool scene_gpu_upload_discs(struct scene_gpu *gpu, const struct scene *scene, struct scene_changes *changes,
                            struct error *error)
{
    uint64_t signature = scene_gpu_signature(scene, SCENE_DISC), id;
    size_t count = scene->objects[SCENE_DISC].count, cursor = 0, n = 0;
    void *value;
    if (gpu->state->any_update && signature == gpu->state->discs_signature)
        return true;
    const struct scene_disc **sorted = calloc(count + 1, sizeof(const struct scene_disc *));
    struct disc *discs = calloc(count + 1, sizeof(*discs));
    bool ok = sorted && discs;
    if (!ok)
        error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for %zu discs", count);
    while (ok && hashmap_next(&scene->objects[SCENE_DISC], &cursor, &id, &value))
        sorted[n++] = value;
    if (ok)
        qsort(sorted, n, sizeof(*sorted), by_id);
    for (size_t i = 0; i < n; i++)
        pack_disc(gpu, sorted[i], &discs[i]);
    free(sorted);
    if (!ok || !gpu_buffer_upload(gpu->device, &gpu->disc_buffer, discs, count * sizeof(*discs), error)) {
        free(discs);
        return false;
    }
    free(gpu->discs);
    gpu->discs = discs;
    gpu->disc_count = (uint32_t)count;
    gpu->state->discs_signature = signature;
    changes->uploaded_bytes += count * sizeof(*discs);
    return true;
}

static void grow(float lower[3], float upper[3], const float low[3], const float high[3])
{
    for (int k = 0; k < 3; k++) {
        lower[k] = fminf(lower[k], low[k]);
        upper[k] = fmaxf(upper[k], high[k]);
    }
}

void scene_gpu_instance_bounds(const struct scene_gpu *gpu, float lower[3], float upper[3])
{
    for (int k = 0; k < 3; k++) {
        lower[k] = FLT_MAX;
        upper[k] = -FLT_MAX;
    }
    for (uint32_t i = 0; i < gpu->instance_count; i++) {
        const struct scene_gpu_geometry *geometry = &gpu->geometries[gpu->instances[i].geometry];
        const float *low = geometry->mesh ? geometry->mesh->lower : geometry->spheres->lower;
        const float *high = geometry->mesh ? geometry->mesh->upper : geometry->spheres->upper;
        float low_world[3], high_world[3];
        affine_bounds(low_world, high_world, (const float *)(const void *)gpu->instances[i].world_from_object, low,
                      high);
        grow(lower, upper, low_world, high_world);
    }
}
