/* SPDX-License-Identifier: MIT */
/* Notes layers of first hits in the slice's sums, and adds these to the picture. */
#include "render/passes/layers/layers.h"

#include "render/light/environment.h"
#include "render/waves/compact.h"
#include "render/context/request.h"
#include "render/waves/integrator.h"
#include "render/waves/trace.h"
#include "shared/layers.h"
#include "shared/light.h"
#include "shared/ray.h"

#include <epoxy/gl.h>

_Static_assert(LAYER_BIT_BEAUTY == 1 << LAYER_BEAUTY && LAYER_BIT_ALBEDO == 1 << LAYER_ALBEDO &&
                   LAYER_BIT_NORMAL == 1 << LAYER_NORMAL && LAYER_BIT_DEPTH == 1 << LAYER_DEPTH &&
                   LAYER_BIT_POSITION == 1 << LAYER_POSITION && LAYER_BIT_AO == 1 << LAYER_AO &&
                   LAYER_BIT_ID == 1 << LAYER_ID && LAYER_BIT_UNKNOWN == 1 << LAYER_UNKNOWN &&
                   LAYER_BITS_CRYPTO_OBJECT == 7 << LAYER_CRYPTO_OBJECT0 &&
                   LAYER_BITS_CRYPTO_MATERIAL == 7 << LAYER_CRYPTO_MATERIAL0 &&
                   LAYER_BIT_MOTION == 1 << LAYER_MOTION && LAYER_BITS_ALL >> LAYER_COUNT == 0 &&
                   LAYER_BITS_ALL >> (LAYER_COUNT - 1) == 1 && LAYER_BIT_STICKING == 1u << LAYER_STICKING &&
                   LAYER_COUNT <= LAYER_STICKING,
               "shaders know the layers by other numbers");
_Static_assert(LAYER_BIT_DIFFUSE_DIRECT == 1u << LAYER_DIFFUSE_DIRECT &&
                   LAYER_BIT_DIFFUSE_INDIRECT == 1u << LAYER_DIFFUSE_INDIRECT &&
                   LAYER_BIT_SPECULAR_DIRECT == 1u << LAYER_SPECULAR_DIRECT &&
                   LAYER_BIT_SPECULAR_INDIRECT == 1u << LAYER_SPECULAR_INDIRECT &&
                   LAYER_BIT_TRANSMISSION == 1u << LAYER_TRANSMISSION &&
                   LAYER_BIT_EMISSION == 1u << LAYER_EMISSION && LAYER_BIT_BACKGROUND == 1u << LAYER_BACKGROUND &&
                   LAYER_BIT_LIGHT_REST == 1u << LAYER_LIGHT_REST &&
                   LAYER_BITS_LIGHT_GROUPS == 0xffu << LAYER_LIGHT_REST &&
                   LAYER_LIGHT_REST + (int)LIGHT_GROUPS_MAX - 1 == LAYER_LIGHT_GROUP7,
               "shaders know the layers by other numbers");

void layers_begin(struct layers *layers, const struct render_frame *frame, bool is_shaded)
{
    const struct frame_request *request = &frame->request;
    layers->notes.layers = frame_request_planes(request) & ~LAYER_BIT_BEAUTY;
    layers->notes.environment_group = frame->scene->scene->environment.value.light_group;
    layers->notes.covers_by_shading = layers->notes.layers & LAYER_BITS_CRYPTO && is_shaded &&
                                      (frame->features.blend || request->light.integrator == INTEGRATOR_RAYCAST);
}

/* Planes of BIND_COVERS. */
static uint32_t cover_waves(const struct wave_notes *notes)
{
    if (!(notes->layers & LAYER_BITS_CRYPTO))
        return 0;
    return notes->covers_by_shading ? COVERS_MAX : 1;
}

static void finish(void *self, struct gpu_device *device)
{
    struct layers *layers = self;
    gpu_buffer_finish(device, &layers->notes.sums);
    gpu_buffer_finish(device, &layers->notes.covers);
    moves_finish(&layers->moves, device);
    gpu_buffer_finish(device, &layers->ao_rays);
    gpu_buffer_finish(device, &layers->ao_times);
    gpu_buffer_finish(device, &layers->ao_visibility);
    *layers = (struct layers){0};
}

static bool reserve(void *self, struct render_wave *wave, uint32_t slice_samples, struct error *error)
{
    struct layers *layers = self;
    struct gpu_device *device = wave->device->gpu;
    if (!layers->notes.layers) {
        finish(layers, device);
        return true;
    }
    size_t planes =
        (size_t)__builtin_popcount(layers->notes.layers & ~LAYER_BITS_CRYPTO) + notes_have_light(&layers->notes);
    size_t covers = (size_t)cover_waves(&layers->notes) * slice_samples;
    size_t rays = layers->notes.layers & LAYER_BIT_AO ? wave->capacity : 0;
    size_t times = wave->frame->scene->has_motion ? rays : 0;
    return gpu_buffer_reserve(device, &layers->notes.sums, planes * slice_samples * sizeof(vec4), error) &&
           gpu_buffer_reserve(device, &layers->notes.covers, covers * sizeof(uvec4), error) &&
           gpu_buffer_reserve(device, &layers->ao_rays, rays * sizeof(struct ray), error) &&
           gpu_buffer_reserve(device, &layers->ao_times, times * sizeof(float), error) &&
           gpu_buffer_reserve(device, &layers->ao_visibility, rays * sizeof(uint), error);
}

bool layers_are_shaded(const struct layers *layers)
{
    return layers->notes.covers_by_shading || notes_have_light(&layers->notes);
}

void layers_begin_slice(struct layers *layers, const struct render_wave *wave)
{
    layers->noted = false;
    layers->noting = layers->notes.layers;
    layers->asked = layers->asking = 0;
    layers->notes.plane_samples = wave->slice.slot_count << wave->frame->uniforms.sample_shift;
}

uint32_t layers_take_unknown(struct layers *layers)
{
    layers->noting = layers->notes.layers & ~LAYER_BIT_UNKNOWN;
    return layers->noting == layers->notes.layers
               ? UINT32_MAX
               : notes_plane(&layers->notes, LAYER_BIT_UNKNOWN) * layers->notes.plane_samples;
}

/* A program that reads hits, in use, with all that these have bound; each of `own`: a define of its own, or NULL.
 */
static const struct gpu_program *use(struct render_wave *wave, const char *compute, const char *const own[2],
                                     struct error *error)
{
    struct gpu_define defines[CONTEXT_SURFACE_DEFINES + 4] = {0};
    size_t n = context_surface_defines(wave, defines);
    for (int i = 0; i < 2; i++)
        if (own[i])
            defines[n++] = (struct gpu_define){own[i], "1"};
    if (wave->frame->scene->has_motion)
        defines[n++] = (struct gpu_define){"HAS_TIMES", "1"};
    const struct gpu_program *program = context_use_with(wave->device, compute, defines, error);
    if (!program)
        return NULL;
    context_bind_hits(wave);
    gpu_uniform_uint(program, "first_slot", wave->slice.first_slot);
    return program;
}

static bool note_sticking(struct layers *layers, struct render_wave *wave, struct error *error)
{
    const bool sticks = wave->frame->integrator->follows_eye;
    const char *const own[2] = {sticks ? "STICKS" : NULL,
                                wave->frame->features.area_lights ? "HAS_AREA_LIGHTS" : NULL};
    const uint32_t first = wave->slice.first_slot, end = first + wave->slice.slot_count;
    context_span_begin(wave->device, STAGE_SHADE);
    const struct gpu_program *program = use(wave, "render/sticking.comp", own, error);
    if (program) {
        gpu_buffer_bind_texels(wave->device->gpu, environment_lights(wave->frame->environment, wave->frame->scene),
                               UNIT_SHADE_LIGHTS, GL_RGBA32F);
        gpu_buffer_bind_storage(&layers->notes.sums, BIND_LAYER_SUMS);
        gpu_uniform_uint(program, "slot_count", wave->slice.slot_count);
        gpu_uniform_uint(program, "first_sum",
                         notes_plane(&layers->notes, LAYER_BIT_STICKING) * layers->notes.plane_samples);
        gpu_dispatch(wave->device->gpu, program,
                     ((end + 3) / 4 - first / 4) << wave->frame->uniforms.sample_shift);
    }
    context_span_end(wave->device);
    return program && gpu_check(wave->device->gpu, "what sticks", error);
}

/* The plane of emission follows those of light, of which it is one. */
static uint32_t light_planes_end(const struct wave_notes *notes)
{
    const uint32_t planes = (uint32_t)__builtin_popcount(notes->layers & ~LAYER_BITS_CRYPTO);
    return notes_have_light(notes) ? planes + 1 : 0;
}

/* Notes every layer but ambient occlusion, which begins with 0. */
static bool note_hits(struct layers *layers, struct render_wave *wave, struct error *error)
{
    bool needs_surface = layers->noting & (LAYER_BIT_ALBEDO | LAYER_BIT_NORMAL);
    context_span_begin(wave->device, STAGE_SHADE);
    const struct gpu_program *program =
        use(wave, "render/layers.comp", (const char *const[2]){needs_surface ? "NEEDS_SURFACE" : NULL}, error);
    if (program) {
        gpu_buffer_bind_storage(&layers->notes.sums, BIND_LAYER_SUMS);
        gpu_uniform_uint(program, "ray_count", wave->ray_count);
        gpu_uniform_uint(program, "layers", layers->notes.layers);
        gpu_uniform_uint(program, "noting", layers->noting);
        gpu_uniform_uint(program, "first_light_plane", notes_plane(&layers->notes, LAYER_BIT_DIFFUSE_DIRECT));
        gpu_uniform_uint(program, "end_light_plane", light_planes_end(&layers->notes));
        gpu_dispatch(wave->device->gpu, program, wave->ray_count);
    }
    context_span_end(wave->device);
    return program && gpu_check(wave->device->gpu, "layers", error);
}

static bool begin_covers(struct layers *layers, struct render_wave *wave, struct error *error)
{
    if (!(layers->noting & LAYER_BITS_CRYPTO))
        return true;
    context_span_begin(wave->device, STAGE_SHADE);
    const struct gpu_program *program = context_use(wave->device, "render/layers_covers.comp", error);
    if (program) {
        gpu_buffer_bind_texels(wave->device->gpu, &wave->hits, UNIT_SHADE_HITS, GL_RGBA32UI);
        gpu_buffer_bind_storage(&layers->notes.covers, BIND_COVERS);
        gpu_uniform_uint(program, "ray_count", wave->ray_count);
        gpu_uniform_uint(program, "cover_waves", cover_waves(&layers->notes));
        gpu_uniform_uint(program, "are_known", !layers->notes.covers_by_shading);
        gpu_dispatch(wave->device->gpu, program, wave->ray_count);
    }
    context_span_end(wave->device);
    return program && gpu_check(wave->device->gpu, "what covers samples", error);
}

/* Whether the current slice adds to a layer: for some layers, samples after the first are zero. */
static bool adds(const struct render_frame *frame, enum layer layer)
{
    return frame->uniforms.sample_index == 0 || !frame_request_is_first_sample(layer);
}

static bool note_motion(struct layers *layers, struct render_wave *wave, struct error *error)
{
    if (!(layers->noting & LAYER_BIT_MOTION) || !adds(wave->frame, LAYER_MOTION))
        return true;
    const struct gpu_define defines[] = {{wave->frame->scene->has_motion ? "HAS_MOTION" : NULL, "1"}, {0}};
    context_span_begin(wave->device, STAGE_SHADE);
    const struct gpu_program *program =
        context_use_with(wave->device, "render/layers_motion.comp", defines, error);
    if (program) {
        context_bind_hits(wave);
        gpu_buffer_bind_storage(&layers->notes.sums, BIND_LAYER_SUMS);
        moves_bind(&layers->moves, &wave->frame->request, program);
        gpu_uniform_uint(program, "first_slot", wave->slice.first_slot);
        gpu_uniform_uint(program, "ray_count", wave->ray_count);
        gpu_uniform_uint(program, "first_sum",
                         notes_plane(&layers->notes, LAYER_BIT_MOTION) * layers->notes.plane_samples);
        gpu_dispatch(wave->device->gpu, program, wave->ray_count);
    }
    context_span_end(wave->device);
    return program && gpu_check(wave->device->gpu, "motion", error);
}

static bool make_ao_rays(struct layers *layers, struct render_wave *wave, uint32_t count, struct error *error)
{
    context_span_begin(wave->device, STAGE_SHADE);
    const struct gpu_program *program = use(wave, "render/layers_ao.comp", (const char *const[2]){NULL}, error);
    if (program) {
        gpu_buffer_bind_storage(&layers->ao_rays, BIND_SHADOW_RAYS);
        if (wave->frame->scene->has_motion)
            gpu_buffer_bind_storage(&layers->ao_times, BIND_RAY_TIMES);
        gpu_uniform_uint(program, "first_ray", layers->asked);
        gpu_uniform_uint(program, "batch_rays", count);
        gpu_uniform_uint(program, "all_rays", context_ao_rays(wave->frame));
        gpu_uniform_float(program, "reach", context_ao_distance(wave->frame));
        gpu_uniform_float(program, "falloff", wave->frame->request.light.ao_falloff);
        compact_dispatch(wave, program, WAVE_HITS);
    }
    context_span_end(wave->device);
    return program != NULL;
}

/* A part of those that were made. */
static bool trace_ao_rays(struct layers *layers, struct render_wave *wave, bool *done, struct error *error)
{
    struct wave rays = {
        .kind = WAVE_ANY,
        .rays = &layers->ao_rays,
        .visibility = &layers->ao_visibility,
        .times = wave->frame->scene->has_motion ? &layers->ao_times : NULL,
    };
    const bool begins = !wave->frame->trace_state->in_progress; /* the wave's rays are counted once */
    return compact_shadow_rays(wave, layers->asking, begins, &rays, error) &&
           wave_trace(wave, RAY_SHADOW, &rays, done, error);
}

static bool gather_ao(struct layers *layers, struct render_wave *wave, uint32_t count, struct error *error)
{
    context_span_begin(wave->device, STAGE_SHADE);
    const struct gpu_program *program = context_use(wave->device, "render/layers_gather.comp", error);
    if (program) {
        gpu_buffer_bind_storage(&wave->hit_list, BIND_HIT_LIST);
        gpu_buffer_bind_storage(&layers->ao_visibility, BIND_VISIBILITY);
        gpu_buffer_bind_storage(&layers->notes.sums, BIND_LAYER_SUMS);
        gpu_uniform_uint(program, "ray_count", wave->ray_count);
        gpu_uniform_uint(program, "batch_rays", count);
        gpu_uniform_uint(program, "all_rays", context_ao_rays(wave->frame));
        gpu_uniform_uint(program, "plane", notes_plane(&layers->notes, LAYER_BIT_AO));
        compact_dispatch(wave, program, WAVE_HITS);
    }
    context_span_end(wave->device);
    return program && gpu_check(wave->device->gpu, "ambient occlusion", error);
}

/* Marks secondary rays that reached places unknown to the tracer. */
static bool mark_unknown(struct layers *layers, struct render_wave *wave, struct error *error)
{
    context_span_begin(wave->device, STAGE_SHADE);
    const struct gpu_program *program = context_use(wave->device, "render/layers_unknown.comp", error);
    if (program) {
        context_bind_hits(wave);
        gpu_buffer_bind_storage(&layers->notes.sums, BIND_LAYER_SUMS);
        gpu_uniform_uint(program, "first_sum",
                         notes_plane(&layers->notes, LAYER_BIT_UNKNOWN) * layers->notes.plane_samples);
        compact_dispatch(wave, program, WAVE_RAYS);
    }
    context_span_end(wave->device);
    return program && gpu_check(wave->device->gpu, "unknown rays", error);
}

static bool any_adds(const struct layers *layers, const struct render_wave *wave)
{
    for (enum layer layer = LAYER_ALBEDO; layer <= LAYER_STICKING; layer++)
        if (layers->noting & ~(LAYER_BITS_CRYPTO | LAYER_BIT_MOTION) & 1u << layer && adds(wave->frame, layer))
            return true;
    return false;
}

/* Notes properties of first hits; *done false: there is more. Rays and hits stay unchanged, and its own rays
 * count as shadow rays. */
static bool note_first(struct layers *layers, struct render_wave *wave, bool *done, struct error *error)
{
    uint32_t all = layers->notes.layers & LAYER_BIT_AO && wave->hit_count > 0 ? context_ao_rays(wave->frame) : 0;
    if (!layers->noted) {
        layers->noted = true;
        *done = all == 0;
        return (!any_adds(layers, wave) || note_hits(layers, wave, error)) && begin_covers(layers, wave, error) &&
               note_motion(layers, wave, error) &&
               (!(layers->noting & LAYER_BIT_STICKING) || note_sticking(layers, wave, error));
    }
    if (layers->asking == 0) {
        uint32_t left = all - layers->asked, together = wave->capacity / wave->hit_count;
        layers->asking = left < together ? left : together;
        return make_ao_rays(layers, wave, layers->asking, error);
    }
    bool traced = false;
    if (!trace_ao_rays(layers, wave, &traced, error))
        return false;
    if (!traced)
        return true;
    const uint32_t count = layers->asking;
    layers->asking = 0;
    layers->asked += count;
    *done = layers->asked == all;
    return gather_ao(layers, wave, count, error);
}

/* Adds the slice's covers to the ranks of one kind, objects or materials: its planes are those in `bits`. */
static bool rank_covers(struct layers *layers, struct picture *picture, struct render_wave *wave, uint32_t bits,
                        struct error *error)
{
    static const unsigned points[CRYPTO_PLANES] = {BIND_ACCUMULATION, BIND_PASS_1, BIND_PASS_2};
    static const char *const counts[] = {"1", "2", "3"};
    const uint32_t wanted = layers->notes.layers & bits;
    const uint32_t first = (uint32_t)__builtin_popcount(picture->layers & ((wanted & -wanted) - 1));
    const uint32_t count = (uint32_t)__builtin_popcount(wanted);
    if (!wanted)
        return true;
    struct gpu_define defines[4] = {{"PLANES", counts[count - 1]}};
    size_t n = 1;
    if (bits == LAYER_BITS_CRYPTO_MATERIAL)
        defines[n++] = (struct gpu_define){"MATERIALS", "1"};
    if (wave->frame->tile_samples)
        defines[n++] = (struct gpu_define){"HAS_TILE_SAMPLES", "1"};
    context_span_begin(wave->device, STAGE_SHADE);
    const struct gpu_program *program = context_use_with(wave->device, "render/layers_rank.comp", defines, error);
    if (program) {
        uint32_t first_slot;
        const uint32_t band = picture_slice_band_number(picture, &wave->slice, &first_slot);
        context_bind(wave);
        if (wave->frame->tile_samples)
            gpu_buffer_bind_texels(wave->device->gpu, wave->frame->tile_samples, UNIT_TILE_SAMPLES, GL_R32UI);
        for (uint32_t i = 0; i < count; i++)
            gpu_buffer_bind_storage(picture_band(picture, first + i, band), points[i]);
        gpu_buffer_bind_storage(&layers->notes.covers, BIND_COVERS);
        gpu_uniform_uint(program, "first_picture_slot", wave->slice.first_slot);
        gpu_uniform_uint(program, "first_slot", first_slot);
        gpu_uniform_uint(program, "slot_count", wave->slice.slot_count);
        gpu_uniform_uint(program, "sample_shift", wave->frame->uniforms.sample_shift);
        gpu_uniform_uint(program, "cover_waves", cover_waves(&layers->notes));
        gpu_dispatch(wave->device->gpu, program, wave->slice.slot_count);
    }
    context_span_end(wave->device);
    return program && gpu_check(wave->device->gpu, "ranks of what covers pixels", error);
}

bool layers_accumulate(struct layers *layers, struct picture *picture, struct render_wave *wave,
                       struct error *error)
{
    for (uint32_t plane = 0; plane < picture->plane_count; plane++) {
        enum layer layer = picture_plane_layer(picture, plane);
        if (layer == LAYER_BEAUTY || LAYER_BITS_CRYPTO >> layer & 1 || !adds(wave->frame, layer))
            continue;
        uint32_t first_sum = notes_plane(&layers->notes, 1u << layer) * layers->notes.plane_samples;
        if (!picture_accumulate(picture, wave, plane, &layers->notes.sums, first_sum, error))
            return false;
    }
    return rank_covers(layers, picture, wave, LAYER_BITS_CRYPTO_OBJECT, error) &&
           rank_covers(layers, picture, wave, LAYER_BITS_CRYPTO_MATERIAL, error);
}

uint64_t layers_device_bytes(const struct layers *layers)
{
    return layers->notes.sums.capacity_bytes + layers->notes.covers.capacity_bytes +
           moves_device_bytes(&layers->moves) + layers->ao_rays.capacity_bytes + layers->ao_times.capacity_bytes +
           layers->ao_visibility.capacity_bytes;
}

/* ---- as a pass ---- */

static bool wants(const void *self, const struct render_wave *wave)
{
    const struct layers *layers = self;
    if (wave->number == 0)
        return layers->noting;
    const bool may_be_unknown = wave->frame->tracer->impl->depends_on & CHANGED_VIEW;
    return layers->notes.layers & LAYER_BIT_UNKNOWN && may_be_unknown;
}

static enum pass_progress run(void *self, struct render_wave *wave, struct error *error)
{
    bool done = wave->number > 0;
    const bool noted = wave->number == 0 ? note_first(self, wave, &done, error) : mark_unknown(self, wave, error);
    return !noted ? PASS_FAILED : done ? PASS_DONE : PASS_MORE;
}

const struct pass layers_pass = {
    .name = "layers",
    .wants = wants,
    .reserve = reserve,
    .run = run,
    .finish = finish,
};
