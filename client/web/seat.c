/* SPDX-License-Identifier: MIT */
/* A browser's seat: a thread with its own connection to the daemon. */
#include "web/seat.h"
#include "web/describe.h"
#include "web/editing.h"
#include "web/error_map.h"
#include "web/inbox.h"
#include "protocol/common/clock.h"
#include "options/complete.h"
#include "options/edit_history.h"
#include "options/job.h"
#include "options/retry.h"
#include "options/talk.h"

#include <errno.h>
#include <poll.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <unistd.h>

#define MOVING_RATE 15.0f
#define CAMERAS_REMEMBERED 256u
#define IDLE_MS 1000
/* Seconds of idling after which the seat pings the daemon, which disconnects silent clients */
#define PING_ROUNDS 8u

struct seat {
    struct seat_options options;
    pthread_t thread;
    int wake_fd, end_fd; /* eventfds: there is work; the seat ends */

    pthread_mutex_t lock; /* guards the members below */
    struct web_inbox inbox;
    bool has_ended;
    struct web_queue queue;

    /* The thread's own members. */
    struct fl_connection *connection;
    struct fl_scene *scene;
    struct fl_view *view;
    struct record_clip_use clip;
    struct message_render render; /* the view's last request */
    struct fl_view_camera camera; /* its camera, if has_camera */
    bool has_camera;
    struct error_map errors;
    struct edit_history history;
    char *described;                             /* the last description of the scene that was sent */
    uint64_t described_revision, shown_revision; /* its revision, and the newest frame's */
    unsigned idle_rounds;
    uint32_t ids[CAMERAS_REMEMBERED]; /* the page's numbers of cameras, by ours, modulo the size */
};

/* ---- to the browser ---- */

static void signal_event(int fd)
{
    const uint64_t one = 1;
    if (write(fd, &one, sizeof(one)) < 0)
        errno = 0; /* the descriptor is readable already */
}

static bool post(struct seat *seat, char *head, const uint8_t *tail, size_t tail_bytes, struct fl_error *error)
{
    const size_t head_bytes = head ? strlen(head) : 0, size_bytes = tail ? sizeof(uint32_t) : 0;
    const size_t bytes = size_bytes + head_bytes + tail_bytes;
    struct parcel *parcel = head ? malloc(sizeof(*parcel) + PARCEL_ROOM + bytes) : NULL;
    if (!parcel) {
        free(head);
        return fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    }
    unsigned char *to = parcel->data + PARCEL_ROOM;
    *parcel = (struct parcel){.is_text = !tail, .bytes = bytes};
    for (size_t i = 0; i < size_bytes; i++)
        *to++ = (unsigned char)(head_bytes >> (8 * i));
    memcpy(to, head, head_bytes);
    if (tail)
        memcpy(to + head_bytes, tail, tail_bytes);
    free(head);
    pthread_mutex_lock(&seat->lock);
    web_queue_add(&seat->queue, parcel);
    pthread_mutex_unlock(&seat->lock);
    seat->options.changed(seat->options.user);
    return true;
}

/* ---- the view ---- */

static bool fill_render(struct seat *seat, const struct web_show *show, struct fl_error *error)
{
    const struct cli_job *job = seat->options.job;
    struct message_render *render = &seat->render;
    *render = job->options;
    render->picture.width = show->width;
    render->picture.height = show->height;
    if (show->has_tracer)
        render->tracing.tracer = show->tracer;
    if (show->has_integrator)
        render->light.integrator = show->integrator;
    if (render->view.moving_rate == 0)
        render->view.moving_rate = MOVING_RATE;
    render->view.adapt = 1;
    render->encoding =
        show->h264 && fl_connection_can_h264(seat->connection) ? PROTOCOL_ENCODING_H264 : PROTOCOL_ENCODING_JPEG;
    render->view.still_encoding = PROTOCOL_ENCODING_JPEG;
    if (show->clip != 0) {
        seat->clip = (struct record_clip_use){.clip = show->clip, .speed = 1, .loop = 1};
        render->clips = &seat->clip;
        render->clips_count = 1;
    }
    return cli_find_camera(render, job->camera.name, job->camera.framed, job->camera.has_framing, seat->scene,
                           error);
}

/* Sends a description of the scene unless it equals the last one. */
static bool describe(struct seat *seat, struct fl_error *error)
{
    struct fl_scene_bounds bounds;
    if (!fl_scene_refresh(seat->scene, &bounds, error))
        return false;
    seat->described_revision = bounds.revision;
    char *text = web_describe_scene(seat->scene, seat->options.scene, &seat->render, &bounds,
                                    fl_connection_can_h264(seat->connection), seat->options.may_edit);
    if (text && seat->described && strcmp(text, seat->described) == 0) {
        free(text);
        return true;
    }
    free(seat->described);
    seat->described = text ? strdup(text) : NULL;
    return post(seat, text, NULL, 0, error);
}

static bool show(struct seat *seat, const struct web_show *wanted, struct fl_error *error)
{
    error_map_end(&seat->errors);
    if (!fill_render(seat, wanted, error))
        return false;
    if (!seat->described && !describe(seat, error))
        return false;
    if (seat->view)
        return fl_view_change(seat->view, &seat->render, error);
    seat->view = fl_view_start(seat->scene, &seat->render, error);
    if (seat->view)
        fl_view_keep_jpeg(seat->view, true);
    return seat->view != NULL;
}

static bool set_camera(struct seat *seat, const struct web_request *wanted, struct fl_error *error)
{
    uint64_t command = 0;
    error_map_end(&seat->errors);
    if (!fl_view_set_camera(seat->view, &wanted->camera, &command, error))
        return false;
    seat->ids[command % CAMERAS_REMEMBERED] = wanted->id;
    seat->camera = wanted->camera;
    seat->has_camera = true;
    return true;
}

static bool may_send(struct seat *seat)
{
    pthread_mutex_lock(&seat->lock);
    const bool may = web_queue_has_room(&seat->queue);
    pthread_mutex_unlock(&seat->lock);
    return may;
}

static bool pass_frames(struct seat *seat, struct fl_error *error)
{
    while (may_send(seat)) {
        struct fl_frame *frame = fl_view_next(seat->view, 0, error);
        if (!frame)
            return error->code == FL_ERROR_NONE;
        const uint32_t id = frame->command == 0 ? 0 : seat->ids[frame->command % CAMERAS_REMEMBERED];
        const bool sent = post(seat, web_describe_frame(frame, id), frame->encoded, frame->encoded_bytes, error);
        seat->shown_revision = frame->revision;
        fl_frame_destroy(frame);
        if (!sent)
            return false;
    }
    return true;
}

/* ---- the errors of its tracer ---- */

/* Reports a comparison that is impossible to the page; the view continues. */
static bool refuse_compare(struct seat *seat, struct fl_error *error)
{
    struct fl_error refusal = *error;
    const uint32_t id = seat->errors.id;
    error_map_end(&seat->errors);
    if (refusal.code != FL_ERROR_REFUSED && refusal.code != FL_ERROR_ARGUMENT)
        return false;
    *error = (struct fl_error){0};
    return post(seat, web_describe_refusal(&refusal, id), NULL, 0, error);
}

static bool compare(struct seat *seat, uint32_t id, struct fl_error *error)
{
    const bool is_begun =
        error_map_begin(&seat->errors, seat->scene, &seat->render, seat->has_camera ? &seat->camera : NULL, error);
    seat->errors.id = id;
    return is_begun || refuse_compare(seat, error);
}

static bool pass_errors(struct seat *seat, struct fl_error *error)
{
    struct error_map *map = &seat->errors;
    if (!map->job || !may_send(seat))
        return true;
    if (!error_map_step(map, seat->scene, error))
        return error->code == FL_ERROR_NONE || refuse_compare(seat, error);
    const bool sent =
        post(seat, web_describe_errors(map->frame, (double)map->render.comparison.compare_far, map->id),
             map->frame->pixels, (size_t)map->frame->width * map->frame->height, error);
    error_map_end(map);
    return sent;
}

/* ---- edits ---- */

static bool answer_edit(struct seat *seat, const struct web_request *request, struct fl_error *error)
{
    struct fl_error refusal = {0};
    char *answer = web_editing_answer(&seat->history, seat->scene, request, &refusal);
    if (!answer && refusal.code != FL_ERROR_REFUSED && refusal.code != FL_ERROR_ARGUMENT) {
        *error = refusal;
        return false;
    }
    return post(seat, answer ? answer : web_describe_edit_refusal(&refusal), NULL, 0, error);
}

/* ---- the thread ---- */

static bool begin_requests(struct seat *seat, struct fl_error *error)
{
    pthread_mutex_lock(&seat->lock);
    /* Each answer is a parcel, and queued parcels are limited. */
    const bool may_answer = web_queue_has_room_for_text(&seat->queue);
    const bool wants_scene = seat->shown_revision > seat->described_revision && may_answer;
    const struct web_request shown = web_inbox_take(&seat->inbox.show, true),
                             key = web_inbox_take(&seat->inbox.key, true),
                             moved = web_inbox_take(&seat->inbox.camera, seat->view || shown.kind != WEB_NONE),
                             compared = web_inbox_take(&seat->inbox.compare, seat->view && may_answer),
                             edited = web_inbox_take(&seat->inbox.edit, seat->view && may_answer);
    pthread_mutex_unlock(&seat->lock);
    if (shown.kind != WEB_NONE && !show(seat, &shown.show, error))
        return false;
    if (moved.kind != WEB_NONE && !set_camera(seat, &moved, error))
        return false;
    if (compared.kind != WEB_NONE && !compare(seat, compared.id, error))
        return false;
    if (edited.kind != WEB_NONE && !answer_edit(seat, &edited, error))
        return false;
    if (wants_scene && !describe(seat, error))
        return false;
    return key.kind == WEB_NONE || !seat->view || fl_view_want_key_frame(seat->view, error);
}

/* Waits for work; false: the seat ends. */
static bool wait_for_work(struct seat *seat)
{
    uint64_t count;
    struct pollfd fds[] = {{.fd = seat->end_fd, .events = POLLIN},
                           {.fd = seat->wake_fd, .events = POLLIN},
                           {.fd = -1, .events = POLLIN}};
    if (seat->view && may_send(seat)) /* otherwise frames wait in the socket, which the daemon notices */
        fds[2].fd = fl_connection_fd(seat->connection);
    const int ready = poll(fds, sizeof(fds) / sizeof(fds[0]), seat->connection ? IDLE_MS : -1);
    if (ready < 0 && errno != EINTR)
        return false;
    seat->idle_rounds = ready == 0 ? seat->idle_rounds + 1 : 0;
    if (fds[1].revents != 0 && read(seat->wake_fd, &count, sizeof(count)) < 0)
        errno = 0;
    return fds[0].revents == 0;
}

static bool has_show(struct seat *seat)
{
    pthread_mutex_lock(&seat->lock);
    const bool has = seat->inbox.show.kind != WEB_NONE;
    pthread_mutex_unlock(&seat->lock);
    return has;
}

/* ---- to the operator ---- */

/* A request of the page that the daemon refuses is no outage. */
static void report_outage(const struct seat *seat, const struct fl_error *error)
{
    const bool is_of_page = seat->scene && !cli_is_temporary(error) &&
                            (error->code == FL_ERROR_REFUSED || error->code == FL_ERROR_ARGUMENT);
    if (!seat->options.outage || is_of_page || error->code == FL_ERROR_NONE ||
        error->code == FL_ERROR_INTERRUPTED || !web_outage_begins(seat->options.outage, monotonic_now_ns()))
        return;
    struct fl_error reported = *error;
    if (reported.field[0] == '\0')
        snprintf(reported.field, sizeof(reported.field), "%.*s", (int)sizeof(reported.field) - 1,
                 seat->options.server);
    cli_report(&reported);
}

static void report_return(const struct seat *seat)
{
    if (seat->options.outage && web_outage_ends(seat->options.outage) && !seat->options.job->talk.quiet)
        fprintf(stderr, "farlight: %s: the daemon is back\n", seat->options.server);
}

/* ---- the thread ---- */

static bool attach(struct seat *seat, struct fl_error *error)
{
    const struct fl_connect_options connect = {.server = seat->options.server,
                                               .key_file = seat->options.key_file,
                                               .name = "farlight-web",
                                               .can_h264 = true,
                                               .interrupt_fd = seat->end_fd,
                                               .lost_after_ms = seat->options.job->daemon.retries.lost_after_ms};
    seat->connection = fl_connect(&connect, error);
    if (seat->connection)
        seat->scene = fl_scene_attach(seat->connection, seat->options.scene, error);
    if (seat->scene)
        report_return(seat);
    return seat->scene != NULL;
}

static void serve(struct seat *seat, struct fl_error *error)
{
    while (!has_show(seat))
        if (!wait_for_work(seat))
            return;
    if (!attach(seat, error))
        return;
    do {
        uint64_t round_trip_ns;
        if (seat->idle_rounds % PING_ROUNDS == PING_ROUNDS - 1 &&
            !fl_ping(seat->connection, &round_trip_ns, error))
            return;
        /* Answers pings and notices a lost daemon even while no frame is wanted. Errors go first, since frames
         * of a view that is being refined would fill the queue. */
        if (!begin_requests(seat, error) || !fl_connection_wait(seat->connection, 0, error) ||
            !pass_errors(seat, error) || !pass_frames(seat, error))
            return;
    } while (wait_for_work(seat));
}

static void *work(void *argument)
{
    struct seat *seat = argument;
    struct fl_error error = {0}, ignored;
    serve(seat, &error);
    report_outage(seat, &error);
    if (!seat->connection) /* such errors name the daemon's address or the key file */
        error.field[0] = error.remedy[0] = '\0';
    if (error.code != FL_ERROR_NONE && error.code != FL_ERROR_INTERRUPTED)
        post(seat, web_describe_error(&error, error.code != FL_ERROR_ARGUMENT), NULL, 0, &ignored);
    edit_history_clear(&seat->history);
    free(seat->described);
    error_map_end(&seat->errors);
    fl_view_destroy(seat->view);
    fl_scene_destroy(seat->scene);
    fl_connection_destroy(seat->connection);
    pthread_mutex_lock(&seat->lock);
    seat->has_ended = true;
    pthread_mutex_unlock(&seat->lock);
    seat->options.changed(seat->options.user);
    return NULL;
}

/* ---- from outside ---- */

static void forget(struct seat *seat)
{
    web_queue_clear(&seat->queue);
    if (seat->wake_fd > 0)
        close(seat->wake_fd);
    if (seat->end_fd > 0)
        close(seat->end_fd);
    pthread_mutex_destroy(&seat->lock);
    free(seat);
}

struct seat *seat_create(const struct seat_options *options, struct fl_error *error)
{
    struct seat *seat = calloc(1, sizeof(*seat));
    if (!seat) {
        fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
        return NULL;
    }
    seat->options = *options;
    pthread_mutex_init(&seat->lock, NULL);
    seat->wake_fd = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    seat->end_fd = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    if (seat->wake_fd > 0 && seat->end_fd > 0 && pthread_create(&seat->thread, NULL, work, seat) == 0)
        return seat;
    fl_error_set(error, FL_ERROR_SYSTEM, "", "no thread or no descriptor: %s", strerror(errno));
    forget(seat);
    return NULL;
}

bool seat_request(struct seat *seat, const struct web_request *request)
{
    bool is_taken = true;
    pthread_mutex_lock(&seat->lock);
    if (request->kind == WEB_SHOWN)
        web_queue_shown(&seat->queue, request->shown);
    else
        is_taken = web_inbox_put(&seat->inbox, request, seat->options.may_edit);
    pthread_mutex_unlock(&seat->lock);
    if (is_taken)
        signal_event(seat->wake_fd);
    return is_taken;
}

struct parcel *seat_take(struct seat *seat, bool *has_ended)
{
    pthread_mutex_lock(&seat->lock);
    struct parcel *parcel = web_queue_take(&seat->queue);
    *has_ended = !seat->queue.first && seat->has_ended;
    pthread_mutex_unlock(&seat->lock);
    if (parcel && parcel->is_text)
        signal_event(seat->wake_fd); /* there is space for another one */
    return parcel;
}

void seat_destroy(struct seat *seat)
{
    if (!seat)
        return;
    signal_event(seat->end_fd);
    pthread_join(seat->thread, NULL);
    forget(seat);
}
