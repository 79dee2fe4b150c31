/* SPDX-License-Identifier: MIT */
/* Queued slices: a ring of read-backs, and the size of slices by their time stamps. */
#include "render/frame/slices_ahead.h"

#include "gpu/registry.h"

#include <epoxy/gl.h>

/* Rays of a slice: before one was measured, minimum and maximum. Fewer do not fill a GPU. The cost of the
 * first slice is unknown, and a driver ends work that takes seconds: it is small, and the second one has its
 * final size, or is SLICE_GROWTH times as large, since its rays may cost more. */
#define SLICE_RAYS_FIRST (1u << 14)
#define SLICE_RAYS_MIN (1u << 12)
#define SLICE_RAYS_MAX (1u << 30)
#define SLICE_GROWTH 8u
#define SLICE_GROWTH_SLOW 2u /* growth after a slice that took longer than a step */

static struct slice_ahead *next_of(struct slices_ahead *ahead)
{
    return &ahead->ring[(ahead->oldest + ahead->count) % SLICES_AHEAD_MAX];
}

static void stamp(struct gpu_device *device, unsigned *query)
{
    if (!*query)
        *query = gpu_object_create(device->registry, GPU_TIMESTAMP_QUERY);
    if (*query)
        glQueryCounter(*query, GL_TIMESTAMP);
}

uint32_t slices_ahead_rays(const struct slices_ahead *ahead, uint32_t maximum)
{
    const uint32_t rays = ahead->slice_rays ? ahead->slice_rays : SLICE_RAYS_FIRST;
    return rays < maximum ? rays : maximum;
}

void slices_ahead_begin(struct slices_ahead *ahead, struct gpu_device *device, const struct slices *slices,
                        uint32_t sample)
{
    struct slice_ahead *slice = next_of(ahead);
    slice->slices = *slices;
    slice->sample = sample;
    stamp(device, &slice->queries[0]);
}

bool slices_ahead_add(struct slices_ahead *ahead, struct gpu_device *device, const struct gpu_buffer *wave_state,
                      uint32_t rays, struct error *error)
{
    struct slice_ahead *slice = next_of(ahead);
    slice->rays = rays;
    ahead->count++;
    stamp(device, &slice->queries[1]);
    return gpu_readback_copy(device, &slice->state, wave_state, 0, sizeof(struct wave_state), error) &&
           gpu_readback_fence(&slice->state, error);
}

bool slices_ahead_has_done(const struct slices_ahead *ahead)
{
    return ahead->count > 0 && gpu_readback_is_done(&ahead->ring[ahead->oldest].state);
}

bool slices_ahead_take(struct slices_ahead *ahead, struct gpu_device *device, const struct slice_ahead **slice,
                       struct wave_state *state, struct error *error)
{
    struct slice_ahead *oldest = &ahead->ring[ahead->oldest];
    *slice = oldest;
    ahead->oldest = (ahead->oldest + 1) % SLICES_AHEAD_MAX;
    ahead->count--;
    return gpu_readback_take(device, &oldest->state, state, error);
}

/* The query's time; 0: it has none. The slice is done, and so are its time stamps. */
static uint64_t time_of(unsigned query)
{
    GLint available = 0;
    GLuint64 time_ns = 0;
    if (query)
        glGetQueryObjectiv(query, GL_QUERY_RESULT_AVAILABLE, &available);
    if (available)
        glGetQueryObjectui64v(query, GL_QUERY_RESULT, &time_ns);
    return time_ns;
}

/* Fixed time of a slice. It has one wave after the other, each as long as its longest ray takes, however few
 * rays there are: many bounces can take longer than a step. A line through the times of two slices of
 * different sizes has it; 0: there is none. */
static uint64_t slices_ahead_fixed_ns(struct slice_cost one, struct slice_cost other)
{
    const struct slice_cost fewer = one.rays < other.rays ? one : other,
                            more = one.rays < other.rays ? other : one;
    if (fewer.rays == more.rays || more.took_ns <= fewer.took_ns)
        return fewer.took_ns < more.took_ns ? fewer.took_ns : more.took_ns;
    const double a_ray_ns = (double)(more.took_ns - fewer.took_ns) / (double)(more.rays - fewer.rays);
    const double fixed_ns = (double)fewer.took_ns - a_ray_ns * (double)fewer.rays;
    return fixed_ns > 0 ? (uint64_t)fixed_ns : 0;
}

static uint64_t wanted_ns(uint64_t fixed_ns, uint64_t step_ns)
{
    return step_ns > 2 * fixed_ns ? step_ns : 2 * fixed_ns;
}

uint32_t slices_ahead_next_rays(struct slice_cost cost, uint64_t fixed_ns, uint64_t step_ns)
{
    const uint64_t wanted = wanted_ns(fixed_ns, step_ns) - fixed_ns;
    const uint64_t took = cost.took_ns > fixed_ns ? cost.took_ns - fixed_ns : 0;
    if (took <= wanted && took >= wanted / 4)
        return cost.rays;
    const double share = took > wanted ? (double)wanted / (double)took : (double)(wanted / 2) / (double)(took + 1);
    uint64_t next = (uint64_t)cost.rays * (cost.took_ns > step_ns ? SLICE_GROWTH_SLOW : SLICE_GROWTH);
    while ((double)next > (double)cost.rays * share && next > SLICE_RAYS_MIN)
        next /= 2;
    return (uint32_t)(next < SLICE_RAYS_MIN ? SLICE_RAYS_MIN : next < SLICE_RAYS_MAX ? next : SLICE_RAYS_MAX);
}

/* Returns false while slices of a single size were measured. */
static bool learn_fixed(struct slices_ahead *ahead, struct slice_cost cost)
{
    const struct slice_cost last = ahead->last;
    if (last.rays && (cost.rays / 2 >= last.rays || last.rays / 2 >= cost.rays)) {
        ahead->fixed_ns = slices_ahead_fixed_ns(last, cost);
        ahead->knows_fixed = true;
    }
    if (ahead->fixed_ns > cost.took_ns)
        ahead->fixed_ns = cost.took_ns;
    ahead->last = cost;
    return ahead->knows_fixed;
}

void slices_ahead_note(struct slices_ahead *ahead, struct slice_cost cost, bool is_rest, uint64_t step_ns)
{
    const bool knows_fixed = learn_fixed(ahead, cost);
    if (is_rest && cost.took_ns <= wanted_ns(ahead->fixed_ns, step_ns))
        return;
    ahead->slice_rays = slices_ahead_next_rays(cost, ahead->fixed_ns, step_ns);
    if (!knows_fixed && ahead->slice_rays == cost.rays)
        ahead->slice_rays *= 2; /* another size says how much of the time is for rays */
}

void slices_ahead_learn(struct slices_ahead *ahead, const struct slice_ahead *slice, uint64_t step_ns)
{
    const uint64_t begin_ns = time_of(slice->queries[0]), end_ns = time_of(slice->queries[1]);
    if (begin_ns > 0 && end_ns > begin_ns)
        slices_ahead_note(ahead, (struct slice_cost){slice->rays, end_ns - begin_ns},
                          slice->rays != slice->slices.slice_rays, step_ns);
}

void slices_ahead_forget(struct slices_ahead *ahead)
{
    ahead->slice_rays = 0;
    ahead->last = (struct slice_cost){0};
    ahead->fixed_ns = 0;
    ahead->knows_fixed = false;
}

void slices_ahead_drop(struct slices_ahead *ahead)
{
    for (uint32_t i = 0; i < SLICES_AHEAD_MAX; i++)
        gpu_readback_drop(&ahead->ring[i].state);
    ahead->count = 0;
}

void slices_ahead_finish(struct slices_ahead *ahead, struct gpu_device *device)
{
    for (uint32_t i = 0; i < SLICES_AHEAD_MAX; i++) {
        gpu_readback_finish(device, &ahead->ring[i].state);
        for (int end = 0; end < 2; end++)
            gpu_object_destroy(device->registry, GPU_TIMESTAMP_QUERY, ahead->ring[i].queries[end]);
    }
    *ahead = (struct slices_ahead){0};
}
