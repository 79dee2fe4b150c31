/* SPDX-License-Identifier: MIT */
#include "tests/bench/bench_waves.h"

#include "tests/accuracy/test_scenes.h"

#include <math.h>

#define PI_F 3.14159265f
/* Distance from its surface at which a ray begins, as a share of the diagonal; above the rounding of distance
 * and position. */
#define OFFSET 1e-5f
#define OCCLUSION_REACH 0.1f /* share of the diagonal */
#define FAR 1e30f

const struct bench_wave_fact bench_wave_facts[BENCH_WAVE_KINDS] = {
    [BENCH_PRIMARY] = {"primary", "coherent", false, true},
    [BENCH_REFLECTION] = {"reflection", "partly", false, false},
    [BENCH_SHADOW] = {"shadow", "coherent", true, false},
    [BENCH_OCCLUSION] = {"occlusion", "incoherent", true, false},
    [BENCH_BOUNCE] = {"bounce", "incoherent", false, false},
};

/* The direction is made unit; *length is what it was. */
static void set_ray(struct ray *ray, const float origin[3], const float direction[3], float t_min, float t_max)
{
    float length = sqrtf(direction[0] * direction[0] + direction[1] * direction[1] + direction[2] * direction[2]);
    for (int k = 0; k < 3; k++) {
        ray->origin_t_min[k] = origin[k];
        ray->direction_t_max[k] = direction[k] / length;
    }
    ray->origin_t_min[3] = t_min;
    ray->direction_t_max[3] = t_max;
}

void bench_camera_rays(struct ray *rays, const struct frame_camera *camera, uint32_t width, uint32_t height)
{
    const float *m = camera->world_from_view, reach = tanf(camera->fov_y / 2);
    const float eye[3] = {m[3], m[7], m[11]};
    for (uint32_t i = 0; i < width * height; i++) {
        uint32_t tile = i / 64, in_tile = i % 64;
        uint32_t x = tile % (width / 8) * 8 + ((in_tile & 1) | (in_tile >> 1 & 2) | (in_tile >> 2 & 4));
        uint32_t y = tile / (width / 8) * 8 + ((in_tile >> 1 & 1) | (in_tile >> 2 & 2) | (in_tile >> 3 & 4));
        float u = reach * (float)width / (float)height * (2 * ((float)x + 0.5f) / (float)width - 1),
              v = -reach * (2 * ((float)y + 0.5f) / (float)height - 1);
        set_ray(&rays[i], eye,
                (float[3]){u * m[0] + v * m[1] - m[2], u * m[4] + v * m[5] - m[6], u * m[8] + v * m[9] - m[10]}, 0,
                FAR);
    }
}

static void unpack_unit(float out[3], uint32_t bits)
{
    float x = (float)(int16_t)(bits & 0xffff) / 32767, y = (float)(int16_t)(bits >> 16) / 32767;
    out[2] = 1 - fabsf(x) - fabsf(y);
    out[0] = out[2] < 0 ? (1 - fabsf(y)) * (x >= 0 ? 1.0f : -1.0f) : x;
    out[1] = out[2] < 0 ? (1 - fabsf(x)) * (y >= 0 ? 1.0f : -1.0f) : y;
    float length = sqrtf(out[0] * out[0] + out[1] * out[1] + out[2] * out[2]);
    for (int k = 0; k < 3; k++)
        out[k] /= length;
}

static void from_hit(struct ray *ray, enum bench_wave_kind kind, const struct ray *from, const struct hit *hit,
                     const struct bench_scene *scene, uint64_t *seed)
{
    const float diagonal = scene->gpu.diagonal, *d = from->direction_t_max;
    float n[3], origin[3], direction[3];
    unpack_unit(n, hit->normal_geometric);
    float cosine = n[0] * d[0] + n[1] * d[1] + n[2] * d[2], side = cosine > 0 ? -1.0f : 1.0f;
    /* A point on the unit sphere around the tip of the normal: directions in proportion to their cosine. */
    float z = test_uniform(seed, -0.999f, 0.999f), phi = test_uniform(seed, 0, 2 * PI_F), r = sqrtf(1 - z * z);
    const float on_sphere[3] = {r * cosf(phi), r * sinf(phi), z};
    for (int k = 0; k < 3; k++) {
        origin[k] = from->origin_t_min[k] + hit->distance * d[k] + OFFSET * diagonal * side * n[k];
        if (kind == BENCH_REFLECTION)
            direction[k] = d[k] - 2 * cosine * n[k];
        else if (kind == BENCH_SHADOW)
            direction[k] = scene->light_world[k] - origin[k];
        else
            direction[k] = side * n[k] * 1.001f + on_sphere[k];
    }
    float t_max = FAR;
    if (kind == BENCH_SHADOW)
        t_max = sqrtf(direction[0] * direction[0] + direction[1] * direction[1] + direction[2] * direction[2]);
    else if (kind == BENCH_OCCLUSION)
        t_max = OCCLUSION_REACH * diagonal;
    set_ray(ray, origin, direction, OFFSET * diagonal, t_max);
}

uint32_t bench_secondary_rays(struct ray *rays, enum bench_wave_kind kind, const struct ray *camera_rays,
                              const struct hit *hits, uint32_t count, uint32_t rays_each,
                              const struct bench_scene *scene)
{
    uint64_t seed = 7;
    uint32_t made = 0;
    for (uint32_t i = 0; i < count; i++)
        for (uint32_t k = 0; k < rays_each && hits[i].distance >= 0; k++)
            from_hit(&rays[made++], kind, &camera_rays[i], &hits[i], scene, &seed);
    return made;
}
