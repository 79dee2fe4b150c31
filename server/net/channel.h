/* SPDX-License-Identifier: MIT */
/* What the front and a worker say to each other: packets over a pair of sockets, with descriptors. Both are one
 * build of one program, so packets carry plain structs. Nothing waits here: what the other end does not take yet
 * is kept. One thread, the loop's. */
#ifndef FARLIGHT_NET_CHANNEL_H
#define FARLIGHT_NET_CHANNEL_H

#include "net/loop.h"

#include <stddef.h>
#include <stdint.h>

#define CHANNEL_PAYLOAD_MAX_BYTES ((size_t)128 << 10)
#define CHANNEL_FDS 2
#define CHANNEL_WORKER_FD 3 /* a worker's end, when it starts */

enum channel_kind {
    /* To a worker. */
    CHANNEL_START,  /* struct channel_start, first of all */
    CHANNEL_CONFIG, /* the configuration, next and after each change; then answered by one without a payload */
    CHANNEL_OWNER,  /* struct channel_owner, before the first client, unless the start had it; answered by
                       CHANNEL_READY */
    CHANNEL_CLIENT, /* struct handover; with its socket and a descriptor of what was read of it. From a worker:
                       another one is to serve it */
    CHANNEL_ASK,    /* struct channel_question, from a worker for all others; to be answered */
    CHANNEL_ASKED,  /* struct channel_asked: how many answers come */
    CHANNEL_ANSWER, /* struct channel_answer and bytes behind it, from a worker to the one that has asked */
    CHANNEL_PING,   /* answered by the same */
    /* To the front. */
    CHANNEL_READY,  /* struct channel_ready */
    CHANNEL_HANGS,  /* its device does not answer: only an end from outside helps */
    CHANNEL_ENDING, /* it ends of itself: no client is to come any more */
    CHANNEL_FAILED, /* it ends: the text says why */
    CHANNEL_COUNTS, /* struct channel_counts, whenever they have changed */
};

#define CHANNEL_NAME_BYTES 48
#define CHANNEL_DEVICES 32

struct channel_owner {
    uint64_t number;               /* auth_owner_number() */
    char name[CHANNEL_NAME_BYTES]; /* for people */
};

struct channel_start {
    uint32_t has_owner; /* from the start: 0 or 1 */
    struct channel_owner owner;
    uint16_t workers_at[CHANNEL_DEVICES]; /* how many use each device, by its index */
};

struct channel_ready {
    uint32_t has_owner; /* 0: it has a device; 1: it has an owner, too, and what was kept for that owner */
    int32_t device;     /* its index */
};

struct channel_counts {
    uint32_t clients;  /* that it serves */
    uint32_t handed;   /* that it was handed so far */
    uint32_t unused_s; /* 0, or for so long it has had no client and held nothing for one */
};

enum channel_what { CHANNEL_STATS, CHANNEL_SCENES };

struct channel_question {
    uint32_t asker;        /* number of the worker, which the front fills in */
    uint32_t number;       /* of the question, which the asker has chosen */
    uint32_t what;         /* enum channel_what */
    uint32_t is_read_only; /* the client for whom it is asked may look at shared scenes alone */
};

struct channel_asked {
    uint32_t number, count;
};

struct channel_answer {
    uint32_t asker, number;
    uint32_t worker; /* that answers, which the front fills in */
};

struct channel_packet;

struct channel {
    struct loop *loop;
    int fd;
    struct loop_watch *watch;
    struct channel_packet *first, **end; /* waits to be sent */
    /* The descriptors are the receiver's; -1: none. */
    void (*received)(void *context, enum channel_kind kind, const void *payload, size_t bytes,
                     const int fds[CHANNEL_FDS]);
    void (*closed)(void *context); /* the other end is gone; called once, and nothing after it */
    void *context;
};

/* A pair of descriptors for two ends, close-on-exec. */
bool channel_pair(int fds[2], struct error *error);
/* The channel's functions and context are set; takes over the descriptor when it succeeds. */
bool channel_open(struct channel *channel, struct loop *loop, int fd, struct error *error);
void channel_close(struct channel *channel); /* accepts one that is closed, or zeroed */
/* Takes over the descriptors, NULL or CHANNEL_FDS of them. False: out of memory, or closed. */
bool channel_send(struct channel *channel, enum channel_kind kind, const void *payload, size_t bytes,
                  const int *fds);
/* Receives what has come, of an end whose process is gone. */
void channel_drain(struct channel *channel);
/* Sends one packet without a loop, with CHANNEL_FDS descriptors or NULL, which stay the caller's; what happens to
 * it is not known. */
void channel_say(int fd, enum channel_kind kind, const void *payload, size_t bytes, const int *fds);
/* Waits for the next packet, of that kind and size, before there is a loop. */
bool channel_wait(int fd, enum channel_kind kind, void *payload, size_t bytes);

#endif
