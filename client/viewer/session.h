/* SPDX-License-Identifier: MIT */
/* The way to a daemon and a scene on it, opened in a thread of its own and made again when it is lost; and on it a
 * view and, beside it, one job at a time. */
#ifndef FARLIGHT_CLIENT_VIEWER_SESSION_H
#define FARLIGHT_CLIENT_VIEWER_SESSION_H

#include "lib/farlight.h"

struct session;

struct session_options {
    const char *server, *key_file;   /* as of fl_connect_options */
    const char *model, *environment; /* that are loaded .. */
    const char *scene_name;          /* .. or, not NULL, the scene that is come to */
    int interrupt_fd;
    void (*note)(void *user, const struct fl_note *note); /* of the first load; called from another thread */
    void *user;
};

enum session_state {
    SESSION_OPENING,
    SESSION_LIVE,
    SESSION_LOST,  /* it is tried again in a while */
    SESSION_FAILED /* it never was there, and will not be */
};

/* The strings must live until it is destroyed. */
struct session *session_create(const struct session_options *options, struct fl_error *error);
/* Goes on with what is under way; never waits for long. */
enum session_state session_step(struct session *session, uint64_t now_ns);
/* How often it has become live: another number is another connection, on which nothing is shown yet. */
unsigned session_times_live(const struct session *session);
/* What is being done (valid until the next call), and how much of it: 0 to 1, 0 also where it is not known. */
const char *session_progress(struct session *session, double *share);
const struct fl_error *session_error(const struct session *session); /* why it was lost, or failed */
uint64_t session_retry_ns(const struct session *session);            /* SESSION_LOST: when it is tried again */
void session_destroy(struct session *session);

/* The rest needs SESSION_LIVE; a connection that is lost on the way is noticed by the next step. */
struct fl_scene *session_scene(struct session *session);
bool session_is_local(const struct session *session);
bool session_can_h264(const struct session *session);
/* Shows it from now on. *change is the number that its frames have in fl_frame.change. */
bool session_show(struct session *session, const struct message_render *options, uint64_t *change);
bool session_look(struct session *session, const struct fl_view_camera *camera, uint64_t *command);
void session_want_key_frame(struct session *session);
/* The next frame; NULL: none within the time, or *refusal (code not NONE) says that the view or its last change
 * was refused. A view that was refused is shown no more. */
struct fl_frame *session_next(struct session *session, unsigned timeout_ms, struct fl_error *refusal);

/* One frame beside the view; what was asked for before is given up. False: refused, or lost. */
bool session_ask(struct session *session, const struct message_render *options, struct fl_error *refusal);
/* Its frame once it is there. NULL with *refusal code NONE: not yet. */
struct fl_frame *session_answer(struct session *session, struct fl_error *refusal);
void session_give_up(struct session *session); /* what was asked for */

#endif
