/* SPDX-License-Identifier: MIT */
/* Waves through Embree, on all cores, with as many rays per call as the processor's vectors hold.
 *
 * Measured on an EPYC of Zen 4 (AVX-512), Embree 3.13.5, robust mode, million rays per second of one core's
 * time:
 *
 *   triangles                   5,204                 145,802               589,700
 *   rays a call            1      8     16        1      8     16       1      8     16
 *   primary              9.3   12.4   12.6      6.7    7.9    8.1     5.9    6.8    6.8
 *   diffuse bounce       9.8   11.5   12.2      5.9    6.3    6.9     4.5    4.8    5.1
 *   shadow              13.9   25.0   26.3      9.4   12.9   13.8     7.6    9.5   10.1
 *
 * Sixteen wins everywhere. Streams (rtcIntersect1M, 1,024 rays) do 10.3, 6.2 and 4.4 on bounces. With
 * RTC_INTERSECT_CONTEXT_FLAG_COHERENT, which traverses rays as a frustum, streams do 21, 14.7 and 10.8 on
 * primary rays, and calls of sixteen 27 and 17. The flag stays off: with it rtcOccluded16 did not terminate on
 * the first scene of tests/tracers, and a ray with a direction near zero changed the answers of others in its
 * packet. The ground truth is slow rather than wrong. */
#include "trace/reference/tracer.h"

#include "base/parallel.h"
#include "shared/hit.h"
#include "shared/ray.h"
#include "trace/step.h"
#include "trace/visibility.h"

#include <float.h>
#include <math.h>
#include <stdatomic.h>
#include <string.h>
#if defined(__SSE2__)
#include <pmmintrin.h>
#endif

/* Maximum of rays that a thread fetches at a time: some tens of microseconds of work. Fewer where a range has
 * few, as its rays may cost milliseconds each. */
#define CHUNK_RAYS 1024u

/* A packet of n rays, and of hits behind them, is a row of n values for each of these fields (rtcore_ray.h has
 * this order for C++ alone); one ray is a packet of 1. */
enum ray_field {
    RAY_ORIGIN, /* x, y, z */
    RAY_T_NEAR = 3,
    RAY_DIRECTION, /* x, y, z */
    RAY_TIME = 7,
    RAY_T_FAR, /* hit: its distance; occluded ray: minus infinity */
    RAY_MASK,
    RAY_ID,
    RAY_FLAGS,
    RAY_FIELDS
};
enum hit_field {
    HIT_NORMAL, /* x, y, z */
    HIT_U = 3,
    HIT_V,
    HIT_PRIMITIVE,
    HIT_GEOMETRY,
    HIT_INSTANCE,
    HIT_FIELDS
};
union lane {
    float f;
    uint32_t u;
};

struct packet {
    _Alignas(64) int32_t valid[REFERENCE_RAYS_MAX]; /* 0 or -1 */
    _Alignas(64) union lane lanes[(RAY_FIELDS + HIT_FIELDS) * REFERENCE_RAYS_MAX];
};

struct traversal {
    const struct reference *reference;
    struct reference_wave *wave;
    const struct ray_range *rays;
    unsigned width;
    uint32_t chunk_rays;
    atomic_uint undone; /* first ray without an answer so far */
};

/* Embree's context, followed by the output of the filter functions. */
struct traversal_context {
    struct RTCIntersectContext embree; /* first: the filter functions get this address */
    float transmittance[CHUNK_RAYS][3];
    bool stops[CHUNK_RAYS]; /* RAY_STOPS_T_MIN */
};

/* ---- floating-point mode ---- */

/* Sets the processor's mode for tracing: denormal numbers count as zero, as arithmetic with them costs a
 * hundred cycles. The mode is the thread's, so it is restored afterwards. */
#if defined(__SSE2__)
static unsigned enter_fast_mode(void)
{
    unsigned before = _mm_getcsr();
    _mm_setcsr(before | _MM_FLUSH_ZERO_ON | _MM_DENORMALS_ZERO_ON);
    return before;
}

static void leave_fast_mode(unsigned before)
{
    _mm_setcsr(before);
}
#else
static unsigned enter_fast_mode(void)
{
    return 0;
}

static void leave_fast_mode(unsigned before)
{
    (void)before;
}
#endif

/* ---- filter functions ---- */

static struct opacity_point point_of(const struct RTCFilterFunctionNArguments *arguments, size_t lane)
{
    const union lane *ray = (const union lane *)(const void *)arguments->ray;
    const union lane *hit = (const union lane *)(const void *)arguments->hit;
    size_t n = arguments->N;
    struct opacity_point point = {
        .primitive = hit[HIT_PRIMITIVE * n + lane].u,
        .u = hit[HIT_U * n + lane].f,
        .v = hit[HIT_V * n + lane].f,
        .distance = ray[RAY_T_FAR * n + lane].f,
    };
    for (size_t k = 0; k < 3; k++) {
        point.origin[k] = ray[(RAY_ORIGIN + k) * n + lane].f;
        point.direction[k] = ray[(RAY_DIRECTION + k) * n + lane].f;
    }
    return point;
}

void reference_filter_closest(const struct RTCFilterFunctionNArguments *arguments)
{
    const struct opacity_surface *surface = arguments->geometryUserPtr;
    for (unsigned lane = 0; lane < arguments->N; lane++) {
        if (!arguments->valid[lane])
            continue;
        const struct opacity_point point = point_of(arguments, lane);
        if (opacity_is_cut_out(surface, &point))
            arguments->valid[lane] = 0;
    }
}

/* A ray that is only dimmed continues. */
void reference_filter_any(const struct RTCFilterFunctionNArguments *arguments)
{
    const struct opacity_surface *surface = arguments->geometryUserPtr;
    struct traversal_context *context = (struct traversal_context *)arguments->context;
    const union lane *ray = (const union lane *)(const void *)arguments->ray;
    for (unsigned lane = 0; lane < arguments->N; lane++) {
        if (!arguments->valid[lane])
            continue;
        const struct opacity_point point = point_of(arguments, lane);
        const uint32_t id = ray[RAY_ID * (size_t)arguments->N + lane].u % CHUNK_RAYS;
        float *left = context->transmittance[id], passes[3], maximum = 0.0f;
        opacity_transmittance(surface, &point, context->stops[id], passes);
        for (int k = 0; k < 3; k++) {
            left[k] *= passes[k];
            maximum = fmaxf(maximum, left[k]);
        }
        if (maximum >= VISIBILITY_BLACK)
            arguments->valid[lane] = 0;
    }
}

/* ---- rays ---- */

static float next_above(float x) /* x at least 0; never a denormal number */
{
    union lane bits = {.f = x};
    if (x < FLT_MIN)
        return FLT_MIN;
    bits.u++;
    return bits.f;
}

static float next_below(float x) /* x above 0 */
{
    union lane bits = {.f = x};
    bits.u--;
    return bits.f;
}

/* Beginning of the part of a ray that Embree traces: its rays do not reach behind their origin. */
static float begin_of(const struct ray *ray)
{
    float t_min = ray->origin_t_min[3];
    return t_min < 0.0f ? t_min : 0.0f;
}

/* Fills a lane of the packet. Rays beyond the coordinates that the scene's instances allow, or with NaN, hit
 * nothing. */
static inline void set_lane(struct packet *packet, unsigned n, unsigned lane, const struct ray *ray, float time,
                            uint32_t id, float coordinate_max)
{
    union lane *rays = packet->lanes;
    float begin = begin_of(ray);
    float t_min = ray->origin_t_min[3] - begin, t_max = ray->direction_t_max[3] - begin;
    bool alive = t_max > t_min;
    for (unsigned k = 0; k < 3; k++) {
        float origin = ray->origin_t_min[k] + begin * ray->direction_t_max[k], direction = ray->direction_t_max[k];
        alive = alive && fabsf(origin) <= coordinate_max && fabsf(direction) <= coordinate_max;
        rays[(RAY_ORIGIN + k) * n + lane].f = origin;
        rays[(RAY_DIRECTION + k) * n + lane].f = direction;
    }
    /* The ends are exclusive; Embree's spheres and discs would include them. */
    float t_near = alive ? next_above(t_min) : 0.0f, t_far = alive ? next_below(t_max) : 0.0f;
    rays[RAY_T_NEAR * n + lane].f = t_near;
    rays[RAY_TIME * n + lane].f = time;
    rays[RAY_T_FAR * n + lane].f = t_far;
    rays[RAY_MASK * n + lane].u = UINT32_MAX;
    rays[RAY_ID * n + lane].u = id;
    rays[RAY_FLAGS * n + lane].u = 0;
    packet->valid[lane] = alive && t_near <= t_far ? -1 : 0;
    union lane *hits = rays + RAY_FIELDS * n;
    hits[HIT_GEOMETRY * n + lane].u = RTC_INVALID_GEOMETRY_ID;
    hits[HIT_INSTANCE * n + lane].u = RTC_INVALID_GEOMETRY_ID;
}

static struct hit intersection_of(const struct reference *reference, const struct packet *packet, unsigned n,
                                  unsigned lane, const struct ray *ray)
{
    const union lane *hits = packet->lanes + RAY_FIELDS * n;
    struct hit intersection = {.distance = -1.0f, .primitive = HIT_NO_PRIMITIVE, .instance = HIT_NO_PRIMITIVE};
    if (!packet->valid[lane] || hits[HIT_GEOMETRY * n + lane].u == RTC_INVALID_GEOMETRY_ID)
        return intersection;
    uint32_t instance = hits[HIT_INSTANCE * n + lane].u;
    intersection.distance = packet->lanes[RAY_T_FAR * n + lane].f + begin_of(ray);
    intersection.primitive = hits[HIT_PRIMITIVE * n + lane].u;
    if (instance != RTC_INVALID_GEOMETRY_ID) {
        intersection.instance = instance - 1;
        intersection.primitive += reference->instances[instance - 1].first_primitive;
    }
    return intersection;
}

static uint32_t visibility_left(const struct packet *packet, unsigned n, unsigned lane,
                                const float transmittance[3])
{
    bool occluded = packet->valid[lane] && packet->lanes[RAY_T_FAR * n + lane].f < 0.0f;
    const float left[3] = {fminf(transmittance[0], 1.0f), fminf(transmittance[1], 1.0f),
                           fminf(transmittance[2], 1.0f)};
    return occluded ? 0 : visibility_of(left);
}

/* ---- packets ---- */

static inline void intersect(RTCScene scene, struct traversal_context *context, struct packet *packet, unsigned n)
{
    void *lanes = packet->lanes;
    switch (n) {
    case 1:
        if (packet->valid[0])
            rtcIntersect1(scene, &context->embree, lanes);
        break;
    case 4:
        rtcIntersect4(packet->valid, scene, &context->embree, lanes);
        break;
    case 8:
        rtcIntersect8(packet->valid, scene, &context->embree, lanes);
        break;
    default:
        rtcIntersect16(packet->valid, scene, &context->embree, lanes);
    }
}

static inline void occlude(RTCScene scene, struct traversal_context *context, struct packet *packet, unsigned n)
{
    void *lanes = packet->lanes;
    switch (n) {
    case 1:
        if (packet->valid[0])
            rtcOccluded1(scene, &context->embree, lanes);
        break;
    case 4:
        rtcOccluded4(packet->valid, scene, &context->embree, lanes);
        break;
    case 8:
        rtcOccluded8(packet->valid, scene, &context->embree, lanes);
        break;
    default:
        rtcOccluded16(packet->valid, scene, &context->embree, lanes);
    }
}

/* Whether to stop before a packet; the very first packet is always traced. A range ends at a multiple of
 * REFERENCE_RAYS_MAX, which keeps the packets of the next range the same. */
static bool is_over(struct traversal *traversal, uint32_t at)
{
    bool is_cancelled =
        atomic_load(&traversal->wave->is_cancelled) || atomic_load(&traversal->reference->ends_waves);
    if (!is_cancelled &&
        (at == traversal->rays->first || at % REFERENCE_RAYS_MAX || !step_is_over(traversal->wave->step_end_ns)))
        return false;
    unsigned undone = atomic_load(&traversal->undone);
    while (at < undone && !atomic_compare_exchange_weak(&traversal->undone, &undone, at))
        continue;
    return true;
}

/* Traverses the rays `first` .. of a chunk that ends at `end`, n at a time. Inlined with a constant n. */
static inline __attribute__((always_inline)) void traverse_packets(struct traversal *traversal,
                                                                   struct traversal_context *context,
                                                                   uint32_t first, uint32_t end, unsigned n)
{
    const struct reference *reference = traversal->reference;
    bool any = traversal->rays->wave->kind == WAVE_ANY;
    struct packet packet;
    for (uint32_t at = first; at < end; at += n) {
        unsigned count = end - at < n ? end - at : n;
        if (is_over(traversal, at))
            return;
        for (unsigned lane = 0; lane < n; lane++) {
            static const struct ray dead = {.direction_t_max = {0.0f, 0.0f, 0.0f, -1.0f}};
            bool there = lane < count;
            float time = there && traversal->rays->wave->times ? traversal->wave->times[at + lane] : 0.0f;
            set_lane(&packet, n, lane, there ? &traversal->wave->rays[at + lane] : &dead, time, at + lane - first,
                     reference->coordinate_max);
        }
        if (any)
            occlude(reference->top, context, &packet, n);
        else
            intersect(reference->top, context, &packet, n);
        for (unsigned lane = 0; lane < count; lane++) {
            if (any)
                ((uint32_t *)traversal->wave->answers)[at + lane] =
                    visibility_left(&packet, n, lane, context->transmittance[at + lane - first]);
            else
                ((struct hit *)traversal->wave->answers)[at + lane] =
                    intersection_of(reference, &packet, n, lane, &traversal->wave->rays[at + lane]);
        }
    }
}

static void traverse_chunk(void *argument, uint32_t chunk)
{
    struct traversal *traversal = argument;
    uint32_t first = traversal->rays->first + chunk * traversal->chunk_rays, left = traversal->rays->end - first;
    uint32_t end = first + (left < traversal->chunk_rays ? left : traversal->chunk_rays);
    struct traversal_context context;
    unsigned mode = enter_fast_mode();
    rtcInitIntersectContext(&context.embree);
    if (traversal->rays->wave->kind == WAVE_ANY)
        for (uint32_t i = 0; i < end - first; i++) {
            for (int k = 0; k < 3; k++)
                context.transmittance[i][k] = 1.0f;
            context.stops[i] = traversal->wave->rays[first + i].origin_t_min[3] == RAY_STOPS_T_MIN;
        }
    switch (traversal->width) {
    case 1:
        traverse_packets(traversal, &context, first, end, 1);
        break;
    case 4:
        traverse_packets(traversal, &context, first, end, 4);
        break;
    case 8:
        traverse_packets(traversal, &context, first, end, 8);
        break;
    default:
        traverse_packets(traversal, &context, first, end, 16);
    }
    leave_fast_mode(mode);
}

uint32_t reference_traverse(struct reference *reference, struct reference_wave *wave)
{
    const struct ray_range *rays = &wave->range;
    const unsigned processors = parallel_processors();
    const uint32_t count = rays->end - rays->first;
    const uint32_t even = (count / processors + REFERENCE_RAYS_MAX) / REFERENCE_RAYS_MAX * REFERENCE_RAYS_MAX;
    struct traversal traversal = {
        .reference = reference,
        .wave = wave,
        .rays = rays,
        .width = reference->width,
        .chunk_rays = even < CHUNK_RAYS ? even : CHUNK_RAYS,
        .undone = rays->end,
    };
    parallel_run(processors, (count - 1) / traversal.chunk_rays + 1, traverse_chunk, &traversal);
    return atomic_load(&traversal.undone);
}
