/* SPDX-License-Identifier: MIT */
/* An engine with a renderer that the test controls, and how to talk to it. */
#ifndef FARLIGHT_TESTS_ENGINE_FAKE_H
#define FARLIGHT_TESTS_ENGINE_FAKE_H

#include "base/clock.h"
#include "engine/backend.h"
#include "engine/engine.h"
#include "render/context/request.h"
#include "tests/fixtures/framing.h"
#include "tests/fixtures/stopped_clock.h"

#include <poll.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>
#include <xxhash.h>

/* ---- a renderer that renders nothing ------------------------------------------------------------ */

/* Steps that a frame takes are its samples, and each takes ao_rays microseconds. A frame of depth 7 goes on until
 * the gate is opened, to all or to its seed; one of depth 8 changes what the frames of a scene share; steps of one
 * of depth 9 wait for the device until others have had one. */
#define GATED_DEPTH 7
#define CHANGING_DEPTH 8
#define WAITING_DEPTH 9
#define STEPS_MAX 4096

/* Bytes on the device that it says it has. */
#define FAKE_SCENE_BYTES 70
#define FAKE_RENDERER_BYTES 7

struct frame_scene {
    struct gpu_device *device;
    uint64_t revision;      /* revision of the last frame */
    bool moved;             /* with something in motion, or else changed */
    uint32_t frames, users; /* in progress; renderers */
};

struct frame_renderer {
    struct frame_scene *shared;
    const struct scene *scene;
    struct frame_request request;
    uint64_t motion_digest;
    uint32_t pose_count, steps_left;
    int last_step;
    bool busy;
    struct frame_request kept_request; /* request of the last frame, with its final number of samples */
    uint32_t kept_samples;
    uint64_t kept_revision;
    struct stage_times times;
};

static struct {
    atomic_bool gate_open;
    atomic_uint gate_seed;
    atomic_uint step_us; /* how long a step takes */
    atomic_int devices_made, devices, scenes, renderers_made, renderers, frames_begun, frames_done,
        frames_abandoned;
    atomic_int fail_steps;      /* the next steps that fail */
    atomic_uint fail_seed;      /* limits these failures to frames of that seed; 0: all */
    atomic_int fail_kind;       /* enum error_code */
    atomic_int fail_from_frame; /* frames from this number on fail; 0: none */
    atomic_bool no_device;
    atomic_bool takes_memory; /* a frame in progress takes a byte of the device's memory for each pixel */
    atomic_bool holds_steps;  /* while set, a step does not end */
    atomic_int steps_held;
    atomic_int in_progress; /* frames, of all scenes */
    atomic_int step_count;
    uint64_t step_seeds[STEPS_MAX]; /* whose step it was: the request's seed */
    uint64_t step_ns[STEPS_MAX];    /* how long it took */
} fake;

static inline struct gpu_device *fake_device_create(const struct gpu_options *options, struct error *error)
{
    (void)options;
    if (atomic_load(&fake.no_device)) {
        error_set(error, ERROR_UNSUPPORTED, "device", "there is none");
        return NULL;
    }
    struct gpu_device *device = calloc(1, sizeof(*device));
    assert_non_null(device);
    strcpy(device->info.name, "fake");
    device->facts.memory = (struct gpu_memory){GPU_MEMORY_TOTAL, 1000};
    atomic_fetch_add(&fake.devices_made, 1);
    atomic_fetch_add(&fake.devices, 1);
    return device;
}

static inline void fake_device_destroy(struct gpu_device *device)
{
    if (device)
        atomic_fetch_sub(&fake.devices, 1);
    free(device);
}

static inline struct frame_scene *fake_scene_create(struct gpu_device *device, struct error *error)
{
    (void)error;
    assert_non_null(device);
    atomic_fetch_add(&fake.scenes, 1);
    struct frame_scene *shared = calloc(1, sizeof(*shared));
    assert_non_null(shared);
    shared->device = device;
    return shared;
}

static inline void fake_scene_destroy(struct frame_scene *shared)
{
    if (!shared)
        return;
    assert_int_equal(shared->users, 0);
    atomic_fetch_sub(&fake.scenes, 1);
    free(shared);
}

static inline uint64_t fake_scene_bytes(const struct frame_scene *shared)
{
    (void)shared;
    return FAKE_SCENE_BYTES;
}

static inline struct frame_renderer *fake_renderer_create(struct frame_scene *shared, struct error *error)
{
    (void)error;
    assert_non_null(shared);
    shared->users++;
    atomic_fetch_add(&fake.renderers_made, 1);
    atomic_fetch_add(&fake.renderers, 1);
    struct frame_renderer *renderer = calloc(1, sizeof(*renderer));
    assert_non_null(renderer);
    renderer->shared = shared;
    return renderer;
}

static inline uint64_t fake_frame_bytes(const struct frame_request *request)
{
    return atomic_load(&fake.takes_memory) ? (uint64_t)request->picture.width * request->picture.height : 0;
}

static inline void fake_end_frame(struct frame_renderer *renderer)
{
    if (!renderer->busy)
        return;
    renderer->busy = false;
    gpu_memory_give(renderer->shared->device, fake_frame_bytes(&renderer->request));
    renderer->shared->frames--;
    atomic_fetch_sub(&fake.in_progress, 1);
}

static inline void fake_renderer_destroy(struct frame_renderer *renderer)
{
    if (!renderer)
        return;
    fake_end_frame(renderer);
    renderer->shared->users--;
    atomic_fetch_sub(&fake.renderers, 1);
    free(renderer);
}

static inline uint64_t fake_renderer_bytes(const struct frame_renderer *renderer)
{
    return FAKE_RENDERER_BYTES + (renderer->busy ? fake_frame_bytes(&renderer->request) : 0);
}

/* Digest of everything in a motion; 0: none. The result's `splits` has it, and `structure_bytes` the poses. */
static inline uint64_t fake_motion_digest(const struct scene_motion *motion)
{
    uint64_t digest = motion != NULL;
    for (uint32_t i = 0; motion && i < motion->pose_count; i++) {
        const struct scene_pose *pose = &motion->poses[i];
        for (uint32_t k = 0; k < pose->node_count; k++) {
            const struct pose_node *node = &pose->nodes[k];
            digest = XXH3_64bits_withSeed(node->parent_from_node, sizeof(node->parent_from_node),
                                          digest + node->node * 2 + node->hidden);
        }
        digest = XXH3_64bits_withSeed(pose->weights, pose->weight_count * sizeof(*pose->weights), digest);
        for (uint32_t k = 0; k < pose->light_count; k++)
            digest =
                XXH3_64bits_withSeed(pose->lights[k].value.colour, sizeof(pose->lights[k].value.colour), digest);
        for (uint32_t k = 0; k < pose->material_count; k++)
            digest = XXH3_64bits_withSeed(pose->materials[k].value.emission,
                                          sizeof(pose->materials[k].value.emission), digest);
    }
    return digest;
}

static inline bool fake_may_begin(const struct frame_renderer *renderer, const struct scene *scene,
                                  const struct scene_motion *motion, const struct frame_request *request)
{
    const struct frame_scene *shared = renderer->shared;
    bool moves = motion || request->light.depth == CHANGING_DEPTH;
    return !shared->frames || (!moves && !shared->moved && shared->revision == scene->revision);
}

static inline bool fake_begin(struct frame_renderer *renderer, const struct scene *scene,
                              const struct scene_motion *motion, const struct frame_request *request,
                              struct error *error)
{
    if (renderer->busy)
        return error_set(error, ERROR_INTERNAL, "fake", "a frame is in progress already");
    if (!fake_may_begin(renderer, scene, motion, request))
        return error_set(error, ERROR_INTERNAL, "fake", "a frame that may not begin");
    if (!gpu_memory_take(renderer->shared->device, fake_frame_bytes(request), "a frame", error))
        return false;
    renderer->shared->revision = scene->revision;
    renderer->shared->moved = motion || request->light.depth == CHANGING_DEPTH;
    renderer->shared->frames++;
    atomic_fetch_add(&fake.in_progress, 1);
    renderer->motion_digest = fake_motion_digest(motion);
    renderer->pose_count = motion ? motion->pose_count : 0;
    renderer->busy = true;
    renderer->scene = scene;
    renderer->request = *request;
    renderer->steps_left = request->sampling.samples;
    renderer->last_step = -1;
    stage_times_begin(&renderer->times);
    atomic_fetch_add(&fake.frames_begun, 1);
    return true;
}

static inline void fake_work(struct frame_renderer *renderer)
{
    if (clock_is_stopped())
        clock_let_pass(atomic_load(&fake.step_us) * UINT64_C(1000));
    else if (atomic_load(&fake.step_us))
        usleep(atomic_load(&fake.step_us));
    if (atomic_load(&fake.holds_steps))
        atomic_fetch_add(&fake.steps_held, 1);
    while (atomic_load(&fake.holds_steps))
        usleep(500);
    int step = renderer->last_step = atomic_fetch_add(&fake.step_count, 1);
    uint64_t start_ns = clock_now_ns(), now_ns = start_ns;
    if (clock_is_stopped())
        clock_let_pass(renderer->request.light.ao_rays * UINT64_C(1000));
    while (now_ns - start_ns < renderer->request.light.ao_rays * UINT64_C(1000))
        now_ns = clock_now_ns();
    if (step >= STEPS_MAX)
        return;
    fake.step_seeds[step] = renderer->request.sampling.seed;
    fake.step_ns[step] = now_ns - start_ns;
}

static inline enum frame_progress fake_step(struct frame_renderer *renderer, struct frame_result *result,
                                            struct error *error)
{
    fake_work(renderer);
    int fail_from = atomic_load(&fake.fail_from_frame);
    bool is_meant =
        !atomic_load(&fake.fail_seed) || renderer->request.sampling.seed == atomic_load(&fake.fail_seed);
    if ((atomic_load(&fake.fail_steps) > 0 && is_meant) ||
        (fail_from && atomic_load(&fake.frames_begun) >= fail_from)) {
        atomic_fetch_sub(&fake.fail_steps, 1);
        error_set(error, (enum error_code)atomic_load(&fake.fail_kind), "fake", "as the test wants");
        return FRAME_FAILED;
    }
    unsigned let_through = atomic_load(&fake.gate_seed);
    bool is_gated = renderer->request.light.depth == GATED_DEPTH &&
                    !(let_through && renderer->request.sampling.seed == let_through);
    if (is_gated && !atomic_load(&fake.gate_open)) {
        usleep(500);
        return FRAME_MORE;
    }
    if (--renderer->steps_left > 0)
        return FRAME_MORE;
    bool goes_on = renderer->kept_samples && renderer->kept_revision == renderer->scene->revision &&
                   frame_request_adds_to(&renderer->kept_request, &renderer->request);
    uint32_t before = goes_on ? renderer->kept_samples : 0, maximum = renderer->request.samples_max;
    uint32_t all = before + renderer->request.sampling.samples;
    renderer->kept_samples = before && maximum && all > maximum ? (before > maximum ? before : maximum) : all;
    renderer->kept_request = renderer->request;
    renderer->kept_revision = renderer->scene->revision;
    const struct frame_request *request = &renderer->request;
    size_t all_bytes = (size_t)frame_request_bytes(request);
    size_t attached = (size_t)__builtin_popcount(request->attachments);
    *result = (struct frame_result){
        .width = renderer->request.picture.width,
        .height = renderer->request.picture.height,
        .size_bytes = all_bytes - 4 * attached * request->picture.width * request->picture.height,
        .format = renderer->request.picture.format,
        .ycbcr = request->ycbcr,
        .revision = renderer->scene->revision,
        .samples = renderer->kept_samples,
        .noise = 1.0f / (float)renderer->kept_samples,
        .layers = frame_request_layers(request),
        .attachments = request->attachments,
        .primary_rays = 10,
        .shadow_rays = 5,
        .secondary_rays = 1,
        .splits = renderer->motion_digest,
        .structure_bytes = renderer->pose_count,
        .times = renderer->times,
    };
    result->pixels = malloc(all_bytes);
    assert_non_null(result->pixels);
    memset(result->pixels, atomic_fetch_add(&fake.frames_done, 1), all_bytes);
    fake_end_frame(renderer);
    return FRAME_DONE;
}

static inline bool fake_step_waits(const struct frame_renderer *renderer)
{
    return renderer->request.light.depth == WAITING_DEPTH &&
           atomic_load(&fake.step_count) == renderer->last_step + 1;
}

static inline void fake_abandon(struct frame_renderer *renderer)
{
    fake_end_frame(renderer);
    renderer->kept_samples = 0;
    atomic_fetch_add(&fake.frames_abandoned, 1);
}

static const struct engine_backend fake_backend = {
    .device_create = fake_device_create,
    .device_destroy = fake_device_destroy,
    .scene_create = fake_scene_create,
    .scene_destroy = fake_scene_destroy,
    .scene_bytes = fake_scene_bytes,
    .renderer_create = fake_renderer_create,
    .renderer_destroy = fake_renderer_destroy,
    .renderer_bytes = fake_renderer_bytes,
    .may_begin = fake_may_begin,
    .begin = fake_begin,
    .step = fake_step,
    .step_waits = fake_step_waits,
    .abandon = fake_abandon,
};

/* ---- talking to the engine ---------------------------------------------------------------------- */

static struct engine *engine; /* the test's */

static inline void start(struct engine_options options)
{
    atomic_store(&fake.gate_open, false);
    atomic_store(&fake.gate_seed, 0);
    atomic_store(&fake.step_us, 0);
    atomic_store(&fake.fail_steps, 0);
    atomic_store(&fake.fail_seed, 0);
    atomic_store(&fake.fail_from_frame, 0);
    atomic_store(&fake.no_device, false);
    atomic_store(&fake.takes_memory, false);
    atomic_store(&fake.step_count, 0);
    atomic_store(&fake.renderers_made, 0);
    atomic_store(&fake.devices_made, 0);
    atomic_store(&fake.frames_begun, 0);
    atomic_store(&fake.frames_done, 0);
    atomic_store(&fake.frames_abandoned, 0);
    options.backend = &fake_backend;
    struct error error = {0};
    engine = engine_create(&options, &error);
    if (!engine)
        fail_msg("%s: %s", error.field, error.text);
}

static inline void stop(void)
{
    engine_destroy(engine);
    assert_int_equal(atomic_load(&fake.devices), 0);
    assert_int_equal(atomic_load(&fake.scenes), 0);
    assert_int_equal(atomic_load(&fake.renderers), 0);
    assert_int_equal(atomic_load(&fake.in_progress), 0);
}

/* In place of the one that runs. */
static inline void restart(struct engine_options options)
{
    stop();
    start(options);
}

/* An engine without options, for EACH_TEST. */
static inline int start_engine(void **state)
{
    (void)state;
    start((struct engine_options){0});
    return 0;
}

static inline int stop_engine(void **state)
{
    (void)state;
    atomic_store(&fake.holds_steps, false);
    clock_start();
    stop();
    return 0;
}

static inline struct engine_command *command(enum engine_command_kind kind, uint64_t client, uint32_t request)
{
    struct engine_command *made = calloc(1, sizeof(*made));
    assert_non_null(made);
    made->kind = kind;
    made->client = client;
    made->request = request;
    made->scene = 1;
    return made;
}

static inline void submit(struct engine_command *made)
{
    struct error error = {0};
    if (!engine_submit(engine, made, &error))
        fail_msg("%s", error.text);
}

/* NULL: none came in that time. */
static inline struct engine_event *event_within(int ms)
{
    struct pollfd poll_fd = {.fd = engine_event_fd(engine), .events = POLLIN};
    poll(&poll_fd, 1, ms);
    return engine_next_event(engine);
}

static inline struct engine_event *next_event(void)
{
    struct engine_event *event = event_within(60000);
    assert_non_null(event);
    return event;
}

static inline struct engine_event *expect_event(enum engine_event_kind kind, uint64_t client, uint32_t request)
{
    struct engine_event *event = event_within(60000);
    if (!event)
        fail_msg("no event; expected kind %d for request %u", kind, request);
    if (event->kind != kind || event->client != client || event->request != request)
        fail_msg("event kind %d for client %d, request %u; expected %d, %d, %u (%s: %s)", event->kind,
                 (int)event->client, event->request, kind, (int)client, request, event->error.field,
                 event->error.text);
    return event;
}

static inline void expect_forgotten(uint64_t client)
{
    engine_event_destroy(expect_event(ENGINE_CLIENT_FORGOTTEN, client, 0));
}

static inline uint64_t expect_done(uint64_t client, uint32_t request)
{
    struct engine_event *event = expect_event(ENGINE_DONE, client, request);
    uint64_t revision = event->revision;
    engine_event_destroy(event);
    return revision;
}

static inline void expect_failed(uint64_t client, uint32_t request, enum error_code kind, const char *field)
{
    struct engine_event *event = expect_event(ENGINE_FAILED, client, request);
    if (event->error.kind != kind)
        fail_msg("error kind %d (%s), expected %d", event->error.kind, event->error.text, kind);
    assert_string_equal(event->error.field, field);
    engine_event_destroy(event);
}

static inline struct engine_event *expect_frame(uint64_t client, uint32_t request, uint32_t frame)
{
    struct engine_event *event = expect_event(ENGINE_FRAME, client, request);
    if (event->frame->frame != frame)
        fail_msg("frame %u, expected %u", event->frame->frame, frame);
    return event;
}

static inline void take_frame(uint64_t client, uint32_t request, uint32_t frame)
{
    engine_event_destroy(expect_frame(client, request, frame));
}

static inline void expect_silence(void)
{
    struct engine_event *event = event_within(60);
    if (event)
        fail_msg("event kind %d for client %d, request %u; expected none", event->kind, (int)event->client,
                 event->request);
}

/* Asserts that each of two jobs had its share of the time while both had work left, by a clock that is stopped:
 * the time of a by its weight is that of b by its own, within a step of each. */
static inline void expect_shares(uint64_t seed_a, uint32_t weight_a, uint64_t seed_b, uint32_t weight_b)
{
    const uint64_t seeds[2] = {seed_a, seed_b};
    const uint32_t weights[2] = {weight_a, weight_b};
    uint64_t had_ns[2] = {0}, longest_ns[2] = {0};
    int count = atomic_load(&fake.step_count), last[2] = {0};
    assert_true(count <= STEPS_MAX);
    for (int i = 0; i < count; i++)
        for (int k = 0; k < 2; k++)
            last[k] = fake.step_seeds[i] == seeds[k] ? i : last[k];
    for (int i = 0; i < (last[0] < last[1] ? last[0] : last[1]); i++) {
        for (int k = 0; k < 2; k++) {
            if (fake.step_seeds[i] != seeds[k])
                continue;
            uint64_t virtual_ns = fake.step_ns[i] / weights[k];
            had_ns[k] += virtual_ns;
            longest_ns[k] = virtual_ns > longest_ns[k] ? virtual_ns : longest_ns[k];
        }
    }
    uint64_t more_ns = had_ns[0] > had_ns[1] ? had_ns[0] - had_ns[1] : had_ns[1] - had_ns[0];
    if (more_ns > longest_ns[0] + longest_ns[1])
        fail_msg("one had %.1f ms, divided by its weight, the other %.1f", (double)had_ns[0] * 1e-6,
                 (double)had_ns[1] * 1e-6);
    assert_true(had_ns[0] > 0 && had_ns[1] > 0);
}

static inline void wait_until(const atomic_int *counter, int value)
{
    for (int i = 0; i < 60000 && atomic_load(counter) < value; i++)
        usleep(1000);
    assert_true(atomic_load(counter) >= value);
}

static inline void open_scene(uint64_t client, uint32_t scene)
{
    struct engine_command *made = command(ENGINE_SCENE_OPEN, client, 1000 + scene);
    made->scene = scene;
    submit(made);
    assert_int_equal(expect_done(client, 1000 + scene), 0);
}

/* A transaction that makes group nodes 1 .. count. */
static inline struct engine_command *commit_of_nodes(uint64_t client, uint32_t request, uint32_t scene,
                                                     uint32_t count)
{
    struct engine_command *made = command(ENGINE_COMMIT, client, request);
    made->scene = scene;
    made->edits = calloc(count, sizeof(*made->edits));
    assert_non_null(made->edits);
    made->edit_count = count;
    for (uint32_t i = 0; i < count; i++) {
        made->edits[i].set.node.base.id = i + 1;
        made->edits[i].set.node.value.parent_from_node[0] = 1;
    }
    return made;
}

static inline void submit_commit(uint64_t client, uint32_t request, uint32_t scene)
{
    submit(commit_of_nodes(client, request, scene, 1));
}

static inline struct engine_command *render(uint64_t client, uint32_t request, uint32_t first, uint32_t last)
{
    struct engine_command *made = command(ENGINE_JOB_START, client, request);
    made->job = (struct engine_job){
        .first_frame = first,
        .last_frame = last,
        .frame_step = 1,
        .frames_per_second = 24,
        .frame = {.picture.width = 4, .picture.height = 3, .sampling.samples = 1, .tracing.tracer = 0},
        .camera = {USUAL_FRAMING},
        .encoding = ENCODING_RAW,
        .quality = 3,
        .credit = 1000,
    };
    return made;
}

static inline struct engine_command *gated(struct engine_command *made)
{
    made->job.frame.light.depth = GATED_DEPTH;
    return made;
}

static inline void submit_target(enum engine_command_kind kind, uint64_t client, uint32_t request, uint32_t target,
                                 uint64_t credit)
{
    struct engine_command *made = command(kind, client, request);
    made->target_request = target;
    made->credit = credit;
    submit(made);
}

#endif
