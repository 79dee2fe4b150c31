/* SPDX-License-Identifier: MIT */
/* Uploads lights and environment, and adds the lights to the bounds of the scene. */
#include "gpu_scene/state.h"

#include "base/clock.h"
#include "scene/affine.h"
#include "shared/light.h"

#include <epoxy/gl.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define ENVIRONMENT_TEXEL_BYTES 8
#define ENVIRONMENT_STRIP_BYTES ((size_t)1 << 20)

static const int device_kinds[] = {
    [LIGHT_POINT] = LIGHT_KIND_POINT,
    [LIGHT_SPOT] = LIGHT_KIND_SPOT,
    [LIGHT_DIRECTIONAL] = LIGHT_KIND_DIRECTIONAL,
    [LIGHT_RECTANGLE] = LIGHT_KIND_RECTANGLE,
    [LIGHT_SPHERE] = LIGHT_KIND_SPHERE,
    [LIGHT_STEADY] = LIGHT_KIND_STEADY,
};

static float length3(const float v[3])
{
    return sqrtf(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

/* Scale of a sphere's radius: the mean of a non-uniform scale, as a sphere stays a sphere. */
static float mean_scale(const float m[12])
{
    double a = (double)m[0] * ((double)m[5] * m[10] - (double)m[6] * m[9]);
    double b = (double)m[1] * ((double)m[4] * m[10] - (double)m[6] * m[8]);
    double c = (double)m[2] * ((double)m[4] * m[9] - (double)m[5] * m[8]);
    return (float)cbrt(fabs(a - b + c));
}

/* Packs a light. False: the transform leaves it no direction, or no size. */
static bool pack_light(const struct scene_light *in, const float world_from_light[12], struct light *out)
{
    const float forward[3] = {0.0f, 0.0f, -1.0f};
    const float half_u[3] = {0.5f * in->value.size[0], 0.0f, 0.0f},
                half_v[3] = {0.0f, 0.5f * in->value.size[1], 0.0f};
    float direction[3];
    *out = (struct light){
        .position_kind = {world_from_light[3], world_from_light[7], world_from_light[11],
                          (float)device_kinds[in->value.kind]},
        .colour = {in->value.colour[0], in->value.colour[1], in->value.colour[2], 0.0f},
    };
    affine_vector(direction, world_from_light, forward);
    float length = length3(direction);
    bool needs_direction =
        in->value.kind == LIGHT_SPOT || in->value.kind == LIGHT_DIRECTIONAL || in->value.kind == LIGHT_RECTANGLE;
    if (needs_direction && !(length > 0.0f && isfinite(length)))
        return false;
    for (int k = 0; k < 3; k++)
        out->direction_range[k] = length > 0.0f ? direction[k] / length : forward[k];
    out->direction_range[3] = in->value.range;
    if (in->value.kind == LIGHT_SPHERE)
        out->colour[3] = in->value.size[0] * mean_scale(world_from_light);
    if (in->value.kind == LIGHT_RECTANGLE) {
        affine_vector(out->half_u_inner, world_from_light, half_u);
        affine_vector(out->half_v_outer, world_from_light, half_v);
    }
    if (in->value.kind == LIGHT_SPOT) {
        out->half_u_inner[3] = cosf(in->value.inner_cone);
        out->half_v_outer[3] = cosf(in->value.outer_cone);
    }
    return true;
}

static bool pack_lights(struct gpu_scene *gpu, const struct scene *scene, const struct scene_pose *pose,
                        struct light **packed, struct error *error)
{
    struct scene_instance *list = NULL;
    size_t count = 0;
    *packed = NULL;
    if (scene->objects[OBJECT_LIGHT].count == 0 || scene_flatten(scene, pose, NODE_LIGHT, &list, &count))
        *packed = calloc(count + 1, sizeof(**packed));
    gpu->light_count = 0;
    for (size_t i = 0; *packed && i < count; i++) {
        const struct scene_light *light = scene_light(scene, list[i].node->value.object);
        if (light &&
            pack_light(scene_pose_light(pose, light), list[i].world_from_object, *packed + gpu->light_count))
            (*packed)[gpu->light_count++].position_kind[3] += (float)list[i].light_group / LIGHT_GROUPS_MAX;
    }
    free(list);
    return *packed || error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for the lights of a scene");
}

/* Notes the environment without its image, which gpu_scene_upload_environment() uploads. */
static void note_environment(struct gpu_scene *gpu, const struct scene *scene, struct scene_changes *changes)
{
    const struct scene_environment *environment = &scene->environment;
    if (gpu->state->any_update && gpu->state->environment_revision == environment->revision)
        return;
    memcpy(gpu->environment_colour, environment->value.colour, sizeof(gpu->environment_colour));
    gpu->environment_rotation = environment->value.rotation;
    gpu->has_environment_image = environment->texels != NULL;
    changes->bits |= CHANGED_LIGHTS;
    gpu->state->environment_rows = 0;
    if (gpu->has_environment_image)
        changes->uploaded_bytes +=
            (uint64_t)environment->value.width * environment->value.height * ENVIRONMENT_TEXEL_BYTES;
    else
        gpu_texture_finish(gpu->device, &gpu->environment);
    gpu->state->environment_revision = environment->revision;
}

bool gpu_scene_upload_environment(struct gpu_scene *gpu, uint64_t end_ns, bool *done, struct error *error)
{
    const struct scene_environment *environment = &gpu->scene->environment;
    uint32_t *row = &gpu->state->environment_rows;
    *done = !gpu->has_environment_image || *row == environment->value.height;
    if (*done)
        return true;
    if (!gpu_texture_reserve(gpu->device, &gpu->environment, GL_RGBA16F, environment->value.width,
                             environment->value.height, error))
        return false;
    glTextureParameteri(gpu->environment.name, GL_TEXTURE_WRAP_S, GL_REPEAT); /* columns wrap */
    const size_t row_bytes = (size_t)environment->value.width * ENVIRONMENT_TEXEL_BYTES;
    const uint32_t strip =
        ENVIRONMENT_STRIP_BYTES / row_bytes ? (uint32_t)(ENVIRONMENT_STRIP_BYTES / row_bytes) : 1;
    while (*row < environment->value.height) {
        uint32_t left = environment->value.height - *row, rows = left < strip ? left : strip;
        gpu_texture_write_rows(&gpu->environment, GL_RGBA, GL_HALF_FLOAT, *row, rows,
                               environment->texels->data + *row * row_bytes);
        *row += rows;
        if (clock_now_ns() >= end_ns)
            break;
    }
    *done = *row == environment->value.height;
    return true;
}

static void grow(struct gpu_scene *gpu, const float point[3], float radius)
{
    for (int k = 0; k < 3; k++) {
        gpu->lower_world[k] = fminf(gpu->lower_world[k], point[k] - radius);
        gpu->upper_world[k] = fmaxf(gpu->upper_world[k], point[k] + radius);
    }
}

static void find_bounds(struct gpu_scene *gpu, const struct light *lights)
{
    gpu_scene_all_instance_bounds(gpu, gpu->lower_world, gpu->upper_world);
    for (uint32_t i = 0; i < gpu->light_count; i++) {
        float radius = lights[i].colour[3] + length3(lights[i].half_u_inner) + length3(lights[i].half_v_outer);
        if ((int)lights[i].position_kind[3] != LIGHT_KIND_DIRECTIONAL)
            grow(gpu, lights[i].position_kind, radius);
    }
    for (uint32_t i = 0; gpu->lower_world[0] > gpu->upper_world[0] && i < gpu->disc_count; i++)
        grow(gpu, gpu->discs[i].centre_radius, gpu->discs[i].centre_radius[3]);
    float size[3] = {0};
    for (int k = 0; k < 3; k++) {
        if (gpu->lower_world[k] > gpu->upper_world[k]) /* the bounds are empty */
            gpu->lower_world[k] = gpu->upper_world[k] = 0.0f;
        size[k] = gpu->upper_world[k] - gpu->lower_world[k];
    }
    gpu->diagonal = length3(size);
}

bool gpu_scene_upload_lights(struct gpu_scene *gpu, const struct scene *scene, const struct scene_motion *motion,
                             struct scene_changes *changes, struct error *error)
{
    uint32_t count_before = gpu->light_count;
    struct light *packed;
    note_environment(gpu, scene, changes);
    if (!pack_lights(gpu, scene, motion ? &motion->poses[0] : NULL, &packed, error))
        return false;
    if (!gpu_scene_check_texels(gpu, (uint64_t)gpu->light_count * LIGHT_TEXELS, "texels of lights", error)) {
        free(packed);
        return false;
    }
    find_bounds(gpu, packed);
    size_t bytes = gpu->light_count * sizeof(*packed);
    /* The lights may be the same also after a change of geometry alone. */
    bool same = gpu->state->any_update && gpu->light_count == count_before &&
                memcmp(packed, gpu->state->lights, bytes) == 0;
    if (!gpu->state->any_update || gpu->lights_revision != scene->lights_revision)
        changes->bits |= CHANGED_LIGHTS;
    free(gpu->state->lights);
    gpu->state->lights = packed;
    if (same)
        return true;
    changes->bits |= CHANGED_LIGHTS;
    changes->uploaded_bytes += bytes;
    return gpu_buffer_upload(gpu->device, &gpu->lights, packed, bytes, error);
}
