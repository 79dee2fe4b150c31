/* SPDX-License-Identifier: MIT */
/* Finds emissive triangles in object space: a mesh is read once for all its instances, wherever they move. */
#include "gpu_scene/emission_map.h"
#include "gpu_scene/emitter.h"
#include "gpu_scene/state.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define HALF_PI 1.57079632679489662f
/* Maximum of leaves per instance; with more triangles, several form a leaf. */
#define LEAVES_MAX (1u << 15)

/* Whether triangles of this material are sampled as lights. */
static bool shines(const struct scene_material *material)
{
    return material && material->value.alpha_mode == ALPHA_OPAQUE && !material->value.unlit &&
           !material->value.emission_seen_only &&
           material->value.emission[0] + material->value.emission[1] + material->value.emission[2] > 0.0f;
}

static const struct scene_material *material_of(const struct scene *scene, const struct scene_pose *pose,
                                                uint32_t id)
{
    const struct scene_material *material = scene_material(scene, id);
    return material ? scene_pose_material(pose, material) : NULL;
}

/* ---- list of surfaces ---- */

static void add_surfaces(const struct gpu_scene *gpu, uint32_t geometry, const struct scene *scene,
                         const struct scene_pose *pose, struct emitter_surface *surfaces, uint32_t *count)
{
    const struct gpu_scene_geometry *own = &gpu->geometries[geometry];
    for (uint32_t r = 0; own->mesh && r < own->mesh->range_count; r++) {
        const struct record_material_range *range = &own->mesh->ranges[r];
        if (range->count == 0 || !shines(material_of(scene, pose, range->material)))
            continue;
        if (surfaces)
            surfaces[*count] =
                (struct emitter_surface){.geometry = geometry,
                                         .material = range->material,
                                         .first_primitive = own->device.first_primitive + range->first,
                                         .count = range->count};
        ++*count;
    }
}

bool emitters_any_spheres(const struct gpu_scene *gpu, const struct scene *scene, const struct scene_pose *pose)
{
    for (uint32_t g = 0; g < gpu->geometry_count; g++) {
        const struct scene_spheres *set = gpu->geometries[g].spheres;
        for (uint32_t r = 0; set && r < set->range_count; r++)
            if (set->ranges[r].count > 0 && shines(material_of(scene, pose, set->ranges[r].material)))
                return true;
    }
    return false;
}

static bool list(const struct gpu_scene *gpu, const struct scene *scene, const struct scene_pose *pose,
                 struct emitter_surface **surfaces, uint32_t *count)
{
    *surfaces = NULL;
    *count = 0;
    for (uint32_t g = 0; g < gpu->geometry_count; g++)
        add_surfaces(gpu, g, scene, pose, NULL, count);
    if (*count == 0)
        return true;
    *surfaces = malloc(*count * sizeof(**surfaces));
    *count = 0;
    for (uint32_t g = 0; *surfaces && g < gpu->geometry_count; g++)
        add_surfaces(gpu, g, scene, pose, *surfaces, count);
    return *surfaces != NULL;
}

/* Number of triangles per leaf that keeps the number of leaves within the maximum. */
static uint32_t choose_cluster_size(const struct gpu_scene *gpu, const struct emitter_surface *surfaces,
                                    uint32_t surface_count)
{
    uint64_t *triangles = calloc(gpu->geometry_count + 1, sizeof(*triangles)), all = 0;
    if (!triangles)
        return 0;
    for (uint32_t s = 0; s < surface_count; s++)
        triangles[surfaces[s].geometry] += surfaces[s].count;
    for (uint32_t i = 0; i < gpu->instance_count; i++)
        all += triangles[gpu->instances[i].geometry];
    free(triangles);
    const uint64_t size = (all + LEAVES_MAX - 1) / LEAVES_MAX;
    return size > 1 ? (size < UINT32_MAX ? (uint32_t)size : UINT32_MAX) : 1;
}

static uint64_t texture_signature(const struct scene *scene, const struct record_texture_use *use)
{
    const struct scene_texture *texture = use->texture ? scene_texture(scene, use->texture) : NULL;
    uint64_t sum =
        texture ? gpu_scene_mix(texture->base.id + 1) + texture->base.revision * 3 + use->texcoord_set : 0;
    for (int i = 0; texture && i < 6; i++) {
        uint32_t bits;
        memcpy(&bits, &use->uv_transform[i], sizeof(bits));
        sum = gpu_scene_mix(sum + bits);
    }
    return sum;
}

/* Signature of all inputs of clusters; factors of emission are not among them. */
static uint64_t sign(const struct gpu_scene *gpu, const struct scene *scene, const struct scene_pose *pose,
                     const struct emitter_surface *surfaces, uint32_t count, uint32_t cluster_size)
{
    uint64_t sum = gpu_scene_mix(gpu->state->shapes_signature + cluster_size);
    for (uint32_t s = 0; s < count; s++) {
        const struct scene_material *material = material_of(scene, pose, surfaces[s].material);
        sum = gpu_scene_mix(sum + surfaces[s].first_primitive);
        sum = gpu_scene_mix(sum + surfaces[s].count);
        sum = gpu_scene_mix(sum + surfaces[s].material);
        sum = gpu_scene_mix(sum + texture_signature(scene, &material->textures[MATERIAL_EMISSION]));
    }
    return sum ? sum : 1;
}

/* ---- triangles ---- */

/* A surface, and the arrays of its triangles. */
struct source {
    const struct scene_mesh *mesh;
    const uint32_t *indices; /* indices of the surface's first triangle */
    const float *positions;
    const float *texcoords; /* NULL: 0 everywhere */
    const struct record_texture_use *use;
    const struct emission_map *map; /* NULL: the whole surface is equally bright */
};

/* Twice the area along the normal, object space. */
static void area_vector(const struct source *source, uint32_t triangle, float out[3])
{
    const float *a = source->positions + (size_t)source->indices[3 * (size_t)triangle] * 3,
                *b = source->positions + (size_t)source->indices[3 * (size_t)triangle + 1] * 3,
                *c = source->positions + (size_t)source->indices[3 * (size_t)triangle + 2] * 3;
    const float u[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]}, v[3] = {c[0] - a[0], c[1] - a[1], c[2] - a[2]};
    for (int k = 0; k < 3; k++)
        out[k] = u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3];
}

static float brightness(const struct source *source, uint32_t triangle)
{
    float uv[3][2];
    if (!source->map)
        return 1.0f;
    for (int k = 0; k < 3; k++) {
        static const float none[2] = {0.0f, 0.0f};
        const float *in = none;
        if (source->texcoords)
            in = source->texcoords + (size_t)source->indices[3 * (size_t)triangle + (size_t)k] * 2;
        for (int axis = 0; axis < 2; axis++) {
            const float *row = source->use->uv_transform + 3 * axis;
            uv[k][axis] = row[0] * in[0] + row[1] * in[1] + row[2];
        }
    }
    return emission_map_mean(source->map, (const float(*)[2])uv);
}

static float length3(const float v[3])
{
    return sqrtf(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

static void grow(struct emitter_bounds *bounds, const struct source *source, uint32_t triangle)
{
    for (size_t corner = 0; corner < 3; corner++) {
        const float *at = source->positions + (size_t)source->indices[3 * (size_t)triangle + corner] * 3;
        for (int k = 0; k < 3; k++) {
            bounds->lower[k] = fminf(bounds->lower[k], at[k]);
            bounds->upper[k] = fmaxf(bounds->upper[k], at[k]);
        }
    }
}

/* Sums the triangles' power and bounds, and finds the middle of their normals. */
static void sum_up(struct emitter_cluster *cluster, const struct source *source, uint32_t first, float *shares)
{
    struct emitter_bounds *bounds = &cluster->bounds;
    *bounds =
        (struct emitter_bounds){.lower = {FLT_MAX, FLT_MAX, FLT_MAX}, .upper = {-FLT_MAX, -FLT_MAX, -FLT_MAX}};
    for (uint32_t i = 0; i < cluster->count; i++) {
        float area[3];
        area_vector(source, first + i, area);
        const float power = 0.5f * length3(area) * brightness(source, first + i);
        const float side = area[0] * bounds->axis[0] + area[1] * bounds->axis[1] + area[2] * bounds->axis[2] < 0.0f
                               ? -1.0f
                               : 1.0f;
        for (int k = 0; k < 3; k++)
            bounds->axis[k] += side * area[k];
        bounds->power += isfinite(power) ? power : 0.0f;
        if (shares)
            shares[i] = bounds->power;
        grow(bounds, source, first + i);
    }
    for (uint32_t i = 0; shares && i < cluster->count; i++)
        shares[i] = i + 1 < cluster->count && bounds->power > 0.0f ? fminf(shares[i] / bounds->power, 1.0f) : 1.0f;
}

static void spread_cone(struct emitter_cluster *cluster, const struct source *source, uint32_t first)
{
    struct emitter_bounds *bounds = &cluster->bounds;
    const float length = length3(bounds->axis);
    bounds->spread = length > 0.0f && isfinite(length) ? 0.0f : HALF_PI;
    for (int k = 0; k < 3; k++)
        bounds->axis[k] = bounds->spread == 0.0f ? bounds->axis[k] / length : (k == 2);
    if (bounds->spread > 0.0f || cluster->count == 1)
        return;
    float minimum = 1.0f;
    for (uint32_t i = 0; i < cluster->count; i++) {
        float area[3];
        area_vector(source, first + i, area);
        const float own = length3(area);
        const float cosine = area[0] * bounds->axis[0] + area[1] * bounds->axis[1] + area[2] * bounds->axis[2];
        minimum = own > 0.0f ? fminf(minimum, fabsf(cosine) / own) : minimum;
    }
    bounds->spread = acosf(minimum);
}

/* ---- clusters ---- */

struct maps {
    struct emission_map *maps;
    uint32_t count;
};

/* Map of a texture; NULL: the surface has no texture. */
static const struct emission_map *find_map(struct maps *maps, const struct scene *scene,
                                           const struct record_texture_use *use)
{
    const struct scene_texture *texture = use->texture ? scene_texture(scene, use->texture) : NULL;
    if (!texture)
        return NULL;
    for (uint32_t i = 0; i < maps->count; i++)
        if (maps->maps[i].texture == use->texture)
            return &maps->maps[i];
    emission_map_init(&maps->maps[maps->count], texture);
    return &maps->maps[maps->count++];
}

static void fill_clusters(struct emitters *emitters, const struct emitter_surface *surface,
                          const struct gpu_scene_geometry *geometry, struct source source)
{
    const uint32_t local = surface->first_primitive - geometry->device.first_primitive;
    const uint32_t size = emitters->cluster_size;
    source.indices += (size_t)local * 3;
    for (uint32_t c = 0; c < surface->cluster_count; c++) {
        struct emitter_cluster *cluster = &emitters->clusters[surface->first_cluster + c];
        const uint32_t first = c * size, left = surface->count - first;
        cluster->first_primitive = surface->first_primitive + first;
        cluster->count = left < size ? left : size;
        cluster->first_share = emitters->share_count;
        sum_up(cluster, &source, first, size > 1 ? emitters->shares + emitters->share_count : NULL);
        spread_cone(cluster, &source, first);
        emitters->share_count += size > 1 ? cluster->count : 0;
    }
}

static bool make_clusters(struct emitters *emitters, const struct gpu_scene *gpu, const struct scene *scene,
                          const struct scene_pose *pose)
{
    uint64_t cluster_count = 0, triangle_count = 0;
    for (uint32_t s = 0; s < emitters->surface_count; s++) {
        struct emitter_surface *surface = &emitters->surfaces[s];
        surface->first_cluster = (uint32_t)cluster_count;
        surface->cluster_count = (surface->count + emitters->cluster_size - 1) / emitters->cluster_size;
        cluster_count += surface->cluster_count;
        triangle_count += surface->count;
    }
    const size_t textures = scene->objects[OBJECT_TEXTURE].count;
    const size_t map_max = textures < emitters->surface_count ? textures : emitters->surface_count;
    struct maps maps = {.maps = malloc((map_max + 1) * sizeof(*maps.maps))};
    emitters->clusters = malloc((size_t)cluster_count * sizeof(*emitters->clusters));
    emitters->shares = emitters->cluster_size > 1 ? malloc((size_t)triangle_count * sizeof(float)) : NULL;
    const bool ok = maps.maps && emitters->clusters && (emitters->shares || emitters->cluster_size == 1);
    for (uint32_t s = 0; ok && s < emitters->surface_count; s++) {
        const struct emitter_surface *surface = &emitters->surfaces[s];
        const struct scene_mesh *mesh = gpu->geometries[surface->geometry].mesh;
        const struct record_texture_use *use =
            &material_of(scene, pose, surface->material)->textures[MATERIAL_EMISSION];
        const struct blob *texcoords = mesh->arrays[use->texcoord_set == 1 ? MESH_TEXCOORDS_1 : MESH_TEXCOORDS_0];
        fill_clusters(emitters, surface, &gpu->geometries[surface->geometry],
                      (struct source){.mesh = mesh,
                                      .indices = (const uint32_t *)(const void *)mesh->arrays[MESH_INDICES]->data,
                                      .positions = (const float *)(const void *)mesh->arrays[MESH_POSITIONS]->data,
                                      .texcoords = texcoords ? (const float *)(const void *)texcoords->data : NULL,
                                      .use = use,
                                      .map = find_map(&maps, scene, use)});
    }
    free(maps.maps);
    return ok;
}

bool emitters_list_surfaces(struct emitters *emitters, const struct gpu_scene *gpu, const struct scene *scene,
                            const struct scene_pose *pose, bool *changed, struct error *error)
{
    struct emitter_surface *surfaces;
    uint32_t count, cluster_size = 1;
    uint64_t signature = 0;
    bool ok = list(gpu, scene, pose, &surfaces, &count);
    if (ok && count > 0) {
        cluster_size = choose_cluster_size(gpu, surfaces, count);
        ok = cluster_size > 0;
        signature = sign(gpu, scene, pose, surfaces, count, cluster_size);
    }
    *changed = ok && signature != emitters->signature;
    if (ok && !*changed) {
        free(surfaces);
        return true;
    }
    emitters_finish(emitters);
    *emitters = (struct emitters){.signature = ok ? signature : 0,
                                  .cluster_size = cluster_size,
                                  .surfaces = surfaces,
                                  .surface_count = count};
    if (ok && (count == 0 || make_clusters(emitters, gpu, scene, pose)))
        return true;
    emitters_finish(emitters);
    return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for the surfaces that shine");
}
