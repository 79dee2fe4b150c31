// SPDX-License-Identifier: MIT
#include "trace/bvh_build.h"

#include "base/parallel.h"

#include <pthread.h>

struct batch {
    struct bvh_job *jobs;
    uint32_t count;
    const struct bvh_settings *settings;
};

static bool is_large(const struct bvh_job *job)
{
    return job->shape.primitive_count >= BVH_THREADED_PRIMITIVES;
}

static void run_small(void *context, uint32_t i)
{
    struct batch *batch = context;
    struct bvh_job *job = &batch->jobs[i];
    if (!is_large(job))
        bvh_tree_build(&job->tree, &job->shape, batch->settings, &job->error);
}

/* Large shapes one after the other with all threads on each, then the small ones with a thread for each. */
static void *run_batch(void *argument)
{
    struct batch *batch = argument;
    for (uint32_t i = 0; i < batch->count; i++) {
        struct bvh_job *job = &batch->jobs[i];
        if (is_large(job))
            bvh_tree_build(&job->tree, &job->shape, batch->settings, &job->error);
    }
    uint64_t primitives = 0;
    for (uint32_t i = 0; i < batch->count; i++)
        primitives += is_large(&batch->jobs[i]) ? 0 : batch->jobs[i].shape.primitive_count;
    unsigned threads = primitives >= BVH_THREADED_PRIMITIVES ? batch->settings->threads : 1;
    parallel_run(threads, batch->count, run_small, batch);
    return NULL;
}

bool bvh_jobs_run(struct bvh_job *jobs, uint32_t count, const struct bvh_settings *settings, struct error *error)
{
    struct batch batch = {jobs, count, settings};
    uint64_t primitives = 0;
    for (uint32_t i = 0; i < count; i++) {
        jobs[i].tree = (struct bvh_tree){0};
        jobs[i].error = (struct error){0};
        primitives += jobs[i].shape.primitive_count;
    }
    pthread_t thread;
    if (primitives >= BVH_THREADED_PRIMITIVES && pthread_create(&thread, NULL, run_batch, &batch) == 0)
        pthread_join(thread, NULL);
    else
        run_batch(&batch);
    for (uint32_t i = 0; i < count; i++) {
        if (jobs[i].error.kind != ERROR_NONE) {
            if (error)
                *error = jobs[i].error;
            return false;
        }
    }
    return true;
}
