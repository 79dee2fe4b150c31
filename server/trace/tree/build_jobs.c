// SPDX-License-Identifier: MIT
// Builds many trees at once, in threads of their own.
#include "trace/tree/build.h"

#include "base/clock.h"
#include "base/host.h"
#include "base/parallel.h"

#include <pthread.h>
#include <stdlib.h>

struct bvh_run {
    struct bvh_job *jobs;
    uint32_t count;
    struct bvh_form settings;
    enum bvh_step step;
    atomic_bool stop;
    pthread_t thread;
    bool has_thread;
    pthread_mutex_t mutex;
    pthread_cond_t ended; /* waits by the monotonic clock */
    bool has_ended;
    uint64_t end_ns;
};

static bool is_large(const struct bvh_job *job)
{
    return job->shape.primitive_count >= BVH_THREADED_PRIMITIVES;
}

static void build(struct bvh_run *run, struct bvh_job *job)
{
    if (run->step == BVH_PLAN)
        bvh_tree_plan(&job->tree, &job->shape, &run->settings, &job->error);
    else
        bvh_tree_write(&job->tree, &job->shape, &run->settings, job->elements, job->primitives);
}

static void run_small(void *context, uint32_t i)
{
    struct bvh_run *run = context;
    if (!is_large(&run->jobs[i]))
        build(run, &run->jobs[i]);
}

/* Builds large shapes one after the other, each with all threads, then the small ones with a thread for each. */
static void run_all(struct bvh_run *run)
{
    for (uint32_t i = 0; i < run->count; i++)
        if (is_large(&run->jobs[i]))
            build(run, &run->jobs[i]);
    uint64_t primitives = 0;
    for (uint32_t i = 0; i < run->count; i++)
        primitives += is_large(&run->jobs[i]) ? 0 : run->jobs[i].shape.primitive_count;
    unsigned threads = primitives >= BVH_THREADED_PRIMITIVES ? run->settings.threads : 1;
    parallel_run(threads, run->count, run_small, run);
}

static void run_to_end(struct bvh_run *run)
{
    run_all(run);
    pthread_mutex_lock(&run->mutex);
    run->end_ns = clock_now_ns();
    run->has_ended = true;
    pthread_cond_signal(&run->ended);
    pthread_mutex_unlock(&run->mutex);
}

static void *run_thread(void *argument)
{
    host_thread_lower_priority();
    run_to_end(argument);
    return NULL;
}

struct bvh_run *bvh_jobs_start(struct bvh_job *jobs, uint32_t count, const struct bvh_form *settings,
                               enum bvh_step step)
{
    uint64_t primitives = 0;
    struct bvh_run *run = calloc(1, sizeof(*run));
    if (!run)
        return NULL;
    run->jobs = jobs;
    run->count = count;
    run->settings = *settings;
    run->step = step;
    run->settings.stop = &run->stop;
    for (uint32_t i = 0; i < count; i++) {
        if (step == BVH_PLAN) {
            jobs[i].tree = (struct bvh_tree){0};
            jobs[i].error = (struct error){0};
        }
        primitives += jobs[i].shape.primitive_count;
    }
    pthread_cond_init(&run->ended, NULL);
    pthread_mutex_init(&run->mutex, NULL);
    run->has_thread =
        primitives >= BVH_THREADED_PRIMITIVES && pthread_create(&run->thread, NULL, run_thread, run) == 0;
    if (!run->has_thread)
        run_to_end(run);
    return run;
}

bool bvh_jobs_wait(struct bvh_run *run, uint64_t until_ns)
{
    return clock_wait_for(&run->has_ended, &run->ended, &run->mutex, until_ns);
}

static void destroy(struct bvh_run *run)
{
    if (run->has_thread)
        pthread_join(run->thread, NULL);
    pthread_cond_destroy(&run->ended);
    pthread_mutex_destroy(&run->mutex);
    free(run);
}

bool bvh_jobs_finish(struct bvh_run *run, uint64_t *end_ns, struct error *error)
{
    const struct bvh_job *jobs = run->jobs;
    const uint32_t count = run->count;
    bvh_jobs_wait(run, UINT64_MAX);
    *end_ns = run->end_ns;
    destroy(run);
    for (uint32_t i = 0; i < count; i++) {
        if (jobs[i].error.kind != ERROR_NONE) {
            if (error)
                *error = jobs[i].error;
            return false;
        }
    }
    return true;
}

void bvh_jobs_stop(struct bvh_run *run)
{
    if (!run)
        return;
    atomic_store(&run->stop, true);
    destroy(run);
}
