/* SPDX-License-Identifier: MIT */
/* Frames that lack memory on the device: idle structures are evicted, then a frame waits until it is alone. */
#include "engine/engine_private.h"

#include "base/log.h"

static bool has_frame(const struct engine *engine)
{
    bool has = false;
    for (size_t i = 0; i < engine->job_count; i++)
        has = has || engine->jobs[i]->rendering;
    return has;
}

bool engine_free_memory(struct engine *engine, struct job *job)
{
    if (!job->evicted && engine_evict_idle(engine, job)) {
        job->evicted = true;
        log_write(LOG_INFO, "engine", "evicted idle structures from device memory for a frame");
        return true;
    }
    job->evicted = false; /* structures in use now may be idle at the next failure */
    if (!has_frame(engine))
        return false;
    engine->needs_memory = job;
    return true;
}

bool engine_memory_lets_begin(const struct engine *engine, const struct job *job)
{
    const struct job *needing = engine->needs_memory;
    if (needing == job)
        return !has_frame(engine);
    if (!needing || !job_wants_frame(needing))
        return true;
    /* Frames of batches may take minutes: while one of them delays the needing job anyway, frames of views may
     * begin. */
    bool batch = false;
    for (size_t i = 0; i < engine->job_count; i++)
        batch |= engine->jobs[i]->rendering && engine->jobs[i]->spec.kind == JOB_BATCH;
    return batch && job->spec.kind == JOB_VIEW && view_has_news(job);
}

void engine_needs_no_memory(struct engine *engine, const struct job *job)
{
    if (engine->needs_memory == job)
        engine->needs_memory = NULL;
}
