/* SPDX-License-Identifier: MIT */
/* Emitters in world space: a leaf for each cluster of each instance, and the tree over them. While the same
 * instances show the same surfaces the tree keeps its shape, and only its nodes follow the motion. */
#include "gpu_scene/emitter.h"

#include "base/log.h"
#include "gpu_scene/state.h"
#include "scene/affine.h"

#include <float.h>
#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define HALF_PI 1.57079632679489662f
/* Maximum of leaves; more are not sampled. Building takes half a second. */
#define LEAVES_LIMIT (1u << 20)
/* Radiance above which a material counts as a lamp: glTF's materials do not exceed it, unless they declare a
 * higher strength. */
#define LAMP_RADIANCE 1.0f

void emitters_finish(struct emitters *emitters)
{
    free(emitters->surfaces);
    free(emitters->clusters);
    free(emitters->shares);
    free(emitters->leaves);
    free(emitters->nodes);
    free(emitters->runs);
    *emitters = (struct emitters){0};
}

/* ---- leaves and runs ---- */

/* Surfaces of a geometry, which are contiguous. */
static uint32_t surfaces_of(const struct emitters *emitters, uint32_t geometry, uint32_t *first)
{
    uint32_t low = 0, high = emitters->surface_count, end;
    while (low < high) {
        const uint32_t middle = low + (high - low) / 2;
        if (emitters->surfaces[middle].geometry < geometry)
            low = middle + 1;
        else
            high = middle;
    }
    *first = end = low;
    while (end < emitters->surface_count && emitters->surfaces[end].geometry == geometry)
        end++;
    return end - low;
}

static void count_all(const struct emitters *emitters, const struct gpu_scene *gpu, uint64_t *leaves,
                      uint64_t *runs)
{
    *leaves = *runs = 0;
    for (uint32_t i = 0; i < gpu->instance_count; i++) {
        uint32_t first, count = surfaces_of(emitters, gpu->instances[i].geometry, &first);
        *runs += count;
        for (uint32_t s = first; s < first + count; s++)
            *leaves += emitters->surfaces[s].cluster_count;
    }
}

static void add_run(struct emitters *emitters, uint32_t instance, const struct emitter_surface *surface)
{
    emitters->runs[emitters->run_count++] = (struct emitter_run){.instance = instance,
                                                                 .first_primitive = surface->first_primitive,
                                                                 .count = surface->count,
                                                                 .first_leaf = emitters->leaf_count};
    for (uint32_t c = 0; c < surface->cluster_count; c++) {
        const struct emitter_cluster *cluster = &emitters->clusters[surface->first_cluster + c];
        emitters->leaves[emitters->leaf_count++] =
            (struct emitter_leaf){.instance = instance,
                                  .first_primitive = cluster->first_primitive,
                                  .count = cluster->count,
                                  .first_share = cluster->first_share};
    }
}

static void warn_of_too_many(struct emitters *emitters, uint64_t leaves)
{
    const bool too_many = leaves > LEAVES_LIMIT;
    if (too_many && !emitters->too_many)
        log_write(LOG_WARNING, "scene",
                  "emissive triangles are not sampled as lights: their instances have %" PRIu64 " groups of them, "
                  "more than %u; rays find them by chance, with more noise",
                  leaves, LEAVES_LIMIT);
    emitters->too_many = too_many;
}

/* Lists the leaves, all but their trails. */
static bool list_leaves(struct emitters *emitters, const struct gpu_scene *gpu, struct emitters *listed)
{
    uint64_t leaves, runs;
    *listed = *emitters;
    listed->leaves = NULL;
    listed->runs = NULL;
    listed->leaf_count = listed->run_count = 0;
    count_all(emitters, gpu, &leaves, &runs);
    warn_of_too_many(emitters, leaves);
    if (leaves == 0 || leaves > LEAVES_LIMIT)
        return true;
    listed->leaves = malloc((size_t)leaves * sizeof(*listed->leaves));
    listed->runs = malloc((size_t)runs * sizeof(*listed->runs));
    if (!listed->leaves || !listed->runs)
        return false;
    for (uint32_t i = 0; i < gpu->instance_count; i++) {
        uint32_t first, count = surfaces_of(emitters, gpu->instances[i].geometry, &first);
        for (uint32_t s = first; s < first + count; s++)
            add_run(listed, i, &emitters->surfaces[s]);
    }
    return true;
}

/* ---- bounds ---- */

/* Transform of an instance for normals and areas. */
struct turn {
    float normals[9];  /* rows; takes a normal to world space */
    float area;        /* area in world space of a square metre of the object */
    bool keeps_angles; /* otherwise a cone of normals may become any */
};

static float dot3(const float a[3], const float b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static struct turn turn_of(const struct instance *instance)
{
    struct turn turn;
    const float *m = (const float *)instance->world_from_object,
                *inverse = (const float *)instance->object_from_world;
    const float x[3] = {m[0], m[4], m[8]}, y[3] = {m[1], m[5], m[9]}, z[3] = {m[2], m[6], m[10]};
    const float xx = dot3(x, x), yy = dot3(y, y), zz = dot3(z, z), mean = (xx + yy + zz) / 3.0f;
    const float off = fmaxf(fmaxf(fabsf(dot3(x, y)), fabsf(dot3(y, z))), fabsf(dot3(z, x)));
    const float uneven = fmaxf(fmaxf(fabsf(xx - mean), fabsf(yy - mean)), fabsf(zz - mean));
    for (int row = 0; row < 3; row++)
        for (int column = 0; column < 3; column++)
            turn.normals[3 * row + column] = inverse[4 * column + row];
    turn.area = mean;
    turn.keeps_angles = off < 1e-3f * mean && uneven < 1e-3f * mean;
    return turn;
}

static void turn_cone(const struct turn *turn, const struct emitter_bounds *in, struct emitter_bounds *out)
{
    for (int k = 0; k < 3; k++)
        out->axis[k] = dot3(&turn->normals[3 * k], in->axis);
    const float length = sqrtf(dot3(out->axis, out->axis));
    const bool known = length > 0.0f && isfinite(length) && (turn->keeps_angles || in->spread == 0.0f);
    for (int k = 0; k < 3; k++)
        out->axis[k] = known ? out->axis[k] / length : (k == 2);
    out->spread = known ? in->spread : HALF_PI;
}

static float emission_of(const struct scene *scene, const struct scene_pose *pose, uint32_t id)
{
    const struct scene_material *material = scene_pose_material(pose, scene_material(scene, id));
    return material->value.emission[0] + material->value.emission[1] + material->value.emission[2];
}

/* Textures only reduce a material's emission. */
static bool any_lamps(const struct emitters *emitters, const struct scene *scene, const struct scene_pose *pose)
{
    bool found = false;
    for (uint32_t i = 0; i < emitters->surface_count; i++) {
        const uint32_t id = emitters->surfaces[i].material;
        const float *emission = scene_pose_material(pose, scene_material(scene, id))->value.emission;
        found |= fmaxf(fmaxf(emission[0], emission[1]), emission[2]) > LAMP_RADIANCE;
    }
    return found;
}

/* Bounds the leaves of an instance's surface. Bounds of an instance that moves while the shutter is open, or
 * that the device deforms, include all its places and all directions. */
static void bound_leaves(const struct emitters *emitters, const struct gpu_scene *gpu, uint32_t index,
                         const struct emitter_surface *surface, float emission, struct emitter_bounds *out)
{
    const struct instance *instance = &gpu->instances[index];
    const bool moves = instance->motion != 0 || gpu->geometries[instance->geometry].node != 0;
    const struct turn turn = turn_of(instance);
    float lower[3], upper[3];
    gpu_scene_instance_bounds(gpu, index, lower, upper);
    for (uint32_t c = 0; c < surface->cluster_count; c++) {
        const struct emitter_bounds *in = &emitters->clusters[surface->first_cluster + c].bounds;
        if (moves) {
            out[c] = (struct emitter_bounds){.axis = {0.0f, 0.0f, 1.0f}, .spread = HALF_PI};
            memcpy(out[c].lower, lower, sizeof(lower));
            memcpy(out[c].upper, upper, sizeof(upper));
        } else {
            affine_bounds(out[c].lower, out[c].upper, (const float *)instance->world_from_object, in->lower,
                          in->upper);
            turn_cone(&turn, in, &out[c]);
        }
        out[c].power = fminf(in->power * turn.area * emission, 1e30f);
    }
}

static struct emitter_bounds *bounds_of(struct emitters *emitters, const struct gpu_scene *gpu,
                                        const struct scene *scene, const struct scene_pose *pose)
{
    struct emitter_bounds *bounds = malloc(emitters->leaf_count * sizeof(*bounds));
    uint32_t leaf = 0;
    double area = 0.0;
    for (uint32_t i = 0; bounds && i < gpu->instance_count; i++) {
        uint32_t first, count = surfaces_of(emitters, gpu->instances[i].geometry, &first);
        for (uint32_t s = first; s < first + count; s++) {
            const struct emitter_surface *surface = &emitters->surfaces[s];
            const float emission = emission_of(scene, pose, surface->material);
            bound_leaves(emitters, gpu, i, surface, emission, bounds + leaf);
            for (uint32_t end = leaf + surface->cluster_count; leaf < end; leaf++)
                area += (double)(bounds[leaf].power / emission);
        }
    }
    emitters->area = (float)area;
    return bounds;
}

/* ---- the tree ---- */

static bool same_leaves(const struct emitters *a, const struct emitters *b)
{
    if (a->leaf_count != b->leaf_count || a->run_count != b->run_count || !a->nodes)
        return false;
    for (uint32_t i = 0; i < a->leaf_count; i++)
        if (a->leaves[i].instance != b->leaves[i].instance ||
            a->leaves[i].first_primitive != b->leaves[i].first_primitive ||
            a->leaves[i].count != b->leaves[i].count)
            return false;
    return true;
}

static bool build(struct emitters *emitters, const struct emitter_bounds *bounds)
{
    uint32_t *trails = malloc(emitters->leaf_count * sizeof(*trails));
    free(emitters->nodes);
    emitters->nodes = calloc((size_t)emitters->leaf_count * 2 - 1, sizeof(*emitters->nodes));
    const bool ok =
        trails && emitters->nodes && emitter_tree_build(bounds, emitters->leaf_count, emitters->nodes, trails);
    for (uint32_t i = 0; ok && i < emitters->leaf_count; i++)
        emitters->leaves[i].trail = trails[i];
    free(trails);
    return ok;
}

/* Moves the listed leaves in; `listed` becomes empty if they equal the present ones. */
static bool update_tree(struct emitters *emitters, struct emitters *listed, const struct gpu_scene *gpu,
                        const struct scene *scene, const struct scene_pose *pose)
{
    const bool same = same_leaves(emitters, listed);
    if (!same) {
        free(emitters->leaves);
        free(emitters->runs);
        emitters->leaves = listed->leaves;
        emitters->runs = listed->runs;
        emitters->leaf_count = listed->leaf_count;
        emitters->run_count = listed->run_count;
        listed->leaves = NULL;
        listed->runs = NULL;
    }
    if (emitters->leaf_count == 0) {
        free(emitters->nodes);
        emitters->nodes = NULL;
        return true;
    }
    struct emitter_bounds *bounds = bounds_of(emitters, gpu, scene, pose);
    const bool ok = bounds && (same ? emitter_tree_refit(bounds, emitters->leaf_count, emitters->nodes)
                                    : build(emitters, bounds));
    free(bounds);
    return ok;
}

bool gpu_scene_make_emitters(struct gpu_scene *gpu, struct error *error)
{
    const struct scene *scene = gpu->scene;
    const struct scene_pose *pose = gpu->motion ? &gpu->motion->poses[0] : NULL;
    struct emitters *emitters = &gpu->state->emitters, listed;
    const bool had = emitters->leaf_count > 0;
    bool changed;
    if (!emitters_list_surfaces(emitters, gpu, scene, pose, &changed, error))
        return false;
    gpu->has_emissive_spheres = emitters_any_spheres(gpu, scene, pose);
    bool ok = list_leaves(emitters, gpu, &listed);
    ok = ok && update_tree(emitters, &listed, gpu, scene, pose);
    free(listed.leaves);
    free(listed.runs);
    gpu->has_emitters = ok && emitters->leaf_count > 0;
    gpu->has_lamps = gpu->has_emitters && any_lamps(emitters, scene, pose);
    gpu->state->stale_tables |= had || gpu->has_emitters || changed;
    return ok || error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for the surfaces that shine");
}
