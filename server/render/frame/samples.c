/* SPDX-License-Identifier: MIT */
/* The order of a picture's samples: some together, in strips that are rasterised, in slices that fit the buffers.
 */
#include "render/frame/samples.h"

#include "render/compare/waves.h"
#include "render/frame/key.h"
#include "render/frame/passes.h"
#include "render/picture/pixel_filter.h"
#include "render/picture/sequence.h"
#include "render/waves/compact.h"
#include "shared/path.h"

bool samples_reserve(struct frame_renderer *renderer, struct error *error)
{
    struct frame_work *work = renderer->work;
    return context_reserve(&work->wave, renderer->slice_rays_max, error) &&
           passes_reserve(work, renderer->slice_rays_max, error);
}

/* ---- slices ---- */

/* The position of a sample within all pixels, if they share one. */
static void place_sample(const struct render_frame *frame, uint32_t index, float place[2])
{
    const struct frame_uniforms *uniforms = &frame->uniforms;
    place[0] = place[1] = 0.5f;
    if (!frame->spread)
        return;
    float numbers[2];
    sequence_pair(numbers, sequence_seed(UINT32_MAX, UINT32_MAX, uniforms->seed), SEQUENCE_PIXEL, index);
    for (int i = 0; i < 2; i++)
        place[i] += pixel_filter_offset((const float *)uniforms->filter_places, numbers[i]);
}

/* Sets the uniforms of the samples that come next. */
static bool set_sample(struct frame_renderer *renderer, struct error *error)
{
    _Static_assert(sizeof(((struct frame_uniforms *)0)->sample_places) == SAMPLES_TOGETHER_MAX * 2 * sizeof(float),
                   "a place for each sample");
    struct frame_work *work = renderer->work;
    uint32_t left = work->frame.request.sampling.samples - renderer->sample;
    const uint32_t held = renderer->samples_before + renderer->sample;
    if (work->frame.request.sampling.noise > 0.0f && picture_noise_next(held) - held < left)
        left = picture_noise_next(held) - held;
    work->frame.uniforms.sample_index =
        (frame_is_layer_pass(renderer) ? renderer->eyes_samples_before : renderer->samples_before) +
        renderer->sample;
    const uint32_t sample_shift_max = work->primary.sample_shift_max;
    const uint32_t shift = slices_sample_shift(&renderer->slices, left);
    work->frame.uniforms.sample_shift = shift < sample_shift_max ? shift : sample_shift_max;
    /* A sample that is added to others has no group of its own. */
    work->frame.uniforms.group_shift =
        frame_request_is_open_ended(&work->frame.request)
            ? 0
            : slices_group_shift(work->frame.request.sampling.samples, renderer->sample);
    for (uint32_t i = 0; i < 1u << work->frame.uniforms.sample_shift; i++)
        place_sample(&work->frame, work->frame.uniforms.sample_index + i,
                     &work->frame.uniforms.sample_places[i / 2][i % 2 * 2]);
    context_set_number(&work->wave, 0);
    return context_upload_uniforms(&work->frame, error);
}

/* Begins the strip of that row. Strips begin where they do if no row is left out, so that rounding puts edges
 * where it does then. */
static void begin_strip(struct frame_renderer *renderer, uint32_t row)
{
    row -= row % renderer->work->primary.strip_rows;
    primary_rasterise_begin(&renderer->work->primary, row, 1u << renderer->work->frame.uniforms.sample_shift);
    renderer->samples_phase = SAMPLES_RASTER;
}

static bool begin_sample(struct frame_renderer *renderer, struct error *error)
{
    slices_restart(&renderer->slices);
    renderer->samples_phase = SAMPLES_SLICE;
    if (!set_sample(renderer, error))
        return false;
    if (renderer->work->primary.rasterises)
        begin_strip(renderer, renderer->target->crop_top * 8);
    return true;
}

static bool rasterise(struct frame_renderer *renderer, struct error *error)
{
    bool done = false;
    if (!primary_rasterise(&renderer->work->primary, &renderer->work->frame, &done, error))
        return false;
    renderer->samples_phase = done ? SAMPLES_SLICE : SAMPLES_RASTER;
    return true;
}

/* Repeats a slice whose wave did not fit, before any of it has reached the picture: as two halves, or, if the
 * rays of one pixel are too many, with larger buffers. */
static bool split_slice(struct frame_renderer *renderer, struct error *error)
{
    struct frame_work *work = renderer->work;
    renderer->result.splits++;
    if (work->frame.comparison)
        comparison_drop_slice(work->frame.comparison);
    compact_repeat(&work->wave);
    renderer->samples_phase = SAMPLES_SLICE;
    if (slices_split(&renderer->slices, &work->wave.slice))
        return true;
    if (work->wave.capacity > renderer->device->facts.storage_block_bytes_max / sizeof(struct child) / 8)
        return error_set(error, ERROR_LIMIT, "depth", "the rays of one pixel are more than the device holds");
    work->wave.capacity *= 2;
    slices_put_back(&renderer->slices, &work->wave.slice);
    return samples_reserve(renderer, error);
}

/* Repeats a slice that the device stopped: the picture has the slices before it, and none of those queued
 * behind it. */
static bool do_again(struct frame_renderer *renderer, const struct slice_ahead *stopped, uint32_t why,
                     struct error *error)
{
    struct frame_work *work = renderer->work;
    slices_ahead_drop(&work->ahead);
    renderer->slices = stopped->slices;
    renderer->sample = stopped->sample;
    if (!set_sample(renderer, error) ||
        !slices_take(&renderer->slices, renderer->target, work->frame.uniforms.sample_shift, &work->wave.slice))
        return error_set(error, ERROR_INTERNAL, NULL, "a slice to be done again is not there");
    const uint32_t row = picture_row_of(renderer->target, work->wave.slice.first_slot);
    if (why == WAVE_STOPPED_FULL && !split_slice(renderer, error))
        return false;
    if (why != WAVE_STOPPED_FULL) {
        if (why == WAVE_STOPPED_LONG) {
            work->frame.trace_state->patient = true;
            slices_ahead_forget(&work->ahead);
        } else {
            work->wave.waves_queued *= 2;
            renderer->waves_needed = work->wave.waves_queued;
        }
        slices_put_back(&renderer->slices, &work->wave.slice);
        compact_repeat(&work->wave);
    }
    renderer->samples_phase = SAMPLES_SLICE;
    if (work->primary.rasterises)
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

/* Takes those of the queued slices that are done. *again: a slice among them is done again. */
static bool land(struct frame_renderer *renderer, bool *again, struct error *error)
{
    struct slices_ahead *ahead = &renderer->work->ahead;
    *again = false;
    while (!*again && slices_ahead_has_done(ahead)) {
        const struct slice_ahead *slice;
        struct wave_state state;
        if (!slices_ahead_take(ahead, renderer->device, &slice, &state, error))
            return false;
        context_collect_done(&renderer->work->device);
        *again = state.stopped != 0;
        if (*again && !do_again(renderer, slice, state.stopped, error))
            return false;
        if (!*again)
            note_done(renderer, slice, &state);
    }
    return true;
}

/* Measures which tiles have samples enough, if that is due. If all have, the frame has. */
static bool measure_noise(struct frame_renderer *renderer, struct error *error)
{
    struct frame_work *work = renderer->work;
    struct picture *picture = renderer->target;
    const uint32_t held = renderer->samples_before + renderer->sample;
    if (!picture_noise_is_due(picture, held))
        return true;
    if (!picture_noise_measure(picture, &work->frame, held, error))
        return false;
    if (picture->noise.going_on == 0) {
        work->frame.request.sampling.samples = renderer->sample;
        picture->samples = held;
    }
    return true;
}

/* Adds the slice to the picture, once it cannot be repeated but on the device. */
static bool accumulate(struct frame_renderer *renderer, struct error *error)
{
    struct frame_work *work = renderer->work;
    struct picture *picture = renderer->target;
    const bool has_beauty = picture->layers & 1u << LAYER_BEAUTY; /* then it is the first plane */
    return (!work->frame.comparison || comparison_keep_slice(work->frame.comparison, error)) &&
           (!denoise_notes_samples(&work->frame) ||
            denoise_accumulate(&renderer->denoise, &work->denoise.notes, &work->wave, picture, error)) &&
           (!has_beauty || work->wave.sums.buffer != &work->wave.slice_sums ||
            picture_accumulate(picture, &work->wave, 0, &work->wave.slice_sums, 0, error)) &&
           layers_accumulate(&work->layers, picture, &work->wave, error);
}

static enum pass_progress add_sums(void *self, struct render_wave *wave, struct error *error)
{
    (void)wave;
    return accumulate(self, error) ? PASS_DONE : PASS_FAILED;
}

const struct pass sums_pass = {.name = "sums", .run = add_sums};

static bool end_slice(struct frame_renderer *renderer, struct error *error)
{
    struct frame_work *work = renderer->work;
    renderer->samples_phase = SAMPLES_SLICE;
    if (!work->device.counts_on_host)
        return slices_ahead_add(&work->ahead, renderer->device, &work->wave.state,
                                work->wave.slice.slot_count << work->frame.uniforms.sample_shift, error);
    count_rays(renderer, &work->wave.known_state);
    renderer->result.shadow_rays += work->wave.shadow_rays;
    return true;
}

/* Continues after a step of the slice's passes. */
static bool follow(struct frame_renderer *renderer, enum pass_progress progress, struct error *error)
{
    renderer->samples_phase = SAMPLES_PASSES;
    switch (progress) {
    case PASS_MORE:
        return true;
    case PASS_DONE:
        return end_slice(renderer, error);
    case PASS_REPEAT:
        return split_slice(renderer, error);
    case PASS_FAILED:
        break;
    }
    return false;
}

static bool begin_slice(struct frame_renderer *renderer, struct error *error)
{
    struct frame_work *work = renderer->work;
    bool again = false;
    if (!land(renderer, &again, error))
        return false;
    if (again || work->ahead.count == SLICES_AHEAD_MAX)
        return true;
    const uint32_t sample_shift = work->frame.uniforms.sample_shift;
    if (!work->device.counts_on_host)
        begin_ahead(renderer);
    if (!slices_take(&renderer->slices, renderer->target, sample_shift, &work->wave.slice)) {
        renderer->sample += 1u << sample_shift;
        const bool lands = renderer->sample == work->frame.request.sampling.samples ||
                           picture_noise_is_due(renderer->target, renderer->samples_before + renderer->sample);
        renderer->samples_phase = lands ? SAMPLES_LAND : SAMPLES_BEGIN;
        return true;
    }
    const uint32_t row = picture_row_of(renderer->target, work->wave.slice.first_slot);
    if (work->primary.rasterises && row - work->primary.first_row >= work->primary.strip_rows) {
        slices_put_back(&renderer->slices, &work->wave.slice); /* the slice is the first of the next strip */
        begin_strip(renderer, row);
        return true;
    }
    layers_begin_slice(&work->layers, &work->wave);
    work->wave.sums = picture_sums_place(renderer->target, &work->wave);
    return follow(renderer, passes_begin_slice(renderer, error), error);
}

/* ---- the picture ---- */

/* Ends the samples, all of which are in the picture. */
static enum pass_progress end_samples(struct frame_renderer *renderer, struct error *error)
{
    if (frame_is_mark_pass(renderer))
        return frame_key_end_marks(renderer, error) ? PASS_REPEAT : PASS_FAILED;
    if (frame_is_eyes_pass(renderer) && !key_view_copy_count(&renderer->key, renderer->device, error))
        return PASS_FAILED;
    /* The copy is there when the picture is, which is copied behind it. */
    return trace_state_copy_counts(renderer->work->frame.trace_state, error) ? PASS_DONE : PASS_FAILED;
}

static enum pass_progress land_all(struct frame_renderer *renderer, struct error *error)
{
    bool again = false;
    if (!land(renderer, &again, error))
        return PASS_FAILED;
    if (again || renderer->work->ahead.count > 0)
        return PASS_MORE;
    if (!measure_noise(renderer, error))
        return PASS_FAILED;
    if (renderer->sample < renderer->work->frame.request.sampling.samples) {
        renderer->samples_phase = SAMPLES_BEGIN;
        return PASS_MORE;
    }
    return end_samples(renderer, error);
}

static bool wants(const void *self, const struct render_wave *wave)
{
    (void)self;
    return wave->frame->request.sampling.samples >
           0; /* else the picture has all its samples and is only output again */
}

static enum pass_progress run(void *self, struct render_wave *wave, struct error *error)
{
    struct frame_renderer *renderer = self;
    bool good = false;
    (void)wave;
    switch (renderer->samples_phase) {
    case SAMPLES_BEGIN:
        good = begin_sample(renderer, error);
        break;
    case SAMPLES_RASTER:
        good = rasterise(renderer, error);
        break;
    case SAMPLES_SLICE:
        good = begin_slice(renderer, error);
        break;
    case SAMPLES_PASSES:
        good = follow(renderer, passes_run_slice(renderer, error), error);
        break;
    case SAMPLES_LAND:
        return land_all(renderer, error);
    }
    return good ? PASS_MORE : PASS_FAILED;
}

const struct pass samples_pass = {.name = "samples", .wants = wants, .run = run};

bool samples_wait(const struct frame_renderer *renderer)
{
    const struct slices_ahead *ahead = &renderer->work->ahead;
    const bool is_full = renderer->samples_phase == SAMPLES_SLICE && ahead->count == SLICES_AHEAD_MAX;
    return (is_full || renderer->samples_phase == SAMPLES_LAND) && ahead->count > 0 &&
           !slices_ahead_has_done(ahead);
}
