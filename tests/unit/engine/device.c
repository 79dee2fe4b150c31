/* SPDX-License-Identifier: MIT */
/* The engine with the real renderer: frames of clients that take turns are those that each would get alone. */
#include "engine/backend.h"
#include "engine/view_mailbox.h"
#include "tests/fixtures/structure.h"
#include "tests/fixtures/frame_hooks.h"
#include "tests/harness/test.h"
#include "tests/fixtures/framing.h"

#include <poll.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include <epoxy/gl.h>

#define FRAMES 4

static struct engine *engine;

/* ---- the real renderer, watched ----------------------------------------------------------------- */

static struct tracer_impl watched_bvh;
static struct {
    /* State of the engine's thread: the tracer whose structure is unfinished; and whether this step built a
     * part. */
    const struct tracer *building;
    bool stepped;
    atomic_uint pieces, beside; /* parts of structures that have several; steps between two of them */
    atomic_bool held;           /* the second piece waits for `gate` */
    atomic_bool gate;
} watched;

static enum tracer_progress watched_update(struct tracer *tracer, struct gpu_scene *scene,
                                           const struct tracer_update *update, struct error *error)
{
    bool goes_on = watched.building == tracer;
    if (goes_on && atomic_load(&watched.pieces) == 1 && !atomic_load(&watched.gate)) {
        atomic_store(&watched.held, true);
        while (!atomic_load(&watched.gate))
            poll(NULL, 0, 1);
    }
    tracer->step_end_ns = 0; /* the shortest that it can be cut to */
    enum tracer_progress progress = tracer_bvh_impl.update(tracer, scene, update, error);
    if (goes_on || progress == TRACER_MORE) {
        watched.building = progress == TRACER_MORE ? tracer : NULL;
        atomic_fetch_add(&watched.pieces, 1);
    }
    watched.stepped = true;
    return progress;
}

static void watched_abandon(struct tracer *tracer)
{
    watched.building = NULL;
    tracer_bvh_impl.abandon(tracer);
}

static struct frame_renderer *watched_renderer(struct frame_scene *shared, struct error *error)
{
    struct frame_renderer *renderer = frame_renderer_create(shared, error);
    if (renderer)
        frame_renderer_stand_in(renderer, TRACER_BVH, &watched_bvh);
    return renderer;
}

static enum frame_progress watched_step(struct frame_renderer *renderer, struct frame_result *result,
                                        struct error *error)
{
    bool building = watched.building != NULL;
    watched.stepped = false;
    enum frame_progress progress = frame_step(renderer, result, error);
    atomic_fetch_add(&watched.beside, building && !watched.stepped);
    return progress;
}

static void watch(bool gate_open)
{
    atomic_store(&watched.pieces, 0);
    atomic_store(&watched.beside, 0);
    atomic_store(&watched.held, false);
    atomic_store(&watched.gate, gate_open);
}

static int start(void **state)
{
    (void)state;
    struct error error = {0};
    static struct engine_backend backend;
    backend = engine_backend_gpu;
    backend.renderer_create = watched_renderer;
    backend.step = watched_step;
    watched_bvh = tracer_bvh_impl;
    watched_bvh.update = watched_update;
    watched_bvh.abandon = watched_abandon;
    watch(true);
    engine = engine_create(&(struct engine_options){.gpu = {.index = -1}, .backend = &backend}, &error);
    if (!engine)
        test_skip_file("%s", error.text);
    return 0;
}

static int stop(void **state)
{
    (void)state;
    engine_destroy(engine);
    return 0;
}

static void submit(struct engine_command made)
{
    struct engine_command *command = malloc(sizeof(*command));
    assert_non_null(command);
    *command = made;
    struct error error = {0};
    if (!engine_submit(engine, command, &error))
        fail_msg("%s", error.text);
}

static struct engine_event *next_event(void)
{
    struct pollfd poll_fd = {.fd = engine_event_fd(engine), .events = POLLIN};
    poll(&poll_fd, 1, 60000);
    struct engine_event *event = engine_next_event(engine);
    assert_non_null(event);
    if (event->kind == ENGINE_FAILED)
        fail_msg("%s: %s", event->error.field, event->error.text);
    return event;
}

static void expect_done(void)
{
    struct engine_event *event = next_event();
    assert_int_equal(event->kind, ENGINE_DONE);
    engine_event_destroy(event);
}

static void expect_gone(uint64_t client)
{
    submit((struct engine_command){.kind = ENGINE_CLIENT_GONE, .client = client});
    struct engine_event *event = next_event();
    assert_int_equal(event->kind, ENGINE_CLIENT_FORGOTTEN);
    engine_event_destroy(event);
}

/* A scene of one sphere above a square, both emitting, so that they are seen without a light. */
static void make_scene(uint64_t client, float radius)
{
    submit((struct engine_command){.kind = ENGINE_SCENE_OPEN, .client = client, .request = 1, .scene = 1});
    expect_done();
    static const float square[12] = {-1, 0, -1, 1, 0, -1, 1, 0, 1, -1, 0, 1},
                       identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    static const uint32_t indices[6] = {0, 2, 1, 0, 3, 2};
    struct scene_edit *edits = calloc(5, sizeof(*edits));
    assert_non_null(edits);
    for (int i = 0; i < 5; i++)
        edits[i].object = i < 2 ? OBJECT_NODE : i == 2 ? OBJECT_MESH : i == 3 ? OBJECT_SPHERES : OBJECT_MATERIAL;
    for (int i = 0; i < 2; i++) {
        struct scene_node *node = &edits[i].set.node;
        *node = (struct scene_node){
            .base.id = (uint32_t)i + 1, .value.kind = i ? NODE_SPHERES : NODE_MESH, .value.object = 1};
        memcpy(node->value.parent_from_node, identity, sizeof(identity));
    }
    struct scene_mesh *mesh = &edits[2].set.mesh;
    *mesh = (struct scene_mesh){.base.id = 1, .value.vertex_count = 4, .value.triangle_count = 2};
    mesh->arrays[MESH_POSITIONS] = blob_create(sizeof(square));
    memcpy(mesh->arrays[MESH_POSITIONS]->data, square, sizeof(square));
    mesh->arrays[MESH_INDICES] = blob_create(sizeof(indices));
    memcpy(mesh->arrays[MESH_INDICES]->data, indices, sizeof(indices));
    struct scene_spheres *spheres = &edits[3].set.spheres;
    *spheres = (struct scene_spheres){.base.id = 1, .value.sphere_count = 1, .range_count = 1};
    spheres->centres_radii = blob_create(16);
    memcpy(spheres->centres_radii->data, (const float[]){0, radius, 0, radius}, 16);
    spheres->ranges = calloc(1, sizeof(*spheres->ranges));
    *spheres->ranges = (struct record_material_range){0, 1, 1};
    edits[4].set.material = (struct scene_material){.base.id = 1,
                                                    .value.base_colour = {1, 1, 1, 1},
                                                    .value.emission = {0.2f, 0.9f, 0.4f},
                                                    .value.roughness = 1,
                                                    .value.ior = 1.5f,
                                                    .value.specular = 1,
                                                    .value.specular_colour = {1, 1, 1}};
    submit((struct engine_command){
        .kind = ENGINE_COMMIT, .client = client, .request = 2, .scene = 1, .edits = edits, .edit_count = 5});
    expect_done();
}

static void submit_job(uint64_t client, uint32_t request, unsigned tracer)
{
    submit((struct engine_command){
        .kind = ENGINE_JOB_START,
        .client = client,
        .request = request,
        .scene = 1,
        .job =
            {
                .last_frame = FRAMES - 1,
                .frame_step = 1,
                .frames_per_second = 1,
                .frame = {.picture.width = 96,
                          .picture.height = 96,
                          .sampling.samples = 2,
                          .light.depth = 2,
                          .sampling.seed = 5,
                          .tracing.tracer = tracer,
                          .tracer_options.ldc.resolution = 64,
                          .tracing.primary = tracer == TRACER_LDC ? PRIMARY_TRACE : PRIMARY_RASTER},
                .encoding = ENCODING_ZSTD,
                .quality = 3,
                .camera = {.camera_path = CAMERA_ORBIT, USUAL_FRAMING, .orbit_turn = 1, .orbit_seconds = 1},
                .credit = FRAMES,
            },
    });
}

/* Collects the digests of all frames of both clients until each has its last answer. */
static void collect(uint64_t digests[2][FRAMES], unsigned jobs)
{
    unsigned next[2] = {0};
    while (jobs) {
        struct engine_event *event = next_event();
        if (event->kind == ENGINE_FRAME) {
            unsigned *frame = &next[event->client - 1];
            assert_int_equal(event->frame->frame, *frame);
            assert_true(stage_times_sum_ns(&event->frame->result.times, STAGE_FRAME, CLOCK_CPU) > 0);
            assert_int_equal(event->frame->result.revision, 1);
            digests[event->client - 1][(*frame)++] = event->frame->digest;
        } else {
            assert_int_equal(event->kind, ENGINE_DONE);
            assert_int_equal(next[event->client - 1], FRAMES);
            jobs--;
        }
        engine_event_destroy(event);
    }
}

ALL_TESTS(start, stop)

TEST(clients_that_take_turns_get_the_frames_they_would_get_alone)
{
    uint64_t alone[2][FRAMES], together[2][FRAMES];
    make_scene(1, 0.5f);
    make_scene(2, 0.8f);
    submit_job(1, 3, TRACER_BVH);
    collect(alone, 1);
    submit_job(2, 3, TRACER_BVH);
    collect(alone, 1);
    submit_job(1, 4, TRACER_BVH);
    submit_job(2, 4, TRACER_BVH);
    collect(together, 2);
    assert_memory_equal(alone, together, sizeof(alone));
    /* They are pictures of something: each frame and each scene has its own. */
    for (int i = 0; i < FRAMES; i++) {
        assert_true(alone[0][i] != alone[1][i]);
        assert_true(i == 0 || alone[0][i] != alone[0][i - 1]);
    }
    expect_gone(1);
    expect_gone(2);
    submit((struct engine_command){.kind = ENGINE_STATS, .client = 9, .request = 1});
    struct engine_event *event = next_event();
    assert_int_equal(event->kind, ENGINE_STATS_READY);
    assert_int_equal(event->stats->frames, 4 * FRAMES);
    assert_int_equal(event->stats->scene_count, 0);
    print_message("device: %s, %llu bytes in use after all scenes are gone\n", event->stats->device.name,
                  (unsigned long long)event->stats->device_bytes);
    assert_in_range(event->stats->device_bytes, 0, 1 << 16);
    engine_event_destroy(event);
}

/* Digests of the frames of one client's jobs, a row each, which have the requests from `first` on. Counts the
 * frames for which a cube was sampled. */
static void collect_jobs(uint64_t (*digests)[FRAMES], uint32_t first, unsigned jobs, unsigned *cubes,
                         unsigned *built)
{
    unsigned next[2] = {0}, running = jobs;
    *cubes = *built = 0;
    while (running) {
        struct engine_event *event = next_event();
        const uint32_t job = event->request - first;
        assert_in_range(job, 0, jobs - 1);
        if (event->kind == ENGINE_FRAME) {
            const struct structure_rows *structure = &event->frame->result.structure;
            *cubes += structure_row(structure, "static/resolution").number > 0;
            *built += structure_row(structure, "static/built").number != 0;
            digests[job][next[job]++] = event->frame->digest;
        } else {
            assert_int_equal(event->kind, ENGINE_DONE);
            running--;
        }
        engine_event_destroy(event);
    }
}

TEST(jobs_switch_tracers_on_one_scene_while_both_run)
{
    uint64_t alone[2][FRAMES], together[2][FRAMES];
    unsigned cubes, built;
    make_scene(3, 0.6f);
    submit_job(3, 3, TRACER_BVH);
    collect_jobs(alone, 3, 1, &cubes, &built);
    assert_int_equal(cubes, 0);
    submit_job(3, 4, TRACER_LDC);
    collect_jobs(alone + 1, 4, 1, &cubes, &built);
    assert_int_equal(cubes, FRAMES);
    assert_int_equal(built, 1); /* nothing moves but the camera */
    submit_job(3, 5, TRACER_BVH);
    submit_job(3, 6, TRACER_LDC);
    collect_jobs(together, 5, 2, &cubes, &built);
    assert_memory_equal(alone, together, sizeof(alone));
    assert_int_equal(cubes, FRAMES);
    assert_int_equal(built, 0); /* kept beside the other tracer's tree */
    for (int i = 0; i < FRAMES; i++)
        assert_true(alone[0][i] != alone[1][i]); /* 64 cells are seen */
    expect_gone(3);
}

/* ---- several views of one scene ----------------------------------------------------------------- */

#define VIEWS 4
#define BATCH_VIEW 3 /* another tracer, and a camera that moves */

/* A view that refines one picture, frame by frame. */
static void submit_view(uint64_t client, uint32_t request, uint32_t view)
{
    struct record_camera_key *key = malloc(sizeof(*key));
    assert_non_null(key);
    *key = (struct record_camera_key){.eye_world = {2.0f - (float)view, 1.5f, 3.0f},
                                      .look_at_world = {0, 0.3f, 0},
                                      .up_world = {0, 1, 0},
                                      .fov_y = 0.7f};
    struct engine_job job = {
        .last_frame = FRAMES - 1,
        .frame_step = 1,
        .frames_per_second = 1,
        .frame = {.picture.width = 160 + 50 * view,
                  .picture.height = 200,
                  .sampling.samples = 2,
                  .light.depth = 3,
                  .sampling.seed = view,
                  .sampling.accumulate = true},
        .encoding = ENCODING_ZSTD,
        .quality = 1,
        .camera = {.camera_path = CAMERA_KEYS, USUAL_FRAMING},
        .keys = key,
        .key_count = 1,
        .credit = FRAMES,
    };
    job.frame.light.integrator = view == 1 ? INTEGRATOR_PATH : view == 2 ? INTEGRATOR_AO : INTEGRATOR_WHITTED;
    if (view == BATCH_VIEW) {
        job.frame.tracing.tracer = TRACER_LDC;
        job.frame.tracer_options.ldc.resolution = 64;
        job.camera.camera_path = CAMERA_ORBIT;
        job.camera.orbit_turn = job.camera.orbit_seconds = 1;
    }
    submit((struct engine_command){
        .kind = ENGINE_JOB_START, .client = client, .request = request, .scene = 1, .job = job});
}

struct view_frame {
    uint64_t digest, begin_ns, end_ns;
    uint32_t samples;
};

static void collect_views(struct view_frame frames[VIEWS][FRAMES], uint32_t first, uint32_t jobs)
{
    unsigned next[VIEWS] = {0};
    while (jobs) {
        struct engine_event *event = next_event();
        uint32_t view = event->request - first;
        assert_in_range(view, 0, VIEWS - 1);
        jobs -= event->kind == ENGINE_DONE;
        if (event->kind == ENGINE_FRAME) {
            const struct frame_result *result = &event->frame->result;
            uint64_t frame_ns = stage_times_sum_ns(&result->times, STAGE_FRAME, CLOCK_CPU);
            frames[view][next[view]++] = (struct view_frame){event->frame->digest, result->times.origin_ns,
                                                             result->times.origin_ns + frame_ns, result->samples};
        }
        engine_event_destroy(event);
    }
}

static bool are_together(const struct view_frame frames[VIEWS][FRAMES], int a, int b)
{
    for (int i = 0; i < FRAMES; i++)
        for (int k = 0; k < FRAMES; k++)
            if (frames[a][i].begin_ns < frames[b][k].end_ns && frames[b][k].begin_ns < frames[a][i].end_ns)
                return true;
    return false;
}

TEST_LONG(views_of_one_scene_at_once_show_what_each_shows_alone)
{
    struct view_frame alone[VIEWS][FRAMES], together[VIEWS][FRAMES];
    make_scene(4, 0.6f);
    for (uint32_t view = 0; view < VIEWS; view++) {
        submit_view(4, 3 + view, view);
        collect_views(alone, 3, 1);
    }
    for (uint32_t view = 0; view < VIEWS; view++)
        submit_view(4, 3 + VIEWS + view, view);
    collect_views(together, 3 + VIEWS, VIEWS);
    for (int view = 0; view < VIEWS; view++) {
        for (uint32_t i = 0; i < FRAMES; i++) {
            assert_true(alone[view][i].digest == together[view][i].digest);
            assert_int_equal(together[view][i].samples, view == BATCH_VIEW ? 2 : 2 * (i + 1));
        }
        if (view > 0)
            assert_true(are_together(together, 0, view));
    }
    expect_gone(4);
}

#define VIEW_SAMPLES 6

static struct engine_command picture(uint32_t request, struct record_camera_key *key)
{
    struct engine_command made = {
        .kind = ENGINE_JOB_START,
        .client = 1,
        .request = request,
        .scene = 1,
        .job =
            {
                .frame_step = 1,
                .frames_per_second = 1000,
                .frame = {.picture.width = 200,
                          .picture.height = 150,
                          .sampling.samples = VIEW_SAMPLES,
                          .light.depth = 2,
                          .sampling.seed = 5,
                          .sampling.accumulate = true},
                .camera.camera_path = CAMERA_KEYS,
                .keys = malloc(sizeof(*key)),
                .key_count = 1,
                .credit = 1000,
            },
    };
    assert_non_null(made.job.keys);
    *made.job.keys = *key;
    return made;
}

/* Two views of one scene, from two places, whose frames of 2 samples each come between each other's. */
TEST(views_beside_each_other_come_to_the_pictures_of_single_frames)
{
    make_scene(1, 0.7f);
    struct record_camera_key keys[2] = {{.eye_world = {0, 1, 3}, .up_world = {0, 1, 0}, .fov_y = 1},
                                        {.eye_world = {2, 2, 1}, .up_world = {0, 1, 0}, .fov_y = 1}};
    uint64_t expected[2], seen[2] = {0};
    for (uint32_t i = 0; i < 2; i++) {
        submit(picture(10 + i, &keys[i]));
        struct engine_event *event = next_event();
        assert_int_equal(event->kind, ENGINE_FRAME);
        expected[i] = event->frame->digest;
        engine_event_destroy(event);
        expect_done();
    }
    assert_true(expected[0] != expected[1]);
    for (uint32_t i = 0; i < 2; i++) {
        struct engine_command made = picture(20 + i, &keys[1 - i]); /* where it does not look from */
        struct view_mailbox *mailbox = view_mailbox_create();
        assert_non_null(mailbox);
        view_mailbox_set_camera(mailbox, &(struct view_camera){.command = 1, .key = keys[i]});
        made.job.kind = JOB_VIEW;
        made.job.last_frame = UINT32_MAX;
        made.job.view.pass_samples = 2;
        made.job.mailbox = mailbox;
        submit(made);
    }
    while (!seen[0] || !seen[1]) {
        struct engine_event *event = next_event();
        assert_int_equal(event->kind, ENGINE_FRAME);
        const struct engine_frame *frame = event->frame;
        assert_int_equal(frame->command, 1);
        assert_int_equal(frame->result.samples, 2 * (frame->frame + 1));
        if (frame->result.samples == VIEW_SAMPLES)
            seen[event->request - 20] = frame->digest;
        else
            assert_true(frame->digest != expected[event->request - 20]);
        engine_event_destroy(event);
    }
    assert_memory_equal(seen, expected, sizeof(seen));
    expect_gone(1);
}

/* ---- a context that is lost --------------------------------------------------------------------- */

static atomic_int resets; /* resets that the driver will report, one a context */

static GLenum status_of_a_lost_context(void)
{
    int left = atomic_load(&resets);
    return left > 0 && atomic_compare_exchange_strong(&resets, &left, left - 1) ? GL_GUILTY_CONTEXT_RESET
                                                                                : GL_NO_ERROR;
}

/* The engine's thread sees it, as it reads the pointer after it has taken a command. */
static void lose_contexts(int count)
{
    atomic_store(&resets, count);
    epoxy_glGetGraphicsResetStatus = status_of_a_lost_context;
}

TEST(frames_go_on_after_a_lost_context_and_are_the_same)
{
    uint64_t before[2][FRAMES], after[2][FRAMES];
    make_scene(7, 0.7f);
    submit_job(7, 3, TRACER_BVH);
    struct engine_event *event;
    for (int i = 0; i < FRAMES; i++) {
        event = next_event();
        before[0][i] = event->frame->digest;
        engine_event_destroy(event);
    }
    expect_done();
    lose_contexts(1);
    submit_job(7, 4, TRACER_BVH);
    for (int i = 0; i < FRAMES; i++) {
        event = next_event();
        after[0][i] = event->frame->digest;
        engine_event_destroy(event);
    }
    expect_done();
    assert_int_equal(atomic_load(&resets), 0); /* the reset was reported */
    assert_memory_equal(before[0], after[0], sizeof(before[0]));
    /* Pictures that are refined, too: what was held is made again. */
    struct view_frame alone[VIEWS][FRAMES], healed[VIEWS][FRAMES];
    submit_view(7, 5, 0);
    collect_views(alone, 5, 1);
    lose_contexts(1);
    submit_view(7, 6, 0);
    collect_views(healed, 6, 1);
    assert_int_equal(atomic_load(&resets), 0);
    assert_true(alone[0][0].digest == healed[0][0].digest);
    expect_gone(7);
}

/* ---- structures that take long to build --------------------------------------------------------- */

enum { FIELD_ALONG = 200, FIELD_TRIANGLES = 2 * FIELD_ALONG * FIELD_ALONG };

/* A hilly square of many triangles in place of the plain one, each with its own vertices. */
static void make_field(uint64_t client)
{
    make_scene(client, 0.5f);
    struct scene_edit *edits = calloc(1, sizeof(*edits));
    assert_non_null(edits);
    edits[0].object = OBJECT_MESH;
    struct scene_mesh *mesh = &edits[0].set.mesh;
    *mesh = (struct scene_mesh){.base.id = 1,
                                .value.vertex_count = 3 * FIELD_TRIANGLES,
                                .value.triangle_count = FIELD_TRIANGLES,
                                .range_count = 1};
    mesh->arrays[MESH_POSITIONS] = blob_create((size_t)FIELD_TRIANGLES * 9 * sizeof(float));
    mesh->arrays[MESH_INDICES] = blob_create((size_t)FIELD_TRIANGLES * 3 * sizeof(uint32_t));
    mesh->ranges = calloc(1, sizeof(*mesh->ranges));
    assert_true(mesh->arrays[MESH_POSITIONS] && mesh->arrays[MESH_INDICES] && mesh->ranges);
    *mesh->ranges = (struct record_material_range){0, FIELD_TRIANGLES, 1};
    float *positions = (float *)(void *)mesh->arrays[MESH_POSITIONS]->data;
    uint32_t *indices = (uint32_t *)(void *)mesh->arrays[MESH_INDICES]->data;
    for (uint32_t i = 0; i < 3 * FIELD_TRIANGLES; i++) {
        uint32_t cell = i / 6, corner = i % 6;
        uint32_t x = cell % FIELD_ALONG + (corner == 1 || corner == 3 || corner == 4);
        uint32_t z = cell / FIELD_ALONG + (corner == 2 || corner == 4 || corner == 5);
        positions[3 * i] = 2.0f * (float)x / FIELD_ALONG - 1;
        positions[3 * i + 1] = (float)((x * 7 + z * 5) % 11) / 100;
        positions[3 * i + 2] = 2.0f * (float)z / FIELD_ALONG - 1;
        indices[i] = i;
    }
    submit((struct engine_command){
        .kind = ENGINE_COMMIT, .client = client, .request = 2, .scene = 1, .edits = edits, .edit_count = 1});
    expect_done();
}

/* Expects a frame and the answer behind it; returns the time. */
static uint64_t expect_picture(uint64_t *revision)
{
    struct engine_event *event = next_event();
    assert_int_equal(event->kind, ENGINE_FRAME);
    uint64_t digest = event->frame->digest;
    *revision = event->frame->result.revision;
    engine_event_destroy(event);
    expect_done();
    return digest;
}

static void submit_picture(uint64_t client, uint32_t request)
{
    struct engine_command made =
        picture(request, &(struct record_camera_key){.eye_world = {0, 2, 3}, .up_world = {0, 1, 0}, .fov_y = 1});
    made.client = client;
    made.job.frame.tracing.tracer = TRACER_BVH;
    made.job.frame.tracing.primary = PRIMARY_TRACE;
    submit(made);
}

/* The engine is in the middle of building, and stays there until the gate is opened. */
static void wait_until_held(void)
{
    for (int i = 0; i < 60000 && !atomic_load(&watched.held); i++)
        poll(NULL, 0, 1);
    assert_true(atomic_load(&watched.held));
}

static void expect_answers(unsigned answers, unsigned frames)
{
    while (answers > 0) {
        struct engine_event *event = next_event();
        answers -= event->kind == ENGINE_DONE;
        frames -= event->kind == ENGINE_FRAME;
        engine_event_destroy(event);
    }
    assert_int_equal(frames, 0);
}

TEST(others_have_their_frames_while_a_structure_is_built)
{
    make_scene(1, 0.5f);
    make_field(2);
    submit_job(1, 5, TRACER_BVH); /* its programs are there */
    expect_answers(1, FRAMES);
    watch(false);
    submit_picture(2, 5);
    wait_until_held();
    submit_job(1, 6, TRACER_BVH);
    atomic_store(&watched.gate, true);
    expect_answers(2, FRAMES + 1);
    print_message("%u pieces, %u steps of another client meanwhile\n", atomic_load(&watched.pieces),
                  atomic_load(&watched.beside));
    assert_true(atomic_load(&watched.pieces) > 2);
    assert_true(atomic_load(&watched.beside) > 1);
    expect_gone(1);
    expect_gone(2);
}

TEST(what_comes_while_a_structure_is_built_leaves_it_right)
{
    uint64_t revision, other_revision;
    make_field(1);
    submit_picture(1, 10);
    uint64_t expected = expect_picture(&revision);
    expect_gone(1);

    /* A cancel ends it there. */
    make_field(1);
    watch(false);
    submit_picture(1, 11);
    wait_until_held();
    submit((struct engine_command){.kind = ENGINE_JOB_CANCEL, .client = 1, .request = 12, .target_request = 11});
    atomic_store(&watched.gate, true);
    unsigned cancelled = 0;
    for (int i = 0; i < 2; i++) { /* the job's answer and the cancel's */
        struct pollfd poll_fd = {.fd = engine_event_fd(engine), .events = POLLIN};
        poll(&poll_fd, 1, 60000);
        struct engine_event *event = engine_next_event(engine);
        assert_non_null(event);
        assert_true(event->kind == ENGINE_FAILED || event->kind == ENGINE_DONE);
        cancelled += event->kind == ENGINE_FAILED && event->error.kind == ERROR_CANCELLED;
        engine_event_destroy(event);
    }
    assert_int_equal(cancelled, 1);
    assert_int_equal(atomic_load(&watched.pieces), 2);
    submit_picture(1, 13);
    assert_true(expect_picture(&other_revision) == expected);
    expect_gone(1);

    /* An edit waits for the picture of the revision before it. */
    make_field(1);
    watch(false);
    submit_picture(1, 14);
    wait_until_held();
    struct scene_edit *edit = calloc(1, sizeof(*edit));
    assert_non_null(edit);
    *edit = (struct scene_edit){.kind = EDIT_REMOVE, .object = OBJECT_NODE, .id = 1};
    submit((struct engine_command){
        .kind = ENGINE_COMMIT, .client = 1, .request = 15, .scene = 1, .edits = edit, .edit_count = 1});
    atomic_store(&watched.gate, true);
    unsigned frames = 0;
    for (int i = 0; i < 3; i++) { /* the picture, its job's answer and the edit's */
        struct engine_event *event = next_event();
        if (event->kind == ENGINE_FRAME) {
            assert_true(event->frame->digest == expected);
            assert_true(event->frame->result.revision == revision);
            frames++;
        }
        engine_event_destroy(event);
    }
    assert_int_equal(frames, 1);
    submit_picture(1, 16);
    assert_true(expect_picture(&other_revision) != expected);
    assert_true(other_revision > revision);
    expect_gone(1);

    /* After a lost context it is built from the beginning. */
    make_field(1);
    watch(false);
    submit_picture(1, 17);
    wait_until_held();
    lose_contexts(1);
    atomic_store(&watched.gate, true);
    assert_true(expect_picture(&other_revision) == expected);
    assert_int_equal(atomic_load(&resets), 0);
    expect_gone(1);
}
