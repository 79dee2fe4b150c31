/* SPDX-License-Identifier: MIT */
/* Ranges of frames: shards, chunks and missing frames. */
#include "lib/frame_set.h"
#include "lib/text.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PARTS_MAX 1000000u

bool fl_text_shard(const char *text, uint32_t *part, uint32_t *parts, struct fl_error *error)
{
    char first[16];
    uint64_t of = 0, all = 0;
    const char *slash = strchr(text, '/');
    const size_t length = slash ? (size_t)(slash - text) : 0;
    snprintf(first, sizeof(first), "%.*s", (int)(length < sizeof(first) ? length : 0), text);
    if (length == 0 || length >= sizeof(first) || !fl_text_integer(first, 1, PARTS_MAX, &of, NULL) ||
        !fl_text_integer(slash + 1, 1, PARTS_MAX, &all, NULL)) {
        fl_error_set(error, FL_ERROR_ARGUMENT, "", "'%s' is not a part K/N with K and N from 1 to %u", text,
                     PARTS_MAX);
        return fl_error_remedy(error, "write the third of eight parts as 3/8");
    }
    if (of > all) {
        fl_error_set(error, FL_ERROR_ARGUMENT, "", "'%s': there is no part %llu of %llu", text,
                     (unsigned long long)of, (unsigned long long)all);
        return fl_error_remedy(error, "use 1/%llu to %llu/%llu", (unsigned long long)all, (unsigned long long)all,
                               (unsigned long long)all);
    }
    *part = (uint32_t)of;
    *parts = (uint32_t)all;
    return true;
}

uint32_t fl_frame_run_count(const struct fl_frame_run *run)
{
    return (run->last - run->first) / run->step + 1;
}

bool fl_frame_run_shard(const struct fl_frame_run *range, uint32_t part, uint32_t parts, struct fl_frame_run *run)
{
    const uint64_t count = fl_frame_run_count(range);
    const uint64_t begin = part - 1;
    if (begin >= count)
        return false;
    const uint64_t last = begin + (count - 1 - begin) / parts * parts;
    const uint64_t step = (uint64_t)range->step * parts;
    run->first = range->first + (uint32_t)(begin * range->step);
    run->last = range->first + (uint32_t)(last * range->step);
    /* A single frame needs no step, and the step between several lies within the range. */
    run->step = run->first == run->last ? 1 : (uint32_t)step;
    return true;
}

bool fl_frame_run_chunk(const struct fl_frame_run *range, uint32_t part, uint32_t parts, struct fl_frame_run *run)
{
    const uint64_t count = fl_frame_run_count(range);
    const uint64_t begin = count * (part - 1) / parts, end = count * part / parts;
    if (begin == end)
        return false;
    run->first = range->first + (uint32_t)(begin * range->step);
    run->last = range->first + (uint32_t)((end - 1) * range->step);
    run->step = run->first == run->last ? 1 : range->step; /* the step as in fl_frame_run_shard */
    return true;
}

static bool add_run(struct fl_frame_set *set, size_t *capacity, const struct fl_frame_run *run,
                    struct fl_error *error)
{
    if (set->run_count == *capacity) {
        const size_t more = *capacity > 0 ? *capacity * 2 : 16;
        struct fl_frame_run *runs = realloc(set->runs, more * sizeof(*runs));
        if (!runs)
            return fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
        set->runs = runs;
        *capacity = more;
    }
    set->runs[set->run_count++] = *run;
    set->frame_count += fl_frame_run_count(run);
    return true;
}

bool fl_frame_set_missing(const struct fl_frame_run *range, bool (*is_there)(void *user, uint32_t frame),
                          void *user, struct fl_frame_set *set, struct fl_error *error)
{
    struct fl_frame_run run = {0};
    size_t capacity = 0;
    *set = (struct fl_frame_set){0};
    for (uint64_t frame = range->first; frame <= range->last; frame += range->step) {
        if (!is_there || !is_there(user, (uint32_t)frame)) {
            if (run.step == 0)
                run = (struct fl_frame_run){.first = (uint32_t)frame, .step = range->step};
            run.last = (uint32_t)frame;
        } else if (run.step != 0) {
            if (!add_run(set, &capacity, &run, error))
                return false;
            run.step = 0;
        }
    }
    return run.step == 0 || add_run(set, &capacity, &run, error);
}

void fl_frame_set_finish(struct fl_frame_set *set)
{
    free(set->runs);
    *set = (struct fl_frame_set){0};
}
