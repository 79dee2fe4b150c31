/* SPDX-License-Identifier: MIT */
/* Scenes on their way to a keeper, which the test controls. */
#include "tests/unit/engine/engine_fake.h"

#include "tests/harness/test.h"

#include <pthread.h>
#include <stdio.h>

/* Requests to the keeper, in order: "read a 1, write a 1, forget a". */
static struct {
    pthread_mutex_t lock;
    char told[1024];
    atomic_bool holds_reads; /* none ends but those that are abandoned */
} keeper = {.lock = PTHREAD_MUTEX_INITIALIZER};

static void tell(const char *what, const char *name, uint64_t revision)
{
    pthread_mutex_lock(&keeper.lock);
    size_t used = strlen(keeper.told);
    snprintf(keeper.told + used, sizeof(keeper.told) - used, revision ? "%s %s %d, " : "%s %s, ", what, name,
             (int)revision);
    pthread_mutex_unlock(&keeper.lock);
}

static void *keeper_read(void *context, const struct scene *scene, uint64_t principal, enum sharing sharing,
                         const atomic_bool *abandoned)
{
    (void)context;
    (void)principal;
    (void)sharing;
    tell("read", scene->name, scene->revision);
    while (atomic_load(&keeper.holds_reads) && !atomic_load(abandoned))
        usleep(1000);
    return strdup(scene->name);
}

static void keeper_write(void *context, void *record, const atomic_bool *abandoned)
{
    (void)context;
    (void)abandoned;
    tell("write", record, 0);
    free(record);
}

static void keeper_forget(void *context, uint64_t principal, const char *name)
{
    (void)context;
    (void)principal;
    tell("forget", name, 0);
}

static const struct engine_keeper port = {.read = keeper_read, .write = keeper_write, .forget = keeper_forget};

static void start_keeping(uint64_t linger_ms)
{
    keeper.told[0] = '\0';
    atomic_store(&keeper.holds_reads, false);
    start((struct engine_options){.keeper = &port, .limits = {.scene_linger_ms = linger_ms}});
}

static void hold_reads(bool held)
{
    atomic_store(&keeper.holds_reads, held);
}

static bool was_told(const char *what)
{
    pthread_mutex_lock(&keeper.lock);
    bool told = strstr(keeper.told, what) != NULL;
    pthread_mutex_unlock(&keeper.lock);
    return told;
}

static void wait_for(const char *what)
{
    for (int i = 0; i < 6000; i++) {
        if (was_told(what))
            return;
        usleep(10000);
    }
    fail_msg("no \"%s\" in \"%s\"", what, keeper.told);
}

static struct engine_command *open_command(uint32_t request, const char *name, enum sharing sharing)
{
    struct engine_command *made = command(ENGINE_SCENE_OPEN, 1, request);
    made->scene = request;
    made->sharing = sharing;
    made->principal = 100;
    strcpy(made->name, name);
    return made;
}

static void open_named(uint32_t request, const char *name, enum sharing sharing)
{
    submit(open_command(request, name, sharing));
    expect_done(1, request);
}

/* Opens a scene as the last process had it, with that revision. */
static void open_restored(uint32_t request, const char *name, uint64_t revision)
{
    struct engine_command *open = open_command(request, name, SHARING_SHARED);
    open->kept_revision = revision;
    submit(open);
    expect_done(1, request);
}

static void change(uint32_t request, uint32_t scene)
{
    submit_commit(1, request, scene);
    expect_done(1, request);
}

TEST(attachable_scenes_are_kept_and_forgotten_with_their_end)
{
    start_keeping(1);
    open_named(1, "private", SHARING_PRIVATE);
    open_named(2, "a", SHARING_KEPT);
    open_named(3, "empty", SHARING_SHARED);
    change(10, 1);
    change(11, 2);
    wait_for("read a 1, write a, ");
    change(12, 2);
    wait_for("read a 2, write a, ");
    submit(command(ENGINE_CLIENT_GONE, 1, 0));
    wait_for("write a, forget a, ");
    assert_false(was_told("private"));
    assert_false(was_told("empty"));
    stop();
}

TEST(changes_wait_while_a_scene_is_read_and_frames_go_on)
{
    start_keeping(1000);
    open_named(1, "a", SHARING_SHARED);
    open_named(2, "b", SHARING_PRIVATE);
    hold_reads(true);
    change(10, 1);
    wait_for("read a 1");
    submit_commit(1, 11, 1);
    change(12, 2); /* a change of another scene */
    assert_null(event_within(100));
    hold_reads(false);
    assert_int_equal(expect_done(1, 11), 2);
    wait_for("read a 2");
    hold_reads(true);
    change(13, 1);
    wait_for("read a 3");
    struct engine_command *job = render(1, 14, 0, 0);
    job->scene = 1;
    submit(job);
    engine_event_destroy(expect_frame(1, 14, 0));
    expect_done(1, 14);
    hold_reads(false);
    stop();
}

TEST(a_scene_may_end_while_it_is_read)
{
    start_keeping(0);
    open_named(1, "a", SHARING_SHARED);
    hold_reads(true);
    change(10, 1);
    wait_for("read a 1");
    submit(command(ENGINE_CLIENT_GONE, 1, 0));
    engine_event_destroy(expect_event(ENGINE_SCENE_ENDED, 0, 0));
    expect_forgotten(1);
    hold_reads(false);
    wait_for("write a, forget a, ");
    stop();
}

TEST(what_has_just_changed_is_kept_when_the_engine_ends)
{
    start_keeping(1000);
    open_named(1, "a", SHARING_SHARED);
    change(10, 1);
    stop();
    assert_string_equal(keeper.told, "read a 1, write a, "); /* and not forgotten */
}

TEST(the_engine_ends_although_the_keeper_does_not)
{
    start_keeping(1000);
    open_named(1, "a", SHARING_SHARED);
    hold_reads(true);
    change(10, 1);
    wait_for("read a 1");
    stop(); /* or this never ends */
}

TEST(a_restored_scene_has_its_revision_and_is_not_written_again)
{
    start_keeping(1000);
    open_restored(1, "a", 7);
    submit_commit(1, 10, 1);
    assert_int_equal(expect_done(1, 10), 7);
    stop();
    assert_string_equal(keeper.told, "");
}

TEST(a_scene_that_could_not_be_restored_does_not_linger)
{
    start_keeping(600000);
    open_restored(1, "a", 7);
    submit(command(ENGINE_CLIENT_GONE, 1, 0));
    engine_event_destroy(expect_event(ENGINE_SCENE_ENDED, 0, 0));
    stop();
    assert_string_equal(keeper.told, ""); /* who restores says what becomes of it on the disk */
}

TEST(restored_scenes_are_no_others_lingering_ones)
{
    start((struct engine_options){.limits = {.scene_linger_ms = 600000, .lingering_scenes = 1}});
    for (uint32_t scene = 1; scene <= 3; scene++) {
        char name[] = {(char)('a' + scene), '\0'};
        open_restored(scene, name, 1);
        change(10 + scene, scene);
    }
    submit(command(ENGINE_CLIENT_GONE, 1, 0));
    expect_forgotten(1);
    submit(command(ENGINE_SCENE_LIST, 1, 20));
    struct engine_event *event = expect_event(ENGINE_SCENES_LISTED, 1, 20);
    assert_int_equal(event->list->count, 3);
    engine_event_destroy(event);
    stop();
}
