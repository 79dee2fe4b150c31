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
/* How long before the encoder is expected to be free a frame is finished: it is hardly older for that, and an
 * encoder that is faster than last time need not wait. */
#define EARLY_NS UINT64_C(500000)
/* No camera for so long: motion is about to end, and nobody waits while hidden layers are rendered. */
#define HIDDEN_IDLE_NS UINT64_C(100000000)

void view_follow(struct job *job, const struct job *before)
{
    job->next_frame = before->next_frame;
    job->view.due_ns = before->view.due_ns;
    job->view.render_ns = before->view.render_ns;
    job->view.hidden_budget = before->view.hidden_budget;
    job->view.begun_ns = before->view.begun_ns;
}

/* One frame has all the samples that are wanted: it is rendered like one of a batch. */
static bool adds_up(const struct job *job)
{
    return job->spec.frame.samples > job->spec.pass_samples;
}

/* Something was wished, or changed, that no frame shows. */
static bool has_news(const struct job *job, const struct view_wish *wish)
{
    const struct view *view = &job->view;
    /* A key frame that could not be finished is wished still. */
    bool key_frame = wish->key_frame || view->wish.key_frame;
    return !view->shown || wish->camera.command != view->shown_command || key_frame ||
           job->scene->known.revision != view->shown_revision;
}

bool view_has_news(const struct job *job)
{
    struct view_wish wish = view_wishes_see(job->spec.wishes);
    return has_news(job, &wish);
}

/* Whether what is hidden in the last picture is to be shown before another one is. */
static bool has_hidden(const struct job *job, const struct view_wish *wish)
{
    const struct view *view = &job->view;
    return view->hidden_layer > 0 && job->scene->known.revision == view->shown_revision &&
           (view->hidden_is_paid || !has_news(job, wish));
}

/* Of the layers of a picture the second comes just behind the first. */
static uint64_t hidden_due_ns(const struct view *view)
{
    return view->hidden_is_paid || view->hidden_layer > 1 ? 0 : view->rendered_ns + HIDDEN_IDLE_NS;
}

static bool may_refine(const struct job *job)
{
    const struct view *view = &job->view;
    return view->shown && !view->shown_moving && view->held_samples < job->spec.frame.samples;
}

/* When a frame may be begun so that it need not wait to be encoded: each is encoded while the next one is
 * rendered, but one that came early would only be older when it is seen. */
static uint64_t encoder_due_ns(const struct job *job)
{
    const struct view *view = &job->view;
    uint32_t unfinished = job_output_unfinished(job->output);
    if (unfinished != 1)
        return unfinished ? UINT64_MAX : 0; /* the engine is told of each that is encoded */
    uint64_t free_ns = view->rendered_ns + job_output_encode_ns(job->output);
    uint64_t before_ns = view->render_ns + EARLY_NS;
    return free_ns > before_ns ? free_ns - before_ns : 0;
}

uint64_t view_due_ns(const struct job *job)
{
    /* Seen in any case, or the engine would not be told of the next wish. */
    struct view_wish wish = view_wishes_see(job->spec.wishes);
    const bool hidden = has_hidden(job, &wish);
    if (job->view.made >= job->view.credit || !(hidden || has_news(job, &wish) || may_refine(job)))
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

/* While it moves. */
static bool adapts(const struct job *job)
{
    return (job->spec.adapt || job->spec.keeps_rate) && job->view.wish.camera.moving;
}

static uint32_t samples_of_next(const struct job *job)
{
    const struct view *view = &job->view;
    uint32_t samples = job->spec.frame.samples;
    uint32_t wanted = view->refining ? samples - view->held_samples : samples;
    wanted = wanted < job->spec.pass_samples ? wanted : job->spec.pass_samples;
    const bool limited = adapts(job) && view->wish.effort.samples > 0 && view->wish.effort.samples < wanted;
    return limited ? view->wish.effort.samples : wanted;
}

/* A frame while it moves, and the first ones at rest, have what frames before them show of the same places; one
 * that has all its samples is that of any other way there. */
static enum frame_history history_of(const struct job *job, uint32_t samples)
{
    const struct view *view = &job->view;
    if (view->wish.camera.moving)
        return HISTORY_MOVING;
    const uint32_t held = samples + (view->refining ? view->held_samples : 0);
    return held < job->spec.frame.samples ? HISTORY_USED : HISTORY_KEPT;
}

/* That it goes without. */
static uint32_t depth_less(const struct job *job)
{
    const uint32_t less = adapts(job) ? job->view.wish.effort.depth_less : 0;
    return less < job->spec.frame.depth ? less : job->spec.frame.depth;
}

/* Smaller and with fewer bounces while it moves, if the rate requires it. */
static void apply_effort(const struct job *job, struct frame_request *request)
{
    const struct view_wish *wish = &job->view.wish;
    uint32_t scale = wish->effort.scale_32nds;
    request->depth = job->spec.frame.depth - depth_less(job);
    if (!adapts(job) || !scale || scale >= 32)
        return;
    uint32_t width, height;
    frame_view_size(request, &width, &height);
    const uint32_t across = request->width / width, down = request->height / height;
    request->width = across * (width * scale >= 32 ? width * scale / 32 : 1);
    request->height = down * (height * scale >= 32 ? height * scale / 32 : 1);
}

/* The camera's view for a picture that is so many times as high, in pixels of the same size. */
static void widen(struct frame_camera *camera, float growth)
{
    camera->fov_y = 2.0f * atanf(growth * tanf(camera->fov_y / 2.0f));
    camera->ortho_height *= growth;
}

static float margin_share(const struct job *job)
{
    const unsigned halves_less = adapts(job) ? job->view.wish.effort.margin_halves_less : 0;
    return halves_less < 2 ? job->spec.margin * (float)(2 - halves_less) / 2.0f : 0.0f;
}

/* While it moves a client that makes views of its own makes all eyes of the one in the middle. */
static void choose_eyes(const struct job *job, struct frame_request *request)
{
    if (!(job->spec.margin > 0.0f) || !frame_has_views(request))
        return;
    if (!job->view.wish.camera.moving) {
        request->attachments = 0;
        return;
    }
    frame_view_size(request, &request->width, &request->height);
    request->views_across = request->views_down = 1;
    request->eyes_over = false;
    request->baseline = 0.0f;
    request->view_source = VIEW_SOURCE_RAYS;
}

/* While it moves: so that a client has something to show beside the edges of the picture. */
static void add_margin(struct job *job, struct frame_request *request)
{
    struct view *view = &job->view;
    view->margin_x = view->margin_y = 0;
    if (!view->wish.camera.moving || !(job->spec.margin > 0.0f))
        return;
    view->margin_x = margin_pixels(margin_share(job), request->width);
    view->margin_y = margin_pixels(margin_share(job), request->height);
    widen(&request->camera, (float)(request->height + 2 * view->margin_y) / (float)request->height);
    request->width += 2 * view->margin_x;
    request->height += 2 * view->margin_y;
}

/* What is hidden is mostly seen in narrow strips: one pixel for two by two of the picture costs a fifth, and views
 * made from it are hardly worse. */
static void halve(struct view *view, struct frame_request *request)
{
    const uint32_t height = (request->height + 1) / 2;
    widen(&request->camera, 2.0f * (float)height / (float)request->height);
    request->width = (request->width + 1) / 2;
    request->height = height;
    view->margin_x /= 2;
    view->margin_y /= 2;
}

/* By the camera of the last picture. */
static bool take_up_hidden(struct job *job, struct shot *shot, struct error *error)
{
    struct view *view = &job->view;
    struct frame_request *request = &shot->request;
    if (!shot_look(shot, &job->spec, job->scene->scene, &view->wish.camera, &job->bounds, error))
        return false;
    view->refining = false;
    request->seed = job->spec.frame.seed;
    request->accumulate = false;
    request->samples = 1;
    request->noise = 0.0f;
    request->hidden_layer = view->hidden_layer;
    request->hidden_radius = job->spec.depth.radius;
    choose_eyes(job, request);
    apply_effort(job, request);
    add_margin(job, request);
    halve(view, request);
    return true;
}

bool view_take_up(struct job *job, struct shot *shot, struct error *error)
{
    struct view *view = &job->view;
    const struct scene *scene = job->scene->scene;
    const struct view_wish seen = view_wishes_see(job->spec.wishes);
    if (has_hidden(job, &seen))
        return take_up_hidden(job, shot, error);
    view->hidden_layer = 0;
    bool key_frame = view->wish.key_frame; /* of a frame that was not finished */
    view->wish = view_wishes_take(job->spec.wishes);
    view->wish.key_frame |= key_frame;
    view->refining = !has_news(job, &view->wish);
    bool made = view->wish.camera.command
                    ? shot_look(shot, &job->spec, scene, &view->wish.camera, &job->bounds, error)
                    : shot_make(shot, &job->spec, scene, job->spec.first_frame, &job->bounds, error);
    if (!made)
        return false;
    shot->request.seed = job->spec.frame.seed; /* the same picture of the same place */
    shot->request.accumulate = adds_up(job);
    shot->request.samples = samples_of_next(job);
    shot->request.samples_max = job->spec.frame.samples; /* one that is complete may be wished again */
    shot->request.history = history_of(job, shot->request.samples);
    choose_eyes(job, &shot->request);
    apply_effort(job, &shot->request);
    add_margin(job, &shot->request);
    return true;
}

/* While it moves; at rest it is the job's. */
static unsigned quality_of(const struct job *job)
{
    const unsigned quality = job->view.wish.effort.quality;
    return adapts(job) && quality ? quality : job->spec.quality;
}

/* A stream of pictures has none of what they hide. */
static enum encoding encoding_of_hidden(const struct job *job)
{
    return job->spec.encoding == ENCODING_H264 ? ENCODING_JPEG : job->spec.encoding;
}

enum ycbcr view_ycbcr(const struct job *job)
{
    if (job->view.hidden_layer > 0)
        return YCBCR_NONE; /* what is not there is filled first */
    /* At rest the samples that are held decide how the frame is encoded, once it is there. */
    bool certain = job->view.wish.camera.moving || job->spec.still_encoding == job->spec.encoding;
    return certain ? encoder_takes(job->spec.encoding, quality_of(job)) : YCBCR_NONE;
}

bool view_is_stale(const struct job *job)
{
    struct view_wish wish = view_wishes_see(job->spec.wishes);
    if (job->view.hidden_layer > 0)
        return !has_hidden(job, &wish);
    return job->view.refining && (has_news(job, &wish) || job->scene->waiting_count > 0);
}

static void note_camera(struct job *job, struct engine_frame *frame)
{
    const struct view *view = &job->view;
    frame->command = view->wish.camera.command;
    frame->received_ns = view->wish.camera.received_ns;
    frame->moving = view->wish.camera.moving;
    frame->quality = quality_of(job);
    frame->depth = job->spec.depth;
    frame->margin_x = view->margin_x;
    frame->margin_y = view->margin_y;
    const struct view_effort *effort = &view->wish.effort;
    frame->in_parts = job->spec.parts && (frame->moving ? effort->parts : effort->still_parts);
}

static void hidden_done(struct job *job, struct engine_frame *frame)
{
    struct view *view = &job->view;
    frame->encoding = encoding_of_hidden(job);
    frame->of_frame = view->picture;
    view->hidden_ns += frame->rendered_ns - frame->applied_ns;
    view->hidden_layer = view->hidden_layer < job->spec.hidden_layers ? view->hidden_layer + 1 : 0;
    if (view->hidden_layer == 0)
        hidden_budget_spend(&view->hidden_budget, view->hidden_ns, !view->hidden_is_paid);
}

/* Behind a picture. */
static void plan_hidden(struct job *job, const struct engine_frame *frame)
{
    struct view *view = &job->view;
    view->hidden_layer = 0;
    if (!view->wish.camera.moving || job->spec.hidden_layers == 0)
        return;
    hidden_budget_earn(&view->hidden_budget, frame->applied_ns - view->begun_ns);
    view->begun_ns = frame->applied_ns;
    view->hidden_is_paid =
        hidden_budget_suffices(&view->hidden_budget) && !(adapts(job) && view->wish.effort.no_hidden);
    view->hidden_ns = 0;
    view->hidden_layer = 1;
}

bool view_goes_without(struct job *job, const struct error *error)
{
    if (job->view.hidden_layer == 0)
        return false;
    log_write(LOG_WARNING, "engine", "a view goes on without what its pictures hide: %s", error->text);
    job->view.hidden_layer = job->spec.hidden_layers = 0;
    return true;
}

void view_done(struct job *job, struct engine_frame *frame)
{
    struct view *view = &job->view;
    const struct view_camera *camera = &view->wish.camera;
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
    if (frame->result.noise <= job->spec.frame.noise && job->spec.frame.noise > 0.0f)
        view->held_samples = job->spec.frame.samples; /* it has enough */
    view->owes_key_frame |= view->wish.key_frame;
    view->wish.key_frame = false;
    if (adapts(job)) {
        const struct view_effort *effort = &view->wish.effort;
        frame->scale_32nds = effort->scale_32nds;
        frame->margin_halves_less = effort->margin_halves_less;
        frame->depth_less = depth_less(job);
        frame->wanted_bytes = effort->bytes;
    }
    bool spares = job->spec.adapt && view->wish.effort.sparing && view->held_samples < job->spec.frame.samples;
    if (!camera->moving && !spares && job->spec.still_encoding != job->spec.encoding) {
        frame->encoding = job->spec.still_encoding;
        if (!encoder_loses(frame->encoding))
            frame->quality = 0; /* the other one's: the fastest level */
    }
    frame->wants_key = view->owes_key_frame;
    /* A picture at rest may stand alone, but does not help a client that has lost the stream. */
    if (!view->lane || frame->encoding == ENCODING_H264)
        view->owes_key_frame = false;
}
