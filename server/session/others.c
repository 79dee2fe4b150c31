/* SPDX-License-Identifier: MIT */
#include "session/others.h"

#include "session/scenes.h"
#include "session/session.h"
#include "session/stats.h"

#include <stdlib.h>
#include <string.h>

#define NOBODY UINT64_MAX /* a principal without scenes, which may attach to shared ones only */

struct waiter {
    struct waiter *next;
    uint64_t session;
    uint32_t request;
    others_done_fn *done;
    void *context;
};

/* A question from clients of this worker to the other workers. */
struct question {
    struct others *others;
    uint32_t number;
    enum channel_what what;
    uint32_t is_read_only;
    struct waiter *waiters;
    struct others_answer *answers, **end;
    uint32_t count, awaited; /* answers so far, and answers expected; UINT32_MAX: not known yet */
    struct loop_timer timer;
};

struct others {
    struct hub *hub;
    struct channel *front;    /* NULL: there are no other workers */
    struct hashmap questions; /* struct question *, by number */
    uint32_t last_question;
    struct hashmap asked; /* struct channel_question *, of other workers, by the number of the engine's request */
    uint32_t last_asked;
};

/* ---- questions --------------------------------------------------------------------------------------- */

static void answer_waiter(struct hub *hub, struct waiter *waiter, const struct others_answer *answers)
{
    struct session *session = hashmap_get(&hub->sessions, waiter->session);
    struct request *request = session ? request_find(session, waiter->request) : NULL;
    waiter->done(waiter->context, request ? session : NULL, request, answers);
    free(waiter);
}

static void finish(struct question *question)
{
    struct others *others = question->others;
    hashmap_remove(&others->questions, question->number);
    loop_timer_stop(others->hub->loop, &question->timer);
    for (struct waiter *waiter; (waiter = question->waiters);) {
        question->waiters = waiter->next;
        answer_waiter(others->hub, waiter, question->answers);
    }
    for (struct others_answer *answer; (answer = question->answers);) {
        question->answers = answer->next;
        free(answer);
    }
    free(question);
}

static void on_timer(void *context)
{
    finish(context);
}

/* Pending question that answers this one too. Questions for statistics are shared, so that many of them cost other
 * users no more than one. Questions for scenes are not: a scene may have been opened since. */
static struct question *find_alike(const struct others *others, enum channel_what what, uint32_t is_read_only)
{
    size_t cursor = 0;
    void *value;
    while (what == CHANNEL_STATS && hashmap_next(&others->questions, &cursor, NULL, &value)) {
        struct question *question = value;
        if (question->what == what && question->is_read_only == is_read_only)
            return question;
    }
    return NULL;
}

/* Asks the other workers. NULL: there are none, or no memory. */
static struct question *ask(struct others *others, enum channel_what what, uint32_t is_read_only,
                            uint64_t timeout_ns)
{
    struct question *question = others->front ? calloc(1, sizeof(*question)) : NULL;
    const struct channel_question packet = {
        .number = ++others->last_question, .what = what, .is_read_only = is_read_only};
    if (!question || !hashmap_put(&others->questions, packet.number, question)) {
        free(question);
        return NULL;
    }
    *question = (struct question){.others = others,
                                  .number = packet.number,
                                  .what = what,
                                  .is_read_only = is_read_only,
                                  .end = &question->answers,
                                  .awaited = UINT32_MAX,
                                  .timer = {.call = on_timer, .context = question}};
    /* A packet that cannot be sent is like one without an answer: the timeout ends the question. */
    channel_send(others->front, CHANNEL_ASK, &packet, sizeof(packet), NULL);
    loop_timer_start(others->hub->loop, &question->timer, timeout_ns);
    return question;
}

void others_ask(struct others *others, enum channel_what what, struct session *session, struct request *request,
                uint64_t timeout_ns, others_done_fn *done, void *context)
{
    const bool is_read_only = session->identity.read_only;
    struct waiter *waiter = malloc(sizeof(*waiter));
    struct question *question = waiter ? find_alike(others, what, is_read_only) : NULL;
    if (waiter && !question)
        question = ask(others, what, is_read_only, timeout_ns);
    if (!question) {
        free(waiter);
        done(context, session, request, NULL);
        return;
    }
    *waiter = (struct waiter){question->waiters, session->number, request->id, done, context};
    question->waiters = waiter;
}

static void take_asked(struct others *others, const void *payload, size_t bytes)
{
    struct channel_asked asked;
    if (bytes != sizeof(asked))
        return;
    memcpy(&asked, payload, bytes);
    struct question *question = hashmap_get(&others->questions, asked.number);
    if (!question)
        return; /* the question has ended */
    question->awaited = asked.count;
    if (question->count == question->awaited)
        finish(question);
}

static enum message_type answer_type(enum channel_what what)
{
    return what == CHANNEL_STATS ? MESSAGE_STATS_REPLY : MESSAGE_SCENE_LIST_REPLY;
}

static void take_answer(struct others *others, const uint8_t *payload, size_t bytes)
{
    struct channel_answer head;
    if (bytes < sizeof(head))
        return;
    memcpy(&head, payload, sizeof(head));
    struct question *question = hashmap_get(&others->questions, head.number);
    struct others_answer *answer = question ? calloc(1, sizeof(*answer)) : NULL;
    if (!answer)
        return;
    struct scratch scratch;
    scratch_init(&scratch, answer->scratch, sizeof(answer->scratch));
    answer->worker = head.worker;
    if (message_decode(&answer->message, (uint16_t)answer_type(question->what), payload + sizeof(head),
                       bytes - sizeof(head), &scratch, NULL)) {
        *question->end = answer;
        question->end = &answer->next;
    } else {
        free(answer); /* the worker had no answer */
    }
    if (++question->count == question->awaited)
        finish(question);
}

/* ---- answers ----------------------------------------------------------------------------------------- */

static void send_answer(struct others *others, const struct channel_question *question,
                        const struct message *message)
{
    uint8_t *packet = malloc(sizeof(struct channel_answer) + CODEC_CONTROL_PAYLOAD_MAX_BYTES);
    if (!packet)
        return; /* the timeout of the asking worker handles this */
    const struct channel_answer head = {.asker = question->asker, .number = question->number};
    struct writer writer;
    memcpy(packet, &head, sizeof(head));
    writer_init(&writer, packet + sizeof(head), CODEC_CONTROL_PAYLOAD_MAX_BYTES);
    const size_t bytes = message && message_encode(&writer, message) ? writer.used_bytes : 0;
    channel_send(others->front, CHANNEL_ANSWER, packet, sizeof(head) + bytes, NULL);
    free(packet);
}

static void take_question(struct others *others, const void *payload, size_t bytes)
{
    struct channel_question *question = bytes == sizeof(*question) ? malloc(bytes) : NULL;
    if (!question)
        return;
    memcpy(question, payload, bytes);
    others->last_asked += others->last_asked == UINT32_MAX ? 2 : 1; /* 0 is no request */
    struct engine_command *command =
        hub_command(question->what == CHANNEL_STATS ? ENGINE_STATS : ENGINE_SCENE_LIST, 0, others->last_asked);
    if (!command || !hashmap_put(&others->asked, others->last_asked, question)) {
        free(command);
        send_answer(others, question, NULL);
        free(question);
        return;
    }
    command->principal = NOBODY;
    hub_submit(others->hub, command);
}

void others_answer(struct others *others, const struct engine_event *event)
{
    struct channel_question *question = hashmap_remove(&others->asked, event->request);
    if (!question)
        return;
    struct message message;
    if (event->kind == ENGINE_STATS_READY && event->stats) {
        struct stats_storage *storage =
            stats_fill(&message,
                       &(struct stats_asker){
                           .hub = others->hub, .principal = NOBODY, .read_only = question->is_read_only != 0},
                       event->stats);
        send_answer(others, question, storage ? &message : NULL);
        free(storage);
    } else if (event->kind == ENGINE_SCENES_LISTED && event->list) {
        struct record_scene_entry entries[SCENES_LIST_MAX];
        scenes_fill_list(&message, entries, event->list);
        send_answer(others, question, &message);
    } else {
        send_answer(others, question, NULL);
    }
    free(question);
}

/* ---- life -------------------------------------------------------------------------------------------- */

void others_received(struct others *others, enum channel_kind kind, const void *payload, size_t bytes)
{
    if (kind == CHANNEL_ASK)
        take_question(others, payload, bytes);
    else if (kind == CHANNEL_ASKED)
        take_asked(others, payload, bytes);
    else if (kind == CHANNEL_ANSWER)
        take_answer(others, payload, bytes);
}

bool others_hand_over(struct others *others, const struct connection *connection, const struct handover *handover,
                      const uint8_t *message, size_t message_bytes, struct error *error)
{
    return others->front && handover_send(others->front, connection, handover, message, message_bytes, error);
}

struct others *others_create(struct hub *hub)
{
    struct others *others = calloc(1, sizeof(*others));
    if (others)
        others->hub = hub;
    return others;
}

void others_reach(struct others *others, struct channel *front)
{
    others->front = front;
}

void others_destroy(struct others *others)
{
    if (!others)
        return;
    size_t cursor = 0;
    void *value;
    while (hashmap_next(&others->questions, &cursor, NULL, &value)) {
        finish(value);
        cursor = 0;
    }
    while (hashmap_next(&others->asked, &cursor, NULL, &value))
        free(value);
    hashmap_finish(&others->questions);
    hashmap_finish(&others->asked);
    free(others);
}
