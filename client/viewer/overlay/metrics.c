/* SPDX-License-Identifier: MIT */
/* Statistics of frames and views. */
#include "metrics.h"

#include <stdlib.h>

#define SECOND_NS 1000000000ull
#define ROUNDS_MAX 7u /* number of recent frames that predict the next one */

const char *const lane_names[LANE_COUNT] = {"input",   "scene",  "primary", "trace",  "shade",
                                            "resolve", "encode", "receive", "decode", "show"};

/* LANE_COUNT: not drawn. */
static enum lane lane_of(enum protocol_stage stage)
{
    switch (stage) {
    case PROTOCOL_STAGE_APPLY:
    case PROTOCOL_STAGE_BUILD:
    case PROTOCOL_STAGE_UPLOAD:
        return LANE_SCENE;
    case PROTOCOL_STAGE_PRIMARY:
        return LANE_PRIMARY;
    case PROTOCOL_STAGE_TRACE:
        return LANE_TRACE;
    case PROTOCOL_STAGE_SHADE:
        return LANE_SHADE;
    case PROTOCOL_STAGE_RESOLVE:
    case PROTOCOL_STAGE_READBACK:
        return LANE_RESOLVE;
    case PROTOCOL_STAGE_ENCODE:
        return LANE_ENCODE;
    default:
        return LANE_COUNT;
    }
}

/* Adds stages; the daemon's times start at the frame's beginning, which was before its readback. */
static void add_stages(struct metrics_frame *made, const struct fl_frame *frame)
{
    uint64_t whole_ns = 0;
    for (size_t i = 0; i < frame->stage_count; i++)
        if (frame->stages[i].stage == PROTOCOL_STAGE_FRAME)
            whole_ns = frame->stages[i].duration_ns;
    const int64_t taken_up_ns = (int64_t)(frame->rendered_ns - whole_ns);
    /* Most work is measured by both clocks. */
    int64_t begins_ns[LANE_COUNT], sums_ns[LANE_COUNT][PROTOCOL_CLOCK_COUNT] = {{0}};
    for (size_t i = 0; i < frame->stage_count; i++) {
        const struct record_stage_time *stage = &frame->stages[i];
        const enum lane lane = lane_of(stage->stage);
        const int64_t begin_ns = taken_up_ns + (int64_t)stage->start_ns;
        if (lane == LANE_COUNT || stage->clock >= PROTOCOL_CLOCK_COUNT)
            continue;
        const bool is_first = sums_ns[lane][PROTOCOL_CLOCK_CPU] + sums_ns[lane][PROTOCOL_CLOCK_GPU] == 0;
        begins_ns[lane] = is_first || begin_ns < begins_ns[lane] ? begin_ns : begins_ns[lane];
        sums_ns[lane][stage->clock] += (int64_t)stage->duration_ns;
    }
    for (int lane = 0; lane < LANE_COUNT; lane++) {
        const int64_t cpu_ns = sums_ns[lane][PROTOCOL_CLOCK_CPU], gpu_ns = sums_ns[lane][PROTOCOL_CLOCK_GPU];
        if (cpu_ns > 0 || gpu_ns > 0)
            made->spans[lane] =
                (struct span){begins_ns[lane], begins_ns[lane] + (cpu_ns > gpu_ns ? cpu_ns : gpu_ns)};
    }
}

void metrics_add(struct metrics *metrics, const struct fl_frame *frame, uint64_t decoded_ns)
{
    struct metrics_frame *made = &metrics->frames[metrics->next];
    *made = (struct metrics_frame){.frame = frame->frame,
                                   .command = frame->command,
                                   .command_sent_ns = frame->command_sent_ns,
                                   .command_received_ns = frame->command_received_ns,
                                   .command_applied_ns = frame->command_applied_ns,
                                   .rendered_ns = frame->rendered_ns,
                                   .begun_ns = frame->begun_ns,
                                   .whole_ns = decoded_ns,
                                   .shown_ns = decoded_ns,
                                   .wire_bytes = frame->wire_bytes,
                                   .first_of_command =
                                       frame->command > metrics->last_command && frame->command_sent_ns > 0};
    add_stages(made, frame);
    if (made->first_of_command)
        metrics->last_command = frame->command;
    metrics->next = (metrics->next + 1) % METRICS_FRAMES;
    metrics->count += metrics->count < METRICS_FRAMES;
    const uint64_t received_ns = frame->begun_ns + frame->receive_ns;
    made->spans[LANE_RECEIVE] = (struct span){(int64_t)frame->begun_ns, (int64_t)received_ns};
    made->spans[LANE_DECODE] = (struct span){(int64_t)received_ns, (int64_t)decoded_ns};
    metrics->unshown += metrics->unshown < METRICS_FRAMES;
}

void metrics_add_view(struct metrics *metrics, uint64_t moved_ns, uint64_t made_ns)
{
    metrics->views[metrics->next_view] = (struct metrics_view){.moved_ns = moved_ns, .shown_ns = made_ns};
    metrics->next_view = (metrics->next_view + 1) % METRICS_VIEWS;
    metrics->view_count += metrics->view_count < METRICS_VIEWS;
    metrics->unshown_views += metrics->unshown_views < METRICS_VIEWS;
}

void metrics_show(struct metrics *metrics, uint64_t shown_ns)
{
    for (; metrics->unshown > 0; metrics->unshown--) {
        struct metrics_frame *frame =
            &metrics->frames[(metrics->next + METRICS_FRAMES - metrics->unshown) % METRICS_FRAMES];
        frame->spans[LANE_SHOW] = (struct span){(int64_t)frame->shown_ns, (int64_t)shown_ns};
        frame->shown_ns = shown_ns;
    }
    for (; metrics->unshown_views > 0; metrics->unshown_views--)
        metrics->views[(metrics->next_view + METRICS_VIEWS - metrics->unshown_views) % METRICS_VIEWS].shown_ns =
            shown_ns;
}

void metrics_add_bytes(struct metrics *metrics, uint64_t bytes)
{
    if (metrics->count > 0)
        metrics->frames[(metrics->next + METRICS_FRAMES - 1) % METRICS_FRAMES].wire_bytes += bytes;
}

const struct metrics_frame *metrics_frame(const struct metrics *metrics, size_t back)
{
    if (back >= metrics->count)
        return NULL;
    return &metrics->frames[(metrics->next + METRICS_FRAMES - 1 - back) % METRICS_FRAMES];
}

bool metrics_span(const struct metrics_frame *frame, enum lane lane, int64_t offset_ns, struct span *span)
{
    *span = frame->spans[lane];
    if (lane == LANE_INPUT && frame->first_of_command)
        *span = (struct span){(int64_t)frame->command_sent_ns, (int64_t)frame->command_applied_ns + offset_ns};
    else if (lane < LANE_RECEIVE && span->end_ns != 0)
        *span = (struct span){span->begin_ns + offset_ns, span->end_ns + offset_ns};
    return span->end_ns != 0;
}

int64_t metrics_clock_offset_ns(const struct metrics *metrics)
{
    int64_t minimum = INT64_MIN, maximum = INT64_MAX;
    for (size_t i = 0; i < metrics->count; i++) {
        const struct metrics_frame *frame = &metrics->frames[i];
        const int64_t from_input = (int64_t)(frame->command_sent_ns - frame->command_received_ns);
        const int64_t from_frame = (int64_t)(frame->begun_ns - frame->rendered_ns);
        if (frame->command_sent_ns > 0 && from_input > minimum)
            minimum = from_input;
        if (frame->rendered_ns > 0 && from_frame < maximum)
            maximum = from_frame;
    }
    if (minimum == INT64_MIN)
        return maximum == INT64_MAX ? 0 : maximum;
    return maximum == INT64_MAX ? minimum : minimum + (maximum - minimum) / 2;
}

static int by_value(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void summarise_rounds(const struct metrics *metrics, struct metrics_summary *summary)
{
    double rounds[ROUNDS_MAX];
    size_t count = 0;
    for (size_t back = 0; back < metrics->count && count < ROUNDS_MAX; back++) {
        const struct metrics_frame *frame = metrics_frame(metrics, back);
        if (frame->first_of_command)
            rounds[count++] = (double)(frame->whole_ns - frame->command_sent_ns) * 1e-9;
    }
    qsort(rounds, count, sizeof(rounds[0]), by_value);
    summary->round_frames = count;
    summary->round_s = count > 0 ? rounds[count / 2] : 0;
}

static void summarise_views(const struct metrics *metrics, uint64_t now_ns, struct metrics_summary *summary)
{
    double latencies[METRICS_VIEWS];
    size_t count = 0;
    for (size_t i = 0; i < metrics->view_count; i++) {
        const struct metrics_view *view = &metrics->views[i];
        const bool is_recent = view->shown_ns + SECOND_NS > now_ns;
        summary->views_per_second += is_recent;
        if (is_recent && view->moved_ns > 0)
            latencies[count++] = (double)(view->shown_ns - view->moved_ns) * 1e-9;
    }
    if (count == 0)
        return;
    qsort(latencies, count, sizeof(latencies[0]), by_value);
    summary->view_latency_s = latencies[count / 2];
    summary->view_latency_99_s = latencies[(count * 99 + 99) / 100 - 1];
}

void metrics_summarise(const struct metrics *metrics, uint64_t now_ns, struct metrics_summary *summary)
{
    double latencies[METRICS_FRAMES];
    size_t latency_count = 0;
    *summary = (struct metrics_summary){0};
    for (size_t back = 0; back < metrics->count; back++) {
        const struct metrics_frame *frame = metrics_frame(metrics, back);
        const bool is_recent = frame->shown_ns + SECOND_NS > now_ns;
        if (is_recent) {
            summary->frames_per_second += 1;
            summary->bits_per_second += (double)frame->wire_bytes * 8;
        }
        if (frame->first_of_command && (is_recent || latency_count == 0))
            latencies[latency_count++] = (double)(frame->shown_ns - frame->command_sent_ns) * 1e-9;
    }
    summarise_rounds(metrics, summary);
    summarise_views(metrics, now_ns, summary);
    if (latency_count == 0)
        return;
    qsort(latencies, latency_count, sizeof(latencies[0]), by_value);
    summary->has_latency = true;
    summary->latency_s = latencies[latency_count / 2];
}
