// SPDX-License-Identifier: MIT
/* Chooses how many rays of a wave an invocation traverses, as a packet. The choice depends on the rays and the
 * scene alone, never on the clock, so that a picture is the same every time: it is made once for the whole
 * wave, before its first step. */
#include "trace/bvh/tracer.h"

#include "shared/ray.h"

#include <math.h>

/* Size of the groups whose coherence is measured. */
#define GROUP_RAYS 8u
#define PACKET_RAYS_PAPER 2u
/* Minimum of rays in a packet that pays: its traversal takes as long as four single ones. */
#define RAYS_PER_PACKET_MIN 5u
/* Maximum distance between the rays of a packet at the scene, in leaves: beyond it they have few leaves in
 * common. Measured: with 871K triangles in 70K pixels (4 leaves) packets of eight camera rays take 0.9 of the
 * time of single ones, with 590K in 213K (2 leaves) 1.5; eight shadow rays, whose last one decides, 1.3, 1.04
 * and 0.87 with 147K, 590K and 1M triangles. */
#define PACKET_WIDTH_CLOSEST 2.5f
#define PACKET_WIDTH_ANY 1.5f
/* Maximum distance between the origins of a packet's rays, as a share of the scene's diagonal. */
#define PACKET_REACH (1.0f / 512)
/* A frame with fewer samples is finished before programs that trace a little faster would be compiled, unless the
 * cache has them. Measured with llvmpipe, processor time: packets of eight camera rays take 130 ms more to compile
 * than packets of four, and save 0.07 us a ray; pairs take 50 ms more than rays one by one, and save 0.04 us. */
#define SMALL_FRAME_SAMPLES (1u << 19)
#define PACKET_RAYS_SMALL 4u
/* Number of groups sampled for a wave's coherence, and the number of rays below which sampling costs more than
 * it saves. */
#define COHERENCE_GROUPS 512u
#define COHERENCE_RAYS_MIN 1024u

float bvh_packet_reach(const struct gpu_scene *scene, const struct wave *wave)
{
    float reach = PACKET_REACH * scene->diagonal;
    /* Rays of different times meet a moving object in different places: measured, packets of a lens's rays then
     * take 0.7 of the time of single ones. */
    return wave->origin_spread > reach && !scene->has_motion ? wave->origin_spread : reach;
}

/* ---- coherence of a wave: the rule of form_packet() in bvh/packet.glsl, for rays that stay close ---- */

#define PACKET_SQUARED_COSINE 0.998f /* value of bvh/packet.glsl */

struct closeness {
    float reach_squared; /* maximum squared distance of origins */
    float centre[3];     /* centre of the scene */
    float width;         /* maximum distance at the scene's centre; 0: any */
};

static float dot3(const float a[3], const float b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static float distance3(const float a[3], const float b[3])
{
    const float apart[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
    return sqrtf(dot3(apart, apart));
}

static bool same_octant(const float a[3], const float b[3])
{
    return (a[0] < 0.0f) == (b[0] < 0.0f) && (a[1] < 0.0f) == (b[1] < 0.0f) && (a[2] < 0.0f) == (b[2] < 0.0f);
}

static bool would_share(const struct closeness *closeness, const struct ray *a, const struct ray *b)
{
    const float *direction_a = a->direction_t_max, *direction_b = b->direction_t_max;
    const float *origin_a = a->origin_t_min, *origin_b = b->origin_t_min;
    const float cosine = dot3(direction_a, direction_b), squares_a = dot3(direction_a, direction_a);
    const float squares_b = dot3(direction_b, direction_b), apart = distance3(origin_a, origin_b);
    if (!same_octant(direction_a, direction_b) ||
        !(cosine * cosine >= PACKET_SQUARED_COSINE * squares_a * squares_b) ||
        !(apart * apart <= closeness->reach_squared))
        return false;
    const float far = distance3(closeness->centre, origin_a), length_a = sqrtf(squares_a),
                length_b = sqrtf(squares_b);
    float unit_a[3], unit_b[3];
    for (int k = 0; k < 3; k++) {
        unit_a[k] = direction_a[k] / length_a;
        unit_b[k] = direction_b[k] / length_b;
    }
    return closeness->width == 0.0f || apart + far * distance3(unit_a, unit_b) <= closeness->width;
}

/* Adds the live rays of a group, and the number of packets that fits them best. */
static void count_group(const struct closeness *closeness, const struct ray *rays, uint32_t counts[2])
{
    bool waits[GROUP_RAYS];
    for (uint32_t k = 0; k < GROUP_RAYS; k++) {
        waits[k] = rays[k].direction_t_max[3] > rays[k].origin_t_min[3];
        counts[0] += waits[k];
    }
    for (uint32_t leading = 0; leading < GROUP_RAYS; leading++) {
        if (!waits[leading])
            continue;
        counts[1]++;
        for (uint32_t k = leading + 1; k < GROUP_RAYS; k++)
            waits[k] = waits[k] && !would_share(closeness, &rays[leading], &rays[k]);
    }
}

/* Counts live rays in a sample of the wave, and the traversals that they would need. The host does it: the
 * buffers of software GL are in its memory, and a program on the device took 45 ms to compile. */
static bool measure_coherence(struct bvh *bvh, const struct gpu_scene *scene, const struct wave *wave,
                              uint32_t counts[2], struct error *error)
{
    const float leaves = wave->kind == WAVE_ANY ? PACKET_WIDTH_ANY : PACKET_WIDTH_CLOSEST;
    const float reach = bvh_packet_reach(scene, wave);
    struct closeness closeness = {.reach_squared = reach * reach, .width = leaves * bvh->tree.leaf_extent_world};
    for (int k = 0; k < 3; k++)
        closeness.centre[k] = 0.5f * scene->lower_world[k] + 0.5f * scene->upper_world[k];
    const uint32_t groups = wave->ray_count / GROUP_RAYS;
    const uint32_t step = groups > COHERENCE_GROUPS ? groups / COHERENCE_GROUPS : 1;
    const struct ray *rays = gpu_buffer_open(scene->device, wave->rays, error);
    if (!rays)
        return false;
    counts[0] = counts[1] = 0;
    for (uint32_t group = 0; group < groups / step; group++)
        count_group(&closeness, rays + (size_t)group * step * GROUP_RAYS, counts);
    gpu_buffer_unmap(scene->device, wave->rays);
    return true;
}

static bool is_of_small_frame(const struct wave *wave)
{
    return wave->frame_samples > 0 && wave->frame_samples < SMALL_FRAME_SAMPLES;
}

/* Rays of one origin get the same answers, to the bit, in packets of any size. */
static uint32_t packet_rays_of(const struct gpu_device *device, const struct wave *wave)
{
    return wave->shared_origin && is_of_small_frame(wave) ? PACKET_RAYS_SMALL : device->facts.packet_rays;
}

static bool is_paper(const struct bvh *bvh)
{
    return bvh->base.options.bvh.form == TRACER_FORM_PAPER;
}

uint32_t bvh_packet_rays_expected(struct bvh *bvh, const struct wave *wave)
{
    if (bvh->tree.store.settings.wide || (wave->apart && !wave->shared_origin))
        return 1;
    if (is_paper(bvh))
        return PACKET_RAYS_PAPER;
    const bool measured = bvh->base.device->facts.packet_rays > 1 && wave->ray_count >= COHERENCE_RAYS_MIN;
    return measured && wave->shared_origin ? packet_rays_of(bvh->base.device, wave) : 1;
}

uint32_t bvh_packet_rays(struct bvh *bvh, const struct gpu_scene *scene, const struct wave *wave,
                         struct error *error)
{
    uint32_t counts[2];
    /* The intersections of a packet of several origins are rounded by its leading ray. */
    if (bvh->tree.store.settings.wide || (wave->apart && (!wave->shared_origin || scene->has_motion)))
        return 1;
    if (is_paper(bvh))
        return PACKET_RAYS_PAPER;
    if (scene->device->facts.packet_rays == 1 || wave->ray_count < COHERENCE_RAYS_MIN)
        return 1;
    if (!measure_coherence(bvh, scene, wave, counts, error))
        return 0;
    return counts[0] >= (uint64_t)RAYS_PER_PACKET_MIN * counts[1] && counts[1] > 0
               ? packet_rays_of(bvh->base.device, wave)
               : 1;
}
