/* SPDX-License-Identifier: MIT */
/* Measures first hits both ways and rays by both kinds of nodes, and derives the limits between them. */
#include "check/first_hits.h"

#include "base/log.h"
#include "check/frames.h"
#include "check/scene.h"
#include "protocol/tracers.h"

#include <math.h>

#define AROUND 256u
#define ACROSS 128u
#define AROUND_FEW 16u
#define ACROSS_FEW 8u
/* A mesh whose links leave the caches of small cards. */
#define AROUND_MANY 512u
#define ACROSS_MANY 256u
#define SAMPLES_SEVERAL 16u
#define REPEATS                                                                                                   \
    4u /* frames per measurement: the first compiles; the fastest counts, as others may use the                   \
          device too */
/* Relative difference of depths that count as the same: some roundings of a distance. */
#define DEPTH_SHARE 1e-4f
/* Share of the time at which tracing, or the other nodes, count as faster: clearly, so that devices of a kind
 * decide the same, though measurements differ from run to run. */
#define TRACED_SHARE 0.8
#define NEVER 1e9 /* primitives a pixel */

/* Request for first hits and their depth only. */
static struct frame_request request_of(const struct gpu_device *device, bool several, enum first_hits_way way)
{
    const uint32_t side =
        (uint32_t)sqrt(device->facts.slice_rays_max) / 2; /* a quarter of a slice, which fills the device */
    struct frame_request request = check_request(TRACER_BVH, side, side);
    request.sampling.samples = several ? SAMPLES_SEVERAL : 1;
    request.tracing.primary = way == FIRST_HITS_TRACED ? PRIMARY_TRACE : PRIMARY_RASTER;
    request.picture.layers = 1u << LAYER_DEPTH;
    return request;
}

static uint64_t time_of(const struct frame_result *result)
{
    return stage_times_sum_ns(&result->times, STAGE_PRIMARY, CLOCK_GPU) +
           stage_times_sum_ns(&result->times, STAGE_TRACE, CLOCK_GPU);
}

/* Measures a request; *result is that of the last frame. */
static bool measure(struct check_frames *frames, const struct frame_request *request, uint64_t *best_ns,
                    struct frame_result *result, struct error *error)
{
    *best_ns = 0;
    for (uint32_t i = 0; i < REPEATS; i++) {
        frame_result_finish(result);
        if (!check_frame(frames, request, result, error))
            return false;
        const uint64_t ns = time_of(result);
        if (i > 0 && (*best_ns == 0 || ns < *best_ns))
            *best_ns = ns;
    }
    return true;
}

static double agreement(const struct frame_result *a, const struct frame_result *b)
{
    const float *one = (const float *)(const void *)a->pixels, *other = (const float *)(const void *)b->pixels;
    const uint32_t pixels = a->width * a->height;
    uint32_t same = 0;
    for (uint32_t i = 0; i < pixels; i++)
        same += fabsf(one[4 * i] - other[4 * i]) <= DEPTH_SHARE * fabsf(one[4 * i]);
    return (double)same / pixels;
}

/* Measures both ways, with one sample per pixel or several. */
static bool measure_ways(struct check_frames *frames, bool several, struct first_hits *measured,
                         struct error *error)
{
    struct frame_result results[2] = {0};
    bool ok = true;
    for (int way = 0; ok && way < 2; way++) {
        const struct frame_request request = request_of(frames->device, several, (enum first_hits_way)way);
        ok = measure(frames, &request, &measured->ns[several][way], &results[way], error);
        measured->ns[several][way] /= request.sampling.samples;
        measured->pixels = (uint64_t)request.picture.width * request.picture.height;
    }
    if (ok && !several) /* with several samples the places in the pixels differ */
        measured->agree = agreement(&results[0], &results[1]);
    for (int way = 0; way < 2; way++)
        frame_result_finish(&results[way]);
    return ok;
}

static bool measure_few(struct check_frames *frames, struct first_hits *measured, struct error *error)
{
    const struct frame_request request = request_of(frames->device, false, FIRST_HITS_RASTERISED);
    struct frame_result result = {0};
    bool ok = measure(frames, &request, &measured->few_ns, &result, error);
    frame_result_finish(&result);
    return ok;
}

/* Rays that go apart: bounces of paths, and ambient occlusion's, which anything stops. */
static bool measure_nodes(struct check_frames *frames, uint32_t nodes, uint64_t *sum_ns, struct error *error)
{
    static const uint32_t integrators[] = {INTEGRATOR_PATH, INTEGRATOR_AO};
    *sum_ns = 0;
    for (size_t i = 0; i < sizeof(integrators) / sizeof(*integrators); i++) {
        struct frame_request request = request_of(frames->device, false, FIRST_HITS_RASTERISED);
        struct frame_result result = {0};
        uint64_t ns = 0;
        request.picture.layers = 0;
        request.light.integrator = integrators[i];
        request.tracer_options.bvh.nodes = nodes;
        const bool ok = measure(frames, &request, &ns, &result, error);
        frame_result_finish(&result);
        if (!ok)
            return false;
        *sum_ns += ns;
    }
    return true;
}

bool first_hits_measure(struct gpu_device *device, struct first_hits *measured, struct error *error)
{
    struct check_frames frames;
    *measured = (struct first_hits){.primitives = 2 * AROUND * ACROSS};
    bool ok = check_frames_init(&frames, device, check_scene_torus(AROUND, ACROSS, error), error) &&
              measure_ways(&frames, false, measured, error) && measure_ways(&frames, true, measured, error);
    check_frames_finish(&frames);
    ok = ok && check_frames_init(&frames, device, check_scene_torus(AROUND_FEW, ACROSS_FEW, error), error) &&
         measure_few(&frames, measured, error);
    check_frames_finish(&frames);
    ok = ok && check_frames_init(&frames, device, check_scene_torus(AROUND_MANY, ACROSS_MANY, error), error) &&
         measure_nodes(&frames, BVH_NODES_LINKS, &measured->links_ns, error) &&
         measure_nodes(&frames, BVH_NODES_EIGHT, &measured->eight_ns, error);
    check_frames_finish(&frames);
    return ok;
}

/* Primitives per pixel from which tracing is faster. Rasterising takes a time for each pixel, measured with few
 * primitives, and one for each primitive; tracing a time for each pixel. If rasterising is as fast for many
 * primitives as for few, it always is the faster way. */
struct gpu_measured first_hits_limits(const struct first_hits *measured)
{
    struct gpu_measured limits = {.known = measured->few_ns > 0,
                                  .nodes_of_eight =
                                      (double)measured->eight_ns < TRACED_SHARE * (double)measured->links_ns};
    for (int several = 0; several < 2; several++) {
        const double rasterised = (double)measured->ns[several][FIRST_HITS_RASTERISED],
                     traced = (double)measured->ns[several][FIRST_HITS_TRACED], few = (double)measured->few_ns,
                     a_primitive = fmax(rasterised - few, 0) / (double)measured->primitives,
                     lacking = traced / TRACED_SHARE - few;
        limits.known = limits.known && rasterised > 0 && traced > 0;
        if (lacking <= 0)
            limits.traced_from[several] = 0;
        else
            limits.traced_from[several] =
                (float)fmin(lacking / fmax(a_primitive, 1e-9) / (double)measured->pixels, NEVER);
    }
    return limits;
}

bool first_hits_keep(struct gpu_device *device, const struct first_hits *measured)
{
    if (device->measured.known)
        return true;
    device->measured = first_hits_limits(measured);
    return !device->measured.known || gpu_measured_store(&device->info, &device->measured);
}

void first_hits_decide(struct gpu_device *device)
{
    struct first_hits measured;
    struct error error = {0};
    if (device->measured.known)
        return;
    if (!first_hits_measure(device, &measured, &error)) {
        log_write(LOG_WARNING, "check", "first hits were not measured, and are rasterised: %s", error.text);
        return;
    }
    const bool kept = first_hits_keep(device, &measured);
    if (device->measured.known)
        log_write(LOG_INFO, "check",
                  "first hits are traced from %.3g primitives a pixel on, from %.3g with several samples, rays by "
                  "%s%s",
                  (double)device->measured.traced_from[0], (double)device->measured.traced_from[1],
                  device->measured.nodes_of_eight ? "nodes of eight" : "links",
                  kept ? "" : "; there is no cache folder to keep that in, so it is measured at each start");
}
