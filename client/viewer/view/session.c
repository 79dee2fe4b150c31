/* SPDX-License-Identifier: MIT */
/* The viewer's connection, scene and view. */
#include "session.h"
#include "options/retry.h"
#include "options/watch.h"

#include <inttypes.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>

#define FIRST_PAUSE_NS 250000000ull
#define LONGEST_PAUSE_NS 4000000000ull
#define AGAIN_TIMEOUT_MS 5000u

struct session {
    struct session_options options;
    uint64_t number;    /* random number of this session */
    char name[40];      /* name of the next scene that is loaded */
    char kept_name[40]; /* name under which the loaded scene is found again */
    struct cli_watch watch;
    enum session_state state;
    unsigned times_live, times_read;
    struct fl_error error;
    uint64_t retry_ns, pause_ns;
    uint64_t lost_ns; /* time since which it is retried; 0: it is live */

    /* Owned by the thread while it runs, else by the caller's. */
    pthread_t thread;
    bool has_thread, reads; /* `reads`: the thread reloads changed files into the scene */
    atomic_bool opened;     /* the thread has finished */
    struct fl_connection *connection;
    struct fl_scene *scene;
    bool is_read, is_other; /* changed files are in the scene; it replaces one that was lost */
    struct fl_error open_error;

    pthread_mutex_t lock; /* guards the members below */
    char doing[160];
    double share;
    char doing_copy[160]; /* the last copy for the caller */

    struct fl_view *view;
    uint64_t changes; /* number of changes of `view` */
    struct fl_job *job;
};

/* ---- opening, in the thread ---- */

static void set_progress(struct session *session, const char *what, double share)
{
    pthread_mutex_lock(&session->lock);
    snprintf(session->doing, sizeof(session->doing), "%s", what);
    session->share = share;
    pthread_mutex_unlock(&session->lock);
}

static void on_progress(void *user, uint64_t done_bytes, uint64_t total_bytes, const char *what)
{
    set_progress(user, what, total_bytes > 0 ? (double)done_bytes / (double)total_bytes : 0);
}

static void on_note(void *user, const struct fl_note *note)
{
    struct session *session = user;
    if (session->options.note && session->times_live == 0)
        session->options.note(session->options.user, note);
}

static struct fl_load_options load_options(struct session *session)
{
    const struct session_options *options = &session->options;
    /* A private daemon's scenes end with its connection. */
    return (struct fl_load_options){.model = options->model,
                                    .models = options->models,
                                    .model_count = options->model_count,
                                    .input_fd = options->input_fd,
                                    .environment = options->environment,
                                    .environment_degrees = options->environment_degrees,
                                    .without_studio = options->without_studio,
                                    .variant = options->variant,
                                    .point_size = options->point_size,
                                    .note = on_note,
                                    .progress = on_progress,
                                    .user = session,
                                    .sharing = options->server ? PROTOCOL_SHARING_KEPT : PROTOCOL_SHARING_PRIVATE,
                                    .scene_name = options->server ? session->name : NULL,
                                    .will_reload = options->watch &&
                                                   cli_watch_can_edit_again(options->edits, options->edit_count)};
}

static bool apply_edits(const struct session_options *options, struct fl_scene *scene, struct fl_error *error)
{
    return options->edit_count == 0 || fl_scene_edit(scene, options->edits, options->edit_count, NULL, error);
}

static struct fl_scene *load(struct session *session, struct fl_error *error)
{
    const struct fl_load_options wanted = load_options(session);
    struct fl_scene *scene = fl_scene_load(session->connection, &wanted, error);
    if (!scene || apply_edits(&session->options, scene, error))
        return scene;
    fl_scene_destroy(scene);
    return NULL;
}

/* Attaches again: a daemon that kept running still has the scene; a new one gets it again. */
static struct fl_scene *attach(struct session *session, struct fl_error *error)
{
    const struct session_options *options = &session->options;
    if (options->scene_name)
        return fl_scene_attach(session->connection, options->scene_name, error);
    struct fl_scene *scene = NULL;
    if (session->times_live > 0 && options->server)
        scene = fl_scene_attach(session->connection, session->kept_name, error);
    if (scene || error->code == FL_ERROR_CONNECTION || error->code == FL_ERROR_INTERRUPTED)
        return scene;
    *error = (struct fl_error){0};
    strcpy(session->kept_name, session->name);
    return load(session, error);
}

static unsigned connect_timeout_ms(const struct session *session)
{
    const struct session_options *options = &session->options;
    if (session->times_live > 0)
        return AGAIN_TIMEOUT_MS;
    return options->server && options->has_retry_for ? cli_connect_timeout_ms(options->retry_for_s) : 0;
}

static void *open_all(void *argument)
{
    struct session *session = argument;
    const struct session_options *options = &session->options;
    const struct fl_connect_options connect = {.server = options->server,
                                               .key_file = options->key_file,
                                               .name = "farlight view",
                                               .can_h264 = true,
                                               .interrupt_fd = options->interrupt_fd,
                                               .timeout_ms = connect_timeout_ms(session),
                                               .lost_after_ms = options->lost_after_ms};
    set_progress(session, options->server ? options->server : "starting a daemon", 0);
    session->connection = fl_connect(&connect, &session->open_error);
    if (session->connection)
        session->scene = attach(session, &session->open_error);
    atomic_store(&session->opened, true);
    return NULL;
}

/* Reloads the changes into the scene, or loads another one if necessary; the old one stays until then. */
static void *read_again(void *argument)
{
    struct session *session = argument;
    struct fl_scene *before = session->scene;
    const struct fl_load_options wanted = load_options(session);
    struct fl_scene *scene = fl_scene_reload(before, &wanted, &session->open_error);
    session->is_read = scene != NULL;
    if (scene)
        apply_edits(&session->options, scene, &session->open_error);
    session->is_other = scene && scene != before;
    if (session->is_other)
        strcpy(session->kept_name, session->name);
    session->scene = scene ? scene : before;
    atomic_store(&session->opened, true);
    return NULL;
}

/* Chooses a name that no earlier scene had. */
static void name_scene(struct session *session)
{
    snprintf(session->name, sizeof(session->name), "view-%016" PRIx64, session->number++);
}

static bool begin_opening(struct session *session, void *(*open)(void *))
{
    session->open_error = (struct fl_error){0};
    session->state = SESSION_OPENING;
    atomic_store(&session->opened, false);
    session->has_thread = pthread_create(&session->thread, NULL, open, session) == 0;
    return session->has_thread || fl_error_set(&session->error, FL_ERROR_SYSTEM, "", "cannot start a thread");
}

/* ---- from state to state ---- */

static void close_all(struct session *session)
{
    fl_render_destroy(session->job);
    fl_view_destroy(session->view);
    fl_scene_destroy(session->scene);
    fl_connection_destroy(session->connection);
    session->job = NULL;
    session->view = NULL;
    session->scene = NULL;
    session->connection = NULL;
}

/* If no daemon has answered yet, the address may be misspelt. */
static bool may_be_tried_again(const struct session *session, uint64_t now_ns)
{
    const struct session_options *options = &session->options;
    if (!options->has_retry_for)
        return session->times_live > 0;
    return (session->times_live > 0 || cli_is_temporary(&session->error)) &&
           (double)(now_ns - session->lost_ns) * 1e-9 < options->retry_for_s;
}

static void lose(struct session *session, const struct fl_error *error, uint64_t now_ns)
{
    session->error = *error;
    close_all(session);
    if (session->lost_ns == 0)
        session->lost_ns = now_ns;
    if (!may_be_tried_again(session, now_ns)) {
        session->state = SESSION_FAILED;
        return;
    }
    session->state = SESSION_LOST;
    session->retry_ns = now_ns + session->pause_ns;
    session->pause_ns = session->pause_ns < LONGEST_PAUSE_NS / 2 ? session->pause_ns * 2 : LONGEST_PAUSE_NS;
}

/* Takes over another scene; the view of the old one ends with it. */
static void take_other(struct session *session)
{
    fl_render_destroy(session->job);
    fl_view_destroy(session->view);
    session->job = NULL;
    session->view = NULL;
    session->times_live++;
}

/* Finishes reloading. An unreadable file leaves everything unchanged; refused edits leave the new contents. */
static bool end_reading(struct session *session)
{
    const struct fl_error *error = &session->open_error;
    session->reads = false;
    if (error->code == FL_ERROR_CONNECTION || error->code == FL_ERROR_INTERRUPTED)
        return false;
    if (session->is_read)
        session->times_read++;
    if (error->code != FL_ERROR_NONE && session->options.stale)
        session->options.stale(session->options.user, error);
    if (session->is_other)
        take_other(session);
    session->state = SESSION_LIVE;
    return true;
}

static void end_opening(struct session *session, uint64_t now_ns)
{
    struct fl_error ignored; /* files are not watched if memory is short */
    pthread_join(session->thread, NULL);
    session->has_thread = false;
    if (session->options.watch && session->scene)
        cli_watch_scene(&session->watch, session->scene, &ignored);
    if (session->reads && end_reading(session))
        return;
    if (!session->scene || session->open_error.code != FL_ERROR_NONE) {
        const struct fl_error error = session->open_error;
        lose(session, &error, now_ns);
        return;
    }
    session->times_live++;
    session->lost_ns = 0;
    session->pause_ns = FIRST_PAUSE_NS;
    session->state = SESSION_LIVE;
}

enum session_state session_step(struct session *session, uint64_t now_ns)
{
    if (session->state == SESSION_OPENING && atomic_load(&session->opened))
        end_opening(session, now_ns);
    else if (session->state == SESSION_LIVE && session->error.code != FL_ERROR_NONE) {
        const struct fl_error error = session->error;
        lose(session, &error, now_ns);
    } else if (session->state == SESSION_LIVE && session->options.watch &&
               cli_watch_has_changed(&session->watch, now_ns)) {
        name_scene(session);
        session->reads = begin_opening(session, read_again);
        if (!session->reads)
            session->state = SESSION_LIVE;
    } else if (session->state == SESSION_LOST && now_ns >= session->retry_ns) {
        if (!begin_opening(session, open_all))
            session->state = SESSION_FAILED;
        else
            session->error = (struct fl_error){0};
    }
    return session->state;
}

static bool begin_watch(struct session *session)
{
    const struct session_options *options = &session->options;
    if (!options->watch)
        return true;
    return cli_watch_begin_models(&session->watch, options->models, options->model_count, options->environment,
                                  &session->error) &&
           (!options->model || cli_watch_add(&session->watch, options->model, &session->error));
}

struct session *session_create(const struct session_options *options, struct fl_error *error)
{
    struct session *session = calloc(1, sizeof(*session));
    if (!session || getrandom(&session->number, sizeof(session->number), 0) != (ssize_t)sizeof(session->number)) {
        fl_error_set(error, FL_ERROR_SYSTEM, "", "out of memory, or no random numbers");
        free(session);
        return NULL;
    }
    session->options = *options;
    session->pause_ns = FIRST_PAUSE_NS;
    name_scene(session);
    pthread_mutex_init(&session->lock, NULL);
    if (begin_watch(session) && begin_opening(session, open_all))
        return session;
    *error = session->error;
    session_destroy(session);
    return NULL;
}

/* Does not wait for a daemon that does not answer, since the interrupt descriptor is readable. */
void session_destroy(struct session *session)
{
    if (!session)
        return;
    if (session->has_thread)
        pthread_join(session->thread, NULL);
    if (session->connection)
        fl_connection_set_interrupt(session->connection, 0);
    close_all(session);
    cli_watch_end(&session->watch);
    pthread_mutex_destroy(&session->lock);
    free(session);
}

unsigned session_times_live(const struct session *session)
{
    return session->times_live;
}

unsigned session_times_read(const struct session *session)
{
    return session->times_read;
}

bool session_reads(const struct session *session)
{
    return session->reads;
}

bool session_has_scene(const struct session *session)
{
    return session->reads || session->state == SESSION_LIVE;
}

const char *session_progress(struct session *session, double *share)
{
    pthread_mutex_lock(&session->lock);
    memcpy(session->doing_copy, session->doing, sizeof(session->doing));
    *share = session->share;
    pthread_mutex_unlock(&session->lock);
    return session->doing_copy;
}

const struct fl_error *session_error(const struct session *session)
{
    return &session->error;
}

uint64_t session_retry_ns(const struct session *session)
{
    return session->retry_ns;
}

/* ---- the view ---- */

struct fl_scene *session_scene(struct session *session)
{
    return session->has_thread ? NULL : session->scene;
}

bool session_is_local(const struct session *session)
{
    return fl_connection_is_local(session->connection);
}

bool session_can_h264(const struct session *session)
{
    return fl_connection_can_h264(session->connection);
}

/* True if a retry on another connection may help: always, unless this request was refused. */
static bool is_lost(const struct fl_error *error)
{
    if (error->code == FL_ERROR_REFUSED)
        return error->retryable || error->server_code == PROTOCOL_ERROR_DEVICE_LOST ||
               error->server_code == PROTOCOL_ERROR_SHUTTING_DOWN;
    return error->code != FL_ERROR_NONE && error->code != FL_ERROR_ARGUMENT && error->code != FL_ERROR_INTERRUPTED;
}

/* Records a lost connection for the next step; other errors go to *refusal. */
static bool fail(struct session *session, const struct fl_error *error, struct fl_error *refusal)
{
    if (is_lost(error))
        session->error = *error;
    else if (error->code != FL_ERROR_INTERRUPTED)
        *refusal = *error;
    return false;
}

bool session_show(struct session *session, const struct message_render *options, uint64_t *change)
{
    struct fl_error error = {0}, ignored;
    if (session->view && fl_view_change(session->view, options, &error)) {
        *change = ++session->changes;
        return true;
    }
    if (session->view && error.code != FL_ERROR_REFUSED)
        return fail(session, &error, &ignored);
    fl_view_destroy(session->view); /* the view was refused from the beginning */
    session->changes = *change = 0;
    session->view = fl_view_start(session->scene, options, &error);
    return session->view || fail(session, &error, &ignored);
}

bool session_set_camera(struct session *session, const struct fl_view_camera *camera, uint64_t *command)
{
    struct fl_error error = {0}, ignored;
    if (!session->view)
        return false;
    return fl_view_set_camera(session->view, camera, command, &error) || fail(session, &error, &ignored);
}

void session_want_key_frame(struct session *session)
{
    struct fl_error error = {0}, ignored;
    if (session->view && !fl_view_want_key_frame(session->view, &error))
        fail(session, &error, &ignored);
}

void session_deliver_parts(struct session *session, bool deliver)
{
    if (session->view)
        fl_view_deliver_parts(session->view, deliver);
}

struct fl_frame *session_next(struct session *session, unsigned timeout_ms, struct fl_error *refusal)
{
    struct fl_error error = {0};
    *refusal = (struct fl_error){0};
    if (!session->view)
        return NULL;
    struct fl_frame *frame = fl_view_next(session->view, timeout_ms, &error);
    if (!frame && error.code != FL_ERROR_NONE)
        fail(session, &error, refusal);
    return frame;
}

/* ---- beside the view ---- */

bool session_ask(struct session *session, const struct message_render *options, struct fl_error *refusal)
{
    struct fl_error error = {0};
    session_give_up(session);
    session->job = fl_render_start(session->scene, options, &error);
    return session->job || fail(session, &error, refusal);
}

struct fl_frame *session_answer(struct session *session, struct fl_error *refusal)
{
    struct fl_error error = {0};
    bool done = false;
    *refusal = (struct fl_error){0};
    if (!session->job)
        return NULL;
    struct fl_frame *frame = fl_render_poll(session->job, 0, &done, &error);
    if (!frame && error.code != FL_ERROR_NONE)
        fail(session, &error, refusal);
    if (frame || refusal->code != FL_ERROR_NONE) {
        fl_render_destroy(session->job);
        session->job = NULL;
    }
    return frame;
}

void session_give_up(struct session *session)
{
    fl_render_destroy(session->job);
    session->job = NULL;
}

/* ---- the scene's objects ---- */

bool session_objects(struct session *session, enum protocol_object_kind kind, struct fl_object **objects,
                     size_t *count, struct fl_error *refusal)
{
    struct fl_error error = {0};
    return fl_scene_objects(session->scene, kind, objects, count, &error) || fail(session, &error, refusal);
}

bool session_object(struct session *session, enum protocol_object_kind kind, uint32_t id, struct fl_object *object,
                    struct fl_error *refusal)
{
    struct fl_error error = {0};
    return fl_scene_object(session->scene, kind, id, object, &error) || fail(session, &error, refusal);
}

bool session_read(struct session *session, enum protocol_object_kind kind, uint32_t id,
                  struct fl_object_state *state, struct fl_error *refusal)
{
    struct fl_error error = {0};
    return fl_scene_read(session->scene, kind, id, state, &error) || fail(session, &error, refusal);
}

bool session_edit(struct session *session, const struct fl_assignment *assignments, size_t count,
                  struct fl_edited *edited, struct fl_error *refusal)
{
    struct fl_error error = {0};
    return fl_scene_edit(session->scene, assignments, count, edited, &error) || fail(session, &error, refusal);
}
