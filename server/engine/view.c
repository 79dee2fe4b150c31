/* SPDX-License-Identifier: MIT */
/* Views: frames of the newest camera only, which refine while nothing moves.
 *
 * A frame begins when the view has changed and has credit, so no frame waits and becomes stale. While the view
 * moves, each frame starts from zero; at rest, frames accumulate samples until there are enough. */
#include "engine/engine_private.h"

#include "base/clock.h"
#include "base/log.h"
#include "protocol/common/margin.h"

#include <math.h>

#define SECOND_NS 1e9
/* Time by which a frame is finished before the encoder is expected to be free: the frame is hardly older for that,
 * and an encoder that is faster than last time need not wait. */
#define EARLY_NS UINT64_C(500000)
/* Time without a new camera after which motion is about to end, so hidden layers delay nobody. */
#define HIDDEN_IDLE_NS UINT64_C(100000000)

void view_follow(struct job *job, const struct job *before)
{
    job->next_frame = before->next_frame;
    job->view.due_ns = before->view.due_ns;
    job->view.render_ns = before->view.render_ns;
    job->view.hidden_budget = before->view.hidden_budget;
    job->view.begun_ns = before->view.begun_ns;
}

/* Whether frames accumulate samples; if one frame has all of them, it is rendered like a batch's. */
static bool adds_up(const struct job *job)
{
    return job->spec.frame.sampling.samples > job->spec.view.pass_samples;
}

/* Whether the requests or the scene have changed since the last frame. */
static bool has_news(const struct job *job, const struct view_request *request)
{
    const struct view *view = &job->view;
    /* A key frame that could not be finished is still requested. */
    bool key_frame = request->key_frame || view->latest.key_frame;
    return !view->shown || request->camera.command != view->shown_command || key_frame ||
           job->scene->known.revision != view->shown_revision;
}

bool view_has_news(const struct job *job)
{
    struct view_request request = view_mailbox_latest(job->spec.mailbox);
    return has_news(job, &request);
}

/* Whether a hidden layer of the last picture comes before the next picture. */
static bool has_hidden(const struct job *job, const struct view_request *request)
{
    const struct view *view = &job->view;
    return view->hidden_layer > 0 && job->scene->known.revision == view->shown_revision &&
           (view->hidden_is_paid || !has_news(job, request));
}

/* Only a picture's first layer waits for a pause; the second follows it at once. */
static uint64_t hidden_due_ns(const struct view *view)
{
    return view->hidden_is_paid || view->hidden_layer > 1 ? 0 : view->rendered_ns + HIDDEN_IDLE_NS;
}

static bool may_refine(const struct job *job)
{
    const struct view *view = &job->view;
    return view->shown && !view->shown_moving && view->held_samples < job->spec.frame.sampling.samples;
}

/* Begin of a frame that need not wait to be encoded: each is encoded while the next one is rendered, and one that
 * came early would only be older when it is shown. */
static uint64_t encoder_due_ns(const struct job *job)
{
    const struct view *view = &job->view;
    uint32_t unfinished = job_output_unfinished(job->output);
    if (unfinished != 1)
        return unfinished ? UINT64_MAX : 0; /* the pool notifies the engine of each encoded frame */
    uint64_t free_ns = view->rendered_ns + job_output_encode_ns(job->output);
    uint64_t before_ns = view->render_ns + EARLY_NS;
    return free_ns > before_ns ? free_ns - before_ns : 0;
}

uint64_t view_due_ns(const struct job *job)
{
    /* Always read: the engine is notified of the next request only after it has read the last. */
    struct view_request request = view_mailbox_latest(job->spec.mailbox);
    const bool hidden = has_hidden(job, &request);
    if (job->view.made >= job->view.credit || !(hidden || has_news(job, &request) || may_refine(job)))
        return UINT64_MAX;
    const uint64_t encoder_ns = encoder_due_ns(job);
    const uint64_t due_ns = hidden ? hidden_due_ns(&job->view) : job->view.due_ns;
    return encoder_ns > due_ns ? encoder_ns : due_ns;
}

/* Frames begin at even intervals where possible, and never more often. */
static void set_due(struct job *job)
{
    uint64_t period_ns = (uint64_t)(SECOND_NS / (double)job->spec.frames_per_second);
    uint64_t due_ns = job->view.due_ns + period_ns;
    job->view.due_ns = due_ns > job->begin_ns ? due_ns : job->begin_ns + period_ns;
}

/* Whether frames follow the link or the rate, which they do while the camera moves. */
static bool adapts(const struct job *job)
{
    return (job->spec.view.adapt || job->spec.view.moving_rate > 0.0f) && job->view.latest.camera.moving;
}

static uint32_t samples_of_next(const struct job *job)
{
    const struct view *view = &job->view;
    uint32_t samples = job->spec.frame.sampling.samples;
    uint32_t wanted = view->refining ? samples - view->held_samples : samples;
    wanted = wanted < job->spec.view.pass_samples ? wanted : job->spec.view.pass_samples;
    const bool limited = adapts(job) && view->latest.effort.samples > 0 && view->latest.effort.samples < wanted;
    return limited ? view->latest.effort.samples : wanted;
}

/* Frames while the camera moves, and the first ones at rest, reuse earlier frames of the same places; a frame that
 * has all its samples does not depend on how the camera came there. */
static enum frame_history history_of(const struct job *job, uint32_t samples)
{
    const struct view *view = &job->view;
    if (view->latest.camera.moving)
        return HISTORY_MOVING;
    const uint32_t held = samples + (view->refining ? view->held_samples : 0);
    return held < job->spec.frame.sampling.samples ? HISTORY_USED : HISTORY_KEPT;
}

/* Bounces dropped so that the frame meets its deadline. */
static uint32_t depth_less(const struct job *job)
{
    const uint32_t less = adapts(job) ? job->view.latest.effort.depth_less : 0;
    return less < job->spec.frame.light.depth ? less : job->spec.frame.light.depth;
}

/* Reduces resolution and bounces while the camera moves, if the rate requires it. */
static void apply_effort(const struct job *job, struct frame_request *request)
{
    uint32_t scale = job->view.latest.effort.scale_32nds;
    request->light.depth = job->spec.frame.light.depth - depth_less(job);
    if (!adapts(job) || !scale || scale >= 32)
        return;
    uint32_t width, height;
    frame_view_size(request, &width, &height);
    const uint32_t across = request->picture.width / width, down = request->picture.height / height;
    request->picture.width = across * (width * scale >= 32 ? width * scale / 32 : 1);
    request->picture.height = down * (height * scale >= 32 ? height * scale / 32 : 1);
}

/* Widens the camera's view for a picture `growth` times as high; pixels keep their size. */
static void widen(struct frame_camera *camera, float growth)
{
    camera->fov_y = 2.0f * atanf(growth * tanf(camera->fov_y / 2.0f));
    camera->ortho_height *= growth;
}

static float margin_share(const struct job *job)
{
    const unsigned halves_less = adapts(job) ? job->view.latest.effort.margin_halves_less : 0;
    return halves_less < 2 ? job->spec.view.margin * (float)(2 - halves_less) / 2.0f : 0.0f;
}

/* While the camera moves, only the middle view is rendered for a client that makes views of its own: it makes the
 * others from it. */
static void choose_eyes(const struct job *job, struct frame_request *request)
{
    if (!(job->spec.view.margin > 0.0f) || !frame_has_views(request))
        return;
    if (!job->view.latest.camera.moving) {
        request->attachments = 0;
        return;
    }
    frame_view_size(request, &request->picture.width, &request->picture.height);
    request->picture.views_across = request->picture.views_down = 1;
    request->picture.eyes_over = false;
    request->picture.baseline = 0.0f;
    request->picture.view_source = VIEW_SOURCE_RAYS;
}

/* Adds a margin while the camera moves, so that the client has something to show beyond the picture's edges. */
static void add_margin(struct job *job, struct frame_request *request)
{
    struct view *view = &job->view;
    view->margin_x = view->margin_y = 0;
    if (!view->latest.camera.moving || !(job->spec.view.margin > 0.0f))
        return;
    view->margin_x = margin_pixels(margin_share(job), request->picture.width);
    view->margin_y = margin_pixels(margin_share(job), request->picture.height);
    widen(&request->camera,
          (float)(request->picture.height + 2 * view->margin_y) / (float)request->picture.height);
    request->picture.width += 2 * view->margin_x;
    request->picture.height += 2 * view->margin_y;
}

/* Hidden layers have half the resolution: they are mostly seen in narrow strips, cost a fifth in this way, and
 * views made from them are hardly worse. */
static void halve(struct view *view, struct frame_request *request)
{
    const uint32_t height = (request->picture.height + 1) / 2;
    widen(&request->camera, 2.0f * (float)height / (float)request->picture.height);
    request->picture.width = (request->picture.width + 1) / 2;
    request->picture.height = height;
    view->margin_x /= 2;
    view->margin_y /= 2;
}

/* Begins a hidden layer, with the camera of the last picture. */
static bool begin_hidden_frame(struct job *job, struct shot *shot, struct error *error)
{
    struct view *view = &job->view;
    struct frame_request *request = &shot->request;
    if (!shot_make_at(shot, &job->spec, job->scene->scene, &view->latest.camera, &job->bounds, error))
        return false;
    view->refining = false;
    request->sampling.seed = job->spec.frame.sampling.seed;
    request->sampling.accumulate = false;
    request->sampling.samples = 1;
    request->sampling.noise = 0.0f;
    request->hidden_layer = view->hidden_layer;
    request->hidden_radius = job->spec.view.depth_radius;
    choose_eyes(job, request);
    apply_effort(job, request);
    add_margin(job, request);
    halve(view, request);
    return true;
}

bool view_begin_frame(struct job *job, struct shot *shot, struct error *error)
{
    struct view *view = &job->view;
    const struct scene *scene = job->scene->scene;
    const struct view_request latest = view_mailbox_latest(job->spec.mailbox);
    if (has_hidden(job, &latest))
        return begin_hidden_frame(job, shot, error);
    view->hidden_layer = 0;
    bool key_frame = view->latest.key_frame; /* request of an unfinished frame */
    view->latest = view_mailbox_begin_frame(job->spec.mailbox);
    view->latest.key_frame |= key_frame;
    view->refining = !has_news(job, &view->latest);
    bool made = view->latest.camera.command
                    ? shot_make_at(shot, &job->spec, scene, &view->latest.camera, &job->bounds, error)
                    : shot_make(shot, &job->spec, scene, job->spec.first_frame, &job->bounds, error);
    if (!made)
        return false;
    shot->request.sampling.seed =
        job->spec.frame.sampling.seed; /* a camera position gives the same picture each time */
    shot->request.sampling.accumulate = adds_up(job);
    shot->request.sampling.samples = samples_of_next(job);
    shot->request.samples_max = job->spec.frame.sampling.samples; /* a complete picture may be requested again */
    shot->request.history = history_of(job, shot->request.sampling.samples);
    choose_eyes(job, &shot->request);
    apply_effort(job, &shot->request);
    add_margin(job, &shot->request);
    return true;
}

/* Quality of a frame: the effort's while the camera moves, the job's at rest. */
static unsigned quality_of(const struct job *job)
{
    const unsigned quality = job->view.latest.effort.quality;
    return adapts(job) && quality ? quality : job->spec.quality;
}

/* Hidden layers are no part of a stream of pictures, so they are encoded one by one. */
static enum encoding encoding_of_hidden(const struct job *job)
{
    return job->spec.encoding == ENCODING_H264 ? ENCODING_JPEG : job->spec.encoding;
}

enum ycbcr view_ycbcr(const struct job *job)
{
    if (job->view.hidden_layer > 0)
        return YCBCR_NONE; /* empty pixels must be filled first */
    /* At rest the number of samples decides on the encoding, which is known only after rendering. */
    bool certain = job->view.latest.camera.moving || job->spec.view.still_encoding == job->spec.encoding;
    return certain ? encoder_takes(job->spec.encoding, quality_of(job)) : YCBCR_NONE;
}

bool view_is_stale(const struct job *job)
{
    struct view_request request = view_mailbox_latest(job->spec.mailbox);
    if (job->view.hidden_layer > 0)
        return !has_hidden(job, &request);
    return job->view.refining && (has_news(job, &request) || job->scene->waiting_count > 0);
}

static void note_camera(struct job *job, struct engine_frame *frame)
{
    const struct view *view = &job->view;
    frame->command = view->latest.camera.command;
    frame->received_ns = view->latest.camera.received_ns;
    frame->moving = view->latest.camera.moving;
    frame->quality = quality_of(job);
    frame->view = job->spec.view;
    frame->margin_x = view->margin_x;
    frame->margin_y = view->margin_y;
    const struct view_effort *effort = &view->latest.effort;
    frame->in_parts = job->spec.view.parts && (frame->moving ? effort->parts : effort->still_parts);
}

static void hidden_done(struct job *job, struct engine_frame *frame)
{
    struct view *view = &job->view;
    frame->encoding = encoding_of_hidden(job);
    frame->of_frame = view->picture;
    view->hidden_ns += frame->rendered_ns - frame->applied_ns;
    view->hidden_layer = view->hidden_layer < job->spec.view.hidden_layers ? view->hidden_layer + 1 : 0;
    if (view->hidden_layer == 0)
        hidden_budget_spend(&view->hidden_budget, view->hidden_ns, !view->hidden_is_paid);
}

/* Decides after a picture whether hidden layers follow it. */
static void plan_hidden(struct job *job, const struct engine_frame *frame)
{
    struct view *view = &job->view;
    view->hidden_layer = 0;
    if (!view->latest.camera.moving || job->spec.view.hidden_layers == 0)
        return;
    hidden_budget_earn(&view->hidden_budget, frame->applied_ns - view->begun_ns);
    view->begun_ns = frame->applied_ns;
    view->hidden_is_paid =
        hidden_budget_suffices(&view->hidden_budget) && !(adapts(job) && view->latest.effort.no_hidden);
    view->hidden_ns = 0;
    view->hidden_layer = 1;
}

bool view_drop_hidden_layers(struct job *job, const struct error *error)
{
    if (job->view.hidden_layer == 0)
        return false;
    log_write(LOG_WARNING, "engine", "a view goes on without what its pictures hide: %s", error->text);
    job->view.hidden_layer = job->spec.view.hidden_layers = 0;
    return true;
}

void view_done(struct job *job, struct engine_frame *frame)
{
    struct view *view = &job->view;
    const struct view_camera *camera = &view->latest.camera;
    view->rendered_ns = frame->rendered_ns;
    view->made++;
    note_camera(job, frame);
    if (frame->request.hidden_layer > 0) {
        hidden_done(job, frame);
        return;
    }
    set_due(job);
    view->render_ns = frame->rendered_ns - frame->applied_ns;
    view->picture = frame->frame;
    plan_hidden(job, frame);
    view->shown = true;
    view->shown_command = camera->command;
    view->shown_revision = frame->result.revision;
    view->shown_moving = camera->moving;
    view->held_samples = frame->result.samples;
    if (frame->result.noise <= job->spec.frame.sampling.noise && job->spec.frame.sampling.noise > 0.0f)
        view->held_samples = job->spec.frame.sampling.samples; /* the noise is low enough */
    view->needs_key_frame |= view->latest.key_frame;
    view->latest.key_frame = false;
    if (adapts(job)) {
        const struct view_effort *effort = &view->latest.effort;
        frame->scale_32nds = effort->scale_32nds;
        frame->margin_halves_less = effort->margin_halves_less;
        frame->depth_less = depth_less(job);
        frame->wanted_bytes = effort->bytes;
    }
    bool spares = job->spec.view.adapt && view->latest.effort.sparing &&
                  view->held_samples < job->spec.frame.sampling.samples;
    if (!camera->moving && !spares && job->spec.view.still_encoding != job->spec.encoding) {
        frame->encoding = job->spec.view.still_encoding;
        if (!encoder_loses(frame->encoding))
            frame->quality = 0; /* the quality was that of the lossy encoding; 0 is the fastest level */
    }
    frame->wants_key = view->needs_key_frame;
    /* A picture at rest may stand alone, but does not help a client that has lost the stream. */
    if (!view->lane || frame->encoding == ENCODING_H264)
        view->needs_key_frame = false;
}
