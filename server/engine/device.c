/* SPDX-License-Identifier: MIT */
/* The engine's device: opened at the start, opened again after a loss, and shared by scenes that do not all fit.
 */
#include "engine/engine_private.h"

#include "base/clock.h"
#include "base/host.h"
#include "base/log.h"

/* The configured limit, or a share of the device's memory. */
static uint64_t device_limit(const struct engine *engine)
{
    const struct gpu_memory *memory = &engine->device->facts.memory;
    if (engine->options.device_bytes_limit)
        return engine->options.device_bytes_limit;
    const uint64_t bytes = gpu_memory_default_limit(memory, host_memory_bytes());
    if (memory->source == GPU_MEMORY_UNTOLD)
        log_write(
            LOG_WARNING, "engine",
            "the driver does not tell how much memory the device has; %llu MiB are used, unless memory.device "
            "of the configuration says otherwise",
            (unsigned long long)(bytes >> 20));
    return bytes;
}

bool engine_open_device(struct engine *engine, struct error *error)
{
    engine->device = engine->backend->device_create(&engine->options.gpu, error);
    if (!engine->device)
        return false;
    engine->options.gpu.measured = engine->device->measured; /* after a loss too */
    engine->device_bytes_limit = device_limit(engine);
    engine->device->memory_limit_bytes = engine->device_bytes_limit;
    return true;
}

/* ---- resources of scenes and jobs ------------------------------------------------------------------ */

bool reference_drop_idle(struct engine *engine, struct engine_reference *reference)
{
    if (!reference->idle)
        return false;
    engine->backend->renderer_destroy(reference->idle);
    reference->idle = NULL;
    return true;
}

static bool drop_all_idle(struct engine *engine, const struct engine_scene *scene)
{
    bool found = false;
    for (struct engine_reference *one = scene->references; one; one = one->next)
        found |= reference_drop_idle(engine, one);
    return found;
}

static bool drop_renderer(struct engine *engine, struct job *job)
{
    if (!job->renderer)
        return false;
    engine->backend->renderer_destroy(job->renderer);
    job->renderer = NULL;
    return true;
}

void scene_drop_shared(struct engine *engine, struct engine_scene *scene)
{
    for (size_t i = 0; i < engine->job_count; i++)
        if (engine->jobs[i]->scene == scene)
            drop_renderer(engine, engine->jobs[i]);
    drop_all_idle(engine, scene);
    engine->backend->scene_destroy(scene->shared);
    scene->shared = NULL;
}

bool job_need_renderer(struct engine *engine, struct job *job, struct error *error)
{
    struct engine_scene *scene = job->scene;
    if (!scene->shared && !(scene->shared = engine->backend->scene_create(engine->device, error)))
        return false;
    if (!job->renderer) {
        job->renderer = job->reference->idle;
        job->reference->idle = NULL;
    }
    if (!job->renderer)
        job->renderer = engine->backend->renderer_create(scene->shared, error);
    return job->renderer;
}

void job_leave_renderer(struct engine *engine, struct job *job)
{
    if (!job->renderer)
        return;
    reference_drop_idle(engine, job->reference);
    job->reference->idle = job->renderer;
    job->renderer = NULL;
}

uint64_t scene_own_device_bytes(const struct engine *engine, const struct engine_scene *scene)
{
    uint64_t bytes = scene->shared ? engine->backend->scene_bytes(scene->shared) : 0;
    for (const struct engine_reference *one = scene->references; one; one = one->next)
        bytes += one->idle ? engine->backend->renderer_bytes(one->idle) : 0;
    return bytes;
}

uint64_t job_device_bytes(const struct engine *engine, const struct job *job)
{
    return job->renderer ? engine->backend->renderer_bytes(job->renderer) : 0;
}

/* ---- loss and need ------------------------------------------------------------------------------ */

static void lose_scene(struct engine *engine, struct engine_scene *scene)
{
    scene_drop_shared(engine, scene);
    scene->frames = 0;
    scene->frames_ended++;
    scene->put_off = NULL;
}

void engine_drop_device(struct engine *engine)
{
    /* Frames in progress start again. */
    for (size_t i = 0; i < engine->job_count; i++)
        job_end_frame(engine->jobs[i]);
    for (struct engine_scene *scene = engine->scenes; scene; scene = scene->next)
        lose_scene(engine, scene);
    engine->backend->device_destroy(engine->device);
    engine->device = NULL;
}

/* Whether DEVICE_REBUILDS_MAX losses lie within the window: the ring's oldest time, which is overwritten next, is
 * recent. */
static bool too_often(const uint64_t times_ns[DEVICE_REBUILDS_MAX], unsigned count, uint64_t now_ns)
{
    return count >= DEVICE_REBUILDS_MAX &&
           now_ns - times_ns[count % DEVICE_REBUILDS_MAX] < DEVICE_REBUILDS_WINDOW_NS;
}

bool engine_job_may_continue(struct job *job, struct error *error)
{
    uint64_t now_ns = clock_now_ns();
    job->losses_ns[job->losses++ % DEVICE_REBUILDS_MAX] = now_ns;
    if (!too_often(job->losses_ns, job->losses, now_ns))
        return true;
    error_set(error, ERROR_DEVICE_LOST, "render",
              "the GPU was lost %d times within 5 minutes over frames of this job, which is put aside",
              DEVICE_REBUILDS_MAX);
    return error_remedy(error, "try a smaller picture or scene, or another device");
}

bool engine_need_device(struct engine *engine, struct error *error)
{
    if (engine->device)
        return true;
    uint64_t now_ns = clock_now_ns();
    uint64_t *oldest_ns = &engine->rebuilds_ns[engine->rebuilds % DEVICE_REBUILDS_MAX];
    if (too_often(engine->rebuilds_ns, engine->rebuilds, now_ns)) {
        error_set(error, ERROR_DEVICE_LOST, "device", "the GPU was lost %d times within 5 minutes",
                  DEVICE_REBUILDS_MAX);
        error->retryable = true; /* by another process, which is there at once */
        return error_remedy(error, "try a smaller picture or scene, or another device");
    }
    *oldest_ns = now_ns;
    engine->rebuilds++;
    log_write(LOG_WARNING, "engine", "the GPU was lost; opening it again");
    struct error reason = {0};
    if (engine_open_device(engine, &reason))
        return true;
    error_set(error, ERROR_DEVICE_LOST, "device", "the GPU was lost and could not be opened again: %.400s",
              reason.text);
    error->retryable = true;
    return false;
}

bool engine_evict_idle(struct engine *engine, const struct job *keep)
{
    bool found = false;
    for (size_t i = 0; i < engine->job_count; i++) {
        struct job *job = engine->jobs[i];
        if (job != keep && !job->rendering)
            found |= drop_renderer(engine, job);
    }
    for (struct engine_scene *scene = engine->scenes; scene; scene = scene->next) {
        found |= drop_all_idle(engine, scene);
        if (scene == keep->scene || scene->frames || !scene->shared)
            continue;
        scene_drop_shared(engine, scene);
        found = true;
    }
    return found;
}

uint64_t engine_device_bytes(const struct engine *engine)
{
    return engine->device ? engine->device->memory_used_bytes : 0;
}
