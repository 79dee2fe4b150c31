/* SPDX-License-Identifier: MIT */
/* The engine with a renderer that the tests control: order, credit, edits, cancel, clients that go. */
#include "tests/unit/engine/engine_fake.h"

#include "base/clock.h"
#include "tests/accuracy/test_scenes.h"
#include "tests/harness/test.h"

#include <xxhash.h>
#include <zstd.h>

EACH_TEST(start_engine, stop_engine)

/* ---- frames ------------------------------------------------------------------------------------- */

TEST(frames_come_in_order_with_what_they_cost)
{
    restart((struct engine_options){.encode_threads = 4});
    open_scene(1, 1);
    submit_commit(1, 2, 1);
    assert_int_equal(expect_done(1, 2), 1);
    struct engine_command *made = render(1, 3, 10, 100);
    made->job.frame_step = 3;
    made->job.time_origin_frame = 10;
    submit(made);
    for (uint32_t frame = 10; frame <= 100; frame += 3) {
        struct engine_event *event = expect_frame(1, 3, frame);
        const struct engine_frame *got = event->frame;
        assert_int_equal(got->size_bytes, 4 * 3 * 4);
        assert_int_equal(got->bytes[0], (frame - 10) / 3);
        assert_true(got->digest == XXH3_64bits(got->bytes, got->size_bytes));
        assert_int_equal(got->result.revision, 1);
        assert_null(got->result.pixels);
        assert_true(got->time_s == (float)((frame - 10) / 24.0));
        assert_true(got->encoded_ns <= clock_now_ns());
        assert_true(stage_times_sum_ns(&got->result.times, STAGE_FRAME, CLOCK_CPU) > 0);
        assert_true(stage_times_sum_ns(&got->result.times, STAGE_ENCODE, CLOCK_CPU) > 0);
        /* The commit is reported once. */
        assert_int_equal(stage_times_sum_ns(&got->result.times, STAGE_APPLY, CLOCK_CPU) > 0, frame == 10);
        engine_event_destroy(event);
    }
    expect_done(1, 3);
    expect_silence();
}

static void expect_samples(uint32_t request, bool starts_anew, const uint32_t samples[3])
{
    struct engine_command *made = render(1, request, 5, 7);
    made->job.frame.sampling.samples = 4;
    made->job.frame.sampling.accumulate = true;
    made->job.frame.starts_anew = starts_anew;
    submit(made);
    for (uint32_t i = 0; i < 3; i++) {
        struct engine_event *event = expect_frame(1, request, 5 + i);
        assert_int_equal(event->frame->result.samples, samples[i]);
        engine_event_destroy(event);
    }
    expect_done(1, request);
}

TEST(a_job_adds_to_the_samples_of_the_one_before_it_unless_it_starts_anew)
{
    restart((struct engine_options){.encode_threads = 1});
    open_scene(1, 1);
    expect_samples(2, false, (const uint32_t[]){4, 8, 12});
    expect_samples(3, false, (const uint32_t[]){16, 20, 24});
    expect_samples(4, true, (const uint32_t[]){4, 8, 12});
}

TEST(layers_are_encoded_as_one_picture)
{
    restart((struct engine_options){.encode_threads = 1});
    const uint32_t layers = 1u << LAYER_BEAUTY | 1u << LAYER_NORMAL | 1u << LAYER_ID;
    open_scene(1, 1);
    for (uint32_t encoding = ENCODING_RAW; encoding <= ENCODING_ZSTD; encoding++) {
        struct engine_command *made = render(1, 2 + encoding, 0, 0);
        made->job.encoding = (enum encoding)encoding;
        made->job.frame.picture.format = PIXEL_FORMAT_RGBA32F;
        made->job.frame.picture.layers = layers;
        submit(made);
        struct engine_event *event = expect_frame(1, 2 + encoding, 0);
        const struct engine_frame *got = event->frame;
        uint8_t pixels[4 * 3 * 16 * 3];
        memset(pixels, (int)encoding, sizeof(pixels)); /* the fake's frames count up */
        assert_int_equal(got->result.layers, layers);
        assert_true(got->digest == XXH3_64bits(pixels, sizeof(pixels)));
        if (encoding == ENCODING_RAW) {
            assert_int_equal(got->size_bytes, sizeof(pixels));
            assert_memory_equal(got->bytes, pixels, sizeof(pixels));
        } else {
            uint8_t back[sizeof(pixels) + 1];
            assert_int_equal(ZSTD_decompress(back, sizeof(back), got->bytes, got->size_bytes), sizeof(pixels));
            assert_memory_equal(back, pixels, sizeof(pixels));
        }
        engine_event_destroy(event);
        expect_done(1, 2 + encoding);
    }
}

TEST(no_frame_goes_out_beyond_its_credit)
{
    restart((struct engine_options){.frames_in_flight = 3});
    open_scene(1, 1);
    struct engine_command *made = render(1, 2, 0, 9);
    made->job.credit = 2;
    submit(made);
    take_frame(1, 2, 0);
    take_frame(1, 2, 1);
    expect_silence();
    /* Ahead of the credit, as many as may be in flight are rendered, and not one more. */
    assert_int_equal(atomic_load(&fake.frames_begun), 5);
    submit_target(ENGINE_JOB_CREDIT, 1, 0, 2, 4);
    take_frame(1, 2, 2);
    take_frame(1, 2, 3);
    expect_silence();
    assert_int_equal(atomic_load(&fake.frames_begun), 7);
    submit_target(ENGINE_JOB_CREDIT, 1, 0, 2, 3); /* absolute: less than before changes nothing */
    expect_silence();
    submit_target(ENGINE_JOB_CREDIT, 1, 0, 2, 100);
    for (uint32_t frame = 4; frame <= 9; frame++)
        take_frame(1, 2, frame);
    expect_done(1, 2);
}

TEST(large_frames_are_fewer_in_flight_but_always_one)
{
    for (int frames = 1; frames <= 4; frames++) {
        /* A frame of the test has 48 bytes. */
        uint64_t bytes = frames == 1 ? 10 : (uint64_t)frames * 48 + 10;
        restart((struct engine_options){.frames_in_flight = 3, .frame_window_bytes = bytes});
        open_scene(1, 1);
        struct engine_command *made = render(1, 2, 0, 9);
        made->job.credit = 1;
        submit(made);
        take_frame(1, 2, 0);
        expect_silence();
        assert_int_equal(atomic_load(&fake.frames_begun), 1 + (frames < 3 ? frames : 3));
        submit_target(ENGINE_JOB_CREDIT, 1, 0, 2, 100);
        for (uint32_t frame = 1; frame <= 9; frame++)
            take_frame(1, 2, frame);
        expect_done(1, 2);
    }
}

/* Slices of one client take ten times as long as those of the other. */
static void run_beside_each_other(uint32_t weight_of_first)
{
    clock_stop();
    atomic_store(&fake.holds_steps, true); /* until both are there */
    for (uint64_t client = 1; client <= 2; client++)
        open_scene(client, 1);
    for (uint64_t client = 1; client <= 2; client++) {
        struct engine_command *made = render(client, 5, 0, 0);
        made->job.frame.sampling.samples = client == 1 ? 40 : 400;
        made->job.frame.light.ao_rays = client == 1 ? 5000 : 500;
        made->job.frame.sampling.seed = client;
        made->job.weight = client == 1 ? weight_of_first : 0;
        submit(made);
    }
    atomic_store(&fake.holds_steps, false);
    for (int i = 0; i < 4; i++)
        engine_event_destroy(next_event());
    expect_shares(1, weight_of_first, 2, 1);
}

TEST(clients_have_the_same_share_of_time_however_long_their_slices_are)
{
    run_beside_each_other(1);
}

TEST(the_weight_of_a_job_is_its_clients_share)
{
    run_beside_each_other(4);
}

TEST(a_job_that_would_wait_for_the_device_lets_others_go_first)
{
    for (uint64_t client = 1; client <= 2; client++) {
        open_scene(client, 1);
        struct engine_command *made = gated(render(client, 5, 0, 0));
        made->job.frame.sampling.samples = 30;
        made->job.frame.sampling.seed = client;
        made->job.frame.light.ao_rays = 200;
        made->job.weight = client == 1 ? 16 : 1;
        if (client == 1)
            made->job.frame.light.depth = WAITING_DEPTH;
        submit(made);
    }
    atomic_store(&fake.gate_open, true);
    for (int i = 0; i < 4; i++)
        engine_event_destroy(next_event());
    /* Alone it goes on all the same; together it would have sixteen of seventeen steps. */
    int last = 0, begun = 0;
    for (int i = 0; i < atomic_load(&fake.step_count); i++)
        last = fake.step_seeds[i] == 2 ? i : last;
    while (fake.step_seeds[begun] == 1)
        begun++;
    for (int i = begun + 1; i < last; i++)
        assert_false(fake.step_seeds[i] == 1 && fake.step_seeds[i - 1] == 1);
}

/* ---- edits -------------------------------------------------------------------------------------- */

TEST(edits_wait_for_the_frame_in_hand_and_others_do_not)
{
    open_scene(1, 1);
    open_scene(1, 2);
    submit_commit(1, 3, 1);
    expect_done(1, 3);
    submit(gated(render(1, 4, 0, 1)));
    wait_until(&fake.frames_begun, 1);
    submit_commit(1, 5, 1);
    submit_commit(1, 6, 2);
    assert_int_equal(expect_done(1, 6), 1); /* another scene */
    expect_silence();
    atomic_store(&fake.gate_open, true);
    bool applied = false;
    uint32_t frames = 0;
    while (!applied || frames < 2) {
        struct engine_event *event = next_event();
        if (event->kind == ENGINE_FRAME) {
            /* The frame in hand shows what it began with, the next one the edit. */
            assert_int_equal(event->frame->result.revision, frames + 1);
            frames++;
        } else {
            assert_int_equal(event->kind, ENGINE_DONE);
            if (event->request == 5) {
                assert_int_equal(event->revision, 2);
                applied = true;
            }
        }
        engine_event_destroy(event);
    }
    expect_done(1, 4);
}

TEST(what_waits_for_a_frame_keeps_its_order_and_can_be_cancelled)
{
    open_scene(1, 1);
    submit(gated(render(1, 4, 0, 0)));
    wait_until(&fake.frames_begun, 1);
    submit_commit(1, 5, 1);
    submit(render(1, 6, 0, 0)); /* must show the commit */
    submit(render(1, 7, 0, 0));
    submit_target(ENGINE_JOB_CANCEL, 1, 8, 7, 0);
    expect_failed(1, 7, ERROR_CANCELLED, "");
    expect_done(1, 8);
    atomic_store(&fake.gate_open, true);
    unsigned answered = 0;
    while (answered != 7) {
        struct engine_event *event = next_event();
        if (event->kind == ENGINE_FRAME)
            assert_int_equal(event->frame->result.revision, event->request == 6);
        else
            answered |= 1u << (event->request - 4);
        engine_event_destroy(event);
    }
}

/* ---- ends --------------------------------------------------------------------------------------- */

TEST(a_cancel_is_answered_once_after_its_job)
{
    open_scene(1, 1);
    submit(gated(render(1, 2, 0, 9)));
    wait_until(&fake.frames_begun, 1);
    submit_target(ENGINE_JOB_CANCEL, 1, 3, 2, 0);
    submit_target(ENGINE_JOB_CANCEL, 1, 4, 2, 0);
    expect_failed(1, 2, ERROR_CANCELLED, "");
    expect_done(1, 3);
    expect_done(1, 4); /* there is nothing left to cancel */
    expect_silence();
    assert_int_equal(atomic_load(&fake.frames_abandoned), 1);
    /* The scene is free for others. */
    submit(render(1, 5, 0, 0));
    take_frame(1, 5, 0);
    expect_done(1, 5);
    submit_target(ENGINE_JOB_CANCEL, 1, 6, 5, 0);
    expect_done(1, 6);
}

/* Spheres in many places: their bounds take a while, which a thread of its own spends. */
static void fill_scene(uint32_t request)
{
    enum { SPHERES = 2000, NODES = 3000 };
    struct engine_command *made = commit_of_nodes(1, request, 1, NODES + 1);
    float(*spheres)[4] = calloc(SPHERES, sizeof(*spheres));
    for (uint32_t i = 0; i < SPHERES; i++)
        spheres[i][3] = 1.0f + (float)i / SPHERES;
    struct scene_edit *edit = &made->edits[NODES];
    *edit = (struct scene_edit){.object = OBJECT_SPHERES};
    edit->set.spheres = (struct scene_spheres){.base.id = 1,
                                               .value.sphere_count = SPHERES,
                                               .centres_radii = test_blob(spheres, SPHERES * sizeof(*spheres))};
    free(spheres);
    for (uint32_t i = 0; i < NODES; i++) {
        struct scene_node *node = &made->edits[i].set.node;
        node->value.kind = NODE_SPHERES;
        node->value.object = 1;
        node->value.parent_from_node[0] = node->value.parent_from_node[5] = node->value.parent_from_node[10] = 1;
        node->value.parent_from_node[3] = (float)i;
    }
    submit(made);
    expect_done(1, request);
}

TEST(a_job_that_searches_a_large_scene_for_its_camera_can_be_cancelled_and_others_follow_it)
{
    open_scene(1, 1);
    fill_scene(2);
    struct engine_command *made[2] = {render(1, 3, 0, 0), render(1, 5, 0, 0)};
    for (int i = 0; i < 2; i++)
        made[i]->job.camera.camera_path = CAMERA_AUTO;
    submit(made[0]);
    submit_target(ENGINE_JOB_CANCEL, 1, 4, 3, 0);
    expect_failed(1, 3, ERROR_CANCELLED, "");
    expect_done(1, 4);
    submit(made[1]);
    submit_commit(1, 6, 1);
    uint64_t revision = 0;
    for (unsigned answered = 0; answered < 3; answered++) {
        struct engine_event *event = next_event();
        assert_int_not_equal(event->kind, ENGINE_FAILED);
        if (event->request == 6)
            revision = event->revision;
        engine_event_destroy(event);
    }
    assert_int_equal(revision, 2);
}

TEST(a_cancelled_job_that_lacks_credit_ends_too)
{
    open_scene(1, 1);
    struct engine_command *made = render(1, 2, 0, 3);
    made->job.credit = 1;
    submit(made);
    take_frame(1, 2, 0);
    wait_until(&fake.frames_done, 4);
    expect_silence();
    submit_target(ENGINE_JOB_CANCEL, 1, 3, 2, 0);
    expect_failed(1, 2, ERROR_CANCELLED, "");
    expect_done(1, 3);
}

TEST(a_client_that_goes_is_forgotten_and_others_go_on)
{
    open_scene(1, 1);
    open_scene(2, 1);
    submit(gated(render(1, 2, 0, 9)));
    submit(gated(render(2, 2, 0, 0)));
    wait_until(&fake.frames_begun, 2);
    submit_commit(1, 3, 1); /* waits for the frame, and is never answered */
    submit(command(ENGINE_CLIENT_GONE, 1, 0));
    expect_forgotten(1);
    assert_int_equal(atomic_load(&fake.renderers), 1);
    expect_silence();
    atomic_store(&fake.gate_open, true);
    take_frame(2, 2, 0);
    expect_done(2, 2);
    submit(command(ENGINE_CLIENT_GONE, 9, 0)); /* was never seen */
    expect_forgotten(9);
}

TEST(a_frame_that_fails_comes_after_those_before_it)
{
    restart((struct engine_options){.encode_threads = 3});
    open_scene(1, 1);
    atomic_store(&fake.fail_kind, ERROR_INTERNAL);
    atomic_store(&fake.fail_from_frame, 4);
    submit(render(1, 2, 0, 9));
    for (uint32_t frame = 0; frame < 3; frame++)
        take_frame(1, 2, frame);
    expect_failed(1, 2, ERROR_INTERNAL, "fake");
    expect_silence();
}

TEST(the_tables_of_all_scenes_together_have_a_limit)
{
    /* Room for about 100 nodes. */
    uint64_t limit_bytes = 100 * (sizeof(struct scene_node) + 32) + 10;
    restart((struct engine_options){.limits.scene = {.host_bytes = limit_bytes}});
    for (uint32_t scene = 1; scene <= 2; scene++)
        open_scene(1, scene);
    open_scene(2, 1);
    submit(commit_of_nodes(1, 1, 1, 60));
    expect_done(1, 1);
    submit(commit_of_nodes(1, 2, 2, 60));
    expect_failed(1, 2, ERROR_LIMIT, "edits");
    submit(commit_of_nodes(2, 3, 1, 60));
    expect_failed(2, 3, ERROR_LIMIT, "edits");
    submit(commit_of_nodes(2, 4, 1, 40));
    expect_done(2, 4);
    submit(commit_of_nodes(1, 5, 1, 60)); /* its share of the limit */
    expect_done(1, 5);
    submit(command(ENGINE_CLIENT_GONE, 2, 0));
    expect_forgotten(2);
    struct engine_command *close = command(ENGINE_SCENE_CLOSE, 1, 6);
    submit(close);
    expect_done(1, 6);
    submit(commit_of_nodes(1, 7, 2, 100));
    expect_done(1, 7);
}

TEST(an_engine_stops_with_work_in_hand)
{
    restart((struct engine_options){.queue_capacity = 2});
    open_scene(1, 1);
    submit(render(1, 2, 0, 1000));
    submit(command(ENGINE_STATS, 1, 3));
    usleep(20000);
    submit_commit(1, 4, 1);
}
