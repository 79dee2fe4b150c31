/* SPDX-License-Identifier: MIT */
#include "engine/view_mailbox.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>

struct view_mailbox {
    atomic_uint references;
    pthread_mutex_t lock; /* guards the members below */
    struct view_request request;
    bool notified; /* whether the engine was notified and has not read the requests since */
};

struct view_mailbox *view_mailbox_create(void)
{
    struct view_mailbox *mailbox = calloc(1, sizeof(*mailbox));
    if (!mailbox)
        return NULL;
    atomic_init(&mailbox->references, 1);
    pthread_mutex_init(&mailbox->lock, NULL);
    return mailbox;
}

struct view_mailbox *view_mailbox_ref(struct view_mailbox *mailbox)
{
    atomic_fetch_add_explicit(&mailbox->references, 1, memory_order_relaxed);
    return mailbox;
}

void view_mailbox_unref(struct view_mailbox *mailbox)
{
    if (!mailbox || atomic_fetch_sub(&mailbox->references, 1) != 1)
        return;
    pthread_mutex_destroy(&mailbox->lock);
    free(mailbox);
}

/* Whether the engine must be notified. Releases the lock that the caller took. */
static bool notify_once(struct view_mailbox *mailbox)
{
    bool notified = mailbox->notified;
    mailbox->notified = true;
    pthread_mutex_unlock(&mailbox->lock);
    return !notified;
}

bool view_mailbox_set_camera(struct view_mailbox *mailbox, const struct view_camera *camera)
{
    pthread_mutex_lock(&mailbox->lock);
    mailbox->request.camera = *camera;
    return notify_once(mailbox);
}

bool view_mailbox_request_key_frame(struct view_mailbox *mailbox)
{
    pthread_mutex_lock(&mailbox->lock);
    mailbox->request.key_frame = true;
    return notify_once(mailbox);
}

void view_mailbox_set_effort(struct view_mailbox *mailbox, const struct view_effort *effort)
{
    pthread_mutex_lock(&mailbox->lock);
    mailbox->request.effort = *effort;
    pthread_mutex_unlock(&mailbox->lock);
}

static struct view_request latest(struct view_mailbox *mailbox, bool begins_frame)
{
    pthread_mutex_lock(&mailbox->lock);
    struct view_request request = mailbox->request;
    mailbox->notified = false;
    if (begins_frame)
        mailbox->request.key_frame = false;
    pthread_mutex_unlock(&mailbox->lock);
    return request;
}

struct view_request view_mailbox_latest(struct view_mailbox *mailbox)
{
    return latest(mailbox, false);
}

struct view_request view_mailbox_begin_frame(struct view_mailbox *mailbox)
{
    return latest(mailbox, true);
}
