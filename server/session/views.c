/* SPDX-License-Identifier: MIT */
#include "session/views.h"

#include "base/clock.h"
#include "session/frames.h"
#include "session/guess.h"
#include "session/session.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Maximum of a view's frames in flight: while one is sent, the next one is encoded and the one after it rendered.
 */
#define IN_HAND_MAX 3
/* Maximum of pictures in a row that are abandoned for a client that moves again right after a rest. */
#define DROPPED_MAX IN_HAND_MAX
/* Expected times may be too long: a frame that is this much early is hardly older.
 */
#define EARLY_NS UINT64_C(500000)
/* Time after which a client that has not acknowledged its first frame may acknowledge none. */
#define SILENCE_NS UINT64_C(250000000)
/* Time on the link above which only a picture's last refinement has the encoding of rest. */
#define SPARING_NS 250000000.0
/* Minimum time between pictures with a margin: their client makes views in between, which a better picture helps
 * more than a newer one. */
#define KEY_NS UINT64_C(50000000)
/* Time on the link below which a frame is not divided: its first part would hardly arrive sooner, and parts cost
 * some 7 ms of processor time at 1280x720. */
#define PARTS_NS UINT64_C(30000000)
#define SECOND_NS 1e9
/* Maximum deadline, so that those of very low rates fit the number. */
#define DEADLINE_MAX_NS 1e15

/* ---- life -------------------------------------------------------------------------------------------- */

static void on_pace_timer(void *context);
static void on_silence_timer(void *context);

/* Deadline of rendering a frame; 0: none. */
static uint64_t deadline_ns_of(float moving_rate)
{
    return moving_rate > 0.0f ? (uint64_t)fmin(SECOND_NS / (double)moving_rate, DEADLINE_MAX_NS) : 0;
}

struct view_terms view_terms_of(const struct message_render *render)
{
    const uint64_t frame_ns = (uint64_t)(SECOND_NS / (double)render->frames_per_second);
    const uint32_t samples = render->sampling.samples < render->view.pass_samples ? render->sampling.samples
                                                                                  : render->view.pass_samples;
    return (struct view_terms){
        .frame_ns = render->view.margin > 0.0f && frame_ns < KEY_NS ? KEY_NS : frame_ns,
        .samples = render->sampling.samples,
        .moving = {.margin = render->view.margin,
                   .hidden_layers = render->view.hidden_layers,
                   .samples = samples,
                   .depth = render->light.depth,
                   .deadline_ns = deadline_ns_of(render->view.moving_rate),
                   .ignores_link = !render->view.adapt},
        .still_encoding = (enum encoding)render->view.still_encoding,
        .quality = encoder_loses((enum encoding)render->encoding) ? render->quality : 0,
        .adapt = render->view.adapt != 0,
        .parts = render->view.parts != 0,
    };
}

struct session_view *session_view_create(const struct view_terms *terms)
{
    struct session_view *view = calloc(1, sizeof(*view));
    if (!view)
        return NULL;
    view->terms = *terms;
    view->changes_end = &view->changes;
    pacing_init(&view->pacing, terms->frame_ns);
    pacing_set_terms(&view->pacing, terms->frame_ns, &terms->moving);
    view->mailbox = view_mailbox_create();
    if (view->mailbox)
        return view;
    free(view);
    return NULL;
}

void session_view_destroy(struct job *job)
{
    struct session_view *view = job->view;
    if (!view)
        return;
    struct loop *loop = job->session->hub->loop;
    loop_timer_stop(loop, &view->pace_timer);
    loop_timer_stop(loop, &view->silence_timer);
    while (view->changes)
        view_drop_change(job, view->changes);
    view_mailbox_unref(view->mailbox);
    free(view);
}

static void start_timer(struct job *job, struct loop_timer *timer, loop_call_fn *call, uint64_t delay_ns)
{
    timer->call = call;
    timer->context = job;
    loop_timer_start(job->session->hub->loop, timer, delay_ns);
}

/* ---- one view in the place of another ---------------------------------------------------------------- */

void view_add_change(struct job *job, struct view_change *change)
{
    *job->view->changes_end = change;
    job->view->changes_end = &change->next;
    job->session->hub->frame_bytes += change->frame_bytes;
}

struct view_change *view_find_change(const struct job *job, uint32_t request)
{
    struct view_change *change = job->view ? job->view->changes : NULL;
    while (change && change->request != request)
        change = change->next;
    return change;
}

/* Removes a change from the list; its frames still count. */
static void take_out(struct session_view *view, struct view_change *change)
{
    struct view_change **place = &view->changes;
    while (*place != change)
        place = &(*place)->next;
    *place = change->next;
    if (!*place)
        view->changes_end = place;
}

void view_drop_change(struct job *job, struct view_change *change)
{
    take_out(job->view, change);
    job->session->hub->frame_bytes -= change->frame_bytes;
    free(change);
}

void view_switch(struct job *job)
{
    struct session_view *view = job->view;
    struct view_change *change = view->changes;
    take_out(view, change);
    job->session->hub->frame_bytes -= job->frame_bytes;
    job->request = change->request;
    job->scene = change->scene;
    job->tracer = change->tracer;
    job->frame_bytes = change->frame_bytes;
    job->engine_credit = change->credit;
    job->frames_gone = 0;
    job->rendered = false;
    job->cancelled = change->cancelled;
    view->terms = change->terms;
    pacing_set_terms(&view->pacing, view->terms.frame_ns, &view->terms.moving);
    view->shown_samples = 0;
    free(change);
}

void view_forget_frames(struct job *job)
{
    struct session_view *view = job->view;
    pacing_init(&view->pacing, view->terms.frame_ns);
    pacing_set_terms(&view->pacing, view->terms.frame_ns, &view->terms.moving);
}

/* ---- pace -------------------------------------------------------------------------------------------- */

bool view_wants_more(const struct job *job)
{
    const struct session_view *view = job->view;
    return view->last_command > view->shown_command ||
           (!view->shown_moving && view->shown_samples < view->terms.samples);
}

bool view_is_unacknowledged(const struct job *job)
{
    return pacing_wait_ns(&job->view->pacing, 0) == UINT64_MAX;
}

uint64_t view_allowed_credit(struct job *job)
{
    struct session_view *view = job->view;
    uint64_t allowed = job->engine_credit;
    uint64_t before = frames_of_replaced(job);
    loop_timer_stop(job->session->hub->loop, &view->pace_timer);
    for (;;) {
        uint64_t in_hand = allowed - job->frames_gone + before;
        if (in_hand >= IN_HAND_MAX || job->frames_sent + in_hand >= job->client_credit)
            break;
        /* A frame begins so early that it is ready just before it may go. */
        uint64_t wait_ns = pacing_wait_ns(&view->pacing, (unsigned)(in_hand - frames_on_the_wire(job)));
        uint64_t lead_ns = view->made_ns + EARLY_NS;
        if (wait_ns > lead_ns && !view->due) {
            if (wait_ns != UINT64_MAX)
                start_timer(job, &view->pace_timer, on_pace_timer, wait_ns - lead_ns);
            break;
        }
        view->due = false;
        allowed++;
    }
    view->due = false;
    return allowed;
}

static void on_pace_timer(void *context)
{
    struct job *job = context;
    job->view->due = true;
    job_pace(job);
}

/* Ends the time in which the client may acknowledge the first frame. */
static void on_silence_timer(void *context)
{
    struct job *job = context;
    pacing_note_silence(&job->view->pacing);
    job_pace(job);
}

bool view_may_send(const struct job *job)
{
    return pacing_may_send(&job->view->pacing);
}

/* Sets the effort by the estimates of link and renderer. */
static void choose_effort(struct session_view *view)
{
    unsigned wanted = view->terms.quality ? view->terms.quality : PACING_QUALITY_REFERENCE;
    struct pacing_advice advice = pacing_advise(&view->pacing, wanted);
    view->effort.scale_32nds = advice.scale_32nds;
    view->effort.quality = view->terms.quality && view->terms.adapt ? advice.quality : 0;
    view->effort.bytes = view->terms.adapt ? advice.bytes : 0;
    view->effort.samples = advice.samples;
    view->effort.depth_less = advice.depth_less;
    view->effort.margin_halves_less = advice.margin_halves_less;
    view->effort.no_hidden = advice.no_hidden;
}

static void choose_sparing(struct session_view *view, const struct engine_frame *frame)
{
    double bytes_per_second = (double)pacing_bytes_per_second(&view->pacing);
    if (bytes_per_second > 0.0)
        view->effort.sparing = (double)frame->size_bytes * SECOND_NS > SPARING_NS * bytes_per_second;
}

static void choose_parts(struct session_view *view, const struct engine_frame *frame)
{
    const bool parts = pacing_takes_longer(&view->pacing, frame->size_bytes, PARTS_NS);
    if (frame->moving)
        view->effort.parts = parts;
    else
        view->effort.still_parts = parts;
}

/* Sums the times of each wave, by the device's clock where it was read. */
static void waves_of(const struct stage_times *times, uint64_t wave_ns[PACING_WAVES])
{
    bool has_gpu = false;
    for (uint32_t i = 0; i < times->count; i++)
        has_gpu |= times->spans[i].clock == CLOCK_GPU;
    for (uint32_t i = 0; i < times->count; i++) {
        const struct record_stage_time *span = &times->spans[i];
        const bool counts = span->stage == STAGE_TRACE || span->stage == STAGE_SHADE;
        if (counts && span->wave < PACING_WAVES && span->clock == (has_gpu ? CLOCK_GPU : CLOCK_CPU))
            wave_ns[span->wave] += span->duration_ns;
    }
}

/* The advice by which the frame was made, which may be some frames old. */
static struct pacing_advice advice_of(const struct engine_frame *frame)
{
    return (struct pacing_advice){
        .scale_32nds = frame->scale_32nds ? frame->scale_32nds : PACING_SCALE_FULL,
        .quality = frame->quality,
        .margin_halves_less = frame->margin_halves_less,
        .samples = frame->request.sampling.samples,
        .depth_less = frame->depth_less,
    };
}

static void learn(struct session_view *view, const struct engine_frame *frame)
{
    uint64_t wave_ns[PACING_WAVES] = {0};
    const struct pacing_advice made = advice_of(frame);
    if (view->terms.moving.deadline_ns)
        waves_of(&frame->result.times, wave_ns);
    pacing_learn_waves(&view->pacing, &made, frame->rendered_ns - frame->applied_ns, wave_ns,
                       frame->moving ? frame->size_bytes : 0);
}

static void guess(struct session_view *view, const struct engine_frame *frame)
{
    uint64_t wave_ns[PACING_WAVES] = {0};
    const struct pacing_advice made = advice_of(frame);
    pacing_guess_waves(&view->pacing, &made, guess_render_ns(&frame->result.times, wave_ns), wave_ns);
}

/* Whether the frame's times are representative. The first frames of a picture at rest may include builds and
 * compilation; frames that refine it do not. */
static bool is_learned_from(const struct session_view *view, const struct engine_frame *frame)
{
    return frame->moving ||
           (view->terms.moving.deadline_ns > 0 && frame->result.samples > frame->request.sampling.samples);
}

void view_frame_made(struct job *job, const struct engine_frame *frame)
{
    struct session_view *view = job->view;
    if (frame->request.hidden_layer > 0) { /* a layer's cost is not a picture's */
        pacing_learn_hidden(&view->pacing, frame->size_bytes);
        return;
    }
    view->made_ns = frame->encoded_ns > frame->applied_ns ? frame->encoded_ns - frame->applied_ns : 0;
    if (is_learned_from(view, frame)) {
        learn(view, frame);
        if (view->terms.adapt || view->terms.moving.deadline_ns)
            choose_effort(view); /* at rest too, for the first frame of the next motion */
    } else if (view->terms.moving.deadline_ns) {
        guess(view, frame); /* no other frame may follow */
        if (view->pacing.guessed)
            choose_effort(view);
    }
    if (view->terms.adapt && !frame->moving && frame->encoding == view->terms.still_encoding)
        choose_sparing(view, frame);
    if (view->terms.parts)
        choose_parts(view, frame);
    view_mailbox_set_effort(view->mailbox, &view->effort);
}

/* Whether the frame may be dropped: its client wants another camera, and no other frame needs it, unlike one of a
 * stream. */
static bool may_be_dropped(const struct session_view *view, const struct engine_frame *frame)
{
    return frame->encoding != ENCODING_H264 && view->last_command > frame->command;
}

bool view_is_overtaken(const struct job *job, const struct engine_frame *frame)
{
    const struct session_view *view = job->view;
    const bool may_wait = frame->request.hidden_layer > 0 || (!frame->moving && view->last_moving);
    return may_wait && view->dropped < DROPPED_MAX && may_be_dropped(view, frame);
}

bool view_is_outdated(const struct job *job, const struct engine_frame *frame)
{
    const struct session_view *view = job->view;
    return may_be_dropped(view, frame) &&
           (view_is_overtaken(job, frame) ||
            clock_now_ns() - frame->encoded_ns > view->terms.frame_ns + view->made_ns);
}

bool view_is_long(const struct job *job, uint64_t left_bytes)
{
    return pacing_is_long(&job->view->pacing, left_bytes);
}

void view_frame_dropped(struct job *job)
{
    job->view->dropped++;
}

void view_frame_abandoned(struct job *job, const struct engine_frame *frame)
{
    job->view->dropped++;
    pacing_abandoned(&job->view->pacing, frame->frame);
}

void view_frame_cut(struct job *job, const struct engine_frame *frame, size_t end_bytes, bool yields)
{
    if (yields)
        pacing_abandoned(&job->view->pacing, frame->frame);
    else
        pacing_cut(&job->view->pacing, frame->frame, end_bytes);
}

void view_frame_begun(struct job *job, const struct engine_frame *frame, size_t end_bytes, uint64_t begun_ns)
{
    struct session_view *view = job->view;
    pacing_sent(&view->pacing, frame->frame, end_bytes, begun_ns);
    view->shown_command = frame->command;
    view->shown_moving = frame->moving;
    view->shown_samples = frame->result.samples;
}

void view_frame_sent(struct job *job)
{
    struct session_view *view = job->view;
    view->dropped = 0;
    if (!view->pacing.acknowledges && !view->pacing.silent && !view->silence_timer.running)
        start_timer(job, &view->silence_timer, on_silence_timer, SILENCE_NS);
}

/* ---- requests ------------------------------------------------------------------------------------------ */

/* The view of a channel; NULL: it has ended, or is none. */
static struct job *find_view(const struct session *session, uint32_t channel)
{
    struct job *job = jobs_find(session, channel);
    return job && job->view ? job : NULL;
}

static void notify_engine(struct job *job)
{
    struct session *session = job->session;
    struct engine_command *command = hub_command(ENGINE_VIEW_CHANGED, session->number, job->request);
    if (!command) {
        session_fail_for_memory(session);
        return;
    }
    command->scene = job->scene;
    hub_submit(session->hub, command);
}

void views_set_camera(struct session *session, const struct message_view_camera *message)
{
    struct job *job = find_view(session, message->channel);
    if (!job)
        return;
    if (message->command <= job->view->last_command) {
        struct error error = {0};
        error_set(&error, ERROR_PROTOCOL, "view_camera.command",
                  "command %" PRIu64 " after command %" PRIu64 " of the same channel", message->command,
                  job->view->last_command);
        session_fail(session, &error);
        return;
    }
    job->view->last_command = message->command;
    job->view->last_moving = message->moving != 0;
    struct view_camera camera = {
        .command = message->command,
        .received_ns = session->connection->last_received_ns,
        .moving = message->moving != 0,
        .key = {.time_s = message->time_s, .fov_y = message->fov_y},
        .node = message->node,
    };
    memcpy(camera.key.eye_world, message->eye_world, sizeof(camera.key.eye_world));
    memcpy(camera.key.look_at_world, message->look_at_world, sizeof(camera.key.look_at_world));
    memcpy(camera.key.up_world, message->up_world, sizeof(camera.key.up_world));
    if (view_mailbox_set_camera(job->view->mailbox, &camera))
        notify_engine(job);
    frames_overtake(job);
    job_watch_for_blocks(job);
}

void views_acknowledge(struct session *session, const struct message_frame_ack *message)
{
    struct job *job = find_view(session, message->channel);
    if (!job)
        return;
    struct session_view *view = job->view;
    pacing_acknowledged(&view->pacing, message->frame, message->whole != 0, session->connection->last_received_ns);
    if (message->want_key_frame && view_mailbox_request_key_frame(view->mailbox))
        notify_engine(job);
    job_pace(job);
}
