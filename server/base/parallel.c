/* SPDX-License-Identifier: MIT */
/* Threads of a parallel loop. */
#include "base/parallel.h"

#include "base/progress.h"

#include <pthread.h>
#include <sched.h>
#include <stdatomic.h>
#include <unistd.h>

#define THREADS_MAX 64u

struct parallel {
    void (*work)(void *context, uint32_t i);
    void *context;
    uint32_t count;
    atomic_uint next;
};

static void *work_off(void *argument)
{
    struct parallel *parallel = argument;
    for (;;) {
        uint32_t i = atomic_fetch_add(&parallel->next, 1);
        if (i >= parallel->count)
            return NULL;
        parallel->work(parallel->context, i);
        progress_report();
    }
}

void parallel_run(unsigned threads, uint32_t count, void (*work)(void *context, uint32_t i), void *context)
{
    struct parallel parallel = {.work = work, .context = context, .count = count};
    pthread_t helpers[THREADS_MAX];
    unsigned wanted = threads < THREADS_MAX ? threads : THREADS_MAX;
    unsigned started = 0;
    if (wanted > count)
        wanted = count;
    while (started + 1 < wanted && pthread_create(&helpers[started], NULL, work_off, &parallel) == 0)
        started++;
    work_off(&parallel);
    for (unsigned i = 0; i < started; i++)
        pthread_join(helpers[i], NULL);
}

unsigned parallel_processors(void)
{
    cpu_set_t set;
    if (sched_getaffinity(0, sizeof(set), &set) != 0) /* there are more processors than a set holds */
        return (unsigned)sysconf(_SC_NPROCESSORS_ONLN);
    return (unsigned)CPU_COUNT(&set);
}
