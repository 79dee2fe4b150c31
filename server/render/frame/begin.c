/* SPDX-License-Identifier: MIT */
/* The start of a frame: brings the scene, the tracers and the lights to its state, and reserves the buffers of its
 * steps. */
#include "render/frame/state.h"

#include "base/clock.h"
#include "render/context/camera.h"
#include "render/frame/choices.h"
#include "render/waves/compact.h"
#include "render/context/request.h"
#include "render/passes/ground/ground.h"
#include "render/picture/pixel_filter.h"
#include "shared/bindings.h"
#include "shared/layers.h"

#include <epoxy/gl.h>
#include <math.h>
#include <string.h>

/* Of a slice at first: few paths are longer, and waves without rays cost some dispatches each. */
#define WAVES_QUEUED_MAX 16
/* Of a step that uploads and integrates an environment. */
#define ENVIRONMENT_STEP_NS UINT64_C(6000000)
/* Of a step in which a thread packs what is large of the scene. */
#define UPDATE_STEP_NS UINT64_C(6000000)
/* Of a step that reserves memory. */
#define RESERVE_NS UINT64_C(3000000)
/* Pixels that are rasterised together: more take a while to reserve and to clear. */
#define STRIP_PIXELS_MAX (1u << 22)
/* The same of all samples that are rasterised together: 64 MiB. */
#define LAYERS_PIXELS_MAX (1u << 23)
/* The number of samples that texture filtering assumes for a picture that accumulates without an end. */
#define SAMPLES_GOING_ON 16

const struct tracer_impl *frame_find_tracer(const struct frame_renderer *renderer, unsigned number,
                                            const char *field, struct error *error)
{
    bool stands_in = renderer->stand_in && renderer->stand_in_number == number;
    return stands_in ? renderer->stand_in : tracer_find(number, field, error);
}

static bool check_request(const struct frame_renderer *renderer, const struct frame_request *request,
                          struct error *error)
{
    return frame_request_check(request, error) && frame_find_tracer(renderer, request->tracer, "tracer", error) &&
           (!request->compare || frame_find_tracer(renderer, request->compare_with, "compare_with", error));
}

/* Whether a node of surfaces is in a light group. */
static bool has_grouped_surfaces(const struct gpu_scene *copy)
{
    for (uint32_t i = 0; i < copy->instance_count; i++)
        if (copy->instances[i].flags >> INSTANCE_LIGHT_GROUP_SHIFT & INSTANCE_LIGHT_GROUP_MASK)
            return true;
    return false;
}

/* A surface that glows is in the group of its node, which stored samples do not hold. */
static bool check_groups(const struct frame_renderer *renderer, struct error *error)
{
    const struct render_context *context = &renderer->work->context;
    if (!(context->request.layers & LAYER_BITS_LIGHT_GROUPS) || !context->tracer->impl->sampled ||
        !has_grouped_surfaces(context->scene))
        return true;
    error_set(error, ERROR_UNSUPPORTED, "layers",
              "the samples of the tracer %s do not tell which node glows, and surfaces are in light groups",
              context->tracer->impl->name);
    return error_remedy(error,
                        "choose bvh or another tracer of triangles, or put lights and the environment alone "
                        "into groups");
}

/* A display's values are no light that adds up. */
static bool check_light(const struct scene *scene, const struct frame_request *request, struct error *error)
{
    if (!(request->layers & LAYER_BITS_LIGHT) || !scene->environment.display_values)
        return true;
    error_set(error, ERROR_UNSUPPORTED, "layers",
              "the light of this scene is a display's values, which do not add up");
    return error_remedy(error, "leave out layers of light");
}

/* Whether the kept picture shows the same as this frame, once the scene has been updated. */
static bool may_go_on(const struct frame_renderer *renderer, const struct frame_request *request)
{
    return renderer->kept_samples > 0 && !renderer->history.is_moving &&
           request->samples <= UINT32_MAX - renderer->kept_samples &&
           frame_request_adds_to(&renderer->kept_request, request);
}

static bool is_alone(const struct frame_renderer *renderer)
{
    return renderer->shared->frames == (renderer->phase != PHASE_IDLE);
}

bool frame_may_begin(const struct frame_renderer *renderer, const struct scene *scene,
                     const struct scene_motion *motion, const struct frame_request *request)
{
    struct error refused = {0}; /* by frame_begin, before it changes anything */
    const struct tracer_impl *const wanted[] = {
        frame_find_tracer(renderer, request->tracer, "tracer", &refused),
        request->compare ? frame_find_tracer(renderer, request->compare_with, "compare_with", &refused) : NULL,
    };
    if (is_alone(renderer) || refused.kind != ERROR_NONE)
        return true;
    const struct tracer_impl *impls[2]; /* that are shared with the other frames */
    size_t count = 0;
    for (size_t i = 0; i < 2; i++)
        if (wanted[i] && !(wanted[i]->depends_on & CHANGED_VIEW))
            impls[count++] = wanted[i];
    const struct gpu_scene *copy = &renderer->shared->copy;
    const struct integrator *integrator = integrator_by_number(request->integrator);
    const bool lit = integrator && integrator->lit_by_surfaces;
    return gpu_scene_is_current(copy, scene, motion) && (!lit || gpu_scene_emitters_are_current(copy)) &&
           tracer_set_are_free(&renderer->shared->tracers, impls, count, &request->tracer_options);
}

/* An update that failed leaves no revision. */
static void note_showing(struct frame_scene *shared, uint64_t revision_before, const struct scene_changes *changes)
{
    if (shared->copy.revision != revision_before || changes->bits)
        shared->showing++;
}

static bool update_scene(struct frame_renderer *renderer, const struct scene *scene,
                         const struct scene_motion *motion, struct error *error)
{
    struct render_context *context = &renderer->work->context;
    struct frame_scene *shared = renderer->shared;
    struct scene_changes changes = {0};
    uint64_t revision_before = shared->copy.revision;
    bool updated = gpu_scene_update(&shared->copy, scene, motion, &changes, &context->times, error) &&
                   (!renderer->work->passes.integrator->lit_by_surfaces ||
                    gpu_scene_update_emitters(&shared->copy, &changes, &context->times, error));
    change_history_note(&shared->changes, updated ? changes.bits : CHANGED_SCENE);
    note_showing(shared, revision_before, &changes);
    if (!updated)
        return false;
    /* What others moved and put back may be in other parts of a tracer's structure, which are not added up. */
    if (renderer->kept_showing != shared->showing)
        renderer->samples_before = 0;
    renderer->result.uploaded_bytes = changes.uploaded_bytes;
    context->features = scene_features_of(scene);
    return true;
}

/* A step of it. */
static bool update_environment(struct frame_renderer *renderer, bool *done, struct error *error)
{
    struct render_context *context = &renderer->work->context;
    struct gpu_scene *copy = &renderer->shared->copy;
    uint64_t start_ns = clock_now_ns(), end_ns = start_ns + ENVIRONMENT_STEP_NS;
    bool updated = gpu_scene_upload_environment(copy, end_ns, done, error);
    if (!updated || !*done)
        return updated;
    struct environment *environment = &renderer->shared->environment;
    updated = environment_update(environment, renderer->device, copy, end_ns, done, error);
    bool lamps =
        environment->default_light && copy->has_lamps && renderer->work->passes.integrator->lit_by_surfaces;
    context->environment = lamps ? &renderer->shared->no_environment : environment;
    stage_times_add(&context->times, STAGE_BUILD, CLOCK_CPU, 0, start_ns, clock_now_ns() - start_ns);
    return updated;
}

static struct tracer *take_tracer(struct frame_renderer *renderer, unsigned number, const char *field,
                                  struct error *error)
{
    const struct tracer_impl *impl = frame_find_tracer(renderer, number, field, error);
    if (!tracer_check_motion(impl, &renderer->shared->copy, error))
        return NULL;
    return tracer_set_take(frame_tracers(renderer, impl), renderer->device, impl,
                           &renderer->work->context.request.tracer_options, error);
}

static bool take_tracers(struct frame_renderer *renderer, struct error *error)
{
    struct render_context *context = &renderer->work->context;
    const struct frame_request *request = &context->request;
    renderer->tracer = context->tracer = take_tracer(renderer, request->tracer, "tracer", error);
    if (!renderer->tracer ||
        !frame_work_trace_by(renderer->work, &renderer->work->trace_state, renderer->tracer, error))
        return false;
    if (frame_is_from_layers(request) || request->hidden_layer)
        return frame_key_take(renderer, error);
    if (!request->compare)
        return true;
    struct tracer_set *tracers = frame_tracers(renderer, renderer->tracer->impl);
    renderer->second = request->compare_with == request->tracer
                           ? tracer_set_take_again(tracers, renderer->tracer)
                           : take_tracer(renderer, request->compare_with, "compare_with", error);
    return renderer->second;
}

static void give_tracer(struct frame_renderer *renderer, const struct tracer *tracer)
{
    if (tracer)
        tracer_set_give(frame_tracers(renderer, tracer->impl), tracer);
}

/* The copy is empty then. */
static void give_up_update(struct frame_scene *shared)
{
    gpu_scene_bring_abandon(&shared->copy);
    change_history_note(&shared->changes, CHANGED_SCENE);
    shared->showing++;
}

void frame_end(struct frame_renderer *renderer)
{
    give_tracer(renderer, renderer->tracer);
    give_tracer(renderer, renderer->second);
    give_tracer(renderer, renderer->key_tracer);
    renderer->tracer = renderer->second = renderer->key_tracer = NULL;
    if (renderer->phase == PHASE_UPDATE)
        give_up_update(renderer->shared);
    if (renderer->phase != PHASE_IDLE)
        renderer->shared->frames--;
    renderer->phase = PHASE_IDLE;
    for (int i = 0; i < 2 && renderer->work; i++)
        gpu_readback_drop(&renderer->work->copies[i]);
    if (renderer->work)
        slices_ahead_drop(&renderer->work->ahead);
    frame_work_give(renderer->shared, renderer->work);
    renderer->work = NULL;
}

static bool begin_comparison(struct frame_renderer *renderer, struct error *error)
{
    struct render_context *context = &renderer->work->context;
    const struct frame_request *request = &context->request;
    context->comparison = NULL;
    if (!request->compare) {
        comparison_destroy(renderer->work->comparison);
        renderer->work->comparison = NULL;
        return true;
    }
    uint64_t start_ns = clock_now_ns();
    if (!renderer->work->comparison)
        renderer->work->comparison = comparison_create(renderer->device, error);
    if (!renderer->work->comparison)
        return false;
    comparison_begin(renderer->work->comparison, &renderer->shared->copy, context->tracer, renderer->second,
                     request->compare_far_share);
    context->comparison = renderer->work->comparison;
    context_add_cpu_time(context, STAGE_COMPARE, start_ns);
    return true;
}

static uint32_t at_least(uint32_t value, uint32_t minimum)
{
    return value > minimum ? value : minimum;
}

bool frame_reserve_waves(struct frame_renderer *renderer, struct error *error)
{
    struct render_context *context = &renderer->work->context;
    return context_reserve(context, renderer->slice_rays_max, error) &&
           layers_reserve(&renderer->work->layers, context, renderer->slice_rays_max, error) &&
           wave_passes_reserve(&renderer->work->passes, context, error);
}

static uint32_t slice_rays(const struct frame_renderer *renderer)
{
    if (renderer->wanted_slice_pixels)
        return renderer->wanted_slice_pixels;
    return choices_slice_rays(renderer->device, renderer->work->context.request.compare);
}

/* A wave for each bounce and one before them, or one alone where nothing sends rays on; more if a slice has needed
 * more. */
static uint32_t waves_queued(const struct frame_renderer *renderer)
{
    const struct render_context *context = &renderer->work->context;
    const uint32_t depth =
        context->request.depth < WAVES_QUEUED_MAX ? context->request.depth + 1 : WAVES_QUEUED_MAX;
    const bool bounces = wave_passes_expect_bounces(&renderer->work->passes, context);
    return at_least(renderer->waves_needed, bounces ? depth : 1);
}

/* Rasterised samples are together only if that needs no more strips: in each all of the scene is drawn. */
static uint32_t sample_shift_max(const struct frame_renderer *renderer)
{
    const struct frame_request *request = &renderer->work->context.request;
    const uint64_t strip_pixels = (uint64_t)request->width * renderer->strip_rows;
    uint32_t shift = 0;
    while (2u << shift <= SAMPLES_TOGETHER_MAX && 2u << shift <= request->samples &&
           (!renderer->rasterise || strip_pixels << (shift + 1) <= LAYERS_PIXELS_MAX))
        shift++;
    return shift;
}

/* Room for more than the first hits is needed by what they send on, and to ask several lights at once. Memory that
 * is touched for the first time takes longer than most passes of a picture. */
static uint32_t rays_a_path(const struct frame_renderer *renderer)
{
    const struct render_context *context = &renderer->work->context;
    const struct wave_passes *passes = &renderer->work->passes;
    const bool once = !context->request.compare && !wave_passes_expect_bounces(passes, context) &&
                      ground_shadow_rays(context, passes->integrator) <= 1;
    return once ? 1 : CHOICES_WAVE_PER_SLICE;
}

static bool has_motion_layer(const struct frame_renderer *renderer)
{
    return frame_request_layers(&renderer->request) & LAYER_BIT_MOTION;
}

/* Stored samples do not know what they are part of. */
static bool check_moves(const struct frame_renderer *renderer, struct error *error)
{
    const struct tracer_impl *impl = renderer->tracer->impl;
    if (!has_motion_layer(renderer) || !renderer->work->layers.moves.has_any || renderer->rasterise ||
        !impl->sampled)
        return true;
    error_set(error, ERROR_UNSUPPORTED, "layers", "the samples that %s holds do not say what moves them",
              impl->name);
    return error_remedy(error, "rasterise first hits, take another tracer, or leave out motion");
}

/* What it needs is known before any of it is reserved. */
static bool size_frame(struct frame_renderer *renderer, struct error *error)
{
    struct render_context *context = &renderer->work->context;
    if (!picture_begin(renderer->target, context, renderer->samples_before, error))
        return false;
    renderer->rasterise = !renderer->key_tracer && choices_rasterise(context);
    if (!check_moves(renderer, error))
        return false;
    renderer->strip_rows = picture_strip_rows(renderer->target, STRIP_PIXELS_MAX);
    renderer->sample_shift_max = sample_shift_max(renderer);
    uint32_t rays = slice_rays(renderer);
    uint64_t all = (uint64_t)picture_slot_count(renderer->target) << renderer->sample_shift_max;
    rays = rays < all ? rays : (uint32_t)all;
    renderer->slice_rays_max = renderer->slices.slice_rays = rays;
    uint32_t wave_rays = rays * rays_a_path(renderer);
    if (renderer->wanted_wave_rays)
        wave_rays = renderer->wanted_wave_rays;
    context->wave_capacity = at_least(wave_rays, rays);
    context->counts_on_host =
        !renderer->queues_ahead || context->request.compare || context->tracer->impl->traces_on_host;
    context->waves_queued = waves_queued(renderer);
    context->sums_in_picture = context->counts_on_host && renderer->target->samples == 1 &&
                               renderer->target->layers & 1u << LAYER_BEAUTY && !context->comparison &&
                               !renderer->key_tracer && !context->tile_samples && !denoise_is_wanted(context);
    layers_begin(&renderer->work->layers, context, !frame_is_eyes_pass(renderer));
    return check_groups(renderer, error);
}

static bool reserve_frame(struct frame_renderer *renderer, struct error *error)
{
    struct render_context *context = &renderer->work->context;
    if (!picture_reserve(renderer->target, context, renderer->samples_before, error) ||
        !denoise_sums_begin(&renderer->denoise, context, renderer->target, renderer->samples_before,
                            &renderer->history, error))
        return false;
    renderer->picture.denoised = NULL;
    if (renderer->rasterise && !primary_reserve(&renderer->work->primary, context, renderer->strip_rows,
                                                1u << renderer->sample_shift_max, error))
        return false;
    if (!frame_reserve_waves(renderer, error))
        return false;
    compact_go_on(context);
    return true;
}

/* They take a third of a millisecond, and stay from frame to frame. */
static void fill_filter(struct render_context *context)
{
    _Static_assert(sizeof(context->uniforms.filter_places) / sizeof(float) > PIXEL_FILTER_INTERVALS,
                   "room for all places");
    if (!context->spread || (context->has_filter && context->filter == context->request.filter))
        return;
    pixel_filter_places((float *)context->uniforms.filter_places, context->request.filter);
    context->filter = context->request.filter;
    context->has_filter = true;
}

/* Once it is known what the frame goes on from. */
static void limit_samples(const struct frame_renderer *renderer, struct frame_request *request)
{
    uint32_t before = renderer->samples_before, maximum = request->samples_max;
    if (!request->accumulate || !before)
        return;
    uint32_t lacking = !maximum ? UINT32_MAX : maximum > before ? maximum - before : 0;
    if (request->noise > 0.0f && renderer->picture.noise.going_on == 0)
        lacking = 0;
    request->samples = request->samples < lacking ? request->samples : lacking;
}

static const struct gpu_texel_formats texel_formats = {.of_unit = {[UNIT_TANGENTS] = GL_R32UI,
                                                                   [UNIT_COLOURS] = GL_RGBA16,
                                                                   [UNIT_SPHERE_MATERIALS] = GL_R32UI,
                                                                   [UNIT_TEXELS] = GL_RGBA8,
                                                                   [UNIT_SHADE_ENVIRONMENT] = GL_R32F,
                                                                   [UNIT_RAY_TIMES] = GL_R32F}};

/* While the scene is brought to a device that has nothing of it: the program that depends on its materials alone,
 * of what is to be met exactly. A guess that is wrong costs time, so where more decides nothing is announced. */
static void announce_first(struct frame_renderer *renderer)
{
    struct render_context *context = &renderer->work->context;
    const struct scene *scene = renderer->scene;
    struct tracer kind = {.impl =
                              frame_find_tracer(renderer, context->request.tracer, "tracer", &(struct error){0})};
    const bool tells = !renderer->announced_first && kind.impl && !kind.impl->sampled &&
                       !context->request.compare && !frame_is_from_layers(&renderer->request) &&
                       !context->request.hidden_layer && !renderer->work->passes.integrator->lit_by_surfaces &&
                       renderer->shared->copy.revision == 0 && !renderer->motion &&
                       scene->objects[OBJECT_SPHERES].count == 0;
    renderer->announced_first = true;
    if (!tells || context->request.samples == 0)
        return;
    context->features = scene_features_of(scene);
    context->sampled_hits = false;
    context->tracer = &kind;
    gpu_program_announce(renderer->device, &texel_formats);
    wave_passes_announce_hits(&renderer->work->passes, context);
    gpu_program_announce(renderer->device, NULL);
    context->tracer = NULL;
}

/* Of a frame that is made in one pass: what depends on no structure. */
static void announce_shading(struct frame_renderer *renderer)
{
    struct render_context *context = &renderer->work->context;
    gpu_program_announce(renderer->device, &texel_formats);
    context->sampled_hits = !renderer->rasterise && context->tracer->impl->sampled;
    wave_passes_announce_shading(&renderer->work->passes, context);
    picture_announce(renderer->target, context);
    gpu_program_announce(renderer->device, NULL);
}

/* Threads compile while this one goes on. */
static void announce_programs(struct frame_renderer *renderer)
{
    struct render_context *context = &renderer->work->context;
    struct wave_passes *passes = &renderer->work->passes;
    gpu_program_announce(renderer->device, &texel_formats);
    /* What takes longest begins first; the rest is in the order of its use. */
    if (frame_is_eyes_pass(renderer)) {
        frame_key_announce(renderer);
    } else {
        context->sampled_hits = !renderer->rasterise && context->tracer->impl->sampled;
        if (!renderer->rasterise)
            primary_announce(context, false);
        wave_passes_announce_long(passes, context);
        if (renderer->rasterise)
            primary_announce(context, true);
        wave_passes_announce(passes, context);
    }
    picture_announce(renderer->target, context);
    gpu_program_announce(renderer->device, NULL);
    renderer->announced = true;
}

/* What needs no memory of the device. */
static bool set_up(struct frame_renderer *renderer, struct error *error)
{
    struct render_context *context = &renderer->work->context;
    const struct frame_request *request = &context->request;
    limit_samples(renderer, &context->request);
    camera_fill_uniforms(&context->uniforms, request, &renderer->shared->copy);
    frame_key_limit_rows(renderer, &context->request); /* the camera is that of all of them */
    environment_fill_uniforms(context->environment, &context->uniforms, &renderer->shared->copy);
    context->display_values = renderer->shared->copy.scene->environment.display_values;
    context->uniforms.depth = request->depth;
    context->uniforms.far_width[2] = frame_request_hides_environment(request) ? 1.0f : 0.0f;
    /* Those of a texel of a layer all pass through its middle. */
    context->spread = !frame_is_layer_pass(renderer) && (request->samples > 1 || frame_request_goes_on(request));
    context->uniforms.far_width[1] =
        context->spread ? 1.0f / sqrtf(frame_request_goes_on(request) ? SAMPLES_GOING_ON : (float)request->samples)
                        : 1.0f;
    fill_filter(context);
    context->uniforms.seed = (uint32_t)(request->seed ^ request->seed >> 32);
    return size_frame(renderer, error);
}

/* Once its tracers are what the scene is. */
static bool get_ready(struct frame_renderer *renderer, struct error *error)
{
    struct render_context *context = &renderer->work->context;
    const struct frame_request *request = &context->request;
    const bool goes_on = renderer->samples_before > 0;
    if (!begin_comparison(renderer, error) || (renderer->key_tracer && !frame_key_set_pass(renderer, error)) ||
        !set_up(renderer, error))
        return false;
    if (request->samples && !renderer->announced)
        announce_programs(renderer);
    if (!denoise_history_begin(&renderer->history, context, renderer->shared->showing, goes_on, error) ||
        !reserve_frame(renderer, error) || !gpu_check_reset(renderer->device, "beginning a frame", error))
        return false;
    renderer->result.revision = renderer->shared->copy.revision;
    renderer->sample = renderer->plane = renderer->band = renderer->copied = 0;
    renderer->copying = false;
    /* A picture that has all its samples is only output again. */
    renderer->phase = request->samples ? PHASE_SAMPLE : PHASE_DENOISE;
    renderer->announced = false;
    denoise_begin(&renderer->work->denoise);
    return request->samples || context_upload_uniforms(context, error);
}

static enum tracer_progress bring(struct frame_renderer *renderer, const struct tracer *tracer,
                                  struct error *error)
{
    struct render_context *context = &renderer->work->context;
    struct frame_scene *shared = renderer->shared;
    struct stage_times *spans = &context->collected;
    const uint64_t start_ns = clock_now_ns();
    spans->origin_ns = context->times.origin_ns;
    spans->count = 0;
    const struct tracer_update update = {.view = &renderer->view, .times = spans};
    enum tracer_progress progress = tracer_set_bring(frame_tracers(renderer, tracer->impl), tracer, &shared->copy,
                                                     &update, shared->step_ns, error);
    if (tracer != renderer->second || tracer == renderer->tracer)
        context_add_times(context, spans);
    else /* a structure that is no part of what the frame's own tracer cost */
        context_add_cpu_time(context, STAGE_COMPARE, start_ns);
    return progress;
}

/* What has not failed for good is gone on with by the next step. */
static bool end_reserving(struct frame_renderer *renderer, bool made, const struct error *failed,
                          struct error *error)
{
    bool put_off = gpu_reserve_end(renderer->device);
    if (!made && !put_off && error && error->kind == ERROR_NONE)
        *error = *failed;
    return made || put_off;
}

static bool get_ready_in_steps(struct frame_renderer *renderer, struct error *error)
{
    struct error failed = {0};
    bool lit = false;
    gpu_reserve_begin(renderer->device, RESERVE_NS);
    bool ready = update_environment(renderer, &lit, &failed) && (!lit || get_ready(renderer, &failed));
    return end_reserving(renderer, ready, &failed, error);
}

/* While its structure is built. */
static bool announce_early(struct frame_renderer *renderer, struct error *error)
{
    struct error failed = {0};
    bool lit = false;
    if (renderer->announced_early || renderer->second || renderer->key_tracer)
        return true;
    gpu_reserve_begin(renderer->device, RESERVE_NS);
    bool done = update_environment(renderer, &lit, &failed) && (!lit || set_up(renderer, &failed));
    renderer->announced_early = done && lit;
    if (renderer->announced_early && renderer->work->context.request.samples)
        announce_shading(renderer);
    return end_reserving(renderer, done, &failed, error);
}

bool frame_reserve_pixels(struct frame_renderer *renderer, struct error *error)
{
    struct error failed = {0};
    gpu_reserve_begin(renderer->device, RESERVE_NS);
    bool reserved = picture_reserve_pixels(&renderer->picture, &renderer->work->context, &failed);
    return end_reserving(renderer, reserved, &failed, error);
}

static enum tracer_progress bring_key(struct frame_renderer *renderer, struct error *error)
{
    const struct tracer *tracer = renderer->key_tracer;
    enum tracer_progress progress = bring(renderer, tracer, error);
    if (progress != TRACER_DONE)
        return progress;
    renderer->key_built = true;
    if (tracer == renderer->tracer)
        return progress;
    renderer->result.uploaded_bytes += tracer->stats.uploaded_bytes;
    renderer->result.structure_bytes += tracer->stats.device_bytes;
    tracer_tell(tracer, &renderer->result.structure);
    return progress;
}

bool frame_build(struct frame_renderer *renderer, struct error *error)
{
    const struct tracer_stats *stats = &renderer->tracer->stats;
    enum tracer_progress progress = TRACER_DONE;
    if (!renderer->built) {
        progress = bring(renderer, renderer->tracer, error);
        if (progress != TRACER_DONE)
            return progress == TRACER_MORE && announce_early(renderer, error);
        renderer->built = true;
        renderer->result.uploaded_bytes += stats->uploaded_bytes;
        renderer->result.structure_bytes = stats->device_bytes;
        tracer_tell(renderer->tracer, &renderer->result.structure);
    }
    if (renderer->second && !renderer->second_built) {
        progress = bring(renderer, renderer->second, error);
        renderer->second_built = progress == TRACER_DONE;
    }
    if (renderer->key_tracer && !renderer->key_built)
        progress = bring_key(renderer, error);
    if (progress != TRACER_DONE)
        return progress == TRACER_MORE;
    return get_ready_in_steps(renderer, error);
}

/* Of a frame of several views that of one; of one whose eyes are made from layers the key view. */
static struct trace_view view_of(const struct frame_request *request)
{
    const struct frame_camera camera = frame_key_camera(request);
    struct trace_view view = {
        .fov_y = camera.fov_y,
        .ortho_height = camera.ortho_height,
        .near = camera.near,
    };
    frame_view_size(request, &view.width, &view.height);
    memcpy(view.world_from_view, camera.world_from_view, sizeof(view.world_from_view));
    return view;
}

static bool begin(struct frame_renderer *renderer, const struct scene *scene, const struct scene_motion *motion,
                  const struct frame_request *request, struct error *error)
{
    if (!check_request(renderer, request, error) || !check_light(scene, request, error))
        return false;
    renderer->work = frame_work_take(renderer->shared, integrator_by_number(request->integrator), error);
    if (!renderer->work)
        return false;
    struct render_context *context = &renderer->work->context;
    context->request = renderer->request = *request;
    context->layer_tracer = NULL;
    context->marked_key = NULL;
    renderer->pass = PASS_UNKNOWN;
    renderer->announced = renderer->announced_early = renderer->announced_first = false;
    renderer->target = &renderer->picture;
    renderer->result = (struct frame_result){0};
    renderer->view = view_of(request);
    renderer->samples_before = may_go_on(renderer, request) ? renderer->kept_samples : 0;
    renderer->kept_samples = 0; /* until this one is finished */
    stage_times_begin(&context->times);
    context->wave_number = 0;
    renderer->scene = scene;
    renderer->motion = motion;
    return true;
}

/* The first step of each, which may read the scene's motion. */
static bool begin_tracers(struct frame_renderer *renderer, struct error *error)
{
    renderer->built = renderer->second_built = renderer->key_built = false;
    picture_restart(&renderer->picture);
    if (!frame_build(renderer, error))
        return false;
    if (renderer->built)
        return true;
    return (!renderer->second || bring(renderer, renderer->second, error) != TRACER_FAILED) &&
           (!renderer->key_tracer || renderer->key_tracer == renderer->tracer ||
            bring(renderer, renderer->key_tracer, error) != TRACER_FAILED);
}

static bool bring_scene(struct frame_renderer *renderer, bool *done, struct error *error)
{
    struct error failed = {0};
    gpu_reserve_begin(renderer->device, RESERVE_NS);
    bool brought = gpu_scene_bring(&renderer->shared->copy, renderer->scene, clock_now_ns() + UPDATE_STEP_NS, done,
                                   &renderer->work->context.times, &failed);
    return end_reserving(renderer, brought, &failed, error);
}

/* The motion is not kept: it is read at once. */
static bool find_moves(struct frame_renderer *renderer, struct error *error)
{
    return !has_motion_layer(renderer) ||
           moves_find(&renderer->work->layers.moves, &renderer->shared->copy, renderer->motion, error);
}

bool frame_update(struct frame_renderer *renderer, struct error *error)
{
    bool done = false;
    if (!bring_scene(renderer, &done, error))
        return false;
    if (!done) {
        announce_first(renderer);
        return true;
    }
    if (!update_scene(renderer, renderer->scene, renderer->motion, error) || !take_tracers(renderer, error) ||
        !find_moves(renderer, error))
        return false;
    renderer->phase = PHASE_BUILD;
    return begin_tracers(renderer, error);
}

bool frame_begin(struct frame_renderer *renderer, const struct scene *scene, const struct scene_motion *motion,
                 const struct frame_request *request, struct error *error)
{
    frame_abandon(renderer);
    if (!frame_may_begin(renderer, scene, motion, request))
        return error_set(error, ERROR_INTERNAL, NULL, "a frame that may not begin beside others");
    bool begun = begin(renderer, scene, motion, request, error);
    if (begun) {
        renderer->phase = PHASE_UPDATE;
        renderer->shared->frames++;
        begun = frame_update(renderer, error);
    }
    if (!begun)
        frame_end(renderer);
    return begun;
}
