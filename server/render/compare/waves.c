/* SPDX-License-Identifier: MIT */
/* Traces a wave by the second tracer and reads both answers back, a part at a time. */
#include "render/compare/waves.h"

#include "base/clock.h"

#include <epoxy/gl.h>
#include <stdlib.h>
#include <string.h>

/* Rays that are on the host at once. */
#define CHUNK_RAYS 16384u
/* Suspects that are asked about again at once. */
#define CHUNK_SUSPECTS (CHUNK_RAYS / WAVE_MOVES)

/* Ascending by wave and kind; made when first asked for. */
struct tally_list {
    struct wave_tally *tallies[COMPARISONS_MAX];
    uint32_t count;
};

struct comparison {
    struct gpu_device *device;
    struct gpu_scene *scene;
    struct tracer *tracers[2];
    struct wave_compare_settings settings;
    bool prepared[2][COMPARED_WAVES_MAX]; /* this frame: kind of wave, number */
    struct gpu_buffer hits, visibility;   /* the second tracer's */
    struct gpu_buffer moved_rays, moved_times, moved_hits, moved_visibility;
    struct tally_list slice, frame;
    struct chunk {
        struct ray rays[CHUNK_RAYS], moved[CHUNK_RAYS];
        float times[CHUNK_RAYS], moved_times[CHUNK_RAYS];
        struct hit first[CHUNK_RAYS], second[CHUNK_RAYS], moved_hits[CHUNK_RAYS];
        uint first_visibility[CHUNK_RAYS], second_visibility[CHUNK_RAYS], moved_visibility[CHUNK_RAYS];
        uint32_t suspects[CHUNK_RAYS];
    } * chunk;
};

/* ---- tallies ------------------------------------------------------------------------------------ */

static int order(const struct wave_tally *tally, uint32_t wave, enum ray_kind kind)
{
    if (tally->wave != wave)
        return tally->wave < wave ? -1 : 1;
    return tally->kind == kind ? 0 : tally->kind < kind ? -1 : 1;
}

static struct wave_tally *tally_of(struct tally_list *list, uint32_t wave, enum ray_kind kind, struct error *error)
{
    wave = wave < COMPARED_WAVES_MAX ? wave : COMPARED_WAVES_MAX - 1;
    uint32_t place = 0;
    while (place < list->count && order(list->tallies[place], wave, kind) < 0)
        place++;
    if (place < list->count && order(list->tallies[place], wave, kind) == 0)
        return list->tallies[place];
    struct wave_tally *tally = list->count < COMPARISONS_MAX ? calloc(1, sizeof(*tally)) : NULL;
    if (!tally) {
        error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory to compare wave %u", wave);
        return NULL;
    }
    tally->wave = wave;
    tally->kind = kind;
    memmove(&list->tallies[place + 1], &list->tallies[place], (list->count++ - place) * sizeof(list->tallies[0]));
    list->tallies[place] = tally;
    return tally;
}

static void empty_list(struct tally_list *list)
{
    for (uint32_t i = 0; i < list->count; i++)
        free(list->tallies[i]);
    list->count = 0;
}

void comparison_drop_slice(struct comparison *comparison)
{
    empty_list(&comparison->slice);
}

bool comparison_keep_slice(struct comparison *comparison, struct error *error)
{
    for (uint32_t i = 0; i < comparison->slice.count; i++) {
        const struct wave_tally *from = comparison->slice.tallies[i];
        struct wave_tally *into = tally_of(&comparison->frame, from->wave, from->kind, error);
        if (!into)
            return false;
        wave_tally_merge(into, from);
    }
    empty_list(&comparison->slice);
    return true;
}

bool comparison_take(struct comparison *comparison, struct record_wave_comparison **figures, uint32_t *count,
                     struct error *error)
{
    uint32_t n = comparison->frame.count;
    *figures = malloc((n ? n : 1) * sizeof(**figures));
    if (!*figures)
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for the figures of %u waves", n);
    for (uint32_t i = 0; i < n; i++)
        wave_tally_figures(comparison->frame.tallies[i], &(*figures)[i]);
    *count = n;
    empty_list(&comparison->frame);
    return true;
}

/* ---- life --------------------------------------------------------------------------------------- */

struct comparison *comparison_create(struct gpu_device *device, struct error *error)
{
    struct comparison *comparison = calloc(1, sizeof(*comparison));
    if (comparison)
        comparison->chunk = malloc(sizeof(*comparison->chunk));
    if (!comparison || !comparison->chunk) {
        free(comparison);
        error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory to compare tracers");
        return NULL;
    }
    comparison->device = device;
    return comparison;
}

void comparison_destroy(struct comparison *comparison)
{
    if (!comparison)
        return;
    empty_list(&comparison->slice);
    empty_list(&comparison->frame);
    gpu_buffer_finish(comparison->device, &comparison->hits);
    gpu_buffer_finish(comparison->device, &comparison->visibility);
    gpu_buffer_finish(comparison->device, &comparison->moved_rays);
    gpu_buffer_finish(comparison->device, &comparison->moved_times);
    gpu_buffer_finish(comparison->device, &comparison->moved_hits);
    gpu_buffer_finish(comparison->device, &comparison->moved_visibility);
    free(comparison->chunk);
    free(comparison);
}

uint64_t comparison_device_bytes(const struct comparison *comparison)
{
    return comparison->hits.capacity_bytes + comparison->visibility.capacity_bytes +
           comparison->moved_rays.capacity_bytes + comparison->moved_times.capacity_bytes +
           comparison->moved_hits.capacity_bytes + comparison->moved_visibility.capacity_bytes;
}

void comparison_begin(struct comparison *comparison, struct gpu_scene *scene, struct tracer *first,
                      struct tracer *second, float far_share)
{
    empty_list(&comparison->slice);
    empty_list(&comparison->frame);
    memset(comparison->prepared, 0, sizeof(comparison->prepared));
    comparison->scene = scene;
    comparison->tracers[0] = first;
    comparison->tracers[1] = second;
    comparison->settings = (struct wave_compare_settings){
        .diagonal = scene->diagonal > 0.0f ? scene->diagonal : 1.0f, /* a metre, if the scene has only discs */
        .far_share = far_share > 0.0f ? far_share : WAVE_FAR_SHARE,
    };
}

/* ---- waves -------------------------------------------------------------------------------------- */

static bool reserve_answers(struct comparison *comparison, const struct wave *wave, struct gpu_buffer *hits,
                            struct gpu_buffer *visibility, struct error *error)
{
    return wave->kind == WAVE_ANY
               ? gpu_buffer_reserve(comparison->device, visibility, wave->ray_count * sizeof(uint), error)
               : gpu_buffer_reserve(comparison->device, hits, wave->ray_count * sizeof(struct hit), error);
}

/* The second tracer gets the same rays and writes its answers to our own buffers. */
static bool make_twin(struct comparison *comparison, const struct wave *wave, struct wave *twin,
                      struct error *error)
{
    *twin = *wave;
    twin->hits = &comparison->hits;
    twin->visibility = &comparison->visibility;
    return reserve_answers(comparison, wave, twin->hits, twin->visibility, error);
}

bool comparison_prepare(struct comparison *comparison, const struct wave *wave, uint32_t wave_number,
                        struct error *error)
{
    wave_number = wave_number < COMPARED_WAVES_MAX ? wave_number : COMPARED_WAVES_MAX - 1;
    bool *prepared = &comparison->prepared[wave->kind == WAVE_ANY][wave_number];
    struct wave twin;
    if (!*prepared) {
        if (!make_twin(comparison, wave, &twin, error))
            return false;
        for (int i = 0; i < 2; i++)
            if (!tracer_trace(comparison->tracers[i], comparison->scene, &twin, error))
                return false;
        *prepared = true;
    }
    gpu_finish(comparison->device);
    return true;
}

/* Moves suspects `first` .. `first + count - 1` of the chunk in space; each stays at its own time. */
static bool upload_moved(struct comparison *comparison, const struct wave_answers *answers, uint32_t first,
                         uint32_t count, struct error *error)
{
    struct chunk *chunk = comparison->chunk;
    size_t moved_count = (size_t)count * WAVE_MOVES;
    for (uint32_t i = 0; i < count; i++) {
        uint32_t suspect = chunk->suspects[first + i];
        wave_moved_rays(&comparison->settings, answers, suspect, &chunk->moved[i * WAVE_MOVES]);
        for (uint32_t k = 0; k < WAVE_MOVES; k++)
            chunk->moved_times[i * WAVE_MOVES + k] = chunk->times[suspect];
    }
    return gpu_buffer_upload(comparison->device, &comparison->moved_rays, chunk->moved,
                             moved_count * sizeof(struct ray), error) &&
           gpu_buffer_upload(comparison->device, &comparison->moved_times, chunk->moved_times,
                             moved_count * sizeof(float), error);
}

/* Asks the second tracer about them again. */
static bool trace_moved(struct comparison *comparison, enum wave_kind kind, const struct wave_answers *answers,
                        uint32_t first, uint32_t count, struct error *error)
{
    struct chunk *chunk = comparison->chunk;
    struct gpu_device *device = comparison->device;
    if (!upload_moved(comparison, answers, first, count, error))
        return false;
    const struct wave wave = {.kind = kind,
                              .ray_count = count * WAVE_MOVES,
                              .rays = &comparison->moved_rays,
                              .times = &comparison->moved_times,
                              .hits = &comparison->moved_hits,
                              .visibility = &comparison->moved_visibility};
    if (!reserve_answers(comparison, &wave, wave.hits, wave.visibility, error) ||
        !tracer_trace(comparison->tracers[1], comparison->scene, &wave, error))
        return false;
    if (kind == WAVE_ANY)
        gpu_buffer_read(device, wave.visibility, 0, chunk->moved_visibility, wave.ray_count * sizeof(uint));
    else
        gpu_buffer_read(device, wave.hits, 0, chunk->moved_hits, wave.ray_count * sizeof(struct hit));
    return true;
}

static bool settle(struct comparison *comparison, struct wave_tally *tally, enum wave_kind kind,
                   const struct wave_answers *answers, uint32_t suspect_count, struct error *error)
{
    struct chunk *chunk = comparison->chunk;
    for (uint32_t first = 0, count; first < suspect_count; first += count) {
        count = suspect_count - first < CHUNK_SUSPECTS ? suspect_count - first : CHUNK_SUSPECTS;
        if (!trace_moved(comparison, kind, answers, first, count, error))
            return false;
        for (uint32_t i = 0; i < count; i++)
            wave_settle(tally, &comparison->settings, answers, chunk->suspects[first + i],
                        kind == WAVE_ANY ? NULL : &chunk->moved_hits[i * WAVE_MOVES],
                        kind == WAVE_ANY ? &chunk->moved_visibility[i * WAVE_MOVES] : NULL);
    }
    return true;
}

/* Rays `first` .. `first + count - 1` and both answers, to the host. */
static struct wave_answers read_answers(struct comparison *comparison, const struct wave *wave, uint32_t first,
                                        uint32_t count)
{
    struct gpu_device *device = comparison->device;
    struct chunk *chunk = comparison->chunk;
    struct wave_answers answers = {.count = count, .rays = chunk->rays};
    gpu_buffer_read(device, wave->rays, first * sizeof(struct ray), chunk->rays, count * sizeof(struct ray));
    if (wave->times)
        gpu_buffer_read(device, wave->times, first * sizeof(float), chunk->times, count * sizeof(float));
    else
        memset(chunk->times, 0, sizeof(chunk->times));
    if (wave->kind == WAVE_ANY) {
        size_t offset = first * sizeof(uint), bytes = count * sizeof(uint);
        gpu_buffer_read(device, wave->visibility, offset, chunk->first_visibility, bytes);
        gpu_buffer_read(device, &comparison->visibility, offset, chunk->second_visibility, bytes);
        answers.first_visibility = chunk->first_visibility;
        answers.second_visibility = chunk->second_visibility;
    } else {
        size_t offset = first * sizeof(struct hit), bytes = count * sizeof(struct hit);
        gpu_buffer_read(device, wave->hits, offset, chunk->first, bytes);
        gpu_buffer_read(device, &comparison->hits, offset, chunk->second, bytes);
        answers.first_hits = chunk->first;
        answers.second_hits = chunk->second;
    }
    return answers;
}

bool comparison_wave(struct comparison *comparison, const struct wave *wave, enum ray_kind kind,
                     uint32_t wave_number, uint64_t first_ns, struct error *error)
{
    struct wave twin;
    struct wave_tally *tally = tally_of(&comparison->slice, wave_number, kind, error);
    if (!tally || !make_twin(comparison, wave, &twin, error))
        return false;
    uint64_t start_ns = clock_now_ns();
    if (!tracer_trace(comparison->tracers[1], comparison->scene, &twin, error))
        return false;
    gpu_finish(comparison->device);
    tally->first_ns += first_ns;
    tally->second_ns += clock_now_ns() - start_ns;
    for (uint32_t first = 0, count; first < wave->ray_count; first += count) {
        count = wave->ray_count - first < CHUNK_RAYS ? wave->ray_count - first : CHUNK_RAYS;
        struct wave_answers answers = read_answers(comparison, wave, first, count);
        uint32_t suspects = wave_compare(tally, &comparison->settings, &answers, comparison->chunk->suspects);
        if (!settle(comparison, tally, wave->kind, &answers, suspects, error))
            return false;
    }
    return gpu_check_reset(comparison->device, "comparing a wave", error);
}
