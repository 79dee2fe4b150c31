// SPDX-License-Identifier: MIT
/* How many rays of a wave an invocation traverses, as a packet or side by side. The choice depends on the rays and
 * the scene alone, never on the clock, so that a picture is the same every time: it is made once for the whole
 * wave, before its first step. */
#include "trace/bvh/tracer.h"

#include "gpu/program.h"
#include "shared/bindings.h"

#include <epoxy/gl.h>

/* The packet size on software GL where packets pay. On hardware a SIMD group traverses together already, and
 * several rays per invocation cost registers; not measured there. */
#define PACKET_RAYS_SOFTWARE 8u
/* The traversal of a packet takes as long as four single ones (bench_bvh): it pays with more rays than that. */
#define RAYS_PER_PACKET_MIN 5u
/* Rays that are farther apart than so many leaves, where the scene is, have few leaves in common. Measured: with
 * 871K triangles in 70K pixels (4 leaves) packets of eight camera rays are 0.9 of one alone, with 590K in 213K (2
 * leaves) 1.5; eight shadow rays, of which the last decides, 1.3, 1.04 and 0.87 with 147K, 590K and 1M triangles.
 */
#define PACKET_WIDTH_CLOSEST 2.5f
#define PACKET_WIDTH_ANY 1.5f
/* A share of the scene's diagonal. */
#define PACKET_REACH (1.0f / 512)
/* Groups of which the coherence of a wave is found, and the rays below which it is not worth it. */
#define COHERENCE_GROUPS 512u
#define COHERENCE_RAYS_MIN 1024u

float bvh_packet_reach(const struct gpu_scene *scene, const struct wave *wave)
{
    float reach = PACKET_REACH * scene->diagonal;
    /* Rays of several times have several places in what moves: measured, those of a lens are 0.7 of single ones
     * then. */
    return wave->origin_spread > reach && !scene->has_motion ? wave->origin_spread : reach;
}

static const struct gpu_program_source coherence_source = {.compute = "bvh/coherence.comp"};

/* Of a sample of the wave: live rays, and the traversals that they would need. */
static bool measure_coherence(struct bvh *bvh, const struct gpu_scene *scene, const struct wave *wave,
                              uint32_t counts[2], struct error *error)
{
    struct gpu_device *device = scene->device;
    const struct gpu_program *program = gpu_program_get(device, &coherence_source, error);
    if (!program)
        return false;
    uint32_t groups = wave->ray_count / PACKET_RAYS_SOFTWARE;
    uint32_t step = groups > COHERENCE_GROUPS ? groups / COHERENCE_GROUPS : 1;
    gpu_buffer_clear(device, &bvh->coherence, 0);
    gpu_buffer_bind_storage(&bvh->coherence, BIND_TRACER_0);
    gpu_buffer_bind_texels(device, wave->rays, UNIT_RAYS, GL_RGBA32F);
    gpu_uniform_uint(program, "group_count", groups / step);
    gpu_uniform_uint(program, "group_stride", step * PACKET_RAYS_SOFTWARE);
    gpu_uniform_uint(program, "group_rays", PACKET_RAYS_SOFTWARE);
    gpu_uniform_float(program, "bvh_packet_reach", bvh_packet_reach(scene, wave));
    float centre[3];
    for (int k = 0; k < 3; k++)
        centre[k] = 0.5f * scene->lower_world[k] + 0.5f * scene->upper_world[k];
    gpu_uniform_vec(program, "scene_centre", 3, centre);
    float leaves = wave->kind == WAVE_ANY ? PACKET_WIDTH_ANY : PACKET_WIDTH_CLOSEST;
    gpu_uniform_float(program, "packet_width", leaves * bvh->tree.leaf_extent_world);
    gpu_dispatch(device, program, groups / step);
    gpu_buffer_read(device, &bvh->coherence, 0, counts, BVH_COHERENCE_BYTES);
    return true;
}

uint32_t bvh_packet_rays_expected(struct bvh *bvh, const struct wave *wave, bool coherent)
{
    const struct tracer_options *options = &bvh->base.options;
    const bool measured = bvh->base.device->facts.software && wave->ray_count >= COHERENCE_RAYS_MIN &&
                          options->bench.bvh_layout != BVH_LAYOUT_PLAIN && options->bvh.rays == 0;
    if (measured)
        (void)gpu_program_get(bvh->base.device, &coherence_source, NULL);
    if (measured)
        return coherent ? 0 : 1;
    return options->bvh.rays ? options->bvh.rays : 1;
}

uint32_t bvh_packet_rays(struct bvh *bvh, const struct gpu_scene *scene, const struct wave *wave,
                         struct error *error)
{
    const struct tracer_options *options = &bvh->base.options;
    uint32_t counts[2];
    if (options->bench.bvh_layout == BVH_LAYOUT_PLAIN)
        return 1;
    if (options->bvh.rays != 0)
        return options->bvh.rays;
    if (!scene->device->facts.software || wave->ray_count < COHERENCE_RAYS_MIN)
        return 1;
    if (!measure_coherence(bvh, scene, wave, counts, error))
        return 0;
    return counts[0] >= (uint64_t)RAYS_PER_PACKET_MIN * counts[1] && counts[1] > 0 ? PACKET_RAYS_SOFTWARE : 1;
}

bool bvh_ray_pairs(const struct bvh *bvh, const struct gpu_scene *scene, const struct wave *wave,
                   uint32_t packet_rays)
{
    /* A traversal that stops to ask for materials does so for one ray. */
    const bool asks_materials = scene->has_cutout || (wave->kind == WAVE_ANY && scene->has_translucent);
    const bool is_chosen = bvh->base.options.bvh.rays == 0 && !bvh->tree.store.settings.plain;
    return is_chosen && packet_rays == 1 && scene->device->facts.software && !asks_materials;
}
