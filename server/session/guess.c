/* SPDX-License-Identifier: MIT */
#include "session/guess.h"

/* Times of a pass in one wave. */
struct repeated {
    uint64_t sum_ns, longest_ns, count;
};

static bool has_gpu_times(const struct stage_times *times)
{
    bool has_gpu = false;
    for (uint32_t i = 0; i < times->count; i++)
        has_gpu |= times->spans[i].clock == CLOCK_GPU;
    return has_gpu;
}

static uint64_t without_longest_ns(const struct repeated *all)
{
    if (all->count < 2)
        return all->sum_ns;
    return (all->sum_ns - all->longest_ns) / (all->count - 1) * all->count;
}

uint64_t guess_render_ns(const struct stage_times *times, uint64_t wave_ns[PACING_WAVES])
{
    static const enum stage stages[] = {STAGE_TRACE, STAGE_SHADE, STAGE_PRIMARY, STAGE_RESOLVE, STAGE_READBACK};
    const enum clock clock = has_gpu_times(times) ? CLOCK_GPU : CLOCK_CPU;
    uint64_t sum_ns = 0;
    for (size_t s = 0; s < sizeof(stages) / sizeof(*stages); s++) {
        struct repeated waves[PACING_WAVES] = {0};
        for (uint32_t i = 0; i < times->count; i++) {
            const struct record_stage_time *span = &times->spans[i];
            if (span->stage != stages[s] || span->clock != clock || span->wave >= PACING_WAVES)
                continue;
            struct repeated *all = &waves[span->wave];
            all->sum_ns += span->duration_ns;
            all->longest_ns = span->duration_ns > all->longest_ns ? span->duration_ns : all->longest_ns;
            all->count++;
        }
        for (uint32_t wave = 0; wave < PACING_WAVES; wave++) {
            sum_ns += without_longest_ns(&waves[wave]);
            if (stages[s] == STAGE_TRACE || stages[s] == STAGE_SHADE)
                wave_ns[wave] += without_longest_ns(&waves[wave]);
        }
    }
    return sum_ns;
}
