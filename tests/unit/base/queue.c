/* SPDX-License-Identifier: MIT */
/* base/queue: bounded, between threads. */
#include <stddef.h>
#include <stdint.h>

#include "base/clock.h"
#include "base/queue.h"
#include "tests/harness/test.h"

#include <poll.h>
#include <pthread.h>
#include <stdatomic.h>

#define PER_THREAD 20000
#define THREADS 3

static bool is_readable(const struct queue *queue)
{
    struct pollfd fd = {.fd = queue_event_fd(queue), .events = POLLIN};
    return poll(&fd, 1, 0) == 1;
}

TEST(items_come_out_in_order_and_no_more_than_fit_go_in)
{
    int items[3];
    struct queue *queue = queue_create(2, false);
    assert_non_null(queue);
    assert_true(queue_try_push(queue, &items[0]));
    assert_true(queue_try_push(queue, &items[1]));
    assert_false(queue_try_push(queue, &items[2]));
    assert_int_equal(queue_length(queue), 2);
    assert_ptr_equal(queue_try_pop(queue), &items[0]);
    assert_true(queue_try_push(queue, &items[2]));
    assert_ptr_equal(queue_try_pop(queue), &items[1]);
    assert_ptr_equal(queue_try_pop(queue), &items[2]);
    assert_null(queue_try_pop(queue));
    assert_int_equal(queue_event_fd(queue), -1);
    queue_destroy(queue, NULL);
}

TEST(the_event_descriptor_is_readable_exactly_while_something_waits)
{
    int item;
    struct queue *queue = queue_create(4, true);
    assert_non_null(queue);
    assert_false(is_readable(queue));
    for (int round = 0; round < 3; round++) {
        queue_try_push(queue, &item);
        queue_try_push(queue, &item);
        assert_true(is_readable(queue));
        queue_try_pop(queue);
        assert_true(is_readable(queue));
        queue_try_pop(queue);
        assert_false(is_readable(queue));
    }
    queue_destroy(queue, NULL);
}

TEST(a_pop_from_an_empty_queue_waits_until_its_timeout)
{
    struct queue *queue = queue_create(1, false);
    uint64_t before_ns = clock_now_ns();
    assert_null(queue_pop(queue, 30000000));
    uint64_t waited_ns = clock_now_ns() - before_ns;
    assert_true(waited_ns >= 30000000);
    queue_destroy(queue, NULL);
}

TEST(a_closed_queue_takes_nothing_and_gives_what_it_has)
{
    int item;
    struct queue *queue = queue_create(2, false);
    queue_try_push(queue, &item);
    queue_close(queue);
    assert_false(queue_push(queue, &item));
    assert_false(queue_try_push(queue, &item));
    assert_ptr_equal(queue_pop(queue, UINT64_MAX), &item);
    assert_null(queue_pop(queue, UINT64_MAX));
    queue_destroy(queue, NULL);
}

static void count_drop(void *item)
{
    ++*(int *)item;
}

TEST(what_is_left_is_dropped_with_the_queue)
{
    int dropped = 0;
    struct queue *queue = queue_create(3, true);
    queue_try_push(queue, &dropped);
    queue_try_push(queue, &dropped);
    queue_destroy(queue, count_drop);
    assert_int_equal(dropped, 2);
    queue_destroy(NULL, count_drop);
}

struct shared {
    struct queue *queue;
    unsigned char items[THREADS * PER_THREAD];
    atomic_int seen[THREADS * PER_THREAD];
    atomic_int next_producer;
};

static void *produce(void *context)
{
    struct shared *shared = context;
    int base = atomic_fetch_add(&shared->next_producer, 1) * PER_THREAD;
    for (int i = 0; i < PER_THREAD; i++)
        queue_push(shared->queue, &shared->items[base + i]);
    return NULL;
}

static void *consume(void *context)
{
    struct shared *shared = context;
    unsigned char *item;
    while ((item = queue_pop(shared->queue, UINT64_MAX)))
        atomic_fetch_add(&shared->seen[item - shared->items], 1);
    return NULL;
}

TEST(many_threads_get_every_item_exactly_once)
{
    static struct shared shared;
    shared.queue = queue_create(8, true);
    pthread_t producers[THREADS], consumers[THREADS];
    for (int i = 0; i < THREADS; i++) {
        pthread_create(&producers[i], NULL, produce, &shared);
        pthread_create(&consumers[i], NULL, consume, &shared);
    }
    for (int i = 0; i < THREADS; i++)
        pthread_join(producers[i], NULL);
    queue_close(shared.queue);
    for (int i = 0; i < THREADS; i++)
        pthread_join(consumers[i], NULL);
    for (int i = 0; i < THREADS * PER_THREAD; i++)
        assert_int_equal(atomic_load(&shared.seen[i]), 1);
    assert_false(is_readable(shared.queue));
    queue_destroy(shared.queue, NULL);
}
