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
    uint32_t first_frame, last_frame, frame_step; /* of a batch */
    uint64_t begun_ns;
    uint64_t frames_sent;
    uint64_t client_credit; /* frames, absolute, as the client said */
    uint64_t engine_credit; /* the part of it that the engine was told, counted in frames of `request` .. */
    uint64_t frames_gone;   /* .. as are these: sent, or dropped */
    uint64_t window;        /* frames that may wait here to be sent */
    uint64_t frame_bytes;   /* maximum of its frames' bytes, in the engine and here */
    struct pending_frame *first, **end; /* from the engine, in order; the first may be under way */
    bool rendered;                      /* the engine is done with it */
    bool cancelled;                     /* later frames from the engine are dropped */
    struct loop_timer blocked_timer;    /* until the client is told that nothing comes .. */
    uint64_t blocked_told;              /* .. the number of sent frames at that time, plus 1 */
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
/* The kernel has accepted a whole frame of that request: the job's, or a replaced view's. */
void job_frame_sent(struct job *job, uint32_t request);
/* The rest of a partly sent frame is abandoned. */
void job_frame_abandoned(struct job *job, uint32_t request);
/* Something has changed that may let frames be begun, or go. */
void job_pace(struct job *job);
/* The client is told after a while if nothing comes because of it. */
void job_watch_for_blocks(struct job *job);
void jobs_finish(struct session *session);
bool job_is_owed(const struct job *job); /* the daemon has work for it, the client waits */
/* NULL: no job has that channel. */
struct job *jobs_find(const struct session *session, uint32_t channel);

#endif
