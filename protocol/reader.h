/* SPDX-License-Identifier: MIT */
/* Sticky-error cursor over bytes from outside. Every read is checked by subtraction; a failed one zeroes its
 * output, and all after it fail too, so that a caller reads ten fields and checks once. */
#ifndef FARLIGHT_PROTOCOL_READER_H
#define FARLIGHT_PROTOCOL_READER_H

#include "protocol/decode_error.h"

#ifdef __cplusplus
extern "C" {
#endif

struct reader {
    const uint8_t *data;
    size_t size_bytes;
    size_t position; /* never above size_bytes */
    bool failed;     /* the bytes ran out */
};

void reader_init(struct reader *reader, const void *data, size_t size_bytes);
size_t reader_left(const struct reader *reader);
uint8_t reader_u8(struct reader *reader);
uint16_t reader_u16(struct reader *reader);
uint32_t reader_u32(struct reader *reader);
uint64_t reader_u64(struct reader *reader);
bool reader_bytes(struct reader *reader, void *out, size_t count);
const uint8_t *reader_view(struct reader *reader, size_t count); /* NULL: failed */
bool reader_skip(struct reader *reader, size_t count);
bool reader_zeros(struct reader *reader, size_t count); /* false without reader->failed: a byte is not 0 */

#ifdef __cplusplus
}
#endif
#endif
