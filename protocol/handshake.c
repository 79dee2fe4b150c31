/* SPDX-License-Identifier: MIT */
/* The handshake of an open connection. */
#include "protocol/handshake.h"

#include <stddef.h>
#include <string.h>

#include "protocol/describe.h"
#include "protocol/reader.h"
#include "protocol/writer.h"

#define LIMITS_MAX_BYTES 256u /* room for a newer peer's limits */

static const struct {
    const char *name, *what;
    size_t offset; /* offset in struct handshake_limits */
    unsigned bytes;
} limits[] = {
#define LIMIT(type, name, what)                                                                                   \
    {#name, what, offsetof(struct handshake_limits, name), sizeof((struct handshake_limits *)0)->name},
#include "protocol/limits.def"
#undef LIMIT
};
#define LIMIT_COUNT (sizeof(limits) / sizeof(limits[0]))

static const uint8_t magic[4] = {'F', 'A', 'R', 'L'};

/* ---- limits ---- */

bool handshake_limit_at(const struct handshake_limits *values, size_t index, struct handshake_limit *out)
{
    if (index >= LIMIT_COUNT) {
        return false;
    }
    const uint8_t *at = (const uint8_t *)values + limits[index].offset;
    uint64_t value;
    uint32_t narrow;
    if (limits[index].bytes == sizeof(narrow)) {
        memcpy(&narrow, at, sizeof(narrow));
        value = narrow;
    } else {
        memcpy(&value, at, sizeof(value));
    }
    *out = (struct handshake_limit){limits[index].name, limits[index].what, limits[index].bytes, value};
    return true;
}

/* ---- encode ---- */

static bool put_text(struct writer *writer, const char *text, size_t max_bytes)
{
    size_t count = strnlen(text, max_bytes + 1);
    if (count > max_bytes || !utf8_valid((const uint8_t *)text, count)) {
        return false;
    }
    return writer_put_u8(writer, (uint8_t)count) && writer_put_bytes(writer, text, count);
}

static size_t finish(struct writer *writer)
{
    writer_put_zeros(writer, (0 - writer->used_bytes) & 7);
    return writer->failed ? 0 : writer->used_bytes;
}

size_t handshake_hello_encode(uint8_t out[HANDSHAKE_HELLO_MAX_BYTES], const struct handshake_hello *hello)
{
    struct writer writer;
    if (hello->version_min == 0 || hello->version_min > hello->version_max) {
        return 0;
    }
    writer_init(&writer, out, HANDSHAKE_HELLO_MAX_BYTES);
    writer_put_bytes(&writer, magic, sizeof(magic));
    writer_put_u16(&writer, hello->version_min);
    writer_put_u16(&writer, hello->version_max);
    writer_put_u64(&writer, hello->capabilities);
    writer_put_bytes(&writer, hello->nonce, sizeof(hello->nonce));
    return put_text(&writer, hello->name, HANDSHAKE_NAME_MAX_BYTES) ? finish(&writer) : 0;
}

size_t handshake_reply_encode(uint8_t out[HANDSHAKE_REPLY_MAX_BYTES], const struct handshake_reply *reply)
{
    struct writer writer;
    writer_init(&writer, out, HANDSHAKE_REPLY_MAX_BYTES);
    writer_put_bytes(&writer, magic, sizeof(magic));
    writer_put_u16(&writer, reply->version);
    writer_put_u16(&writer, HANDSHAKE_LIMITS_BYTES);
    writer_put_u64(&writer, reply->capabilities);
    writer_put_bytes(&writer, reply->nonce, sizeof(reply->nonce));
    writer_put_bytes(&writer, reply->session_token, sizeof(reply->session_token));
#define LIMIT(type, name, what) writer_put_##type(&writer, reply->limits.name);
#include "protocol/limits.def"
#undef LIMIT
    if (!put_text(&writer, reply->name, HANDSHAKE_NAME_MAX_BYTES) ||
        !put_text(&writer, reply->text, HANDSHAKE_TEXT_MAX_BYTES)) {
        return 0;
    }
    return finish(&writer);
}

/* ---- parse ---- */

static enum handshake_result fatal(struct decode_error *error, const char *field, const char *text)
{
    decode_error_set(error, PROTOCOL_ERROR_PROTOCOL, field, "%s", text);
    return HANDSHAKE_FATAL;
}

/* A reader that has failed ran out of bytes, which is no fault of the peer while more may arrive. Length bytes
 * bound every layout, so the stated maximum always suffices. */
static enum handshake_result get_magic(struct reader *reader, struct decode_error *error)
{
    for (size_t i = 0; i < sizeof(magic) && i < reader->size_bytes; i++) {
        if (reader->data[i] != magic[i]) {
            return fatal(error, "magic", "these bytes are no farlight handshake");
        }
    }
    return reader_skip(reader, sizeof(magic)) ? HANDSHAKE_CONSUMED : HANDSHAKE_NEED_MORE;
}

/* `out` has space for max_bytes and the NUL. */
static enum handshake_result get_text(struct reader *reader, char *out, size_t max_bytes, const char *field,
                                      struct decode_error *error)
{
    size_t count = reader_u8(reader);
    if (count > max_bytes) {
        return fatal(error, field, "is too long");
    }
    if (!reader_bytes(reader, out, count)) {
        return HANDSHAKE_NEED_MORE;
    }
    out[count] = '\0';
    return utf8_valid((const uint8_t *)out, count) ? HANDSHAKE_CONSUMED
                                                   : fatal(error, field, "is no UTF-8 text without NUL");
}

static enum handshake_result get_padding(struct reader *reader, struct decode_error *error)
{
    bool zero = reader_zeros(reader, (0 - reader->position) & 7);
    if (reader->failed) {
        return HANDSHAKE_NEED_MORE;
    }
    return zero ? HANDSHAKE_CONSUMED : fatal(error, "padding", "is not zero");
}

static enum handshake_result parse_hello(struct handshake_hello *out, struct reader *reader,
                                         struct decode_error *error)
{
    enum handshake_result result = get_magic(reader, error);
    if (result != HANDSHAKE_CONSUMED) {
        return result;
    }
    out->version_min = reader_u16(reader);
    out->version_max = reader_u16(reader);
    if (!reader->failed && (out->version_min == 0 || out->version_min > out->version_max)) {
        return fatal(error, "version_min", "is 0 or above version_max");
    }
    out->capabilities = reader_u64(reader);
    reader_bytes(reader, out->nonce, sizeof(out->nonce));
    if (reader->failed) {
        return HANDSHAKE_NEED_MORE;
    }
    result = get_text(reader, out->name, HANDSHAKE_NAME_MAX_BYTES, "name", error);
    return result == HANDSHAKE_CONSUMED ? get_padding(reader, error) : result;
}

/* Limits that an older peer does not send stay 0. */
static void get_limits(struct handshake_limits *out, const uint8_t *bytes, size_t count)
{
    struct reader reader;
    reader_init(&reader, bytes, count);
#define LIMIT(type, name, what) out->name = reader_##type(&reader);
#include "protocol/limits.def"
#undef LIMIT
}

static enum handshake_result parse_reply(struct handshake_reply *out, struct reader *reader,
                                         struct decode_error *error)
{
    enum handshake_result result = get_magic(reader, error);
    if (result != HANDSHAKE_CONSUMED) {
        return result;
    }
    out->version = reader_u16(reader);
    size_t limits_bytes = reader_u16(reader);
    if (limits_bytes > LIMITS_MAX_BYTES) {
        return fatal(error, "limits_bytes", "is above 256");
    }
    out->capabilities = reader_u64(reader);
    reader_bytes(reader, out->nonce, sizeof(out->nonce));
    reader_bytes(reader, out->session_token, sizeof(out->session_token));
    const uint8_t *told = reader_view(reader, limits_bytes);
    if (!told) {
        return HANDSHAKE_NEED_MORE;
    }
    get_limits(&out->limits, told, limits_bytes);
    result = get_text(reader, out->name, HANDSHAKE_NAME_MAX_BYTES, "name", error);
    if (result == HANDSHAKE_CONSUMED) {
        result = get_text(reader, out->text, HANDSHAKE_TEXT_MAX_BYTES, "text", error);
    }
    return result == HANDSHAKE_CONSUMED ? get_padding(reader, error) : result;
}

enum handshake_result handshake_hello_parse(struct handshake_hello *out, const uint8_t *bytes, size_t count,
                                            size_t *consumed_bytes, struct decode_error *error)
{
    struct reader reader;
    if (error) {
        memset(error, 0, sizeof(*error));
    }
    memset(out, 0, sizeof(*out));
    reader_init(&reader, bytes, count);
    enum handshake_result result = parse_hello(out, &reader, error);
    *consumed_bytes = result == HANDSHAKE_CONSUMED ? reader.position : 0;
    if (result != HANDSHAKE_CONSUMED) {
        memset(out, 0, sizeof(*out));
    }
    return result;
}

enum handshake_result handshake_reply_parse(struct handshake_reply *out, const uint8_t *bytes, size_t count,
                                            size_t *consumed_bytes, struct decode_error *error)
{
    struct reader reader;
    if (error) {
        memset(error, 0, sizeof(*error));
    }
    memset(out, 0, sizeof(*out));
    reader_init(&reader, bytes, count);
    enum handshake_result result = parse_reply(out, &reader, error);
    *consumed_bytes = result == HANDSHAKE_CONSUMED ? reader.position : 0;
    if (result != HANDSHAKE_CONSUMED) {
        memset(out, 0, sizeof(*out));
    }
    return result;
}

/* ---- agreement ---- */

uint16_t handshake_choose_version(const struct handshake_hello *hello, struct decode_error *error)
{
    uint16_t maximum = hello->version_max < HANDSHAKE_VERSION_MAX ? hello->version_max : HANDSHAKE_VERSION_MAX;
    if (maximum < hello->version_min || maximum < HANDSHAKE_VERSION_MIN) {
        decode_error_set(error, PROTOCOL_ERROR_VERSION, "version",
                         "the daemon speaks versions %u to %u, the client %u to %u", HANDSHAKE_VERSION_MIN,
                         HANDSHAKE_VERSION_MAX, hello->version_min, hello->version_max);
        return 0;
    }
    return maximum;
}

bool handshake_reply_accept(const struct handshake_hello *hello, const struct handshake_reply *reply,
                            struct decode_error *error)
{
    if (reply->version == 0) {
        return decode_error_set(error, PROTOCOL_ERROR_VERSION, "version", "%s",
                                reply->text[0] != '\0' ? reply->text : "no version in common");
    }
    if (reply->version < hello->version_min || reply->version > hello->version_max) {
        return decode_error_set(error, PROTOCOL_ERROR_PROTOCOL, "version",
                                "%u was chosen where %u to %u were offered", reply->version, hello->version_min,
                                hello->version_max);
    }
    return true;
}
