/* SPDX-License-Identifier: MIT */
#include "trace/scene_gpu.h"

#include "base/clock.h"
#include "shared/bindings.h"
#include "trace/scene_gpu_state.h"

#include <epoxy/gl.h>
#include <stdlib.h>

void scene_gpu_init(struct scene_gpu *gpu, struct gpu_device *device)
{
    *gpu = (struct scene_gpu){.device = device};
}

static void finish_buffers(struct scene_gpu *gpu)
{
    struct gpu_buffer *buffers[] = {
        &gpu->triangles,   &gpu->positions, &gpu->normals,         &gpu->tangents,
        &gpu->texcoords,   &gpu->colours,   &gpu->spheres,         &gpu->materials,
        &gpu->textures,    &gpu->texels,    &gpu->instance_buffer, &gpu->geometry_buffer,
        &gpu->disc_buffer, &gpu->lights,    &gpu->texture_slots,   &gpu->sphere_materials,
    };
    for (size_t i = 0; i < sizeof(buffers) / sizeof(buffers[0]); i++)
        gpu_buffer_finish(gpu->device, buffers[i]);
    gpu_texture_finish(gpu->device, &gpu->environment);
}

void scene_gpu_finish(struct scene_gpu *gpu)
{
    if (!gpu->device)
        return;
    finish_buffers(gpu);
    if (gpu->state) {
        hashmap_finish(&gpu->state->material_indices.index_by_id);
        hashmap_finish(&gpu->state->texture_index_by_id);
        free(gpu->state->material_indices.free);
        free(gpu->state);
    }
    free(gpu->geometries);
    free(gpu->instances);
    free(gpu->discs);
    scene_gpu_init(gpu, gpu->device);
}

/* Spreads an id and a revision over 64 bits (the finaliser of splitmix64). */
static uint64_t mix(uint64_t x)
{
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
}

uint64_t scene_gpu_signature(const struct scene *scene, enum scene_object_kind kind)
{
    uint64_t signature = 0, id;
    size_t cursor = 0;
    void *value;
    while (hashmap_next(&scene->objects[kind], &cursor, &id, &value)) {
        const struct scene_object *object = value;
        signature += mix(mix(id + 1) + object->revision);
    }
    return signature;
}

static bool update_parts(struct scene_gpu *gpu, const struct scene *scene, struct scene_changes *changes,
                         struct error *error)
{
    bool fresh = !gpu->state->any_update;
    bool shading = fresh || gpu->shading_revision != scene->shading_revision;
    bool geometry = fresh || gpu->geometry_revision != scene->geometry_revision;
    bool instances = fresh || gpu->instances_revision != scene->instances_revision;
    bool lights = fresh || gpu->lights_revision != scene->lights_revision;
    if (shading && !scene_gpu_index_materials(gpu, scene, error))
        return false;
    if (shading && (!scene_gpu_upload_textures(gpu, scene, changes, error) ||
                    !scene_gpu_upload_materials(gpu, scene, changes, error)))
        return false;
    /* Always: it finds by itself whether a shape changed, and where the shapes are now. */
    if (!scene_gpu_upload_geometry(gpu, scene, changes, error))
        return false;
    if (geometry && !scene_gpu_upload_discs(gpu, scene, changes, error))
        return false;
    if ((geometry || shading) && !scene_gpu_classify_geometry(gpu, scene, changes, error))
        return false;
    if ((geometry || instances) && !scene_gpu_upload_instances(gpu, scene, changes, error))
        return false;
    /* The bounds are of geometry, instances and lights together; lights see to them last. */
    if ((geometry || instances || lights) && !scene_gpu_upload_lights(gpu, scene, changes, error))
        return false;
    return gpu_check(gpu->device, "scene upload", error);
}

bool scene_gpu_update(struct scene_gpu *gpu, const struct scene *scene, const struct scene_motion *motion,
                      struct scene_changes *changes, struct stage_times *times, struct error *error)
{
    (void)motion;
    uint64_t start_ns = clock_now_ns();
    *changes = (struct scene_changes){0};
    gpu->scene = scene;
    if (!gpu->state && !(gpu->state = calloc(1, sizeof(*gpu->state))))
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for the device's copy of a scene");
    if (gpu->state->any_update && gpu->revision == scene->revision)
        return true;
    gpu_push_group(gpu->device, "scene upload");
    bool ok = update_parts(gpu, scene, changes, error);
    gpu_pop_group(gpu->device);
    if (!ok) {
        scene_gpu_finish(gpu);
        return false;
    }
    gpu->state->any_update = true;
    gpu->revision = scene->revision;
    gpu->geometry_revision = scene->geometry_revision;
    gpu->instances_revision = scene->instances_revision;
    gpu->shading_revision = scene->shading_revision;
    gpu->lights_revision = scene->lights_revision;
    stage_times_add(times, STAGE_UPLOAD, STAGE_CPU, 0, start_ns, clock_now_ns() - start_ns);
    return true;
}

void scene_gpu_bind(struct scene_gpu *gpu)
{
    struct gpu_device *device = gpu->device;
    gpu_buffer_bind_texels(gpu->device, &gpu->instance_buffer, UNIT_INSTANCES, GL_RGBA32UI);
    gpu_buffer_bind_texels(gpu->device, &gpu->geometry_buffer, UNIT_GEOMETRIES, GL_RGBA32UI);
    gpu_buffer_bind_storage(&gpu->materials, BIND_MATERIALS);
    gpu_buffer_bind_storage(&gpu->texture_slots, BIND_TEXTURE_SLOTS);
    gpu_buffer_bind_storage(&gpu->textures, BIND_TEXTURES);
    gpu_buffer_bind_storage(&gpu->lights, BIND_LIGHTS);
    gpu_buffer_bind_storage(&gpu->disc_buffer, BIND_DISCS);
    gpu_buffer_bind_texels(device, &gpu->triangles, UNIT_TRIANGLES, GL_RGBA32UI);
    gpu_buffer_bind_texels(device, &gpu->positions, UNIT_POSITIONS, GL_RGBA32F);
    gpu_buffer_bind_texels(device, &gpu->normals, UNIT_NORMALS, GL_RGBA32F);
    gpu_buffer_bind_texels(device, &gpu->tangents, UNIT_TANGENTS, GL_R32UI);
    gpu_buffer_bind_texels(device, &gpu->texcoords, UNIT_TEXCOORDS, GL_RGBA32F);
    gpu_buffer_bind_texels(device, &gpu->colours, UNIT_COLOURS, GL_RGBA8);
    gpu_buffer_bind_texels(device, &gpu->spheres, UNIT_SPHERES, GL_RGBA32F);
    gpu_buffer_bind_texels(device, &gpu->sphere_materials, UNIT_SPHERE_MATERIALS, GL_R32UI);
    gpu_buffer_bind_texels(device, &gpu->texels, UNIT_TEXELS, GL_RGBA8);
    gpu_texture_bind(&gpu->environment, UNIT_ENVIRONMENT);
}

uint64_t scene_gpu_device_bytes(const struct scene_gpu *gpu)
{
    const struct gpu_buffer *buffers[] = {
        &gpu->triangles,   &gpu->positions, &gpu->normals,         &gpu->tangents,
        &gpu->texcoords,   &gpu->colours,   &gpu->spheres,         &gpu->materials,
        &gpu->textures,    &gpu->texels,    &gpu->instance_buffer, &gpu->geometry_buffer,
        &gpu->disc_buffer, &gpu->lights,    &gpu->texture_slots,   &gpu->sphere_materials,
    };
    uint64_t bytes = gpu->environment.size_bytes;
    for (size_t i = 0; i < sizeof(buffers) / sizeof(buffers[0]); i++)
        bytes += buffers[i]->capacity_bytes;
    return bytes;
}
