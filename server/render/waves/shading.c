/* SPDX-License-Identifier: MIT */
/* A wave is shaded by the integrator, asks lights by shadow rays, and its children become the next wave. */
#include "render/waves/shading.h"

#include "render/light/environment.h"
#include "render/waves/compact.h"
#include "render/context/request.h"
#include "render/waves/notes.h"
#include "render/waves/trace.h"

#include "shared/bindings.h"
#include "shared/hit.h"
#include "shared/layers.h"
#include "shared/path.h"
#include "shared/ray.h"

#include <epoxy/gl.h>

#define SHADOW_WAVES_MAX 4u
#define SHADOW_MEMORY_PART 32 /* part of the device's memory, at most */
#define DEFINES_MAX                                                                                               \
    (INTEGRATOR_DEFINES_MAX + CONTEXT_SURFACE_DEFINES + NOTES_LIGHT_DEFINES +                                     \
     3) /* three more and the end of the list */

static uint32_t shadow_rays(const struct wave_shading *shading, const struct render_frame *frame)
{
    return shading->extra->shadow_rays(frame);
}

/* How many waves of shadow rays the buffers hold. Where the device counts hits, a batch needs room for as many as
 * the wave may have, and fewer batches are fewer passes. Not by the limit in force, which changes with other
 * frames. */
static uint32_t shadow_waves(const struct wave_shading *shading, const struct render_wave *wave)
{
    const struct gpu_facts *facts = &wave->device->gpu->facts;
    const uint64_t rays = wave->capacity, texels = notes_have_light(wave->notes) ? 2 : 1,
                   ray_bytes = sizeof(struct ray) + sizeof(uint) + texels * sizeof(vec4);
    const uint64_t fitting[] = {
        shadow_rays(shading, wave->frame),
        SHADOW_WAVES_MAX,
        facts->memory.bytes / SHADOW_MEMORY_PART / (rays * ray_bytes),
        facts->storage_block_bytes_max / (rays * sizeof(struct ray)),
        facts->texture_buffer_texels_max / (rays * texels),
    };
    uint64_t waves = wave->device->counts_on_host ? 0 : UINT32_MAX;
    for (size_t i = 0; i < sizeof(fitting) / sizeof(fitting[0]); i++)
        waves = fitting[i] < waves ? fitting[i] : waves;
    const uint32_t least = wave->frame->integrator->shadow_waves;
    return waves > least ? (uint32_t)waves : least;
}

static bool reserve(void *self, struct render_wave *wave, uint32_t slice_samples, struct error *error)
{
    struct wave_shading *shading = self;
    (void)slice_samples;
    const struct integrator *integrator = wave->frame->integrator;
    struct gpu_device *device = wave->device->gpu;
    size_t waves = wave->capacity, children = waves * integrator->children_a_hit;
    size_t shadows = shadow_rays(shading, wave->frame) > 0 ? waves * shadow_waves(shading, wave) : 0;
    size_t samples = notes_have_light(wave->notes) ? 2 * shadows : shadows;
    size_t shadow_times = wave->frame->scene->has_motion ? shadows : 0;
    if ((integrator->prepare && !integrator->prepare(wave->frame, error)) ||
        !shading->extra->prepare(wave->frame, error))
        return false;
    return gpu_buffer_reserve(device, &shading->radiance, waves * sizeof(vec4), error) &&
           gpu_buffer_reserve(device, &shading->children, children * sizeof(struct child), error) &&
           gpu_buffer_reserve(device, &shading->child_counts, waves * sizeof(uint), error) &&
           gpu_buffer_reserve(device, &shading->shadow_rays, shadows * sizeof(struct ray), error) &&
           gpu_buffer_reserve(device, &shading->shadow_times, shadow_times * sizeof(float), error) &&
           gpu_buffer_reserve(device, &shading->visibility, shadows * sizeof(uint), error) &&
           gpu_buffer_reserve(device, &shading->light_samples, samples * sizeof(vec4), error);
}

static void finish(void *self, struct gpu_device *device)
{
    struct wave_shading *shading = self;
    gpu_buffer_finish(device, &shading->radiance);
    gpu_buffer_finish(device, &shading->children);
    gpu_buffer_finish(device, &shading->child_counts);
    gpu_buffer_finish(device, &shading->shadow_rays);
    gpu_buffer_finish(device, &shading->shadow_times);
    gpu_buffer_finish(device, &shading->visibility);
    gpu_buffer_finish(device, &shading->light_samples);
    *shading = (struct wave_shading){.extra = shading->extra};
}

uint64_t wave_shading_device_bytes(const struct wave_shading *shading)
{
    return shading->radiance.capacity_bytes + shading->children.capacity_bytes +
           shading->child_counts.capacity_bytes + shading->shadow_rays.capacity_bytes +
           shading->shadow_times.capacity_bytes + shading->visibility.capacity_bytes +
           shading->light_samples.capacity_bytes;
}

static void bind_shading(struct wave_shading *shading, struct render_wave *wave)
{
    context_bind_hits(wave);
    gpu_buffer_bind_texels(wave->device->gpu, environment_lights(wave->frame->environment, wave->frame->scene),
                           UNIT_SHADE_LIGHTS, GL_RGBA32F);
    gpu_buffer_bind_storage(&shading->radiance, BIND_RADIANCE);
    gpu_buffer_bind_storage(&shading->children, BIND_CHILDREN);
    gpu_buffer_bind_storage(&shading->child_counts, BIND_CHILD_COUNTS);
    gpu_buffer_bind_storage(&shading->light_samples, BIND_LIGHT_SAMPLES);
    gpu_buffer_bind_storage(&shading->shadow_rays, BIND_SHADOW_RAYS);
    if (wave->frame->scene->has_motion)
        gpu_buffer_bind_storage(&shading->shadow_times, BIND_RAY_TIMES);
}

/* The integrator's program, in use, with the scene and everything that shade.glsl names bound and set. */
static const struct gpu_program *shade_program(struct wave_shading *shading, struct render_wave *wave,
                                               struct error *error)
{
    const struct integrator *integrator = wave->frame->integrator;
    struct gpu_define defines[DEFINES_MAX] = {0};
    size_t n = integrator->defines ? integrator->defines(wave, defines) : 0;
    n += context_surface_defines(wave, defines + n);
    if (wave->frame->features.area_lights)
        defines[n++] = (struct gpu_define){"HAS_AREA_LIGHTS", "1"};
    if (wave->frame->scene->has_motion)
        defines[n++] = (struct gpu_define){"HAS_TIMES", "1"};
    n += notes_light_defines(wave->notes, defines + n);
    const struct gpu_program *program = context_use_with(wave->device, integrator->shader, defines, error);
    if (!program)
        return NULL;
    bool last = wave->number >= wave->frame->request.light.depth + integrator->straight_waves;
    gpu_uniform_uint(program, "first_slot", wave->slice.first_slot);
    gpu_uniform_uint(program, "wave_number", wave->number);
    gpu_uniform_uint(program, "last_wave", last);
    gpu_uniform_uint(program, "children_a_hit", integrator->children_a_hit);
    gpu_uniform_uint(program, "shadow_rays_a_hit", integrator->shadow_rays_a_hit(wave->frame));
    gpu_uniform_float(program, "radiance_limit", frame_request_radiance_limit(&wave->frame->request));
    bind_shading(shading, wave);
    notes_bind_light(wave->notes, program);
    return program;
}

/* Shades the hits, of which there are some: shadow rays first .. first + count - 1 of each; if first is 0
 * also the light that the hit emits, and its children. */
static bool shade_hits(struct wave_shading *shading, struct render_wave *wave, uint32_t first, uint32_t count,
                       struct error *error)
{
    const uint32_t own = wave->frame->integrator->shadow_rays_a_hit(wave->frame);
    const bool is_own = first == 0 || first < own; /* the rest are the ground's */
    context_span_begin(wave->device, STAGE_SHADE);
    const struct gpu_program *program = shade_program(shading, wave, error);
    if (program && is_own) {
        gpu_uniform_uint(program, "first_ray", first);
        gpu_uniform_uint(program, "batch_rays", count < own - first ? count : own - first);
        if (wave->frame->integrator->set)
            wave->frame->integrator->set(wave->frame, program);
        compact_dispatch(wave, program, WAVE_HITS);
    }
    const bool shaded = program && shading->extra->shade(wave, first, count, error);
    context_span_end(wave->device);
    return shaded;
}

/* The shadow rays that were made, a part of them. */
static bool trace_shadows(struct wave_shading *shading, struct render_wave *wave, bool *done, struct error *error)
{
    struct wave rays = {
        .kind = WAVE_ANY,
        .rays = &shading->shadow_rays,
        .visibility = &shading->visibility,
        .times = wave->frame->scene->has_motion ? &shading->shadow_times : NULL,
    };
    return compact_shadow_rays(wave, wave->asking, false, &rays, error) &&
           wave_trace(wave, RAY_SHADOW, &rays, done, error);
}

static const struct gpu_program *gather_program(const struct wave_shading *shading, struct render_wave *wave,
                                                struct error *error)
{
    const struct integrator *integrator = wave->frame->integrator;
    const bool meets_lights = integrator->meets_lights && wave->frame->features.area_lights;
    const char *const names[] = {
        integrator->gather,
        shading->extra->is_shown(wave->frame) ? "GROUND" : NULL,
        wave->frame->environment->kind == ENVIRONMENT_IMAGE ? "HAS_ENVIRONMENT_IMAGE" : NULL,
        integrator->left_scene,
        meets_lights ? "HAS_AREA_LIGHTS" : NULL,
        meets_lights && context_samples_emitters(wave->frame) ? "HAS_EMITTERS" : NULL,
        notes_covers(wave->notes) ? "COVERS" : NULL,
    };
    struct gpu_define defines[sizeof(names) / sizeof(names[0]) + NOTES_LIGHT_DEFINES + 1] = {0};
    size_t n = 0;
    for (size_t i = 0; i < sizeof(names) / sizeof(names[0]); i++)
        if (names[i])
            defines[n++] = (struct gpu_define){names[i], "1"};
    (void)notes_light_defines(wave->notes, defines + n);
    return context_use_with(wave->device, "render/gather.comp", defines, error);
}

/* Adds the light of unobstructed rays to the wave's radiance, and after the last batch that to the samples,
 * with the light of the paths that left the scene. */
static bool gather(struct wave_shading *shading, struct render_wave *wave, bool last, uint32_t rays_a_hit,
                   struct error *error)
{
    const struct gpu_program *program = gather_program(shading, wave, error);
    if (!program)
        return false;
    context_bind(wave);
    gpu_uniform_uint(program, "batch_rays", rays_a_hit);
    gpu_uniform_uint(program, "last_batch", last);
    gpu_uniform_float(program, "radiance_limit", frame_request_radiance_limit(&wave->frame->request));
    gpu_buffer_bind_texels(wave->device->gpu, environment_lights(wave->frame->environment, wave->frame->scene),
                           UNIT_SHADE_LIGHTS, GL_RGBA32F);
    gpu_buffer_bind_texels(wave->device->gpu, &wave->rays, UNIT_RAYS, GL_RGBA32F);
    gpu_buffer_bind_texels(wave->device->gpu, &wave->paths, UNIT_SHADE_PATHS, GL_RGBA32UI);
    gpu_buffer_bind_texels(wave->device->gpu, &shading->light_samples, UNIT_PASS_0, GL_RGBA32F);
    gpu_buffer_bind_storage(&shading->radiance, BIND_RADIANCE);
    gpu_buffer_bind_storage(&wave->hit_places, BIND_HIT_PLACES);
    gpu_buffer_bind_storage(&shading->visibility, BIND_VISIBILITY);
    if (notes_covers(wave->notes)) {
        gpu_buffer_bind_texels(wave->device->gpu, &wave->hits, UNIT_SHADE_HITS, GL_RGBA32UI);
        gpu_buffer_bind_storage(notes_covers(wave->notes), BIND_COVERS);
        gpu_uniform_uint(program, "wave_number", wave->number);
        gpu_uniform_uint(program, "sample_count", wave->slice.slot_count << wave->frame->uniforms.sample_shift);
    }
    context_bind_sums(wave);
    notes_bind_light(wave->notes, program);
    context_span_begin(wave->device, STAGE_SHADE);
    compact_dispatch(wave, program, WAVE_RAYS);
    context_span_end(wave->device);
    return true;
}

static const struct gpu_program *move_program(struct render_wave *wave, struct error *error)
{
    static const struct gpu_define times[] = {{"HAS_TIMES", "1"}, {NULL, NULL}};
    return context_use_with(wave->device, "render/compact_move.comp",
                            wave->frame->scene->has_motion ? times : NULL, error);
}

static bool move_children(struct wave_shading *shading, struct render_wave *wave, struct error *error)
{
    const struct gpu_program *program = move_program(wave, error);
    if (!program)
        return false;
    gpu_uniform_uint(program, "children_a_hit", wave->frame->integrator->children_a_hit);
    gpu_buffer_bind_storage(&shading->child_counts, BIND_CHILD_COUNTS);
    gpu_buffer_bind_storage(&wave->block_offsets, BIND_BLOCK_OFFSETS);
    gpu_buffer_bind_texels(wave->device->gpu, &shading->children, UNIT_MOVE_CHILDREN, GL_RGBA32UI);
    gpu_buffer_bind_storage(&wave->rays, BIND_RAYS);
    gpu_buffer_bind_storage(&wave->paths, BIND_PATHS);
    if (wave->frame->scene->has_motion)
        gpu_buffer_bind_storage(&wave->ray_times, BIND_RAY_TIMES);
    compact_dispatch(wave, program, WAVE_HITS);
    return true;
}

static enum pass_progress make_wave(struct wave_shading *shading, struct render_wave *wave, struct error *error)
{
    const bool last_queued = !wave->device->counts_on_host && wave->number + 1 == wave->waves_queued;
    if (wave->hit_count == 0)
        return PASS_DONE;
    const struct compact_order order = {.children_a_hit = wave->frame->integrator->children_a_hit,
                                        .last_queued = last_queued,
                                        .sorts = wave->frame->integrator->scatters};
    if (!compact_children(wave, &order, &shading->child_counts, error))
        return PASS_FAILED;
    if (wave->device->counts_on_host && wave->known_state.stopped)
        return PASS_REPEAT;
    if (last_queued || wave->ray_count == 0)
        return PASS_DONE;
    shading->has_children = true;
    return move_children(shading, wave, error) ? PASS_DONE : PASS_FAILED;
}

/* Makes the children the wave's rays and paths, and counts the wave. */
static enum pass_progress next_wave(struct wave_shading *shading, struct render_wave *wave, struct error *error)
{
    context_span_begin(wave->device, STAGE_SHADE);
    enum pass_progress progress = make_wave(shading, wave, error);
    context_span_end(wave->device);
    wave->asked = 0;
    context_set_number(wave, wave->number + 1);
    return progress;
}

/* How many shadow rays of each hit are made and traced together. */
static uint32_t batch_of(const struct wave_shading *shading, const struct render_wave *wave)
{
    if (wave->hit_count == 0)
        return 0;
    uint32_t left = shadow_rays(shading, wave->frame) - wave->asked;
    uint32_t together = wave->capacity * shadow_waves(shading, wave) / wave->hit_count;
    return left < together ? left : together;
}

/* Shades, and makes a batch of shadow rays. */
static bool shade_batch(struct wave_shading *shading, struct render_wave *wave, struct error *error)
{
    wave->asking = batch_of(shading, wave);
    return wave->hit_count == 0 || shade_hits(shading, wave, wave->asked, wave->asking, error);
}

static enum pass_progress finish_batch(struct wave_shading *shading, struct render_wave *wave, struct error *error)
{
    const uint32_t count = wave->asking;
    wave->asking = 0;
    wave->asked += count;
    bool last = wave->hit_count == 0 || wave->asked == shadow_rays(shading, wave->frame);
    if (!gather(shading, wave, last, count, error))
        return PASS_FAILED;
    return last ? next_wave(shading, wave, error) : PASS_MORE;
}

static enum pass_progress shade(void *self, struct render_wave *wave, struct error *error)
{
    struct wave_shading *shading = self;
    if (wave->asking == 0) {
        if (!shade_batch(shading, wave, error))
            return PASS_FAILED;
        return wave->asking > 0 ? PASS_MORE : finish_batch(shading, wave, error);
    }
    bool done = false;
    if (!trace_shadows(shading, wave, &done, error))
        return PASS_FAILED;
    return done ? finish_batch(shading, wave, error) : PASS_MORE;
}

void wave_shading_announce_hits(struct wave_shading *shading, struct render_wave *wave)
{
    (void)shade_program(shading, wave, NULL);
}

void wave_shading_announce_long(struct wave_shading *shading, struct render_wave *wave)
{
    const struct wave shadows = {.kind = WAVE_ANY,
                                 .times = wave->frame->scene->has_motion ? &shading->shadow_times : NULL};
    if (shadow_rays(shading, wave->frame) > 0)
        wave_announce(wave, &shadows);
    if (wave->frame->scene->instance_count > 0)
        (void)shade_program(shading, wave, NULL);
}

void wave_shading_announce_shading(struct wave_shading *shading, struct render_wave *wave)
{
    if (wave->frame->scene->instance_count > 0)
        (void)shade_program(shading, wave, NULL);
    (void)gather_program(shading, wave, NULL);
}

static void announce_bounces(struct wave_shading *shading, struct render_wave *wave)
{
    const struct wave bounces = {.kind = WAVE_CLOSEST, .times = context_ray_times(wave)};
    wave->sampled_hits = wave->frame->tracer->impl->sampled;
    (void)move_program(wave, NULL);
    wave_announce(wave, &bounces);
    (void)shade_program(shading, wave, NULL);
}

bool wave_shading_expects_bounces(const struct render_frame *frame)
{
    const struct integrator *integrator = frame->integrator;
    return frame->scene->instance_count > 0 && frame->request.light.depth > 0 &&
           (integrator->always_bounces || (integrator->mirrors && frame->features.mirrors));
}

void wave_shading_announce(struct wave_shading *shading, struct render_wave *wave)
{
    const struct integrator *integrator = wave->frame->integrator;
    compact_announce_hits(wave);
    (void)gather_program(shading, wave, NULL);
    compact_announce_children(wave, integrator->scatters);
    if (wave_shading_expects_bounces(wave->frame))
        announce_bounces(shading, wave);
}

/* ---- as passes ---- */

static bool wants_shading(const void *self, const struct render_wave *wave)
{
    const struct wave_shading *shading = self;
    return shading->is_wanted && wave->frame->request.picture.view_source != VIEW_SOURCE_LAYERS;
}

const struct pass shading_pass = {
    .name = "shading",
    .wants = wants_shading,
    .reserve = reserve,
    .run = shade,
    .finish = finish,
};

static bool has_children(const void *self, const struct render_wave *wave)
{
    (void)wave;
    return ((const struct wave_shading *)self)->has_children;
}

static enum pass_progress bounce(void *self, struct render_wave *wave, struct error *error)
{
    struct wave_shading *shading = self;
    struct wave rays = {
        .kind = WAVE_CLOSEST,
        .rays = &wave->rays,
        .hits = &wave->hits,
        .times = context_ray_times(wave),
    };
    bool done = false;
    compact_rays(wave, &rays);
    if (!wave_trace(wave, RAY_SECONDARY, &rays, &done, error))
        return PASS_FAILED;
    if (!done)
        return PASS_MORE;
    shading->has_children = false;
    wave->sampled_hits = wave->frame->tracer->impl->sampled;
    context_span_begin(wave->device, STAGE_SHADE);
    const bool listed = shading->extra->make_hits(wave, error) && compact_hits(wave, error);
    context_span_end(wave->device);
    return listed ? PASS_DONE : PASS_FAILED;
}

const struct pass bounce_pass = {.name = "bounce", .wants = has_children, .run = bounce};
