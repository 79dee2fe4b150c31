/* SPDX-License-Identifier: MIT */
/* Edits against a daemon that is played: one that another client is quicker on, and ones that say what makes no
 * sense. */
#include "tests/unit/client/played_daemon.h"
#include "protocol/handshake.h"
#include "tests/harness/test.h"

#define STEEL 5u /* the only material */

/* State and behaviour of the played daemon. */
static struct {
    unsigned conflicts;    /* commits that come too late */
    uint32_t wrong_object; /* added to an identifier that is read */
    bool stuck;            /* its list comes to no end */
    float roughness, metallic;
    uint64_t revision;
    unsigned commits;
    uint64_t base_revision;
    struct message_set_material set;
} world;

static void send_done(struct daemon *daemon, uint32_t request)
{
    struct message message = {.type = MESSAGE_OK};
    message.ok.revision = world.revision;
    tell(daemon, request, &message);
}

static void send_list(struct daemon *daemon, uint32_t request, const struct message_scene_objects *question)
{
    struct record_object_entry entry = {.object = STEEL, .name = "steel"};
    struct message message;
    message_init(&message, MESSAGE_SCENE_OBJECTS_REPLY);
    message.scene_objects_reply.revision = world.revision;
    message.scene_objects_reply.total = 1;
    message.scene_objects_reply.next = world.stuck ? 3 : 0;
    message.scene_objects_reply.objects = &entry;
    const bool is_asked = question->name[0] == '\0' || strcmp(question->name, "steel") == 0;
    message.scene_objects_reply.objects_count = is_asked && question->kind == PROTOCOL_OBJECT_MATERIAL;
    tell(daemon, request, &message);
}

static void tell_material(struct daemon *daemon, uint32_t request, uint32_t object)
{
    struct message message;
    message_init(&message, MESSAGE_SET_MATERIAL);
    message.set_material.material = object + world.wrong_object;
    message.set_material.value.roughness = world.roughness;
    message.set_material.value.metallic = world.metallic;
    message.set_material.name = "steel";
    tell(daemon, request, &message);
    send_done(daemon, request);
}

/* Another client adds to the other field each time before this one is told of the conflict. */
static void answer_commit(struct daemon *daemon, uint32_t request)
{
    world.commits++;
    if (world.commits > world.conflicts) {
        world.revision++;
        send_done(daemon, request);
        return;
    }
    world.metallic += world.metallic < 1 ? 0.25f : 0;
    world.revision++;
    struct message message = {.type = MESSAGE_ERROR};
    message.error.code = PROTOCOL_ERROR_CONFLICT;
    message.error.retryable = 1;
    message.error.field = "edits[0] (material 5)";
    message.error.text = "it has been changed";
    message.error.remedy = "";
    tell(daemon, request, &message);
}

static void answer(struct daemon *daemon, uint32_t request, const struct message *message)
{
    struct message reply;
    switch (message->type) {
    case MESSAGE_SCENE_ATTACH:
    case MESSAGE_SCENE_CLOSE:
        send_done(daemon, request);
        return;
    case MESSAGE_SCENE_DESCRIBE:
        message_init(&reply, MESSAGE_SCENE_DESCRIPTION);
        tell(daemon, request, &reply);
        return;
    case MESSAGE_SCENE_OBJECTS:
        send_list(daemon, request, &message->scene_objects);
        return;
    case MESSAGE_OBJECT_GET:
        tell_material(daemon, request, message->object_get.object);
        return;
    case MESSAGE_EDIT_BEGIN:
        world.base_revision = message->edit_begin.base_revision;
        return;
    case MESSAGE_SET_MATERIAL:
        world.set = message->set_material; /* without its strings and arrays */
        return;
    case MESSAGE_EDIT_COMMIT:
        answer_commit(daemon, request);
        return;
    default:
        return;
    }
}

static void play(struct daemon *daemon)
{
    greet(daemon);
    while (take(daemon))
        answer(daemon, header.request, &asked);
}

static struct fl_scene *scene;

static void come(void)
{
    world.revision = 10;
    connect_to_played(play);
    scene = fl_scene_attach(connection, "model", &error);
    if (!scene)
        fail_msg("%s", error.text);
}

static void leave(void)
{
    fl_scene_destroy(scene);
    scene = NULL;
    leave_played();
    memset(&world, 0, sizeof(world));
}

static int end(void **state)
{
    (void)state;
    leave();
    return 0;
}

EACH_TEST(NULL, end)

static bool edit(const char *text, struct fl_edited *edited)
{
    struct fl_assignment assignment;
    error = (struct fl_error){0};
    assert_true(fl_assignment_parse(text, &assignment, &error));
    return fl_scene_edit(scene, &assignment, 1, edited, &error);
}

TEST(an_edit_that_comes_too_late_is_made_anew_of_what_is_there)
{
    world.conflicts = 2;
    world.roughness = 0.5f;
    come();
    struct fl_edited edited;
    if (!edit("material.steel.roughness*=0.5", &edited))
        fail_msg("%s", error.text);
    assert_int_equal(world.commits, 3);
    assert_true(world.set.value.roughness == 0.25f);
    assert_true(world.set.value.metallic == 0.5f); /* the other client's */
    assert_int_equal(world.base_revision, 12);
    assert_int_equal(edited.revision, 13);
    assert_int_equal(edited.objects, 1);
    assert_int_equal(edited.undo_count, 1);
    assert_int_equal(edited.undo[0].id, STEEL);
    assert_true(edited.undo[0].values[0] == 0.5);
    free(edited.undo);
}

TEST(an_edit_that_always_comes_too_late_ends_with_the_conflict)
{
    world.conflicts = UINT32_MAX;
    come();
    assert_false(edit("material.steel.roughness=1", NULL));
    check_error(FL_ERROR_REFUSED, "changed");
    assert_int_equal(error.server_code, PROTOCOL_ERROR_CONFLICT);
    assert_string_equal(error.field, "material.steel.roughness=1");
    assert_true(error.retryable);
}

TEST(an_object_is_known_by_name_number_identifier_and_pattern)
{
    static const char *const which[] = {"steel", "0", "#5", "st*l", "*"};
    come();
    for (size_t i = 0; i < sizeof(which) / sizeof(which[0]); i++) {
        uint32_t *ids = NULL;
        size_t count = 0;
        if (!fl_scene_find_objects(scene, PROTOCOL_OBJECT_MATERIAL, which[i], &ids, &count, &error))
            fail_msg("%s: %s", which[i], error.text);
        assert_int_equal(count, 1);
        assert_int_equal(ids[0], STEEL);
        free(ids);
    }
    uint32_t *ids = NULL;
    size_t count = 0;
    assert_false(fl_scene_find_objects(scene, PROTOCOL_OBJECT_MATERIAL, "stele", &ids, &count, &error));
    assert_string_equal(error.remedy, "did you mean 'steel'?");
    assert_false(fl_scene_find_objects(scene, PROTOCOL_OBJECT_MATERIAL, "b*", &ids, &count, &error));
    assert_string_equal(error.remedy, "it has 1 material: 'steel'");
    assert_false(fl_scene_find_objects(scene, PROTOCOL_OBJECT_MATERIAL, "1", &ids, &count, &error));
    struct fl_object_state read;
    assert_true(fl_scene_read(scene, PROTOCOL_OBJECT_MATERIAL, STEEL, &read, &error));
    assert_string_equal(read.name, "steel");
    assert_int_equal(read.revision, 10);
    assert_false(fl_scene_read(scene, PROTOCOL_OBJECT_MESH, 1, &read, &error));
    check_error(FL_ERROR_ARGUMENT, "no fields");
}

TEST(a_daemon_that_says_what_makes_no_sense_is_reported)
{
    world.wrong_object = 1;
    come();
    assert_false(edit("material.steel.roughness=1", NULL));
    check_error(FL_ERROR_PROTOCOL, "another object than 5");
    leave();
    world.stuck = true;
    come();
    assert_false(edit("material.steel.roughness=1", NULL));
    check_error(FL_ERROR_PROTOCOL, "does not come after");
}
