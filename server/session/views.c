/* SPDX-License-Identifier: MIT */
#include "session/views.h"

#include "session/frames.h"
#include "session/session.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

struct session_view *session_view_create(void)
{
    struct session_view *view = calloc(1, sizeof *view);
    if (!view)
        return NULL;
    view->changes_end = &view->changes;
    view->wishes = view_wishes_create();
    if (view->wishes)
        return view;
    free(view);
    return NULL;
}

void session_view_destroy(struct job *job)
{
    struct session_view *view = job->view;
    if (!view)
        return;
    while (view->changes)
        view_drop_change(job, view->changes);
    view_wishes_unref(view->wishes);
    free(view);
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

/* Takes it out of the list; its frames still count. */
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
    struct view_change *change = job->view->changes;
    take_out(job->view, change);
    job->session->hub->frame_bytes -= job->frame_bytes;
    job->request = change->request;
    job->scene = change->scene;
    job->window = change->window;
    job->frame_bytes = change->frame_bytes;
    job->engine_credit = change->credit;
    job->frames_gone = 0;
    job->cancelled = change->cancelled;
    free(change);
}

/* ---- wishes ------------------------------------------------------------------------------------------ */

/* The view of a channel; NULL: it has ended, or is none. */
static struct job *find_view(const struct session *session, uint32_t channel)
{
    struct job *job = jobs_find(session, channel);
    return job && job->view ? job : NULL;
}

static void tell_engine(struct job *job)
{
    struct session *session = job->session;
    struct engine_command *command = hub_command(ENGINE_VIEW_LOOK, session->number, job->request);
    if (command)
        command->scene = job->scene;
    if (command && hub_submit(session->hub, command))
        return;
    struct error error = {0};
    error_set(&error, ERROR_OUT_OF_MEMORY, NULL, "no memory for what a view is told");
    session_fail(session, &error);
}

void views_look(struct session *session, const struct message_view_camera *message)
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
    struct view_camera camera = {
        .command = message->command,
        .received_ns = session->connection->last_received_ns,
        .moving = message->moving != 0,
        .key = {.time_s = message->time_s, .fov_y = message->fov_y},
    };
    memcpy(camera.key.eye_world, message->eye_world, sizeof camera.key.eye_world);
    memcpy(camera.key.look_at_world, message->look_at_world, sizeof camera.key.look_at_world);
    memcpy(camera.key.up_world, message->up_world, sizeof camera.key.up_world);
    if (view_wishes_look(job->view->wishes, &camera))
        tell_engine(job);
}

void views_acknowledge(struct session *session, const struct message_frame_ack *message)
{
    struct job *job = find_view(session, message->channel);
    if (job && message->want_key_frame && view_wishes_want_key_frame(job->view->wishes))
        tell_engine(job);
}
