/* SPDX-License-Identifier: MIT */
/* The order of a frame that has begun: for each sample, or for some together, the raster pass, then slice by slice
 * primary hits, layers and waves; at last band by band resolve and readback. */
#include "render/frame/frame.h"

#include "base/clock.h"
#include "render/waves/compact.h"
#include "render/context/request.h"
#include "render/frame/state.h"
#include "render/passes/ground/ground.h"
#include "render/picture/pixel_filter.h"
#include "render/picture/sequence.h"
#include "render/waves/trace.h"
#include "render/passes/wireframe/wireframe.h"
#include "shared/path.h"

void frame_abandon(struct frame_renderer *renderer)
{
    if (renderer->phase != PHASE_IDLE) {
        gpu_timer_drop(renderer->work->context.timer);
        renderer->work->context.span_count = 0;
    }
    picture_drop_pixels(&renderer->picture);
    frame_end(renderer);
}

/* The position of a sample within all pixels, if they share one. */
static void place_sample(const struct render_context *context, uint32_t index, float place[2])
{
    const struct frame_uniforms *uniforms = &context->uniforms;
    place[0] = place[1] = 0.5f;
    if (!context->spread)
        return;
    float numbers[2];
    sequence_pair(numbers, sequence_seed(UINT32_MAX, UINT32_MAX, uniforms->seed), SEQUENCE_PIXEL, index);
    for (int i = 0; i < 2; i++)
        place[i] += pixel_filter_offset((const float *)uniforms->filter_places, numbers[i]);
}

/* The uniforms of the samples in hand. */
static bool set_sample(struct frame_renderer *renderer, struct error *error)
{
    _Static_assert(sizeof(((struct frame_uniforms *)0)->sample_places) == SAMPLES_TOGETHER_MAX * 2 * sizeof(float),
                   "a place for each sample");
    struct render_context *context = &renderer->work->context;
    uint32_t left = context->request.samples - renderer->sample;
    const uint32_t held = renderer->samples_before + renderer->sample;
    if (context->request.noise > 0.0f && picture_noise_next(held) - held < left)
        left = picture_noise_next(held) - held;
    context->uniforms.sample_index =
        (frame_is_layer_pass(renderer) ? renderer->eyes_samples_before : renderer->samples_before) +
        renderer->sample;
    const uint32_t shift = slices_sample_shift(&renderer->slices, left);
    context->uniforms.sample_shift = shift < renderer->sample_shift_max ? shift : renderer->sample_shift_max;
    /* A sample that is added to others has no group of its own. */
    context->uniforms.group_shift = frame_request_goes_on(&context->request)
                                        ? 0
                                        : slices_group_shift(context->request.samples, renderer->sample);
    for (uint32_t i = 0; i < 1u << context->uniforms.sample_shift; i++)
        place_sample(context, context->uniforms.sample_index + i,
                     &context->uniforms.sample_places[i / 2][i % 2 * 2]);
    context->wave_number = 0;
    return context_upload_uniforms(context, error);
}

/* What is seen in the strip of that row: strips begin where they do if no row is left out, so that rounding puts
 * edges where it does then. */
static void begin_strip(struct frame_renderer *renderer, uint32_t row)
{
    row -= row % renderer->strip_rows;
    primary_rasterise_begin(&renderer->work->primary, row, 1u << renderer->work->context.uniforms.sample_shift);
    renderer->phase = PHASE_RASTER;
}

static bool begin_sample(struct frame_renderer *renderer, struct error *error)
{
    slices_restart(&renderer->slices);
    renderer->phase = PHASE_SLICE;
    if (!set_sample(renderer, error))
        return false;
    if (renderer->rasterise)
        begin_strip(renderer, renderer->target->crop_top * 8);
    return true;
}

static bool rasterise(struct frame_renderer *renderer, struct error *error)
{
    bool done = false;
    if (!primary_rasterise(&renderer->work->primary, &renderer->work->context, &done, error))
        return false;
    renderer->phase = done ? PHASE_SLICE : PHASE_RASTER;
    return true;
}

static const struct primary *rasterised(const struct frame_renderer *renderer)
{
    return renderer->rasterise ? &renderer->work->primary : NULL;
}

/* A wave did not fit. Nothing of the slice has reached the picture, so it is traced again: as two halves, or, if
 * the rays of one pixel are too many, with larger buffers. */
static bool split_slice(struct frame_renderer *renderer, struct error *error)
{
    struct render_context *context = &renderer->work->context;
    renderer->result.splits++;
    if (context->comparison)
        comparison_drop_slice(context->comparison);
    compact_go_on(context);
    renderer->phase = PHASE_SLICE;
    if (slices_split(&renderer->slices, &context->slice))
        return true;
    if (context->wave_capacity > renderer->device->facts.storage_block_bytes_max / sizeof(struct child) / 8)
        return error_set(error, ERROR_LIMIT, "depth", "the rays of one pixel are more than the device holds");
    context->wave_capacity *= 2;
    slices_put_back(&renderer->slices, &context->slice);
    return frame_reserve_waves(renderer, error);
}

/* The device has stopped a slice: the picture has what was before it, and nothing of what is queued behind it. */
static bool do_again(struct frame_renderer *renderer, const struct slice_ahead *stopped, uint32_t why,
                     struct error *error)
{
    struct render_context *context = &renderer->work->context;
    slices_ahead_drop(&renderer->work->ahead);
    renderer->slices = stopped->slices;
    renderer->sample = stopped->sample;
    if (!set_sample(renderer, error) ||
        !slices_take(&renderer->slices, renderer->target, context->uniforms.sample_shift, &context->slice))
        return error_set(error, ERROR_INTERNAL, NULL, "a slice to be done again is not there");
    const uint32_t row = picture_row_of(renderer->target, context->slice.first_slot);
    if (why == WAVE_STOPPED_FULL && !split_slice(renderer, error))
        return false;
    if (why != WAVE_STOPPED_FULL) {
        if (why == WAVE_STOPPED_LONG) {
            context->trace_state->patient = true;
            slices_ahead_forget(&renderer->work->ahead);
        } else {
            context->waves_queued *= 2;
            renderer->waves_needed = context->waves_queued;
        }
        slices_put_back(&renderer->slices, &context->slice);
        compact_go_on(context);
    }
    renderer->phase = PHASE_SLICE;
    if (renderer->rasterise)
        begin_strip(renderer, row);
    return true;
}

static void count_rays(struct frame_renderer *renderer, const struct wave_state *state)
{
    renderer->result.shadow_rays += state->all_shadow_rays;
    renderer->result.secondary_rays += state->all_secondary_rays;
    renderer->result.sorted_waves += state->all_sorted_waves;
}

/* The samples of that slice are in the picture. */
static void note_done(struct frame_renderer *renderer, const struct slice_ahead *slice,
                      const struct wave_state *state)
{
    count_rays(renderer, state);
    slices_ahead_learn(&renderer->work->ahead, slice, renderer->shared->step_ns);
}

static void begin_ahead(struct frame_renderer *renderer)
{
    struct slices_ahead *ahead = &renderer->work->ahead;
    renderer->slices.slice_rays = slices_ahead_rays(ahead, renderer->slice_rays_max);
    slices_ahead_begin(ahead, renderer->device, &renderer->slices, renderer->sample);
}

/* Those of the queued slices that are done. *again: one of them is done again. */
static bool land(struct frame_renderer *renderer, bool *again, struct error *error)
{
    struct slices_ahead *ahead = &renderer->work->ahead;
    *again = false;
    while (!*again && slices_ahead_has_done(ahead)) {
        const struct slice_ahead *slice;
        struct wave_state state;
        if (!slices_ahead_take(ahead, renderer->device, &slice, &state, error))
            return false;
        context_collect_done(&renderer->work->context);
        *again = state.stopped != 0;
        if (*again && !do_again(renderer, slice, state.stopped, error))
            return false;
        if (!*again)
            note_done(renderer, slice, &state);
    }
    return true;
}

/* If it is time to: which tiles have samples enough. If all have, the frame has. */
static bool measure_noise(struct frame_renderer *renderer, struct error *error)
{
    struct render_context *context = &renderer->work->context;
    struct picture *picture = renderer->target;
    const uint32_t held = renderer->samples_before + renderer->sample;
    if (!picture_noise_is_due(picture, held))
        return true;
    if (!picture_noise_measure(picture, context, held, error))
        return false;
    if (picture->noise.going_on == 0) {
        context->request.samples = renderer->sample;
        picture->samples = held;
    }
    return true;
}

static bool land_all(struct frame_renderer *renderer, struct error *error)
{
    bool again = false;
    if (!land(renderer, &again, error))
        return false;
    if (again || renderer->work->ahead.count > 0)
        return true;
    if (!measure_noise(renderer, error))
        return false;
    if (renderer->sample < renderer->work->context.request.samples) {
        renderer->phase = PHASE_SAMPLE;
        return true;
    }
    if (frame_is_mark_pass(renderer))
        return frame_key_end_marks(renderer, error);
    renderer->phase = frame_is_layer_pass(renderer) ? PHASE_KEEP : PHASE_DENOISE;
    if (frame_is_eyes_pass(renderer) && !key_view_copy_count(&renderer->key, renderer->device, error))
        return false;
    /* It is there when the picture is, which is copied behind it. */
    return trace_state_copy_counts(renderer->work->context.trace_state, error);
}

static bool begin_slice(struct frame_renderer *renderer, struct error *error)
{
    struct render_context *context = &renderer->work->context;
    bool again = false;
    if (!land(renderer, &again, error))
        return false;
    if (again || renderer->work->ahead.count == SLICES_AHEAD_MAX)
        return true;
    uint32_t sample_shift = context->uniforms.sample_shift;
    if (!context->counts_on_host)
        begin_ahead(renderer);
    if (!slices_take(&renderer->slices, renderer->target, sample_shift, &context->slice)) {
        renderer->sample += 1u << sample_shift;
        const bool lands = renderer->sample == context->request.samples ||
                           picture_noise_is_due(renderer->target, renderer->samples_before + renderer->sample);
        renderer->phase = lands ? PHASE_LAND : PHASE_SAMPLE;
        return true;
    }
    uint32_t row = picture_row_of(renderer->target, context->slice.first_slot);
    if (renderer->rasterise && row - renderer->work->primary.first_row >= renderer->strip_rows) {
        slices_put_back(&renderer->slices, &context->slice); /* it is the first of the next strip */
        begin_strip(renderer, row);
        return true;
    }
    layers_begin_slice(&renderer->work->layers, context);
    context->sums = picture_sums_place(renderer->target, context);
    renderer->phase = PHASE_PRIMARY;
    const bool begun = frame_is_eyes_pass(renderer) ? frame_key_begin_slice(renderer, error)
                                                    : primary_begin_slice(rasterised(renderer), context, error);
    return begun && gpu_check_reset(renderer->device, "primary rays", error);
}

static bool note_guides(struct frame_renderer *renderer, struct error *error)
{
    struct render_context *context = &renderer->work->context;
    return !denoise_notes_samples(context) ||
           denoise_note(&renderer->denoise, &renderer->work->denoise.notes,
                        denoise_history_moved(&renderer->history), context, error);
}

static bool follow_guides(struct frame_renderer *renderer, struct error *error)
{
    struct render_context *context = &renderer->work->context;
    return !denoise_notes_samples(context) ||
           denoise_follow(&renderer->denoise, &renderer->work->denoise.notes,
                          denoise_history_moved(&renderer->history), context, error);
}

static bool trace_wave(struct frame_renderer *renderer, struct error *error)
{
    struct render_context *context = &renderer->work->context;
    struct wave wave = {
        .kind = WAVE_CLOSEST,
        .rays = &context->rays,
        .hits = &context->hits,
        .times = context_ray_times(context),
    };
    bool done = false;
    compact_rays(context, &wave);
    if (!wave_trace(context, RAY_SECONDARY, &wave, &done, error))
        return false;
    if (!done)
        return true;
    renderer->phase = PHASE_SHADE;
    context->sampled_hits = context->tracer->impl->sampled;
    context_span_begin(context, STAGE_SHADE);
    bool listed = ground_hit(context, renderer->work->passes.integrator, error) && compact_hits(context, error);
    context_span_end(context);
    return listed && follow_guides(renderer, error) &&
           layers_mark_unknown(&renderer->work->layers, context, error);
}

static bool accumulate(struct frame_renderer *renderer, struct error *error)
{
    struct render_context *context = &renderer->work->context;
    struct picture *picture = renderer->target;
    bool has_beauty = picture->layers & 1u << LAYER_BEAUTY; /* then it is the first plane */
    return (!context->comparison || comparison_keep_slice(context->comparison, error)) &&
           (!denoise_notes_samples(context) ||
            denoise_accumulate(&renderer->denoise, &renderer->work->denoise.notes, context, picture, error)) &&
           (!has_beauty || context->sums.buffer != &context->slice_sums ||
            picture_accumulate(picture, context, 0, &context->slice_sums, 0, error)) &&
           layers_accumulate(&renderer->work->layers, picture, context, error);
}

static bool finish_slice(struct frame_renderer *renderer, struct error *error)
{
    struct render_context *context = &renderer->work->context;
    renderer->phase = PHASE_SLICE;
    if (!accumulate(renderer, error))
        return false;
    if (!context->counts_on_host)
        return slices_ahead_add(&renderer->work->ahead, renderer->device, &context->wave_state,
                                context->slice.slot_count << context->uniforms.sample_shift, error);
    count_rays(renderer, &context->known_state);
    renderer->result.shadow_rays += context->shadow_rays;
    return true;
}

static bool find_eyes(struct frame_renderer *renderer, struct error *error)
{
    bool done = false;
    if (!frame_key_find(renderer, &done, error))
        return false;
    if (!done)
        return true;
    if (!renderer->work->layers.noting)
        return finish_slice(renderer, error);
    renderer->phase = PHASE_LAYERS;
    return true;
}

/* First hits are listed already: where they were rasterised, that list is of what was filled in. */
static bool list_ground(struct frame_renderer *renderer, struct error *error)
{
    struct render_context *context = &renderer->work->context;
    const struct integrator *integrator = renderer->work->passes.integrator;
    if (!ground_is_shown(context, integrator))
        return true;
    context_span_begin(context, STAGE_SHADE);
    const bool listed = ground_hit(context, integrator, error) && compact_hits(context, error);
    context_span_end(context);
    return listed;
}

static bool find_primary(struct frame_renderer *renderer, struct error *error)
{
    bool done = false;
    if (frame_is_eyes_pass(renderer))
        return find_eyes(renderer, error);
    struct render_context *context = &renderer->work->context;
    if (!primary_find(rasterised(renderer), context, &done, error))
        return false;
    if (done)
        renderer->phase = renderer->work->layers.wanted ? PHASE_LAYERS : PHASE_SHADE;
    if (done && (!list_ground(renderer, error) || !wireframe_paint(context, error)))
        return false;
    if (done && !note_guides(renderer, error))
        return false;
    return gpu_check(renderer->device, "primary hits", error);
}

static bool note_layers(struct frame_renderer *renderer, struct error *error)
{
    bool done = false;
    if (!layers_step(&renderer->work->layers, &renderer->work->context, &done, error))
        return false;
    if (!done)
        return true;
    const bool is_shaded =
        renderer->target->layers & 1u << LAYER_BEAUTY || layers_are_shaded(&renderer->work->layers);
    if (!is_shaded || frame_is_eyes_pass(renderer))
        return finish_slice(renderer, error);
    renderer->phase = PHASE_SHADE;
    return true;
}

static bool shade_wave(struct frame_renderer *renderer, struct error *error)
{
    struct render_context *context = &renderer->work->context;
    switch (wave_passes_shade(&renderer->work->passes, context, error)) {
    case WAVE_AGAIN:
        return true;
    case WAVE_MORE:
        renderer->phase = PHASE_TRACE;
        return true;
    case WAVE_OVERFLOW:
        return split_slice(renderer, error);
    case WAVE_DONE:
        return finish_slice(renderer, error);
    case WAVE_FAILED:
        break;
    }
    return false;
}

static bool denoise(struct frame_renderer *renderer, struct error *error)
{
    struct render_context *context = &renderer->work->context;
    bool done = true;
    context->wave_number = 0;
    if (denoise_is_wanted(context) && denoise_strength(&context->request, renderer->picture.samples) > 0.0f) {
        if (!denoise_step(&renderer->work->denoise, &renderer->denoise, &renderer->history, context,
                          &renderer->picture, &done, error))
            return false;
        renderer->picture.denoised = denoise_sums_band(&renderer->denoise, DENOISE_SUM_RESULT, 0);
    }
    if (done)
        renderer->phase = PHASE_RESOLVE;
    return true;
}

static bool all_resolved(const struct frame_renderer *renderer)
{
    return renderer->plane == renderer->picture.plane_count;
}

/* The previous band is fetched while this one is copied. */
static bool pass_on(struct frame_renderer *renderer, bool has_band, uint32_t plane, uint32_t band,
                    struct error *error)
{
    struct picture *picture = &renderer->picture;
    struct render_context *context = &renderer->work->context;
    struct gpu_readback *before = &renderer->work->copies[renderer->copied % 2];
    struct gpu_readback *next = &renderer->work->copies[(renderer->copied + 1) % 2];
    if (has_band && !picture_copy_band(picture, context, next, plane, band, error))
        return false;
    if (renderer->copying &&
        !picture_take_band(picture, context, before, renderer->copied_plane, renderer->copied_band, error))
        return false;
    renderer->copying = has_band;
    renderer->copied++;
    renderer->copied_plane = plane;
    renderer->copied_band = band;
    return true;
}

/* One band of one plane; the last one is followed by none. */
static bool read_band(struct frame_renderer *renderer, struct error *error)
{
    struct picture *picture = &renderer->picture;
    struct render_context *context = &renderer->work->context;
    const uint32_t plane = renderer->plane, band = renderer->band;
    if (!picture->pixels)
        return frame_reserve_pixels(renderer, error);
    context->wave_number = 0;
    if (all_resolved(renderer))
        return pass_on(renderer, false, 0, 0, error);
    if (++renderer->band == picture->band_count) {
        renderer->band = 0;
        renderer->plane++;
    }
    return picture_resolve_band(picture, context, plane, band, error) &&
           pass_on(renderer, true, plane, band, error);
}

bool frame_step_waits(const struct frame_renderer *renderer)
{
    struct tracer *building = !renderer->built                              ? renderer->tracer
                              : !renderer->second_built && renderer->second ? renderer->second
                              : !renderer->key_built                        ? renderer->key_tracer
                                                                            : NULL;
    if (renderer->phase == PHASE_BUILD && building)
        return tracer_update_waits(building);
    if (renderer->phase == PHASE_UPDATE && gpu_scene_bring_waits(&renderer->shared->copy))
        return true;
    const struct slices_ahead *ahead = &renderer->work->ahead;
    if (renderer->phase == PHASE_LAND || (renderer->phase == PHASE_SLICE && ahead->count == SLICES_AHEAD_MAX))
        return ahead->count > 0 && !slices_ahead_has_done(ahead);
    return renderer->phase == PHASE_RESOLVE && renderer->picture.pixels && renderer->copying &&
           all_resolved(renderer) && !gpu_readback_is_done(&renderer->work->copies[renderer->copied % 2]);
}

static size_t attached_bytes(const struct frame_request *request)
{
    size_t count = (size_t)__builtin_popcount(request->attachments);
    return count * request->width * request->height * frame_format_bytes(PIXEL_FORMAT_DEPTH32F);
}

static bool hand_out(struct frame_renderer *renderer, struct frame_result *result, struct error *error)
{
    struct render_context *context = &renderer->work->context;
    const struct frame_request *request = &context->request;
    if (context->comparison && !comparison_take(context->comparison, &renderer->result.comparisons,
                                                &renderer->result.comparison_count, error))
        return false;
    if (!trace_state_tell(renderer->work->trace_state, &renderer->result.structure, error) ||
        (frame_is_from_layers(&renderer->request) && !frame_key_tell(renderer, error)))
        return false;
    context_collect(context);
    stage_times_add(&context->times, STAGE_FRAME, CLOCK_CPU, 0, context->times.origin_ns,
                    clock_now_ns() - context->times.origin_ns);
    *result = renderer->result;
    const struct frame_crop all = {0, 0, request->width, request->height};
    const struct frame_crop *part = request->crop.width > 0 ? &request->crop : &all;
    if (request->crop.width > 0)
        picture_cut(&renderer->picture, request);
    result->pixels = renderer->picture.pixels;
    result->layers = frame_request_layers(request);
    result->attachments = request->attachments;
    result->size_bytes = renderer->picture.size_bytes - attached_bytes(request);
    renderer->picture.pixels = NULL;
    result->width = part->width;
    result->height = part->height;
    result->format = request->format;
    result->ycbcr = request->ycbcr;
    result->samples = renderer->picture.samples;
    result->noise = renderer->picture.noise.error;
    result->primary_rays += request->noise > 0.0f
                                ? picture_noise_rays(&renderer->picture, renderer->samples_before)
                                : (uint64_t)part->width * part->height * request->samples;
    result->times = context->times;
    renderer->kept_request = *request;
    renderer->kept_samples = result->samples;
    renderer->kept_showing = renderer->shared->showing;
    frame_end(renderer);
    return true;
}

enum frame_progress frame_step(struct frame_renderer *renderer, struct frame_result *result, struct error *error)
{
    const struct gpu_device *device = renderer->device;
    const uint64_t waits = device->waits, dispatches = device->dispatches, barriers = device->barriers;
    bool good = false;
    switch (renderer->phase) {
    case PHASE_IDLE:
        error_set(error, ERROR_INTERNAL, NULL, "a step of no frame");
        return FRAME_FAILED;
    case PHASE_UPDATE:
        good = frame_update(renderer, error);
        break;
    case PHASE_BUILD:
        good = frame_build(renderer, error);
        break;
    case PHASE_SAMPLE:
        good = begin_sample(renderer, error);
        break;
    case PHASE_RASTER:
        good = rasterise(renderer, error);
        break;
    case PHASE_SLICE:
        good = begin_slice(renderer, error);
        break;
    case PHASE_PRIMARY:
        good = find_primary(renderer, error);
        break;
    case PHASE_LAYERS:
        good = note_layers(renderer, error);
        break;
    case PHASE_SHADE:
        good = shade_wave(renderer, error);
        break;
    case PHASE_TRACE:
        good = trace_wave(renderer, error);
        break;
    case PHASE_LAND:
        good = land_all(renderer, error);
        break;
    case PHASE_KEEP:
        good = frame_key_keep(renderer, error);
        break;
    case PHASE_DENOISE:
        good = denoise(renderer, error);
        break;
    case PHASE_RESOLVE:
        good = read_band(renderer, error);
        break;
    }
    renderer->result.device_waits += (uint32_t)(device->waits - waits);
    renderer->result.dispatches += (uint32_t)(device->dispatches - dispatches);
    renderer->result.barriers += (uint32_t)(device->barriers - barriers);
    if (!good) {
        frame_abandon(renderer);
        return FRAME_FAILED;
    }
    if (renderer->phase != PHASE_RESOLVE || !all_resolved(renderer) || renderer->copying)
        return FRAME_MORE;
    if (hand_out(renderer, result, error))
        return FRAME_DONE;
    frame_abandon(renderer);
    return FRAME_FAILED;
}
