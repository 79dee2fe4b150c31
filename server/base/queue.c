/* SPDX-License-Identifier: MIT */
/* Bounded queue with a lock and an eventfd. */
#include "base/queue.h"

#include "base/clock.h"

#include <pthread.h>
#include <stdlib.h>
#include <sys/eventfd.h>
#include <unistd.h>

struct queue {
    pthread_mutex_t mutex;
    pthread_cond_t not_empty, not_full;
    int event_fd; /* -1: none */
    bool closed;
    size_t capacity, length, first;
    void *items[];
};

struct queue *queue_create(size_t capacity, bool event_fd)
{
    if (!capacity || capacity > (SIZE_MAX - sizeof(struct queue)) / sizeof(void *))
        return NULL;
    struct queue *queue = calloc(1, sizeof(*queue) + capacity * sizeof(void *));
    if (!queue)
        return NULL;
    queue->capacity = capacity;
    queue->event_fd = -1;
    if (event_fd) {
        queue->event_fd = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
        if (queue->event_fd < 0) {
            free(queue);
            return NULL;
        }
    }
    pthread_mutex_init(&queue->mutex, NULL);
    pthread_cond_init(&queue->not_empty, NULL);
    pthread_cond_init(&queue->not_full, NULL);
    return queue;
}

void queue_destroy(struct queue *queue, void (*drop)(void *item))
{
    if (!queue)
        return;
    for (void *item; (item = queue_try_pop(queue));) {
        if (drop)
            drop(item);
    }
    pthread_cond_destroy(&queue->not_full);
    pthread_cond_destroy(&queue->not_empty);
    pthread_mutex_destroy(&queue->mutex);
    if (queue->event_fd >= 0)
        close(queue->event_fd);
    free(queue);
}

/* The eventfd is readable exactly while the queue holds something: it is written when the queue becomes
 * non-empty and read when it becomes empty, both under the lock. */
static void raise_event(struct queue *queue)
{
    uint64_t one = 1;
    ssize_t written = queue->event_fd >= 0 ? write(queue->event_fd, &one, sizeof(one)) : 0;
    (void)written; /* cannot fail: the counter is 0 */
}

static void clear_event(struct queue *queue)
{
    uint64_t value;
    ssize_t got = queue->event_fd >= 0 ? read(queue->event_fd, &value, sizeof(value)) : 0;
    (void)got; /* cannot fail: the counter is 1 */
}

static void append_locked(struct queue *queue, void *item)
{
    queue->items[(queue->first + queue->length) % queue->capacity] = item;
    if (queue->length++ == 0)
        raise_event(queue);
    pthread_cond_signal(&queue->not_empty);
}

static void *take_locked(struct queue *queue)
{
    if (!queue->length)
        return NULL;
    void *item = queue->items[queue->first];
    queue->first = (queue->first + 1) % queue->capacity;
    if (--queue->length == 0)
        clear_event(queue);
    pthread_cond_signal(&queue->not_full);
    return item;
}

bool queue_try_push(struct queue *queue, void *item)
{
    pthread_mutex_lock(&queue->mutex);
    bool fits = !queue->closed && queue->length < queue->capacity;
    if (fits)
        append_locked(queue, item);
    pthread_mutex_unlock(&queue->mutex);
    return fits;
}

bool queue_push(struct queue *queue, void *item)
{
    pthread_mutex_lock(&queue->mutex);
    while (!queue->closed && queue->length == queue->capacity)
        pthread_cond_wait(&queue->not_full, &queue->mutex);
    bool open = !queue->closed;
    if (open)
        append_locked(queue, item);
    pthread_mutex_unlock(&queue->mutex);
    return open;
}

void *queue_try_pop(struct queue *queue)
{
    pthread_mutex_lock(&queue->mutex);
    void *item = take_locked(queue);
    pthread_mutex_unlock(&queue->mutex);
    return item;
}

void *queue_pop(struct queue *queue, uint64_t timeout_ns)
{
    uint64_t now_ns = clock_now_ns(),
             until_ns = timeout_ns < UINT64_MAX - now_ns ? now_ns + timeout_ns : UINT64_MAX;
    bool in_time = true;
    pthread_mutex_lock(&queue->mutex);
    while (!queue->length && !queue->closed && in_time)
        in_time = clock_wait(&queue->not_empty, &queue->mutex, until_ns);
    void *item = take_locked(queue);
    pthread_mutex_unlock(&queue->mutex);
    return item;
}

void queue_close(struct queue *queue)
{
    pthread_mutex_lock(&queue->mutex);
    queue->closed = true;
    pthread_cond_broadcast(&queue->not_empty);
    pthread_cond_broadcast(&queue->not_full);
    pthread_mutex_unlock(&queue->mutex);
}

size_t queue_length(struct queue *queue)
{
    pthread_mutex_lock(&queue->mutex);
    size_t length = queue->length;
    pthread_mutex_unlock(&queue->mutex);
    return length;
}

int queue_event_fd(const struct queue *queue)
{
    return queue->event_fd;
}
