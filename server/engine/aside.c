/* SPDX-License-Identifier: MIT */
#include "engine/aside.h"

#include "base/clock.h"
#include "base/host.h"
#include "base/progress.h"
#include "engine/shot.h"

#include <pthread.h>
#include <stdlib.h>

#define THREADS 3

struct list {
    struct aside_commit *first, **end;
};

struct aside {
    void (*on_done)(void *context);
    void *context;
    pthread_mutex_t lock; /* guards the members below */
    pthread_cond_t changed;
    struct list waiting, done;
    struct aside_commit *running[THREADS];
    bool closed;
    unsigned numbered; /* threads that know their place in `running` */
    pthread_t threads[THREADS];
    unsigned started; /* threads; the creator's */
};

static void append(struct list *list, struct aside_commit *commit)
{
    commit->next = NULL;
    *list->end = commit;
    list->end = &commit->next;
}

/* Removes the task to which `place` points. */
static struct aside_commit *take(struct list *list, struct aside_commit **place)
{
    struct aside_commit *commit = *place;
    if (!commit)
        return NULL;
    *place = commit->next;
    if (!*place)
        list->end = place;
    return commit;
}

static bool is_busy(const struct aside *aside, uint64_t client)
{
    for (unsigned i = 0; i < THREADS; i++) {
        if (aside->running[i] && aside->running[i]->command->client == client)
            return true;
    }
    return false;
}

/* First task of a client that has none running; NULL: none. */
static struct aside_commit *next_locked(struct aside *aside)
{
    struct aside_commit **place = &aside->waiting.first;
    while (*place && is_busy(aside, (*place)->command->client))
        place = &(*place)->next;
    return take(&aside->waiting, place);
}

static void carry_out(struct aside_commit *commit)
{
    struct engine_command *command = commit->command;
    if (command->kind == ENGINE_JOB_START) {
        struct error found_again = {0}; /* the job reports it */
        (void)shot_check(&command->job, commit->scene, &commit->bounds, &found_again);
        return;
    }
    uint64_t start_ns = clock_now_ns();
    commit->applied = scene_commit_unless(commit->scene, command->edits, command->edit_count, &commit->abandoned,
                                          &commit->error);
    /* Releasing replaced or refused data takes time too, so it happens on this thread. */
    engine_command_release_edits(command);
    commit->start_ns = start_ns;
    commit->duration_ns = clock_now_ns() - start_ns;
    progress_report();
}

static void *run_thread(void *context)
{
    struct aside *aside = context;
    pthread_setname_np(pthread_self(), "commit");
    host_thread_lower_priority();
    pthread_mutex_lock(&aside->lock);
    const unsigned self = aside->numbered++;
    while (!aside->closed) {
        struct aside_commit *commit = next_locked(aside);
        if (!commit) {
            pthread_cond_wait(&aside->changed, &aside->lock);
            continue;
        }
        aside->running[self] = commit;
        pthread_mutex_unlock(&aside->lock);
        carry_out(commit);
        pthread_mutex_lock(&aside->lock);
        aside->running[self] = NULL;
        append(&aside->done, commit);
        pthread_cond_broadcast(&aside->changed); /* its client may have another one */
        pthread_mutex_unlock(&aside->lock);
        aside->on_done(aside->context);
        pthread_mutex_lock(&aside->lock);
    }
    pthread_mutex_unlock(&aside->lock);
    return NULL;
}

struct aside *aside_create(void (*on_done)(void *context), void *context, struct error *error)
{
    struct aside *aside = calloc(1, sizeof(*aside));
    if (!aside) {
        error_set(error, ERROR_OUT_OF_MEMORY, "engine", "no memory");
        return NULL;
    }
    aside->on_done = on_done;
    aside->context = context;
    aside->waiting.end = &aside->waiting.first;
    aside->done.end = &aside->done.first;
    pthread_mutex_init(&aside->lock, NULL);
    pthread_cond_init(&aside->changed, NULL);
    while (aside->started < THREADS &&
           pthread_create(&aside->threads[aside->started], NULL, run_thread, aside) == 0)
        aside->started++;
    if (aside->started == THREADS)
        return aside;
    error_set(error, ERROR_OUT_OF_MEMORY, "engine", "could start only %u of %u threads", aside->started, THREADS);
    aside_destroy(aside);
    return NULL;
}

void aside_commit_destroy(struct aside_commit *commit)
{
    if (!commit)
        return;
    engine_command_destroy(commit->command);
    free(commit);
}

static void drop_all(struct list *list)
{
    for (struct aside_commit *commit; (commit = take(list, &list->first));)
        aside_commit_destroy(commit);
}

void aside_destroy(struct aside *aside)
{
    if (!aside)
        return;
    pthread_mutex_lock(&aside->lock);
    aside->closed = true;
    for (unsigned i = 0; i < THREADS; i++) {
        if (aside->running[i])
            atomic_store(&aside->running[i]->abandoned, true);
    }
    pthread_cond_broadcast(&aside->changed);
    pthread_mutex_unlock(&aside->lock);
    for (unsigned i = 0; i < aside->started; i++)
        pthread_join(aside->threads[i], NULL);
    drop_all(&aside->waiting);
    drop_all(&aside->done);
    pthread_cond_destroy(&aside->changed);
    pthread_mutex_destroy(&aside->lock);
    free(aside);
}

void aside_submit(struct aside *aside, struct aside_commit *commit)
{
    pthread_mutex_lock(&aside->lock);
    append(&aside->waiting, commit);
    pthread_cond_signal(&aside->changed);
    pthread_mutex_unlock(&aside->lock);
}

struct aside_commit *aside_take_done(struct aside *aside)
{
    pthread_mutex_lock(&aside->lock);
    struct aside_commit *commit = take(&aside->done, &aside->done.first);
    pthread_mutex_unlock(&aside->lock);
    return commit;
}
