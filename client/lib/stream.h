/* SPDX-License-Identifier: MIT */
/* Messages over one non-blocking descriptor: a bounded buffer in each direction, sealed or not, and nothing else.
 * Used towards the daemon and towards helper programs. One thread. */
#ifndef FARLIGHT_CLIENT_LIB_STREAM_H
#define FARLIGHT_CLIENT_LIB_STREAM_H

#include "lib/farlight.h"
#include "protocol/framing.h"
#include "protocol/handshake.h"

#include <poll.h>

struct sealed_key;
struct sealed_link;

/* Two maximum messages: one can be completed while the other is processed. */
#define FL_STREAM_BUFFER_BYTES (2u * FRAMING_MESSAGE_MAX_BYTES)

struct fl_stream {
    int fd;           /* owned; -1: none */
    uint32_t accept;  /* bits of enum message_from: the allowed senders of received messages */
    const char *peer; /* the peer's name in errors, "the daemon"; static */
    bool ended;       /* the peer will send nothing more */
    bool is_blocked;  /* the last bytes to be sent found no space */
    bool heard;       /* the peer sent bytes, or accepted some that had found no space; reset by the caller */
    uint8_t *in, *out, *scratch_data; /* FL_STREAM_BUFFER_BYTES, the same, SCRATCH_BYTES */
    size_t in_start, in_end, out_start, out_end;
    struct scratch scratch;
    struct sealed_link *link; /* between these buffers and the descriptor; NULL: the connection is not sealed */
    bool is_last;             /* no more messages follow: the end is sealed after them */
};

/* Takes the descriptor over (also on failure) and makes it non-blocking. */
bool fl_stream_init(struct fl_stream *stream, int fd, uint32_t accept, const char *peer, struct fl_error *error);
void fl_stream_finish(struct fl_stream *stream);
/* Makes the connection a sealed one, whose handshake fl_stream_transfer() begins. Must precede all messages. */
bool fl_stream_seal(struct fl_stream *stream, const struct sealed_key *key, struct fl_error *error);
/* True if a holder of the key has sent the end of the stream, so that nothing is missing. True without a seal. */
bool fl_stream_is_whole(const struct fl_stream *stream);

/* True if a message of any size fits into the send buffer. */
bool fl_stream_has_room(const struct fl_stream *stream);
bool fl_stream_has_output(const struct fl_stream *stream);
/* Appends a message to the send buffer; it must fit. */
bool fl_stream_push(struct fl_stream *stream, uint32_t request, uint32_t channel, const struct message *message,
                    struct fl_error *error);
/* Appends a message whose payload is encoded already; header->payload_bytes is its size. */
void fl_stream_push_payload(struct fl_stream *stream, const struct framing_header *header, const uint8_t *payload);

/* poll()'s events for the stream's present state; 0 when there is nothing to wait for. */
short fl_stream_events(const struct fl_stream *stream);
/* Writes as much as possible without blocking; received bytes stay in place. False: the peer is lost. */
bool fl_stream_write(struct fl_stream *stream, struct fl_error *error);
/* Writes and reads as much as possible without blocking. False: the peer is lost. The end of its bytes is no
 * failure: see `ended`. */
bool fl_stream_transfer(struct fl_stream *stream, struct fl_error *error);

enum fl_stream_result { FL_STREAM_MESSAGE, FL_STREAM_NOTHING, FL_STREAM_ERROR };
/* The next complete message; unknown ignorable messages are skipped. `frame` and `message` (NULL: not decoded)
 * are valid until the next call. NOTHING with `ended`: at most an incomplete message remains. */
enum fl_stream_result fl_stream_next(struct fl_stream *stream, struct frame *frame, struct message *message,
                                     struct fl_error *error);
/* True if a reply says that the daemon has no place for another client now; *error is set then, retryable. */
bool fl_stream_is_turned_away(const struct handshake_reply *reply, struct fl_error *error);
/* True if the buffer holds an incomplete message. */
bool fl_stream_has_remains(const struct fl_stream *stream);

/* poll() until something is ready, the deadline passes (UINT64_MAX: never) or the interrupt descriptor (0: none)
 * becomes readable. At most 4 entries; those with events 0 are not waited for. */
bool fl_wait(struct pollfd *polled, size_t count, int interrupt_fd, uint64_t deadline_ns, struct fl_error *error);
/* False where the interrupt descriptor (0: none) is readable; for loops that may go on without a wait. */
bool fl_check_interrupt(int interrupt_fd, struct fl_error *error);

#endif
