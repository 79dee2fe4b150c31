/* SPDX-License-Identifier: MIT */
/* The engine when something is wrong: jobs that cannot be, lost devices, too little memory, full queues. */
#include "tests/unit/engine/engine_fake.h"

#include "base/progress.h"
#include "tests/harness/test.h"

EACH_TEST(start_engine, stop_engine)

/* ---- jobs that cannot be ------------------------------------------------------------------------ */

TEST(jobs_that_cannot_be_are_refused_with_their_field)
{
    open_scene(1, 1);
    struct engine_command *made = render(1, 2, 0, 0);
    made->job.frame.tracing.tracer = 63;
    submit(made);
    struct engine_event *event = expect_event(ENGINE_FAILED, 1, 2);
    assert_int_equal(event->error.kind, ERROR_UNSUPPORTED);
    assert_string_equal(event->error.field, "render.tracer");
    assert_non_null(strstr(event->error.remedy, "naive"));
    engine_event_destroy(event);
    made = render(1, 3, 5, 4);
    submit(made);
    expect_failed(1, 3, ERROR_INVALID, "render.last_frame");
    made = render(1, 4, 0, 0);
    made->job.encoding = ENCODING_JPEG;
    made->job.frame.picture.format = PIXEL_FORMAT_RGBA16F;
    submit(made);
    expect_failed(1, 4, ERROR_UNSUPPORTED, "render.encoding");
    made = render(1, 5, 0, 0);
    made->job.camera.camera_path = CAMERA_NODE;
    made->job.camera.camera_node = 8;
    submit(made);
    expect_failed(1, 5, ERROR_UNKNOWN_ID, "render.camera_node");
    made = render(1, 6, 0, 0);
    made->job.camera.camera_path = CAMERA_KEYS;
    submit(made);
    expect_failed(1, 6, ERROR_INVALID, "render.keys");
    made = render(1, 7, 0, 0);
    made->scene = 4;
    submit(made);
    expect_failed(1, 7, ERROR_UNKNOWN_ID, "render.scene");
}

/* ---- the device --------------------------------------------------------------------------------- */

TEST(a_lost_device_is_made_anew_and_the_frame_rendered_again)
{
    open_scene(1, 1);
    atomic_store(&fake.fail_kind, ERROR_DEVICE_LOST);
    atomic_store(&fake.fail_steps, 2);
    submit(render(1, 2, 0, 2));
    for (uint32_t frame = 0; frame <= 2; frame++)
        take_frame(1, 2, frame);
    expect_done(1, 2);
    assert_int_equal(atomic_load(&fake.devices_made), 3);
    assert_int_equal(atomic_load(&fake.devices), 1);
}

TEST(a_job_over_which_the_device_is_lost_each_time_is_put_aside_and_others_go_on)
{
    open_scene(1, 1);
    atomic_store(&fake.fail_kind, ERROR_DEVICE_LOST);
    atomic_store(&fake.fail_steps, 3);
    submit(render(1, 2, 0, 2));
    struct engine_event *event = expect_event(ENGINE_FAILED, 1, 2);
    assert_int_equal(event->error.kind, ERROR_DEVICE_LOST);
    assert_false(event->error.retryable);
    engine_event_destroy(event);
    submit(render(1, 3, 0, 0));
    take_frame(1, 3, 0);
    expect_done(1, 3);
    assert_int_equal(atomic_load(&fake.devices_made), 4);
}

TEST(a_permanently_lost_device_fails_all_jobs_and_is_reported)
{
    open_scene(1, 1);
    submit(gated(render(1, 2, 0, 2)));
    submit(gated(render(1, 3, 0, 2)));
    wait_until(&fake.frames_begun, 2);
    atomic_store(&fake.fail_kind, ERROR_DEVICE_LOST);
    atomic_store(&fake.fail_steps, 1000);
    for (int i = 0; i < 2; i++) {
        struct engine_event *event = next_event();
        assert_int_equal(event->kind, ENGINE_FAILED);
        assert_int_equal(event->error.kind, ERROR_DEVICE_LOST);
        engine_event_destroy(event);
    }
    engine_event_destroy(expect_event(ENGINE_DEVICE_GONE, 0, 0));
    assert_int_equal(atomic_load(&fake.devices_made), 4);
    submit(command(ENGINE_STATS, 1, 4)); /* the engine itself lives, for goodbyes */
    engine_event_destroy(expect_event(ENGINE_STATS_READY, 1, 4));
}

TEST(a_watchdog_sees_whether_the_engine_makes_progress)
{
    uint64_t turns = 0;
    open_scene(1, 1);
    while (!engine_is_alive(engine, &turns) || !engine_is_alive(engine, &turns))
        usleep(1000); /* the engine has nothing to do, from some time on */
    atomic_store(&fake.holds_steps, true);
    submit(render(1, 2, 0, 0));
    wait_until(&fake.steps_held, 1);
    engine_is_alive(engine, &turns);
    assert_false(engine_is_alive(engine, &turns)); /* within a step */
    progress_report();
    assert_true(engine_is_alive(engine, &turns)); /* the step is one of many parts */
    assert_false(engine_is_alive(engine, &turns));
    atomic_store(&fake.holds_steps, false);
    take_frame(1, 2, 0);
    expect_done(1, 2);
    bool alive = false; /* once the thread is back from the step, of which the frame was out before its end */
    for (int i = 0; i < 10000 && !(alive = engine_is_alive(engine, &turns)); i++)
        usleep(1000);
    assert_true(alive);
}

TEST(edits_that_waited_for_a_lost_frame_are_applied)
{
    open_scene(1, 1);
    open_scene(1, 2);
    submit(gated(render(1, 2, 0, 0)));
    struct engine_command *other = gated(render(1, 3, 0, 0));
    other->scene = 2;
    submit(other);
    wait_until(&fake.frames_begun, 2);
    submit_commit(1, 4, 1);
    submit_commit(1, 5, 2);
    expect_silence();
    atomic_store(&fake.fail_kind, ERROR_DEVICE_LOST);
    atomic_store(&fake.fail_steps, 1);
    uint32_t first = 0;
    for (int i = 0; i < 2; i++) {
        struct engine_event *event = next_event();
        assert_int_equal(event->kind, ENGINE_DONE);
        assert_true(event->request == 4 || event->request == 5);
        assert_true(event->request != first);
        first = event->request;
        engine_event_destroy(event);
    }
}

TEST(idle_scenes_are_evicted_when_device_memory_runs_out)
{
    open_scene(1, 1);
    open_scene(2, 1);
    submit(render(1, 2, 0, 0));
    take_frame(1, 2, 0);
    expect_done(1, 2);
    atomic_store(&fake.fail_kind, ERROR_OUT_OF_MEMORY);
    atomic_store(&fake.fail_steps, 1);
    submit(render(2, 2, 0, 0));
    take_frame(2, 2, 0);
    expect_done(2, 2);
    assert_int_equal(atomic_load(&fake.scenes), 1);
    assert_int_equal(atomic_load(&fake.renderers), 1);
    /* Nobody else is there to give way. */
    submit(command(ENGINE_SCENE_CLOSE, 1, 9));
    expect_done(1, 9);
    atomic_store(&fake.fail_steps, 1);
    submit(render(2, 3, 0, 0));
    expect_failed(2, 3, ERROR_OUT_OF_MEMORY, "fake");
}

static struct engine_command *seeded(uint64_t client, uint32_t seed)
{
    struct engine_command *made = render(client, seed, 0, 0);
    made->job.frame.sampling.seed = seed;
    return made;
}

TEST(a_frame_for_which_there_is_no_memory_waits_until_others_have_ended)
{
    for (uint64_t client = 1; client <= 3; client++)
        open_scene(client, 1);
    submit(gated(seeded(1, 11)));
    wait_until(&fake.frames_begun, 1);
    atomic_store(&fake.fail_kind, ERROR_OUT_OF_MEMORY);
    atomic_store(&fake.fail_seed, 12);
    atomic_store(&fake.fail_steps, 1);
    submit(seeded(2, 12));
    wait_until(&fake.frames_begun, 2);
    expect_silence(); /* the job has neither failed nor begun again */
    submit(seeded(3, 13));
    expect_silence(); /* nobody overtakes it */
    assert_int_equal(atomic_load(&fake.frames_begun), 2);
    atomic_store(&fake.fail_steps, 1); /* once more alone: what the first one has is idle by then */
    atomic_store(&fake.gate_open, true);
    for (int i = 0; i < 6; i++) { /* a frame and an answer each */
        struct engine_event *event = next_event();
        assert_true(event->kind == ENGINE_FRAME || event->kind == ENGINE_DONE);
        engine_event_destroy(event);
    }
    assert_int_equal(atomic_load(&fake.frames_begun), 5);
    assert_int_equal(atomic_load(&fake.scenes), 2);
    /* Alone on the device, and nothing is left to make room. */
    for (uint64_t client = 1; client <= 3; client += 2) {
        submit(command(ENGINE_SCENE_CLOSE, client, 20));
        expect_done(client, 20);
    }
    atomic_store(&fake.fail_steps, 1);
    submit(seeded(2, 12));
    expect_failed(2, 12, ERROR_OUT_OF_MEMORY, "fake");
}

TEST(without_a_device_there_is_no_engine)
{
    atomic_store(&fake.no_device, true);
    struct error error = {0};
    assert_null(engine_create(&(struct engine_options){.backend = &fake_backend}, &error));
    assert_int_equal(error.kind, ERROR_UNSUPPORTED);
    assert_string_equal(error.text, "there is none");
}

/* ---- queues and stats --------------------------------------------------------------------------- */

TEST(a_full_queue_is_reported_and_loses_nothing)
{
    /* Both queues fill up: nobody takes events while commands come in. */
    restart((struct engine_options){.queue_capacity = 4});
    uint32_t accepted = 0;
    for (uint32_t i = 0; i < 1000; i++) {
        struct engine_command *made = command(ENGINE_STATS, 1, accepted + 1);
        struct error error = {0};
        if (engine_submit(engine, made, &error)) {
            accepted++;
            continue;
        }
        engine_command_destroy(made);
        assert_int_equal(error.kind, ERROR_BUSY);
        assert_true(error.retryable);
        if (i > 500)
            usleep(100);
    }
    assert_true(accepted >= 8 && accepted < 20);
    for (uint32_t i = 1; i <= accepted; i++)
        engine_event_destroy(expect_event(ENGINE_STATS_READY, 1, i));
}

TEST(stats_add_up)
{
    assert_string_equal(engine_device(engine)->name, "fake");
    open_scene(1, 1);
    open_scene(1, 2);
    submit_commit(1, 2, 2);
    expect_done(1, 2);
    submit(render(1, 3, 0, 3));
    for (uint32_t frame = 0; frame <= 3; frame++)
        take_frame(1, 3, frame);
    expect_done(1, 3);
    engine_report_sent(engine, 5, 7);
    engine_report_sent(engine, 50, 70);
    submit(command(ENGINE_STATS, 1, 4));
    struct engine_event *event = expect_event(ENGINE_STATS_READY, 1, 4);
    const struct engine_stats *stats = event->stats;
    assert_int_equal(stats->frames, 4);
    assert_int_equal(stats->rays, 4 * 16);
    assert_int_equal(stats->jobs, 0);
    assert_int_equal(stats->device_limit_bytes, 700);
    assert_int_equal(stats->scene_count, 2);
    /* Memory that the job left is there for the next one. */
    assert_int_equal(stats->scenes[0].device_bytes, FAKE_SCENE_BYTES + FAKE_RENDERER_BYTES);
    assert_int_equal(stats->scenes[1].nodes, 1);
    assert_int_equal(stats->scenes[1].revision, 1);
    assert_true(stats->host_bytes > 0);
    assert_int_equal(stats->stages[STAGE_ENCODE][CLOCK_CPU].count, 4);
    assert_int_equal(stats->stages[STAGE_FRAME][CLOCK_CPU].count, 4);
    assert_int_equal(stats->stages[STAGE_SEND][CLOCK_CPU].count, 2);
    assert_int_equal(stats->stages[STAGE_SEND][CLOCK_CPU].total_ns, 77);
    assert_int_equal(stats->stages[STAGE_QUEUE][CLOCK_CPU].max_ns, 50);
    assert_int_equal(stats->scenes[1].instances, 0);
    engine_event_destroy(event);
    /* Memory of a scene is counted anew after a transaction. */
    struct engine_command *made = command(ENGINE_COMMIT, 1, 5);
    static const float sphere[4] = {0, 0, 0, 1};
    made->scene = 2;
    made->edits = calloc(2, sizeof(*made->edits));
    made->edit_count = 2;
    made->edits[0].object = OBJECT_SPHERES;
    made->edits[0].set.spheres = (struct scene_spheres){
        .base.id = 7, .value.sphere_count = 1, .centres_radii = blob_create(sizeof(sphere))};
    memcpy(made->edits[0].set.spheres.centres_radii->data, sphere, sizeof(sphere));
    made->edits[1].set.node = (struct scene_node){.base.id = 2,
                                                  .value.kind = NODE_SPHERES,
                                                  .value.object = 7,
                                                  .value.parent_from_node = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}};
    submit(made);
    expect_done(1, 5);
    for (uint32_t request = 6; request <= 7; request++) {
        submit(command(ENGINE_STATS, 1, request));
        event = expect_event(ENGINE_STATS_READY, 1, request);
        assert_int_equal(event->stats->scenes[1].nodes, 2);
        assert_int_equal(event->stats->scenes[1].instances, 1);
        assert_int_equal(event->stats->scenes[1].spheres, 1);
        engine_event_destroy(event);
    }
}
