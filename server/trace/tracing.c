/* SPDX-License-Identifier: MIT */
/* Waves through a tracer, in steps or at once. */
#include "shared/hit.h"
#include "shared/ray.h"
#include "shared/wave.h"
#include "trace/program.h"
#include "trace/tracer.h"

#include <stdlib.h>

/* Maximum growth of a step's rays over the last one's, which may have left the scene at once. The first step
 * has the device's range_rays_first. */
#define STEP_RAYS_GROWTH 2u
#define STEP_RAYS_MAX (1u << 30)
/* Divisor of the first step's rays where rays go through surfaces. */
#define STEP_RAYS_THROUGH 16u

/* ---- state ---- */

struct trace_state *trace_state_create(const struct tracer_impl *impl, struct gpu_device *device,
                                       const struct tracer_options *options, struct error *error)
{
    struct trace_state *state =
        impl->state_create ? impl->state_create(device, options, error) : calloc(1, sizeof(*state));
    if (!state) {
        if (!impl->state_create)
            error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for the state of a wave");
        return NULL;
    }
    state->impl = impl;
    state->device = device;
    state->options = *options;
    return state;
}

void trace_state_destroy(struct trace_state *state)
{
    if (state && state->impl->state_destroy)
        state->impl->state_destroy(state);
    else
        free(state);
}

bool trace_state_fits(const struct trace_state *state, const struct tracer_impl *impl,
                      const struct tracer_options *options)
{
    return state->impl == impl && tracer_options_same(&state->options, options);
}

uint64_t trace_state_device_bytes(const struct trace_state *state)
{
    return state->impl->state_device_bytes ? state->impl->state_device_bytes(state) : 0;
}

void trace_state_reset(struct trace_state *state)
{
    state->in_progress = state->patient = state->has_traced = false;
    for (unsigned i = 0; i < WAVE_FAMILIES; i++)
        state->step_rays[i] = 0;
}

bool trace_state_copy_counts(struct trace_state *state, struct error *error)
{
    return !state->impl->state_copy_counts || !state->has_traced || state->impl->state_copy_counts(state, error);
}

bool trace_state_report(struct trace_state *state, struct structure_rows *rows, struct error *error)
{
    return !state->impl->state_report || !state->has_traced || state->impl->state_report(state, rows, error);
}

/* ---- checks ---- */

static bool buffer_holds(const struct gpu_buffer *buffer, uint32_t count, size_t item_bytes)
{
    return buffer && buffer->size_bytes / item_bytes >= count;
}

static bool check_wave(const struct tracer *tracer, const struct gpu_scene *scene, const struct wave *wave,
                       struct error *error)
{
    bool fits = wave->ray_count > 0 && wave->family < WAVE_FAMILIES &&
                buffer_holds(wave->rays, wave->ray_count, sizeof(struct ray));
    if (wave->kind == WAVE_ANY)
        fits = fits && buffer_holds(wave->visibility, wave->ray_count, sizeof(uint32_t));
    else
        fits = fits && buffer_holds(wave->hits, wave->ray_count, sizeof(struct hit));
    fits = fits && (!wave->times || buffer_holds(wave->times, wave->ray_count, sizeof(float)));
    fits =
        fits && (!wave->counts || buffer_holds(wave->counts, wave->counts_index + 1, sizeof(struct wave_counts)));
    if (!fits)
        return error_set(error, ERROR_INTERNAL, NULL, "%s: a wave of %u rays does not fit its buffers",
                         tracer->impl->name, wave->ray_count);
    return !wave->times || tracer_check_motion(tracer->impl, scene, error);
}

static bool check_updated(const struct tracer *tracer, struct error *error)
{
    return (tracer->updated && !tracer->updating) ||
           error_set(error, ERROR_INTERNAL, NULL, "%s: traced before it was brought to the scene",
                     tracer->impl->name);
}

/* ---- steps ---- */

bool tracer_trace_begin(struct tracer *tracer, struct gpu_scene *scene, const struct wave *wave,
                        struct trace_state *state, struct error *error)
{
    const struct tracer_impl *impl = tracer->impl;
    state->in_progress = false;
    if (!trace_state_fits(state, impl, &tracer->options))
        return error_set(error, ERROR_INTERNAL, NULL, "%s: the state of another tracer's waves", impl->name);
    if (!check_wave(tracer, scene, wave, error) || !check_updated(tracer, error))
        return false;
    state->wave = *wave;
    state->traced_rays = 0;
    gpu_push_group(tracer->device, impl->name);
    state->in_progress = !impl->trace_begin || (impl->trace_begin(tracer, scene, state, error) &&
                                                gpu_check(tracer->device, impl->name, error));
    gpu_pop_group(tracer->device);
    return state->in_progress;
}

/* Rays that ranges are multiples of. */
static uint32_t minimum_rays(const struct trace_state *state)
{
    return state->impl->minimum_rays ? state->impl->minimum_rays : 1;
}

/* Rays of a family's first step. A ray may go through many surfaces one after the other, and is tested with all
 * discs. */
static uint32_t first_step_rays(const struct trace_state *state, const struct gpu_scene *scene)
{
    const struct gpu_facts *facts = &state->device->facts;
    const uint32_t minimum = minimum_rays(state);
    uint64_t rays = facts->range_rays_first;
    if (rays == UINT32_MAX)
        return UINT32_MAX;
    if (scene->has_translucent || scene->has_cutout)
        rays /= STEP_RAYS_THROUGH;
    if (rays * scene->disc_count > facts->list_tests_max)
        rays = facts->list_tests_max / scene->disc_count;
    return rays > minimum ? (uint32_t)rays : minimum;
}

/* The rays of the next step: the rest is divided into equal steps, none with more than the family's. */
static struct ray_range next_range(const struct trace_state *state, const struct gpu_scene *scene,
                                   uint64_t step_ns)
{
    const struct wave *wave = &state->wave;
    const uint32_t learnt = state->step_rays[wave->family], minimum = minimum_rays(state);
    const uint32_t first = state->traced_rays, left = wave->ray_count - first;
    const uint32_t maximum = step_ns == 0 ? minimum : learnt ? learnt : first_step_rays(state, scene);
    struct ray_range rays = {.wave = wave, .first = first, .end = wave->ray_count};
    if (step_ns == STEP_WITHOUT_END || maximum >= left)
        return rays;
    const uint32_t steps = (left - 1) / maximum + 1, even = (left - 1) / steps + 1;
    const uint32_t count = (even + minimum - 1) / minimum * minimum;
    if (count < left)
        rays.end = first + count;
    return rays;
}

static void learn(struct trace_state *state, const struct gpu_scene *scene, uint32_t rays, uint64_t step_ns,
                  uint64_t took_ns)
{
    uint32_t *step_rays = &state->step_rays[state->wave.family];
    if (state->device->facts.range_rays_first == UINT32_MAX)
        return;
    const uint64_t last = *step_rays ? *step_rays : first_step_rays(state, scene), minimum = minimum_rays(state);
    const uint64_t wanted = rays * step_ns / (took_ns + 1), maximum = STEP_RAYS_GROWTH * last;
    const uint64_t next = wanted < maximum ? wanted : maximum;
    *step_rays = (uint32_t)(next < minimum ? minimum : next < STEP_RAYS_MAX ? next : STEP_RAYS_MAX);
}

static bool make_surfaces(struct tracer *tracer, struct gpu_scene *scene, const struct ray_range *rays,
                          struct error *error)
{
    if (rays->wave->kind == WAVE_ANY || rays->wave->bare)
        return true;
    return tracer->impl->surfaces ? tracer->impl->surfaces(tracer, scene, rays, error)
                                  : trace_surfaces(scene, rays, error);
}

static uint64_t step_end_of(uint64_t step_ns)
{
    return step_ns == STEP_WITHOUT_END ? STEP_WITHOUT_END : clock_now_ns() + step_ns;
}

/* Intersects some rays; *rays: those whose answers are final. */
static enum tracer_progress intersect(struct tracer *tracer, struct gpu_scene *scene, struct trace_state *state,
                                      uint64_t step_ns, struct ray_range *rays, struct error *error)
{
    const struct tracer_impl *impl = tracer->impl;
    const uint32_t all = state->wave.ray_count;
    if (!impl->trace_step) {
        *rays = next_range(state, scene, step_ns);
        state->range_end = rays->end;
        state->step_end_ns = step_end_of(step_ns);
        if (!impl->trace_range(tracer, scene, state, rays, error))
            return TRACER_FAILED;
        rays->end = state->range_end;
        return rays->end == all ? TRACER_DONE : TRACER_MORE;
    }
    const uint64_t end_ns = step_end_of(step_ns);
    enum tracer_progress progress;
    do
        progress = impl->trace_step(tracer, scene, state, end_ns, error);
    while (progress == TRACER_MORE && step_ns == STEP_WITHOUT_END);
    *rays = (struct ray_range){.wave = &state->wave, .end = progress == TRACER_DONE ? all : 0};
    return progress;
}

/* Runs a step. `surfaces`: intersections become hits too. */
static enum tracer_progress do_step(struct tracer *tracer, struct gpu_scene *scene, struct trace_state *state,
                                    uint64_t step_ns, bool surfaces, struct error *error)
{
    const uint64_t start_ns = clock_now_ns();
    struct ray_range rays;
    gpu_push_group(tracer->device, tracer->impl->name);
    enum tracer_progress progress = intersect(tracer, scene, state, step_ns, &rays, error);
    if (progress != TRACER_FAILED && surfaces && rays.first < rays.end &&
        !make_surfaces(tracer, scene, &rays, error))
        progress = TRACER_FAILED;
    if (progress != TRACER_FAILED && !gpu_check(tracer->device, tracer->impl->name, error))
        progress = TRACER_FAILED;
    gpu_pop_group(tracer->device);
    state->in_progress = progress == TRACER_MORE;
    state->has_traced |= progress == TRACER_DONE;
    if (progress == TRACER_FAILED)
        return TRACER_FAILED;
    if (rays.first < rays.end && !tracer->impl->trace_step && step_ns > 0 && step_ns != STEP_WITHOUT_END)
        learn(state, scene, rays.end - rays.first, step_ns, clock_now_ns() - start_ns);
    state->traced_rays = rays.end;
    return progress;
}

enum tracer_progress tracer_trace_step(struct tracer *tracer, struct gpu_scene *scene, struct trace_state *state,
                                       uint64_t step_ns, struct error *error)
{
    if (!state->in_progress) {
        error_set(error, ERROR_INTERNAL, NULL, "%s: a step of no wave", tracer->impl->name);
        return TRACER_FAILED;
    }
    if (check_updated(tracer, error))
        return do_step(tracer, scene, state, step_ns, true, error);
    state->in_progress = false;
    return TRACER_FAILED;
}

void tracer_announce(struct tracer *tracer, struct gpu_scene *scene, const struct wave *wave)
{
    const struct ray_range rays = {.wave = wave, .end = wave->ray_count};
    if (!tracer->impl->announce)
        return;
    tracer->impl->announce(tracer, scene, wave);
    (void)make_surfaces(tracer, scene, &rays, NULL);
}

/* ---- layers of a view ---- */

bool tracer_layer_hits(struct tracer *tracer, struct gpu_scene *scene, const struct wave *wave, uint32_t layer,
                       struct error *error)
{
    const struct tracer_impl *impl = tracer->impl;
    const struct ray_range all = {.wave = wave, .end = wave->ray_count};
    if (!check_wave(tracer, scene, wave, error) || !check_updated(tracer, error))
        return false;
    gpu_push_group(tracer->device, impl->name);
    bool found = impl->layer_hits(tracer, scene, &all, layer, error) &&
                 make_surfaces(tracer, scene, &all, error) && gpu_check(tracer->device, impl->name, error);
    gpu_pop_group(tracer->device);
    return found;
}

/* ---- eyes ---- */

bool tracer_finds_eyes(const struct tracer *tracer, const struct gpu_scene *scene,
                       const struct frame_uniforms *frame)
{
    const struct tracer_impl *impl = tracer->impl;
    return impl->finds_eyes && impl->finds_eyes(tracer, scene, frame);
}

bool tracer_eye_hits(struct tracer *tracer, struct gpu_scene *scene, struct trace_state *state,
                     const struct eye_rays *rays, struct error *error)
{
    const struct tracer_impl *impl = tracer->impl;
    if (!check_updated(tracer, error))
        return false;
    gpu_push_group(tracer->device, impl->name);
    const bool found =
        impl->eye_hits(tracer, scene, state, rays, error) && gpu_check(tracer->device, impl->name, error);
    gpu_pop_group(tracer->device);
    state->has_traced |= found;
    return found;
}

/* ---- at once ---- */

static bool trace_at_once(struct tracer *tracer, struct gpu_scene *scene, const struct wave *wave, bool surfaces,
                          struct error *error)
{
    if (tracer->state && !trace_state_fits(tracer->state, tracer->impl, &tracer->options)) {
        trace_state_destroy(tracer->state); /* benchmarks change options between two waves */
        tracer->state = NULL;
    }
    if (!tracer->state)
        tracer->state = trace_state_create(tracer->impl, tracer->device, &tracer->options, error);
    return tracer->state && tracer_trace_begin(tracer, scene, wave, tracer->state, error) &&
           do_step(tracer, scene, tracer->state, STEP_WITHOUT_END, surfaces, error) == TRACER_DONE;
}

bool tracer_trace(struct tracer *tracer, struct gpu_scene *scene, const struct wave *wave, struct error *error)
{
    return trace_at_once(tracer, scene, wave, true, error);
}

bool tracer_intersect(struct tracer *tracer, struct gpu_scene *scene, const struct wave *wave, struct error *error)
{
    return trace_at_once(tracer, scene, wave, false, error);
}

bool tracer_surfaces(struct tracer *tracer, struct gpu_scene *scene, const struct wave *wave, struct error *error)
{
    const struct ray_range all = {.wave = wave, .end = wave->ray_count};
    return check_wave(tracer, scene, wave, error) && check_updated(tracer, error) &&
           make_surfaces(tracer, scene, &all, error) && gpu_check(tracer->device, tracer->impl->name, error);
}
