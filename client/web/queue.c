/* SPDX-License-Identifier: MIT */
/* The queue of messages to a browser. */
#include "web/queue.h"

#include <stdlib.h>

bool web_queue_has_room(const struct web_queue *queue)
{
    return queue->queued + queue->unshown < QUEUE_ROOM;
}

bool web_queue_has_room_for_text(const struct web_queue *queue)
{
    return queue->queued < QUEUE_ROOM;
}

void web_queue_add(struct web_queue *queue, struct parcel *parcel)
{
    parcel->next = NULL;
    *(queue->last ? &queue->last->next : &queue->first) = parcel;
    queue->last = parcel;
    queue->queued++;
}

struct parcel *web_queue_take(struct web_queue *queue)
{
    struct parcel *parcel = queue->first;
    if (!parcel)
        return NULL;
    queue->first = parcel->next;
    queue->last = queue->first ? queue->last : NULL;
    queue->queued--;
    queue->unshown += !parcel->is_text;
    return parcel;
}

void web_queue_shown(struct web_queue *queue, unsigned pictures)
{
    queue->unshown -= pictures < queue->unshown ? pictures : queue->unshown;
}

void web_queue_clear(struct web_queue *queue)
{
    for (struct parcel *parcel; (parcel = web_queue_take(queue));)
        free(parcel);
    *queue = (struct web_queue){0};
}
