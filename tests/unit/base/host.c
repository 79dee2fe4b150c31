/* SPDX-License-Identifier: MIT */
/* Threads of processes by their names. */
#include "base/host.h"
#include "tests/harness/test.h"

#include <pthread.h>
#include <stdatomic.h>
#include <time.h>
#include <unistd.h>

#define NAME "unit:spool$"

static atomic_bool works;
static int ends[2];

static void *work_and_wait(void *unused)
{
    char byte;
    (void)unused;
    while (works)
        ;
    assert_int_equal(read(ends[0], &byte, 1), 1);
    return NULL;
}

/* A thread reaches its wait some time after it was let go. */
static bool sleeps_soon(const int *threads, size_t count)
{
    const struct timespec step = {.tv_nsec = 1000000};
    for (int i = 0; i < 60000; i++) {
        if (host_threads_sleep(threads, count))
            return true;
        (void)nanosleep(&step, NULL);
    }
    return false;
}

TEST(threads_are_found_by_their_names_and_sleep_where_they_wait)
{
    pthread_t all[2];
    int found[3];
    works = true;
    assert_int_equal(pipe(ends), 0);
    assert_int_equal(host_threads_find(NAME, found, 3), 0);
    for (int i = 0; i < 2; i++) {
        assert_int_equal(pthread_create(&all[i], NULL, work_and_wait, NULL), 0);
        assert_int_equal(pthread_setname_np(all[i], i ? NAME "1" : NAME "0"), 0);
    }
    assert_int_equal(host_threads_find(NAME, found, 1), 1);
    assert_int_equal(host_threads_find(NAME, found, 3), 2);
    assert_false(host_threads_sleep(found, 2));
    works = false;
    assert_true(sleeps_soon(found, 2));
    assert_int_equal(write(ends[1], "ab", 2), 2);
    for (int i = 0; i < 2; i++)
        assert_int_equal(pthread_join(all[i], NULL), 0);
    /* A thread can be joined some time before it leaves the list of the process. */
    assert_true(sleeps_soon(found, 2));
    close(ends[0]);
    close(ends[1]);
}
