/* SPDX-License-Identifier: MIT */
/* Queue of messages: their order, parts and removal. */
#include "net/out_queue.h"

#include <stdlib.h>

/* Maximum of bytes queued for one system call; a control message waits behind at most these. */
#define LINED_UP_BYTES ((size_t)512 << 10)

void out_chunk_ref(struct out_chunk *chunk)
{
    chunk->references++;
}

void out_chunk_unref(struct out_chunk *chunk)
{
    if (chunk && --chunk->references == 0)
        chunk->release(chunk);
}

struct out_message *out_message_create(size_t head_bytes)
{
    if (head_bytes > SIZE_MAX - sizeof(struct out_message))
        return NULL;
    struct out_message *message = malloc(sizeof(*message) + head_bytes);
    if (message)
        *message = (struct out_message){.head_bytes = head_bytes};
    return message;
}

static size_t out_message_bytes(const struct out_message *message)
{
    return message->head_bytes + message->body_bytes + message->padding_bytes;
}

static void destroy(struct out_message *message)
{
    out_chunk_unref(message->body);
    free(message);
}

static void list_init(struct out_list *list)
{
    list->first = NULL;
    list->end = &list->first;
}

static void list_append(struct out_list *list, struct out_message *message)
{
    message->next = NULL;
    *list->end = message;
    list->end = &message->next;
}

static struct out_message *list_take(struct out_list *list)
{
    struct out_message *message = list->first;
    if (!message)
        return NULL;
    list->first = message->next;
    if (!list->first)
        list->end = &list->first;
    message->next = NULL;
    return message;
}

static void list_clear(struct out_list *list)
{
    for (struct out_message *message; (message = list_take(list));)
        destroy(message);
}

void out_queue_init(struct out_queue *queue)
{
    *queue = (struct out_queue){0};
    list_init(&queue->sending);
    list_init(&queue->control);
    list_init(&queue->bulk);
}

void out_queue_finish(struct out_queue *queue)
{
    list_clear(&queue->sending);
    list_clear(&queue->control);
    list_clear(&queue->bulk);
    queue->queued_bytes = queue->queued_bulk_bytes = queue->sending_bytes = queue->taken_bytes = 0;
}

void out_queue_push(struct out_queue *queue, struct out_message *message, bool bulk)
{
    size_t bytes = out_message_bytes(message);
    queue->queued_bytes += bytes;
    if (bulk)
        queue->queued_bulk_bytes += bytes;
    list_append(bulk ? &queue->bulk : &queue->control, message);
}

/* Moves messages to the list `sending`, control first. */
static void line_up(struct out_queue *queue)
{
    while (queue->sending_bytes < LINED_UP_BYTES) {
        struct out_message *message = list_take(&queue->control);
        if (!message && (message = list_take(&queue->bulk)))
            queue->queued_bulk_bytes -= out_message_bytes(message);
        if (!message)
            return;
        queue->sending_bytes += out_message_bytes(message);
        list_append(&queue->sending, message);
    }
}

/* Adds a part without its first `*skip_bytes`. */
static size_t add_part(struct iovec *part, const uint8_t *data, size_t bytes, size_t *skip_bytes)
{
    if (*skip_bytes >= bytes) {
        *skip_bytes -= bytes;
        return 0;
    }
    /* The const is cast away for struct iovec; sendmsg() does not write. */
    *part = (struct iovec){.iov_base = (void *)(uintptr_t)(data + *skip_bytes), .iov_len = bytes - *skip_bytes};
    *skip_bytes = 0;
    return 1;
}

size_t out_queue_gather(struct out_queue *queue, struct iovec *parts, size_t parts_max)
{
    static const uint8_t zeros[8];
    line_up(queue);
    size_t count = 0, taken_bytes = queue->taken_bytes;
    for (const struct out_message *message = queue->sending.first; message && parts_max - count >= 3;
         message = message->next) {
        size_t left_bytes = out_message_bytes(message) - message->sent_bytes;
        if (taken_bytes >= left_bytes) {
            taken_bytes -= left_bytes;
            continue;
        }
        size_t skip_bytes = message->sent_bytes + taken_bytes;
        taken_bytes = 0;
        count += add_part(&parts[count], message->head, message->head_bytes, &skip_bytes);
        if (message->body)
            count += add_part(&parts[count], message->body->data + message->body_offset_bytes, message->body_bytes,
                              &skip_bytes);
        count += add_part(&parts[count], zeros, message->padding_bytes, &skip_bytes);
    }
    return count;
}

void out_queue_take(struct out_queue *queue, size_t bytes)
{
    queue->taken_bytes += bytes;
}

void out_queue_advance(struct out_queue *queue, size_t bytes, uint64_t before_ns, uint64_t now_ns)
{
    /* The queue is updated before the calls, which may push or drop messages. */
    struct out_list complete;
    list_init(&complete);
    queue->queued_bytes -= bytes;
    queue->sending_bytes -= bytes;
    queue->taken_bytes -= bytes < queue->taken_bytes ? bytes : queue->taken_bytes;
    while (bytes) {
        struct out_message *message = queue->sending.first;
        size_t left_bytes = out_message_bytes(message) - message->sent_bytes;
        if (!message->begun_ns)
            message->begun_ns = before_ns;
        if (bytes < left_bytes) {
            message->sent_bytes += bytes;
            break;
        }
        bytes -= left_bytes;
        list_append(&complete, list_take(&queue->sending));
    }
    for (struct out_message *message; (message = list_take(&complete));) {
        if (message->sent)
            message->sent(message->context, message->begun_ns, now_ns);
        destroy(message);
    }
}

enum drop_kind {
    DROP_OF_ALL,
    DROP_OF_REQUEST,
    DROP_UNBEGUN_OF_REQUEST, /* keeps a begun message */
};

struct drop {
    enum drop_kind kind;
    uint32_t request;
    size_t from_bytes;
};

/* Drops bulk messages (those with a body or a completion) of the request, or of any request, from one list. */
static void drop_from(struct out_queue *queue, struct out_list *list, struct drop drop)
{
    struct out_list kept;
    size_t taken_bytes = list == &queue->sending ? queue->taken_bytes : 0;
    list_init(&kept);
    for (struct out_message *message; (message = list_take(list));) {
        bool concerned = (message->body || message->sent) && message->body_offset_bytes >= drop.from_bytes &&
                         (drop.kind == DROP_OF_ALL || message->request == drop.request);
        size_t left_bytes = out_message_bytes(message) - message->sent_bytes;
        bool begun = message->sent_bytes || taken_bytes;
        taken_bytes -= left_bytes < taken_bytes ? left_bytes : taken_bytes;
        if (concerned && !begun) {
            queue->queued_bytes -= out_message_bytes(message);
            if (list == &queue->bulk)
                queue->queued_bulk_bytes -= out_message_bytes(message);
            else
                queue->sending_bytes -= out_message_bytes(message);
            destroy(message);
            continue;
        }
        if (concerned && drop.kind != DROP_UNBEGUN_OF_REQUEST)
            message->sent = NULL;
        list_append(&kept, message);
    }
    while (kept.first)
        list_append(list, list_take(&kept));
}

static void drop(struct out_queue *queue, struct drop what)
{
    drop_from(queue, &queue->sending, what);
    drop_from(queue, &queue->bulk, what);
}

void out_queue_drop_bulk(struct out_queue *queue, uint32_t request)
{
    drop(queue, (struct drop){.kind = DROP_OF_REQUEST, .request = request});
}

size_t out_queue_drop_unbegun(struct out_queue *queue, uint32_t request, size_t from_bytes)
{
    size_t before_bytes = queue->queued_bytes;
    drop(queue, (struct drop){.kind = DROP_UNBEGUN_OF_REQUEST, .request = request, .from_bytes = from_bytes});
    return before_bytes - queue->queued_bytes;
}

void out_queue_drop_all_bulk(struct out_queue *queue)
{
    drop(queue, (struct drop){.kind = DROP_OF_ALL});
}

size_t out_queue_begun_end(const struct out_queue *queue, uint32_t request)
{
    size_t end = 0, taken_bytes = queue->taken_bytes;
    const struct out_message *message = queue->sending.first;
    for (; message && (message->sent_bytes || taken_bytes); message = message->next) {
        size_t left_bytes = out_message_bytes(message) - message->sent_bytes;
        taken_bytes -= left_bytes < taken_bytes ? left_bytes : taken_bytes;
        if (message->body && message->request == request)
            end = message->body_offset_bytes + message->body_bytes;
    }
    return end;
}
