/* SPDX-License-Identifier: MIT */
#include "engine/keep.h"

#include "base/clock.h"
#include "base/host.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

struct order {
    struct order *next;
    const struct scene *scene; /* NULL: one of this name is to be forgotten */
    uint64_t principal;
    enum sharing sharing;
    char name[SCENE_NAME_MAX + 1];
};

struct keep {
    const struct engine_keeper *keeper;
    void (*on_change)(void *context);
    void *context;
    atomic_bool abandoned;
    pthread_mutex_t lock; /* guards the members below */
    pthread_cond_t changed;
    struct order *first, **end;
    bool was_read; /* whether the caller must still be notified */
    uint64_t read_ns;
    size_t left; /* orders not yet carried out */
    bool closed;
    pthread_t thread;
    bool started; /* the owner's */
};

static void carry_out(struct keep *keep, const struct order *order)
{
    const struct engine_keeper *keeper = keep->keeper;
    if (!order->scene) {
        keeper->forget(keeper->context, order->principal, order->name);
        return;
    }
    uint64_t start_ns = clock_now_ns();
    void *record = keeper->read(keeper->context, order->scene, order->principal, order->sharing, &keep->abandoned);
    pthread_mutex_lock(&keep->lock);
    keep->was_read = true;
    keep->read_ns = clock_now_ns() - start_ns;
    pthread_mutex_unlock(&keep->lock);
    keep->on_change(keep->context);
    if (record)
        keeper->write(keeper->context, record, &keep->abandoned);
}

static struct order *take_first(struct keep *keep)
{
    struct order *order = keep->first;
    if (!order)
        return NULL;
    keep->first = order->next;
    if (!keep->first)
        keep->end = &keep->first;
    return order;
}

static void *run_thread(void *context)
{
    struct keep *keep = context;
    pthread_setname_np(pthread_self(), "keep");
    host_thread_lower_priority();
    pthread_mutex_lock(&keep->lock);
    for (struct order *order; (order = take_first(keep)) || !keep->closed;) {
        if (!order) {
            pthread_cond_wait(&keep->changed, &keep->lock);
            continue;
        }
        pthread_mutex_unlock(&keep->lock);
        if (!atomic_load(&keep->abandoned))
            carry_out(keep, order);
        free(order);
        pthread_mutex_lock(&keep->lock);
        keep->left--;
        pthread_cond_broadcast(&keep->changed);
        pthread_mutex_unlock(&keep->lock);
        keep->on_change(keep->context);
        pthread_mutex_lock(&keep->lock);
    }
    pthread_mutex_unlock(&keep->lock);
    return NULL;
}

struct keep *keep_create(const struct engine_keeper *keeper, void (*on_change)(void *context), void *context,
                         struct error *error)
{
    struct keep *keep = calloc(1, sizeof(*keep));
    if (!keep) {
        error_set(error, ERROR_OUT_OF_MEMORY, "engine", "no memory");
        return NULL;
    }
    keep->keeper = keeper;
    keep->on_change = on_change;
    keep->context = context;
    keep->end = &keep->first;
    pthread_mutex_init(&keep->lock, NULL);
    pthread_cond_init(&keep->changed, NULL);
    keep->started = pthread_create(&keep->thread, NULL, run_thread, keep) == 0;
    if (keep->started)
        return keep;
    error_set(error, ERROR_OUT_OF_MEMORY, "engine", "could not start a thread");
    keep_destroy(keep, 0);
    return NULL;
}

static void wait_for_all(struct keep *keep, uint64_t within_ns)
{
    uint64_t end_ns = clock_now_ns() + within_ns;
    while (keep->left && clock_wait(&keep->changed, &keep->lock, end_ns))
        continue;
}

void keep_destroy(struct keep *keep, uint64_t within_ns)
{
    if (!keep)
        return;
    pthread_mutex_lock(&keep->lock);
    keep->closed = true;
    pthread_cond_broadcast(&keep->changed);
    if (keep->started)
        wait_for_all(keep, within_ns);
    pthread_mutex_unlock(&keep->lock);
    atomic_store(&keep->abandoned, true);
    if (keep->started)
        pthread_join(keep->thread, NULL);
    pthread_cond_destroy(&keep->changed);
    pthread_mutex_destroy(&keep->lock);
    free(keep);
}

static bool submit(struct keep *keep, const struct order *what)
{
    struct order *order = malloc(sizeof(*order));
    if (!order)
        return false;
    *order = *what;
    pthread_mutex_lock(&keep->lock);
    *keep->end = order;
    keep->end = &order->next;
    keep->left++;
    pthread_cond_broadcast(&keep->changed);
    pthread_mutex_unlock(&keep->lock);
    return true;
}

bool keep_save(struct keep *keep, const struct scene *scene, uint64_t principal, enum sharing sharing)
{
    return submit(keep, &(struct order){.scene = scene, .principal = principal, .sharing = sharing});
}

bool keep_forget(struct keep *keep, uint64_t principal, const char *name)
{
    struct order order = {.principal = principal};
    memcpy(order.name, name, strnlen(name, SCENE_NAME_MAX));
    return submit(keep, &order);
}

bool keep_was_read(struct keep *keep, uint64_t *read_ns)
{
    pthread_mutex_lock(&keep->lock);
    bool was_read = keep->was_read;
    *read_ns = keep->read_ns;
    keep->was_read = false;
    pthread_mutex_unlock(&keep->lock);
    return was_read;
}

bool keep_is_idle(struct keep *keep)
{
    pthread_mutex_lock(&keep->lock);
    bool idle = !keep->left;
    pthread_mutex_unlock(&keep->lock);
    return idle;
}
