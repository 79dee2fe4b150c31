/* SPDX-License-Identifier: MIT */
/* Updates of the device's copy: the parts that a revision or a pose changes, in order. */
#include "gpu_scene/scene.h"

#include "base/clock.h"
#include "shared/bindings.h"
#include "gpu_scene/state.h"

#include <epoxy/gl.h>
#include <stdlib.h>
#include <string.h>

void gpu_scene_init(struct gpu_scene *gpu, struct gpu_device *device)
{
    *gpu = (struct gpu_scene){.device = device};
}

#define BUFFERS_MAX (13 + DEFORM_BUFFERS_MAX)

/* Lists all buffers; returns their number. */
static size_t list_buffers(struct gpu_scene *gpu, struct gpu_buffer *buffers[BUFFERS_MAX])
{
    struct gpu_buffer *own[] = {
        &gpu->triangles, &gpu->positions, &gpu->normals,          &gpu->tangents,        &gpu->texcoords,
        &gpu->colours,   &gpu->spheres,   &gpu->sphere_materials, &gpu->instance_buffer, &gpu->motion_buffer,
        &gpu->tables,    &gpu->texels,    &gpu->lights,
    };
    size_t count = sizeof(own) / sizeof(own[0]);
    memcpy(buffers, own, sizeof(own));
    if (gpu->state)
        count += gpu_scene_deform_buffers(&gpu->state->deform, buffers + count);
    return count;
}

void gpu_scene_finish(struct gpu_scene *gpu)
{
    struct gpu_buffer *buffers[BUFFERS_MAX];
    if (!gpu->device)
        return;
    if (gpu->state)
        packing_finish(gpu, &gpu->state->packing);
    size_t count = list_buffers(gpu, buffers);
    for (size_t i = 0; i < count; i++)
        gpu_buffer_finish(gpu->device, buffers[i]);
    gpu_texture_finish(gpu->device, &gpu->environment);
    if (gpu->state) {
        gpu_scene_drop_texture_packing(gpu);
        gpu_scene_deform_finish(&gpu->state->deform, gpu->device);
        emitters_finish(&gpu->state->emitters);
        hashmap_finish(&gpu->state->material_indices.index_by_id);
        hashmap_finish(&gpu->state->texture_index_by_id);
        free(gpu->state->material_indices.free);
        free(gpu->state->materials);
        free(gpu->state->texture_slots);
        free(gpu->state->textures);
        free(gpu->state->tables);
        free(gpu->state->lights);
        free(gpu->state);
    }
    gpu_scene_drop_geometries(gpu);
    free(gpu->instances);
    free(gpu->motions);
    free(gpu->discs);
    *gpu = (struct gpu_scene){.device = gpu->device, .deformed_revision = gpu->deformed_revision};
}

/* Finaliser of splitmix64. */
uint64_t gpu_scene_mix(uint64_t x)
{
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
}

uint64_t gpu_scene_signature(const struct scene *scene, enum object_kind kind)
{
    uint64_t signature = 0, id;
    size_t cursor = 0;
    void *value;
    while (hashmap_next(&scene->objects[kind], &cursor, &id, &value)) {
        const struct scene_object *object = value;
        signature += gpu_scene_mix(gpu_scene_mix(id + 1) + object->revision);
    }
    return signature;
}

bool gpu_scene_check_texels(const struct gpu_scene *gpu, uint64_t count, const char *what, struct error *error)
{
    uint64_t max = gpu->device->facts.texture_buffer_texels_max;
    return count <= max ||
           error_set(error, ERROR_LIMIT, "scene", "%llu %s; this device's texel buffers hold at most %llu",
                     (unsigned long long)count, what, (unsigned long long)max);
}

/* Kinds of objects that poses affect. */
static unsigned posed_parts(const struct scene_motion *motion)
{
    unsigned parts = 0;
    for (uint32_t p = 0; motion && p < motion->pose_count; p++) {
        const struct scene_pose *pose = &motion->poses[p];
        parts |= (pose->node_count ? POSED_NODES : 0) | (pose->morph_count ? POSED_MORPHS : 0) |
                 (pose->light_count ? POSED_LIGHTS : 0) | (pose->material_count ? POSED_MATERIALS : 0);
    }
    return parts;
}

static bool update_shading(struct gpu_scene *gpu, const struct scene *scene, const struct scene_motion *motion,
                           bool edited, struct scene_changes *changes, struct error *error)
{
    changes->bits |= edited ? CHANGED_SHADING : 0;
    return gpu_scene_pack_materials(gpu, scene, motion, changes, error);
}

/* Updates the parts. `posed`: the kinds that poses change, now or in the last update. */
static bool update_parts(struct gpu_scene *gpu, const struct scene *scene, const struct scene_motion *motion,
                         unsigned posed, struct scene_changes *changes, struct error *error)
{
    bool fresh = !gpu->state->any_update;
    bool shading_edited = fresh || gpu->shading_revision != scene->shading_revision;
    bool shading = shading_edited || (posed & POSED_MATERIALS);
    bool geometry = fresh || gpu->geometry_revision != scene->geometry_revision;
    bool nodes = fresh || gpu->instances_revision != scene->instances_revision || (posed & POSED_NODES);
    bool lights = fresh || gpu->lights_revision != scene->lights_revision || (posed & POSED_LIGHTS);
    if (shading && !update_shading(gpu, scene, motion, shading_edited, changes, error))
        return false;
    if (geometry && !gpu_scene_pack_discs(gpu, scene, changes, error))
        return false;
    if (geometry || shading || (changes->bits & CHANGED_GEOMETRY))
        gpu_scene_classify_geometry(gpu, scene, motion);
    if ((geometry || nodes || (posed & POSED_MORPHS)) && !gpu_scene_deform(gpu, scene, motion, changes, error))
        return false;
    if ((geometry || nodes) && !gpu_scene_upload_instances(gpu, scene, motion, changes, error))
        return false;
    gpu->state->stale_emitters |=
        geometry || nodes || shading || (changes->bits & (CHANGED_GEOMETRY | CHANGED_DEFORMED));
    if (!gpu_scene_upload_tables(gpu, changes, error))
        return false;
    /* Lights come last, as they complete the bounds of geometry, instances and lights together. */
    if ((geometry || nodes || lights || (changes->bits & CHANGED_DEFORMED)) &&
        !gpu_scene_upload_lights(gpu, scene, motion, changes, error))
        return false;
    return gpu_check_reset(gpu->device, "scene upload", error);
}

bool gpu_scene_is_current(const struct gpu_scene *gpu, const struct scene *scene,
                          const struct scene_motion *motion)
{
    return gpu->state && gpu->state->any_update && gpu->revision == scene->revision &&
           (posed_parts(motion) | gpu->state->posed_parts) == 0;
}

/* Materials come first: triangles are packed with their indices. */
static bool list_parts(struct gpu_scene *gpu, const struct scene *scene, struct error *error)
{
    const bool shading = !gpu->state->any_update || gpu->shading_revision != scene->shading_revision;
    return (!shading ||
            (gpu_scene_index_materials(gpu, scene, error) && gpu_scene_list_textures(gpu, scene, error))) &&
           gpu_scene_list_geometry(gpu, scene, error);
}

static bool bring(struct gpu_scene *gpu, const struct scene *scene, uint64_t end_ns, bool *done,
                  struct error *error)
{
    struct gpu_scene_state *state = gpu->state;
    if (!state->is_bringing && !list_parts(gpu, scene, error))
        return false;
    state->is_bringing = true;
    switch (packing_step(gpu, &state->packing, end_ns, error)) {
    case PACKING_MORE:
        return true;
    case PACKING_FAILED:
        return false;
    case PACKING_DONE:
        break;
    }
    *done = true;
    state->is_bringing = false;
    state->has_brought = true;
    state->brought_revision = scene->revision;
    state->brought.uploaded_bytes += packing_bytes(&state->packing);
    packing_finish(gpu, &state->packing);
    return gpu_scene_finish_textures(gpu, error);
}

static bool is_brought(const struct gpu_scene *gpu, const struct scene *scene)
{
    const struct gpu_scene_state *state = gpu->state;
    return state && ((state->any_update && gpu->revision == scene->revision) ||
                     (state->has_brought && state->brought_revision == scene->revision));
}

bool gpu_scene_bring(struct gpu_scene *gpu, const struct scene *scene, uint64_t end_ns, bool *done,
                     struct stage_times *times, struct error *error)
{
    struct error failed = {0};
    const uint64_t start_ns = clock_now_ns();
    *done = is_brought(gpu, scene);
    if (*done)
        return true;
    if (!gpu->state && !(gpu->state = calloc(1, sizeof(*gpu->state))))
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for the device's copy of a scene");
    gpu->scene = scene;
    gpu_push_group(gpu->device, "scene upload");
    bool ok = bring(gpu, scene, end_ns, done, &failed);
    gpu_pop_group(gpu->device);
    if (times)
        stage_times_add(times, STAGE_UPLOAD, CLOCK_CPU, 0, start_ns, clock_now_ns() - start_ns);
    if (ok)
        return true;
    if (failed.kind != ERROR_BUSY)
        gpu_scene_finish(gpu);
    if (error)
        *error = failed;
    return false;
}

bool gpu_scene_bring_waits(struct gpu_scene *gpu)
{
    return gpu->state && packing_waits(&gpu->state->packing);
}

void gpu_scene_bring_abandon(struct gpu_scene *gpu)
{
    if (gpu->state && gpu->state->is_bringing)
        gpu_scene_finish(gpu);
}

static bool bring_all(struct gpu_scene *gpu, const struct scene *scene, struct error *error)
{
    bool done = false;
    while (!done && gpu_scene_bring(gpu, scene, UINT64_MAX, &done, NULL, error))
        ;
    return done;
}

bool gpu_scene_update(struct gpu_scene *gpu, const struct scene *scene, const struct scene_motion *motion,
                      struct scene_changes *changes, struct stage_times *times, struct error *error)
{
    uint64_t start_ns = clock_now_ns();
    if (motion && motion->pose_count == 0)
        motion = NULL;
    unsigned parts = posed_parts(motion);
    *changes = (struct scene_changes){0};
    gpu->scene = scene;
    gpu->motion = motion;
    if (gpu_scene_is_current(gpu, scene, motion))
        return true;
    if (!bring_all(gpu, scene, error))
        return false;
    *changes = gpu->state->brought;
    gpu->state->brought = (struct scene_changes){0};
    gpu->state->has_brought = false;
    unsigned posed = parts | gpu->state->posed_parts;
    gpu_push_group(gpu->device, "scene upload");
    bool ok = update_parts(gpu, scene, motion, posed, changes, error);
    gpu_pop_group(gpu->device);
    if (!ok) {
        gpu_scene_finish(gpu);
        return false;
    }
    gpu->has_motion = gpu->motion_count > 0 || gpu_scene_any_closes(gpu);
    gpu->state->any_update = true;
    gpu->state->posed_parts = parts;
    gpu->revision = scene->revision;
    gpu->geometry_revision = scene->geometry_revision;
    gpu->instances_revision = scene->instances_revision;
    gpu->shading_revision = scene->shading_revision;
    gpu->lights_revision = scene->lights_revision;
    stage_times_add(times, STAGE_UPLOAD, CLOCK_CPU, 0, start_ns, clock_now_ns() - start_ns);
    return true;
}

bool gpu_scene_emitters_are_current(const struct gpu_scene *gpu)
{
    return gpu->state && !gpu->state->stale_emitters;
}

bool gpu_scene_update_emitters(struct gpu_scene *gpu, struct scene_changes *changes, struct stage_times *times,
                               struct error *error)
{
    uint64_t start_ns = clock_now_ns();
    if (gpu_scene_emitters_are_current(gpu))
        return true;
    if (!gpu_scene_make_emitters(gpu, error) || !gpu_scene_upload_tables(gpu, changes, error)) {
        gpu_scene_finish(gpu);
        return false;
    }
    gpu->state->stale_emitters = false;
    stage_times_add(times, STAGE_UPLOAD, CLOCK_CPU, 0, start_ns, clock_now_ns() - start_ns);
    return true;
}

void gpu_scene_bind(struct gpu_scene *gpu)
{
    struct gpu_device *device = gpu->device;
    gpu_buffer_bind_texels(gpu->device, &gpu->instance_buffer, UNIT_INSTANCES, GL_RGBA32UI);
    gpu_buffer_bind_texels(gpu->device, &gpu->motion_buffer, UNIT_MOTIONS, GL_RGBA32F);
    gpu_buffer_bind_texels(gpu->device, &gpu->tables, UNIT_TABLES, GL_RGBA32UI);
    gpu_buffer_bind_texels(device, &gpu->triangles, UNIT_TRIANGLES, GL_RGBA32UI);
    gpu_buffer_bind_texels(device, &gpu->positions, UNIT_POSITIONS, GL_RGBA32F);
    gpu_buffer_bind_texels(device, &gpu->normals, UNIT_NORMALS, GL_RGBA32F);
    gpu_buffer_bind_texels(device, &gpu->tangents, UNIT_TANGENTS, GL_R32UI);
    gpu_buffer_bind_texels(device, &gpu->texcoords, UNIT_TEXCOORDS, GL_RGBA32F);
    gpu_buffer_bind_texels(device, &gpu->colours, UNIT_COLOURS, GL_RGBA16);
    gpu_buffer_bind_texels(device, &gpu->spheres, UNIT_SPHERES, GL_RGBA32F);
    gpu_buffer_bind_texels(device, &gpu->sphere_materials, UNIT_SPHERE_MATERIALS, GL_R32UI);
    gpu_buffer_bind_texels(device, &gpu->texels, UNIT_TEXELS, GL_RGBA8);
    gpu_texture_bind(&gpu->environment, UNIT_ENVIRONMENT);
}

uint64_t gpu_scene_device_bytes(const struct gpu_scene *gpu)
{
    struct gpu_scene copy = *gpu; /* allows the same list for callers that change the buffers */
    struct gpu_buffer *buffers[BUFFERS_MAX];
    size_t count = list_buffers(&copy, buffers);
    uint64_t bytes = gpu->environment.size_bytes;
    for (size_t i = 0; i < count; i++)
        bytes += buffers[i]->capacity_bytes;
    return bytes;
}
