/* SPDX-License-Identifier: MIT */
/* Messages on their way to a browser. What it has not taken is bounded, whatever it says. No I/O, no lock. */
#ifndef FARLIGHT_CLIENT_WEB_QUEUE_H
#define FARLIGHT_CLIENT_WEB_QUEUE_H

#include <stdbool.h>
#include <stddef.h>

/* A message for the browser. */
#define PARCEL_ROOM 32u
struct parcel {
    struct parcel *next;
    bool is_text; /* else it has a picture, which the browser says that it has shown */
    size_t bytes;
    unsigned char data[]; /* PARCEL_ROOM bytes for who sends it, then the message */
};

#define QUEUE_ROOM 2u /* parcels that wait, and pictures that are not shown: further ones would only be late */

/* Zero: empty. */
struct web_queue {
    struct parcel *first, *last;
    unsigned queued, unshown; /* parcels in it; pictures that were taken from it */
};

/* A picture may be added. */
bool web_queue_has_room(const struct web_queue *queue);
/* A text may be, which does not wait until pictures are shown. One that ends the connection is added in any case.
 */
bool web_queue_has_room_for_text(const struct web_queue *queue);
/* It is the queue's from now on. */
void web_queue_add(struct web_queue *queue, struct parcel *parcel);
/* The first one, for the caller to free; NULL: none. */
struct parcel *web_queue_take(struct web_queue *queue);
/* The browser says so; more than were taken count for as many. */
void web_queue_shown(struct web_queue *queue, unsigned pictures);
void web_queue_clear(struct web_queue *queue);

#endif
