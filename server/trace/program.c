/* SPDX-License-Identifier: MIT */
/* Programs of waves and surfaces: their defines, bindings and dispatches. */
#include "trace/program.h"

#include "shared/bindings.h"
#include "shared/wave.h"

#include <epoxy/gl.h>
#include <stddef.h>
#include <stdio.h>

#define OWN_DEFINES_MAX 12
#define SURFACE_DEFINES_MAX (TRACE_SURFACE_DEFINES + 1)

/* At time 0 rays meet the first pose, and so they do in a program without motion. */
bool trace_has_motion(const struct gpu_scene *scene, const struct wave *wave)
{
    return scene->has_motion && wave->times;
}

void trace_bind_rays(const struct gpu_scene *scene, const struct wave *wave)
{
    gpu_buffer_bind_texels(scene->device, wave->rays, UNIT_RAYS, GL_RGBA32F);
    if (trace_has_motion(scene, wave))
        gpu_buffer_bind_texels(scene->device, wave->times, UNIT_RAY_TIMES, GL_R32F);
}

/* Dispatches rays first .. end - 1, `rays_an_invocation` to an invocation. */
static void dispatch_rays(const struct gpu_program *program, const struct gpu_scene *scene,
                          const struct wave *wave, uint32_t first, uint32_t end, uint32_t rays_an_invocation)
{
    gpu_uniform_uint(program, "first_ray", first);
    gpu_uniform_uint(program, "ray_count", end);
    if (wave->counts) {
        gpu_buffer_bind_storage(wave->counts, BIND_WAVE);
        gpu_uniform_uint(program, "counts_index", wave->counts_index);
    }
    if (wave->counts && first == 0 && end == wave->ray_count)
        gpu_dispatch_indirect(program, wave->counts,
                              wave->counts_index * sizeof(struct wave_counts) +
                                  offsetof(struct wave_counts, groups_x));
    else
        gpu_dispatch(scene->device, program,
                     ((uint64_t)(end - first) + rays_an_invocation - 1) / rays_an_invocation);
}

size_t trace_wave_defines(const struct gpu_scene *scene, const struct wave *wave, struct gpu_define *defines)
{
    size_t n = 0;
    if (wave->kind == WAVE_ANY)
        defines[n++] = (struct gpu_define){"ANY_HIT", "1"};
    if (scene->has_spheres)
        defines[n++] = (struct gpu_define){"HAS_SPHERES", "1"};
    if (scene->disc_count > 0)
        defines[n++] = (struct gpu_define){"HAS_DISCS", "1"};
    if (scene->has_cutout)
        defines[n++] = (struct gpu_define){"HAS_CUTOUT", "1"};
    if (trace_has_motion(scene, wave))
        defines[n++] = (struct gpu_define){"HAS_MOTION", "1"};
    if (wave->counts)
        defines[n++] = (struct gpu_define){"HAS_COUNTS", "1"};
    /* A closest hit on a translucent surface is a hit like any other, and needs no second program. */
    if (scene->has_translucent && wave->kind == WAVE_ANY)
        defines[n++] = (struct gpu_define){"HAS_TRANSLUCENT", "1"};
    if (scene->has_transmission && wave->kind == WAVE_ANY)
        defines[n++] = (struct gpu_define){"HAS_TRANSMISSION", "1"};
    if (!scene->has_varied_alpha)
        defines[n++] = (struct gpu_define){"EVEN_ALPHA", "1"};
    return n;
}

const struct gpu_program *trace_program_get(const struct gpu_scene *scene, const struct wave *wave,
                                            const struct trace_program_source *source, struct error *error)
{
    struct gpu_define defines[TRACE_WAVE_DEFINES + OWN_DEFINES_MAX + 4] = {0};
    char traverse[128], packet_rays[16];
    size_t n = trace_wave_defines(scene, wave, defines);
    /* The quotes stay in the value: program.c reads the file to include from it. */
    snprintf(traverse, sizeof(traverse), "\"%s\"", source->traverse);
    snprintf(packet_rays, sizeof(packet_rays), "%u", source->packet_rays ? source->packet_rays : 1);
    defines[n++] = (struct gpu_define){"TRAVERSE", traverse};
    defines[n++] = (struct gpu_define){"PACKET_RAYS", packet_rays};
    for (size_t i = 0; i < OWN_DEFINES_MAX && source->defines && source->defines[i].name; i++)
        defines[n++] = source->defines[i];
    struct gpu_program_source whole = {.compute = "trace/wave.comp", .defines = defines};
    return gpu_program_get(scene->device, &whole, error);
}

uint32_t trace_rays_a_dispatch(const struct gpu_device *device, uint64_t rounds_of_a_ray)
{
    if (device->facts.dispatch_rounds_max == 0)
        return 0;
    const uint64_t fitting =
        device->facts.dispatch_rounds_max / (rounds_of_a_ray + 1) / TRACE_RAYS_MULTIPLE * TRACE_RAYS_MULTIPLE;
    const uint64_t some = fitting < TRACE_DISPATCH_RAYS_MAX ? fitting : TRACE_DISPATCH_RAYS_MAX;
    return some > TRACE_RAYS_MULTIPLE ? (uint32_t)some : TRACE_RAYS_MULTIPLE;
}

void trace_program_run(const struct gpu_program *program, const struct gpu_scene *scene,
                       const struct ray_range *rays, const struct trace_program_source *source)
{
    const struct wave *wave = rays->wave;
    const uint32_t rays_an_invocation = source->packet_rays ? source->packet_rays : 1;
    trace_bind_rays(scene, wave);
    if (wave->kind == WAVE_ANY)
        gpu_buffer_bind_storage(wave->visibility, BIND_VISIBILITY);
    else
        gpu_buffer_bind_image(scene->device, wave->hits, IMAGE_HITS, GL_RGBA32UI);
    gpu_uniform_uint(program, "disc_count", scene->disc_count);
    gpu_uniform_uint(program, "instance_count", scene->instance_count);
    const bool is_whole = wave->counts && source->rays_a_dispatch >= TRACE_DISPATCH_RAYS_MAX;
    for (uint32_t first = rays->first, part; first < rays->end; first += part) {
        part = rays->end - first;
        if (source->rays_a_dispatch && source->rays_a_dispatch < part && !is_whole)
            part = source->rays_a_dispatch;
        dispatch_rays(program, scene, wave, first, first + part, rays_an_invocation);
        if (first + part < rays->end) /* makes the driver submit it: drivers may gather commands into one batch */
            glFlush();
    }
}

/* ---- surfaces ---- */

const struct gpu_program *trace_surface_program_get(const struct gpu_scene *scene, const struct wave *wave,
                                                    const char *compute, const struct gpu_define *defines,
                                                    struct error *error)
{
    struct gpu_define all[SURFACE_DEFINES_MAX + 2] = {0};
    size_t n = 0;
    for (; n < SURFACE_DEFINES_MAX && defines && defines[n].name; n++)
        all[n] = defines[n];
    if (wave->counts)
        all[n++] = (struct gpu_define){"HAS_COUNTS", "1"};
    return gpu_program_get(scene->device, &(struct gpu_program_source){.compute = compute, .defines = all}, error);
}

void trace_surface_program_run(const struct gpu_program *program, const struct gpu_scene *scene,
                               const struct ray_range *rays)
{
    trace_bind_rays(scene, rays->wave);
    gpu_buffer_bind_image(scene->device, rays->wave->hits, IMAGE_HITS, GL_RGBA32UI);
    dispatch_rays(program, scene, rays->wave, rays->first, rays->end, 1);
}

size_t trace_surface_defines(const struct gpu_scene *scene, struct gpu_define *defines)
{
    size_t n = 0;
    if (scene->has_spheres)
        defines[n++] = (struct gpu_define){"HAS_SPHERES", "1"};
    if (scene->disc_count == 0)
        defines[n++] = (struct gpu_define){"NO_DISCS", "1"};
    if (!scene->has_texcoords)
        defines[n++] = (struct gpu_define){"NO_TEXCOORDS", "1"};
    if (!scene->has_colours)
        defines[n++] = (struct gpu_define){"NO_COLOURS", "1"};
    if (!scene->has_tangents)
        defines[n++] = (struct gpu_define){"NO_TANGENTS", "1"};
    return n;
}

bool trace_surfaces(const struct gpu_scene *scene, const struct ray_range *rays, struct error *error)
{
    struct gpu_define defines[TRACE_SURFACE_DEFINES + 2] = {0};
    size_t n = trace_surface_defines(scene, defines);
    if (trace_has_motion(scene, rays->wave))
        defines[n++] = (struct gpu_define){"HAS_MOTION", "1"};
    const struct gpu_program *program =
        trace_surface_program_get(scene, rays->wave, "trace/surface.comp", defines, error);
    if (program)
        trace_surface_program_run(program, scene, rays);
    return program != NULL;
}
