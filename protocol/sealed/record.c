/* SPDX-License-Identifier: MIT */
/* Sealing and opening of records. */
#include "protocol/sealed/state.h"

#include <string.h>

#include "protocol/reader.h"
#include "protocol/writer.h"

size_t sealed_seal(struct sealed *sealed, uint8_t *out, const uint8_t *plain, size_t plain_bytes)
{
    const uint8_t tag = plain_bytes == 0 ? crypto_secretstream_xchacha20poly1305_TAG_FINAL
                                         : crypto_secretstream_xchacha20poly1305_TAG_MESSAGE;
    struct writer writer;
    writer_init(&writer, out, LENGTH_BYTES);
    writer_put_u32(&writer, (uint32_t)(plain_bytes + TAG_BYTES));
    crypto_secretstream_xchacha20poly1305_push(&sealed->sending, out + LENGTH_BYTES, NULL, plain, plain_bytes, out,
                                               LENGTH_BYTES, tag);
    sealed->sealed_last = plain_bytes == 0;
    return LENGTH_BYTES + plain_bytes + TAG_BYTES;
}

static uint32_t record_length(const uint8_t *bytes)
{
    struct reader reader;
    reader_init(&reader, bytes, LENGTH_BYTES);
    return reader_u32(&reader);
}

static bool is_record_length(size_t sealed_bytes)
{
    return sealed_bytes >= TAG_BYTES && sealed_bytes <= SEALED_PLAIN_MAX_BYTES + TAG_BYTES;
}

bool sealed_has_record(const uint8_t *bytes, size_t count)
{
    if (count < LENGTH_BYTES) {
        return false;
    }
    const size_t sealed_bytes = record_length(bytes);
    return !is_record_length(sealed_bytes) || count - LENGTH_BYTES >= sealed_bytes;
}

enum sealed_result sealed_open(struct sealed *sealed, const uint8_t *bytes, size_t count, size_t *consumed_bytes,
                               uint8_t *plain, size_t plain_capacity, size_t *plain_bytes,
                               struct decode_error *error)
{
    if (error) {
        memset(error, 0, sizeof(*error));
    }
    *consumed_bytes = *plain_bytes = 0;
    if (sealed->stage != STAGE_OPEN || (sealed->opened_last && count > 0)) {
        return sealed_fatal(sealed, error, "record", "no record is expected");
    }
    if (count < LENGTH_BYTES) {
        return SEALED_NEED_MORE;
    }
    const size_t sealed_bytes = record_length(bytes);
    if (!is_record_length(sealed_bytes)) {
        return sealed_fatal(sealed, error, "sealed_bytes", "is not within 17 .. 65553");
    }
    if (count - LENGTH_BYTES < sealed_bytes) {
        return SEALED_NEED_MORE;
    }
    if (sealed_bytes - TAG_BYTES > plain_capacity) {
        return SEALED_NEED_ROOM;
    }
    uint8_t tag = 0;
    if (crypto_secretstream_xchacha20poly1305_pull(&sealed->receiving, plain, NULL, &tag, bytes + LENGTH_BYTES,
                                                   sealed_bytes, bytes, LENGTH_BYTES) != 0) {
        return sealed_fatal(sealed, error, "record", "is not authentic: it was changed on the way");
    }
    const size_t opened_bytes = sealed_bytes - TAG_BYTES;
    if (tag != (opened_bytes == 0 ? crypto_secretstream_xchacha20poly1305_TAG_FINAL
                                  : crypto_secretstream_xchacha20poly1305_TAG_MESSAGE)) {
        return sealed_fatal(sealed, error, "record", "has the wrong tag for its size");
    }
    sealed->opened_last = opened_bytes == 0;
    *consumed_bytes = LENGTH_BYTES + sealed_bytes;
    *plain_bytes = opened_bytes;
    return SEALED_CONSUMED;
}
