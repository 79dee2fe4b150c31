/* SPDX-License-Identifier: MIT */
#include "engine/view_wishes.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>

struct view_wishes {
    atomic_uint references;
    pthread_mutex_t lock; /* guards the members below */
    struct view_wish wish;
    bool notified; /* whether the engine was notified and has not read the wishes since */
};

struct view_wishes *view_wishes_create(void)
{
    struct view_wishes *wishes = calloc(1, sizeof(*wishes));
    if (!wishes)
        return NULL;
    atomic_init(&wishes->references, 1);
    pthread_mutex_init(&wishes->lock, NULL);
    return wishes;
}

struct view_wishes *view_wishes_ref(struct view_wishes *wishes)
{
    atomic_fetch_add_explicit(&wishes->references, 1, memory_order_relaxed);
    return wishes;
}

void view_wishes_unref(struct view_wishes *wishes)
{
    if (!wishes || atomic_fetch_sub(&wishes->references, 1) != 1)
        return;
    pthread_mutex_destroy(&wishes->lock);
    free(wishes);
}

/* Whether the engine must be notified. Releases the lock that the caller took. */
static bool notify_once(struct view_wishes *wishes)
{
    bool notified = wishes->notified;
    wishes->notified = true;
    pthread_mutex_unlock(&wishes->lock);
    return !notified;
}

bool view_wishes_set_camera(struct view_wishes *wishes, const struct view_camera *camera)
{
    pthread_mutex_lock(&wishes->lock);
    wishes->wish.camera = *camera;
    return notify_once(wishes);
}

bool view_wishes_request_key_frame(struct view_wishes *wishes)
{
    pthread_mutex_lock(&wishes->lock);
    wishes->wish.key_frame = true;
    return notify_once(wishes);
}

void view_wishes_set_effort(struct view_wishes *wishes, const struct view_effort *effort)
{
    pthread_mutex_lock(&wishes->lock);
    wishes->wish.effort = *effort;
    pthread_mutex_unlock(&wishes->lock);
}

static struct view_wish latest(struct view_wishes *wishes, bool begins_frame)
{
    pthread_mutex_lock(&wishes->lock);
    struct view_wish wish = wishes->wish;
    wishes->notified = false;
    if (begins_frame)
        wishes->wish.key_frame = false;
    pthread_mutex_unlock(&wishes->lock);
    return wish;
}

struct view_wish view_wishes_latest(struct view_wishes *wishes)
{
    return latest(wishes, false);
}

struct view_wish view_wishes_begin_frame(struct view_wishes *wishes)
{
    return latest(wishes, true);
}
