/* SPDX-License-Identifier: MIT */
/* Messages that an importer may send. */
#include "lib/relay.h"
#include "tests/harness/test.h"

#include <string.h>

static struct fl_error error;

static struct fl_relay some_relay(void)
{
    return (struct fl_relay){.scene = 5, .request_base = 100, .upload_base = 1000};
}

static enum fl_relay_verdict judge(struct fl_relay *relay, enum message_type type, uint32_t request,
                                   uint32_t channel, uint32_t *mapped)
{
    struct message message;
    message_init(&message, type);
    const struct framing_header header = {.type = (uint16_t)type, .request = request, .channel = channel};
    error = (struct fl_error){0};
    return fl_relay_from_importer(relay, &header, &message, mapped, &error);
}

TEST(an_importer_may_send_blobs_edits_and_its_own_messages_only)
{
    static const enum message_type forwarded[] = {
        MESSAGE_BLOB_OFFER, MESSAGE_BLOB_DATA,   MESSAGE_EDIT_BEGIN, MESSAGE_EDIT_COMMIT,     MESSAGE_SET_NODE,
        MESSAGE_SET_MESH,   MESSAGE_SET_SPHERES, MESSAGE_SET_DISC,   MESSAGE_SET_MATERIAL,    MESSAGE_SET_TEXTURE,
        MESSAGE_SET_LIGHT,  MESSAGE_SET_CAMERA,  MESSAGE_REMOVE,     MESSAGE_SET_ENVIRONMENT, MESSAGE_SET_SKIN,
        MESSAGE_SET_CLIP,   MESSAGE_SET_CHANNEL};
    static const enum message_type local[] = {
        MESSAGE_IMPORT_NOTE, MESSAGE_IMPORT_BOUNDS,   MESSAGE_IMPORT_CLIP, MESSAGE_IMPORT_VARIANT,
        MESSAGE_IMPORT_FILE, MESSAGE_IMPORT_PROGRESS, MESSAGE_IMPORT_DONE};
    static const enum message_type all[] = {
#define MESSAGE(NAME, name, number, from, doc) MESSAGE_##NAME,
#include "protocol/messages.def"
    };
    for (size_t i = 0; i < sizeof(all) / sizeof(all[0]); i++) {
        enum fl_relay_verdict expected = FL_RELAY_REFUSE;
        for (size_t j = 0; j < sizeof(forwarded) / sizeof(forwarded[0]); j++)
            expected = forwarded[j] == all[i] ? FL_RELAY_FORWARD : expected;
        for (size_t j = 0; j < sizeof(local) / sizeof(local[0]); j++)
            expected = local[j] == all[i] ? FL_RELAY_LOCAL : expected;
        struct fl_relay relay = some_relay();
        uint32_t mapped = 0;
        const enum fl_relay_verdict verdict = judge(&relay, all[i], 1, 0, &mapped);
        if (verdict != expected)
            fail_msg("%s: verdict %d in place of %d", message_type_text(all[i]), (int)verdict, (int)expected);
        if (verdict == FL_RELAY_REFUSE)
            assert_int_equal(error.code, FL_ERROR_PROTOCOL);
    }
}

TEST(requests_are_shifted_and_answers_shifted_back)
{
    struct fl_relay relay = some_relay();
    uint32_t mapped = 0, back = 0;
    assert_int_equal(judge(&relay, MESSAGE_BLOB_OFFER, 1, 0, &mapped), FL_RELAY_FORWARD);
    assert_int_equal(mapped, 101);
    assert_int_equal(judge(&relay, MESSAGE_BLOB_DATA, 2, 1, &mapped), FL_RELAY_FORWARD);
    assert_int_equal(mapped, 102);
    struct framing_header answer = {.type = MESSAGE_OK, .request = 102};
    assert_true(fl_relay_from_daemon(&relay, &answer, &back));
    assert_int_equal(back, 2);
    answer.request = 103; /* not the importer's */
    assert_false(fl_relay_from_daemon(&relay, &answer, &back));
    answer.request = 100; /* ours */
    assert_false(fl_relay_from_daemon(&relay, &answer, &back));
    answer = (struct framing_header){.type = MESSAGE_STATS_REPLY, .request = 101};
    assert_false(fl_relay_from_daemon(&relay, &answer, &back));
}

TEST(requests_that_are_not_counted_are_refused)
{
    struct fl_relay relay = some_relay();
    uint32_t mapped = 0;
    assert_int_equal(judge(&relay, MESSAGE_BLOB_OFFER, 0, 0, &mapped), FL_RELAY_REFUSE);
    assert_int_equal(judge(&relay, MESSAGE_BLOB_OFFER, 2000000, 0, &mapped), FL_RELAY_REFUSE);
    assert_int_equal(judge(&relay, MESSAGE_BLOB_OFFER, UINT32_MAX, 0, &mapped), FL_RELAY_REFUSE);
    relay.request_base = UINT32_MAX - 3;
    assert_int_equal(judge(&relay, MESSAGE_BLOB_OFFER, 3, 0, &mapped), FL_RELAY_FORWARD);
    assert_int_equal(judge(&relay, MESSAGE_BLOB_OFFER, 4, 0, &mapped), FL_RELAY_REFUSE);
    assert_int_equal(judge(&relay, MESSAGE_BLOB_OFFER, 3, 2, &mapped), FL_RELAY_REFUSE);
    assert_int_equal(judge(&relay, MESSAGE_SET_NODE, 3, 1, &mapped), FL_RELAY_REFUSE);
}

TEST(only_the_scene_that_is_loaded_can_be_edited)
{
    struct fl_relay relay = some_relay();
    const struct framing_header header = {.type = MESSAGE_EDIT_BEGIN, .request = 1};
    struct message message = {.type = MESSAGE_EDIT_BEGIN};
    uint32_t mapped = 0;
    message.edit_begin.scene = 5;
    assert_int_equal(fl_relay_from_importer(&relay, &header, &message, &mapped, &error), FL_RELAY_REFUSE);
    message.edit_begin.scene = 1;
    assert_int_equal(fl_relay_from_importer(&relay, &header, &message, &mapped, &error), FL_RELAY_FORWARD);
    assert_int_equal(message.edit_begin.scene, 5);
}

TEST(credit_is_counted_from_the_start_of_the_import)
{
    const struct fl_relay relay = some_relay();
    assert_int_equal(fl_relay_credit(&relay, 5000), 4000);
    assert_int_equal(fl_relay_credit(&relay, 900), 0);
}
