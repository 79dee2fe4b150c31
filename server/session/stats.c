/* SPDX-License-Identifier: MIT */
#include "session/stats.h"

#include "base/clock.h"
#include "protocol/codec.h"
#include "protocol/version.h"
#include "session/jobs.h"
#include "session/others.h"
#include "session/session.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Time after which the figures of a worker that does not answer are left out. */
#define OTHERS_NS UINT64_C(500000000)

#define CLIENTS_MAX 256
#define SCENES_MAX 256
#define JOBS_MAX 256
#define STAGES_MAX (STAGE_COUNT * 2)
#define NAME_BYTES 65

struct stats_storage {
    struct record_client_stat clients[CLIENTS_MAX];
    char client_names[CLIENTS_MAX][NAME_BYTES];
    struct record_scene_stat scenes[SCENES_MAX];
    struct record_stage_total stages[STAGES_MAX];
    struct record_job_stat jobs[JOBS_MAX];
};

static void fill_client(struct record_client_stat *stat, char name[NAME_BYTES], const struct session *session,
                        uint64_t now_ns)
{
    const struct connection *connection = session->connection;
    /* The client's own name is cut where a character begins, so that the text stays UTF-8. */
    int name_bytes = (int)strlen(session->name);
    int room = NAME_BYTES - 4 - (int)strlen(session->identity.name);
    while (name_bytes > room || (name_bytes && ((unsigned char)session->name[name_bytes] & 0xc0) == 0x80))
        name_bytes--;
    snprintf(name, NAME_BYTES, "%.*s (%s)", name_bytes, session->name, session->identity.name);
    *stat = (struct record_client_stat){
        .client = session->number,
        .connected_ns = now_ns - connection->connected_ns,
        .received_bytes = connection->received_bytes,
        .sent_bytes = connection->sent_bytes,
        .bulk_bytes = session->blobs.received_bytes,
        .requests = (uint32_t)session->requests.in_flight.count,
        .scenes = (uint32_t)session->scenes.count,
        .name = name,
    };
}

/* Whether the asker may know of the session; a read-only client knows of itself alone. */
static bool may_hear_of(const struct stats_asker *asker, const struct session *session)
{
    return !asker->read_only || session == asker->session;
}

static uint32_t fill_clients(struct stats_storage *storage, const struct stats_asker *asker)
{
    const struct hub *hub = asker->hub;
    uint64_t now_ns = clock_now_ns();
    uint32_t count = 0;
    size_t cursor = 0;
    void *value;
    while (count < CLIENTS_MAX && hashmap_next(&hub->sessions, &cursor, NULL, &value)) {
        const struct session *session = value;
        if (!session->introduced || !may_hear_of(asker, session))
            continue;
        fill_client(&storage->clients[count], storage->client_names[count], session, now_ns);
        count++;
    }
    return count;
}

/* Scenes that other owners keep have no name for this client, and are not listed for a read-only one. */
static uint32_t fill_scenes(struct stats_storage *storage, const struct stats_asker *asker,
                            const struct engine_stats *stats)
{
    uint32_t count = 0;
    for (uint32_t i = 0; i < stats->scene_count && count < SCENES_MAX; i++) {
        const struct engine_scene_stat *from = &stats->scenes[i];
        if (asker->read_only && !from->is_known)
            continue;
        storage->scenes[count++] = (struct record_scene_stat){
            .client = from->client,
            .scene = from->scene,
            .revision = from->revision,
            .nodes = from->nodes,
            .instances = from->instances,
            .triangles = from->triangles,
            .spheres = from->spheres,
            .host_bytes = from->host_bytes,
            .device_bytes = from->device_bytes,
            .name = from->is_known ? from->name : "",
        };
    }
    return count;
}

/* Whether the asker may know the scene's name: a client of the same user or key has the scene, or a scene of that
 * name is listed for this client anyway. */
static bool may_know_scene(const struct stats_asker *asker, const struct session *owner, const char *name,
                           const struct engine_stats *stats)
{
    bool may = owner->principal == asker->principal;
    for (uint32_t i = 0; !may && i < stats->scene_count; i++)
        may = stats->scenes[i].is_known && strcmp(stats->scenes[i].name, name) == 0;
    return may;
}

static void fill_job(struct record_job_stat *stat, const struct job *job, uint64_t now_ns)
{
    const uint64_t next = job->first_frame + job->frames_sent * job->frame_step;
    *stat = (struct record_job_stat){
        .client = job->session->number,
        .running_ns = now_ns - job->begun_ns,
        .frames_sent = job->frames_sent,
        .frames_total = job->view ? 0 : (job->last_frame - job->first_frame) / job->frame_step + 1,
        .frame = job->view ? 0 : (uint32_t)(next < job->last_frame ? next : job->last_frame),
        .kind = job->view ? PROTOCOL_JOB_VIEW : PROTOCOL_JOB_BATCH,
        .tracer = job->tracer,
        .owner = job->session->identity.name,
        .scene = session_scene_name(job->session, job->scene),
    };
}

static uint32_t fill_jobs(struct stats_storage *storage, const struct stats_asker *asker,
                          const struct engine_stats *stats)
{
    const uint64_t now_ns = clock_now_ns();
    uint32_t count = 0;
    size_t cursor = 0;
    void *value;
    while (hashmap_next(&asker->hub->sessions, &cursor, NULL, &value)) {
        const struct session *session = value;
        if (!may_hear_of(asker, session))
            continue;
        for (const struct job *job = session->jobs; job && count < JOBS_MAX; job = job->next) {
            struct record_job_stat *stat = &storage->jobs[count++];
            fill_job(stat, job, now_ns);
            if (!may_know_scene(asker, session, stat->scene, stats))
                stat->scene = "";
        }
    }
    return count;
}

static uint32_t fill_stages(struct stats_storage *storage, const struct engine_stats *stats)
{
    uint32_t count = 0;
    for (uint32_t stage = 0; stage < STAGE_COUNT; stage++) {
        for (uint32_t clock = 0; clock < 2; clock++) {
            if (!stats->stages[stage][clock].count)
                continue;
            storage->stages[count++] = (struct record_stage_total){
                .stage = (enum protocol_stage)stage,
                .clock = (enum protocol_clock)clock,
                .count = stats->stages[stage][clock].count,
                .total_ns = stats->stages[stage][clock].total_ns,
                .max_ns = stats->stages[stage][clock].max_ns,
            };
        }
    }
    return count;
}

static void fill(struct message_stats_reply *reply, const struct hub *hub, const struct engine_stats *stats)
{
    reply->uptime_ns = clock_now_ns() - hub->options.started_ns;
    reply->frames = stats->frames;
    reply->rays = stats->rays;
    reply->host_bytes = stats->host_bytes;
    reply->host_limit_bytes = hub->options.engine_limits.scene.host_bytes;
    reply->device_bytes = stats->device_bytes;
    reply->device_limit_bytes = stats->device_limit_bytes;
    reply->blob_bytes = blob_store_bytes(hub->blobs);
    reply->blobs = (uint32_t)blob_store_count(hub->blobs);
    reply->jobs = stats->jobs;
    reply->device_objects = stats->device_objects;
    reply->version = FARLIGHT_VERSION;
    reply->device = stats->device.name;
    reply->driver = stats->device.version;
}

/* Drops rows until the message fits: the totals of a very busy daemon matter more than its last scenes and jobs.
 */
static void make_fit(struct message *message)
{
    struct message_stats_reply *reply = &message->stats_reply;
    while ((reply->scenes_count || reply->running_count) &&
           message_payload_bytes(message) > CODEC_CONTROL_PAYLOAD_MAX_BYTES)
        --*(reply->scenes_count > reply->running_count ? &reply->scenes_count : &reply->running_count);
}

struct stats_storage *stats_fill(struct message *message, const struct stats_asker *asker,
                                 const struct engine_stats *stats)
{
    struct stats_storage *storage = calloc(1, sizeof(*storage));
    if (!storage)
        return NULL;
    message_init(message, MESSAGE_STATS_REPLY);
    struct message_stats_reply *reply = &message->stats_reply;
    fill(reply, asker->hub, stats);
    reply->clients = storage->clients;
    reply->clients_count = fill_clients(storage, asker);
    reply->scenes = storage->scenes;
    reply->scenes_count = fill_scenes(storage, asker, stats);
    reply->stages = storage->stages;
    reply->stages_count = fill_stages(storage, stats);
    reply->running = storage->jobs;
    reply->running_count = fill_jobs(storage, asker, stats);
    make_fit(message);
    return storage;
}

/* ---- of all workers ---------------------------------------------------------------------------------- */

static void add_stage(struct stats_storage *storage, struct message_stats_reply *reply,
                      const struct record_stage_total *more)
{
    uint32_t i = 0;
    while (i < reply->stages_count &&
           (storage->stages[i].stage != more->stage || storage->stages[i].clock != more->clock))
        i++;
    if (i == STAGES_MAX)
        return;
    struct record_stage_total *total = &storage->stages[i];
    if (i == reply->stages_count) {
        *total = *more;
        reply->stages_count++;
        return;
    }
    total->count += more->count;
    total->total_ns += more->total_ns;
    total->max_ns = more->max_ns > total->max_ns ? more->max_ns : total->max_ns;
}

static void add_other(struct stats_storage *storage, struct message_stats_reply *reply,
                      const struct message_stats_reply *other)
{
    reply->frames += other->frames;
    reply->rays += other->rays;
    reply->host_bytes += other->host_bytes;
    reply->device_bytes += other->device_bytes;
    reply->blob_bytes += other->blob_bytes;
    reply->blobs += other->blobs;
    reply->jobs += other->jobs;
    reply->device_objects += other->device_objects;
    for (uint32_t i = 0; i < other->clients_count && reply->clients_count < CLIENTS_MAX; i++)
        storage->clients[reply->clients_count++] = other->clients[i];
    for (uint32_t i = 0; i < other->scenes_count && reply->scenes_count < SCENES_MAX; i++)
        storage->scenes[reply->scenes_count++] = other->scenes[i];
    for (uint32_t i = 0; i < other->running_count && reply->running_count < JOBS_MAX; i++)
        storage->jobs[reply->running_count++] = other->running[i];
    for (uint32_t i = 0; i < other->stages_count; i++)
        add_stage(storage, reply, &other->stages[i]);
}

static void send_sum(struct session *session, struct request *request, const struct engine_stats *stats,
                     const struct others_answer *answers)
{
    struct error error = {0};
    struct message message;
    struct stats_storage *storage = stats_fill(&message,
                                               &(struct stats_asker){.hub = session->hub,
                                                                     .session = session,
                                                                     .principal = session->principal,
                                                                     .read_only = session->identity.read_only},
                                               stats);
    if (!storage) {
        error_set(&error, ERROR_OUT_OF_MEMORY, "stats", "no memory");
        request_answer_error(session, request, &error);
        return;
    }
    for (const struct others_answer *answer = answers; answer; answer = answer->next)
        add_other(storage, &message.stats_reply, &answer->message.stats_reply);
    make_fit(&message);
    if (session_send(session, request->id, 0, &message)) {
        request_answered(session, request);
    } else {
        error_set(&error, ERROR_INTERNAL, "stats", "the numbers cannot be sent");
        request_answer_error(session, request, &error);
    }
    free(storage);
}

static void on_others(void *context, struct session *session, struct request *request,
                      const struct others_answer *answers)
{
    if (session)
        send_sum(session, request, context, answers);
    engine_stats_destroy(context);
}

void stats_answer(struct session *session, struct request *request, struct engine_stats *stats)
{
    others_ask(session->hub->others, CHANNEL_STATS, session, request, OTHERS_NS, on_others, stats);
}
