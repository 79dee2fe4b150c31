// SPDX-License-Identifier: MIT
/* Updates trees to the vertices of deformed meshes. */
#include "trace/tree/store.h"

#include "base/clock.h"
#include "shared/bindings.h"

#include <epoxy/gl.h>
#include <float.h>
#include <stdlib.h>
#include <string.h>

/* A geometry whose vertices have moved. */
struct moved {
    uint32_t geometry;
    uint32_t first_box;
    bool rebuild;
};

struct deforming {
    struct moved *list;
    uint32_t count;
    uint64_t boxes; /* number of boxes in the trees that can be refitted */
};

static struct bvh_entry *entry_of(struct bvh_store *store, uint32_t geometry)
{
    return &store->entries[store->entry_of[geometry]];
}

static bool list_moved(struct deforming *deforming, const struct bvh_store *store, const struct gpu_scene *scene)
{
    deforming->list = malloc(((size_t)scene->geometry_count + 1) * sizeof(*deforming->list));
    for (uint32_t g = 0; deforming->list && g < scene->geometry_count; g++) {
        const struct bvh_entry *entry = bvh_store_entry(store, g);
        if (!entry || entry->node == 0 || entry->deformed_revision == scene->geometries[g].deformed_revision)
            continue;
        deforming->list[deforming->count++] = (struct moved){
            .geometry = g, .first_box = (uint32_t)deforming->boxes, .rebuild = entry->refit.record_count == 0};
        deforming->boxes += entry->refit.record_count;
    }
    return deforming->list != NULL;
}

static struct bvh_refit_place place_of(struct bvh_store *store, const struct gpu_scene *scene,
                                       const struct moved *moved)
{
    const struct bvh_entry *entry = entry_of(store, moved->geometry);
    const struct geometry *geometry = &scene->geometries[moved->geometry].device;
    return (struct bvh_refit_place){
        .boxes = &store->boxes,
        .primitives = &store->primitives,
        .elements = &store->elements,
        .first_box = moved->first_box,
        .first_texel = entry->first_texel,
        .close_texels = entry->texel_count / 2,
        .first_vertex = geometry->first_vertex,
        .close_offset = geometry->close_offset,
        .first_element = entry->first_element,
        .element_count = entry->element_count,
    };
}

/* ---- refit ---- */

/* Refits the boxes of all trees, then reads their roots together: each read waits for the device. */
static bool make_bounds(struct bvh_store *store, struct gpu_scene *scene, struct deforming *deforming,
                        struct bvh_refit_root *roots, struct error *error)
{
    struct gpu_device *device = store->device;
    if (!gpu_buffer_reserve(device, &store->boxes, deforming->boxes * BVH_REFIT_BOX_BYTES, error) ||
        !gpu_buffer_reserve(device, &store->roots, deforming->count * sizeof(*roots), error))
        return false;
    gpu_buffer_bind_texels(device, &scene->positions, UNIT_POSITIONS, GL_RGBA32F);
    for (uint32_t i = 0; i < deforming->count; i++) {
        const struct moved *moved = &deforming->list[i];
        const struct bvh_refit_place place = place_of(store, scene, moved);
        if (moved->rebuild)
            continue;
        if (!bvh_refit_bounds(&entry_of(store, moved->geometry)->refit, device, &place, error))
            return false;
        gpu_buffer_copy(device, (struct gpu_buffer_place){&store->boxes, moved->first_box * sizeof(*roots)},
                        (struct gpu_buffer_place){&store->roots, i * sizeof(*roots)}, sizeof(*roots));
    }
    gpu_buffer_read(device, &store->roots, 0, roots, deforming->count * sizeof(*roots));
    return true;
}

/* Sets an entry's box, padded as the builder does, with overflow included. Lower above upper: no corner is a
 * number. */
static void take_box(struct bvh_entry *entry, const struct bvh_refit_root *root)
{
    memcpy(entry->lower, root->lower, sizeof(entry->lower));
    memcpy(entry->upper, root->upper, sizeof(entry->upper));
    bvh_pad_box(entry->lower, entry->upper);
    for (int k = 0; k < 3; k++) {
        entry->lower[k] = entry->lower[k] < -FLT_MAX ? -FLT_MAX : entry->lower[k];
        entry->upper[k] = entry->upper[k] > FLT_MAX ? FLT_MAX : entry->upper[k];
    }
}

static bool has_worn_out(const struct bvh_entry *entry, const struct bvh_refit_root *root)
{
    return root->surfaces > BVH_REFIT_WEAR_MAX * entry->built_wear * root->triangle_surfaces;
}

static bool refit(struct bvh_store *store, struct gpu_scene *scene, struct deforming *deforming,
                  struct bvh_store_report *report, struct error *error)
{
    struct bvh_refit_root *roots = calloc((size_t)deforming->count + 1, sizeof(*roots));
    if (!roots)
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for %u trees", deforming->count);
    bool ok = deforming->boxes == 0 || make_bounds(store, scene, deforming, roots, error);
    for (uint32_t i = 0; ok && i < deforming->count; i++) {
        struct moved *moved = &deforming->list[i];
        struct bvh_entry *entry = entry_of(store, moved->geometry);
        moved->rebuild = moved->rebuild || has_worn_out(entry, &roots[i]);
        if (moved->rebuild)
            continue;
        const struct bvh_refit_place place = place_of(store, scene, moved);
        take_box(entry, &roots[i]);
        entry->grid = bvh_grid_over(entry->lower, entry->upper, 0);
        ok = bvh_refit_write(&entry->refit, store->device, &place, &store->settings, &entry->grid, error);
        entry->deformed_revision = scene->geometries[moved->geometry].deformed_revision;
        report->refitted_elements += entry->element_count;
    }
    free(roots);
    return ok;
}

/* ---- rebuild ---- */

/* Reads the vertices from the device: at shutter open, then at shutter close, 4 floats each. */
static float *read_vertices(struct bvh_store *store, const struct gpu_scene *scene,
                            const struct geometry *geometry)
{
    size_t bytes = (size_t)geometry->vertex_count * 4 * sizeof(float);
    float *vertices = malloc(2 * bytes + 1);
    if (!vertices)
        return NULL;
    gpu_buffer_read(store->device, &scene->positions, (size_t)geometry->first_vertex * 4 * sizeof(float), vertices,
                    bytes);
    if (geometry->close_offset)
        gpu_buffer_read(store->device, &scene->positions,
                        ((size_t)geometry->first_vertex + geometry->close_offset) * 4 * sizeof(float),
                        vertices + (size_t)geometry->vertex_count * 4, bytes);
    return vertices;
}

static bool rebuild(struct bvh_store *store, const struct gpu_scene *scene, const struct deforming *deforming,
                    struct bvh_store_report *report, struct stage_times *times, struct error *error)
{
    struct bvh_job *jobs = calloc((size_t)deforming->count + 1, sizeof(*jobs));
    float **vertices = calloc((size_t)deforming->count + 1, sizeof(*vertices));
    uint32_t *which = malloc(((size_t)deforming->count + 1) * sizeof(*which)), count = 0;
    bool ok = jobs && vertices && which;
    for (uint32_t i = 0; ok && i < deforming->count; i++) {
        const struct gpu_scene_geometry *geometry = &scene->geometries[deforming->list[i].geometry];
        if (!deforming->list[i].rebuild)
            continue;
        float *read = vertices[count] = read_vertices(store, scene, &geometry->device);
        ok = read != NULL;
        jobs[count].shape = (struct bvh_shape){
            .positions = read,
            .positions_close =
                ok && geometry->device.close_offset ? read + (size_t)geometry->device.vertex_count * 4 : NULL,
            .position_floats = 4,
            .indices = (const uint32_t *)(const void *)geometry->mesh->arrays[MESH_INDICES]->data,
            .primitive_count = geometry->mesh->value.triangle_count,
            .deforms = true,
        };
        which[count++] = deforming->list[i].geometry;
    }
    if (!ok)
        error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for the trees of %u meshes", deforming->count);
    if (ok && count > 0) {
        ok = bvh_store_rebuild(store, scene, jobs, which, count, report, times, error);
    } else {
        free(which);
        free(jobs);
    }
    for (uint32_t i = 0; vertices && i < deforming->count; i++)
        free(vertices[i]);
    free(vertices);
    return ok;
}

bool bvh_store_deform(struct bvh_store *store, struct gpu_scene *scene, struct bvh_store_report *report,
                      struct stage_times *times, struct error *error)
{
    struct deforming deforming = {0};
    uint64_t start_ns = clock_now_ns();
    store->deforms_in_shutter = false;
    for (uint32_t g = 0; g < scene->geometry_count; g++)
        store->deforms_in_shutter = store->deforms_in_shutter || scene->geometries[g].device.close_offset != 0;
    if (!list_moved(&deforming, store, scene))
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for a scene of %u geometries",
                         scene->geometry_count);
    bool ok = deforming.count == 0 || refit(store, scene, &deforming, report, error);
    stage_times_add(times, STAGE_BUILD, CLOCK_CPU, 0, start_ns, clock_now_ns() - start_ns);
    ok = ok && (deforming.count == 0 || rebuild(store, scene, &deforming, report, times, error));
    free(deforming.list);
    return ok;
}
