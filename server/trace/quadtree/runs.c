/* SPDX-License-Identifier: MIT */
/* Boxes round runs of primitives, kept from scene to scene. */
#include "trace/quadtree/runs.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

void quadtree_runs_finish(struct quadtree_runs *runs)
{
    free(runs->boxes);
    free(runs->owners);
    *runs = (struct quadtree_runs){0};
}

static size_t run_count(uint32_t primitives)
{
    return ((size_t)primitives + QUADTREE_RUN - 1) / QUADTREE_RUN;
}

static struct quadtree_run_owner owner_of(const struct gpu_scene_geometry *geometry, size_t first)
{
    return (struct quadtree_run_owner){.id = geometry->id,
                                       .node = geometry->node,
                                       .count = geometry->device.primitive_count,
                                       .revision = geometry->revision,
                                       .first = first,
                                       .is_mesh = geometry->mesh != NULL};
}

static bool is_of(const struct quadtree_run_owner *a, const struct quadtree_run_owner *b)
{
    return a->id == b->id && a->node == b->node && a->count == b->count && a->revision == b->revision &&
           a->first == b->first && a->is_mesh == b->is_mesh;
}

static size_t next_first(const struct quadtree_run_owner *owner)
{
    return owner->first + (owner->node == 0 ? run_count(owner->count) : 0);
}

static bool are_same(const struct quadtree_runs *runs, const struct gpu_scene *scene)
{
    size_t first = 0;
    bool same = runs->owner_count == scene->geometry_count;
    for (uint32_t i = 0; same && i < scene->geometry_count; i++) {
        const struct quadtree_run_owner owner = owner_of(&scene->geometries[i], first);
        same = is_of(&owner, &runs->owners[i]);
        first = next_first(&owner);
    }
    return same;
}

static void grow(struct quadtree_run_box *box, const float point[3], float radius)
{
    for (int k = 0; k < 3; k++) {
        box->lower[k] = fminf(box->lower[k], point[k] - radius);
        box->upper[k] = fmaxf(box->upper[k], point[k] + radius);
    }
}

static void grow_by(struct quadtree_run_box *box, const struct gpu_scene_geometry *geometry, uint32_t primitive)
{
    if (geometry->spheres) {
        const float *sphere =
            (const float *)(const void *)geometry->spheres->centres_radii->data + 4 * (size_t)primitive;
        grow(box, sphere, sphere[3]);
        return;
    }
    const struct scene_mesh *mesh = geometry->mesh;
    const uint32_t *corners =
        (const uint32_t *)(const void *)mesh->arrays[MESH_INDICES]->data + 3 * (size_t)primitive;
    const float *positions = (const float *)(const void *)mesh->arrays[MESH_POSITIONS]->data;
    for (int i = 0; i < 3; i++)
        grow(box, &positions[3 * (size_t)corners[i]], 0.0f);
}

static void find_boxes(struct quadtree_run_box *boxes, const struct gpu_scene_geometry *geometry)
{
    const uint32_t count = geometry->device.primitive_count;
    for (uint32_t i = 0; i < count; i++) {
        if (i % QUADTREE_RUN == 0)
            boxes[i / QUADTREE_RUN] = (struct quadtree_run_box){.lower = {FLT_MAX, FLT_MAX, FLT_MAX},
                                                                .upper = {-FLT_MAX, -FLT_MAX, -FLT_MAX}};
        grow_by(&boxes[i / QUADTREE_RUN], geometry, i);
    }
}

bool quadtree_runs_update(struct quadtree_runs *runs, const struct gpu_scene *scene, struct error *error)
{
    if (are_same(runs, scene))
        return true;
    quadtree_runs_finish(runs);
    size_t count = 0;
    runs->owners = calloc(scene->geometry_count, sizeof(*runs->owners));
    for (uint32_t i = 0; runs->owners && i < scene->geometry_count; i++) {
        runs->owners[i] = owner_of(&scene->geometries[i], count);
        count = next_first(&runs->owners[i]);
    }
    runs->boxes = runs->owners && count > 0 ? malloc(count * sizeof(*runs->boxes)) : NULL;
    if (!runs->owners || (count > 0 && !runs->boxes)) {
        quadtree_runs_finish(runs);
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for boxes round primitives");
    }
    runs->owner_count = scene->geometry_count;
    for (uint32_t i = 0; i < scene->geometry_count; i++)
        if (runs->owners[i].node == 0)
            find_boxes(&runs->boxes[runs->owners[i].first], &scene->geometries[i]);
    return true;
}

/* The owner of an instance's boxes; NULL: it has no known boxes. */
static const struct quadtree_run_owner *known_owner(const struct quadtree_runs *runs,
                                                    const struct gpu_scene *scene, uint32_t instance)
{
    const uint32_t geometry = scene->instances[instance].geometry;
    return geometry < runs->owner_count && runs->owners[geometry].node == 0 ? &runs->owners[geometry] : NULL;
}

uint32_t quadtree_runs_of(const struct quadtree_runs *runs, const struct gpu_scene *scene, uint32_t instance)
{
    const struct quadtree_run_owner *owner = known_owner(runs, scene, instance);
    return owner ? (uint32_t)run_count(owner->count) : 1;
}

struct raster_span quadtree_run_span(const struct quadtree_runs *runs, const struct gpu_scene *scene,
                                     uint32_t instance, uint32_t run)
{
    struct raster_span span = {.instance = instance,
                               .end =
                                   scene->geometries[scene->instances[instance].geometry].device.primitive_count};
    if (!known_owner(runs, scene, instance))
        return span;
    span.first = run * QUADTREE_RUN;
    if (span.end - span.first > QUADTREE_RUN)
        span.end = span.first + QUADTREE_RUN;
    return span;
}

const struct quadtree_run_box *quadtree_run_box(const struct quadtree_runs *runs, const struct gpu_scene *scene,
                                                uint32_t instance, uint32_t run)
{
    const struct quadtree_run_owner *owner = known_owner(runs, scene, instance);
    return owner ? &runs->boxes[owner->first + run] : NULL;
}
