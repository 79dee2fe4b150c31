/* SPDX-License-Identifier: MIT */
/* Jobs: their start and end, and their frames, each in slices. A batch is every frame of a range, in order; view.c
 * has what differs for views. */
#include "engine/engine_private.h"

#include "base/clock.h"
#include "base/log.h"
#include "encode/stream.h"
#include "engine/shot.h"
#include "render/context/request.h"

#include <stdlib.h>
#include <string.h>

/* ---- start -------------------------------------------------------------------------------------- */

static bool can_encode(const struct engine_job *spec, enum encoding encoding)
{
    uint32_t pixel_bytes = frame_format_bytes(spec->frame.picture.format);
    return encoder_supports(encoding, pixel_bytes) ||
           (spec->kind == JOB_VIEW && encoder_stream_supports(encoding, pixel_bytes));
}

/* Keeps the bounds that the check has found, for the first frame. */
static bool spec_check(const struct engine_job *spec, const struct scene *scene, struct animation_bounds *bounds,
                       struct error *error)
{
    if (spec->last_frame < spec->first_frame)
        return error_set(error, ERROR_INVALID, "render.last_frame", "%u lies before the first frame, %u",
                         spec->last_frame, spec->first_frame);
    if (!can_encode(spec, spec->encoding)) {
        error_set(error, ERROR_UNSUPPORTED, "render.encoding", "encoding %u cannot carry pixels of %u bytes",
                  (unsigned)spec->encoding, frame_format_bytes(spec->frame.picture.format));
        return error_remedy(error, "use the pixel format rgba8, or the encoding raw, zstd or predicted");
    }
    if (spec->kind == JOB_VIEW && !can_encode(spec, spec->view.still_encoding))
        return error_set(error, ERROR_UNSUPPORTED, "render.still_encoding",
                         "encoding %u cannot carry pixels of %u bytes", (unsigned)spec->view.still_encoding,
                         frame_format_bytes(spec->frame.picture.format));
    return tracer_find(spec->frame.tracing.tracer, "render.tracer", error) &&
           (!spec->frame.comparison.compare ||
            tracer_find(spec->frame.comparison.compare_with, "render.compare_with", error)) &&
           shot_check(spec, scene, bounds, error);
}

static bool jobs_reserve(struct engine *engine)
{
    if (engine->job_count < engine->job_capacity)
        return true;
    size_t capacity = engine->job_capacity ? engine->job_capacity * 2 : 16;
    struct job **jobs = realloc(engine->jobs, capacity * sizeof(*jobs));
    if (!jobs)
        return false;
    engine->jobs = jobs;
    struct schedule_entry *entries = realloc(engine->entries, capacity * sizeof(*entries));
    if (!entries)
        return false;
    engine->entries = entries;
    engine->job_capacity = capacity;
    return true;
}

/* Frames in flight: fewer if they are large, or a few jobs would fill the host's memory. */
static uint32_t window_of(const struct engine *engine, const struct frame_request *frame)
{
    uint64_t frames = engine->options.frame_window_bytes / frame_request_bytes(frame);
    return frames < 1                                  ? 1
           : frames < engine->options.frames_in_flight ? (uint32_t)frames
                                                       : engine->options.frames_in_flight;
}

/* The view that a new view replaces; NULL: none. */
static struct job *replaced_by(struct engine *engine, const struct engine_command *command)
{
    for (size_t i = 0; command->job.kind == JOB_VIEW && i < engine->job_count; i++) {
        struct job *job = engine->jobs[i];
        if (job->spec.mailbox == command->job.mailbox && !job_output_is_closed(job->output))
            return job;
    }
    return NULL;
}

bool job_start(struct engine *engine, struct engine_reference *reference, struct engine_command *command,
               const struct animation_bounds *known, struct error *error)
{
    struct animation_bounds bounds = known ? *known : (struct animation_bounds){0};
    if (!spec_check(&command->job, reference->scene->scene, &bounds, error))
        return false;
    struct job *job = calloc(1, sizeof(*job));
    struct job_output *output = job_output_create(&(struct job_output_options){
        .events = engine->events,
        .client = command->client,
        .request = command->request,
        .window = window_of(engine, &command->job.frame),
        .credit = command->job.kind == JOB_VIEW ? UINT64_MAX : command->job.credit,
    });
    bool streams = command->job.encoding == ENCODING_H264 || command->job.view.still_encoding == ENCODING_H264;
    struct encode_lane *lane = streams ? encode_lane_create(command->job.frames_per_second) : NULL;
    struct job *before = replaced_by(engine, command);
    struct engine_event *end_before = before ? event_create(ENGINE_DONE, before->client, before->request) : NULL;
    if (!job || !output || (streams && !lane) || (before && !end_before) || !jobs_reserve(engine)) {
        free(job);
        job_output_unref(output);
        encode_lane_unref(lane);
        engine_event_destroy(end_before);
        return error_set(error, ERROR_OUT_OF_MEMORY, "render", "no memory for a job");
    }
    job->client = command->client;
    job->request = command->request;
    job->spec = command->job;
    command->job.keys = NULL;
    command->job.clips = NULL;
    command->job.mailbox = NULL;
    job->reference = reference;
    job->scene = reference->scene;
    job->output = output;
    job->next_frame = job->spec.first_frame;
    job->bounds = bounds;
    job->view.credit = job->spec.credit;
    job->view.lane = lane;
    engine->jobs[engine->job_count++] = job;
    if (before) {
        struct engine_scene *scene_before = before->scene;
        view_follow(job, before);
        job_abort(engine, before, end_before);
        if (scene_before != job->scene)
            engine_run_waiting(engine, scene_before);
    }
    return true;
}

struct job *job_find(struct engine *engine, uint64_t client, uint32_t request)
{
    for (size_t i = 0; i < engine->job_count; i++) {
        struct job *job = engine->jobs[i];
        /* The number of a job that has been answered may be in use again already. */
        if (job->client == client && job->request == request && !job_output_is_closed(job->output))
            return job;
    }
    return NULL;
}

/* ---- end ---------------------------------------------------------------------------------------- */

void job_end_frame(struct job *job)
{
    job->rendering = false;
    scene_motion_finish(&job->motion);
}

void job_abandon_frame(struct engine *engine, struct job *job)
{
    if (!job->rendering)
        return;
    engine->backend->abandon(job->renderer);
    job_end_frame(job);
    job->scene->frames--;
    job->scene->frames_ended++;
}

/* The output may outlive the job: frames may still be in the encoder or wait for the network thread. */
static void job_remove(struct engine *engine, struct job *job)
{
    job_abandon_frame(engine, job);
    if (job->scene->put_off == job)
        job->scene->put_off = NULL;
    if (engine->turn_of == job)
        engine->turn_of = NULL;
    engine_needs_no_memory(engine, job);
    job_leave_renderer(engine, job);
    size_t i = 0;
    while (engine->jobs[i] != job)
        i++;
    memmove(&engine->jobs[i], &engine->jobs[i + 1], (--engine->job_count - i) * sizeof(struct job *));
    job_output_unref(job->output);
    encode_lane_unref(job->view.lane);
    free(job->spec.keys);
    free(job->spec.clips);
    view_mailbox_unref(job->spec.mailbox);
    free(job);
}

void job_abort(struct engine *engine, struct job *job, struct engine_event *final)
{
    job_output_close(job->output, final);
    job_remove(engine, job);
}

void job_credit(struct job *job, uint64_t credit)
{
    if (job->spec.kind == JOB_BATCH)
        job_output_credit(job->output, credit);
    else if (credit > job->view.credit)
        job->view.credit = credit;
}

void jobs_reap(struct engine *engine)
{
    for (size_t i = engine->job_count; i-- > 0;) {
        struct job *job = engine->jobs[i];
        if (!job_output_is_closed(job->output))
            continue;
        struct engine_scene *scene = job->scene;
        job_remove(engine, job);
        engine_run_waiting(engine, scene);
        /* The deferred commands may have ended other jobs: use the list's current length. */
        i = i < engine->job_count ? i : engine->job_count;
    }
}

/* Posts the job's answer, which follows the frames under way: its last frame is rendered, or none can be rendered
 * any more. */
static void job_finish(struct job *job, const struct error *error)
{
    job->next_frame = (uint64_t)job->spec.last_frame + 1;
    struct engine_event *final = event_create(error ? ENGINE_FAILED : ENGINE_DONE, job->client, job->request);
    if (!final) {
        log_write(LOG_ERROR, "engine", "no memory for an event; a job ends without an answer");
        job_output_close(job->output, NULL);
        return;
    }
    if (error)
        final->error = *error;
    job_output_finish(job->output, final);
}

/* ---- frames ------------------------------------------------------------------------------------- */

bool job_wants_frame(const struct job *job)
{
    return !job_output_is_closed(job->output) && !job->rendering && job->next_frame <= job->spec.last_frame &&
           job_output_has_room(job->output) &&
           (job->spec.kind == JOB_BATCH ? job_output_has_credit(job->output) : view_due_ns(job) != UINT64_MAX);
}

/* Whether something waits for the frames in progress to end. */
static bool is_waited_for(const struct engine_scene *scene)
{
    return scene->commit || scene->waiting_count || (scene->put_off && job_wants_frame(scene->put_off));
}

/* Views of the scene would show nothing for the minutes that a batch's frame may take. While such a frame delays
 * the waiting commands anyway, frames of views may begin, as they delay them no further. */
static bool may_begin_meanwhile(const struct engine *engine, const struct job *job)
{
    const struct engine_scene *scene = job->scene;
    bool batch = false;
    for (size_t i = 0; i < engine->job_count; i++) {
        const struct job *other = engine->jobs[i];
        batch |= other->scene == scene && other->rendering && other->spec.kind == JOB_BATCH;
    }
    return batch && job->spec.kind == JOB_VIEW && view_has_news(job) && job->refused_after != scene->frames_ended;
}

/* New frames must not delay commands that wait for the frames in progress. */
static bool may_begin(const struct engine *engine, const struct job *job)
{
    const struct engine_scene *scene = job->scene;
    if (scene->commit || !engine_memory_lets_begin(engine, job))
        return false;
    if (engine->needs_memory == job)
        return !scene->waiting_count;
    if (!scene->waiting_count && scene->put_off == job)
        return !scene->frames;
    return !is_waited_for(scene) || (scene->put_off != job && may_begin_meanwhile(engine, job));
}

/* Time at which the job is ready; in the past: now. UINT64_MAX: not before something happens. */
static uint64_t ready_ns(const struct engine *engine, const struct job *job)
{
    if (job->rendering)
        return job_output_is_closed(job->output) ? UINT64_MAX : 0;
    if (!job_wants_frame(job) || !may_begin(engine, job))
        return UINT64_MAX;
    return job->spec.kind == JOB_VIEW ? view_due_ns(job) : 0;
}

bool job_is_ready(const struct engine *engine, const struct job *job)
{
    uint64_t ready = ready_ns(engine, job);
    return ready != UINT64_MAX && ready <= clock_now_ns();
}

uint64_t jobs_idle_ns(const struct engine *engine)
{
    uint64_t first_ns = UINT64_MAX, now_ns = clock_now_ns();
    for (size_t i = 0; i < engine->job_count; i++) {
        uint64_t ready = ready_ns(engine, engine->jobs[i]);
        first_ns = ready < first_ns ? ready : first_ns;
    }
    return first_ns == UINT64_MAX ? UINT64_MAX : first_ns > now_ns ? first_ns - now_ns : 0;
}

/* Reopens the device. Frames in progress are rendered again, from the scenes that are held in memory. */
static void device_lost(struct engine *engine, struct job *job)
{
    struct error error = {0};
    engine_drop_device(engine);
    if (!engine_job_may_continue(job, &error))
        job_finish(job, &error);
    error = (struct error){0};
    if (engine_need_device(engine, &error))
        return;
    for (size_t i = 0; i < engine->job_count; i++)
        if (engine->jobs[i]->next_frame <= engine->jobs[i]->spec.last_frame)
            job_finish(engine->jobs[i], &error);
    engine_post_device_gone(engine);
}

/* Retries the frame where that is worthwhile; if not, fails the job. */
static void frame_failed(struct engine *engine, struct job *job, struct error *error)
{
    job_abandon_frame(engine, job);
    if (error->kind == ERROR_DEVICE_LOST && engine->device) {
        device_lost(engine, job);
        return;
    }
    const bool has_room = error->kind == ERROR_OUT_OF_MEMORY && engine_free_memory(engine, job);
    if (!has_room && !(job->spec.kind == JOB_VIEW && view_drop_hidden_layers(job, error)))
        job_finish(job, error);
}

/* Begins the frame, or puts it off where the renderer cannot begin it beside those in progress. */
static bool frame_begin_shot(struct engine *engine, struct job *job, struct shot *shot, struct error *error)
{
    struct engine_scene *scene = job->scene;
    const struct scene_motion *motion = shot->motion.pose_count ? &shot->motion : NULL;
    if (!engine_need_device(engine, error) || !job_need_renderer(engine, job, error))
        return false;
    if (!engine->backend->may_begin(job->renderer, scene->scene, motion, &shot->request)) {
        if (!is_waited_for(scene))
            scene->put_off = job;
        job->refused_after = scene->frames_ended;
        return true;
    }
    if (scene->put_off == job)
        scene->put_off = NULL;
    engine_needs_no_memory(engine, job);
    job->motion = shot->motion;
    shot->motion = (struct scene_motion){0};
    motion = motion ? &job->motion : NULL;
    if (!engine->backend->begin(job->renderer, scene->scene, motion, &shot->request, error)) {
        scene_motion_finish(&job->motion);
        return false;
    }
    job->rendering = true;
    scene->frames++;
    return true;
}

static bool job_begin_frame(struct engine *engine, struct job *job, struct error *error)
{
    struct engine_scene *scene = job->scene;
    struct shot shot;
    job->begin_ns = clock_now_ns();
    bool made = job->spec.kind == JOB_VIEW
                    ? view_begin_frame(job, &shot, error)
                    : shot_make(&shot, &job->spec, scene->scene, (uint32_t)job->next_frame, &job->bounds, error);
    if (!made)
        return false;
    shot.request.ycbcr =
        job->spec.kind == JOB_VIEW ? view_ycbcr(job) : encoder_takes(job->spec.encoding, job->spec.quality);
    job->frame = shot.request;
    job->time_s = shot.time_s;
    job->shutter_s = shot.shutter_s;
    bool good = frame_begin_shot(engine, job, &shot, error);
    shot_finish(&shot);
    return good;
}

static void account(struct engine *engine, struct job *job, struct frame_result *result)
{
    struct engine_scene *scene = job->scene;
    if (scene->apply_ns)
        stage_times_add(&result->times, STAGE_APPLY, CLOCK_CPU, 0, scene->apply_start_ns, scene->apply_ns);
    scene->apply_ns = 0;
    if (!stage_times_sum_ns(&result->times, STAGE_FRAME, CLOCK_CPU))
        stage_times_add(&result->times, STAGE_FRAME, CLOCK_CPU, 0, job->begin_ns, clock_now_ns() - job->begin_ns);
    stage_totals_add_times(&engine->totals, &result->times);
    engine->frames++;
    engine->rays += result->primary_rays + result->shadow_rays + result->secondary_rays;
}

static void frame_done(struct engine *engine, struct job *job, struct engine_frame *frame)
{
    job_end_frame(job);
    job->evicted = false;
    job->scene->frames--;
    job->scene->frames_ended++;
    account(engine, job, &frame->result);
    frame->frame = (uint32_t)job->next_frame;
    frame->request = job->frame;
    frame->encoding = job->spec.encoding;
    frame->quality = job->spec.quality;
    frame->time_s = job->time_s;
    frame->shutter_s = job->shutter_s;
    frame->applied_ns = job->begin_ns;
    frame->rendered_ns = clock_now_ns();
    if (job->spec.kind == JOB_VIEW)
        view_done(job, frame);
    job->next_frame += job->spec.frame_step;
    uint64_t position = job_output_reserve(job->output);
    if (!encode_pool_submit(engine->pool, job->output, job->view.lane, position, frame)) {
        struct error error = {0};
        error_set(&error, ERROR_OUT_OF_MEMORY, "render", "a frame could not be passed on to be encoded");
        struct engine_event *event = event_create(ENGINE_FAILED, job->client, job->request);
        if (event)
            event->error = error;
        job_output_close(job->output, event);
        return;
    }
    if (job->next_frame > job->spec.last_frame)
        job_finish(job, NULL);
}

static void job_continue_frame(struct engine *engine, struct job *job)
{
    struct error error = {0};
    struct engine_frame *frame = calloc(1, sizeof(*frame));
    if (!frame) {
        error_set(&error, ERROR_OUT_OF_MEMORY, "render", "no memory for a frame");
        frame_failed(engine, job, &error);
        return;
    }
    enum frame_progress progress = engine->backend->step(job->renderer, &frame->result, &error);
    if (progress == FRAME_DONE) {
        frame_done(engine, job, frame);
        return;
    }
    engine_frame_destroy(frame);
    if (progress == FRAME_FAILED)
        frame_failed(engine, job, &error);
}

void job_step(struct engine *engine, struct job *job)
{
    if (job->rendering && job->spec.kind == JOB_VIEW && view_is_stale(job)) {
        job_abandon_frame(engine, job);
    } else if (job->rendering) {
        job_continue_frame(engine, job);
    } else {
        struct error error = {0};
        if (!job_begin_frame(engine, job, &error))
            frame_failed(engine, job, &error);
    }
}
