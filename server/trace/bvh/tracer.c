// SPDX-License-Identifier: MIT
// The tracer `bvh`: waves through the trees, within the time that a driver allows a dispatch.
#include "trace/bvh/tracer.h"

#include "bvh/layout.h"
#include "gpu/program.h"
#include "shared/bindings.h"
#include "trace/program.h"

#include <epoxy/gl.h>
#include <stdlib.h>

static struct tracer *bvh_create(struct gpu_device *device, const struct tracer_options *options,
                                 struct error *error)
{
    struct bvh *bvh = calloc(1, sizeof(*bvh));
    if (!bvh) {
        error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for a tracer");
        return NULL;
    }
    const bool is_paper = options->bvh.form == TRACER_FORM_PAPER;
    const bool is_wide = !is_paper && (options->bvh.nodes == BVH_NODES_EIGHT ||
                                       (options->bvh.nodes == BVH_NODES_AUTO && device->measured.nodes_of_eight));
    const struct bvh_form settings = {.spheres = is_paper, .one_order = is_paper, .wide = is_wide};
    scene_tree_init(&bvh->tree, device, &settings, &bvh->base.stats);
    return &bvh->base;
}

static void fill_bytes(struct bvh *bvh)
{
    bvh->base.stats.device_bytes = scene_tree_bytes(&bvh->tree);
}

static void bvh_reset(struct bvh *bvh)
{
    scene_tree_finish(&bvh->tree);
    fill_bytes(bvh);
}

static void bvh_destroy(struct tracer *tracer)
{
    struct bvh *bvh = (struct bvh *)tracer;
    bvh_reset(bvh);
    free(bvh);
}

static enum tracer_progress bvh_update(struct tracer *tracer, struct gpu_scene *scene,
                                       const struct tracer_update *update, struct error *error)
{
    struct bvh *bvh = (struct bvh *)tracer;
    enum tracer_progress progress = scene_tree_update(&bvh->tree, scene, update, tracer->step_end_ns, error);
    if (progress == TRACER_FAILED)
        bvh_reset(bvh);
    fill_bytes(bvh);
    return progress;
}

static void bvh_abandon(struct tracer *tracer)
{
    bvh_reset((struct bvh *)tracer);
}

static void bvh_report(const struct tracer *tracer, struct structure_rows *rows)
{
    scene_tree_report(&((const struct bvh *)tracer)->tree, rows);
}

static bool bvh_waits(struct tracer *tracer)
{
    return scene_tree_waits(&((struct bvh *)tracer)->tree);
}

/* ---- waves ---- */

static struct trace_state *bvh_state_create(struct gpu_device *device, const struct tracer_options *options,
                                            struct error *error)
{
    (void)device, (void)options;
    struct bvh_state *state = calloc(1, sizeof(*state));
    if (state)
        return &state->base;
    error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for the state of a wave");
    return NULL;
}

static void bvh_state_destroy(struct trace_state *state)
{
    struct bvh_state *own = (struct bvh_state *)state;
    gpu_buffer_finish(state->device, &own->places);
    gpu_buffer_finish(state->device, &own->depths);
    gpu_buffer_finish(state->device, &own->unfinished);
    free(own);
}

static uint64_t bvh_state_device_bytes(const struct trace_state *state)
{
    const struct bvh_state *own = (const struct bvh_state *)state;
    return own->places.capacity_bytes + own->depths.capacity_bytes + own->unfinished.capacity_bytes;
}

static bool bvh_trace_begin(struct tracer *tracer, struct gpu_scene *scene, struct trace_state *state,
                            struct error *error)
{
    struct bvh_state *own = (struct bvh_state *)state;
    own->packet_rays = bvh_packet_rays((struct bvh *)tracer, scene, &state->wave, error);
    own->unfinished_rays = 0;
    return own->packet_rays > 0;
}

static void set_uniforms(const struct bvh *bvh, const struct gpu_program *program, const struct gpu_scene *scene,
                         const struct wave *wave)
{
    gpu_uniform_float(program, "bvh_packet_reach", bvh_packet_reach(scene, wave));
    if (scene_tree_only_instance(&bvh->tree) != BVH_NONE) {
        gpu_uniform_uint(program, "bvh_instance", scene_tree_only_instance(&bvh->tree));
        return;
    }
    gpu_uniform_uint(program, "bvh_top_count", bvh->tree.top.element_count);
    if (bvh_is_packed(&bvh->tree.top.settings)) {
        gpu_uniform_vec(program, "bvh_top_grid_lower", 3, bvh->tree.top.grid.lower);
        gpu_uniform_vec(program, "bvh_top_cells_per_unit", 3, bvh->tree.top.grid.cells_per_unit);
    }
}

/* How dispatches of a wave stay within the time that a driver allows. */
enum budget {
    BUDGET_NONE,   /* software GL traces short ranges, and no driver ends them */
    BUDGET_STOPS,  /* rays left unfinished stop the slice */
    BUDGET_RESUMES /* dispatches follow one another until all rays are finished */
};

static enum budget budget_of(const struct bvh *bvh, const struct trace_state *state)
{
    if (bvh->base.device->facts.dispatch_rounds_max == 0)
        return BUDGET_NONE;
    return state->wave.stopped && !state->patient ? BUDGET_STOPS : BUDGET_RESUMES;
}

static uint32_t rays_of_a_dispatch(const struct ray_range *rays)
{
    const uint32_t count = rays->end - rays->first;
    return count < TRACE_DISPATCH_RAYS_MAX ? count : TRACE_DISPATCH_RAYS_MAX;
}

static void run_and_stop(struct bvh *bvh, const struct gpu_program *program, const struct gpu_scene *scene,
                         const struct ray_range *rays, const struct trace_program_source *source)
{
    gpu_buffer_bind_storage(rays->wave->stopped, BIND_BVH_UNFINISHED);
    gpu_uniform_uint(program, "unfinished_word", rays->wave->stopped_word);
    gpu_uniform_uint(program, "bvh_budget_max", bvh->base.device->facts.ray_tests_max);
    trace_program_run(program, scene, rays, source);
}

/* Dispatches some rays once, new ones or unfinished ones, and waits. */
static bool run_once(struct bvh *bvh, const struct gpu_program *program, const struct gpu_scene *scene,
                     struct bvh_state *own, const struct ray_range *rays,
                     const struct trace_program_source *source, struct error *error)
{
    struct gpu_device *device = bvh->tree.store.device;
    const uint32_t count = rays->end - rays->first;
    const bool is_new = own->unfinished_rays == 0;
    uint32_t unfinished = 0;
    const uint32_t place_texels = bvh->tree.store.settings.wide ? BVH_WIDE_PLACE_TEXELS : 1;
    if (is_new &&
        (!gpu_buffer_reserve(device, &own->places, (size_t)count * place_texels * sizeof(uvec4), error) ||
         !gpu_buffer_reserve(device, &own->depths, count * TRACE_DEPTH_BYTES, error) ||
         !gpu_buffer_reserve(device, &own->unfinished, sizeof(unfinished), error)))
        return false;
    gpu_buffer_clear(device, &own->unfinished, 0);
    gpu_buffer_bind_storage(&own->unfinished, BIND_BVH_UNFINISHED);
    gpu_buffer_bind_storage(&own->places, BIND_BVH_PLACES);
    gpu_buffer_bind_storage(&own->depths, BIND_OPTICAL_DEPTHS);
    gpu_uniform_uint(program, "unfinished_word", 0);
    gpu_uniform_uint(program, "bvh_budget_max", device->facts.ray_tests_max);
    gpu_uniform_uint(program, "is_first_part", is_new);
    gpu_uniform_uint(program, "resumes", !is_new);
    trace_program_run(program, scene, rays, source);
    gpu_buffer_read(device, &own->unfinished, 0, &unfinished, sizeof(unfinished));
    own->unfinished_rays = unfinished ? count : 0;
    return !device->lost || gpu_check(device, "tracing", error);
}

/* Dispatches until all rays are finished or the step is over: a scene can be built whose rays take so long that
 * neither a cancel nor other frames could wait for their end. */
static bool run_patiently(struct bvh *bvh, const struct gpu_program *program, const struct gpu_scene *scene,
                          struct trace_state *state, const struct ray_range *rays,
                          const struct trace_program_source *source, struct error *error)
{
    struct bvh_state *own = (struct bvh_state *)state;
    state->range_end = rays->first;
    do {
        const struct ray_range left = {.wave = rays->wave, .first = state->range_end, .end = rays->end};
        const uint32_t count = own->unfinished_rays ? own->unfinished_rays : rays_of_a_dispatch(&left);
        const struct ray_range some = {.wave = rays->wave, .first = left.first, .end = left.first + count};
        if (!run_once(bvh, program, scene, own, &some, source, error))
            return false;
        if (own->unfinished_rays == 0)
            state->range_end = some.end;
    } while (state->range_end < rays->end && !step_is_over(state->step_end_ns));
    return true;
}

static bool bvh_trace_range(struct tracer *tracer, struct gpu_scene *scene, struct trace_state *state,
                            const struct ray_range *rays, struct error *error)
{
    struct bvh *bvh = (struct bvh *)tracer;
    const struct bvh_form *settings = &bvh->tree.store.settings;
    const struct wave *wave = &state->wave;
    const struct bvh_state *own = (const struct bvh_state *)state;
    const uint32_t packet_rays = own->packet_rays;
    const enum budget budget = budget_of(bvh, state);
    struct gpu_define defines[9] = {0};
    size_t n = 0;
    if (settings->spheres)
        defines[n++] = (struct gpu_define){"BVH_SPHERES", "1"};
    if (settings->wide)
        defines[n++] = (struct gpu_define){"BVH_WIDE", "1"};
    if (bvh_is_packed(&(struct bvh_form){.spheres = settings->spheres, .whole = settings->whole}))
        defines[n++] = (struct gpu_define){"BVH_PACKED", "1"};
    if (scene_tree_only_instance(&bvh->tree) != BVH_NONE)
        defines[n++] = (struct gpu_define){"BVH_ONE_INSTANCE", "1"};
    /* A common origin in the world becomes many in the object spaces of moving instances. */
    if (wave->shared_origin && packet_rays > 1 && !scene->has_motion)
        defines[n++] = (struct gpu_define){"SHARED_ORIGIN", "1"};
    if (bvh->tree.store.deforms_in_shutter && wave->times) /* otherwise all rays meet the vertices of the first
                                                              pose */
        defines[n++] = (struct gpu_define){"BVH_DEFORMS_IN_SHUTTER", "1"};
    if (budget != BUDGET_NONE)
        defines[n++] = (struct gpu_define){"BVH_BUDGET", "1"};
    if (budget == BUDGET_RESUMES)
        defines[n++] = (struct gpu_define){"BVH_RESUMES", "1"};
    const struct trace_program_source source = {
        .traverse = "bvh/traverse.glsl",
        .defines = defines,
        .packet_rays = packet_rays,
        .rays_a_dispatch = TRACE_DISPATCH_RAYS_MAX,
    };
    const struct gpu_program *program = trace_program_get(scene, wave, &source, error);
    if (!program)
        return false;
    scene_tree_bind(&bvh->tree);
    set_uniforms(bvh, program, scene, wave);
    if (budget == BUDGET_RESUMES)
        return run_patiently(bvh, program, scene, state, rays, &source, error);
    if (budget == BUDGET_STOPS)
        run_and_stop(bvh, program, scene, rays, &source);
    else
        trace_program_run(program, scene, rays, &source);
    return true;
}

static void bvh_announce(struct tracer *tracer, struct gpu_scene *scene, const struct wave *wave)
{
    struct bvh *bvh = (struct bvh *)tracer;
    struct bvh_state state = {.base.wave = *wave, .packet_rays = bvh_packet_rays_expected(bvh, wave)};
    const struct ray_range rays = {.wave = &state.base.wave, .end = wave->ray_count};
    (void)bvh_trace_range(tracer, scene, &state.base, &rays, NULL);
}

const struct tracer_impl tracer_bvh_impl = {
    .name = "bvh",
    .finds_first_hits = true,
    .depends_on = CHANGED_GEOMETRY | CHANGED_DEFORMED | CHANGED_INSTANCES,
    .minimum_rays = TRACE_RAYS_MULTIPLE,
    .create = bvh_create,
    .destroy = bvh_destroy,
    .update = bvh_update,
    .abandon = bvh_abandon,
    .report = bvh_report,
    .waits = bvh_waits,
    .state_create = bvh_state_create,
    .state_destroy = bvh_state_destroy,
    .state_device_bytes = bvh_state_device_bytes,
    .trace_begin = bvh_trace_begin,
    .trace_range = bvh_trace_range,
    .announce = bvh_announce,
};
