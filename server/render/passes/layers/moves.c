/* SPDX-License-Identifier: MIT */
/* Poses of the frames beside the one that is rendered, worked out on the host. */
#include "render/passes/layers/moves.h"

#include "render/context/camera.h"
#include "shared/layers.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- instances ---- */

/* The visible instances of one kind in a pose, by node ids. */
struct flat {
    struct scene_instance *list; /* owned */
    size_t count;
};

static int by_node(const void *key, const void *element)
{
    const uint32_t id = *(const uint32_t *)key, other = ((const struct scene_instance *)element)->node->base.id;
    return (id > other) - (id < other);
}

/* An instance that the other frame does not show stands still. */
static void copy_matrix(vec4 rows[3], const struct flat *flat, const struct instance *instance)
{
    const struct scene_instance *found =
        flat->count ? bsearch(&instance->node, flat->list, flat->count, sizeof(*flat->list), by_node) : NULL;
    memcpy(rows, found ? found->world_from_object : &instance->world_from_object[0][0], 12 * sizeof(float));
}

static bool place_instances(struct move *made, const struct gpu_scene *gpu, const struct scene_pose *pose,
                            bool is_later)
{
    struct flat meshes = {0}, sets = {0};
    const bool flat = scene_flatten(gpu->scene, pose, NODE_MESH, &meshes.list, &meshes.count) &&
                      scene_flatten(gpu->scene, pose, NODE_SPHERES, &sets.list, &sets.count);
    for (uint32_t i = 0; flat && i < gpu->instance_count; i++) {
        const struct instance *instance = &gpu->instances[i];
        copy_matrix(is_later ? made[i].later : made[i].earlier,
                    gpu->geometries[instance->geometry].spheres ? &sets : &meshes, instance);
    }
    free(meshes.list);
    free(sets.list);
    return flat;
}

/* ---- vertices ---- */

/* The vertices of an instance's geometry, where that deforms. */
static size_t deforming_vertices(const struct gpu_scene *gpu, const struct instance *instance)
{
    const struct gpu_scene_geometry *geometry = &gpu->geometries[instance->geometry];
    return geometry->node ? geometry->device.vertex_count : 0;
}

static bool place_vertices(struct move *made, float (*vertices)[3], const struct gpu_scene *gpu,
                           const struct scene_motion *motion, struct error *error)
{
    size_t first = 0;
    for (uint32_t i = 0; i < gpu->instance_count; i++) {
        const size_t count = deforming_vertices(gpu, &gpu->instances[i]);
        const struct scene_node *node = count ? scene_node(gpu->scene, gpu->instances[i].node) : NULL;
        if (!node)
            continue;
        if (!scene_deform(gpu->scene, &motion->earlier, node, vertices[first], NULL, error) ||
            !scene_deform(gpu->scene, &motion->later, node, vertices[first + count], NULL, error))
            return false;
        made[i].first_vertex = (uint32_t)first + 1;
        first += 2 * count;
    }
    return true;
}

/* ---- all of it ---- */

static bool check_size(const struct gpu_scene *gpu, size_t bytes, struct error *error)
{
    if (bytes <= gpu->device->facts.storage_block_bytes_max)
        return true;
    error_set(error, ERROR_LIMIT, "layers",
              "the motion of all instances and vertices takes %zu bytes, a buffer of the device has at most %llu",
              bytes, (unsigned long long)gpu->device->facts.storage_block_bytes_max);
    return error_remedy(error, "leave out the layer motion");
}

static bool make(struct moves *moves, struct move *made, float (*vertices)[3], size_t vertex_count,
                 const struct gpu_scene *gpu, const struct scene_motion *motion, struct error *error)
{
    if (!place_instances(made, gpu, &motion->earlier, false) || !place_instances(made, gpu, &motion->later, true))
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for the motion of %u instances",
                         gpu->instance_count);
    return place_vertices(made, vertices, gpu, motion, error) &&
           gpu_buffer_upload(gpu->device, &moves->instances, made, gpu->instance_count * sizeof(*made), error) &&
           gpu_buffer_upload(gpu->device, &moves->vertices, vertices, vertex_count * sizeof(*vertices), error);
}

bool moves_find(struct moves *moves, const struct gpu_scene *gpu, const struct scene_motion *motion,
                struct error *error)
{
    moves->has_any = motion && motion->has_neighbours && gpu->instance_count > 0;
    if (!moves->has_any)
        return true;
    size_t vertex_count = 0;
    for (uint32_t i = 0; i < gpu->instance_count; i++)
        vertex_count += 2 * deforming_vertices(gpu, &gpu->instances[i]);
    if (!check_size(gpu, gpu->instance_count * sizeof(struct move), error) ||
        !check_size(gpu, vertex_count * sizeof(float[3]), error))
        return false;
    struct move *made = calloc(gpu->instance_count, sizeof(*made));
    float(*vertices)[3] = malloc((vertex_count + 1) * sizeof(*vertices));
    const bool found = made && vertices ? make(moves, made, vertices, vertex_count, gpu, motion, error)
                                        : error_set(error, ERROR_OUT_OF_MEMORY, NULL,
                                                    "no memory for the motion of %zu vertices", vertex_count);
    free(made);
    free(vertices);
    return found;
}

/* ---- cameras ---- */

static void set_rows(const struct gpu_program *program, uint32_t first, const struct frame_camera *camera)
{
    for (uint32_t row = 0; row < 3; row++) {
        char name[32];
        snprintf(name, sizeof(name), "world_from_views[%u]", first + row);
        gpu_uniform_vec(program, name, 4, &camera->world_from_view[4 * row]);
    }
}

void moves_bind(const struct moves *moves, const struct frame_request *request, const struct gpu_program *program)
{
    const struct frame_camera *now = &request->camera;
    const struct frame_camera *cameras[3] = {now, now, now};
    const bool is_orthographic = now->fov_y == 0.0f;
    uint32_t width, height;
    float pixels_a_metre[4] = {0};
    frame_view_size(request, &width, &height);
    if (request->has_neighbours) {
        cameras[0] = &request->camera_earlier;
        cameras[2] = &request->camera_later;
    }
    for (uint32_t i = 0; i < 3; i++) {
        const float fov_y = cameras[i]->fov_y;
        set_rows(program, 3 * i, cameras[i]);
        pixels_a_metre[i] = (float)height / (fov_y > 0.0f ? 2.0f * tanf(fov_y / 2.0f) : cameras[i]->ortho_height);
    }
    gpu_uniform_vec(program, "pixels_a_metre", 4, pixels_a_metre);
    gpu_uniform_uint(program, "is_orthographic", is_orthographic);
    gpu_uniform_uint(program, "has_moves", moves->has_any);
    gpu_buffer_bind_storage(&moves->instances, BIND_MOVES);
    gpu_buffer_bind_storage(&moves->vertices, BIND_MOVED_VERTICES);
}

uint64_t moves_device_bytes(const struct moves *moves)
{
    return moves->instances.capacity_bytes + moves->vertices.capacity_bytes;
}

void moves_finish(struct moves *moves, struct gpu_device *device)
{
    gpu_buffer_finish(device, &moves->instances);
    gpu_buffer_finish(device, &moves->vertices);
    *moves = (struct moves){0};
}
