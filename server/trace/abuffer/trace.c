/* SPDX-License-Identifier: MIT */
/* Passes of the tracer `abuffer` over a wave: intersections, then surfaces. */
#include "trace/abuffer/trace.h"

#include "gpu/program.h"
#include "shared/bindings.h"
#include "trace/abuffer/voxels.h"
#include "trace/program.h"

#include <epoxy/gl.h>

/* Rounds to bisect a column to a depth, and to scan the samples before it. */
#define SCAN_ROUNDS 36

bool abuffer_surfaces(struct abuffer_store *store, const struct gpu_scene *scene, const struct ray_range *rays,
                      struct error *error)
{
    struct gpu_define defines[3] = {0};
    size_t n = 0;
    if (scene->has_spheres)
        defines[n++] = (struct gpu_define){"HAS_SPHERES", "1"};
    if (scene->disc_count > 0)
        defines[n++] = (struct gpu_define){"HAS_DISCS", "1"};
    const struct gpu_program *program =
        trace_surface_program_get(scene, rays->wave, "abuffer/surface.comp", defines, error);
    if (!program)
        return false;
    gpu_uniform_int(program, "abuffer_drawn_count", (int32_t)store->drawn_count);
    gpu_buffer_bind_texels(store->device, &store->drawn, UNIT_TRACER_4, GL_RGBA32UI);
    trace_surface_program_run(program, scene, rays);
    return true;
}

/* With N texels and V voxels along a side, and D samples in the longest list: a ray passes 12 V parts of voxels,
 * and with the voxels and blocks 16 V. In each part and image it begins with the texel where it enters, and passes
 * 2 N texels of each image on its way. Two samples of a column are one round; by parity all samples of a column
 * are visited where a surface is passed. Each part adds two rounds: one for what it collects for a shadow ray, one
 * for the search itself (abuffer/exact.glsl). */
/* Maximum of rounds of the traversal's loops that a ray can take. */
static uint64_t abuffer_rounds_of_a_ray(const struct abuffer_store *store)
{
    const uint64_t parts = 12 * (uint64_t)store->voxels_along;
    const uint64_t columns = 3 * (2 * (uint64_t)store->resolution + parts);
    return 3 * parts + parts / 3 + columns * (SCAN_ROUNDS + store->depth_max * 3 / 2);
}

bool abuffer_intersect(struct abuffer_store *store, struct gpu_scene *scene, const struct ray_range *rays,
                       const struct tracer_options *options, struct error *error)
{
    struct gpu_define defines[3] = {0};
    size_t n = 0;
    if (store->resolution == 0)
        defines[n++] = (struct gpu_define){"ABUFFER_EMPTY", "1"};
    if (options->abuffer.form == TRACER_FORM_PAPER)
        defines[n++] = (struct gpu_define){"ABUFFER_PARITY", "1"};
    const struct trace_program_source source = {
        .traverse = "abuffer/traverse.glsl",
        .defines = defines,
        .packet_rays = 1,
        .rays_a_dispatch = trace_rays_a_dispatch(store->device, abuffer_rounds_of_a_ray(store)),
    };
    const struct gpu_program *program = trace_program_get(scene, rays->wave, &source, error);
    if (!program)
        return false;
    const float place[4] = {store->lower_world[0], store->lower_world[1], store->lower_world[2],
                            store->cell_world};
    gpu_uniform_int(program, "abuffer_resolution", (int32_t)store->resolution);
    gpu_uniform_int(program, "abuffer_grid", (int32_t)(store->voxels_along / ABUFFER_BLOCK_VOXELS));
    gpu_uniform_int(program, "abuffer_has_subvoxels", abuffer_has_subvoxels(store));
    gpu_uniform_int(program, "abuffer_drawn_count", (int32_t)store->drawn_count);
    gpu_uniform_vec(program, "abuffer_place", 4, place);
    gpu_buffer_bind_texels(store->device, &store->texels, UNIT_TRACER_0, GL_RG32UI);
    gpu_buffer_bind_texels(store->device, &store->samples, UNIT_TRACER_1, GL_RGBA32UI);
    gpu_buffer_bind_texels(store->device, &store->voxels, UNIT_TRACER_2, GL_RGBA32UI);
    gpu_buffer_bind_texels(store->device, &store->ids, UNIT_TRACER_3, GL_R32UI);
    gpu_buffer_bind_texels(store->device, &store->drawn, UNIT_TRACER_4, GL_RGBA32UI);
    gpu_buffer_bind_texels(store->device, &store->subvoxels, UNIT_TRACER_5, GL_RG32UI);
    trace_program_run(program, scene, rays, &source);
    return true;
}
