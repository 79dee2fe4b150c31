/* SPDX-License-Identifier: MIT */
/* A bounds-checked cursor over bytes from outside. */
#include "protocol/reader.h"

#include <string.h>

void reader_init(struct reader *reader, const void *data, size_t size_bytes)
{
    *reader = (struct reader){.data = data, .size_bytes = size_bytes};
}

size_t reader_left(const struct reader *reader)
{
    return reader->failed ? 0 : reader->size_bytes - reader->position;
}

const uint8_t *reader_view(struct reader *reader, size_t count)
{
    if (reader->failed || count > reader->size_bytes - reader->position) {
        reader->failed = true;
        return NULL;
    }
    const uint8_t *view = reader->data + reader->position;
    reader->position += count;
    return view;
}

/* `count` is 1, 2, 4 or 8. */
static uint64_t read_little_endian(struct reader *reader, size_t count)
{
    const uint8_t *bytes = reader_view(reader, count);
    uint64_t value = 0;
    if (!bytes) {
        return 0;
    }
    for (size_t i = 0; i < count; i++) {
        value |= (uint64_t)bytes[i] << (8 * i);
    }
    return value;
}

uint8_t reader_u8(struct reader *reader)
{
    return (uint8_t)read_little_endian(reader, 1);
}

uint16_t reader_u16(struct reader *reader)
{
    return (uint16_t)read_little_endian(reader, 2);
}

uint32_t reader_u32(struct reader *reader)
{
    return (uint32_t)read_little_endian(reader, 4);
}

uint64_t reader_u64(struct reader *reader)
{
    return read_little_endian(reader, 8);
}

bool reader_bytes(struct reader *reader, void *out, size_t count)
{
    if (count == 0) {
        return !reader->failed; /* `out` may be NULL, which memcpy and memset may not be given */
    }
    const uint8_t *bytes = reader_view(reader, count);
    if (!bytes) {
        memset(out, 0, count);
        return false;
    }
    memcpy(out, bytes, count);
    return true;
}

bool reader_skip(struct reader *reader, size_t count)
{
    reader_view(reader, count);
    return !reader->failed;
}

bool reader_zeros(struct reader *reader, size_t count)
{
    const uint8_t *bytes = reader_view(reader, count);
    if (!bytes) {
        return false;
    }
    for (size_t i = 0; i < count; i++) {
        if (bytes[i] != 0) {
            return false;
        }
    }
    return true;
}
