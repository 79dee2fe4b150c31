/* SPDX-License-Identifier: MIT */
/* Embree's scenes: one for each geometry, kept by (kind, id, revision), and a top scene of instances and discs.
 *
 * All are built in robust mode (watertight edges) and in medium quality: high quality would split triangles in
 * space, and a filter function would then be called twice for one intersection, and tint it twice. */
#include "trace/reference/tracer.h"

#include "base/hashmap.h"
#include "base/parallel.h"
#include "base/progress.h"

#include <stdlib.h>
#include <string.h>

/* Embree builds one scene on all cores; scenes smaller than this are built several at once instead. */
#define ALONE_PRIMITIVES_MIN 20000u
/* Embree reads a vertex of 12 bytes as one of 16. */
#define VERTEX_SLACK_BYTES 4u

static bool no_memory(struct error *error, const struct gpu_scene *scene)
{
    return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for a scene of %u geometries and %u instances",
                     scene->geometry_count, scene->instance_count);
}

/* ---- entries ---- */

static void entry_destroy(struct reference_entry *entry)
{
    if (!entry)
        return;
    if (entry->geometry)
        rtcReleaseGeometry(entry->geometry);
    if (entry->scene)
        rtcReleaseScene(entry->scene);
    opacity_surface_finish(&entry->surface);
    blob_unref(entry->shape[0]);
    blob_unref(entry->shape[1]);
    free(entry);
}

/* Key of an entry. A deforming geometry is kept by its node, which shows no other. */
static uint64_t entry_key(bool is_mesh, uint32_t id, uint32_t node)
{
    return (uint64_t)(node ? node : id) << 2 | (node ? 2u : 0u) | is_mesh;
}

/* The array in its blob, or a padded copy if Embree would read past the end. */
static void set_buffer(RTCGeometry geometry, enum RTCBufferType type, enum RTCFormat format,
                       const struct blob *blob, size_t item_bytes, size_t count)
{
    size_t slack_bytes = format == RTC_FORMAT_FLOAT3 ? VERTEX_SLACK_BYTES : 0;
    if (blob->capacity_bytes - count * item_bytes >= slack_bytes) {
        rtcSetSharedGeometryBuffer(geometry, type, 0, format, blob->data, 0, item_bytes, count);
        return;
    }
    void *copy = rtcSetNewGeometryBuffer(geometry, type, 0, format, item_bytes, count);
    if (copy)
        memcpy(copy, blob->data, count * item_bytes);
}

static bool take_shape(struct reference_entry *entry, RTCDevice device, const struct gpu_scene_geometry *geometry)
{
    if (entry->is_mesh) {
        const struct scene_mesh *mesh = geometry->mesh;
        if (!entry->node)
            entry->shape[0] = blob_ref(mesh->arrays[MESH_POSITIONS]);
        entry->shape[1] = blob_ref(mesh->arrays[MESH_INDICES]);
        entry->primitive_count = mesh->value.triangle_count;
        entry->geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
        if (!entry->geometry)
            return false;
        if (!entry->node)
            set_buffer(entry->geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, entry->shape[0],
                       3 * sizeof(float), mesh->value.vertex_count);
        set_buffer(entry->geometry, RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3, entry->shape[1], 3 * sizeof(uint32_t),
                   mesh->value.triangle_count);
        return opacity_surface_init_mesh(&entry->surface, mesh);
    }
    entry->shape[0] = blob_ref(geometry->spheres->centres_radii);
    entry->primitive_count = geometry->spheres->value.sphere_count;
    entry->geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_SPHERE_POINT);
    if (!entry->geometry)
        return false;
    set_buffer(entry->geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT4, entry->shape[0], 4 * sizeof(float),
               geometry->spheres->value.sphere_count);
    return opacity_surface_init_spheres(&entry->surface, geometry->spheres);
}

/* Called by Embree's builder; false stops it. */
static bool on_progress(void *context, double share)
{
    const struct reference *reference = context;
    (void)share;
    progress_report();
    return !atomic_load(&reference->is_abandoned);
}

static RTCScene new_scene(struct reference *reference)
{
    RTCScene scene = rtcNewScene(reference->device);
    if (scene) {
        rtcSetSceneProgressMonitorFunction(scene, on_progress, reference);
        rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
        rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_MEDIUM);
    }
    return scene;
}

static struct reference_entry *entry_create(struct reference *reference, const struct gpu_scene_geometry *geometry)
{
    struct reference_entry *entry = calloc(1, sizeof(*entry));
    if (!entry)
        return NULL;
    entry->is_mesh = geometry->mesh != NULL;
    entry->id = geometry->id;
    entry->node = geometry->node;
    entry->revision = geometry->revision;
    entry->is_wanted = entry->is_stale = true;
    entry->scene = new_scene(reference);
    if (!entry->scene || !take_shape(entry, reference->device, geometry)) {
        entry_destroy(entry);
        return NULL;
    }
    rtcSetGeometryUserData(entry->geometry, &entry->surface);
    rtcAttachGeometry(entry->scene, entry->geometry);
    return entry;
}

/* Computes one time step of a deforming mesh on the host, so that the device's result is compared with an
 * independent one. */
static bool take_vertices(struct reference_entry *entry, const struct gpu_scene *scene,
                          const struct scene_pose *pose, unsigned step, struct error *error)
{
    const struct scene_node *node = scene_node(scene->scene, entry->node);
    const struct scene_mesh *mesh = scene_mesh(scene->scene, entry->id);
    float *vertices = rtcSetNewGeometryBuffer(entry->geometry, RTC_BUFFER_TYPE_VERTEX, step, RTC_FORMAT_FLOAT3,
                                              3 * sizeof(float), mesh->value.vertex_count);
    return vertices && scene_deform(scene->scene, pose, node, vertices, NULL, error);
}

/* Deforms geometries to the poses. Trees are rebuilt, not refitted: slow rather than wrong. */
static bool deform_entries(struct reference *reference, const struct gpu_scene *scene, struct error *error)
{
    const struct scene_motion *motion = scene->motion;
    for (uint32_t g = 0; g < scene->geometry_count; g++) {
        const struct gpu_scene_geometry *geometry = &scene->geometries[g];
        struct reference_entry *entry = reference->entries[g];
        if (!geometry->node || entry->deformed_revision == geometry->deformed_revision)
            continue;
        bool closes = geometry->device.close_offset != 0;
        rtcSetGeometryTimeStepCount(entry->geometry, closes ? 2 : 1);
        if (!take_vertices(entry, scene, motion ? &motion->poses[0] : NULL, 0, error) ||
            (closes && !take_vertices(entry, scene, &motion->poses[motion->pose_count - 1], 1, error)))
            return false;
        entry->deformed_revision = geometry->deformed_revision;
        entry->is_stale = true;
    }
    return true;
}

/* Marks the entries that the scene still has; entry_of: by geometry of the scene, NULL where there is none. */
static bool find_kept(const struct reference *reference, const struct gpu_scene *scene,
                      struct reference_entry **entry_of)
{
    struct hashmap by_key = {0};
    bool ok = true;
    for (uint32_t i = 0; ok && i < reference->entry_count; i++) {
        struct reference_entry *entry = reference->entries[i];
        entry->is_wanted = false;
        ok = hashmap_put(&by_key, entry_key(entry->is_mesh, entry->id, entry->node), entry);
    }
    for (uint32_t g = 0; ok && g < scene->geometry_count; g++) {
        const struct gpu_scene_geometry *geometry = &scene->geometries[g];
        struct reference_entry *entry =
            hashmap_get(&by_key, entry_key(geometry->mesh != NULL, geometry->id, geometry->node));
        if (!entry || entry->id != geometry->id || entry->revision != geometry->revision)
            continue;
        entry->is_wanted = true;
        entry_of[g] = entry;
    }
    hashmap_finish(&by_key);
    return ok;
}

/* Lists one entry for each geometry of the scene, in its order, and drops those that the scene no longer has. */
static bool list_entries(struct reference *reference, const struct gpu_scene *scene)
{
    uint32_t count = scene->geometry_count;
    struct reference_entry **entries = calloc((size_t)count + 1, sizeof(struct reference_entry *));
    bool ok = entries && find_kept(reference, scene, entries);
    for (uint32_t g = 0; ok && g < count; g++) {
        if (!entries[g])
            entries[g] = entry_create(reference, &scene->geometries[g]);
        ok = entries[g] != NULL;
    }
    if (!ok) {
        for (uint32_t g = 0; entries && g < count; g++)
            if (entries[g] && entries[g]->is_stale)
                entry_destroy(entries[g]);
        free(entries);
        return false;
    }
    for (uint32_t i = 0; i < reference->entry_count; i++)
        if (!reference->entries[i]->is_wanted)
            entry_destroy(reference->entries[i]);
    free(reference->entries);
    reference->entries = entries;
    reference->entry_count = count;
    return true;
}

/* Sets filter functions only where a material needs them: opaque surfaces then cost nothing. Embree notices a
 * change of filter functions when it builds; they change seldom. */
static void set_filters(struct reference_entry *entry)
{
    bool closest = opacity_surface_has_cutout(&entry->surface);
    bool any = opacity_surface_lets_light_pass(&entry->surface);
    if (closest == entry->filters_closest && any == entry->filters_any)
        return;
    entry->filters_closest = closest;
    entry->filters_any = any;
    entry->is_stale = true;
    rtcSetGeometryIntersectFilterFunction(entry->geometry, closest ? reference_filter_closest : NULL);
    rtcSetGeometryOccludedFilterFunction(entry->geometry, any ? reference_filter_any : NULL);
}

static void commit_entry(struct reference_entry *entry)
{
    rtcCommitGeometry(entry->geometry);
    rtcCommitScene(entry->scene);
    entry->is_stale = false;
}

static void commit_small(void *context, uint32_t i)
{
    struct reference_entry *entry = ((struct reference *)context)->entries[i];
    if (entry->is_stale && entry->primitive_count < ALONE_PRIMITIVES_MIN)
        commit_entry(entry);
}

/* Marks the entries to be built as fresh. False: there are none. */
static bool mark_fresh(struct reference *reference)
{
    bool any = false;
    for (uint32_t i = 0; i < reference->entry_count; i++) {
        struct reference_entry *entry = reference->entries[i];
        entry->is_fresh = entry->is_stale;
        any = any || entry->is_stale;
        if (entry->is_stale)
            reference->base.stats.nodes_rebuilt += entry->primitive_count;
    }
    return any;
}

static void commit_entries(struct reference *reference)
{
    uint32_t small_count = 0;
    for (uint32_t i = 0; i < reference->entry_count && !atomic_load(&reference->is_abandoned); i++) {
        struct reference_entry *entry = reference->entries[i];
        if (!entry->is_stale)
            continue;
        if (entry->primitive_count >= ALONE_PRIMITIVES_MIN)
            commit_entry(entry);
        else
            small_count++;
    }
    if (small_count > 0)
        parallel_run(parallel_processors(), reference->entry_count, commit_small, reference);
}

/* ---- discs ---- */

static int by_id(const void *a, const void *b)
{
    uint32_t id_a = (*(const struct scene_disc *const *)a)->base.id;
    uint32_t id_b = (*(const struct scene_disc *const *)b)->base.id;
    return id_a < id_b ? -1 : id_a > id_b;
}

/* Lists the materials of the discs by id, in gpu_scene's order of discs. */
static uint32_t *list_disc_materials(const struct gpu_scene *scene)
{
    const struct hashmap *discs = &scene->scene->objects[OBJECT_DISC];
    const struct scene_disc **sorted = calloc(discs->count + 1, sizeof(const struct scene_disc *));
    uint32_t *materials = calloc(discs->count + 1, sizeof(*materials));
    size_t cursor = 0, count = 0;
    uint64_t id;
    void *value;
    if (!sorted || !materials) {
        free(sorted);
        free(materials);
        return NULL;
    }
    while (hashmap_next(discs, &cursor, &id, &value))
        sorted[count++] = value;
    qsort(sorted, count, sizeof(*sorted), by_id);
    for (size_t i = 0; i < count; i++)
        materials[i] = sorted[i]->value.material;
    free(sorted);
    return materials;
}

static bool same_discs(const struct reference *reference, const struct gpu_scene *scene)
{
    const struct opacity_surface *old = &reference->disc_surface;
    return old->run_count == scene->disc_count &&
           (scene->disc_count == 0 ||
            memcmp(old->discs, scene->discs, scene->disc_count * sizeof(*scene->discs)) == 0);
}

static void drop_discs(struct reference *reference)
{
    if (reference->disc_geometry) {
        if (reference->top)
            rtcDetachGeometry(reference->top, REFERENCE_DISCS);
        rtcReleaseGeometry(reference->disc_geometry);
    }
    reference->disc_geometry = NULL;
    opacity_surface_finish(&reference->disc_surface);
}

static bool make_disc_geometry(struct reference *reference, const struct gpu_scene *scene)
{
    RTCGeometry geometry = rtcNewGeometry(reference->device, RTC_GEOMETRY_TYPE_ORIENTED_DISC_POINT);
    if (!geometry)
        return false;
    reference->disc_geometry = geometry;
    float(*centres)[4] = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4,
                                                 sizeof(*centres), scene->disc_count);
    float(*normals)[3] = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_NORMAL, 0, RTC_FORMAT_FLOAT3,
                                                 sizeof(*normals), scene->disc_count);
    for (uint32_t i = 0; centres && normals && i < scene->disc_count; i++) {
        memcpy(centres[i], scene->discs[i].centre_radius, sizeof(centres[i]));
        memcpy(normals[i], scene->discs[i].normal, sizeof(normals[i]));
    }
    rtcSetGeometryUserData(geometry, &reference->disc_surface);
    rtcAttachGeometryByID(reference->top, geometry, REFERENCE_DISCS);
    return true;
}

/* Rebuilds all discs if one changed: there are few. `shading`: their materials may let other light pass now. A
 * disc with a new material differs in gpu_scene's copy too. */
static bool update_discs(struct reference *reference, const struct gpu_scene *scene, bool shading, bool *changed)
{
    bool same = same_discs(reference, scene);
    if (same && (!shading || scene->disc_count == 0))
        return true;
    *changed = true;
    drop_discs(reference);
    if (scene->disc_count == 0)
        return true;
    uint32_t *materials = list_disc_materials(scene);
    bool ok = materials &&
              opacity_surface_init_discs(&reference->disc_surface, scene->discs, materials, scene->disc_count);
    free(materials);
    if (!ok || !make_disc_geometry(reference, scene))
        return false;
    opacity_surface_bind(&reference->disc_surface, &reference->materials);
    RTCGeometry geometry = reference->disc_geometry;
    if (opacity_surface_has_cutout(&reference->disc_surface))
        rtcSetGeometryIntersectFilterFunction(geometry, reference_filter_closest);
    if (opacity_surface_lets_light_pass(&reference->disc_surface))
        rtcSetGeometryOccludedFilterFunction(geometry, reference_filter_any);
    rtcCommitGeometry(geometry);
    return true;
}

/* ---- the whole scene ---- */

static bool update_materials(struct reference *reference, const struct gpu_scene *scene)
{
    opacity_materials_finish(&reference->materials);
    if (!opacity_materials_init(&reference->materials, scene->scene,
                                scene->motion ? &scene->motion->poses[0] : NULL))
        return false;
    for (uint32_t i = 0; i < reference->entry_count; i++) {
        opacity_surface_bind(&reference->entries[i]->surface, &reference->materials);
        set_filters(reference->entries[i]);
    }
    return true;
}

static bool update_parts(struct reference *reference, const struct gpu_scene *scene, unsigned changed,
                         bool *builds, struct error *error)
{
    bool top_changed = !reference->top, shading = changed & (CHANGED_SHADING | CHANGED_GEOMETRY);
    if (!reference->top)
        reference->top = new_scene(reference);
    if (!reference->top || ((changed & CHANGED_GEOMETRY) && !list_entries(reference, scene)) ||
        (shading && !update_materials(reference, scene)))
        return false;
    if ((changed & (CHANGED_GEOMETRY | CHANGED_DEFORMED)) && !deform_entries(reference, scene, error))
        return false;
    bool any_fresh = mark_fresh(reference);
    if (!update_discs(reference, scene, shading, &top_changed) ||
        !reference_update_instances(
            reference, scene, shading || (changed & (CHANGED_INSTANCES | CHANGED_DEFORMED)), &top_changed, error))
        return false;
    reference->top_changed = top_changed;
    *builds = any_fresh || top_changed;
    return true;
}

bool reference_scene_update(struct reference *reference, const struct gpu_scene *scene, unsigned changed,
                            bool *builds, struct error *error)
{
    bool ok = update_parts(reference, scene, changed, builds, error);
    /* Embree's own error has priority: it says why. */
    return (reference_check(reference, "building", error) && ok) || no_memory(error, scene);
}

void reference_scene_build(struct reference *reference)
{
    commit_entries(reference);
    if (reference->top_changed && !atomic_load(&reference->is_abandoned))
        rtcCommitScene(reference->top);
}

bool reference_scene_built(struct reference *reference, const struct gpu_scene *scene, struct error *error)
{
    struct tracer_stats *stats = &reference->base.stats;
    if (!reference_check(reference, "building", error))
        return no_memory(error, scene);
    stats->nodes = (uint64_t)scene->instance_count + scene->disc_count;
    for (uint32_t i = 0; i < reference->entry_count; i++) {
        reference->entries[i]->is_fresh = false;
        stats->nodes += reference->entries[i]->primitive_count;
    }
    return true;
}

void reference_scene_finish(struct reference *reference)
{
    reference_drop_instances(reference);
    drop_discs(reference);
    if (reference->top)
        rtcReleaseScene(reference->top);
    reference->top = NULL;
    for (uint32_t i = 0; i < reference->entry_count; i++)
        entry_destroy(reference->entries[i]);
    free(reference->entries);
    reference->entries = NULL;
    reference->entry_count = 0;
    opacity_materials_finish(&reference->materials);
}
