/* SPDX-License-Identifier: MIT */
/* Filters the noise out of a picture, one strip and one pass of the filter after the other. */
#include "render/passes/denoise/filter.h"

#include "shared/denoise.h"

#include <epoxy/gl.h>

#include <math.h>

#define LEVELS 4u /* levels of the wavelet: the widest sees 15 pixels far */
/* Rows on both sides that a strip depends on: each level reads up to 2^level pixels away and its risk
 * DENOISE_CHOICE_RADIUS times that, and the noise is estimated from 4 pixels around. */
#define EDGE_ROWS (((1u << LEVELS) - 1) * (1 + DENOISE_CHOICE_RADIUS) + 4)
/* Pixels of a dispatch: software GL does them within some ten milliseconds; a GPU has no use for more than this.
 */
#define STEP_PIXELS (1u << 15) /* times step_scale */
/* Number of samples up to which noise weighs more than detail that resembles it. */
#define FEW_SAMPLES 16u

enum filter_pass {
    PASS_TAKE,
    PASS_REPROJECT,
    PASS_NOISE,
    PASS_SETTLE,
    PASS_LEVELS,
    PASS_GIVE = PASS_LEVELS + 2 * LEVELS,
    PASS_COUNT
};

void denoise_begin(struct denoise_filter *filter, struct denoise_sums *sums, struct denoise_history *history,
                   struct picture *picture)
{
    filter->sums = sums;
    filter->history = history;
    filter->picture = picture;
    filter->own_row = filter->own_end = filter->pass = filter->row = 0;
}

static uint64_t rows_max(const struct render_frame *frame, const struct picture *picture)
{
    const struct gpu_facts *facts = &frame->device->gpu->facts;
    const uint64_t row_bytes = picture->width * sizeof(uvec4);
    const uint64_t by_bytes = facts->storage_block_bytes_max / row_bytes;
    const uint64_t by_texels = facts->texture_buffer_texels_max / picture->width;
    return by_bytes < by_texels ? by_bytes : by_texels;
}

static bool reserve_strip(struct denoise_filter *filter, const struct render_frame *frame, uint32_t width,
                          bool has_motion, struct error *error)
{
    struct gpu_device *device = frame->device->gpu;
    const size_t pixels = (size_t)width * filter->strip_rows;
    struct gpu_buffer *const lights[] = {&filter->first, &filter->wider, &filter->levels[0], &filter->levels[1]};
    for (size_t i = 0; i < sizeof(lights) / sizeof(*lights); i++)
        if (!gpu_buffer_reserve(device, lights[i], pixels * sizeof(uvec4), error))
            return false;
    const size_t motions = has_motion ? pixels * 2 * sizeof(uint32_t) : 0;
    return gpu_buffer_reserve(device, &filter->motions, motions, error) &&
           gpu_buffer_reserve(device, &filter->guides, pixels * 2 * sizeof(uint32_t), error) &&
           gpu_buffer_reserve(device, &filter->slopes, pixels * sizeof(uint32_t), error) &&
           gpu_buffer_reserve(device, &filter->risks, pixels * 2 * sizeof(float), error);
}

/* Begins a strip, which is the whole picture where it fits. */
static bool begin_strip(struct denoise_filter *filter, const struct render_frame *frame, struct error *error)
{
    const uint64_t most = rows_max(frame, filter->picture);
    filter->own_row = filter->own_end;
    if (most < 3 * EDGE_ROWS && most < filter->picture->height)
        return error_set(error, ERROR_LIMIT, "denoise", "a picture of %u pixels across is too wide for it",
                         filter->picture->width);
    const bool fits = filter->picture->height <= most;
    const uint32_t own = fits ? filter->picture->height : (uint32_t)most - 2 * EDGE_ROWS;
    const uint32_t left = filter->picture->height - filter->own_row;
    filter->own_end = filter->own_row + (left < own ? left : own);
    filter->strip_row = filter->own_row > EDGE_ROWS ? filter->own_row - EDGE_ROWS : 0;
    const uint64_t end = (uint64_t)filter->own_end + EDGE_ROWS;
    filter->strip_rows =
        (end < filter->picture->height ? (uint32_t)end : filter->picture->height) - filter->strip_row;
    return reserve_strip(filter, frame, filter->picture->width, filter->sums->has_motion, error) &&
           denoise_history_reserve(filter->history, frame, fits && !filter->sums->follows,
                                   filter->sums->has_motion, error);
}

static void bind_light(const struct render_frame *frame, struct gpu_buffer *buffer, unsigned unit)
{
    gpu_buffer_bind_texels(frame->device->gpu, buffer, unit, GL_RGBA32UI);
}

static void bind_guides(struct denoise_filter *filter, const struct render_frame *frame)
{
    gpu_buffer_bind_texels(frame->device->gpu, &filter->guides, UNIT_DENOISE_GUIDE, GL_RG32UI);
}

static void bind_risks(struct denoise_filter *filter, const struct render_frame *frame)
{
    gpu_buffer_bind_texels(frame->device->gpu, &filter->risks, UNIT_DENOISE_RISK, GL_RG32F);
}

static void bind_sums(struct denoise_filter *filter, const struct render_frame *frame,
                      const struct gpu_program *program, uint32_t band)
{
    const struct denoise_sums *sums = filter->sums;
    const struct picture *picture = filter->picture;
    gpu_buffer_bind_storage(picture_band(picture, 0, band), BIND_ACCUMULATION);
    gpu_buffer_bind_storage(denoise_sums_band(sums, DENOISE_SUM_HALF, band), BIND_DENOISE_HALF);
    gpu_buffer_bind_storage(denoise_sums_band(sums, DENOISE_SUM_ALBEDO, band), BIND_DENOISE_ALBEDO);
    gpu_buffer_bind_storage(denoise_sums_band(sums, DENOISE_SUM_NORMAL, band), BIND_DENOISE_NORMAL);
    if (sums->has_motion)
        gpu_buffer_bind_storage(denoise_sums_band(sums, DENOISE_SUM_MOTION, band), BIND_DENOISE_MOTION);
    gpu_uniform_uint(program, "band_row", picture_band_first_row(picture, band));
    gpu_uniform_uint(program, "sample_count", picture->samples);
    if (frame->tile_samples) {
        uint32_t first_slot;
        (void)picture_band_slots(picture, band, &first_slot);
        gpu_uniform_uint(program, "first_tile", first_slot / TILE_SLOTS);
    }
    gpu_uniform_float(program, "strength", denoise_strength(&frame->request, picture->samples));
}

static void bind_take(struct denoise_filter *filter)
{
    gpu_buffer_bind_storage(&filter->guides, BIND_DENOISE_GUIDE);
    gpu_buffer_bind_storage(&filter->first, BIND_DENOISE_OUT);
    if (filter->sums->has_motion)
        gpu_buffer_bind_storage(&filter->motions, BIND_DENOISE_OUT_TOO);
}

static void bind_reproject(struct denoise_filter *filter, const struct render_frame *frame,
                           const struct gpu_program *program)
{
    if (filter->sums->has_motion)
        gpu_buffer_bind_texels(frame->device->gpu, &filter->motions, UNIT_DENOISE_MOTION, GL_RG32UI);
    bind_light(frame, &filter->first, UNIT_DENOISE_LIGHT);
    bind_guides(filter, frame);
    gpu_buffer_bind_storage(&filter->levels[0], BIND_DENOISE_OUT);
    denoise_history_bind(filter->history, frame, program, filter->picture->samples);
}

static void bind_give(struct denoise_filter *filter, const struct render_frame *frame, uint32_t band)
{
    if (filter->history->is_written)
        bind_light(frame, denoise_history_pixels(filter->history), UNIT_DENOISE_WIDER);
    bind_light(frame, &filter->levels[(LEVELS - 1) % 2], UNIT_DENOISE_LIGHT);
    bind_light(frame, &filter->first, UNIT_DENOISE_FIRST);
    bind_guides(filter, frame);
    gpu_buffer_bind_storage(denoise_sums_band(filter->sums, DENOISE_SUM_RESULT, band), BIND_DENOISE_OUT);
}

/* With few samples, the noise of mirrors and glass hides the things in them. With many, the halves of the
 * samples differ by those things, and so does the history, as the eye moves. */
static float mirror_doubt(const struct denoise_history *history, uint32_t samples)
{
    const float many = fminf(fmaxf((float)samples / (float)FEW_SAMPLES - 1.0f, 0.0f), 1.0f);
    return history->is_written ? DENOISE_MIRROR_DOUBT : DENOISE_MIRROR_DOUBT * many;
}

static void bind_noise(struct denoise_filter *filter, const struct render_frame *frame,
                       const struct gpu_program *program)
{
    bind_light(frame, filter->history->is_written ? &filter->levels[0] : &filter->first, UNIT_DENOISE_LIGHT);
    bind_guides(filter, frame);
    gpu_buffer_bind_storage(&filter->slopes, BIND_DENOISE_SLOPE);
    gpu_buffer_bind_storage(&filter->risks, BIND_DENOISE_OUT);
    gpu_buffer_bind_storage(&filter->wider, BIND_DENOISE_OUT_TOO);
    gpu_uniform_uint(program, "one_sample", filter->picture->samples == 1);
    gpu_uniform_float(program, "doubt", mirror_doubt(filter->history, filter->picture->samples));
    gpu_uniform_float(program, "white", exp2f(-frame->request.picture.exposure_stops));
}

/* Share of the halves' difference that counts as noise: it falls with the samples, so that edges within
 * pixels stay. With few samples the fall of the error is estimated from quarters of two samples, so half of
 * it is not believed. */
static float believed(uint32_t samples)
{
    return samples < FEW_SAMPLES ? 2.0f : 5.0f / (1.0f + log2f((float)samples));
}

static void bind_settle(struct denoise_filter *filter, const struct render_frame *frame,
                        const struct gpu_program *program)
{
    gpu_uniform_float(program, "believed", believed(filter->picture->samples));
    bind_light(frame, &filter->wider, UNIT_DENOISE_LIGHT);
    bind_guides(filter, frame);
    bind_risks(filter, frame);
    gpu_buffer_bind_storage(&filter->first, BIND_DENOISE_OUT);
}

static void bind_level(struct denoise_filter *filter, const struct render_frame *frame,
                       const struct gpu_program *program)
{
    const uint32_t level = (filter->pass - PASS_LEVELS) / 2;
    const bool chooses = (filter->pass - PASS_LEVELS) % 2;
    bind_light(frame, level > 0 ? &filter->levels[(level - 1) % 2] : &filter->first, UNIT_DENOISE_LIGHT);
    gpu_uniform_int(program, "spacing", 1 << level);
    if (chooses) {
        bind_light(frame, &filter->wider, UNIT_DENOISE_WIDER);
        bind_risks(filter, frame);
        gpu_buffer_bind_storage(&filter->levels[level % 2], BIND_DENOISE_OUT);
        return;
    }
    bind_guides(filter, frame);
    gpu_buffer_bind_texels(frame->device->gpu, &filter->slopes, UNIT_DENOISE_SLOPE, GL_R32UI);
    bind_light(frame, &filter->first, UNIT_DENOISE_FIRST);
    gpu_buffer_bind_storage(&filter->wider, BIND_DENOISE_OUT);
    gpu_buffer_bind_storage(&filter->risks, BIND_DENOISE_OUT_TOO);
}

static const char *shader_of(uint32_t pass)
{
    switch (pass) {
    case PASS_TAKE:
        return "render/denoise_take.comp";
    case PASS_REPROJECT:
        return "render/denoise_reproject.comp";
    case PASS_NOISE:
        return "render/denoise_noise.comp";
    case PASS_SETTLE:
        return "render/denoise_settle.comp";
    case PASS_GIVE:
        return "render/denoise_give.comp";
    }
    return (pass - PASS_LEVELS) % 2 ? "render/denoise_choose.comp" : "render/denoise_filter.comp";
}

static void bind_pass(struct denoise_filter *filter, const struct render_frame *frame,
                      const struct gpu_program *program)
{
    const uint32_t band = (filter->strip_row + filter->row) / filter->picture->band_rows;
    switch (filter->pass) {
    case PASS_TAKE:
        bind_sums(filter, frame, program, band);
        bind_take(filter);
        break;
    case PASS_REPROJECT:
        bind_reproject(filter, frame, program);
        break;
    case PASS_NOISE:
        bind_noise(filter, frame, program);
        break;
    case PASS_SETTLE:
        bind_settle(filter, frame, program);
        break;
    case PASS_GIVE:
        bind_sums(filter, frame, program, band);
        bind_give(filter, frame, band);
        break;
    default:
        bind_level(filter, frame, program);
    }
}

/* Rows of the strip that a pass is over: the last one only over its own. */
static void rows_of_pass(const struct denoise_filter *filter, uint32_t *begin, uint32_t *end)
{
    const bool gives = filter->pass == PASS_GIVE;
    *begin = gives ? filter->own_row - filter->strip_row : 0;
    *end = gives ? filter->own_end - filter->strip_row : filter->strip_rows;
}

/* Whether the frame has bands with slots in tiles. */
static bool has_band(const struct denoise_filter *filter)
{
    return filter->pass == PASS_TAKE || filter->pass == PASS_GIVE;
}

/* Rows from the current one on, no farther than the end of its band where bands are bound. */
static uint32_t rows_of_step(const struct denoise_filter *filter, const struct render_frame *frame, uint32_t left)
{
    const uint32_t pixels = STEP_PIXELS * frame->device->gpu->facts.step_scale;
    uint32_t rows = pixels / filter->picture->width ? pixels / filter->picture->width : 1;
    const uint32_t row = filter->strip_row + filter->row;
    const uint32_t band_left = filter->picture->band_rows - row % filter->picture->band_rows;
    rows = has_band(filter) && band_left < rows ? band_left : rows;
    return rows < left ? rows : left;
}

static bool dispatch(struct denoise_filter *filter, const struct render_frame *frame, uint32_t rows,
                     struct error *error)
{
    const char *shader = shader_of(filter->pass);
    const bool gives_reprojected = filter->pass == PASS_GIVE && filter->history->is_written;
    const bool asks_sums = has_band(filter) || filter->pass == PASS_REPROJECT;
    const struct gpu_program *program = asks_sums
                                            ? denoise_use(frame, filter->sums, shader, gives_reprojected, error)
                                            : context_use(frame->device, shader, error);
    if (!program)
        return false;
    context_span_begin(frame->device, STAGE_RESOLVE);
    context_bind_frame(frame);
    gpu_uniform_uint(program, "first_row", filter->row);
    gpu_uniform_uint(program, "item_count", rows * filter->picture->width);
    gpu_uniform_uint(program, "strip_row", filter->strip_row);
    gpu_uniform_uint(program, "strip_rows", filter->strip_rows);
    bind_pass(filter, frame, program);
    gpu_dispatch(frame->device->gpu, program, (uint64_t)rows * filter->picture->width);
    context_span_end(frame->device);
    return gpu_check(frame->device->gpu, "denoising", error);
}

/* The pass that follows. */
static uint32_t next_pass(const struct denoise_filter *filter)
{
    const uint32_t next = filter->pass + 1;
    return next == PASS_REPROJECT && !filter->history->is_written ? next + 1 : next;
}

static bool step(struct denoise_filter *filter, const struct render_frame *frame, bool *done, struct error *error)
{
    *done = false;
    if (filter->pass == 0 && filter->row == 0 && !begin_strip(filter, frame, error))
        return false;
    uint32_t begin, end;
    rows_of_pass(filter, &begin, &end);
    filter->row = filter->row > begin ? filter->row : begin;
    const uint32_t rows = rows_of_step(filter, frame, end - filter->row);
    if (!dispatch(filter, frame, rows, error))
        return false;
    filter->row += rows;
    if (filter->row < end)
        return true;
    filter->row = 0;
    filter->pass = next_pass(filter);
    if (filter->pass < PASS_COUNT)
        return true;
    filter->pass = 0;
    *done = filter->own_end == filter->picture->height;
    if (*done)
        denoise_history_end(filter->history);
    return true;
}

uint64_t denoise_filter_device_bytes(const struct denoise_filter *filter)
{
    return filter->notes.capacity_bytes + filter->guides.capacity_bytes + filter->slopes.capacity_bytes +
           filter->first.capacity_bytes + filter->wider.capacity_bytes + filter->levels[0].capacity_bytes +
           filter->levels[1].capacity_bytes + filter->risks.capacity_bytes + filter->motions.capacity_bytes;
}

static void finish(void *self, struct gpu_device *device)
{
    struct denoise_filter *filter = self;
    struct gpu_buffer *const all[] = {&filter->notes,     &filter->guides,    &filter->slopes,
                                      &filter->motions,   &filter->first,     &filter->wider,
                                      &filter->levels[0], &filter->levels[1], &filter->risks};
    for (size_t i = 0; i < sizeof(all) / sizeof(*all); i++)
        gpu_buffer_finish(device, all[i]);
}

/* ---- as passes ---- */

static struct gpu_buffer *moved_of(const struct denoise_filter *filter)
{
    return denoise_history_moved(filter->history);
}

static bool wants_guides(const void *self, const struct render_wave *wave)
{
    (void)self;
    return denoise_notes_samples(wave->frame);
}

static enum pass_progress note_guides(void *self, struct render_wave *wave, struct error *error)
{
    struct denoise_filter *filter = self;
    const bool noted = wave->number == 0
                           ? denoise_note(filter->sums, &filter->notes, moved_of(filter), wave, error)
                           : denoise_follow(filter->sums, &filter->notes, moved_of(filter), wave, error);
    return noted ? PASS_DONE : PASS_FAILED;
}

const struct pass guides_pass = {.name = "guides", .wants = wants_guides, .run = note_guides};

static bool wants_filter(const void *self, const struct render_wave *wave)
{
    const struct denoise_filter *filter = self;
    const struct render_frame *frame = wave->frame;
    return denoise_is_wanted(frame) && denoise_strength(&frame->request, filter->picture->samples) > 0.0f;
}

static enum pass_progress run_filter(void *self, struct render_wave *wave, struct error *error)
{
    struct denoise_filter *filter = self;
    bool done = false;
    context_set_number(wave, 0);
    if (!step(filter, wave->frame, &done, error))
        return PASS_FAILED;
    filter->picture->denoised = denoise_sums_band(filter->sums, DENOISE_SUM_RESULT, 0);
    return done ? PASS_DONE : PASS_MORE;
}

const struct pass denoise_pass = {.name = "denoise", .wants = wants_filter, .run = run_filter, .finish = finish};
