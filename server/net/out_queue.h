/* SPDX-License-Identifier: MIT */
/* Queue of messages to be sent on a connection. Bodies are shared chunks with a reference count and are never
 * copied or changed; each message keeps an offset instead. Control messages go before bulk ones, but a begun
 * message is finished first. One thread, no system calls. */
#ifndef FARLIGHT_NET_OUT_QUEUE_H
#define FARLIGHT_NET_OUT_QUEUE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/uio.h>

/* Bytes that several messages refer to; embedded in their owner. */
struct out_chunk {
    uint32_t references;
    const uint8_t *data;
    size_t size_bytes;
    void (*release)(struct out_chunk *chunk); /* called after the last reference is gone */
};
void out_chunk_ref(struct out_chunk *chunk);
void out_chunk_unref(struct out_chunk *chunk); /* accepts NULL */

/* Called when the kernel has accepted the last byte, at `now_ns`; the call that took the first one began at
 * `begun_ns`. Not called for a message that is dropped. */
typedef void out_sent_fn(void *context, uint64_t begun_ns, uint64_t now_ns);

struct out_message {
    struct out_message *next;
    uint32_t request;
    out_sent_fn *sent;
    void *context;
    struct out_chunk *body; /* may be NULL; the message holds a reference */
    size_t body_offset_bytes, body_bytes;
    size_t padding_bytes; /* zeros after the body, at most 7 */
    size_t sent_bytes;    /* sent so far of head, body and padding together */
    uint64_t begun_ns;    /* beginning of the call for its first bytes; 0: not yet */
    size_t head_bytes;
    uint8_t head[];
};
struct out_message *out_message_create(size_t head_bytes); /* NULL: out of memory */

struct out_list {
    struct out_message *first, **end;
};

struct out_queue {
    struct out_list sending; /* in the order of sending; filled from the two lists below */
    struct out_list control, bulk;
    size_t queued_bytes;      /* in all lists, not yet accepted by the kernel */
    size_t queued_bulk_bytes; /* those in `bulk` */
    size_t sending_bytes;     /* those in `sending` */
    size_t taken_bytes;       /* part of those, from their start: copied, not yet accepted by the kernel */
};

void out_queue_init(struct out_queue *queue);
void out_queue_finish(struct out_queue *queue); /* drops everything */
void out_queue_push(struct out_queue *queue, struct out_message *message, bool bulk);
/* Gets the next bytes to send, in at most `parts_max` (at least 3) parts. Returns the number of parts; 0: none
 * wait. */
size_t out_queue_gather(struct out_queue *queue, struct iovec *parts, size_t parts_max);
/* Marks gathered bytes as copied: they are not gathered again, and their messages count as begun.
 * out_queue_advance() must follow for all of them. */
void out_queue_take(struct out_queue *queue, size_t bytes);
/* Marks gathered bytes (or copied ones, if there are any) as accepted by the kernel, in a call that lasted from
 * `before_ns` to `now_ns`. Calls `sent` of completed messages, which may push. */
void out_queue_advance(struct out_queue *queue, size_t bytes, uint64_t before_ns, uint64_t now_ns);
/* Drops the request's messages that were not begun, and the `sent` call of one that was. Control messages stay. */
void out_queue_drop_bulk(struct out_queue *queue, uint32_t request);
void out_queue_drop_all_bulk(struct out_queue *queue);
/* Drops only messages whose body begins at or after `from_bytes`, and a begun message keeps its `sent`. Returns
 * the number of dropped bytes. */
size_t out_queue_drop_unbegun(struct out_queue *queue, uint32_t request, size_t from_bytes);
/* End of the body of the request's last begun message; 0: none of its messages here was begun. */
size_t out_queue_begun_end(const struct out_queue *queue, uint32_t request);

#endif
