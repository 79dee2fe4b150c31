/* SPDX-License-Identifier: MIT */
#include "engine/encode_pool.h"

#include "base/clock.h"
#include "base/log.h"
#include "base/parallel.h"
#include "encode/sparse.h"
#include "encode/stream.h"
#include "engine/attachments.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <xxhash.h>

#define THREADS_MAX 64
/* A thread must be left to other users where one user's frames take long. */
#define THREADS_MIN 2
#define THREADS_AUTO_MAX 4
/* Bytes that are hashed between two checks whether the frame is still wanted. */
#define DIGEST_STEP_BYTES ((size_t)16 << 20)

struct encode_task {
    struct job_output *output;
    struct encode_lane *lane; /* NULL: the frame is no part of a stream */
    uint64_t position;
    struct engine_frame *frame;
    struct encode_task *next; /* next waiting task of the lane or of the pool */
    struct encode_pool *pool;
};

struct encode_pool {
    struct encode_pool_options options;
    atomic_bool closed;
    pthread_mutex_t lock; /* guards the members below, except the threads */
    pthread_cond_t changed;
    struct encode_task *first, **end; /* waiting tasks, in order */
    struct encode_task *running[THREADS_MAX];
    unsigned numbered; /* threads that know their place in `running` */
    unsigned thread_count;
    pthread_t threads[THREADS_MAX];
};

/* ---- lanes -------------------------------------------------------------------------------------- */

struct encode_lane {
    atomic_uint references;
    float frames_per_second;
    struct encoder_stream *stream; /* encoder, used by the current task alone; NULL before the first */
    pthread_mutex_t lock;          /* guards the members below */
    bool busy;                     /* whether one of its tasks is queued or running */
    struct encode_task *first, **end;
};

struct encode_lane *encode_lane_create(float frames_per_second)
{
    struct encode_lane *lane = calloc(1, sizeof(*lane));
    if (!lane)
        return NULL;
    atomic_init(&lane->references, 1);
    lane->frames_per_second = frames_per_second;
    lane->end = &lane->first;
    pthread_mutex_init(&lane->lock, NULL);
    return lane;
}

void encode_lane_unref(struct encode_lane *lane)
{
    if (!lane || atomic_fetch_sub(&lane->references, 1) != 1)
        return;
    encoder_stream_destroy(lane->stream);
    pthread_mutex_destroy(&lane->lock);
    free(lane);
}

/* False: the task waits for those before it; lane_next() will return it. */
static bool lane_enter(struct encode_lane *lane, struct encode_task *task)
{
    pthread_mutex_lock(&lane->lock);
    bool free_now = !lane->busy;
    lane->busy = true;
    if (!free_now) {
        *lane->end = task;
        lane->end = &task->next;
    }
    pthread_mutex_unlock(&lane->lock);
    return free_now;
}

/* Ends the lane's current task and returns the next one; NULL: none waits. */
static struct encode_task *lane_next(struct encode_lane *lane)
{
    pthread_mutex_lock(&lane->lock);
    struct encode_task *task = lane->first;
    if (task)
        lane->first = task->next;
    if (!lane->first)
        lane->end = &lane->first;
    lane->busy = task != NULL;
    pthread_mutex_unlock(&lane->lock);
    return task;
}

/* ---- tasks -------------------------------------------------------------------------------------- */

/* Frees a task and returns the one that waited for it, which the caller owns; NULL: none. */
static struct encode_task *task_end(struct encode_task *task)
{
    struct encode_task *next = task->lane ? lane_next(task->lane) : NULL;
    engine_frame_destroy(task->frame);
    job_output_unref(task->output);
    encode_lane_unref(task->lane);
    free(task);
    return next;
}

static void task_destroy(struct encode_task *task)
{
    while (task)
        task = task_end(task);
}

static bool is_given_up(const void *context)
{
    const struct encode_task *task = context;
    return job_output_is_closed(task->output) || atomic_load_explicit(&task->pool->closed, memory_order_relaxed);
}

static bool encode_in_stream(struct encode_lane *lane, const struct picture *picture, struct engine_frame *frame,
                             struct error *error)
{
    struct encoded_picture encoded;
    const struct encoder_request request = {
        .quality = frame->quality, .bytes = frame->wanted_bytes, .key_frame = frame->wants_key};
    if (!lane->stream)
        lane->stream = encoder_stream_create(frame->encoding, lane->frames_per_second, error);
    if (!lane->stream || !encoder_stream_encode(lane->stream, picture, &request, &encoded, error))
        return false;
    frame->bytes = encoded.bytes;
    frame->size_bytes = encoded.size_bytes;
    frame->key_frame = encoded.key_frame;
    return true;
}

static bool encode_pixels(struct encode_lane *lane, const struct picture *picture, struct engine_frame *frame,
                          struct error *error)
{
    if (lane)
        return encode_in_stream(lane, picture, frame, error);
    frame->key_frame = true;
    return encoder_encode(frame->encoding, picture, frame->quality, &frame->bytes, &frame->size_bytes, error);
}

static bool make_digest(const struct encode_task *task, struct error *error)
{
    const struct frame_result *result = &task->frame->result;
    XXH3_state_t *state = XXH3_createState();
    if (!state)
        return error_set(error, ERROR_OUT_OF_MEMORY, "encoding", "out of memory for a frame's digest");
    XXH3_64bits_reset(state);
    size_t done = 0;
    while (done < result->size_bytes && !is_given_up(task)) {
        size_t left = result->size_bytes - done, step = left < DIGEST_STEP_BYTES ? left : DIGEST_STEP_BYTES;
        XXH3_64bits_update(state, result->pixels + done, step);
        done += step;
    }
    task->frame->digest = XXH3_64bits_digest(state);
    XXH3_freeState(state);
    return done == result->size_bytes || encoder_given_up(error);
}

/* Fills pixels of a hidden layer that no eye can see: they are empty, and cost least in colours of their
 * neighbours. */
static void fill_hidden(const struct engine_frame *frame)
{
    const struct frame_result *result = &frame->result;
    if (frame->request.hidden_layer > 0 && result->format == PIXEL_FORMAT_RGBA8 &&
        result->attachments & 1u << ATTACHMENT_DEPTH)
        sparse_fill(result->pixels, attachments_depths(result), result->width, result->height);
}

static bool encode(const struct encode_task *task, struct error *error)
{
    struct engine_frame *frame = task->frame;
    struct stage_totals *totals = task->pool->options.totals;
    struct frame_result *result = &frame->result;
    /* Layers lie one behind the other: one picture of their common height. */
    uint32_t rows = result->height * (uint32_t)__builtin_popcount(result->layers);
    struct picture picture = {
        .width = result->width,
        .height = rows,
        .bytes_per_pixel = (uint32_t)(result->size_bytes / ((size_t)result->width * rows)),
        .pixels = result->pixels,
    };
    if (result->ycbcr != YCBCR_NONE)
        picture = (struct picture){.width = result->width,
                                   .height = result->height,
                                   .bytes_per_pixel = 4,
                                   .ycbcr = result->ycbcr,
                                   .planes = ycbcr_planes_at(result->pixels, result->width)};
    picture.is_given_up = is_given_up;
    picture.given_up_context = task;
    picture.in_scans = frame->in_parts;
    uint64_t start_ns = clock_now_ns();
    fill_hidden(frame);
    if (!make_digest(task, error) || !encode_pixels(task->lane, &picture, frame, error) ||
        !attachments_append(frame, &picture, error))
        return false;
    if (!encoder_loses(frame->encoding))
        frame->quality = 0; /* a compression level, not a loss */
    free(result->pixels);
    result->pixels = NULL;
    frame->encoded_ns = clock_now_ns();
    stage_times_add(&result->times, STAGE_ENCODE, CLOCK_CPU, 0, start_ns, frame->encoded_ns - start_ns);
    stage_totals_add(totals, STAGE_ENCODE, CLOCK_CPU, frame->encoded_ns - start_ns);
    return true;
}

static void run_task(struct encode_task *task)
{
    struct error error = {0};
    bool encoded = !is_given_up(task) && encode(task, &error);
    if (is_given_up(task))
        return;
    struct engine_event *event = event_create(encoded ? ENGINE_FRAME : ENGINE_FAILED, 0, 0);
    if (!event) {
        log_write(LOG_ERROR, "encode", "no memory for an event; a job ends without an answer");
        job_output_close(task->output, NULL);
        return;
    }
    event->error = error;
    if (encoded) {
        event->frame = task->frame;
        event->output = job_output_ref(task->output);
        task->frame = NULL;
    }
    job_output_put(task->output, task->position, event);
}

static unsigned running_of(const struct encode_pool *pool, uint64_t client)
{
    unsigned count = 0;
    for (unsigned i = 0; i < pool->thread_count; i++)
        count += pool->running[i] && job_output_client(pool->running[i]->output) == client;
    return count;
}

/* First task of the client that occupies the fewest threads; NULL: none waits, or one thread must be left to
 * others. */
static struct encode_task *next_locked(struct encode_pool *pool)
{
    struct encode_task **best = NULL;
    unsigned fewest = pool->thread_count > 1 ? pool->thread_count - 1 : 1;
    for (struct encode_task **place = &pool->first; *place && fewest; place = &(*place)->next) {
        unsigned count = running_of(pool, job_output_client((*place)->output));
        if (count >= fewest)
            continue;
        fewest = count;
        best = place;
    }
    if (!best)
        return NULL;
    struct encode_task *task = *best;
    *best = task->next;
    if (!*best)
        pool->end = best;
    task->next = NULL;
    return task;
}

static void set_running(struct encode_pool *pool, unsigned self, struct encode_task *task)
{
    pthread_mutex_lock(&pool->lock);
    pool->running[self] = task;
    pthread_mutex_unlock(&pool->lock);
}

static void *run_thread(void *context)
{
    struct encode_pool *pool = context;
    pthread_setname_np(pthread_self(), "encode");
    pthread_mutex_lock(&pool->lock);
    const unsigned self = pool->numbered++;
    while (!atomic_load(&pool->closed)) {
        struct encode_task *task = next_locked(pool);
        if (!task) {
            pthread_cond_wait(&pool->changed, &pool->lock);
            continue;
        }
        pool->running[self] = task;
        pthread_mutex_unlock(&pool->lock);
        while (task) {
            run_task(task);
            set_running(pool, self, NULL);
            task = task_end(task); /* next task of the same lane */
            set_running(pool, self, task);
            pool->options.on_done(pool->options.context);
        }
        pthread_mutex_lock(&pool->lock);
        pthread_cond_signal(&pool->changed); /* a task of that client may have been left waiting */
    }
    pthread_mutex_unlock(&pool->lock);
    return NULL;
}

struct encode_pool *encode_pool_create(const struct encode_pool_options *options, struct error *error)
{
    struct encode_pool *pool = calloc(1, sizeof(*pool));
    if (!pool) {
        error_set(error, ERROR_OUT_OF_MEMORY, "encode_threads", "no memory for the encoding pool");
        return NULL;
    }
    pool->options = *options;
    pool->end = &pool->first;
    pthread_mutex_init(&pool->lock, NULL);
    pthread_cond_init(&pool->changed, NULL);
    unsigned threads = options->threads, processors = parallel_processors();
    if (!threads)
        threads = processors > THREADS_AUTO_MAX ? THREADS_AUTO_MAX
                  : processors < THREADS_MIN    ? THREADS_MIN
                                                : processors;
    threads = threads > THREADS_MAX ? THREADS_MAX : threads;
    pthread_mutex_lock(&pool->lock); /* the threads wait until all have started */
    while (pool->thread_count < threads &&
           pthread_create(&pool->threads[pool->thread_count], NULL, run_thread, pool) == 0)
        pool->thread_count++;
    pthread_mutex_unlock(&pool->lock);
    if (pool->thread_count == threads)
        return pool;
    error_set(error, ERROR_OUT_OF_MEMORY, "encode_threads", "could start only %u of %u threads",
              pool->thread_count, threads);
    encode_pool_destroy(pool);
    return NULL;
}

void encode_pool_destroy(struct encode_pool *pool)
{
    if (!pool)
        return;
    pthread_mutex_lock(&pool->lock);
    atomic_store(&pool->closed, true);
    pthread_cond_broadcast(&pool->changed);
    pthread_mutex_unlock(&pool->lock);
    for (unsigned i = 0; i < pool->thread_count; i++)
        pthread_join(pool->threads[i], NULL);
    for (struct encode_task *task; (task = pool->first);) {
        pool->first = task->next;
        task->next = NULL;
        task_destroy(task);
    }
    pthread_cond_destroy(&pool->changed);
    pthread_mutex_destroy(&pool->lock);
    free(pool);
}

bool encode_pool_submit(struct encode_pool *pool, struct job_output *output, struct encode_lane *lane,
                        uint64_t position, struct engine_frame *frame)
{
    struct encode_task *task = calloc(1, sizeof(*task));
    if (!task) {
        engine_frame_destroy(frame);
        return false;
    }
    *task =
        (struct encode_task){.output = job_output_ref(output), .position = position, .frame = frame, .pool = pool};
    if (lane && frame->encoding == ENCODING_H264) {
        atomic_fetch_add(&lane->references, 1);
        task->lane = lane;
        if (!lane_enter(lane, task))
            return true;
    }
    pthread_mutex_lock(&pool->lock);
    *pool->end = task;
    pool->end = &task->next;
    pthread_cond_signal(&pool->changed);
    pthread_mutex_unlock(&pool->lock);
    return true;
}
