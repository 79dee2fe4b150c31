/* SPDX-License-Identifier: MIT */
/* Render jobs of one session: checked, handed to the engine, paced by the client's credit. */
#ifndef FARLIGHT_SESSION_JOBS_H
#define FARLIGHT_SESSION_JOBS_H

#include "engine/engine.h"
#include "net/loop.h"
#include "protocol/framing.h"
#include "session/requests.h"

#include <stdbool.h>
#include <stdint.h>

struct pending_frame;
struct session_view;

struct job {
    struct job *next;
    struct session *session;
    uint32_t request, channel, scene;
    enum protocol_tracer tracer;
    uint32_t first_frame, last_frame, frame_step; /* batch only */
    uint64_t begun_ns;
    uint64_t frames_sent;
    uint64_t client_credit; /* frames that the client allows, absolute */
    uint64_t engine_credit; /* the part of it that was passed to the engine, counted in frames of `request` .. */
    uint64_t frames_gone;   /* .. like these frames, which were sent or dropped */
    uint64_t window;        /* maximum of frames that wait here to be sent */
    uint64_t frame_bytes;   /* maximum of its frames' bytes, in the engine and here */
    struct pending_frame *first, **end; /* from the engine, in order; the first may be under way */
    bool rendered;                      /* whether the engine has finished it */
    bool cancelled;                     /* whether later frames from the engine are dropped */
    struct loop_timer blocked_timer;    /* notifies the client that no frame is sent .. */
    uint64_t blocked_noticed;           /* .. with the number of sent frames at the last notice, plus 1 */
    struct session_view *view;          /* owned; NULL: a batch */
};

void jobs_start(struct session *session, struct request *request, const struct message_render *render);
void jobs_credit(struct session *session, const struct message_credit *credit);
/* `cancel` is answered by the engine's answer to it, after the job's own request. */
void job_cancel(struct session *session, struct request *target, struct request *cancel);
bool job_is_cancelled(const struct request *target);
/* The engine's events for a job's request. */
void job_done(struct session *session, struct request *request);
void job_failed(struct session *session, struct request *request, const struct error *error);
/* Called when the kernel has accepted a whole frame of that request: the job's, or a replaced view's. */
void job_frame_sent(struct job *job, uint32_t request);
/* The rest of a partly sent frame is abandoned. */
void job_frame_abandoned(struct job *job, uint32_t request);
/* Called after changes that may let frames begin, or be sent. */
void job_pace(struct job *job);
/* Starts the timer that notifies the client if no frame is sent for a reason that it can change. */
void job_watch_for_blocks(struct job *job);
void jobs_finish(struct session *session);
bool job_is_awaited(const struct job *job); /* whether the daemon has work for it, for which the client waits */
/* NULL: no job has that channel. */
struct job *jobs_find(const struct session *session, uint32_t channel);

#endif
