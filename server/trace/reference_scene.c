/* SPDX-License-Identifier: MIT */
/* Embree's scenes: one for each geometry, kept by (kind, id, revision), and a top scene of instances and discs.
 *
 * All are built in robust mode (watertight edges) and in medium quality: high quality would split triangles in
 * space, and a filter function would then be asked twice about one crossing, and tint it twice. */
#include "trace/reference.h"

#include "base/hashmap.h"
#include "base/parallel.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Embree builds one scene on all cores; scenes smaller than this are built several at once instead. */
#define ALONE_PRIMITIVES_MIN 20000u
/* World coordinates that rays may have at least, else the scene is refused. */
#define REACH_MIN 1e9
/* Embree reads a vertex of 12 bytes as one of 16. */
#define VERTEX_SLACK_BYTES 4u

static bool no_memory(struct error *error, const struct scene_gpu *scene)
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

static uint64_t entry_key(bool is_mesh, uint32_t id)
{
    return (uint64_t)id << 1 | is_mesh;
}

/* The array as it lies in its blob, or a copy with room behind it where Embree would read past the end. */
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

static bool take_shape(struct reference_entry *entry, RTCDevice device, const struct scene_gpu_geometry *geometry)
{
    if (entry->is_mesh) {
        const struct scene_mesh *mesh = geometry->mesh;
        entry->shape[0] = blob_ref(mesh->arrays[MESH_POSITIONS]);
        entry->shape[1] = blob_ref(mesh->arrays[MESH_INDICES]);
        entry->primitive_count = mesh->triangle_count;
        entry->geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
        if (!entry->geometry)
            return false;
        set_buffer(entry->geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, entry->shape[0], 3 * sizeof(float),
                   mesh->vertex_count);
        set_buffer(entry->geometry, RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3, entry->shape[1], 3 * sizeof(uint32_t),
                   mesh->triangle_count);
        return opacity_surface_init_mesh(&entry->surface, mesh);
    }
    entry->shape[0] = blob_ref(geometry->spheres->centres_radii);
    entry->primitive_count = geometry->spheres->sphere_count;
    entry->geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_SPHERE_POINT);
    if (!entry->geometry)
        return false;
    set_buffer(entry->geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT4, entry->shape[0], 4 * sizeof(float),
               geometry->spheres->sphere_count);
    return opacity_surface_init_spheres(&entry->surface, geometry->spheres);
}

static RTCScene new_scene(RTCDevice device)
{
    RTCScene scene = rtcNewScene(device);
    if (scene) {
        rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
        rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_MEDIUM);
    }
    return scene;
}

static struct reference_entry *entry_create(RTCDevice device, const struct scene_gpu_geometry *geometry)
{
    struct reference_entry *entry = calloc(1, sizeof(*entry));
    if (!entry)
        return NULL;
    entry->is_mesh = geometry->mesh != NULL;
    entry->id = geometry->id;
    entry->revision = geometry->revision;
    entry->is_wanted = entry->is_stale = true;
    entry->scene = new_scene(device);
    if (!entry->scene || !take_shape(entry, device, geometry)) {
        entry_destroy(entry);
        return NULL;
    }
    rtcSetGeometryUserData(entry->geometry, &entry->surface);
    rtcAttachGeometry(entry->scene, entry->geometry);
    return entry;
}

/* Marks the entries that the scene still has; entry_of: by geometry of the scene, NULL where there is none. */
static bool find_kept(const struct reference *reference, const struct scene_gpu *scene,
                      struct reference_entry **entry_of)
{
    struct hashmap by_key = {0};
    bool ok = true;
    for (uint32_t i = 0; ok && i < reference->entry_count; i++) {
        struct reference_entry *entry = reference->entries[i];
        entry->is_wanted = false;
        ok = hashmap_put(&by_key, entry_key(entry->is_mesh, entry->id), entry);
    }
    for (uint32_t g = 0; ok && g < scene->geometry_count; g++) {
        const struct scene_gpu_geometry *geometry = &scene->geometries[g];
        struct reference_entry *entry = hashmap_get(&by_key, entry_key(geometry->mesh != NULL, geometry->id));
        if (!entry || entry->revision != geometry->revision)
            continue;
        entry->is_wanted = true;
        entry_of[g] = entry;
    }
    hashmap_finish(&by_key);
    return ok;
}

/* One entry for each geometry of the scene, in its order; those that it no longer has are gone. */
static bool list_entries(struct reference *reference, const struct scene_gpu *scene)
{
    uint32_t count = scene->geometry_count;
    struct reference_entry **entries = calloc((size_t)count + 1, sizeof(struct reference_entry *));
    bool ok = entries && find_kept(reference, scene, entries);
    for (uint32_t g = 0; ok && g < count; g++) {
        if (!entries[g])
            entries[g] = entry_create(reference->device, &scene->geometries[g]);
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

/* Embree is asked to call back only where a material wants it: opaque surfaces cost nothing. It notices a change
 * of filter functions when it builds; they change seldom. */
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
    entry->is_fresh = true;
}

static void commit_small(void *context, uint32_t i)
{
    struct reference_entry *entry = ((struct reference *)context)->entries[i];
    if (entry->is_stale && entry->primitive_count < ALONE_PRIMITIVES_MIN)
        commit_entry(entry);
}

static void commit_entries(struct reference *reference)
{
    uint32_t small_count = 0;
    uint64_t built = 0;
    for (uint32_t i = 0; i < reference->entry_count; i++) {
        struct reference_entry *entry = reference->entries[i];
        if (!entry->is_stale)
            continue;
        built += entry->primitive_count;
        if (entry->primitive_count >= ALONE_PRIMITIVES_MIN)
            commit_entry(entry);
        else
            small_count++;
    }
    if (small_count > 0)
        parallel_run(parallel_processors(), reference->entry_count, commit_small, reference);
    reference->base.stats.nodes_rebuilt += built;
}

/* ---- discs ---- */

static int by_id(const void *a, const void *b)
{
    uint32_t id_a = (*(const struct scene_disc *const *)a)->base.id;
    uint32_t id_b = (*(const struct scene_disc *const *)b)->base.id;
    return id_a < id_b ? -1 : id_a > id_b;
}

/* The materials of the discs, by their ids, in the order in which scene_gpu has the discs. */
static uint32_t *list_disc_materials(const struct scene_gpu *scene)
{
    const struct hashmap *discs = &scene->scene->objects[SCENE_DISC];
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
        materials[i] = sorted[i]->material;
    free(sorted);
    return materials;
}

static bool same_discs(const struct reference *reference, const struct scene_gpu *scene)
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

static bool make_disc_geometry(struct reference *reference, const struct scene_gpu *scene)
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

/* All discs anew where one changed: there are few. `shading`: their materials may let other light pass now. A disc
 * that has got another material differs in scene_gpu's copy too. */
static bool update_discs(struct reference *reference, const struct scene_gpu *scene, bool shading, bool *changed)
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

/* ---- instances ---- */

static bool resize_instances(struct reference *reference, uint32_t count)
{
    for (uint32_t i = count; i < reference->instance_count; i++) {
        rtcDetachGeometry(reference->top, i + 1);
        rtcReleaseGeometry(reference->instances[i].geometry);
    }
    if (count < reference->instance_count)
        reference->instance_count = count;
    struct reference_instance *instances =
        realloc(reference->instances, ((size_t)count + 1) * sizeof(*reference->instances));
    if (!instances)
        return false;
    reference->instances = instances;
    for (uint32_t i = reference->instance_count; i < count; i++) {
        instances[i] =
            (struct reference_instance){.geometry = rtcNewGeometry(reference->device, RTC_GEOMETRY_TYPE_INSTANCE)};
        if (!instances[i].geometry)
            return false;
        rtcAttachGeometryByID(reference->top, instances[i].geometry, i + 1);
        reference->instance_count = i + 1;
    }
    return true;
}

/* The greatest world coordinate that Embree can take to the instance's space. It computes with coordinates up to
 * 1.844e18 and ends the process at a ray beyond (Debian's is built with its assertions); and it inverts the
 * transform by a determinant in single precision, which must neither vanish nor overflow. 0: it cannot at all. */
static float reach_of(struct instance *instance)
{
    const float *m = instance->world_from_object[0], *inverse = instance->object_from_world[0];
    double lengths = 1.0, reach = REFERENCE_COORDINATE_MAX;
    for (size_t k = 0; k < 3; k++) {
        const double x = m[k], y = m[4 + k], z = m[8 + k];
        const double sum =
            fabs((double)inverse[4 * k]) + fabs((double)inverse[4 * k + 1]) + fabs((double)inverse[4 * k + 2]);
        lengths *= sqrt(x * x + y * y + z * z);
        reach = fmin(reach, (REFERENCE_COORDINATE_MAX - fabs((double)inverse[4 * k + 3])) / sum);
    }
    const double determinant = (double)m[0] * ((double)m[5] * m[10] - (double)m[6] * m[9]) -
                               (double)m[1] * ((double)m[4] * m[10] - (double)m[6] * m[8]) +
                               (double)m[2] * ((double)m[4] * m[9] - (double)m[5] * m[8]);
    bool inverts = fabs(determinant) > 1e-30 && lengths < 1e30 && fabs(determinant) >= 1e-5 * lengths;
    return inverts && reach >= REACH_MIN ? (float)reach : 0.0f;
}

/* Tells Embree what moved, or shows something else now. True if anything did. */
static bool place_instance(struct reference *reference, const struct scene_gpu *scene, uint32_t i)
{
    struct reference_instance *instance = &reference->instances[i];
    const struct instance *now = &scene->instances[i];
    const struct reference_entry *entry = reference->entries[now->geometry];
    bool same_entry = instance->entry == entry && !entry->is_fresh;
    bool same_place = instance->entry && memcmp(instance->world_from_object, now->world_from_object,
                                                sizeof(instance->world_from_object)) == 0;
    instance->first_primitive = scene->geometries[now->geometry].device.first_primitive;
    if (same_entry && same_place)
        return false;
    if (!same_entry)
        rtcSetGeometryInstancedScene(instance->geometry, entry->scene);
    memcpy(instance->world_from_object, now->world_from_object, sizeof(instance->world_from_object));
    rtcSetGeometryTransform(instance->geometry, 0, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, instance->world_from_object);
    rtcCommitGeometry(instance->geometry);
    instance->entry = entry;
    return true;
}

static bool find_reach(struct reference *reference, const struct scene_gpu *scene, struct error *error)
{
    reference->coordinate_max = REFERENCE_COORDINATE_MAX;
    for (uint32_t i = 0; i < scene->instance_count; i++) {
        float reach = reach_of(&scene->instances[i]);
        if (reach == 0.0f) {
            char field[64];
            snprintf(field, sizeof(field), "node %u.parent_from_node", scene->instances[i].node);
            error_set(error, ERROR_UNSUPPORTED, field,
                      "its place in the world is scaled, sheared or moved too far");
            return error_remedy(error,
                                "the tracer reference computes in single precision: choose bvh, or scale by "
                                "more than 1e-9");
        }
        reference->coordinate_max = fminf(reference->coordinate_max, reach);
    }
    /* Of what lies beyond, Embree would leave out whole instances without a word. */
    for (int k = 0; k < 3; k++) {
        const double farthest = fmax(-(double)scene->lower_world[k], (double)scene->upper_world[k]);
        if (scene->instance_count > 0 && farthest > (double)reference->coordinate_max) {
            error_set(error, ERROR_UNSUPPORTED, "tracer",
                      "reference: the scene reaches out to %g, and it sees up to %g", farthest,
                      (double)reference->coordinate_max);
            return error_remedy(error, "choose bvh, or make the scene smaller");
        }
    }
    return true;
}

/* `look`: some may have moved, or show what was built anew. */
static bool update_instances(struct reference *reference, const struct scene_gpu *scene, bool look, bool *changed,
                             struct error *error)
{
    struct tracer_stats *stats = &reference->base.stats;
    if (look && !find_reach(reference, scene, error))
        return false;
    *changed = *changed || reference->instance_count != scene->instance_count;
    if (!resize_instances(reference, scene->instance_count))
        return false;
    for (uint32_t i = 0; look && i < scene->instance_count; i++)
        *changed = place_instance(reference, scene, i) || *changed;
    if (*changed) {
        rtcCommitScene(reference->top);
        stats->nodes_rebuilt += (uint64_t)scene->instance_count + scene->disc_count;
    }
    return true;
}

/* ---- all of it ---- */

static bool update_materials(struct reference *reference, const struct scene_gpu *scene)
{
    opacity_materials_finish(&reference->materials);
    if (!opacity_materials_init(&reference->materials, scene->scene))
        return false;
    for (uint32_t i = 0; i < reference->entry_count; i++) {
        opacity_surface_bind(&reference->entries[i]->surface, &reference->materials);
        set_filters(reference->entries[i]);
    }
    return true;
}

static bool update_parts(struct reference *reference, const struct scene_gpu *scene,
                         const struct scene_changes *changes, struct error *error)
{
    bool changed = !reference->top, shading = changes->shading || changes->geometry;
    if (!reference->top)
        reference->top = new_scene(reference->device);
    if (!reference->top || (changes->geometry && !list_entries(reference, scene)) ||
        (shading && !update_materials(reference, scene)))
        return false;
    commit_entries(reference);
    return update_discs(reference, scene, shading, &changed) &&
           update_instances(reference, scene, shading || changes->instances, &changed, error);
}

bool reference_scene_update(struct reference *reference, const struct scene_gpu *scene,
                            const struct scene_changes *changes, struct error *error)
{
    struct tracer_stats *stats = &reference->base.stats;
    bool ok = update_parts(reference, scene, changes, error);
    /* What Embree says comes first: where it fails it says why. */
    if (!reference_check(reference, "building", error) || !ok)
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
    for (uint32_t i = 0; i < reference->instance_count; i++)
        rtcReleaseGeometry(reference->instances[i].geometry);
    free(reference->instances);
    reference->instances = NULL;
    reference->instance_count = 0;
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
