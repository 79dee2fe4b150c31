/* SPDX-License-Identifier: MIT */
/* Edits of a client over a socketpair: transactions, blobs, moving objects. */
#include "tests/unit/session/answering_engine.h"
#include "tests/harness/test.h"

static void send_piece(uint32_t request, const struct record_blob_ref *reference, const uint8_t *data,
                       size_t offset, size_t bytes)
{
    struct message message = made(MESSAGE_BLOB_DATA);
    message.blob_data.offset_bytes = offset;
    memcpy(message.blob_data.hash, reference->hash, sizeof(reference->hash));
    message.blob_data.data = data + offset;
    message.blob_data.data_bytes = (uint32_t)bytes;
    send_message(request, 1, &message);
}

/* Sends as far as credit goes, waiting for more by pings. */
static void send_blob(uint32_t request, const struct record_blob_ref *reference, const uint8_t *data)
{
    static uint64_t sent;
    if (served.hub.sessions.count && client.upload_credit <= 1 << 20)
        sent = 0;
    for (size_t offset = 0; offset < reference->size_bytes;) {
        size_t piece = reference->size_bytes - offset < 262144 ? (size_t)reference->size_bytes - offset : 262144;
        while (client.upload_credit < sent + piece)
            expect_alive(9999);
        send_piece(request, reference, data, offset, piece);
        offset += piece;
        sent += piece;
    }
}

SESSION_TEST(edits_are_gathered_and_committed_together)
{
    open_scene(1, 1);
    begin_edit(2, 1);
    for (uint32_t node = 1; node <= 10; node++)
        send_node(2, node, 0);
    commit(2);
    expect(MESSAGE_OK, 2);
    assert_int_equal(client.message.ok.revision, 1);
    assert_int_equal(atomic_load(&engine.edits), 10);
}

SESSION_TEST(a_failed_transaction_has_one_answer_and_what_follows_it_is_skipped)
{
    open_scene(1, 1);
    begin_edit(2, 9); /* no such scene */
    send_node(2, 1, 0);
    commit(2);
    expect_error(2, PROTOCOL_ERROR_UNKNOWN_ID);
    begin_edit(3, 1);
    for (uint32_t node = 1; node <= 12; node++) /* two more than fit */
        send_node(3, node, 0);
    commit(3);
    expect_error(3, PROTOCOL_ERROR_LIMIT);
    expect_alive(4);
    begin_edit(3, 1); /* the number is free again */
    send_node(3, 1, 0);
    commit(3);
    expect(MESSAGE_OK, 3);
    assert_int_equal(atomic_load(&engine.edits), 1);
}

SESSION_TEST(edits_count_until_their_transaction_is_answered)
{
    atomic_store(&engine.keep_commits, true);
    open_scene(1, 1);
    begin_edit(2, 1);
    for (uint32_t node = 1; node <= 10; node++)
        send_node(2, node, 0);
    commit(2);
    begin_edit(3, 1);
    send_node(3, 11, 0);
    expect_error(3, PROTOCOL_ERROR_LIMIT);
    assert_string_not_equal(client.message.error.remedy, "");
    release_commit();
    expect(MESSAGE_OK, 2);
    begin_edit(4, 1);
    for (uint32_t node = 1; node <= 10; node++)
        send_node(4, node, 0);
    commit(4);
    release_commit();
    expect(MESSAGE_OK, 4);
}

SESSION_TEST(edits_take_no_more_memory_than_the_limit)
{
    static struct record_material_range ranges[2048];
    struct message message = made(MESSAGE_SET_MESH);
    message.set_mesh.mesh = 1;
    message.set_mesh.ranges = ranges;
    message.set_mesh.ranges_count = 2048; /* 24 KiB of the 64, where there is room for some more edits */
    open_scene(1, 1);
    begin_edit(2, 1);
    send_message(2, 0, &message);
    begin_edit(3, 1);
    send_message(3, 0, &message);
    expect_error(3, PROTOCOL_ERROR_LIMIT);
    assert_non_null(strstr(client.message.error.remedy, "memory.transactions"));
    commit(2);
    expect(MESSAGE_OK, 2);
    begin_edit(4, 1);
    send_message(4, 0, &message);
    commit(4);
    expect(MESSAGE_OK, 4);
}

SESSION_TEST(a_mesh_with_a_blob_that_is_not_held_names_it)
{
    open_scene(1, 1);
    begin_edit(2, 1);
    struct record_blob_ref reference = {.size_bytes = 36, .hash = {0xab, 0xcd}};
    struct message message = made(MESSAGE_SET_MESH);
    message.set_mesh.mesh = 5;
    message.set_mesh.arrays = &reference;
    message.set_mesh.arrays_count = 1;
    send_message(2, 0, &message);
    expect_error(2, PROTOCOL_ERROR_UNKNOWN_ID);
    assert_non_null(strstr(client.message.error.text, "abcd0000"));
    assert_string_equal(client.message.error.field, "set_mesh 5.arrays[0]");
}

SESSION_TEST(a_blob_is_sent_once_and_needed_no_more)
{
    size_t bytes = ((size_t)2 << 20) + 12345;
    uint8_t *data = malloc(bytes);
    for (size_t i = 0; i < bytes; i++)
        data[i] = (uint8_t)(i ^ i >> 9);
    struct record_blob_ref reference = reference_to(data, bytes);
    assert_int_equal(offer(1, reference), 1);
    send_blob(2, &reference, data);
    expect(MESSAGE_OK, 2);
    assert_int_equal(offer(3, reference), 0);
    free(data);
}

SESSION_TEST(a_blob_with_another_hash_is_refused_and_can_be_sent_again)
{
    uint8_t data[1000] = {1, 2, 3}, wrong[1000] = {3, 2, 1};
    struct record_blob_ref reference = reference_to(data, sizeof(data));
    assert_int_equal(offer(1, reference), 1);
    send_piece(2, &reference, wrong, 0, 1000);
    expect_error(2, PROTOCOL_ERROR_HASH_MISMATCH);
    send_piece(3, &reference, data, 0, 500);
    send_piece(3, &reference, data, 400, 500); /* not where it belongs */
    send_piece(3, &reference, data, 500, 500); /* the request has its answer */
    expect_error(3, PROTOCOL_ERROR_INVALID);
    send_piece(4, &reference, data, 0, 500);
    send_piece(4, &reference, data, 500, 500);
    expect(MESSAGE_OK, 4);
}

SESSION_TEST(a_size_that_is_only_declared_takes_no_room_from_others)
{
    static uint8_t data[3 << 20];
    struct record_blob_ref large = {.size_bytes = 6 << 20, .hash = {1}},
                           beyond = {.size_bytes = 9 << 20, .hash = {2}};
    assert_int_equal(offer(1, large), 1);
    send_piece(2, &large, data, 0, 8);
    assert_int_equal(offer(3, beyond), 1);
    send_piece(4, &beyond, data, 0, 8);
    expect_error(4, PROTOCOL_ERROR_LIMIT);
    struct record_blob_ref whole = reference_to(data, sizeof(data));
    assert_int_equal(offer(5, whole), 1);
    for (size_t offset = 0; offset < sizeof(data); offset += 131072) {
        while (client.upload_credit < 16 + offset + 131072)
            expect_alive(9999);
        send_piece(6, &whole, data, offset, 131072);
    }
    expect(MESSAGE_OK, 6);
}

SESSION_TEST(made_up_hashes_with_the_same_head_stay_distinct)
{
    uint8_t data[100] = {7};
    struct record_blob_ref references[3] = {reference_to(data, sizeof(data))};
    for (uint8_t i = 1; i < 3; i++) {
        references[i] = references[0];
        references[i].hash[31] ^= i;
    }
    for (uint32_t i = 0; i < 3; i++)
        assert_int_equal(offer(1 + i, references[i]), 1);
    send_piece(4, &references[0], data, 0, sizeof(data));
    expect(MESSAGE_OK, 4);
    assert_int_equal(offer(5, references[0]), 0);
    assert_int_equal(offer(6, references[1]), 1);
    assert_int_equal(offer(7, references[2]), 1);
}

SESSION_TEST(blob_data_on_another_channel_ends_the_connection)
{
    static const uint8_t data[100];
    struct record_blob_ref reference = reference_to(data, sizeof(data));
    assert_int_equal(offer(1, reference), 1);
    struct message message = made(MESSAGE_BLOB_DATA);
    message.blob_data.data = data;
    message.blob_data.data_bytes = sizeof(data);
    memcpy(message.blob_data.hash, reference.hash, sizeof(reference.hash));
    send_message(2, 7, &message);
    expect_error(0, PROTOCOL_ERROR_PROTOCOL);
    expect(MESSAGE_GOODBYE, 0);
    expect_end();
}

/* ---- what moves --------------------------------------------------------------------------------------- */

static struct record_blob_ref upload(uint32_t request, const void *data, size_t bytes)
{
    struct record_blob_ref reference = reference_to(data, bytes);
    assert_int_equal(offer(request, reference), 1);
    send_blob(request + 1, &reference, data);
    expect(MESSAGE_OK, request + 1);
    return reference;
}

static void send_skinned(uint32_t request, struct record_blob_ref *joints_and_matrices,
                         struct record_blob_ref *floats)
{
    struct record_morph_weight weights[] = {{0.25f}, {-4}};
    struct message message = made(MESSAGE_SET_NODE);
    message.set_node.node = 7;
    message.set_node.value.kind = PROTOCOL_NODE_MESH;
    message.set_node.value.object = 3;
    message.set_node.value.skin = 5;
    message.set_node.weights = weights;
    message.set_node.weights_count = 2;
    send_message(request, 0, &message);
    message = made(MESSAGE_SET_MESH);
    message.set_mesh.mesh = 3;
    message.set_mesh.value.influence_count = 4;
    message.set_mesh.value.target_count = 2;
    message.set_mesh.weights = weights + 1;
    message.set_mesh.weights_count = 1;
    send_message(request, 0, &message);
    message = made(MESSAGE_SET_SKIN);
    message.set_skin.skin = 5;
    message.set_skin.value.joint_count = 1;
    message.set_skin.arrays = joints_and_matrices;
    message.set_skin.arrays_count = 2;
    message.set_skin.name = "bones";
    send_message(request, 0, &message);
    message = made(MESSAGE_SET_CLIP);
    message.set_clip.clip = 6;
    message.set_clip.arrays = floats;
    message.set_clip.arrays_count = 1;
    message.set_clip.name = "run";
    send_message(request, 0, &message);
    message = made(MESSAGE_SET_CHANNEL);
    message.set_channel = (struct message_set_channel){
        .channel = 8,
        .value.clip = 6,
        .value.path = PROTOCOL_CHANNEL_LIGHT_SIZE,
        .value.object = 9,
        .value.interpolation = PROTOCOL_INTERPOLATION_BEZIER,
        .value.width = 2,
        .value.key_count = 1,
        .value.first_time = 1,
        .value.first_value = 2,
    };
    send_message(request, 0, &message);
}

SESSION_TEST(skins_clips_and_channels_become_edits)
{
    const uint32_t joint = 7;
    const float matrix[12] = {1, 2, 3}, numbers[3] = {4, 5, 6};
    open_scene(1, 1);
    struct record_blob_ref joints_and_matrices[] = {upload(10, &joint, 4), upload(12, matrix, sizeof(matrix))};
    struct record_blob_ref floats = upload(14, numbers, sizeof(numbers));
    atomic_store(&engine.keep_commits, true);
    begin_edit(2, 1);
    send_skinned(2, joints_and_matrices, &floats);
    commit(2);
    struct engine_command *kept;
    while (!(kept = atomic_load(&engine.kept_commit)))
        usleep(1000);
    assert_int_equal(kept->edit_count, 5);
    const struct scene_node *node = &kept->edits[0].set.node;
    assert_true(kept->edits[0].object == OBJECT_NODE && node->value.skin == 5 && node->weight_count == 2);
    assert_true(node->weights[0] == 0.25f && node->weights[1] == -4.0f);
    const struct scene_mesh *mesh = &kept->edits[1].set.mesh;
    assert_true(mesh->value.influence_count == 4 && mesh->value.target_count == 2);
    assert_true(mesh->weight_count == 1 && mesh->weights[0] == -4.0f);
    const struct scene_skin *skin = &kept->edits[2].set.skin;
    assert_true(kept->edits[2].object == OBJECT_SKIN && skin->base.id == 5 && skin->value.joint_count == 1);
    assert_string_equal(skin->base.name, "bones");
    assert_memory_equal(skin->joints->data, &joint, 4);
    assert_memory_equal(skin->joint_from_mesh->data, matrix, sizeof(matrix));
    const struct scene_clip *clip = &kept->edits[3].set.clip;
    assert_true(kept->edits[3].object == OBJECT_CLIP && clip->base.id == 6);
    assert_memory_equal(clip->floats->data, numbers, sizeof(numbers));
    const struct scene_channel *channel = &kept->edits[4].set.channel;
    assert_true(kept->edits[4].object == OBJECT_CHANNEL && channel->base.id == 8 && channel->value.clip == 6);
    assert_true(channel->value.path == CHANNEL_LIGHT_SIZE && channel->value.object == 9);
    assert_true(channel->value.interpolation == INTERPOLATION_BEZIER && channel->value.width == 2);
    assert_true(channel->value.key_count == 1 && channel->value.first_time == 1 &&
                channel->value.first_value == 2);
    release_commit();
    expect(MESSAGE_OK, 2);
    /* An array that is not held is named. */
    begin_edit(3, 1);
    joints_and_matrices[1].hash[0] ^= 1;
    struct message message = made(MESSAGE_SET_SKIN);
    message.set_skin.skin = 5;
    message.set_skin.arrays = joints_and_matrices;
    message.set_skin.arrays_count = 2;
    send_message(3, 0, &message);
    expect_error(3, PROTOCOL_ERROR_UNKNOWN_ID);
    assert_string_equal(client.message.error.field, "set_skin 5.arrays[1]");
}

SESSION_TEST(weights_count_as_memory_of_a_transaction)
{
    static struct record_material_range ranges[4096];
    static struct record_morph_weight weights[1024];
    open_scene(1, 1);
    begin_edit(2, 1);
    struct message message = made(MESSAGE_SET_MESH); /* 48 of 64 KiB */
    message.set_mesh.ranges = ranges;
    message.set_mesh.ranges_count = 4096;
    send_message(2, 0, &message);
    for (uint32_t node = 1; node <= 4; node++) { /* 4 KiB each */
        message = made(MESSAGE_SET_NODE);
        message.set_node.node = node;
        message.set_node.weights = weights;
        message.set_node.weights_count = 1024;
        send_message(2, 0, &message);
    }
    expect_error(2, PROTOCOL_ERROR_LIMIT);
}
