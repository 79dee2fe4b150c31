/* SPDX-License-Identifier: MIT */
/* Threads that compile announced programs. */
#include "gpu/program_ahead.h"

#include "base/clock.h"
#include "base/host.h"
#include "base/parallel.h"
#include "gpu/egl.h"
#include "gpu/program_rehearse.h"

#include <epoxy/gl.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* Maximum of threads. A compiler is a single thread; more would need more memory and gain little: a frame has a
 * few large programs. */
#define THREADS_MAX 2
/* Programs given at once to a driver that compiles several together. */
#define TOGETHER_MAX 32
/* Names of Mesa's threads that write compiled code to the disk, with the lowest priority: some milliseconds,
 * and more on a busy machine. The wait lasts until they sleep, and no longer than this; the second limit is for
 * when none is found. */
#define WRITERS_NAME ":disk$"
#define WRITERS_MAX 8
#define WRITTEN_NS_MAX UINT64_C(100000000)
#define WRITTEN_NS UINT64_C(8000000)
#define WRITTEN_STEP_NS 500000

enum state { WAITING, BEGUN, DONE };

struct item {
    struct item *next; /* in the order of the announcements, which is that of their need */
    struct gpu_build build;
    struct gpu_binary binary;
    enum state state;
    char key[]; /* files and defines */
};

struct worker {
    struct gpu_ahead *ahead;
    pthread_t thread;
    bool started;   /* started and not joined */
    bool stands_in; /* helps while the device's thread waits: it ends after one program */
    bool ended;
};

struct gpu_ahead {
    const struct gpu_device *device;
    pthread_mutex_t lock; /* guards the members below */
    pthread_cond_t changed;
    struct item *first, **end;
    struct worker workers[THREADS_MAX];
    bool ends, unavailable; /* unavailable: no context can be made */
};

/* Locked. Begins the next waiting items; 0: there are none. */
static size_t begin_items(struct gpu_ahead *ahead, struct item **items)
{
    const size_t max = ahead->device->facts.compiles_together ? TOGETHER_MAX : 1;
    size_t count = 0;
    for (struct item *at = ahead->first; at && !ahead->ends && count < max; at = at->next)
        if (at->state == WAITING) {
            at->state = BEGUN;
            items[count++] = at;
        }
    return count;
}

static void let_write(void)
{
    const struct timespec step = {.tv_nsec = WRITTEN_STEP_NS};
    int writers[WRITERS_MAX];
    const size_t count = host_threads_find(WRITERS_NAME, writers, WRITERS_MAX);
    const uint64_t end_ns = clock_now_ns() + (count > 0 ? WRITTEN_NS_MAX : WRITTEN_NS);
    do
        (void)nanosleep(&step, NULL);
    while (clock_now_ns() < end_ns && !(count > 0 && host_threads_sleep(writers, count)));
}

static void end_item(struct gpu_ahead *ahead, struct item *item, GLuint program)
{
    struct gpu_binary binary = {0};
    const bool good = gpu_build_end(&item->build, program, NULL) && gpu_build_binary(&binary, program);
    const bool rehearses =
        good && ahead->device->facts.compiles_at_dispatch && item->build.stages[0].type == GL_COMPUTE_SHADER;
    if (rehearses)
        gpu_program_rehearse(ahead->device->texel_formats, program);
    glDeleteProgram(program);
    if (good)
        gpu_binary_write(ahead->device->binaries, &item->build.key, &binary);
    if (rehearses)
        let_write();
    pthread_mutex_lock(&ahead->lock);
    item->binary = binary;
    item->state = DONE;
    pthread_cond_broadcast(&ahead->changed);
    pthread_mutex_unlock(&ahead->lock);
}

static void compile_items(struct gpu_ahead *ahead, bool once)
{
    struct item *items[TOGETHER_MAX];
    GLuint programs[TOGETHER_MAX];
    do {
        pthread_mutex_lock(&ahead->lock);
        const size_t count = begin_items(ahead, items);
        pthread_mutex_unlock(&ahead->lock);
        if (count == 0)
            return;
        for (size_t i = 0; i < count; i++) {
            programs[i] = glCreateProgram();
            gpu_build_start(&items[i]->build, programs[i]);
        }
        for (size_t i = 0; i < count; i++)
            end_item(ahead, items[i], programs[i]);
    } while (!once);
}

static void *run(void *context)
{
    struct worker *worker = context;
    struct gpu_ahead *ahead = worker->ahead;
    struct gpu_egl beside;
    pthread_setname_np(pthread_self(), "compile");
    host_thread_lower_priority(); /* builds go first; a program that is waited for takes no time here */
    const bool opened = gpu_egl_open_beside(&beside, ahead->device->egl);
    if (opened) {
        compile_items(ahead, worker->stands_in);
        gpu_egl_close_beside(&beside);
    }
    pthread_mutex_lock(&ahead->lock);
    worker->ended = true;
    ahead->unavailable |= !opened;
    pthread_mutex_unlock(&ahead->lock);
    return NULL;
}

struct gpu_ahead *gpu_ahead_create(const struct gpu_device *device)
{
    struct gpu_ahead *ahead = calloc(1, sizeof(*ahead));
    if (!ahead)
        return NULL;
    ahead->device = device;
    ahead->end = &ahead->first;
    for (size_t i = 0; i < THREADS_MAX; i++)
        ahead->workers[i].ahead = ahead;
    pthread_mutex_init(&ahead->lock, NULL);
    pthread_cond_init(&ahead->changed, NULL);
    return ahead;
}

void gpu_ahead_destroy(struct gpu_ahead *ahead)
{
    if (!ahead)
        return;
    pthread_mutex_lock(&ahead->lock);
    ahead->ends = true;
    pthread_mutex_unlock(&ahead->lock);
    for (size_t i = 0; i < THREADS_MAX; i++)
        if (ahead->workers[i].started)
            pthread_join(ahead->workers[i].thread, NULL);
    for (struct item *next, *at = ahead->first; at; at = next) {
        next = at->next;
        gpu_build_finish(&at->build);
        gpu_binary_finish(&at->binary);
        free(at);
    }
    pthread_cond_destroy(&ahead->changed);
    pthread_mutex_destroy(&ahead->lock);
    free(ahead);
}

/* Locked. Finds the item's link in the list. */
static struct item **find(struct gpu_ahead *ahead, const char *key)
{
    for (struct item **at = &ahead->first; *at; at = &(*at)->next)
        if (strcmp((*at)->key, key) == 0)
            return at;
    return NULL;
}

bool gpu_ahead_knows(struct gpu_ahead *ahead, const char *key)
{
    pthread_mutex_lock(&ahead->lock);
    const bool knows = ahead->unavailable || find(ahead, key);
    pthread_mutex_unlock(&ahead->lock);
    return knows;
}

/* Locked. Starts a worker. */
static void start(struct worker *worker)
{
    if (worker->started && !worker->ended)
        return;
    if (worker->started)
        pthread_join(worker->thread, NULL); /* the thread only has to return */
    worker->ended = false;
    worker->started = pthread_create(&worker->thread, NULL, run, worker) == 0;
}

static size_t thread_count(const struct gpu_facts *facts)
{
    if (facts->compiles_together)
        return 1;
    /* The device's thread compiles, too, where that happens at a dispatch. */
    const size_t count = facts->compiles_at_dispatch ? parallel_processors() - 1 : THREADS_MAX;
    return count < THREADS_MAX ? count : THREADS_MAX;
}

void gpu_ahead_add(struct gpu_ahead *ahead, const char *key, struct gpu_build *build, bool compiles)
{
    const size_t key_bytes = strlen(key) + 1;
    struct item *item = malloc(sizeof(*item) + key_bytes);
    if (!item) {
        gpu_build_finish(build);
        return;
    }
    *item = (struct item){.build = *build, .state = compiles ? WAITING : DONE};
    memcpy(item->key, key, key_bytes);
    *build = (struct gpu_build){0};
    pthread_mutex_lock(&ahead->lock);
    *ahead->end = item;
    ahead->end = &item->next;
    const size_t threads = compiles ? thread_count(&ahead->device->facts) : 0;
    for (size_t i = 0; i < threads; i++)
        start(&ahead->workers[i]);
    pthread_mutex_unlock(&ahead->lock);
}

size_t gpu_ahead_left(struct gpu_ahead *ahead)
{
    size_t count = 0;
    pthread_mutex_lock(&ahead->lock);
    for (const struct item *at = ahead->first; at; at = at->next)
        count++;
    pthread_mutex_unlock(&ahead->lock);
    return count;
}

static bool any_waiting(const struct gpu_ahead *ahead)
{
    const struct item *at = ahead->first;
    while (at && at->state != WAITING)
        at = at->next;
    return at;
}

/* Locked. Starts a second thread while the device's thread waits for the only one that compiles, so that no
 * processor is idle. */
static void stand_in(struct gpu_ahead *ahead)
{
    struct worker *worker = &ahead->workers[1];
    const struct gpu_facts *facts = &ahead->device->facts;
    if (!facts->compiles_at_dispatch || thread_count(facts) != 1 || !any_waiting(ahead))
        return;
    worker->stands_in = true;
    start(worker);
}

bool gpu_ahead_take(struct gpu_ahead *ahead, const char *key, struct gpu_build *build, struct gpu_binary *binary)
{
    pthread_mutex_lock(&ahead->lock);
    struct item **place = find(ahead, key), *item = place ? *place : NULL;
    if (item && item->state == BEGUN)
        stand_in(ahead);
    while (item && item->state == BEGUN)
        pthread_cond_wait(&ahead->changed, &ahead->lock);
    if (item) { /* only this thread changes the list */
        *place = item->next;
        if (ahead->end == &item->next)
            ahead->end = place;
    }
    pthread_mutex_unlock(&ahead->lock);
    if (!item)
        return false;
    *build = item->build;
    *binary = item->binary;
    free(item);
    return true;
}
