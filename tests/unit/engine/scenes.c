/* SPDX-License-Identifier: MIT */
/* Scenes that several clients share, and scenes that outlive those who hold them. */
#include "tests/unit/engine/engine_fake.h"

#include "tests/unit/scene/drafts.h"
#include "tests/harness/test.h"

#define LONG_MS 600000u /* no test takes so long */
#define SHORT_MS 50u

static int begin(void **state)
{
    (void)state;
    start((struct engine_options){.limits.scene_linger_ms = LONG_MS});
    return 0;
}

EACH_TEST(begin, stop_engine)

/* Principals have other numbers than clients, so that neither is taken for the other. */
static uint64_t principal_of(uint64_t client)
{
    return client + 100;
}

static void submit_open(uint64_t client, uint32_t request, const char *name, enum sharing sharing)
{
    struct engine_command *made = command(ENGINE_SCENE_OPEN, client, request);
    made->scene = request;
    made->sharing = sharing;
    made->principal = principal_of(client);
    strcpy(made->name, name);
    submit(made);
}

/* A scene has the number of the request that opened it. */
static void open_as(uint64_t client, uint32_t request, const char *name, enum sharing sharing)
{
    submit_open(client, request, name, sharing);
    assert_int_equal(expect_done(client, request), 0);
}

static void submit_attach(uint64_t client, uint32_t request, const char *name, uint64_t principal)
{
    struct engine_command *made = command(ENGINE_SCENE_ATTACH, client, request);
    made->scene = request;
    made->principal = principal;
    strcpy(made->name, name);
    submit(made);
}

static uint64_t attach(uint64_t client, uint32_t request, const char *name)
{
    submit_attach(client, request, name, principal_of(client));
    return expect_done(client, request);
}

static void attach_fails(uint64_t client, uint32_t request, const char *name)
{
    submit_attach(client, request, name, principal_of(client));
    expect_failed(client, request, ERROR_UNKNOWN_ID, "scene_attach.name");
}

static void expect_changed(uint64_t client, uint32_t scene, uint64_t revision)
{
    struct engine_event *event = expect_event(ENGINE_SCENE_CHANGED, client, 0);
    assert_int_equal(event->scene, scene);
    assert_int_equal(event->revision, revision);
    engine_event_destroy(event);
}

static void close_scene(uint64_t client, uint32_t request, uint32_t scene)
{
    struct engine_command *made = command(ENGINE_SCENE_CLOSE, client, request);
    made->scene = scene;
    submit(made);
}

static void client_goes(uint64_t client)
{
    submit(command(ENGINE_CLIENT_GONE, client, 0));
    expect_forgotten(client);
}

static void expect_ended(void)
{
    engine_event_destroy(expect_event(ENGINE_SCENE_ENDED, 0, 0));
}

static struct engine_command *render_scene(uint64_t client, uint32_t request, uint32_t scene, uint32_t last_frame)
{
    struct engine_command *made = render(client, request, 0, last_frame);
    made->scene = scene;
    return made;
}

/* ---- transactions that are carried out beside the thread ---------------------------------------------- */

/* More than is done at once. */
#define MANY_NODES 1000

static void submit_long_commit(uint64_t client, uint32_t request, uint32_t scene)
{
    submit(commit_of_nodes(client, request, scene, MANY_NODES));
}

TEST(what_follows_a_long_transaction_waits_for_it)
{
    open_as(1, 5, "a", SHARING_SHARED);
    open_as(2, 6, "b", SHARING_PRIVATE);
    attach(2, 7, "a");
    submit_long_commit(1, 10, 5);
    submit_commit(1, 11, 5);
    submit_long_commit(1, 12, 5);
    submit(render_scene(1, 13, 5, 0));
    assert_int_equal(expect_done(1, 10), 1);
    expect_changed(2, 7, 1);
    assert_int_equal(expect_done(1, 11), 2);
    expect_changed(2, 7, 2);
    assert_int_equal(expect_done(1, 12), 3);
    expect_changed(2, 7, 3);
    struct engine_event *event = expect_frame(1, 13, 0);
    assert_int_equal(event->frame->result.revision, 3);
    engine_event_destroy(event);
    expect_done(1, 13);
}

TEST(a_scene_is_closed_after_its_long_transaction)
{
    open_as(1, 5, "", SHARING_PRIVATE);
    submit_long_commit(1, 10, 5);
    close_scene(1, 11, 5);
    assert_int_equal(expect_done(1, 10), 1);
    expect_done(1, 11);
    submit_commit(1, 12, 5);
    expect_failed(1, 12, ERROR_UNKNOWN_ID, "edit_begin.scene");
}

TEST(clients_and_the_engine_may_go_during_a_long_transaction)
{
    for (int round = 0; round < 20; round++) {
        open_as(1, 5, "", SHARING_PRIVATE);
        open_as(2, 6, "", SHARING_PRIVATE);
        submit_long_commit(1, 10, 5);
        submit(command(ENGINE_CLIENT_GONE, 1, 0));
        struct engine_event *event = next_event();
        if (event->kind == ENGINE_DONE) { /* the job was finished before */
            engine_event_destroy(event);
            event = expect_event(ENGINE_CLIENT_FORGOTTEN, 1, 0);
        }
        assert_int_equal(event->kind, ENGINE_CLIENT_FORGOTTEN);
        engine_event_destroy(event);
        submit_long_commit(2, 11, 6);
        if (round % 2)
            assert_int_equal(expect_done(2, 11), 1);
        restart((struct engine_options){0});
    }
}

/* ---- names ------------------------------------------------------------------------------------------- */

TEST(a_shared_scene_is_rendered_by_all_attached_clients)
{
    open_as(1, 5, "a", SHARING_SHARED);
    submit_commit(1, 6, 5);
    expect_done(1, 6);
    assert_int_equal(attach(2, 3, "a"), 1);
    submit(render_scene(2, 4, 3, 0));
    struct engine_event *event = expect_frame(2, 4, 0);
    assert_int_equal(event->frame->result.revision, 1);
    engine_event_destroy(event);
    expect_done(2, 4);
    submit(render_scene(1, 7, 5, 0));
    take_frame(1, 7, 0);
    expect_done(1, 7);
    assert_int_equal(atomic_load(&fake.scenes), 1); /* on the device once */
    /* The other's number for it is no number of one's own. */
    submit(render_scene(2, 8, 5, 0));
    expect_failed(2, 8, ERROR_UNKNOWN_ID, "render.scene");
}

TEST(sharing_decides_which_clients_may_attach)
{
    open_as(1, 1, "private", SHARING_PRIVATE);
    open_as(1, 2, "kept", SHARING_KEPT);
    open_as(1, 3, "shared", SHARING_SHARED);
    attach_fails(1, 4, "private");
    attach_fails(2, 4, "private");
    attach_fails(2, 5, "kept");
    attach(1, 5, "kept");                         /* a second time, under another number */
    submit_attach(3, 5, "kept", principal_of(1)); /* another connection of the same user */
    expect_done(3, 5);
    attach(2, 6, "shared");
    attach_fails(2, 7, "");
    attach_fails(2, 8, "Shared");
    submit_attach(2, 6, "shared", 0);
    expect_failed(2, 6, ERROR_INVALID, "scene_attach.scene");
}

TEST(a_name_names_one_scene_for_each)
{
    open_as(1, 1, "", SHARING_PRIVATE);
    submit_open(1, 2, "", SHARING_KEPT);
    expect_failed(1, 2, ERROR_INVALID, "scene_open.name");
    submit_open(1, 2, "", SHARING_SHARED);
    expect_failed(1, 2, ERROR_INVALID, "scene_open.name");
    open_as(1, 2, "a", SHARING_KEPT);
    submit_open(1, 3, "a", SHARING_KEPT);
    expect_failed(1, 3, ERROR_INVALID, "scene_open.name");
    submit_open(1, 3, "a", SHARING_SHARED);
    expect_failed(1, 3, ERROR_INVALID, "scene_open.name");
    /* A scene that is kept for one client is invisible to another. */
    open_as(2, 1, "a", SHARING_KEPT);
    open_as(3, 1, "a", SHARING_SHARED);
    submit_open(4, 1, "a", SHARING_SHARED);
    expect_failed(4, 1, ERROR_INVALID, "scene_open.name");
    open_as(4, 1, "a", SHARING_PRIVATE); /* for people only */
    /* Nobody can take a name from what others keep. */
    open_as(5, 1, "a", SHARING_KEPT);
    submit_commit(5, 2, 1);
    expect_done(5, 2);
    assert_int_equal(attach(5, 3, "a"), 1);
    /* A client's own scene has precedence over a shared one. */
    submit_commit(2, 2, 1);
    expect_done(2, 2);
    assert_int_equal(attach(2, 3, "a"), 1);
    assert_int_equal(attach(4, 3, "a"), 0);
}

/* ---- changes ----------------------------------------------------------------------------------------- */

TEST(a_commit_notifies_all_other_clients)
{
    open_as(1, 5, "a", SHARING_SHARED);
    attach(2, 6, "a");
    attach(3, 7, "a");
    attach(2, 8, "a");
    submit_commit(2, 9, 6);
    assert_int_equal(expect_done(2, 9), 1);
    expect_changed(1, 5, 1);
    expect_changed(3, 7, 1);
    expect_changed(2, 8, 1);
    struct engine_command *wrong = command(ENGINE_COMMIT, 1, 10);
    wrong->scene = 5;
    wrong->edits = calloc(1, sizeof(*wrong->edits));
    wrong->edit_count = 1;
    wrong->edits[0].set.node.base.id = 3;
    wrong->edits[0].set.node.value.parent = 9;
    submit(wrong);
    expect_failed(1, 10, ERROR_UNKNOWN_ID, "edits[0] (node 3).parent");
    close_scene(3, 11, 7);
    expect_done(3, 11);
    submit_commit(1, 12, 5);
    assert_int_equal(expect_done(1, 12), 2);
    expect_changed(2, 6, 2);
    expect_changed(2, 8, 2);
    expect_silence();
}

/* ---- ends -------------------------------------------------------------------------------------------- */

TEST(closing_ends_the_jobs_of_the_client_that_closes)
{
    open_as(1, 5, "a", SHARING_SHARED);
    attach(2, 6, "a");
    submit(gated(render_scene(1, 7, 5, 9)));
    submit(gated(render_scene(2, 7, 6, 0)));
    wait_until(&fake.frames_begun, 2);
    close_scene(1, 8, 5);
    expect_failed(1, 7, ERROR_CANCELLED, "");
    expect_done(1, 8);
    assert_int_equal(atomic_load(&fake.in_progress), 1);
    atomic_store(&fake.gate_open, true);
    take_frame(2, 7, 0);
    expect_done(2, 7);
    submit_commit(1, 9, 5);
    expect_failed(1, 9, ERROR_UNKNOWN_ID, "edit_begin.scene");
}

TEST(edits_that_came_before_a_close_are_applied)
{
    open_as(1, 5, "a", SHARING_SHARED);
    attach(2, 6, "a");
    submit(gated(render_scene(2, 7, 6, 0)));
    wait_until(&fake.frames_begun, 1);
    /* They wait for the other's frame, and the close waits for them. */
    submit_commit(1, 8, 5);
    close_scene(1, 9, 5);
    expect_silence();
    atomic_store(&fake.gate_open, true);
    bool framed = false;
    uint32_t next = 8;
    while (!framed || next < 10) {
        struct engine_event *event = next_event();
        if (event->client == 1) {
            assert_int_equal(event->kind, ENGINE_DONE);
            assert_int_equal(event->request, next);
            assert_int_equal(event->revision, next == 8);
            next++;
        }
        framed = framed || event->kind == ENGINE_DONE;
        engine_event_destroy(event);
    }
}

TEST(a_client_that_goes_leaves_the_scene_to_the_others)
{
    open_as(1, 5, "a", SHARING_SHARED);
    attach(2, 6, "a");
    submit(gated(render_scene(1, 7, 5, 9)));
    wait_until(&fake.frames_begun, 1);
    submit_commit(1, 8, 5); /* waits for the frame, and goes with its client */
    submit_commit(2, 9, 6); /* waits, and is applied as soon as the frame is given up */
    submit(command(ENGINE_CLIENT_GONE, 1, 0));
    assert_int_equal(expect_done(2, 9), 1);
    expect_forgotten(1);
    attach(3, 1, "a");
    submit(render_scene(2, 10, 6, 0));
    take_frame(2, 10, 0);
    expect_done(2, 10);
}

TEST(a_cancel_ends_only_what_its_client_waits_for)
{
    open_as(1, 5, "a", SHARING_SHARED);
    attach(2, 6, "a");
    submit(gated(render_scene(1, 7, 5, 0)));
    wait_until(&fake.frames_begun, 1);
    submit_commit(2, 8, 6);
    submit(render_scene(2, 9, 6, 0));
    submit(render_scene(1, 9, 5, 0)); /* a scene with that number */
    submit_target(ENGINE_JOB_CANCEL, 1, 10, 9, 0);
    expect_failed(1, 9, ERROR_CANCELLED, "");
    expect_done(1, 10);
    atomic_store(&fake.gate_open, true);
    unsigned ends = 0;
    while (ends != 7) {
        struct engine_event *event = next_event();
        if (event->kind == ENGINE_DONE)
            ends |= 1u << (event->request - 7);
        engine_event_destroy(event);
    }
}

/* ---- lingering --------------------------------------------------------------------------------------- */

/* Opens it, changes it once, and goes. */
static void leave(uint64_t client, const char *name, enum sharing sharing)
{
    open_as(client, 1, name, sharing);
    submit_commit(client, 2, 1);
    expect_done(client, 2);
    client_goes(client);
}

TEST(a_lingering_scene_can_be_attached_again)
{
    leave(1, "kept", SHARING_KEPT);
    leave(1, "shared", SHARING_SHARED);
    leave(1, "private", SHARING_PRIVATE);
    assert_int_equal(attach(1, 3, "kept"), 1);
    assert_int_equal(attach(2, 3, "shared"), 1);
    attach_fails(2, 4, "kept");
    attach_fails(1, 4, "private");
    submit(render_scene(2, 5, 3, 0));
    take_frame(2, 5, 0);
    expect_done(2, 5);
    close_scene(2, 6, 3);
    expect_done(2, 6);
    assert_int_equal(attach(1, 5, "shared"), 1);
}

TEST(its_time_is_limited_and_begins_when_the_last_one_goes)
{
    restart((struct engine_options){.limits.scene_linger_ms = SHORT_MS});
    open_as(1, 1, "a", SHARING_SHARED);
    submit_commit(1, 2, 1);
    expect_done(1, 2);
    attach(2, 1, "a");
    client_goes(1);
    expect_silence(); /* longer than it would linger, but it is held */
    client_goes(2);
    expect_ended();
    attach_fails(1, 3, "a");
}

TEST(nothing_lingers_where_that_is_not_wanted)
{
    restart((struct engine_options){.limits.scene_linger_ms = 0});
    open_as(1, 1, "a", SHARING_SHARED);
    submit_commit(1, 2, 1);
    expect_done(1, 2);
    submit(command(ENGINE_CLIENT_GONE, 1, 0));
    expect_ended();
    expect_forgotten(1);
    /* Nor does one that holds nothing. */
    restart((struct engine_options){.limits.scene_linger_ms = LONG_MS});
    open_as(1, 1, "a", SHARING_KEPT);
    close_scene(1, 2, 1);
    expect_done(1, 2);
    expect_ended();
    attach_fails(1, 3, "a");
}

TEST(of_too_many_the_one_that_was_left_first_ends)
{
    restart((struct engine_options){.limits.scene_linger_ms = LONG_MS, .limits.lingering_scenes = 2});
    leave(1, "a", SHARING_KEPT);
    leave(2, "b", SHARING_SHARED);
    attach(1, 1, "a"); /* "b" has been left for longer now */
    client_goes(1);
    open_as(3, 1, "c", SHARING_SHARED);
    submit_commit(3, 2, 1);
    expect_done(3, 2);
    submit(command(ENGINE_CLIENT_GONE, 3, 0));
    expect_ended();
    expect_forgotten(3);
    attach_fails(1, 2, "b");
    attach(1, 2, "a");
    attach(1, 3, "c");
}

TEST(a_left_scene_gives_its_name_to_a_new_one_of_the_same_user)
{
    leave(1, "a", SHARING_SHARED);
    submit_open(2, 1, "a", SHARING_SHARED);
    expect_failed(2, 1, ERROR_INVALID, "scene_open.name");
    submit_open(1, 1, "a", SHARING_SHARED);
    expect_ended();
    expect_done(1, 1);
    assert_int_equal(attach(2, 1, "a"), 0);
}

TEST(lingering_scenes_are_evicted_where_memory_is_short)
{
    /* Room for about 100 nodes. */
    uint64_t limit_bytes = 100 * (sizeof(struct scene_node) + 32) + 10;
    restart((struct engine_options){.limits.scene_linger_ms = LONG_MS,
                                    .limits.scene = {.host_bytes = limit_bytes, .nodes = 100}});
    open_as(1, 1, "a", SHARING_SHARED);
    submit(commit_of_nodes(1, 2, 1, 60));
    expect_done(1, 2);
    open_as(2, 1, "b", SHARING_PRIVATE);
    submit(commit_of_nodes(2, 2, 1, 60));
    expect_failed(2, 2, ERROR_LIMIT, "edits"); /* the scene is held */
    client_goes(1);
    submit(commit_of_nodes(2, 3, 1, 60));
    expect_ended();
    assert_int_equal(expect_done(2, 3), 1);
    leave(1, "c", SHARING_SHARED);
    submit(commit_of_nodes(2, 4, 1, 101)); /* more than any scene may have: they need not give way */
    expect_failed(2, 4, ERROR_LIMIT, "edits");
    attach(1, 4, "c");
}

static void submit_trim(uint64_t bytes)
{
    struct engine_command *made = command(ENGINE_SCENES_TRIM, 0, 0);
    made->trim_bytes = bytes;
    submit(made);
}

#define SPHERES 4u
#define SPHERES_BYTES (SPHERES * 16u)

/* With one blob. */
static void leave_spheres(uint64_t client, const char *name)
{
    static const float numbers[SPHERES * 4] = {0, 0, 0, 1, 1, 0, 0, 1, 2, 0, 0, 1, 3, 0, 0, 1};
    struct draft_list list = {0};
    add_spheres(&list, 1, numbers, SPHERES);
    open_as(client, 1, name, SHARING_SHARED);
    struct engine_command *made = command(ENGINE_COMMIT, client, 2);
    made->scene = 1;
    made->edits = malloc(sizeof(*made->edits));
    assert_non_null(made->edits);
    *made->edits = list.edits[0];
    made->edit_count = 1;
    submit(made);
    expect_done(client, 2);
    client_goes(client);
}

TEST(lingering_scenes_are_evicted_for_the_bytes_of_blobs_that_are_lacking)
{
    leave_spheres(1, "first");
    leave_spheres(2, "second");
    leave_spheres(2, "third");
    submit_trim(3 * SPHERES_BYTES + 1); /* even all of them would not suffice */
    submit_trim(0);
    attach(3, 1, "second");
    client_goes(3);
    submit_trim(SPHERES_BYTES);
    expect_ended();
    attach_fails(3, 1, "first");
    submit_trim(1);
    expect_ended();
    attach_fails(3, 2, "third"); /* "second" was left later */
    submit_trim(1);
    expect_ended();
    attach_fails(3, 3, "second");
}

/* ---- what is told ------------------------------------------------------------------------------------ */

TEST(a_list_has_what_its_reader_may_come_to)
{
    open_as(1, 1, "m", SHARING_SHARED);
    open_as(1, 2, "k", SHARING_KEPT);
    open_as(1, 3, "p", SHARING_PRIVATE);
    open_as(2, 1, "o", SHARING_KEPT);
    attach(2, 2, "m");
    leave(3, "b", SHARING_SHARED);
    static const struct {
        uint64_t client;
        const char *names[3];
        uint32_t clients[3];
    } wanted[] = {{1, {"b", "k", "m"}, {0, 1, 2}}, {2, {"b", "m", "o"}, {0, 2, 1}}};
    for (int i = 0; i < 2; i++) {
        struct engine_command *made = command(ENGINE_SCENE_LIST, wanted[i].client, 9);
        made->principal = principal_of(wanted[i].client);
        submit(made);
        struct engine_event *event = expect_event(ENGINE_SCENES_LISTED, wanted[i].client, 9);
        assert_int_equal(event->list->count, 3);
        for (int k = 0; k < 3; k++) {
            assert_string_equal(event->list->scenes[k].name, wanted[i].names[k]);
            assert_int_equal(event->list->scenes[k].clients, wanted[i].clients[k]);
            assert_int_equal(event->list->scenes[k].revision, wanted[i].clients[k] == 0);
        }
        assert_int_equal(event->list->scenes[0].sharing, SHARING_SHARED);
        assert_int_equal(event->list->scenes[i ? 2 : 1].sharing, SHARING_KEPT);
        engine_event_destroy(event);
    }
}

TEST(stats_have_each_scene_once)
{
    open_as(1, 5, "a", SHARING_SHARED);
    attach(2, 6, "a");
    leave(3, "b", SHARING_SHARED);
    submit(command(ENGINE_STATS, 1, 7));
    struct engine_event *event = expect_event(ENGINE_STATS_READY, 1, 7);
    assert_int_equal(event->stats->scene_count, 2);
    assert_int_equal(event->stats->scenes[0].client, 1);
    assert_int_equal(event->stats->scenes[0].scene, 5);
    assert_int_equal(event->stats->scenes[1].client, 0); /* nobody has it */
    assert_string_equal(event->stats->scenes[1].name, "b");
    engine_event_destroy(event);
}

static void submit_edits(uint32_t request, const struct draft_list *list)
{
    struct engine_command *made = command(ENGINE_COMMIT, 1, request);
    made->edits = malloc(list->count * sizeof(*made->edits));
    assert_non_null(made->edits);
    memcpy(made->edits, list->edits, list->count * sizeof(*made->edits));
    made->edit_count = list->count;
    submit(made);
    expect_done(1, request);
}

static struct engine_event *describe(uint32_t request)
{
    submit(command(ENGINE_SCENE_DESCRIBE, 1, request));
    return expect_event(ENGINE_SCENE_DESCRIBED, 1, request);
}

TEST(a_description_names_cameras_and_clips)
{
    open_as(1, 1, "a", SHARING_PRIVATE);
    struct engine_event *event = describe(2);
    assert_true(event->description->empty);
    assert_int_equal(event->description->revision, 0);
    assert_int_equal(event->description->camera_count + event->description->clip_count, 0);
    engine_event_destroy(event);

    struct draft_list list = {0};
    add_set(&list, OBJECT_CAMERA, 4)->set.camera =
        (struct scene_camera){.base = {.id = 4, .name = "lens"}, .value.fov_y = 0.75f};
    strcpy(add_shown(&list, 9, NODE_CAMERA, 4)->base.name, "tower");
    add_shown(&list, 7, NODE_CAMERA, 4);
    static const float sphere[4] = {1, 2, 3, 0.5f};
    add_spheres(&list, 1, sphere, 1);
    add_shown(&list, 3, NODE_SPHERES, 1);
    static const float floats[8] = {0, 1.5f, 0, 0, 0, 1, 1, 1};
    strcpy(add_clip(&list, 5, floats, 8)->base.name, "walk");
    add_clip(&list, 2, floats, 8);
    add_channel(&list, 1, 5, CHANNEL_NODE_TRANSLATION, 3, 3, 2);
    add_channel(&list, 2, 5, CHANNEL_NODE_SCALE, 3, 3, 1)->value.first_value = 2;
    submit_edits(3, &list);
    event = describe(4);
    const struct engine_scene_description *told = event->description;
    assert_int_equal(told->revision, 1);
    assert_false(told->empty);
    for (int axis = 0; axis < 3; axis++) {
        assert_true(told->lower_world[axis] == sphere[axis] - 0.5f);
        assert_true(told->upper_world[axis] == sphere[axis] + 0.5f);
    }
    assert_int_equal(told->spheres, 1);
    assert_int_equal(told->triangles, 0);
    assert_int_equal(told->nodes, 3);
    /* Ascending, whatever the order in which they were made; without a name of the node's it is the camera's. */
    assert_int_equal(told->camera_count, 2);
    assert_int_equal(told->cameras[0].node, 7);
    assert_string_equal(told->cameras[0].name, "lens");
    assert_int_equal(told->cameras[1].node, 9);
    assert_string_equal(told->cameras[1].name, "tower");
    assert_true(told->cameras[1].fov_y == 0.75f);
    assert_int_equal(told->clip_count, 2);
    assert_int_equal(told->clips[0].clip, 2);
    assert_int_equal(told->clips[0].channels, 0);
    assert_true(told->clips[0].duration_s == 0);
    assert_int_equal(told->clips[1].clip, 5);
    assert_int_equal(told->clips[1].channels, 2);
    assert_true(told->clips[1].duration_s == 1.5f);
    assert_string_equal(told->clips[1].name, "walk");
    engine_event_destroy(event);

    /* After a change it is another. */
    struct draft_list removal = {0};
    add_remove(&removal, OBJECT_NODE, 9);
    submit_edits(5, &removal);
    event = describe(6);
    assert_int_equal(event->description->revision, 2);
    assert_int_equal(event->description->camera_count, 1);
    engine_event_destroy(event);
}

TEST(of_many_cameras_the_first_are_listed)
{
    open_as(1, 1, "a", SHARING_PRIVATE);
    /* From the largest number down, a few at a time. */
    uint32_t next = ENGINE_DESCRIPTION_MAX + 40, request = 2;
    bool has_camera = false;
    while (next > 0) {
        struct draft_list list = {0};
        if (!has_camera)
            add_set(&list, OBJECT_CAMERA, 1)->set.camera = (struct scene_camera){.base.id = 1, .value.fov_y = 1};
        has_camera = true;
        while (next > 0 && list.count < EDITS_MAX)
            add_shown(&list, next--, NODE_CAMERA, 1);
        submit_edits(request++, &list);
    }
    struct engine_event *event = describe(request);
    assert_int_equal(event->description->camera_count, ENGINE_DESCRIPTION_MAX);
    for (uint32_t i = 0; i < ENGINE_DESCRIPTION_MAX; i++)
        assert_int_equal(event->description->cameras[i].node, i + 1);
    engine_event_destroy(event);
}
