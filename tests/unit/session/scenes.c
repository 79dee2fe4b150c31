/* SPDX-License-Identifier: MIT */
/* Several clients on one daemon: scenes that they share, lose and come back to, and clients who may only look. The
 * daemon is the real one but for its renderer. */
#include "tests/unit/session/clients_fixture.h"
#include "tests/harness/test.h"

#define SPHERE_FLOATS 4

static const float sphere[SPHERE_FLOATS] = {1, 2, 3, 0.5f};

static int set_up(void **state)
{
    set_options(state);
    start_daemon();
    return 0;
}

static int set_up_for_readers(void **state)
{
    set_options(state);
    users_look_only = true;
    start_daemon();
    return 0;
}

static int set_up_with_few_blobs(void **state)
{
    set_options(state);
    options.limits.blob_bytes = 300000;
    start_daemon();
    return 0;
}

/* ---- steps ------------------------------------------------------------------------------------------- */

static void submit_attach(struct client *client, uint32_t scene, const char *name)
{
    struct message message = made(MESSAGE_SCENE_ATTACH);
    message.scene_attach.scene = scene;
    message.scene_attach.name = name;
    send_message(client, 100 + scene, 0, &message);
}

static uint64_t attach(struct client *client, uint32_t scene, const char *name)
{
    submit_attach(client, scene, name);
    return expect_ok(client, 100 + scene);
}

static void expect_changed(struct client *client, uint32_t scene, uint64_t revision)
{
    expect(client, MESSAGE_SCENE_CHANGED, 0);
    assert_int_equal(client->message.scene_changed.scene, scene);
    assert_int_equal(client->message.scene_changed.revision, revision);
}

/* Puts the sphere up, with a node that shows it. */
static void commit_sphere(struct client *client, uint32_t scene)
{
    struct record_blob_ref reference = reference_to(sphere, sizeof(sphere));
    if (offer(client, 1, reference)) {
        send_blob(client, 2, &reference, sphere);
        expect_ok(client, 2);
    }
    begin_edit(client, 3, scene);
    struct message message = made(MESSAGE_SET_SPHERES);
    message.set_spheres.spheres = 1;
    message.set_spheres.value.sphere_count = 1;
    message.set_spheres.arrays = &reference;
    message.set_spheres.arrays_count = 1;
    send_message(client, 3, 0, &message);
    message = made(MESSAGE_SET_NODE);
    message.set_node.node = 1;
    message.set_node.value.kind = PROTOCOL_NODE_SPHERES;
    message.set_node.value.object = 1;
    for (int axis = 0; axis < 3; axis++)
        message.set_node.value.parent_from_node[5 * axis] = 1;
    send_message(client, 3, 0, &message);
    commit(client, 3);
    assert_int_equal(expect_ok(client, 3), 1);
}

/* ---- sharing ----------------------------------------------------------------------------------------- */

EACH_TEST(set_up, tear_down)

TEST(an_edit_by_one_appears_to_the_other)
{
    struct client *one = come(false), *other = come(true);
    open_scene_as(one, 1, "model", PROTOCOL_SHARING_SHARED);
    commit_sphere(one, 1);
    assert_int_equal(attach(other, 7, "model"), 1);
    assert_int_equal(render_frame(other, 20, 7), 1);
    assert_int_equal(commit_node(one, 21, 1, 5), 2);
    expect_changed(other, 7, 2);
    assert_int_equal(render_frame(other, 22, 7), 2);
    assert_int_equal(commit_node(other, 23, 7, 6), 3);
    expect_changed(one, 1, 3);
    assert_int_equal(render_frame(one, 24, 1), 3);
}

/* Messages of a view until a frame of that revision has come whole; it is acknowledged. */
static void expect_view_of(struct client *client, uint32_t request, uint64_t revision)
{
    uint64_t shown = 0;
    do {
        receive(client);
        if (client->message.type == MESSAGE_SCENE_CHANGED)
            continue;
        assert_int_equal(client->header.request, request);
        if (client->message.type == MESSAGE_FRAME_BEGIN) {
            assert_true(client->message.frame_begin.revision >= shown);
            shown = client->message.frame_begin.revision;
        } else if (client->message.type == MESSAGE_ERROR) {
            fail_msg("%s: %s", client->message.error.field, client->message.error.text);
        } else if (client->message.type == MESSAGE_FRAME_END) {
            struct message ack = made(MESSAGE_FRAME_ACK);
            ack.frame_ack.channel = request;
            ack.frame_ack.frame = client->message.frame_end.frame;
            ack.frame_ack.whole = 1;
            send_message(client, 0, 0, &ack);
        }
    } while (client->message.type != MESSAGE_FRAME_END || shown < revision);
    assert_int_equal(shown, revision);
}

TEST(a_view_at_rest_shows_what_another_client_changes)
{
    struct client *one = come(false), *other = come(true);
    open_scene_as(one, 1, "model", PROTOCOL_SHARING_SHARED);
    commit_sphere(one, 1);
    attach(other, 7, "model");
    struct message message = made(MESSAGE_RENDER);
    message.render.picture.width = message.render.picture.height = 1;
    message.render.kind = PROTOCOL_JOB_VIEW;
    message.render.scene = 7;
    message.render.channel = 20;
    message.render.credit = 1000;
    message.render.frames_per_second = 1000;
    send_message(other, 20, 0, &message);
    expect_view_of(other, 20, 1);
    assert_int_equal(commit_node(one, 21, 1, 5), 2);
    expect_view_of(other, 20, 2);
    assert_int_equal(commit_node(one, 22, 1, 6), 3);
    expect_view_of(other, 20, 3);
}

TEST(many_changes_reach_a_slow_reader_as_one)
{
    enum { CHANGES = 200 };
    struct client *one = come(false), *other = come(false);
    open_scene_as(one, 1, "model", PROTOCOL_SHARING_SHARED);
    attach(other, 1, "model");
    for (uint32_t i = 1; i <= CHANGES; i++)
        assert_int_equal(commit_node(one, i, 1, 1), i);
    /* However many are told, they ascend, and the last is the last. */
    uint64_t told = 0;
    while (told < CHANGES) {
        expect(other, MESSAGE_SCENE_CHANGED, 0);
        assert_true(other->message.scene_changed.revision > told);
        told = other->message.scene_changed.revision;
    }
    assert_int_equal(told, CHANGES);
}

/* ---- reading and changing what others made ------------------------------------------------------------ */

static void get_object(struct client *client, uint32_t request, uint32_t scene, enum protocol_object_kind kind,
                       uint32_t object)
{
    struct message message = made(MESSAGE_OBJECT_GET);
    message.object_get.scene = scene;
    message.object_get.kind = kind;
    message.object_get.object = object;
    send_message(client, request, 0, &message);
}

/* Sets a material's roughness if it is as it was at that revision. */
static void submit_material(struct client *client, uint32_t request, uint64_t base_revision, float roughness)
{
    struct message message = made(MESSAGE_EDIT_BEGIN);
    message.edit_begin.scene = 1;
    message.edit_begin.base_revision = base_revision;
    send_message(client, request, 0, &message);
    message = made(MESSAGE_SET_MATERIAL);
    message.set_material.material = 8;
    message.set_material.value.roughness = roughness;
    message.set_material.name = "steel";
    send_message(client, request, 0, &message);
    commit(client, request);
}

TEST(an_object_is_read_as_it_was_set)
{
    struct client *one = come(false), *other = come(true);
    open_scene_as(one, 1, "model", PROTOCOL_SHARING_SHARED);
    commit_sphere(one, 1);
    submit_material(one, 20, 0, 0.25f);
    assert_int_equal(expect_ok(one, 20), 2);
    attach(other, 4, "model");
    get_object(other, 5, 4, PROTOCOL_OBJECT_MATERIAL, 8);
    expect(other, MESSAGE_SET_MATERIAL, 5);
    assert_true(other->message.set_material.value.roughness == 0.25f);
    assert_string_equal(other->message.set_material.name, "steel");
    assert_int_equal(expect_ok(other, 5), 2);
    get_object(other, 6, 4, PROTOCOL_OBJECT_NODE, 1);
    expect(other, MESSAGE_SET_NODE, 6);
    assert_int_equal(other->message.set_node.value.kind, PROTOCOL_NODE_SPHERES);
    expect_ok(other, 6);
    get_object(other, 6, 4, PROTOCOL_OBJECT_ENVIRONMENT, 1); /* black until it is set */
    expect(other, MESSAGE_SET_ENVIRONMENT, 6);
    assert_true(other->message.set_environment.value.colour[0] == 0 &&
                other->message.set_environment.value.keeps_image == 1);
    expect_ok(other, 6);
    /* Objects that do not exist, or cannot be read, are an error of that request. */
    get_object(other, 7, 4, PROTOCOL_OBJECT_MATERIAL, 9);
    expect_error(other, 7, PROTOCOL_ERROR_UNKNOWN_ID);
    get_object(other, 8, 4, PROTOCOL_OBJECT_SPHERES, 1);
    expect_error(other, 8, PROTOCOL_ERROR_UNSUPPORTED);
    get_object(other, 8, 4, PROTOCOL_OBJECT_ENVIRONMENT, 2);
    expect_error(other, 8, PROTOCOL_ERROR_UNKNOWN_ID);
    get_object(other, 9, 5, PROTOCOL_OBJECT_NODE, 1);
    expect_error(other, 9, PROTOCOL_ERROR_UNKNOWN_ID);
    assert_string_equal(other->message.error.field, "object_get.scene");
}

TEST(objects_are_listed_by_name_and_page_by_page)
{
    struct client *one = come(false);
    open_scene_as(one, 1, "model", PROTOCOL_SHARING_SHARED);
    struct message message = made(MESSAGE_EDIT_BEGIN);
    message.edit_begin.scene = 1;
    send_message(one, 2, 0, &message);
    for (uint32_t i = 1; i <= 300; i++) {
        message = made(MESSAGE_SET_MATERIAL);
        message.set_material.material = i;
        message.set_material.name = i == 7 ? "steel" : "paint";
        send_message(one, 2, 0, &message);
    }
    commit(one, 2);
    expect_ok(one, 2);
    struct message question = made(MESSAGE_SCENE_OBJECTS);
    const struct message_scene_objects_reply *reply = &one->message.scene_objects_reply;
    question.scene_objects.scene = 1;
    question.scene_objects.kind = PROTOCOL_OBJECT_MATERIAL;
    bool seen[301] = {false};
    uint32_t count = 0, pages = 0;
    do {
        send_message(one, 3, 0, &question);
        expect(one, MESSAGE_SCENE_OBJECTS_REPLY, 3);
        assert_int_equal(reply->revision, 1);
        assert_int_equal(reply->total, 300);
        for (uint32_t i = 0; i < reply->objects_count; i++, count++) {
            assert_false(seen[reply->objects[i].object]);
            seen[reply->objects[i].object] = true;
        }
        question.scene_objects.from = reply->next;
        pages++;
    } while (reply->next);
    assert_int_equal(count, 300);
    assert_int_equal(pages, 2);
    question.scene_objects.from = 0;
    question.scene_objects.name = "steel";
    send_message(one, 4, 0, &question);
    expect(one, MESSAGE_SCENE_OBJECTS_REPLY, 4);
    assert_int_equal(reply->objects_count, 1);
    assert_int_equal(reply->objects[0].object, 7);
    assert_int_equal(reply->next, 0);
    question.scene_objects.name = "";
    question.scene_objects.object = 7;
    send_message(one, 5, 0, &question);
    expect(one, MESSAGE_SCENE_OBJECTS_REPLY, 5);
    assert_int_equal(reply->objects_count, 1);
    assert_string_equal(reply->objects[0].name, "steel");
    /* A place that no list has is its end. */
    question.scene_objects.object = 0;
    question.scene_objects.from = UINT32_MAX;
    send_message(one, 6, 0, &question);
    expect(one, MESSAGE_SCENE_OBJECTS_REPLY, 6);
    assert_int_equal(reply->objects_count, 0);
    assert_int_equal(reply->next, 0);
}

TEST(an_edit_of_what_has_changed_since_it_was_read_is_refused)
{
    struct client *one = come(false), *other = come(true);
    open_scene_as(one, 1, "model", PROTOCOL_SHARING_SHARED);
    commit_sphere(one, 1);
    submit_material(one, 20, 1, 0.25f); /* the material does not exist */
    expect_error(one, 20, PROTOCOL_ERROR_CONFLICT);
    submit_material(one, 21, 0, 0.25f);
    assert_int_equal(expect_ok(one, 21), 2);
    attach(other, 1, "model");
    submit_material(other, 22, 2, 0.5f);
    assert_int_equal(expect_ok(other, 22), 3);
    expect_changed(one, 1, 3);
    submit_material(one, 23, 2, 0.75f);
    expect_error(one, 23, PROTOCOL_ERROR_CONFLICT);
    assert_int_equal(one->message.error.retryable, 1);
    assert_string_equal(one->message.error.field, "edits[0] (material 8)");
    /* A change of another object is no conflict. */
    assert_int_equal(commit_node(other, 24, 1, 6), 4);
    expect_changed(one, 1, 4);
    submit_material(one, 25, 3, 0.75f);
    assert_int_equal(expect_ok(one, 25), 5);
    get_object(one, 26, 1, PROTOCOL_OBJECT_MATERIAL, 8);
    expect(one, MESSAGE_SET_MATERIAL, 26);
    assert_true(one->message.set_material.value.roughness == 0.75f);
}

TEST(contents_of_a_scene_are_reported)
{
    struct client *one = come(false), *other = come(true);
    open_scene_as(one, 1, "model", PROTOCOL_SHARING_SHARED);
    open_scene_as(one, 2, "mine", PROTOCOL_SHARING_KEPT);
    commit_sphere(one, 1);
    attach(other, 4, "model");
    struct message message = made(MESSAGE_SCENE_DESCRIBE);
    message.scene_describe.scene = 4;
    send_message(other, 5, 0, &message);
    expect(other, MESSAGE_SCENE_DESCRIPTION, 5);
    const struct message_scene_description *told = &other->message.scene_description;
    assert_int_equal(told->revision, 1);
    assert_int_equal(told->spheres, 1);
    assert_int_equal(told->empty, 0);
    for (int axis = 0; axis < 3; axis++)
        assert_true(told->lower_world[axis] == sphere[axis] - 0.5f &&
                    told->upper_world[axis] == sphere[axis] + 0.5f);
    message.scene_describe.scene = 5;
    send_message(other, 6, 0, &message);
    expect_error(other, 6, PROTOCOL_ERROR_UNKNOWN_ID);
    assert_string_equal(other->message.error.field, "scene_describe.scene");

    message = made(MESSAGE_SCENE_LIST);
    send_message(other, 7, 0, &message);
    expect(other, MESSAGE_SCENE_LIST_REPLY, 7);
    assert_int_equal(other->message.scene_list_reply.scenes_count, 1);
    assert_string_equal(other->message.scene_list_reply.scenes[0].name, "model");
    assert_int_equal(other->message.scene_list_reply.scenes[0].clients, 2);
    send_message(one, 7, 0, &message);
    expect(one, MESSAGE_SCENE_LIST_REPLY, 7);
    assert_int_equal(one->message.scene_list_reply.scenes_count, 2);
    assert_string_equal(one->message.scene_list_reply.scenes[0].name, "mine");
    assert_int_equal(one->message.scene_list_reply.scenes[0].sharing, PROTOCOL_SHARING_KEPT);
}

TEST(scenes_that_cannot_be_attached_are_refused_by_field)
{
    struct client *one = come(false), *other = come(true);
    open_scene_as(one, 1, "kept", PROTOCOL_SHARING_KEPT);
    submit_attach(other, 1, "kept");
    expect_error(other, 101, PROTOCOL_ERROR_UNKNOWN_ID);
    assert_string_equal(other->message.error.field, "scene_attach.name");
    attach(one, 2, "kept");
    submit_attach(one, 2, "kept");
    expect_error(one, 102, PROTOCOL_ERROR_INVALID);
    assert_string_equal(one->message.error.field, "scene_attach.scene");
    open_scene_as(one, 3, "", PROTOCOL_SHARING_PRIVATE);
    submit_attach(one, 4, "kept");
    expect_error(one, 104, PROTOCOL_ERROR_LIMIT); /* attached ones count as well */
    /* The number of one that failed is free. */
    open_scene_as(other, 1, "", PROTOCOL_SHARING_PRIVATE);
}

/* ---- lost connections -------------------------------------------------------------------------------- */

TEST(a_cut_connection_finds_its_scene_again_without_sending_it)
{
    struct client *witness = come(true), *one = come(false);
    open_scene_as(one, 1, "kept", PROTOCOL_SHARING_KEPT);
    commit_sphere(one, 1);
    cut(one, witness);
    one = come(false);
    assert_int_equal(attach(one, 9, "kept"), 1);
    assert_int_equal(render_frame(one, 20, 9), 1);
    struct record_blob_ref reference = reference_to(sphere, sizeof(sphere));
    assert_int_equal(offer(one, 21, reference), 0); /* the scene holds it */
}

TEST(a_client_that_leaves_a_shared_scene_does_not_change_it)
{
    struct client *witness = come(false), *stranger = come(true);
    open_scene_as(stranger, 1, "shared", PROTOCOL_SHARING_SHARED);
    commit_sphere(stranger, 1);
    open_scene_as(stranger, 2, "kept", PROTOCOL_SHARING_KEPT);
    commit_node(stranger, 30, 2, 1);
    cut(stranger, witness);
    assert_int_equal(attach(witness, 1, "shared"), 1);
    assert_int_equal(render_frame(witness, 20, 1), 1);
    /* Memory of the scene still counts, though it has no name any more; no client can come back to the other
     * scene. */
    struct message message = made(MESSAGE_STATS);
    send_message(witness, 21, 0, &message);
    expect(witness, MESSAGE_STATS_REPLY, 21);
    assert_int_equal(witness->message.stats_reply.blob_bytes, sizeof(sphere));
    assert_int_equal(witness->message.stats_reply.scenes_count, 1);
    assert_int_equal(offer(witness, 22, reference_to(sphere, sizeof(sphere))), 1);
}

TEST_WITH(lingering_scenes_are_evicted_for_blobs, set_up_with_few_blobs, tear_down)
{
    /* Room for one blob of 200,000 bytes, not for two. */
    static float spheres[2][50000];
    for (size_t i = 0; i < sizeof(spheres) / sizeof(spheres[0]); i++) {
        for (size_t k = 0; k < sizeof(spheres[0]) / sizeof(spheres[0][0]); k++)
            spheres[i][k] = (float)(k % 5 + i + 1);
    }
    struct client *one = come(true), *witness = come(false);
    open_scene_as(one, 1, "shared", PROTOCOL_SHARING_SHARED);
    struct record_blob_ref references[2];
    for (int i = 0; i < 2; i++)
        references[i] = reference_to(spheres[i], sizeof(spheres[i]));
    assert_int_equal(offer(one, 1, references[0]), 1);
    send_blob(one, 2, &references[0], spheres[0]);
    expect_ok(one, 2);
    begin_edit(one, 3, 1);
    struct message message = made(MESSAGE_SET_SPHERES);
    message.set_spheres.spheres = 1;
    message.set_spheres.value.sphere_count = 12500;
    message.set_spheres.arrays = references;
    message.set_spheres.arrays_count = 1;
    send_message(one, 3, 0, &message);
    commit(one, 3);
    expect_ok(one, 3);
    cut(one, witness);
    assert_int_equal(offer(witness, 1, references[1]), 1);
    send_blob(witness, 2, &references[1], spheres[1]);
    expect_error(witness, 2, PROTOCOL_ERROR_LIMIT);
    assert_int_equal(witness->message.error.retryable, 1);
    /* The scene ends, and trying again does it; how soon is not said. */
    for (int tries = 0;; tries++) {
        uint32_t request = 10 + (uint32_t)tries;
        send_blob(witness, request, &references[1], spheres[1]);
        receive(witness);
        assert_int_equal(witness->header.request, request);
        if (witness->message.type == MESSAGE_OK)
            break;
        if (tries == 5000)
            fail_msg("%s", witness->message.error.text);
        usleep(1000);
    }
    submit_attach(witness, 1, "shared");
    expect_error(witness, 101, PROTOCOL_ERROR_UNKNOWN_ID);
}

/* ---- what stats tell whom ---------------------------------------------------------------------------- */

static const struct message_stats_reply *stats_of(struct client *client)
{
    struct message message = made(MESSAGE_STATS);
    send_message(client, 778, 0, &message);
    expect(client, MESSAGE_STATS_REPLY, 778);
    return &client->message.stats_reply;
}

static void open_one_of_each(struct client *client)
{
    open_scene_as(client, 1, "private", PROTOCOL_SHARING_PRIVATE);
    open_scene_as(client, 2, "kept", PROTOCOL_SHARING_KEPT);
    open_scene_as(client, 3, "shared", PROTOCOL_SHARING_SHARED);
}

static void expect_scene_names(struct client *client, uint32_t count, const char *const names[])
{
    const struct message_stats_reply *stats = stats_of(client);
    assert_int_equal(stats->scenes_count, count);
    for (uint32_t i = 0; i < count; i++)
        assert_string_equal(stats->scenes[i].name, names[i]);
}

TEST(what_others_keep_to_themselves_has_no_name_in_stats)
{
    struct client *owner = come(true), *other = come(true);
    open_one_of_each(owner);
    expect_scene_names(owner, 3, (const char *const[]){"private", "kept", "shared"});
    expect_scene_names(other, 3, (const char *const[]){"", "", "shared"});
    const struct message_stats_reply *stats = stats_of(other);
    assert_int_equal(stats->clients_count, 2);
    for (uint32_t i = 0; i < 2; i++)
        assert_int_equal(strncmp(stats->clients[i].name, "test (", 6), 0);
}

static void start_job(struct client *client, uint32_t scene, uint32_t channel)
{
    struct message message = made(MESSAGE_RENDER);
    message.render.scene = scene;
    message.render.channel = channel;
    message.render.first_frame = 10;
    message.render.last_frame = 19;
    message.render.frame_step = 3;
    message.render.credit = 0;
    message.render.picture.width = message.render.picture.height = 16;
    message.render.tracing.tracer = PROTOCOL_TRACER_NAIVE;
    send_message(client, 800 + scene, 0, &message);
}

TEST(a_job_is_told_with_its_owner_its_frames_and_the_name_of_a_scene_that_is_no_secret)
{
    struct client *owner = come(true), *other = come(true);
    open_one_of_each(owner);
    for (uint32_t scene = 1; scene <= 3; scene++)
        start_job(owner, scene, 10 + scene);
    const struct message_stats_reply *stats = stats_of(owner);
    assert_int_equal(stats->running_count, 3);
    const struct message_stats_reply *told = stats_of(other);
    assert_int_equal(told->running_count, 3);
    unsigned named = 0;
    for (uint32_t i = 0; i < 3; i++) {
        const struct record_job_stat *job = &told->running[i];
        assert_int_equal(job->client, 1);
        assert_int_equal(job->frames_sent, 0);
        assert_int_equal(job->frames_total, 4);
        assert_int_equal(job->frame, 10);
        assert_int_equal(job->kind, PROTOCOL_JOB_BATCH);
        assert_int_equal(job->tracer, PROTOCOL_TRACER_NAIVE);
        assert_true(job->owner[0] != '\0');
        assert_true(job->scene[0] == '\0' || strcmp(job->scene, "shared") == 0);
        named += job->scene[0] != '\0';
    }
    assert_int_equal(named, 1);
}

TEST_WITH(a_reader_hears_of_no_other_client, set_up_for_readers, tear_down)
{
    struct client *owner = come(true), *reader = come(false);
    open_one_of_each(owner);
    expect_scene_names(reader, 1, (const char *const[]){"shared"});
    const struct message_stats_reply *stats = stats_of(reader);
    assert_int_equal(stats->clients_count, 1);
    assert_int_equal(stats->clients[0].client, 2);
    assert_int_equal(stats_of(owner)->clients_count, 2);
}

/* ---- readers ----------------------------------------------------------------------------------------- */

TEST_WITH(a_reader_looks_and_changes_nothing, set_up_for_readers, tear_down)
{
    struct client *writer = come(true), *reader = come(false);
    assert_int_equal(writer->capabilities & HANDSHAKE_CAN_READ_ONLY, 0);
    assert_int_equal(reader->capabilities & HANDSHAKE_CAN_READ_ONLY, HANDSHAKE_CAN_READ_ONLY);
    open_scene_as(writer, 1, "model", PROTOCOL_SHARING_SHARED);
    commit_sphere(writer, 1);
    assert_int_equal(attach(reader, 1, "model"), 1);
    assert_int_equal(render_frame(reader, 20, 1), 1);

    submit_open(reader, 2, "", PROTOCOL_SHARING_PRIVATE);
    expect_error(reader, 102, PROTOCOL_ERROR_DENIED);
    assert_true(reader->message.error.remedy[0] != '\0');
    struct record_blob_ref reference = reference_to(sphere, sizeof(sphere));
    struct message message = made(MESSAGE_BLOB_OFFER);
    message.blob_offer.blobs = &reference;
    message.blob_offer.blobs_count = 1;
    send_message(reader, 21, 0, &message);
    expect_error(reader, 21, PROTOCOL_ERROR_DENIED);
    send_blob(reader, 22, &reference, sphere);
    expect_error(reader, 22, PROTOCOL_ERROR_DENIED);
    /* The whole transaction has one answer, as its edits are on their way when it is refused. */
    begin_edit(reader, 23, 1);
    message = made(MESSAGE_SET_NODE);
    message.set_node.node = 1;
    send_message(reader, 23, 0, &message);
    commit(reader, 23);
    expect_error(reader, 23, PROTOCOL_ERROR_DENIED);
    assert_int_equal(render_frame(reader, 24, 1), 1); /* unchanged */
}
