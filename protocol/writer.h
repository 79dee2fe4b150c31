/* SPDX-License-Identifier: MIT */
/* Sticky-error cursor that writes little-endian bytes into a caller's buffer. After the first failure
 * nothing more is written and every call returns false, so a caller writes ten fields and checks once. */
#ifndef FARLIGHT_PROTOCOL_WRITER_H
#define FARLIGHT_PROTOCOL_WRITER_H

#include "protocol/decode_error.h"

#ifdef __cplusplus
extern "C" {
#endif

struct writer {
    uint8_t *data; /* the caller's */
    size_t capacity_bytes;
    size_t used_bytes;
    bool failed;
    struct decode_error error; /* the failure */
};

void writer_init(struct writer *writer, void *data, size_t capacity_bytes);
bool writer_put_u8(struct writer *writer, uint8_t value);
bool writer_put_u16(struct writer *writer, uint16_t value);
bool writer_put_u32(struct writer *writer, uint32_t value);
bool writer_put_u64(struct writer *writer, uint64_t value);
bool writer_put_bytes(struct writer *writer, const void *bytes, size_t count);
bool writer_put_zeros(struct writer *writer, size_t count);

#ifdef __cplusplus
}
#endif
#endif
