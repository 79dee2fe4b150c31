/* SPDX-License-Identifier: MIT */
/* Prints the document of the wire format, in Markdown: from the table, from the prose in the file that is its
 * argument, and from the messages of example.c. */
#include <inttypes.h>
#include <stdio.h>

#include "protocol/describe.h"
#include "protocol/docs/example.h"
#include "protocol/handshake.h"
#include "protocol/sealed/sealed.h"

static void print_rules(void)
{
    printf("# The wire format of farlight, version %u\n\n"
           "Written from `protocol/messages.def`, `words.def`, `tracers.def` and `protocol/docs/guide.md`; "
           "do not edit.\n\n"
           "All numbers are little-endian. A connection begins with the handshake; after it both sides send\n"
           "messages. Lengths are metres, angles radians unless a field says degrees, colours linear Rec. 709,\n"
           "times nanoseconds. Matrices are 3x4 row-major (rows x, y, z; the fourth column is the translation).\n"
           "Identifiers are chosen by the client, unique per scene and kind, and never 0.\n\n",
           HANDSHAKE_VERSION_MAX);
}

static void print_limits(void)
{
    static const struct handshake_limits none;
    struct handshake_limit limit;
    unsigned offset = 48;
    printf("The limits of the daemon. Missing limits at the end are 0 (unknown), further limits are skipped.\n\n"
           "| offset | type | name | limit |\n| ---: | --- | --- | --- |\n");
    for (size_t i = 0; handshake_limit_at(&none, i, &limit); i++) {
        printf("| %u | u%u | `%s` | %s |\n", offset, 8 * limit.bytes, limit.name, limit.what);
        offset += limit.bytes;
    }
    printf("\n");
}

static void print_capabilities(void)
{
    printf("Capabilities are bits; all others are 0:\n\n"
           "| bit | meaning |\n| ---: | --- |\n"
           "| %d | client: it decodes the encoding h264; reply: the daemon encodes it |\n"
           "| %d | reply: this client may read the scene, but not change it |\n"
           "| %d | reply of version 0: this address accepts only sealed connections, as a daemon with a key does "
           "over TCP |\n"
           "| %d | reply of version 0: a later attempt may succeed |\n"
           "| %d | client: frames of views may end unfinished, see `frame_end`; reply: they will |\n\n",
           __builtin_ctzll(HANDSHAKE_CAN_H264), __builtin_ctzll(HANDSHAKE_CAN_READ_ONLY),
           __builtin_ctzll(HANDSHAKE_NEEDS_KEY), __builtin_ctzll(HANDSHAKE_TRY_AGAIN),
           __builtin_ctzll(HANDSHAKE_CAN_ABANDON));
}

static void print_handshake(void)
{
    printf("\n## Handshake\n\n"
           "The layout of the handshake never changes. The client begins, with at most %u bytes:\n\n"
           "| offset | type | field |\n| ---: | --- | --- |\n"
           "| 0 | 4 bytes | `FARL` |\n"
           "| 4 | u16 | version_min, at least 1 |\n"
           "| 6 | u16 | version_max, not below version_min |\n"
           "| 8 | u64 | capabilities that the client understands |\n"
           "| 16 | 16 bytes | nonce |\n"
           "| 32 | u8, bytes | name: at most %u bytes of UTF-8 after their count |\n"
           "| | | zeros up to a multiple of 8 |\n\n",
           HANDSHAKE_HELLO_MAX_BYTES, HANDSHAKE_NAME_MAX_BYTES);
    printf("The reply, at most %u bytes:\n\n"
           "| offset | type | field |\n| ---: | --- | --- |\n"
           "| 0 | 4 bytes | `FARL` |\n"
           "| 4 | u16 | version chosen; 0: the client is refused, the connection ends |\n"
           "| 6 | u16 | limits_bytes, at most 256 |\n"
           "| 8 | u64 | capabilities that both understand |\n"
           "| 16 | 16 bytes | nonce |\n"
           "| 32 | 16 bytes | session token |\n"
           "| 48 | limits_bytes | limits, see below |\n"
           "| | u8, bytes | name of the daemon: at most %u bytes |\n"
           "| | u8, bytes | text: why the client is refused; at most %u bytes |\n"
           "| | | zeros up to a multiple of 8 |\n\n",
           HANDSHAKE_REPLY_MAX_BYTES, HANDSHAKE_NAME_MAX_BYTES, HANDSHAKE_TEXT_MAX_BYTES);
    print_limits();
    print_capabilities();
}

static void print_sealed_messages(void)
{
    printf("## Sealed connections\n\n"
           "If the daemon has a key (%u random bytes, the same at both ends), a connection may begin with four\n"
           "messages that prove it and derive keys for the connection; over TCP it must. Then a third\n"
           "party can neither read nor change the data, repeat it, or cut off its end unnoticed. The bytes of an\n"
           "open connection, from the handshake on, are sent in records, cut anywhere. The first byte of a\n"
           "connection is `S` if it is sealed, else the `F` of the handshake. A daemon that accepts only sealed\n"
           "connections answers an open handshake with version 0 and bit 2 of the capabilities.\n\n",
           SEALED_KEY_BYTES);
    printf("| message | from | bytes | layout |\n| ---: | --- | ---: | --- |\n"
           "| 1 | client | 72 | `SEAL`, u8 1, u8 version (%u), u16 0, X25519 public key (32), nonce (32) |\n"
           "| 2 | server | 72 | `SEAL`, u8 2, u8 status, u16 0, X25519 public key (32), nonce (32) |\n"
           "| 3 | client | 64 | `SEAL`, u8 3, u8 0, u16 0, header of its stream (24), proof (32) |\n"
           "| 4 | server | 64 | `SEAL`, u8 4, u8 status, u16 0, header of its stream (24), proof (32) |\n\n",
           SEALED_VERSION);
    printf("Public keys and nonces are random and used for one connection. The client may send records right\n"
           "after message 3; they are opened only after its proof. A status other than 0 ends its\n"
           "message after 8 bytes, and the connection with it:\n\n| status | meaning |\n| ---: | --- |\n");
    for (enum sealed_status status = SEALED_WRONG_KEY; status <= SEALED_OTHER_VERSION; status++) {
        printf("| %d | %s |\n", (int)status, sealed_status_text(status));
    }
}

static void print_sealed_keys(void)
{
    printf(
        "\nBLAKE2b is that of RFC 7693, X25519 that of RFC 7748; a key of BLAKE2b is its own key parameter.\n"
        "`|` stands for concatenation:\n\n"
        "- down | up = BLAKE2b-512(X25519 of the two keys | client's public key | server's public key), 32 bytes\n"
        "  each (libsodium's crypto_kx). A public key that gives a secret of zeros, or equals the receiver's "
        "own,\n"
        "  is refused.\n"
        "- K(label) = BLAKE2b-256, keyed with the key of the connection, of label | up | down | message 1 |\n"
        "  message 2. A label is ASCII, with zeros up to 32 bytes.\n"
        "- Proof of message 3: BLAKE2b-256, keyed with K(`farlight sealed client proof`), of the first 32 bytes\n"
        "  of message 3.\n"
        "- Proof of message 4: BLAKE2b-256, keyed with K(`farlight sealed server proof`), of message 3 | the\n"
        "  first 32 bytes of message 4.\n"
        "- The streams: libsodium's crypto_secretstream_xchacha20poly1305, begun with the header of message 3\n"
        "  and K(`farlight sealed client stream`), or that of message 4 and K(`farlight sealed server "
        "stream`).\n\n");
    printf(
        "A record is u32 sealed_bytes and that many bytes: one push of the stream, with those 4 bytes as\n"
        "additional data. It has 1 to %u bytes of plain text, 17 fewer than sealed, and the tag MESSAGE (0). The\n"
        "last one of a direction, after the goodbye, has none and the tag FINAL (3). Anything else, a record\n"
        "that does not open, and one after the last, end the connection. A daemon waits before it refuses a\n"
        "wrong key, and refuses all keys for a while from an address that has sent too many wrong ones.\n\n",
        SEALED_PLAIN_MAX_BYTES);
}

static void print_sealed_stream(void)
{
    printf(
        "crypto_secretstream_xchacha20poly1305 in detail, for clients without libsodium (ChaCha20 and Poly1305 of "
        "RFC\n"
        "8439, HChaCha20 as in XChaCha20): k = HChaCha20 of K and bytes 0 to 15 of the header; n = its bytes 16 "
        "to\n"
        "23; a counter begins at 1. A push has the nonce u32 counter | n and takes, of ChaCha20 with k and it,\n"
        "the first 32 bytes of block 0 as the key of Poly1305, block 1 for the tag with 63 zeros behind it, and\n"
        "block 2 and on for the text. Poly1305 goes over the additional data, zeros up to a multiple of 16, the\n"
        "64 sealed bytes of the tag, the sealed text, as many zeros as the text has bytes beyond a multiple of "
        "16,\n"
        "u64 bytes of additional data, u64 64 + bytes of text. The sealed bytes of the record are the first\n"
        "sealed byte of the tag, the sealed text and those 16 bytes, of which the first 8 are then mixed into n "
        "by\n"
        "exclusive or; the counter goes up by 1. (After 2^32 - 1 records libsodium makes new keys.)\n\n");
}

static void print_framing(void)
{
    printf("## Messages in the stream\n\n"
           "| offset | type | field |\n| ---: | --- | --- |\n"
           "| 0 | u32 | payload_bytes, without the padding |\n"
           "| 4 | u16 | type; a peer skips an unknown type with the top bit |\n"
           "| 6 | u16 | flags, 0 |\n"
           "| 8 | u32 | request: chosen by the requesting side, repeated by the answer; 0: none |\n"
           "| 12 | u32 | channel |\n"
           "| %u | | payload, then zeros up to a multiple of 8 |\n\n",
           FRAMING_HEADER_BYTES);
    printf("A payload has at most %u bytes, one with bulk data at most %u. An unknown type without the top bit,\n"
           "other flags, a size outside the type's range and a message that the peer may not send end the\n"
           "connection.\n\n",
           CODEC_CONTROL_PAYLOAD_MAX_BYTES, CODEC_BULK_PAYLOAD_MAX_BYTES);
    printf(
        "## Payload\n\n"
        "`u16 struct_bytes` (the size of the fixed fields that follow), the fixed fields, packed, then the\n"
        "counted fields, all in the order of the tables below.\n\n"
        "- Fixed: u8 u16 u32 u64, f32 (never NaN or infinite), enums as u32, byte arrays, and records: u16 bytes\n"
        "  of the record's fixed fields, then the fields.\n"
        "- string: u32 bytes, then UTF-8 without NUL. No terminator.\n"
        "- array: u32 count, then the records, each its fixed fields and then its counted ones.\n"
        "- bulk: u32 bytes, zeros up to a multiple of 8 from the start of the payload, the bytes.\n");
    printf(
        "- A fixed part, of a message or of a record in it, that is shorter and cut between two fields comes "
        "from\n"
        "  an older peer: missing fields have their defaults. A longer one comes from a newer peer: the rest is\n"
        "  skipped.\n"
        "- All counted fields are present. Bytes after the last one are an error.\n\n");
}

static void print_enum(const struct enum_desc *desc)
{
    printf("### %s\n\n%s\n\n| number | text | meaning |\n| ---: | --- | --- |\n", desc->name, desc->doc);
    for (size_t i = 0; i < desc->value_count; i++) {
        printf("| %" PRIu32 " | `%s` | %s |\n", desc->values[i].number, desc->values[i].text, desc->values[i].doc);
    }
    printf("\n");
}

static void print_int_range(const struct field_desc *field)
{
    char text[96];
    if (field->zero_is_default) {
        printf("%s; 0: %s", field_allowed_text(field, text, sizeof(text)),
               field->default_int == 0 ? "the tracer chooses" : "the default");
        return;
    }
    uint64_t type_max = field->width_bytes == 8 ? UINT64_MAX : (UINT64_C(1) << (8 * field->width_bytes)) - 1;
    if (field->min == 0 && field->max == type_max) {
        printf("any");
    } else {
        printf("%" PRIu64 " .. %" PRIu64, field->min, field->max);
    }
}

static void print_field_row(const struct field_desc *field, size_t offset)
{
    if (field_is_counted(field)) {
        printf("| | `%s` | ", field->name);
    } else {
        printf("| %zu | `%s` | ", offset, field->name);
    }
    switch (field->kind) {
    case FIELD_INT:
        printf("u%" PRIu32 " | ", 8 * field->width_bytes);
        print_int_range(field);
        break;
    case FIELD_ENUM:
        printf("enum %s | listed", field->enumeration->name);
        break;
    case FIELD_REAL:
        printf(field->count > 1 ? "f32 x %" PRIu32 " | " : "f32 | ", field->count);
        printf("%g .. %g", (double)field->real_min, (double)field->real_max);
        break;
    case FIELD_BYTES:
        printf("%" PRIu32 " bytes | any", field->count);
        break;
    case FIELD_RECORD:
        printf("u16 %" PRIu32 ", then %s | ", field->width_bytes - 2, field->record()->name);
        break;
    case FIELD_STRING:
        printf("string | at most %" PRIu64 " bytes", field->max);
        break;
    case FIELD_ARRAY:
        printf("array of %s | at most %" PRIu64, field->record()->name, field->max);
        break;
    case FIELD_BULK:
        printf("bulk | at most %" PRIu64 " bytes", field->max);
        break;
    }
    char text[32];
    const bool has_default = field->kind == FIELD_INT ? field->default_int != field->min
                                                      : field->kind == FIELD_REAL && field->default_real > 0.0f;
    if (has_default) {
        printf("; default %s", field_default_text(field, text, sizeof(text)));
    }
    printf(" | %s |\n", field->kind == FIELD_RECORD && !*field->doc ? field->record()->doc : field->doc);
}

static void print_fields(const struct struct_desc *desc, size_t offset)
{
    if (!desc->fields->name) {
        printf("No fields.\n\n");
        return;
    }
    printf("| offset | field | type | allowed | meaning |\n| ---: | --- | --- | --- | --- |\n");
    for (const struct field_desc *field = desc->fields; field->name; field++) {
        print_field_row(field, offset);
        offset += (size_t)field->width_bytes * field->count;
    }
    printf("\n");
}

static const char *sender(uint32_t from)
{
    switch (from) {
    case MESSAGE_FROM_CLIENT:
        return "client to server";
    case MESSAGE_FROM_SERVER:
        return "server to client";
    case MESSAGE_FROM_BOTH:
        return "both ways";
    default:
        return "between a client and its helper programs";
    }
}

static void print_message(const struct message_desc *desc)
{
    const struct struct_desc *body = desc->body();
    printf("### 0x%04x %s\n\n%s.\n\n", desc->info.type, desc->info.name, desc->doc);
    printf("From: %s. Fixed part %" PRIu32 " bytes, payload %" PRIu32 " .. %" PRIu32 " bytes.%s\n\n",
           sender(desc->info.from), body->wire_fixed_bytes, desc->info.payload_min_bytes,
           desc->info.payload_max_bytes,
           (desc->info.type & MESSAGE_TYPE_IGNORABLE) != 0 ? " A peer that does not know it may ignore it." : "");
    print_fields(body, 2);
}

static void print_predicted(void)
{
    printf(
        "## The encoding `predicted`\n\n"
        "A frame of Zstandard (RFC 8878). The unpacked size is that of the pixels, stored as consecutive\n"
        "planes: plane b has byte b of every pixel, rows from the top, without gaps. Several layers are one "
        "picture of their common height.\n\n"
        "Each byte is stored minus its prediction, modulo 256. The prediction is computed from three bytes of\n"
        "the same plane: left of it (a), above it (b), and left of that (c); bytes outside the picture are 0:\n\n"
        "    c >= max(a, b): min(a, b)\n"
        "    c <= min(a, b): max(a, b)\n"
        "    else:           a + b - c\n\n"
        "So a decoder restores the rows from the top and from left to right, and adds each stored byte to the\n"
        "prediction from the bytes that it has restored.\n\n");
}

static void print_depth(void)
{
    printf(
        "## Depth of the form `inverse`\n\n"
        "`predicted` with two bytes per pixel, the lower one first: a number n. The depth is 1 / (n depth_step),\n"
        "and 1 / depth is off by half of depth_step at most. Where n is 0 there is no surface nearer than\n"
        "2 / depth_step. With f = height / (2 tan(fov_y / 2)) pixels, an eye within the radius R of the frame's\n"
        "eye sees a point at the distance d from it no more than\n\n"
        "    depth_step / 2 * f * R / (1 - R / d)^2\n\n"
        "pixels from its true place; depth_step is 2 depth_pixels / (f depth_radius), f of the frame with its "
        "margin,\n"
        "which has as many pixels per radian as the requested picture.\n\n");
}

static void print_h264(void)
{
    printf("## The encoding `h264`\n\n"
           "The frames of a view with this encoding form one stream, even with other frames between them: each is "
           "an\n"
           "access unit in the byte stream format of ITU-T H.264 annex B, 4:2:0 with 8 bits, colours by BT.709 in "
           "the\n"
           "limited range. Each can be decoded on arrival, since none needs a later one. A key frame is an IDR\n"
           "picture with the parameter sets before it; the stream begins with one, a change of the frames' size\n"
           "causes one, and otherwise only a request (`want_key_frame` of frame_ack). The decoded picture has an\n"
           "even width and height: if the frame's is odd, drop the last column or row.\n\n");
}

static bool copy_file(const char *path)
{
    FILE *file = fopen(path, "r");
    if (!file) {
        perror(path);
        return false;
    }
    for (int byte; (byte = getc(file)) != EOF;) {
        putchar(byte);
    }
    bool ok = !ferror(file);
    fclose(file);
    return ok;
}

int main(int argument_count, char **arguments)
{
    if (argument_count != 2) {
        fprintf(stderr, "usage: %s GUIDE\n", arguments[0]);
        return 2;
    }
    print_rules();
    if (!copy_file(arguments[1])) {
        return 1;
    }
    print_handshake();
    print_sealed_messages();
    print_sealed_keys();
    print_sealed_stream();
    print_framing();
    printf("## Enumerations\n\n");
    for (size_t i = 0; i < protocol_enum_count; i++) {
        print_enum(&protocol_enums[i]);
    }
    printf("## Records\n\nOffsets are from the start of the record.\n\n");
    for (size_t i = 0; i < protocol_record_count; i++) {
        const struct struct_desc *record = protocol_records[i]();
        printf("### %s\n\n%s. At least %" PRIu32 " bytes.\n\n", record->name, record->doc, record->wire_min_bytes);
        print_fields(record, 0);
    }
    printf("## Messages\n\nOffsets are from the start of the payload.\n\n");
    for (size_t i = 0; i < protocol_message_count; i++) {
        print_message(&protocol_messages[i]);
    }
    print_predicted();
    print_depth();
    print_h264();
    docgen_print_example();
    return ferror(stdout) || fflush(stdout) != 0 ? 1 : 0;
}
