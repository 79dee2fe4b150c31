/* SPDX-License-Identifier: MIT */
#include "tests/bench/bench_eye_pass.h"

#include "gpu/program.h"
#include "shared/eye_hit.h"
#include "shared/path.h"
#include "shared/ray.h"
#include "trace/raster/view.h"

#include <epoxy/gl.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static uint32_t pixels_of(const struct bench_eye_pass *pass)
{
    return pass->uniforms.width * pass->uniforms.height;
}

bool bench_eye_pass_init(struct bench_eye_pass *pass, struct gpu_device *device, struct bench_scene *scene,
                         const struct frame_camera *camera, const struct trace_view *key, struct error *error)
{
    const float half_height = tanf(camera->fov_y / 2);
    struct raster_camera view = {
        .extent = {half_height * (float)key->width / (float)key->height, half_height},
        .width = key->width,
        .height = key->height,
    };
    memcpy(view.world_from_view, camera->world_from_view, sizeof(view.world_from_view));
    *pass = (struct bench_eye_pass){.device = device, .scene = &scene->gpu};
    raster_camera_fill(&pass->uniforms, &view);
    pass->uniforms.sample_places[0][0] = pass->uniforms.sample_places[0][1] = 0.5f;
    for (int i = 0; i < 3; i++) {
        pass->key_eye[i] = key->world_from_view[4 * i + 3];
        pass->towards[i] = -key->world_from_view[4 * i + 2];
    }
    const size_t count = pixels_of(pass);
    return gpu_buffer_upload(device, &pass->uniform_buffer, &pass->uniforms, sizeof(pass->uniforms), error) &&
           gpu_buffer_reserve(device, &pass->rays, count * sizeof(struct ray), error) &&
           gpu_buffer_reserve(device, &pass->paths, count * sizeof(struct path), error) &&
           gpu_buffer_reserve(device, &pass->sums, count * sizeof(vec4), error) &&
           gpu_buffer_reserve(device, &pass->hits, count * sizeof(struct hit), error);
}

void bench_eye_pass_finish(struct bench_eye_pass *pass)
{
    struct gpu_buffer *buffers[] = {&pass->uniform_buffer, &pass->rays, &pass->paths, &pass->sums, &pass->hits};
    for (size_t i = 0; i < sizeof(buffers) / sizeof(buffers[0]); i++)
        gpu_buffer_finish(pass->device, buffers[i]);
}

bool bench_eye_pass_is_short(const struct bench_eye_pass *pass, const struct tracer *tracer)
{
    return tracer_finds_eyes(tracer, pass->scene, &pass->uniforms);
}

static bool run_short(struct bench_eye_pass *pass, struct tracer *tracer, struct error *error)
{
    const struct eye_rays eyes = {.frame = &pass->uniforms, .slot_count = pixels_of(pass), .hits = &pass->hits};
    if (!tracer->state)
        tracer->state = trace_state_create(tracer->impl, tracer->device, &tracer->options, error);
    return tracer->state && tracer_eye_hits(tracer, pass->scene, tracer->state, &eyes, error);
}

static bool run_rays(struct bench_eye_pass *pass, struct tracer *tracer, struct error *error)
{
    const struct gpu_program_source source = {.compute = "render/primary.comp"};
    const struct gpu_program *program = gpu_program_get(pass->device, &source, error);
    const struct wave wave = {.kind = WAVE_CLOSEST,
                              .ray_count = pixels_of(pass),
                              .rays = &pass->rays,
                              .hits = &pass->hits,
                              .shared_origin = true};
    if (!program)
        return false;
    gpu_buffer_bind_storage(&pass->rays, BIND_RAYS);
    gpu_buffer_bind_storage(&pass->paths, BIND_PATHS);
    gpu_buffer_bind_storage(&pass->sums, BIND_SLICE_SUMS);
    gpu_uniform_uint(program, "slot_count", wave.ray_count);
    gpu_dispatch(pass->device, program, wave.ray_count);
    return tracer_intersect(tracer, pass->scene, &wave, error);
}

bool bench_eye_pass_run(struct bench_eye_pass *pass, struct tracer *tracer, struct error *error)
{
    gpu_scene_bind(pass->scene);
    gpu_buffer_bind_uniform(&pass->uniform_buffer, UNIFORM_FRAME);
    const bool done =
        bench_eye_pass_is_short(pass, tracer) ? run_short(pass, tracer, error) : run_rays(pass, tracer, error);
    glFinish();
    return done;
}

/* The ray's point as far along the view as the plane that it meets. */
static float distance_of(const struct bench_eye_pass *pass, const struct ray *ray, float inverse)
{
    float along = 0, ahead = 0;
    for (int i = 0; i < 3; i++) {
        along += ray->direction_t_max[i] * pass->towards[i];
        ahead += (ray->origin_t_min[i] - pass->key_eye[i]) * pass->towards[i];
    }
    return (1 / inverse - ahead) / along;
}

bool bench_eye_pass_read(struct bench_eye_pass *pass, const struct ray *rays, struct hit *answers,
                         struct error *error)
{
    const uint32_t count = pixels_of(pass);
    vec4 *found = malloc(count * sizeof(*found));
    if (!found)
        return error_set(error, ERROR_OUT_OF_MEMORY, "--size", "no memory for the answers");
    gpu_buffer_read(pass->device, &pass->hits, 0, found, count * sizeof(*found));
    for (uint32_t i = 0; i < count; i++) {
        const uint32_t bits = (uint32_t)found[i][3], layer = bits & EYE_LAYER_MASK;
        answers[i].distance = layer ? distance_of(pass, &rays[i], found[i][2]) : -1;
        answers[i].material = (bits & EYE_UNKNOWN ? HIT_UNKNOWN : 0) | layer << HIT_LAYER_SHIFT;
    }
    free(found);
    return true;
}
