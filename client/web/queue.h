/* SPDX-License-Identifier: MIT */
/* The queue of messages to a browser, bounded whatever the browser says. No I/O, no lock. */
#ifndef FARLIGHT_CLIENT_WEB_QUEUE_H
#define FARLIGHT_CLIENT_WEB_QUEUE_H

#include <stdbool.h>
#include <stddef.h>

/* A message to the browser. */
#define PARCEL_ROOM 32u
struct parcel {
    struct parcel *next;
    bool is_text; /* false: a picture, which the browser acknowledges when it is shown */
    size_t bytes;
    unsigned char data[]; /* PARCEL_ROOM bytes for the sender, then the message */
};

#define QUEUE_ROOM 2u /* limit of queued parcels and of pictures not shown: more would only be late */

/* A queue; zero: empty. */
struct web_queue {
    struct parcel *first, *last;
    unsigned queued, unshown; /* parcels in the queue; pictures taken from it and not shown yet */
};

/* True if a picture may be added. */
bool web_queue_has_room(const struct web_queue *queue);
/* True if a text may be added, which does not depend on shown pictures. A text that ends the connection is
 * added in any case. */
bool web_queue_has_room_for_text(const struct web_queue *queue);
/* Adds a parcel, which the queue owns from now on. */
void web_queue_add(struct web_queue *queue, struct parcel *parcel);
/* Takes the first parcel out, for the caller to free; NULL: none. */
struct parcel *web_queue_take(struct web_queue *queue);
/* Counts pictures that the browser has shown, at most those that were taken. */
void web_queue_shown(struct web_queue *queue, unsigned pictures);
void web_queue_clear(struct web_queue *queue);

#endif
