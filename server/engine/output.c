/* SPDX-License-Identifier: MIT */
#include "engine/output.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>

struct job_output {
    struct job_output_options options;
    atomic_uint references;
    atomic_uint in_hand;    /* reserved, not fetched */
    atomic_uint unfinished; /* reserved, not put */
    atomic_uint_fast64_t encode_ns;
    atomic_bool closed; /* written under the lock */
    /* Held while events are pushed, which keeps them in order. A push may wait for the network thread, which never
     * takes this lock. */
    pthread_mutex_t lock;
    uint64_t reserved, next;     /* positions given out, and handed out */
    atomic_uint_fast64_t credit; /* written under the lock */
    struct engine_event *final;
    struct engine_event *waiting[]; /* by position modulo the window */
};

struct job_output *job_output_create(const struct job_output_options *options)
{
    struct job_output *output = calloc(1, sizeof(*output) + options->window * sizeof(output->waiting[0]));
    if (!output)
        return NULL;
    output->options = *options;
    atomic_init(&output->credit, options->credit);
    atomic_init(&output->references, 1);
    pthread_mutex_init(&output->lock, NULL);
    return output;
}

struct job_output *job_output_ref(struct job_output *output)
{
    atomic_fetch_add_explicit(&output->references, 1, memory_order_relaxed);
    return output;
}

static void drop_waiting(struct job_output *output)
{
    for (uint32_t i = 0; i < output->options.window; i++) {
        engine_event_destroy(output->waiting[i]);
        output->waiting[i] = NULL;
    }
    engine_event_destroy(output->final);
    output->final = NULL;
}

void job_output_unref(struct job_output *output)
{
    if (!output || atomic_fetch_sub(&output->references, 1) != 1)
        return;
    drop_waiting(output);
    pthread_mutex_destroy(&output->lock);
    free(output);
}

bool job_output_has_room(const struct job_output *output)
{
    return atomic_load(&output->in_hand) < output->options.window;
}

bool job_output_has_credit(const struct job_output *output)
{
    return atomic_load(&output->credit) > 0;
}

uint64_t job_output_reserve(struct job_output *output)
{
    atomic_fetch_add(&output->in_hand, 1);
    atomic_fetch_add(&output->unfinished, 1);
    pthread_mutex_lock(&output->lock);
    uint64_t position = output->reserved++;
    pthread_mutex_unlock(&output->lock);
    return position;
}

static void push(struct job_output *output, struct engine_event *event)
{
    if (!queue_push(output->options.events, event))
        engine_event_destroy(event); /* the engine is shutting down */
}

/* Pushes `final` and drops the rest. */
static void close_locked(struct job_output *output, struct engine_event *final)
{
    atomic_store(&output->closed, true);
    if (final)
        push(output, final);
    drop_waiting(output);
}

/* Pushes every event that may go out now. */
static void advance_locked(struct job_output *output)
{
    while (!atomic_load(&output->closed)) {
        struct engine_event **place = &output->waiting[output->next % output->options.window];
        bool failed = *place && (*place)->kind == ENGINE_FAILED;
        if (!*place || (!failed && output->next >= output->credit))
            break;
        struct engine_event *event = *place;
        *place = NULL;
        output->next++;
        if (failed)
            close_locked(output, event);
        else
            push(output, event);
    }
    if (atomic_load(&output->closed) || !output->final)
        return;
    bool all_out = output->next == output->reserved;
    bool no_credit = output->next >= output->credit;
    if (all_out || (output->final->kind == ENGINE_FAILED && no_credit)) {
        struct engine_event *final = output->final;
        output->final = NULL;
        close_locked(output, final);
    }
}

void job_output_put(struct job_output *output, uint64_t position, struct engine_event *event)
{
    event->client = output->options.client;
    event->request = output->options.request;
    if (event->frame)
        atomic_store(&output->encode_ns, stage_times_sum_ns(&event->frame->result.times, STAGE_ENCODE, CLOCK_CPU));
    atomic_fetch_sub(&output->unfinished, 1);
    pthread_mutex_lock(&output->lock);
    if (atomic_load(&output->closed)) {
        engine_event_destroy(event);
    } else {
        output->waiting[position % output->options.window] = event;
        advance_locked(output);
    }
    pthread_mutex_unlock(&output->lock);
}

uint32_t job_output_unfinished(const struct job_output *output)
{
    return atomic_load(&output->unfinished);
}

uint64_t job_output_encode_ns(const struct job_output *output)
{
    return atomic_load(&output->encode_ns);
}

void job_output_credit(struct job_output *output, uint64_t credit)
{
    pthread_mutex_lock(&output->lock);
    if (credit > output->credit)
        output->credit = credit;
    advance_locked(output);
    pthread_mutex_unlock(&output->lock);
}

void job_output_finish(struct job_output *output, struct engine_event *final)
{
    pthread_mutex_lock(&output->lock);
    if (atomic_load(&output->closed) || output->final) {
        engine_event_destroy(final);
    } else {
        output->final = final;
        advance_locked(output);
    }
    pthread_mutex_unlock(&output->lock);
}

bool job_output_close(struct job_output *output, struct engine_event *final)
{
    pthread_mutex_lock(&output->lock);
    bool was_open = !atomic_load(&output->closed);
    if (was_open)
        close_locked(output, final);
    pthread_mutex_unlock(&output->lock);
    if (!was_open)
        engine_event_destroy(final);
    return was_open;
}

bool job_output_is_closed(const struct job_output *output)
{
    return atomic_load(&output->closed);
}

uint64_t job_output_client(const struct job_output *output)
{
    return output->options.client;
}

void job_output_taken(struct job_output *output)
{
    atomic_fetch_sub(&output->in_hand, 1);
}

/* ---- events ------------------------------------------------------------------------------------- */

struct engine_event *event_create(enum engine_event_kind kind, uint64_t client, uint32_t request)
{
    struct engine_event *event = calloc(1, sizeof(*event));
    if (!event)
        return NULL;
    event->kind = kind;
    event->client = client;
    event->request = request;
    return event;
}

void engine_frame_destroy(struct engine_frame *frame)
{
    if (!frame)
        return;
    free(frame->result.pixels);
    free(frame->bytes);
    free(frame);
}

void engine_stats_destroy(struct engine_stats *stats)
{
    if (stats)
        free(stats->scenes);
    free(stats);
}

void engine_event_destroy(struct engine_event *event)
{
    if (!event)
        return;
    engine_frame_destroy(event->frame);
    engine_stats_destroy(event->stats);
    free(event->list);
    free(event->description);
    free(event->objects);
    if (event->object)
        scene_edit_finish(event->object);
    free(event->object);
    job_output_unref(event->output);
    free(event);
}
