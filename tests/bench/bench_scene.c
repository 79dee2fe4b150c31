/* SPDX-License-Identifier: MIT */
#include "tests/bench/bench_scene.h"

#include "tests/accuracy/test_scenes.h"
#include "tests/fixtures/framing.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI_F 3.14159265f

/* ---- the family ---- */

static void bumpy_sphere(float (*vertices)[3], uint32_t *indices, uint32_t first_vertex, uint32_t steps,
                         const float centre[3])
{
    for (uint32_t i = 0; i <= steps; i++) {
        for (uint32_t j = 0; j <= steps; j++) {
            float theta = PI_F * (float)i / (float)steps, phi = 2 * PI_F * (float)j / (float)steps;
            float radius = 1 + 0.05f * sinf(17 * theta) * sinf(13 * phi);
            float *v = vertices[first_vertex + i * (steps + 1) + j];
            v[0] = centre[0] + radius * sinf(theta) * cosf(phi);
            v[1] = centre[1] + radius * cosf(theta);
            v[2] = centre[2] + radius * sinf(theta) * sinf(phi);
        }
    }
    for (uint32_t i = 0; i < steps; i++) {
        for (uint32_t j = 0; j < steps; j++, indices += 6) {
            uint32_t a = first_vertex + i * (steps + 1) + j, b = a + steps + 1;
            memcpy(indices, (uint32_t[6]){a, a + 1, b, a + 1, b + 1, b}, 6 * sizeof(*indices));
        }
    }
}

/* Nine bumpy spheres on a floor, one mesh: the tree is to be measured, not the number of instances. */
static struct scene *family_scene(uint32_t triangles)
{
    uint32_t steps = (uint32_t)lrintf(sqrtf((float)triangles / 18));
    steps = steps < 4 ? 4 : steps;
    const uint32_t each = (steps + 1) * (steps + 1), count = 18 * steps * steps + 2, last = 9 * each;
    static const float floor_corners[4][3] = {{-20, 0, -20}, {20, 0, -20}, {20, 0, 20}, {-20, 0, 20}};
    float(*vertices)[3] = malloc((last + 4) * sizeof(*vertices));
    uint32_t *indices = malloc(3 * (size_t)count * sizeof(*indices));
    struct test_edits edits = {.scene = test_scene_create()};
    if (vertices && indices && edits.scene) {
        for (uint32_t s = 0; s < 9; s++)
            bumpy_sphere(vertices, indices + (size_t)s * steps * steps * 6, s * each, steps,
                         (float[3]){2.5f * ((float)(s % 3) - 1), 1, 2.5f * ((float)(s / 3) - 1)});
        memcpy(vertices[last], floor_corners, sizeof(floor_corners));
        memcpy(indices + 3 * ((size_t)count - 2),
               (uint32_t[6]){last, last + 1, last + 2, last, last + 2, last + 3}, 6 * sizeof(*indices));
        test_mesh(&edits, 1, (const float(*)[3])vertices, last + 4, indices, count);
        test_node(&edits, 1, 0, NODE_MESH, 1, NULL);
        test_commit(&edits);
    }
    free(vertices);
    free(indices);
    return edits.scene;
}

/* ---- camera and light ---- */

/* The model's own first camera, if it has one in perspective. */
static bool own_camera(struct bench_scene *scene)
{
    const struct scene_node *node = scene_node(scene->loaded.scene, scene->loaded.camera);
    const struct scene_camera *camera = node ? scene_camera(scene->loaded.scene, node->value.object) : NULL;
    float m[12], eye[3], look_at[3], up[3];
    if (!camera || camera->value.fov_y <= 0 || !scene_world_from_node(scene->loaded.scene, NULL, node->base.id, m))
        return false;
    for (int k = 0; k < 3; k++) {
        eye[k] = m[4 * k + 3];
        look_at[k] = eye[k] - m[4 * k + 2];
        up[k] = m[4 * k + 1];
    }
    return frame_camera_look_at(&scene->camera, eye, look_at, up, camera->value.fov_y);
}

static bool choose_camera(struct bench_scene *scene, const struct bench_scene_options *options,
                          struct error *error)
{
    const float family_eye[3] = {0, 5, 9}, family_target[3] = {0, 0.7f, 0}, up[3] = {0, 1, 0};
    if (options->has_eye)
        return frame_camera_look_at(&scene->camera, options->eye, options->look_at, options->up, options->fov_y) ||
               error_set(error, ERROR_INVALID, "--eye", "eye, target and up span no view");
    if (!options->model)
        return frame_camera_look_at(&scene->camera, family_eye, family_target, up, 0.846f);
    if (!own_camera(scene))
        frame_camera_auto(&scene->camera, &usual_framing, scene->gpu.lower_world, scene->gpu.upper_world,
                          options->aspect);
    return true;
}

/* Outside of all, above on the right; but a camera within the bounds is in a room, and has its light beside it. */
static void choose_light(struct bench_scene *scene)
{
    const float *m = scene->camera.world_from_view, *lower = scene->gpu.lower_world,
                *upper = scene->gpu.upper_world, diagonal = scene->gpu.diagonal;
    bool is_inside = true;
    for (int k = 0; k < 3; k++)
        is_inside = is_inside && m[4 * k + 3] > lower[k] && m[4 * k + 3] < upper[k];
    for (int k = 0; k < 3; k++) {
        const float right = m[4 * k], above = m[4 * k + 1], back = m[4 * k + 2];
        scene->light_world[k] = is_inside
                                    ? m[4 * k + 3] + 0.03f * diagonal * (right + above)
                                    : (lower[k] + upper[k]) / 2 + diagonal * (0.4f * right + 0.8f * above + back);
    }
}

static void count_primitives(struct bench_scene *scene)
{
    for (uint32_t i = 0; i < scene->gpu.instance_count; i++) {
        const struct gpu_scene_geometry *geometry = &scene->gpu.geometries[scene->gpu.instances[i].geometry];
        *(geometry->mesh ? &scene->triangle_count : &scene->sphere_count) += geometry->device.primitive_count;
    }
}

bool bench_scene_init(struct bench_scene *scene, struct gpu_device *device,
                      const struct bench_scene_options *options, struct error *error)
{
    struct scene_changes changes;
    memset(scene, 0, sizeof(*scene));
    gpu_scene_init(&scene->gpu, device);
    if (options->model) {
        if (!load_model(&scene->loaded, options->model, error))
            return false;
    } else if (!(scene->loaded.scene = family_scene(options->family_triangles))) {
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for the scene");
    }
    if (!gpu_scene_update(&scene->gpu, scene->loaded.scene, NULL, &changes, NULL, error) ||
        !choose_camera(scene, options, error))
        return false;
    choose_light(scene);
    count_primitives(scene);
    return true;
}

void bench_scene_finish(struct bench_scene *scene)
{
    gpu_scene_finish(&scene->gpu);
    load_model_finish(&scene->loaded);
}
