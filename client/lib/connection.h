/* SPDX-License-Identifier: MIT */
/* The inside of a connection, for the files of this folder. */
#ifndef FARLIGHT_CLIENT_LIB_CONNECTION_H
#define FARLIGHT_CLIENT_LIB_CONNECTION_H

#include "lib/process.h"
#include "lib/stream.h"
#include "protocol/handshake.h"

/* Channel of blob data; jobs use the channels above it. */
#define FL_UPLOAD_CHANNEL 1u

/* A message without texts or arrays that did not fit into the buffer. */
struct fl_late {
    struct fl_late *next;
    uint32_t request;
    struct message message;
};

struct fl_receiver;
/* 1: the message was the receiver's; 0: it may be another's; -1: the connection is broken, *error says why. */
typedef int fl_take_fn(struct fl_receiver *receiver, const struct framing_header *header,
                       const struct message *message, struct fl_error *error);
/* A job, a view or a scene: messages may arrive for it at any time, also while another answer is awaited. */
struct fl_receiver {
    struct fl_receiver *next; /* next receiver of the same connection */
    fl_take_fn *take;
};

struct fl_connection {
    struct fl_stream stream;
    struct fl_process process; /* the private daemon or ssh */
    struct handshake_limits limits;
    int interrupt_fd;
    uint32_t last_request, last_scene, last_channel;
    uint64_t upload_credit;           /* the daemon's total for the upload channel */
    uint64_t upload_sent;             /* bytes of blob data sent so far */
    struct fl_receiver *receivers;    /* not owned */
    bool has_job, has_view;           /* a connection runs at most one of each */
    struct fl_late *late, **late_end; /* owned; sent first as soon as the buffer has space */
    bool read_only;                   /* the daemon rejects this client's edits */
    bool can_h264;                    /* true if this client and the daemon both can */
    struct fl_error broken;           /* why the connection is broken; code NONE: it works */
    struct message_stats_reply stats; /* the last answer */
    uint64_t lost_after_ns;           /* maximum silence of the daemon; 0: the handshake is not finished */
    uint64_t silent_ns; /* the silence so far, counted only while the client listens, a limited share at a time */
    uint64_t check_ns;  /* end of the current share of silence; UINT64_MAX: none is being counted */
    uint64_t start_ns;
    bool local;
    bool said_goodbye;
    char address[300];
};

/* A received answer or message of a frame; valid until the next call on the connection. */
struct fl_received {
    struct framing_header header;
    struct message message;
};

/* Marks the connection as unusable, for a fault of the stream or the peer, and adds the last output of a
 * private daemon to the error. Returns false. */
bool fl_connection_break(struct fl_connection *connection, struct fl_error *error);
/* False, with the reason, if the connection is broken. */
bool fl_connection_check(const struct fl_connection *connection, struct fl_error *error);
uint32_t fl_connection_next_request(struct fl_connection *connection);

/* Sends one message and waits until the kernel has it. */
bool fl_connection_send(struct fl_connection *connection, uint32_t request, uint32_t channel,
                        const struct message *message, struct fl_error *error);
/* Queues a message that releases something and so must not fail: it is sent now, or as soon as the buffer has
 * space. The message has no texts and no arrays. Without memory for it the connection is marked as broken,
 * since its end releases everything. */
void fl_connection_send_late(struct fl_connection *connection, uint32_t request, const struct message *message);
/* Moves delayed messages to the stream as far as they fit. False: the connection is broken. */
bool fl_connection_push_late(struct fl_connection *connection, struct fl_error *error);
/* Register and remove a receiver, which is offered messages that are not for the connection itself. */
void fl_connection_add(struct fl_connection *connection, struct fl_receiver *receiver);
void fl_connection_remove(struct fl_connection *connection, struct fl_receiver *receiver);
/* Handles messages for the connection itself (ping, credit for uploads, blocked, goodbye, an error of request 0)
 * or a receiver. 1: handled; 0: the message is the caller's; -1: the connection is broken, and *error says why. */
int fl_connection_consume(struct fl_connection *connection, const struct framing_header *header,
                          const struct message *message, struct fl_error *error);
enum fl_step {
    FL_STEP_MESSAGE, /* the message is the caller's */
    FL_STEP_SERVED,  /* bytes moved, or a message was for the connection or a receiver */
    FL_STEP_FAILED
};
/* Returns a message if one has arrived, else runs one round of waiting. */
enum fl_step fl_connection_step(struct fl_connection *connection, struct fl_received *received,
                                uint64_t deadline_ns, struct fl_error *error);
/* Waits for the next message that is the caller's. */
bool fl_connection_receive(struct fl_connection *connection, struct fl_received *received, uint64_t deadline_ns,
                           struct fl_error *error);
/* Serves the connection until the daemon lets `total` bytes in all be uploaded and a message fits into the buffer.
 * An ERROR that answers `request` is FL_ERROR_REFUSED; other messages are dropped. */
bool fl_connection_wait_upload(struct fl_connection *connection, uint32_t request, uint64_t total,
                               uint64_t deadline_ns, struct fl_error *error);
/* Waits for the answer to `request`; other messages are dropped. An ERROR is FL_ERROR_REFUSED. */
bool fl_connection_answer(struct fl_connection *connection, uint32_t request, enum message_type expected,
                          struct fl_received *received, uint64_t deadline_ns, struct fl_error *error);
/* Sends a one-message request and waits for its answer, for half a minute. */
bool fl_connection_ask(struct fl_connection *connection, const struct message *question,
                       enum message_type expected, struct fl_received *received, struct fl_error *error);
/* Ends a round of waiting, which lasts until connection->check_ns at most: pings a silent daemon, which also
 * keeps the daemon from disconnecting this client for its silence. False: the daemon was silent for
 * lost_after_ns, and the connection is broken. */
bool fl_connection_check_silence(struct fl_connection *connection, struct fl_error *error);
/* Converts the daemon's error; returns false. */
bool fl_error_from_message(struct fl_error *error, const struct message_error *message);

#endif
