/* SPDX-License-Identifier: MIT */
/* Any stream: cut in pieces it must give the same messages and the same end as whole.
 * Input: accepted senders, then one byte of piece sizes, then the stream. */
#include <stdlib.h>
#include <string.h>

#include "protocol/framing.h"
#include "tests/fuzz/fuzz.h"

static uint8_t scratch_memory[SCRATCH_BYTES];

static void decode(const struct frame *frame)
{
    struct scratch scratch;
    struct message message;
    scratch_init(&scratch, scratch_memory, sizeof(scratch_memory));
    if (frame->info) {
        message_decode(&message, frame->header.type, frame->payload, frame->header.payload_bytes, &scratch, NULL);
    }
}

/* Parses one message from the bytes so far; `whole` is the result of the whole stream at this place. */
static enum framing_result check_piece(const uint8_t *bytes, size_t count, uint32_t accept,
                                       enum framing_result whole, const struct frame *whole_frame)
{
    struct frame frame;
    struct decode_error error;
    uint8_t *copy = malloc(count > 0 ? count : 1); /* a copy, so that a read beyond its end is seen */
    if (!copy) {
        return FRAMING_FATAL;
    }
    memcpy(copy, bytes, count);
    enum framing_result result = framing_parse(&frame, copy, count, accept, &error);
    if (result == FRAMING_NEED_MORE) {
        FUZZ_REQUIRE(frame.need_bytes > count && frame.need_bytes <= FRAMING_MESSAGE_MAX_BYTES);
        FUZZ_REQUIRE(error.code == PROTOCOL_ERROR_NONE);
    } else if (result == FRAMING_CONSUMED) {
        FUZZ_REQUIRE(whole == FRAMING_CONSUMED && frame.consumed_bytes == whole_frame->consumed_bytes);
        FUZZ_REQUIRE(frame.consumed_bytes <= count && frame.info == whole_frame->info);
        decode(&frame);
    } else {
        FUZZ_REQUIRE(whole == FRAMING_FATAL && error.code != PROTOCOL_ERROR_NONE);
    }
    free(copy);
    return result;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size < 2) {
        return 0;
    }
    uint32_t accept = data[0] & 7u;
    size_t step = (size_t)data[1] + 1;
    data += 2;
    size -= 2;
    while (size > 0) {
        struct frame frame;
        enum framing_result whole = framing_parse(&frame, data, size, accept, NULL);
        size_t end = whole == FRAMING_CONSUMED ? frame.consumed_bytes : size;
        enum framing_result piece = FRAMING_NEED_MORE;
        for (size_t count = 0; count < end && piece == FRAMING_NEED_MORE; count += step) {
            piece = check_piece(data, count, accept, whole, &frame);
            FUZZ_REQUIRE(piece != FRAMING_CONSUMED); /* not before its last byte */
        }
        piece = check_piece(data, end, accept, whole, &frame);
        FUZZ_REQUIRE(piece == whole);
        if (whole != FRAMING_CONSUMED) {
            break;
        }
        data += frame.consumed_bytes;
        size -= frame.consumed_bytes;
    }
    return 0;
}
