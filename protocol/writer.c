/* SPDX-License-Identifier: MIT */
/* A bounds-checked cursor that writes into a caller's buffer. */
#include "protocol/writer.h"

#include <string.h>

void writer_init(struct writer *writer, void *data, size_t capacity_bytes)
{
    memset(writer, 0, sizeof(*writer));
    writer->data = data;
    writer->capacity_bytes = capacity_bytes;
}

/* Space for the next `count` bytes; NULL: there is none. */
static uint8_t *reserve(struct writer *writer, size_t count)
{
    if (writer->failed) {
        return NULL;
    }
    if (count > writer->capacity_bytes - writer->used_bytes) {
        writer->failed = true;
        decode_error_set(&writer->error, PROTOCOL_ERROR_LIMIT, NULL, "the buffer of %zu bytes is too small",
                         writer->capacity_bytes);
        return NULL;
    }
    uint8_t *place = writer->data + writer->used_bytes;
    writer->used_bytes += count;
    return place;
}

/* `count` is 1, 2, 4 or 8. */
static bool put_little_endian(struct writer *writer, uint64_t value, size_t count)
{
    uint8_t *place = reserve(writer, count);
    if (!place) {
        return false;
    }
    for (size_t i = 0; i < count; i++) {
        place[i] = (uint8_t)(value >> (8 * i));
    }
    return true;
}

bool writer_put_u8(struct writer *writer, uint8_t value)
{
    return put_little_endian(writer, value, 1);
}

bool writer_put_u16(struct writer *writer, uint16_t value)
{
    return put_little_endian(writer, value, 2);
}

bool writer_put_u32(struct writer *writer, uint32_t value)
{
    return put_little_endian(writer, value, 4);
}

bool writer_put_u64(struct writer *writer, uint64_t value)
{
    return put_little_endian(writer, value, 8);
}

bool writer_put_bytes(struct writer *writer, const void *bytes, size_t count)
{
    if (count == 0) {
        return !writer->failed; /* `bytes` may be NULL, which memcpy may not be given */
    }
    uint8_t *place = reserve(writer, count);
    if (!place) {
        return false;
    }
    memcpy(place, bytes, count);
    return true;
}

bool writer_put_zeros(struct writer *writer, size_t count)
{
    if (count == 0) {
        return !writer->failed;
    }
    uint8_t *place = reserve(writer, count);
    if (!place) {
        return false;
    }
    memset(place, 0, count);
    return true;
}
