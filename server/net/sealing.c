/* SPDX-License-Identifier: MIT */
/* Bytes of a connection through its sealed link. */
#include "net/sealing.h"

#include "net/connection.h"

#include <string.h>
#include <sys/uio.h>

/* Size below which parts are copied into one record; larger ones are sealed in place. */
#define TOGETHER_BYTES ((size_t)16 << 10)
#define PARTS_A_CALL 64
/* Maximum of bytes that are sealed before they can be sent: sealed bytes can be neither withdrawn nor overtaken.
 */
#define AHEAD_BYTES ((size_t)64 << 10)

/* Copies small parts, which shrink by the copied bytes, up to `maximum` bytes or the first large part. */
static size_t put_together(uint8_t *to, size_t maximum, struct iovec **parts, const struct iovec *end)
{
    size_t used_bytes = 0;
    while (*parts < end && (*parts)->iov_len < TOGETHER_BYTES && used_bytes < maximum) {
        struct iovec *part = *parts;
        size_t bytes = part->iov_len < maximum - used_bytes ? part->iov_len : maximum - used_bytes;
        memcpy(to + used_bytes, part->iov_base, bytes);
        used_bytes += bytes;
        part->iov_base = (char *)part->iov_base + bytes;
        part->iov_len -= bytes;
        *parts += part->iov_len == 0;
    }
    return used_bytes;
}

static size_t seal_parts(struct sealed_link *link, struct iovec *parts, const struct iovec *end)
{
    size_t sealed_bytes = 0, room_bytes;
    while (parts < end && (room_bytes = sealed_link_room(link)) > 0) {
        if (parts->iov_len >= TOGETHER_BYTES) {
            size_t bytes = sealed_link_seal(link, parts->iov_base, parts->iov_len);
            sealed_bytes += bytes;
            if (bytes < parts->iov_len)
                break;
            parts++;
        } else {
            uint8_t together[TOGETHER_BYTES];
            size_t maximum = room_bytes < sizeof(together) ? room_bytes : sizeof(together);
            sealed_bytes += sealed_link_seal(link, together, put_together(together, maximum, &parts, end));
        }
    }
    return sealed_bytes;
}

/* Cuts the parts to at most `max_bytes`. Returns their number. */
static size_t cut_parts(struct iovec *parts, size_t count, size_t max_bytes)
{
    size_t used = 0;
    for (; used < count && max_bytes; used++) {
        if (parts[used].iov_len > max_bytes)
            parts[used].iov_len = max_bytes;
        max_bytes -= parts[used].iov_len;
    }
    return used;
}

/* Bytes that are sealed and not yet accepted by the kernel. */
static size_t waiting_bytes(const struct sealed_link *link)
{
    size_t bytes;
    return sealed_link_waiting(link, &bytes) ? bytes : 0;
}

/* Whether the final record is due: everything before it is sealed, and the client is authenticated. */
static bool is_to_end(const struct connection *connection)
{
    return connection->state == CONNECTION_FLUSHING && sealed_may_seal(connection->link->sealed) &&
           connection->out.taken_bytes == connection->out.queued_bytes;
}

size_t sealing_gather(struct connection *connection, struct iovec *part)
{
    struct sealed_link *link = connection->link;
    size_t ahead_bytes;
    while ((ahead_bytes = waiting_bytes(link)) < AHEAD_BYTES && sealed_link_room(link) > 0) {
        struct iovec parts[PARTS_A_CALL];
        size_t count =
            cut_parts(parts, out_queue_gather(&connection->out, parts, PARTS_A_CALL), AHEAD_BYTES - ahead_bytes);
        if (!count)
            break;
        out_queue_take(&connection->out, seal_parts(link, parts, parts + count));
    }
    if (is_to_end(connection))
        sealed_link_seal_last(link);
    size_t bytes;
    const uint8_t *waiting = sealed_link_waiting(link, &bytes);
    /* The const is cast away for struct iovec; sendmsg() does not write. */
    *part = (struct iovec){.iov_base = (void *)(uintptr_t)waiting, .iov_len = bytes};
    return waiting != NULL;
}

bool sealing_is_done(const struct connection *connection)
{
    size_t bytes;
    return !sealed_link_waiting(connection->link, &bytes) &&
           (!sealed_may_seal(connection->link->sealed) || sealed_has_sealed_last(connection->link->sealed));
}

bool sealing_open_next(struct connection *connection)
{
    struct decode_error error = {0};
    size_t bytes = 0;
    /* A record of any size fits behind the start of a message of any size. */
    switch (sealed_link_open(connection->link, connection->in + connection->in_used,
                             connection->in_capacity - connection->in_used, &bytes, &error)) {
    case SEALED_CONSUMED:
        connection->in_used += bytes;
        return true;
    case SEALED_FATAL:
    case SEALED_REFUSED:
        sealed_link_drop_input(connection->link);
        connection_finish(connection, PROTOCOL_ERROR_PROTOCOL, error.field, error.text);
        return false;
    case SEALED_NEED_MORE:
    case SEALED_NEED_ROOM:
        return false;
    }
    return false;
}
