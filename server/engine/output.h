/* SPDX-License-Identifier: MIT */
/* The output of a job: its frames in order as far as credit goes, then one final event, then nothing.
 *
 * Frames come from the encoding pool in any order; the thread that owns GL gives credit, ends and cancels; the
 * network thread reports what it has fetched. The call that makes the next event possible pushes it. Thread-safe,
 * reference-counted: the job, each frame under way and each event hold a reference. */
#ifndef FARLIGHT_ENGINE_OUTPUT_H
#define FARLIGHT_ENGINE_OUTPUT_H

#include "base/queue.h"
#include "engine/engine.h"

struct job_output;

struct job_output_options {
    struct queue *events; /* struct engine_event *; a push may wait */
    uint64_t client;
    uint32_t request;
    uint32_t window; /* maximum of frames that were added and not fetched */
    uint64_t credit;
};

struct job_output *job_output_create(const struct job_output_options *options); /* NULL: out of memory */
struct job_output *job_output_ref(struct job_output *output);
void job_output_unref(struct job_output *output); /* accepts NULL */

/* Reserves a place for one more frame; false: `window` frames are not fetched yet. One thread only. */
bool job_output_has_room(const struct job_output *output);
/* Whether the client has given any credit. */
bool job_output_has_credit(const struct job_output *output);
/* Takes that place; the number is the frame's position in the output. */
uint64_t job_output_reserve(struct job_output *output);
/* Adds the frame, or its error, for a reserved place. Takes over the event and fills in its client and request. */
void job_output_put(struct job_output *output, uint64_t position, struct engine_event *event);
/* Frames whose place is reserved and that are not put there yet: the encoders have them. */
uint32_t job_output_unfinished(const struct job_output *output);
/* Time that the last frame took to encode; 0: none has been encoded. */
uint64_t job_output_encode_ns(const struct job_output *output);
void job_output_credit(struct job_output *output, uint64_t credit);
/* The final event. `done` comes after the last frame; `failed` after the frames that credit lets out. */
void job_output_finish(struct job_output *output, struct engine_event *final);
/* Closes the output with `final` at once (NULL: without an event). False: it was closed already, and `final` is
 * dropped. */
bool job_output_close(struct job_output *output, struct engine_event *final);
bool job_output_is_closed(const struct job_output *output);
uint64_t job_output_client(const struct job_output *output);
/* Notes that a frame has left the event queue. */
void job_output_taken(struct job_output *output);

/* An event of that kind; NULL: out of memory. */
struct engine_event *event_create(enum engine_event_kind kind, uint64_t client, uint32_t request);
void engine_frame_destroy(struct engine_frame *frame); /* accepts NULL */

#endif
