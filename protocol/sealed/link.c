/* SPDX-License-Identifier: MIT */
/* The buffers of a sealed connection. */
#include "protocol/sealed/link.h"

#include <stdlib.h>
#include <string.h>

/* Capacity before the peer is known: the messages of the handshake, and the first record that a client sends
 * with them. */
#define CLOSED_BYTES 512u
/* Capacity of an open link: a few of the largest records, so that a system call moves much. */
#define OPEN_BYTES (4u * (size_t)SEALED_RECORD_MAX_BYTES)

/* ---- life ---- */

static struct sealed_link *create(struct sealed *sealed)
{
    struct sealed_link *link = calloc(1, sizeof(*link));
    uint8_t *in = malloc(CLOSED_BYTES), *out = malloc(CLOSED_BYTES);
    if (!sealed || !link || !in || !out) {
        sealed_destroy(sealed);
        free(link);
        free(in);
        free(out);
        return NULL;
    }
    link->sealed = sealed;
    link->in = in;
    link->out = out;
    link->in_capacity = link->out_capacity = CLOSED_BYTES;
    return link;
}

struct sealed_link *sealed_link_client(const struct sealed_key *key)
{
    struct sealed_link *link = create(sealed_client(key));
    if (link) {
        link->out_end = sealed_begin(link->sealed, link->out);
    }
    return link;
}

struct sealed_link *sealed_link_server(const struct sealed_key *keys, size_t key_count)
{
    return create(sealed_server(keys, key_count));
}

void sealed_link_destroy(struct sealed_link *link)
{
    if (link) {
        sealed_destroy(link->sealed);
        free(link->in);
        free(link->out);
        free(link);
    }
}

/* Gives the buffers more memory, once the peer is known. */
static bool widen(struct sealed_link *link)
{
    uint8_t *in = realloc(link->in, OPEN_BYTES);
    link->in = in ? in : link->in;
    uint8_t *out = in ? realloc(link->out, OPEN_BYTES) : NULL;
    if (!out) {
        return false;
    }
    link->out = out;
    link->in_capacity = link->out_capacity = OPEN_BYTES;
    return true;
}

/* ---- on the way to another process ---- */

struct saved_head {
    size_t in_bytes, out_bytes;
};

size_t sealed_link_save(const struct sealed_link *link, uint8_t *out)
{
    const struct saved_head head = {sealed_link_unopened(link), link->out_end - link->out_start};
    if (out) {
        memcpy(out, &head, sizeof(head));
        out += sizeof(head);
        sealed_save(link->sealed, out);
        out += sealed_saved_bytes();
        memcpy(out, link->in + link->in_start, head.in_bytes);
        memcpy(out + head.in_bytes, link->out + link->out_start, head.out_bytes);
    }
    return sizeof(head) + sealed_saved_bytes() + head.in_bytes + head.out_bytes;
}

struct sealed_link *sealed_link_restore(const uint8_t *saved, size_t bytes)
{
    struct saved_head head;
    const size_t before_bytes = sizeof(head) + sealed_saved_bytes();
    if (bytes < before_bytes) {
        return NULL;
    }
    memcpy(&head, saved, sizeof(head));
    if (head.in_bytes > OPEN_BYTES || head.out_bytes > OPEN_BYTES ||
        head.in_bytes + head.out_bytes != bytes - before_bytes) {
        return NULL;
    }
    struct sealed_link *link = create(sealed_restore(saved + sizeof(head)));
    if (link && !widen(link)) {
        sealed_link_destroy(link);
        return NULL;
    }
    if (link) {
        memcpy(link->in, saved + before_bytes, head.in_bytes);
        memcpy(link->out, saved + before_bytes + head.in_bytes, head.out_bytes);
        link->in_end = head.in_bytes;
        link->out_end = head.out_bytes;
    }
    return link;
}

/* ---- from the socket ---- */

uint8_t *sealed_link_space(struct sealed_link *link, size_t *bytes)
{
    if (link->in_start > 0) {
        memmove(link->in, link->in + link->in_start, link->in_end - link->in_start);
        link->in_end -= link->in_start;
        link->in_start = 0;
    }
    *bytes = link->in_capacity - link->in_end;
    return link->in + link->in_end;
}

void sealed_link_came(struct sealed_link *link, size_t bytes)
{
    link->in_end += bytes;
}

size_t sealed_link_unopened(const struct sealed_link *link)
{
    return link->in_end - link->in_start;
}

bool sealed_link_has_record(const struct sealed_link *link)
{
    return sealed_is_open(link->sealed) &&
           sealed_has_record(link->in + link->in_start, sealed_link_unopened(link));
}

void sealed_link_drop_input(struct sealed_link *link)
{
    link->in_start = link->in_end = 0;
}

enum sealed_result sealed_link_handshake(struct sealed_link *link, struct decode_error *error)
{
    enum sealed_result result = SEALED_CONSUMED;
    while (result == SEALED_CONSUMED && !sealed_is_open(link->sealed)) {
        size_t consumed_bytes = 0, out_bytes = 0;
        /* At most two messages of the handshake are queued at once. */
        result = sealed_handshake(link->sealed, link->in + link->in_start, sealed_link_unopened(link),
                                  &consumed_bytes, link->out + link->out_end, &out_bytes, error);
        link->in_start += consumed_bytes;
        link->out_end += out_bytes;
    }
    if (result == SEALED_CONSUMED && link->in_capacity < OPEN_BYTES && !widen(link)) {
        decode_error_set(error, PROTOCOL_ERROR_OUT_OF_MEMORY, "", "no memory");
        return SEALED_FATAL;
    }
    return result;
}

void sealed_link_refuse(struct sealed_link *link)
{
    sealed_refuse(link->out + link->out_end, sealed_status(link->sealed));
    link->out_end += SEALED_REFUSAL_BYTES;
}

enum sealed_result sealed_link_open(struct sealed_link *link, uint8_t *plain, size_t plain_capacity,
                                    size_t *plain_bytes, struct decode_error *error)
{
    size_t consumed_bytes = 0;
    const enum sealed_result result =
        sealed_open(link->sealed, link->in + link->in_start, sealed_link_unopened(link), &consumed_bytes, plain,
                    plain_capacity, plain_bytes, error);
    link->in_start += consumed_bytes;
    return result;
}

/* ---- to the socket ---- */

static bool has_room_for(const struct sealed_link *link, size_t plain_bytes)
{
    return link->record_end < SEALED_LINK_RECORDS && sealed_may_seal(link->sealed) &&
           !sealed_has_sealed_last(link->sealed) &&
           link->out_capacity - link->out_end >= plain_bytes + SEALED_RECORD_EXTRA_BYTES;
}

size_t sealed_link_room(const struct sealed_link *link)
{
    if (!has_room_for(link, 1)) {
        return 0;
    }
    const size_t room_bytes = link->out_capacity - link->out_end - SEALED_RECORD_EXTRA_BYTES;
    return room_bytes < SEALED_PLAIN_MAX_BYTES ? room_bytes : SEALED_PLAIN_MAX_BYTES;
}

static void put_record(struct sealed_link *link, const uint8_t *plain, size_t plain_bytes)
{
    link->out_end += sealed_seal(link->sealed, link->out + link->out_end, plain, plain_bytes);
    link->records[link->record_end++] =
        (struct sealed_link_record){.end = link->out_end, .plain_bytes = plain_bytes};
}

size_t sealed_link_seal(struct sealed_link *link, const uint8_t *plain, size_t plain_bytes)
{
    size_t taken_bytes = 0, room_bytes;
    while (taken_bytes < plain_bytes && (room_bytes = sealed_link_room(link)) > 0) {
        const size_t left_bytes = plain_bytes - taken_bytes;
        const size_t record_bytes = left_bytes < room_bytes ? left_bytes : room_bytes;
        put_record(link, plain + taken_bytes, record_bytes);
        taken_bytes += record_bytes;
    }
    return taken_bytes;
}

bool sealed_link_seal_last(struct sealed_link *link)
{
    if (sealed_has_sealed_last(link->sealed)) {
        return true;
    }
    if (!has_room_for(link, 0)) {
        return false;
    }
    put_record(link, NULL, 0);
    return true;
}

const uint8_t *sealed_link_waiting(const struct sealed_link *link, size_t *bytes)
{
    *bytes = link->out_end - link->out_start;
    return *bytes > 0 ? link->out + link->out_start : NULL;
}

size_t sealed_link_sent(struct sealed_link *link, size_t bytes)
{
    size_t plain_bytes = 0;
    link->out_start += bytes;
    while (link->record_first < link->record_end && link->records[link->record_first].end <= link->out_start) {
        plain_bytes += link->records[link->record_first++].plain_bytes;
    }
    if (link->out_start == link->out_end) {
        link->out_start = link->out_end = link->record_first = link->record_end = 0;
    }
    return plain_bytes;
}
