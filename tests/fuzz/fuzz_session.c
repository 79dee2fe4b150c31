/* SPDX-License-Identifier: MIT */
/* Whole sessions of up to three clients against the real dispatcher, connections and loop, with the recorder for
 * an engine. The input is a list of steps, each of which begins with kind | client << 2 | settle << 4:
 *
 * - kind 0, bytes: u16 count, that many bytes as they are.
 * - kind 1, message: u8 which of the client's messages, u8 request, u8 channel, u16 count, that many bytes of
 *   payload. It gets a header that fits, so that an input's changes reach what is behind the framing.
 * - kind 2, time: u8, the square of which passes in ms.
 * - kind 3, circumstance: u8. 0 .. 15: the recorder's mood; 16: the client connects or goes; 17: it says hello;
 * 18: it reads no more, or again; 19: the daemon stops; 20: the client may only look. */
#include "protocol/describe.h"
#include "tests/fuzz/engine_recorder.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/serving.h"

#include "base/log.h"

#include <string.h>

struct input {
    const uint8_t *next, *end;
};

static unsigned take(struct input *input)
{
    return input->next < input->end ? *input->next++ : 0;
}

static size_t take_count(struct input *input)
{
    size_t count = take(input);
    count |= (size_t)take(input) << 8;
    size_t left = (size_t)(input->end - input->next);
    return count < left ? count : left;
}

static void send_bytes(unsigned client, struct input *input)
{
    size_t count = take_count(input);
    if (serving_clients[client].fd >= 0)
        serving_send(client, input->next, count);
    input->next += count;
}

/* Message that a client may send. */
static const struct message_info *client_message(unsigned number)
{
    const struct message_info *found[64];
    size_t count = 0;
    for (size_t i = 0; i < protocol_message_count && count < 64; i++) {
        if (protocol_messages[i].info.from & MESSAGE_FROM_CLIENT)
            found[count++] = &protocol_messages[i].info;
    }
    return found[number % count];
}

static void send_message(unsigned client, struct input *input)
{
    static const uint8_t zeros[8];
    struct framing_header header = {.type = client_message(take(input))->type};
    header.request = take(input);
    header.channel = take(input);
    size_t count = take_count(input);
    header.payload_bytes = (uint32_t)count;
    uint8_t head[FRAMING_HEADER_BYTES];
    framing_header_encode(head, &header);
    if (serving_clients[client].fd >= 0 && serving_send(client, head, sizeof(head)) &&
        serving_send(client, input->next, count))
        serving_send(client, zeros, -count & 7);
    input->next += count;
}

static void change(unsigned client, unsigned what)
{
    if (what < 16) {
        recorder_set_mood(what);
    } else if (what == 16 && serving_clients[client].fd >= 0) {
        serving_disconnect(client);
    } else if (what == 16) {
        serving_connect(client);
    } else if (what == 17 && serving_clients[client].fd >= 0) {
        serving_greet(client);
    } else if (what == 18) {
        serving_clients[client].stalled = !serving_clients[client].stalled;
    } else if (what == 19 && !serving_hub.stopping) {
        hub_stop(&serving_hub);
    } else if (what == 20) {
        serving_restrict(client);
    }
}

static void pass_time(unsigned amount)
{
    serving_wait(amount * amount * UINT64_C(1000000));
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct input input = {data, data + size};
    log_set_level(LOG_ERROR);
    serving_begin();
    while (input.next < input.end) {
        unsigned step = take(&input), client = (step >> 2 & 3) % SERVING_CLIENTS;
        switch (step & 3) {
        case 0:
            send_bytes(client, &input);
            break;
        case 1:
            send_message(client, &input);
            break;
        case 2:
            pass_time(take(&input));
            break;
        case 3:
            change(client, take(&input));
            break;
        }
        if (step & 16)
            serving_settle();
    }
    serving_end();
    return 0;
}
