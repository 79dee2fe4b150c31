/* SPDX-License-Identifier: MIT */
/* The device's memory among owners: how much each may have, and who waits or gives way where it is short. */
#include "engine/engine_private.h"

#include "base/clock.h"
#include "base/log.h"

/* How long an owner who is alone keeps to its share: who comes back often is not to find everything taken. */
#define SHARED_NS UINT64_C(60000000000)

static struct engine_owner *owner_of(const struct job *job)
{
    return job->reference->client->owner;
}

/* `owner` NULL: of anyone. */
static bool has_frame(const struct engine *engine, const struct engine_owner *owner)
{
    bool has = false;
    for (size_t i = 0; i < engine->job_count; i++)
        has = has || (engine->jobs[i]->rendering && (!owner || owner_of(engine->jobs[i]) == owner));
    return has;
}

/* ---- shares ---- */

static uint64_t bytes_of(const struct engine *engine, const struct engine_owner *owner)
{
    uint64_t bytes = 0;
    for (const struct engine_scene *scene = engine->scenes; scene; scene = scene->next)
        bytes += scene->owner == owner->number ? scene_own_device_bytes(engine, scene) : 0;
    for (size_t i = 0; i < engine->job_count; i++)
        bytes += owner_of(engine->jobs[i]) == owner ? job_device_bytes(engine, engine->jobs[i]) : 0;
    return bytes;
}

/* UINT64_MAX: as much as there is. */
static uint64_t share_bytes(const struct engine *engine)
{
    uint32_t percent = engine->options.limits.device_share_percent;
    bool limits = engine->device_bytes_limit && percent && percent < 100;
    return limits ? engine->device_bytes_limit / 100 * percent : UINT64_MAX;
}

static bool others_render(const struct engine *engine, const struct engine_owner *owner)
{
    bool others = false;
    for (size_t i = 0; i < engine->job_count; i++)
        others = others || owner_of(engine->jobs[i]) != owner;
    return others;
}

void engine_limit_memory(struct engine *engine, const struct job *job)
{
    const struct engine_owner *owner = owner_of(job);
    const uint64_t now_ns = clock_now_ns(), share = share_bytes(engine);
    if (!engine->device)
        return;
    if (others_render(engine, owner))
        engine->memory_shared_until_ns = now_ns + SHARED_NS;
    uint64_t *limit = &engine->device->memory_limit_bytes;
    *limit = engine->device_bytes_limit;
    if (share == UINT64_MAX || now_ns >= engine->memory_shared_until_ns)
        return;
    const uint64_t used = engine->device->memory_used_bytes, own = bytes_of(engine, owner);
    const uint64_t of_others = used > own ? used - own : 0;
    if (of_others < *limit && share < *limit - of_others)
        *limit = of_others + share;
}

/* ---- need ---- */

/* Gives up the newest frames of others, which are rendered again, until each of these has its share. False: there
 * are none to give up. */
static bool give_up_frames(struct engine *engine, const struct engine_owner *needing)
{
    const uint64_t share = share_bytes(engine);
    bool given_up = false;
    for (size_t i = engine->job_count; i-- > 0;) {
        struct job *job = engine->jobs[i];
        const struct engine_owner *owner = owner_of(job);
        if (!job->rendering || owner == needing || bytes_of(engine, owner) <= share)
            continue;
        job_abandon_frame(engine, job);
        given_up = true;
    }
    return given_up;
}

bool engine_make_room(struct engine *engine, struct job *job, struct error *error)
{
    struct engine_owner *owner = owner_of(job);
    const bool by_share = engine->device && engine->device->memory_limit_bytes < engine->device_bytes_limit;
    if (!job->evicted && engine_evict_idle(engine, job, by_share ? owner : NULL)) {
        job->evicted = true;
        log_write(LOG_INFO, "engine", "evicted idle structures from device memory for a frame");
        return true;
    }
    job->evicted = false; /* what is in use now may be idle by then */
    if (has_frame(engine, owner)) {
        owner->needs_own = job->scene->put_off = job;
        return true;
    }
    if (by_share) {
        error->retryable = true;
        error->retry_after_ms = (uint32_t)(SHARED_NS / 1000000u);
        error_remedy(error, "this user or key has limits.share of memory.device while others render; "
                            "try a smaller picture or scene, or later");
        return false;
    }
    if (give_up_frames(engine, owner)) {
        log_write(LOG_INFO, "engine", "gave up frames that had more than their share of device memory");
        return true;
    }
    if (!has_frame(engine, NULL))
        return false;
    engine->needs_all = job;
    return true;
}

/* Frames of batches may take minutes: while one of them delays the job that needs memory anyway, frames of views
 * may begin. */
static bool waits_for(const struct engine *engine, const struct job *job, const struct job *needing,
                      const struct engine_owner *owner)
{
    if (!needing || needing == job || !job_wants_frame(needing))
        return false;
    bool batch = false;
    for (size_t i = 0; i < engine->job_count; i++) {
        const struct job *other = engine->jobs[i];
        batch |= other->rendering && other->spec.kind == JOB_BATCH && (!owner || owner_of(other) == owner);
    }
    return !(batch && job->spec.kind == JOB_VIEW && view_has_news(job));
}

bool engine_memory_lets_begin(const struct engine *engine, const struct job *job)
{
    const struct engine_owner *owner = owner_of(job);
    if (engine->needs_all == job)
        return !has_frame(engine, NULL);
    if (owner->needs_own == job && has_frame(engine, owner))
        return false;
    return !waits_for(engine, job, engine->needs_all, NULL) && !waits_for(engine, job, owner->needs_own, owner);
}

void engine_needs_no_memory(struct engine *engine, const struct job *job)
{
    if (engine->needs_all == job)
        engine->needs_all = NULL;
    if (owner_of(job)->needs_own == job)
        owner_of(job)->needs_own = NULL;
}
