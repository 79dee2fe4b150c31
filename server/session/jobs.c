/* SPDX-License-Identifier: MIT */
#include "session/jobs.h"

#include "base/clock.h"
#include "session/frames.h"
#include "session/job_terms.h"
#include "session/session.h"
#include "session/views.h"

#include <stdlib.h>

/* Time without a frame after which the client is notified of the reason. */
#define BLOCKED_NS UINT64_C(100000000)

struct job *jobs_find(const struct session *session, uint32_t channel)
{
    for (struct job *job = session->jobs; job; job = job->next) {
        if (job->channel == channel)
            return job;
    }
    return NULL;
}

/* ---- start ------------------------------------------------------------------------------------------- */

static uint64_t allowed_credit(struct job *job)
{
    if (job->view)
        return view_allowed_credit(job);
    uint64_t left = job->client_credit - job->frames_sent;
    return job->frames_gone + (left < job->window ? left : job->window);
}

/* Creates a job that replaces none. NULL: out of memory. */
static struct job *job_create(struct session *session, uint32_t request, const struct message_render *render)
{
    bool is_view = render->kind == PROTOCOL_JOB_VIEW;
    struct job *job = calloc(1, sizeof(*job));
    struct view_terms terms = view_terms_of(render);
    struct session_view *view = job && is_view ? session_view_create(&terms) : NULL;
    if (!job || (is_view && !view)) {
        free(job);
        return NULL;
    }
    *job = (struct job){
        .next = session->jobs,
        .session = session,
        .request = request,
        .channel = render->channel,
        .scene = render->scene,
        .tracer = render->tracing.tracer,
        .first_frame = render->first_frame,
        .last_frame = render->last_frame,
        .frame_step = render->frame_step,
        .begun_ns = clock_now_ns(),
        .client_credit = render->credit,
        .window = job_window(session, render),
        .frame_bytes = job_bytes(session, render),
        .view = view,
    };
    job->end = &job->first;
    job->engine_credit = allowed_credit(job);
    session->jobs = job;
    session->job_count++;
    session->hub->frame_bytes += job->frame_bytes;
    job_watch_for_blocks(job);
    return job;
}

/* Adds a view that will replace the view `job`. A frame of it may begin if the client's credit exceeds the frames
 * sent. */
static bool add_change(struct job *job, uint32_t request, const struct message_render *render)
{
    struct view_change *change = calloc(1, sizeof(*change));
    if (!change)
        return false;
    if (render->credit > job->client_credit)
        job->client_credit = render->credit;
    *change = (struct view_change){
        .request = request,
        .scene = render->scene,
        .tracer = render->tracing.tracer,
        .credit = job->client_credit > job->frames_sent ? 1 : 0,
        .frame_bytes = job_bytes(job->session, render),
        .terms = view_terms_of(render),
    };
    view_add_change(job, change);
    return true;
}

void jobs_start(struct session *session, struct request *request, const struct message_render *render)
{
    struct error error = {0};
    if (!job_check(session, render, &error)) {
        request_answer_error(session, request, &error);
        return;
    }
    struct engine_command *command = hub_command(ENGINE_JOB_START, session->number, request->id);
    if (!command || !job_fill(&command->job, session, render)) {
        engine_command_destroy(command);
        session_submit(session, request, NULL);
        return;
    }
    struct job *job = job_replaced_by(session, render);
    bool replaces = job != NULL;
    if (replaces ? !add_change(job, request->id, render) : !(job = job_create(session, request->id, render))) {
        engine_command_destroy(command);
        session_submit(session, request, NULL);
        return;
    }
    request->object = job;
    if (job->view)
        command->job.mailbox = view_mailbox_ref(job->view->mailbox);
    command->job.credit = replaces ? view_find_change(job, request->id)->credit : job->engine_credit;
    command->scene = render->scene;
    session_submit(session, request, command);
}

/* ---- pace -------------------------------------------------------------------------------------------- */

/* Reason why no frame is sent, if the client can change it; NULL: there is none. */
static const char *blocked_by(const struct job *job)
{
    if (job->rendered || job->cancelled || (job->view && !view_wants_more(job)))
        return NULL;
    if (job->frames_sent >= job->client_credit)
        return "the credit is used up";
    return job->view && view_is_unacknowledged(job) ? "frames on their way are not acknowledged" : NULL;
}

static void on_blocked_timer(void *context)
{
    struct job *job = context;
    const char *why = blocked_by(job);
    if (!why)
        return;
    job->blocked_noticed = job->frames_sent + 1;
    struct message message;
    message_init(&message, MESSAGE_BLOCKED);
    message.blocked.channel = job->channel;
    message.blocked.total = job->frames_sent;
    message.blocked.text = why;
    session_send(job->session, 0, 0, &message);
}

void job_watch_for_blocks(struct job *job)
{
    if (job->blocked_timer.running || job->blocked_noticed == job->frames_sent + 1 || !blocked_by(job))
        return;
    job->blocked_timer.call = on_blocked_timer;
    job->blocked_timer.context = job;
    loop_timer_start(job->session->hub->loop, &job->blocked_timer, BLOCKED_NS);
}

static void submit_credit(struct job *job)
{
    struct session *session = job->session;
    uint64_t allowed = allowed_credit(job);
    job_watch_for_blocks(job);
    if (allowed <= job->engine_credit || job->rendered || job->cancelled)
        return;
    struct engine_command *command = hub_command(ENGINE_JOB_CREDIT, session->number, job->request);
    if (!command) {
        session_fail_for_memory(session); /* the job might wait forever */
        return;
    }
    command->target_request = job->request;
    command->scene = job->scene;
    command->credit = allowed;
    hub_submit(session->hub, command);
    job->engine_credit = allowed;
}

void job_pace(struct job *job)
{
    submit_credit(job);
    connection_wake(job->session->connection);
}

void jobs_credit(struct session *session, const struct message_credit *credit)
{
    struct job *job = jobs_find(session, credit->channel);
    if (!job || credit->total <= job->client_credit)
        return; /* the job may just have ended; credit never falls */
    job->client_credit = credit->total;
    job_pace(job);
}

bool job_is_awaited(const struct job *job)
{
    return job->first || job->frames_sent < job->client_credit;
}

/* ---- end --------------------------------------------------------------------------------------------- */

/* Drops the frames that the kernel has not accepted yet. A replaced view may wait for one of them. */
static void drop_frames(struct session *session, struct job *job)
{
    uint32_t before = frames_drop(session, job);
    struct request *request = before ? request_find(session, before) : NULL;
    if (request)
        request_answer_ok(session, request, 0);
}

static void destroy(struct session *session, struct job *job)
{
    drop_frames(session, job);
    session_view_destroy(job);
    loop_timer_stop(session->hub->loop, &job->blocked_timer);
    struct job **place = &session->jobs;
    while (*place != job)
        place = &(*place)->next;
    *place = job->next;
    session->job_count--;
    session->hub->frame_bytes -= job->frame_bytes;
    free(job);
}

/* Ends the job after the engine has ended its request; if a view was to replace it, that view becomes current. */
static void end(struct session *session, struct job *job)
{
    if (!job->view || !job->view->changes) {
        destroy(session, job);
        return;
    }
    drop_frames(session, job);
    view_switch(job);
    view_forget_frames(job);
    submit_credit(job);
}

void job_failed(struct session *session, struct request *request, const struct error *error)
{
    struct job *job = request->object;
    struct view_change *change = view_find_change(job, request->id);
    if (change)
        view_drop_change(job, change);
    else
        end(session, job);
    request_answer_error(session, request, error);
}

static void fail_cancelled(struct session *session, struct request *request)
{
    struct error error = {0};
    error_set(&error, ERROR_CANCELLED, NULL, "cancelled by the client");
    job_failed(session, request, &error);
}

static void finish_if_complete(struct session *session, struct job *job)
{
    if (!job->rendered || job->first)
        return;
    struct request *request = request_find(session, job->request);
    destroy(session, job);
    request_answer_ok(session, request, 0);
}

/* Replaces the view by the next one. A frame under way is finished before the request is answered. */
static void view_replaced(struct session *session, struct job *job, struct request *request)
{
    bool under_way = frames_keep_begun(job);
    view_switch(job);
    submit_credit(job);
    if (!under_way)
        request_answer_ok(session, request, 0);
}

void job_done(struct session *session, struct request *request)
{
    struct job *job = request->object;
    if (job->view && !job->cancelled && job->view->changes) {
        view_replaced(session, job, request);
        return;
    }
    job->rendered = true;
    if (job->cancelled)
        /* The job ended before the engine got the cancel, but its frames are dropped. */
        fail_cancelled(session, request);
    else
        finish_if_complete(session, job);
}

/* Ends the frame under way, of which no more bytes will be sent. */
static void frame_over(struct job *job, uint32_t request_id)
{
    if (request_id != job->request) {
        request_answer_ok(job->session, request_find(job->session, request_id), 0);
        submit_credit(job);
        return;
    }
    job->frames_gone++;
    submit_credit(job);
    finish_if_complete(job->session, job);
}

void job_frame_sent(struct job *job, uint32_t request_id)
{
    job->frames_sent++;
    if (job->view)
        view_frame_sent(job);
    frame_over(job, request_id);
}

void job_frame_abandoned(struct job *job, uint32_t request_id)
{
    frame_over(job, request_id);
}

bool job_is_cancelled(const struct request *target)
{
    const struct job *job = target->object;
    const struct view_change *change = view_find_change(job, target->id);
    return change ? change->cancelled : job->cancelled && target->id == job->request;
}

void job_cancel(struct session *session, struct request *target, struct request *cancel)
{
    struct job *job = target->object;
    struct view_change *change = view_find_change(job, target->id);
    bool current = target->id == job->request;
    if (!current && !change) {
        target->cancelled_by = cancel->id; /* replaced, and its last frame is under way */
        return;
    }
    if (current && job->rendered) {
        fail_cancelled(session, target);
        request_answer_ok(session, cancel, 0);
        return;
    }
    struct engine_command *command = hub_command(ENGINE_JOB_CANCEL, session->number, cancel->id);
    if (command) { /* without memory the job continues, and another cancel may end it */
        /* A view that is about to be replaced ends by that. */
        if (change) {
            change->cancelled = true;
        } else if (!job->view || !job->view->changes) {
            job->cancelled = true;
            drop_frames(session, job);
        }
        command->target_request = target->id;
        command->scene = job->scene;
    }
    session_submit(session, cancel, command);
}

void jobs_finish(struct session *session)
{
    while (session->jobs)
        destroy(session, session->jobs);
}
