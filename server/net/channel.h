/* SPDX-License-Identifier: MIT */
/* Channel between the front and a worker: packets over a pair of sockets, with descriptors. Both ends are the same
 * build of the same program, so packets carry plain structs. No call waits: packets that the other end does not
 * accept yet are queued. One thread, the loop's. */
#ifndef FARLIGHT_NET_CHANNEL_H
#define FARLIGHT_NET_CHANNEL_H

#include "net/loop.h"

#include <stddef.h>
#include <stdint.h>

#define CHANNEL_PAYLOAD_MAX_BYTES ((size_t)128 << 10)
#define CHANNEL_FDS 2
#define CHANNEL_WORKER_FD 3 /* a worker's end, when it starts */

enum channel_kind {
    /* Packets to a worker. */
    CHANNEL_START,  /* struct channel_start, first of all */
    CHANNEL_CONFIG, /* the configuration, next and after each change; then answered by one without a payload */
    CHANNEL_OWNER,  /* struct channel_owner, before the first client, unless the start had it; answered by
                       CHANNEL_READY */
    CHANNEL_CLIENT, /* struct handover; with the client's socket and a descriptor of the bytes read from it. From a
                       worker: another one should serve it */
    CHANNEL_ASK,    /* struct channel_question, from a worker for all others, which answer it */
    CHANNEL_ASKED,  /* struct channel_asked: the number of answers to come */
    CHANNEL_ANSWER, /* struct channel_answer followed by bytes, from a worker to the one that has asked */
    CHANNEL_PING,   /* answered by the same */
    /* Packets to the front. */
    CHANNEL_READY,  /* struct channel_ready */
    CHANNEL_HANGS,  /* its device does not answer: it must be killed */
    CHANNEL_ENDING, /* the worker ends on its own: it must get no more clients */
    CHANNEL_FAILED, /* the worker ends: the text says why */
    CHANNEL_COUNTS, /* struct channel_counts, after each change */
};

#define CHANNEL_NAME_BYTES 48
#define CHANNEL_DEVICES 32

struct channel_owner {
    uint64_t number;               /* auth_owner_number() */
    char name[CHANNEL_NAME_BYTES]; /* for people */
};

struct channel_start {
    uint32_t has_owner; /* 1: the worker has one from the start; 0: not yet */
    struct channel_owner owner;
    uint16_t workers_at[CHANNEL_DEVICES]; /* number of workers that use each device, by its index */
};

struct channel_ready {
    uint32_t has_owner; /* 0: it has a device; 1: it also has an owner, and the data kept for that owner */
    int32_t device;     /* its index */
};

struct channel_counts {
    uint32_t clients;  /* clients being served */
    uint32_t handed;   /* clients handed over so far */
    uint32_t unused_s; /* seconds without a client or data kept for one; 0: it has some */
};

enum channel_what { CHANNEL_STATS, CHANNEL_SCENES };

struct channel_question {
    uint32_t asker;        /* number of the worker, which the front fills in */
    uint32_t number;       /* number of the question, chosen by the asker */
    uint32_t what;         /* enum channel_what */
    uint32_t is_read_only; /* the client behind the question may only view shared scenes */
};

struct channel_asked {
    uint32_t number, count;
};

struct channel_answer {
    uint32_t asker, number;
    uint32_t worker; /* the answering worker, filled in by the front */
};

struct channel_packet;

struct channel {
    struct loop *loop;
    int fd;
    struct loop_watch *watch;
    struct channel_packet *first, **end; /* queue of packets to be sent */
    /* Receives a packet. The receiver owns the descriptors; -1: none. */
    void (*received)(void *context, enum channel_kind kind, const void *payload, size_t bytes,
                     const int fds[CHANNEL_FDS]);
    void (*closed)(void *context); /* the other end is gone; called once, as the last call */
    void *context;
};

/* Makes a pair of descriptors for two ends, close-on-exec. */
bool channel_pair(int fds[2], struct error *error);
/* Opens a channel whose functions and context are set; owns the descriptor on success. */
bool channel_open(struct channel *channel, struct loop *loop, int fd, struct error *error);
void channel_close(struct channel *channel); /* accepts a closed or zeroed one */
/* Sends a packet; owns the descriptors, NULL or CHANNEL_FDS of them. False: out of memory, or closed. */
bool channel_send(struct channel *channel, enum channel_kind kind, const void *payload, size_t bytes,
                  const int *fds);
/* Receives the packets left from an end whose process is gone. */
void channel_drain(struct channel *channel);
/* Sends one packet without a loop, with CHANNEL_FDS descriptors or NULL, which stay the caller's; its fate is
 * unknown. */
void channel_say(int fd, enum channel_kind kind, const void *payload, size_t bytes, const int *fds);
/* Waits for the next packet, of that kind and size, before there is a loop. */
bool channel_wait(int fd, enum channel_kind kind, void *payload, size_t bytes);

#endif
