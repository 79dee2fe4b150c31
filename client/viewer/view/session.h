/* SPDX-License-Identifier: MIT */
/* The connection to a daemon and a scene on it, opened by a thread of its own, and again after a loss; and on
 * it a view and one job at a time. */
#ifndef FARLIGHT_VIEWER_VIEW_SESSION_H
#define FARLIGHT_VIEWER_VIEW_SESSION_H

#include "lib/farlight.h"

struct session;

struct session_options {
    const char *server, *key_file;   /* see fl_connect_options */
    const char *model, *environment; /* files to load .. */
    const struct fl_model *models;   /* several models, see fl_load_options */
    size_t model_count;
    int input_fd; /* see fl_load_options */
    double environment_degrees, point_size;
    bool without_studio;
    const char *variant;
    const struct fl_assignment *edits; /* edits after each load */
    size_t edit_count;
    const char *scene_name; /* .. or, if not NULL, the scene to attach to */
    bool watch;             /* reloads files when they change */
    /* Limit of retries for a daemon that is lost, or missing at first. Without has_retry_for: unlimited, or
     * none. */
    bool has_retry_for;
    double retry_for_s;
    unsigned lost_after_ms; /* see fl_connect_options */
    int interrupt_fd;
    /* Notes of the first load; called from another thread */
    void (*note)(void *user, const struct fl_note *note);
    /* Reports that changed files could not be loaded; the scene is unchanged. */
    void (*stale)(void *user, const struct fl_error *error);
    void *user;
};

enum session_state {
    SESSION_OPENING,
    SESSION_LIVE,
    SESSION_LOST,  /* will be retried */
    SESSION_FAILED /* was never live, and will not be; or the time for retries is over */
};

/* Creates a session; strings and lists must live until it is destroyed. */
struct session *session_create(const struct session_options *options, struct fl_error *error);
/* Advances the current state; never blocks for long. */
enum session_state session_step(struct session *session, uint64_t now_ns);
/* The number of times that the session has become live: a new number means a new connection or a new scene, of
 * which nothing is shown yet. */
unsigned session_times_live(const struct session *session);
/* The number of times that changed files were read. If they became another scene, the session became live with
 * it; else the scene is the same, and pointers to its cameras and clips are invalid. */
unsigned session_times_read(const struct session *session);
bool session_reads(const struct session *session);     /* true while a thread reloads files and uses the scene */
bool session_has_scene(const struct session *session); /* also true while it is reloaded */
/* The current activity (valid until the next call) and its progress: 0 to 1, 0 also if unknown. */
const char *session_progress(struct session *session, double *share);
const struct fl_error *session_error(const struct session *session); /* reason of the loss or failure */
uint64_t session_retry_ns(const struct session *session);            /* SESSION_LOST: time of the next attempt */
void session_destroy(struct session *session);

/* The functions below need SESSION_LIVE; the next step notices a connection that is lost meanwhile. */
struct fl_scene *session_scene(struct session *session); /* NULL in every other state */
bool session_is_local(const struct session *session);
bool session_can_h264(const struct session *session);
/* Shows the picture with these options. *change is the number of its frames in fl_frame.change. */
bool session_show(struct session *session, const struct message_render *options, uint64_t *change);
bool session_set_camera(struct session *session, const struct fl_view_camera *camera, uint64_t *command);
void session_want_key_frame(struct session *session);
void session_deliver_parts(struct session *session, bool deliver); /* see fl_view_deliver_parts */
/* The next frame; NULL: none within the time, or *refusal (code not NONE) says that the view or its last change
 * was refused. A refused view is not shown any more. */
struct fl_frame *session_next(struct session *session, unsigned timeout_ms, struct fl_error *refusal);

/* Requests a frame beside the view, and cancels the previous request. False: refused, or lost. */
bool session_ask(struct session *session, const struct message_render *options, struct fl_error *refusal);
/* The requested frame once it has arrived. NULL with *refusal code NONE: not yet. */
struct fl_frame *session_answer(struct session *session, struct fl_error *refusal);
void session_give_up(struct session *session); /* cancels the request */

/* Call the library's functions for the scene's objects, and wait for the daemon. False: refused, or lost. */
bool session_objects(struct session *session, enum protocol_object_kind kind, struct fl_object **objects,
                     size_t *count, struct fl_error *refusal);
bool session_object(struct session *session, enum protocol_object_kind kind, uint32_t id, struct fl_object *object,
                    struct fl_error *refusal);
bool session_read(struct session *session, enum protocol_object_kind kind, uint32_t id,
                  struct fl_object_state *state, struct fl_error *refusal);
bool session_edit(struct session *session, const struct fl_assignment *assignments, size_t count,
                  struct fl_edited *edited, struct fl_error *refusal);

#endif
