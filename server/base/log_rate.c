/* SPDX-License-Identifier: MIT */
/* Counts of recent lines by source and kind. */
#include "base/log_rate.h"

#include "base/clock.h"
#include "base/log.h"

#include <pthread.h>
#include <stddef.h>

#define LINES_AT_ONCE 5
#define INTERVAL_NS UINT64_C(10000000000)
#define ENTRIES 256

/* Entry for the pairs of source and kind that share this place: few lines are enough where two collide. */
struct entry {
    uint64_t began_ns; /* 0: none yet */
    uint32_t written, left_out;
};

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static struct entry entries[ENTRIES];

static struct entry *entry_of(uint64_t source, const char *kind)
{
    uint64_t mixed = (source ^ (uint64_t)(uintptr_t)kind) * UINT64_C(0x9e3779b97f4a7c15);
    return &entries[mixed >> 56];
}

bool log_is_due(uint64_t source, const char *kind)
{
    uint64_t now_ns = clock_now_ns();
    uint32_t left_out = 0;
    pthread_mutex_lock(&lock);
    struct entry *entry = entry_of(source, kind);
    if (!entry->began_ns || now_ns - entry->began_ns >= INTERVAL_NS) {
        left_out = entry->left_out;
        *entry = (struct entry){.began_ns = now_ns};
    }
    bool due = entry->written < LINES_AT_ONCE;
    entry->written += due;
    entry->left_out += !due;
    pthread_mutex_unlock(&lock);
    if (left_out)
        log_write(LOG_WARNING, "log", "%u lines about clients were left out", left_out);
    return due;
}
