/* SPDX-License-Identifier: MIT */
/* Scenes of others', as the library sees them: what it learns on coming, and what it hears of later. */
#include "tests/unit/client/played_daemon.h"
#include "tests/harness/test.h"

/* Messages of the client that the played daemon received. */
static struct {
    char attached[129];
    uint32_t scene, closed, clip, removed;
    bool committed;
} seen;

static void tell_changed(struct daemon *daemon, uint32_t scene, uint64_t revision)
{
    struct message message = {.type = MESSAGE_SCENE_CHANGED};
    message.scene_changed.scene = scene;
    message.scene_changed.revision = revision;
    tell(daemon, 0, &message);
}

static void tell_description(struct daemon *daemon, uint32_t request)
{
    static struct record_camera_entry cameras[2] = {{.node = 7, .fov_y = 1, .name = "tower"},
                                                    {.node = 9, .fov_y = 1, .name = ""}};
    static struct record_clip_entry clips[2] = {{.clip = 3, .channels = 2, .duration_s = 1.5f, .name = "walk"},
                                                {.clip = 4, .name = "nothing"}};
    struct message message = {.type = MESSAGE_SCENE_DESCRIPTION};
    struct message_scene_description *told = &message.scene_description;
    told->revision = 5;
    told->triangles = 12;
    told->spheres = 3;
    for (int axis = 0; axis < 3; axis++) {
        told->lower_world[axis] = (float)-axis;
        told->upper_world[axis] = (float)axis;
    }
    told->cameras = cameras;
    told->cameras_count = 2;
    told->clips = clips;
    told->clips_count = 2;
    tell(daemon, request, &message);
}

static void send_list(struct daemon *daemon, uint32_t request)
{
    static struct record_scene_entry scenes[2] = {
        {.revision = 5, .triangles = 12, .clients = 1, .sharing = PROTOCOL_SHARING_SHARED, .name = "model"},
        {.revision = 1, .sharing = PROTOCOL_SHARING_KEPT, .name = "mine"}};
    struct message message = {.type = MESSAGE_SCENE_LIST_REPLY};
    message.scene_list_reply.scenes = scenes;
    message.scene_list_reply.scenes_count = 2;
    tell(daemon, request, &message);
}

static void tell_unknown(struct daemon *daemon, uint32_t request)
{
    struct message message = {.type = MESSAGE_ERROR};
    message.error.code = PROTOCOL_ERROR_UNKNOWN_ID;
    message.error.field = "scene_attach.name";
    message.error.text = "no such scene";
    message.error.remedy = "";
    tell(daemon, request, &message);
}

static void send_ok(struct daemon *daemon, uint32_t request, uint64_t revision)
{
    struct message message = {.type = MESSAGE_OK};
    message.ok.revision = revision;
    tell(daemon, request, &message);
}

/* Any change is of revision 9; before an answer to a ping, revision 8 is told of. */
static void answer(struct daemon *daemon, uint32_t request, const struct message *message)
{
    struct message reply;
    switch (message->type) {
    case MESSAGE_SCENE_ATTACH:
        snprintf(seen.attached, sizeof(seen.attached), "%s", message->scene_attach.name);
        seen.scene = message->scene_attach.scene;
        if (strcmp(message->scene_attach.name, "model") == 0)
            send_ok(daemon, request, 4);
        else
            tell_unknown(daemon, request);
        return;
    case MESSAGE_SCENE_DESCRIBE:
        tell_description(daemon, request);
        return;
    case MESSAGE_SCENE_LIST:
        send_list(daemon, request);
        return;
    case MESSAGE_PING:
        tell_changed(daemon, seen.scene, 8);
        tell_changed(daemon, seen.scene + 100, 77); /* nobody's */
        reply = (struct message){.type = MESSAGE_PONG};
        tell(daemon, request, &reply);
        return;
    case MESSAGE_BLOB_OFFER:
        reply = (struct message){.type = MESSAGE_BLOB_NEED};
        tell(daemon, request, &reply);
        return;
    case MESSAGE_SET_CLIP:
        seen.clip = message->set_clip.clip;
        return;
    case MESSAGE_REMOVE:
        seen.removed = message->remove.object;
        return;
    case MESSAGE_EDIT_COMMIT:
        seen.committed = seen.removed != 0;
        send_ok(daemon, request, 9);
        return;
    case MESSAGE_SCENE_CLOSE:
        seen.closed = message->scene_close.scene;
        send_ok(daemon, request, 0);
        return;
    default:
        return;
    }
}

static void play_scenes(struct daemon *daemon)
{
    memset(&seen, 0, sizeof(seen));
    greet(daemon);
    while (take(daemon))
        answer(daemon, header.request, &asked);
}

static struct fl_scene *attach(void)
{
    struct fl_scene *scene = fl_scene_attach(connection, "model", &error);
    if (!scene)
        fail_msg("%s", error.text);
    return scene;
}

EACH_TEST(NULL, end_played)

TEST(an_attached_scene_is_known_as_a_loaded_one)
{
    connect_to_played(play_scenes);
    struct fl_scene *scene = attach();
    uint32_t found = 0;
    const struct fl_clip_info *info = NULL;
    assert_int_equal(fl_scene_camera_count(scene), 2);
    assert_true(fl_scene_find_camera(scene, "tower", &found, &error));
    assert_int_equal(found, 7);
    assert_true(fl_scene_find_camera(scene, "1", &found, &error));
    assert_int_equal(found, 9);
    assert_int_equal(fl_scene_clip_count(scene), 2);
    assert_true(fl_scene_find_clip(scene, "walk", &found, &info, &error));
    assert_int_equal(found, 3);
    assert_true(info->duration_s == 1.5f);
    assert_false(fl_scene_find_clip(scene, "nothing", &found, NULL, &error));
    assert_int_equal(error.code, FL_ERROR_ARGUMENT);
    assert_false(fl_scene_find_object(scene, PROTOCOL_OBJECT_MATERIAL, "brass", &found, &error));
    struct fl_scene_bounds bounds;
    assert_true(fl_scene_get_bounds(scene, &bounds, &error));
    assert_false(bounds.empty);
    assert_int_equal(bounds.revision, 5);
    assert_int_equal(bounds.triangles, 12);
    assert_int_equal(bounds.spheres, 3);
    assert_true(bounds.lower_world[2] == -2 && bounds.upper_world[1] == 1);
    fl_scene_destroy(scene);
    assert_true(fl_ping(connection, &(uint64_t){0}, &error)); /* earlier messages have arrived */
    assert_int_equal(seen.closed, seen.scene);
    assert_int_equal(seen.clip, 0);
}

TEST(a_missing_scene_is_reported)
{
    connect_to_played(play_scenes);
    assert_null(fl_scene_attach(connection, "other", &error));
    check_error(FL_ERROR_REFUSED, "no such scene");
    assert_int_equal(error.server_code, PROTOCOL_ERROR_UNKNOWN_ID);
    struct fl_scene *scene = attach(); /* the connection is as good as before */
    fl_scene_destroy(scene);
}

TEST(a_revision_is_heard_of_whatever_is_waited_for)
{
    connect_to_played(play_scenes);
    struct fl_scene *scene = attach();
    assert_int_equal(fl_scene_revision(scene), 5); /* told with what it holds, after the 4 of the answer */
    assert_true(fl_ping(connection, &(uint64_t){0}, &error));
    assert_int_equal(fl_scene_revision(scene), 8);
    struct fl_scene_bounds bounds;
    assert_true(fl_scene_get_bounds(scene, &bounds, &error));
    assert_int_equal(fl_scene_revision(scene), 8); /* revisions never fall */
    fl_scene_destroy(scene);
    assert_true(fl_ping(connection, &(uint64_t){0}, &error)); /* the scene is gone here */
}

TEST(a_clip_added_to_a_shared_scene_is_removed_again)
{
    connect_to_played(play_scenes);
    struct fl_scene *scene = attach();
    static const float times[2] = {0, 1}, values[6] = {0};
    const struct fl_channel channel = {.path = PROTOCOL_CHANNEL_VIEW_EYE,
                                       .interpolation = PROTOCOL_INTERPOLATION_LINEAR,
                                       .width = 3,
                                       .key_count = 2,
                                       .times = times,
                                       .values = values};
    uint32_t clip = 0;
    assert_true(fl_scene_add_clip(scene, "mine", &channel, 1, &clip, &error));
    assert_int_equal(fl_scene_revision(scene), 9);
    assert_int_equal(seen.clip, clip);
    assert_true(clip > 1000); /* far from those that whoever put the scene up counts from 1 */
    fl_scene_destroy(scene);
    assert_true(fl_ping(connection, &(uint64_t){0}, &error));
    assert_int_equal(seen.removed, clip);
    assert_true(seen.committed);
}

TEST(the_list_is_the_callers)
{
    connect_to_played(play_scenes);
    struct fl_scene_entry *list = NULL;
    size_t count = 0;
    if (!fl_scene_list(connection, &list, &count, &error))
        fail_msg("%s", error.text);
    assert_false(fl_connection_is_read_only(connection));
    leave_played();
    assert_int_equal(count, 2);
    assert_string_equal(list[0].name, "model");
    assert_int_equal(list[0].revision, 5);
    assert_int_equal(list[0].triangles, 12);
    assert_int_equal(list[0].clients, 1);
    assert_int_equal(list[1].sharing, PROTOCOL_SHARING_KEPT);
    free(list);
}
