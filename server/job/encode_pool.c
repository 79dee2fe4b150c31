/* SPDX-License-Identifier: MIT */
#include "job/encode_pool.h"

#include "base/clock.h"
#include "base/log.h"
#include "base/parallel.h"

#include <pthread.h>
#include <stdlib.h>
#include <xxhash.h>

#define THREADS_MAX 64
#define THREADS_AUTO_MAX 4
#define QUEUE_CAPACITY 256

struct encode_task {
    struct job_output *output;
    uint64_t position;
    struct engine_frame *frame;
};

struct encode_pool {
    struct encode_pool_options options;
    struct queue *tasks;
    unsigned thread_count;
    pthread_t threads[THREADS_MAX];
};

static void task_destroy(void *item)
{
    struct encode_task *task = item;
    engine_frame_destroy(task->frame);
    job_output_unref(task->output);
    free(task);
}

static bool encode(struct encode_pool *pool, struct engine_frame *frame, struct error *error)
{
    struct frame_result *result = &frame->result;
    /* Layers lie one behind the other: one picture of their common height. */
    uint32_t rows = result->height * (uint32_t)__builtin_popcount(result->layers);
    struct picture picture = {
        .width = result->width,
        .height = rows,
        .bytes_per_pixel = (uint32_t)(result->size_bytes / ((size_t)result->width * rows)),
        .pixels = result->pixels,
    };
    uint64_t start_ns = clock_now_ns();
    frame->digest = XXH3_64bits(result->pixels, result->size_bytes);
    if (!encoder_encode(frame->encoding, &picture, frame->quality, &frame->bytes, &frame->size_bytes, error))
        return false;
    frame->key_frame = true;
    if (frame->encoding != ENCODING_JPEG)
        frame->quality = 0; /* a level, which costs no picture */
    free(result->pixels);
    result->pixels = NULL;
    frame->encoded_ns = clock_now_ns();
    stage_times_add(&result->times, STAGE_ENCODE, STAGE_CPU, 0, start_ns, frame->encoded_ns - start_ns);
    stage_totals_add(pool->options.totals, STAGE_ENCODE, STAGE_CPU, frame->encoded_ns - start_ns);
    return true;
}

static void run_task(struct encode_pool *pool, struct encode_task *task)
{
    if (job_output_is_closed(task->output))
        return;
    struct error error = {0};
    bool encoded = encode(pool, task->frame, &error);
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

static void *run_thread(void *context)
{
    struct encode_pool *pool = context;
    for (struct encode_task *task; (task = queue_pop(pool->tasks, UINT64_MAX));) {
        run_task(pool, task);
        task_destroy(task);
        pool->options.on_done(pool->options.context);
    }
    return NULL;
}

struct encode_pool *encode_pool_create(const struct encode_pool_options *options, struct error *error)
{
    struct encode_pool *pool = calloc(1, sizeof *pool);
    struct queue *tasks = queue_create(QUEUE_CAPACITY, false);
    if (!pool || !tasks) {
        free(pool);
        queue_destroy(tasks, NULL);
        error_set(error, ERROR_OUT_OF_MEMORY, "encode_threads", "no memory for the encoding pool");
        return NULL;
    }
    pool->options = *options;
    pool->tasks = tasks;
    unsigned threads = options->threads, processors = parallel_processors();
    if (!threads)
        threads = processors > THREADS_AUTO_MAX ? THREADS_AUTO_MAX : processors;
    threads = threads > THREADS_MAX ? THREADS_MAX : threads;
    while (pool->thread_count < threads) {
        if (pthread_create(&pool->threads[pool->thread_count], NULL, run_thread, pool)) {
            error_set(error, ERROR_OUT_OF_MEMORY, "encode_threads", "could start only %u of %u threads",
                      pool->thread_count, threads);
            encode_pool_destroy(pool);
            return NULL;
        }
        pthread_setname_np(pool->threads[pool->thread_count++], "encode");
    }
    return pool;
}

void encode_pool_destroy(struct encode_pool *pool)
{
    if (!pool)
        return;
    queue_close(pool->tasks);
    for (void *task; (task = queue_try_pop(pool->tasks));)
        task_destroy(task);
    for (unsigned i = 0; i < pool->thread_count; i++)
        pthread_join(pool->threads[i], NULL);
    queue_destroy(pool->tasks, task_destroy);
    free(pool);
}

bool encode_pool_submit(struct encode_pool *pool, struct job_output *output, uint64_t position,
                        struct engine_frame *frame)
{
    struct encode_task *task = calloc(1, sizeof *task);
    if (!task) {
        engine_frame_destroy(frame);
        return false;
    }
    *task = (struct encode_task){job_output_ref(output), position, frame};
    if (queue_push(pool->tasks, task))
        return true;
    task_destroy(task);
    return false;
}
