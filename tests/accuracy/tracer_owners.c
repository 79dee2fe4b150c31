/* SPDX-License-Identifier: MIT */
/* Dependence of a tracer decides when it is brought to the scene and who owns it: the scene, a view, or the
 * work of a frame. Stand-ins that count their calls answer as `naive` does. */
#include "tests/accuracy/render_fixture.h"
#include "tests/fixtures/frame_hooks.h"
#include "tests/harness/test.h"

#include "render/frame/work.h"

#define STEPS 3u /* steps of a wave, for the tracer that advances in a way of its own */

/* ---- tracers that count ---- */

static struct {
    unsigned creates, destroys;   /* numbers of tracers */
    unsigned updates, changed;    /* calls since count_anew(), and the bits of all of them */
    struct trace_view view;       /* the last view */
    unsigned states, states_made; /* states of waves: alive, and made so far */
    unsigned steps;
} counts;

static const struct tracer_impl *behind; /* the tracer that answers */

static void count_anew(void)
{
    counts.updates = counts.changed = 0;
}

static struct tracer *counting_create(struct gpu_device *on, const struct tracer_options *options,
                                      struct error *error)
{
    counts.creates++;
    return behind->create(on, options, error);
}

static void counting_destroy(struct tracer *tracer)
{
    counts.destroys++;
    behind->destroy(tracer);
}

static enum tracer_progress counting_update(struct tracer *tracer, struct gpu_scene *scene,
                                            const struct tracer_update *update, struct error *error)
{
    counts.updates++;
    counts.changed |= update->changed;
    if (tracer->impl->depends_on & CHANGED_VIEW)
        counts.view = *update->view;
    return behind->update(tracer, scene, update, error);
}

struct batches {
    struct trace_state base;
    unsigned step;
    struct gpu_buffer own;
};

static struct trace_state *batches_create(struct gpu_device *on, const struct tracer_options *options,
                                          struct error *error)
{
    (void)options;
    struct batches *state = calloc(1, sizeof(*state));
    assert_non_null(state);
    assert_true(gpu_buffer_reserve(on, &state->own, 4096, error));
    counts.states++;
    counts.states_made++;
    return &state->base;
}

static void batches_destroy(struct trace_state *state)
{
    gpu_buffer_finish(state->device, &((struct batches *)state)->own);
    free(state);
    counts.states--;
}

static uint64_t batches_bytes(const struct trace_state *state)
{
    return ((const struct batches *)state)->own.capacity_bytes;
}

static bool batches_begin(struct tracer *tracer, struct gpu_scene *scene, struct trace_state *state,
                          struct error *error)
{
    (void)tracer, (void)scene, (void)error;
    ((struct batches *)state)->step = 0;
    return true;
}

/* Rays become final after the last step, and not before. */
static enum tracer_progress batches_step(struct tracer *tracer, struct gpu_scene *scene, struct trace_state *state,
                                         uint64_t step_end_ns, struct error *error)
{
    const struct ray_range all = {.wave = &state->wave, .end = state->wave.ray_count};
    (void)step_end_ns;
    counts.steps++;
    if (++((struct batches *)state)->step < STEPS)
        return TRACER_MORE;
    return tracer_progress_of(behind->trace_range(tracer, scene, state, &all, error));
}

/* In place of `number`, a tracer that counts and has these dependencies beside those of `answering`. */
static void stand_in(struct fixture *fixture, struct frame_renderer *renderer, const struct tracer_impl *answering,
                     unsigned number, unsigned more, bool in_batches)
{
    static struct tracer_impl impl;
    behind = answering;
    impl = *answering;
    impl.name = "counting";
    impl.depends_on |= more;
    impl.create = counting_create;
    impl.destroy = counting_destroy;
    impl.update = counting_update;
    if (in_batches) {
        impl.state_create = batches_create;
        impl.state_destroy = batches_destroy;
        impl.state_device_bytes = batches_bytes;
        impl.trace_begin = batches_begin;
        impl.trace_range = NULL;
        impl.trace_step = batches_step;
    }
    frame_renderer_stand_in(renderer, number, &impl);
    fixture->request.tracing.tracer = number;
}

static int clear_all(void **state)
{
    int status = fixture_clear(state); /* which destroys what the test before made */
    memset(&counts, 0, sizeof(counts));
    return status;
}

ALL_TESTS(fixture_setup, fixture_teardown)
EACH_TEST(clear_all, NULL)

/* ---- scenes ---- */

struct ids {
    uint32_t square_node, square, light_node, light, disc;
};

static void set_disc(struct fixture *fixture, uint32_t id, uint32_t material, float radius)
{
    struct scene_disc *disc = &fixture_edit(fixture, OBJECT_DISC)->set.disc;
    disc->base.id = id;
    disc->value.material = material;
    disc->value.normal_world[2] = 1.0f;
    disc->value.centre_world[2] = -1.0f;
    disc->value.radius = radius;
}

static void move_node(struct fixture *fixture, uint32_t id, enum node_kind kind, uint32_t object, float x)
{
    const float moved[12] = {1, 0, 0, x, 0, 1, 0, 0, 0, 0, 1, kind == NODE_LIGHT ? 3.0f : 0.0f};
    struct scene_node *node = &fixture_edit(fixture, OBJECT_NODE)->set.node;
    node->base.id = id;
    node->value.kind = kind;
    node->value.object = object;
    memcpy(node->value.parent_from_node, moved, sizeof(moved));
}

static struct ids build_scene(struct fixture *fixture)
{
    struct ids ids;
    uint32_t material = fixture_material(fixture)->base.id;
    ids.square = fixture_square(fixture, 1.0f, material, NULL)->base.id;
    ids.square_node = fixture->next_id - 1;
    ids.light = fixture_light(fixture, LIGHT_POINT, 0.0f, 0.0f, 3.0f, 10.0f)->base.id;
    ids.light_node = fixture->next_id - 1;
    fixture_sphere(fixture, 0.3f, 0.2f, 0.5f, 0.3f, material);
    ids.disc = fixture->next_id++;
    set_disc(fixture, ids.disc, material, 2.0f);
    fixture_commit(fixture);
    return ids;
}

static struct frame_result render_by(struct fixture *fixture, struct frame_renderer *renderer)
{
    struct frame_renderer *own = fixture->renderer;
    fixture->renderer = renderer;
    struct frame_result result = fixture_render(fixture);
    fixture->renderer = own;
    return result;
}

/* How often the stand-in is brought to the scene for a frame. */
static unsigned updates_for(struct fixture *fixture, struct frame_renderer *renderer)
{
    count_anew();
    struct frame_result result = render_by(fixture, renderer);
    frame_result_finish(&result);
    return counts.updates;
}

static struct frame_renderer *another_renderer(struct fixture *fixture)
{
    struct error error = {0};
    struct frame_renderer *renderer = frame_renderer_create(fixture->shared, &error);
    assert_non_null(renderer);
    return renderer;
}

/* ---- what changed ---- */

TEST(bvh_is_updated_by_what_it_depends_on_and_by_nothing_else)
{
    struct fixture *fixture = *state;
    const struct ids ids = build_scene(fixture);
    stand_in(fixture, fixture->renderer, &tracer_bvh_impl, TRACER_BVH, 0, false);
    assert_true(updates_for(fixture, fixture->renderer) > 0);
    assert_int_equal(counts.changed, tracer_bvh_impl.depends_on); /* the first structure */
    assert_int_equal(updates_for(fixture, fixture->renderer), 0);
    fixture_set_camera(fixture, 1.0f, 0.0f, 5.0f, 0.6f);
    assert_int_equal(updates_for(fixture, fixture->renderer), 0);
    move_node(fixture, ids.light_node, NODE_LIGHT, ids.light, 1.0f);
    updates_for(fixture, fixture->renderer);
    assert_false(counts.changed & ~(unsigned)CHANGED_INSTANCES);
    fixture_environment(fixture, 0.1f, 0.1f, 0.1f);
    assert_int_equal(updates_for(fixture, fixture->renderer), 0);
    set_disc(fixture, ids.disc, 0, 1.0f);
    assert_int_equal(updates_for(fixture, fixture->renderer), 0);
    move_node(fixture, ids.square_node, NODE_MESH, ids.square, 0.5f);
    assert_true(updates_for(fixture, fixture->renderer) > 0);
    assert_int_equal(counts.changed, CHANGED_INSTANCES);
}

TEST(an_edit_reaches_a_tracer_that_was_not_in_use)
{
    struct fixture *fixture = *state;
    const struct ids ids = build_scene(fixture);
    stand_in(fixture, fixture->renderer, &tracer_bvh_impl, TRACER_BVH, 0, false);
    updates_for(fixture, fixture->renderer);
    fixture->request.tracing.tracer = TRACER_NAIVE;
    for (int i = 0; i < 2; i++) {
        move_node(fixture, ids.square_node, NODE_MESH, ids.square, 0.25f * (float)(i + 1));
        assert_int_equal(updates_for(fixture, fixture->renderer), 0);
    }
    assert_int_equal(updates_for(fixture, fixture->renderer), 0);
    fixture->request.tracing.primary = PRIMARY_TRACE;
    struct frame_result expected = fixture_render(fixture);
    fixture->request.tracing.tracer = TRACER_BVH;
    count_anew();
    struct frame_result got = fixture_render(fixture);
    assert_int_equal(counts.changed, CHANGED_INSTANCES);
    assert_memory_equal(got.pixels, expected.pixels, expected.size_bytes);
    frame_result_finish(&expected);
    frame_result_finish(&got);
    assert_int_equal(updates_for(fixture, fixture->renderer), 0);
    assert_int_equal(counts.creates, 1);
}

/* ---- whose it is ---- */

TEST(a_structure_of_the_scene_serves_all_viewers)
{
    struct fixture *fixture = *state;
    build_scene(fixture);
    struct frame_renderer *other = another_renderer(fixture);
    stand_in(fixture, fixture->renderer, &tracer_naive_impl, TRACER_NAIVE, 0, false);
    stand_in(fixture, other, &tracer_naive_impl, TRACER_NAIVE, 0, false);
    assert_int_equal(updates_for(fixture, fixture->renderer), 1);
    fixture_set_camera(fixture, 1.0f, 0.0f, 5.0f, 0.6f);
    assert_int_equal(updates_for(fixture, other), 0);
    assert_int_equal(counts.creates, 1);
    frame_renderer_destroy(other);
    assert_int_equal(counts.destroys, 0);
}

TEST(each_viewer_has_a_structure_of_its_view)
{
    struct fixture *fixture = *state;
    const struct ids ids = build_scene(fixture);
    struct frame_renderer *other = another_renderer(fixture);
    stand_in(fixture, fixture->renderer, &tracer_naive_impl, TRACER_NAIVE, CHANGED_VIEW, false);
    stand_in(fixture, other, &tracer_naive_impl, TRACER_NAIVE, CHANGED_VIEW, false);
    const struct frame_request first = fixture->request;
    assert_int_equal(updates_for(fixture, fixture->renderer), 1);
    assert_true(counts.changed & CHANGED_VIEW);
    fixture_set_camera(fixture, 2.0f, 0.0f, 5.0f, 0.6f);
    const struct frame_request second = fixture->request;
    assert_int_equal(updates_for(fixture, other), 1);
    assert_int_equal(counts.creates, 2);
    assert_memory_equal(counts.view.world_from_view, second.camera.world_from_view,
                        sizeof(counts.view.world_from_view));
    assert_int_equal(counts.view.width, 32);
    /* Neither viewer's frames touch the structure of the other one. */
    assert_int_equal(updates_for(fixture, other), 0);
    fixture->request = first;
    assert_int_equal(updates_for(fixture, fixture->renderer), 0);
    fixture_set_camera(fixture, 0.0f, 0.5f, 5.0f, 0.6f);
    assert_int_equal(updates_for(fixture, fixture->renderer), 1);
    assert_int_equal(counts.changed, CHANGED_VIEW);
    fixture->request.picture.width = 40;
    assert_int_equal(updates_for(fixture, fixture->renderer), 1);
    assert_int_equal(counts.changed, CHANGED_VIEW);
    /* An edit reaches both, each with its next frame. */
    move_node(fixture, ids.square_node, NODE_MESH, ids.square, 0.5f);
    assert_int_equal(updates_for(fixture, fixture->renderer), 1);
    assert_int_equal(counts.changed, CHANGED_INSTANCES);
    fixture->request = second;
    assert_int_equal(updates_for(fixture, other), 1);
    assert_int_equal(counts.changed, CHANGED_INSTANCES);
    assert_int_equal(counts.creates, 2);
    frame_renderer_destroy(other);
    assert_int_equal(counts.destroys, 1);
}

TEST(each_frame_in_progress_has_a_state_of_its_waves)
{
    struct fixture *fixture = *state;
    struct error error = {0};
    build_scene(fixture);
    fixture->request.tracing.primary = PRIMARY_TRACE;
    fixture->request.picture.width = 80;
    struct frame_result expected = fixture_render(fixture);
    struct frame_renderer *renderers[2] = {fixture->renderer, another_renderer(fixture)};
    for (int i = 0; i < 2; i++) {
        stand_in(fixture, renderers[i], &tracer_naive_impl, TRACER_NAIVE, 0, true);
        if (!frame_begin(renderers[i], fixture->scene, NULL, &fixture->request, &error))
            fail_msg("frame_begin: %s: %s", error.field, error.text);
    }
    assert_int_equal(counts.states, 2);
    assert_ptr_not_equal(renderers[0]->work->trace_state, renderers[1]->work->trace_state);
    assert_true(frame_work_device_bytes(renderers[0]->work) >=
                trace_state_device_bytes(renderers[0]->work->trace_state));
    const struct batches *own = (const struct batches *)renderers[0]->work->trace_state;
    assert_true(own->own.capacity_bytes >= 4096);
    assert_int_equal(trace_state_device_bytes(&own->base), own->own.capacity_bytes);
    struct frame_result got[2] = {{0}, {0}};
    enum frame_progress progress[2] = {FRAME_MORE, FRAME_MORE};
    while (progress[0] == FRAME_MORE || progress[1] == FRAME_MORE) {
        for (int i = 0; i < 2; i++) /* the steps of two waves by turns */
            if (progress[i] == FRAME_MORE)
                progress[i] = frame_step(renderers[i], &got[i], &error);
    }
    for (int i = 0; i < 2; i++) {
        assert_int_equal(progress[i], FRAME_DONE);
        assert_memory_equal(got[i].pixels, expected.pixels, expected.size_bytes);
        frame_result_finish(&got[i]);
    }
    assert_true(counts.steps >= 2 * STEPS);
    assert_int_equal(counts.steps % STEPS, 0);
    assert_int_equal(counts.creates, 1); /* the tracer itself is the scene's */
    frame_result_finish(&expected);
    /* The next frame has it again; another tracer does not. */
    updates_for(fixture, fixture->renderer);
    assert_int_equal(counts.states_made, 2);
    frame_renderer_destroy(renderers[1]);
    frame_renderer_destroy(fixture->renderer);
    frame_scene_destroy(fixture->shared);
    fixture->renderer = NULL;
    fixture->shared = NULL;
    assert_int_equal(counts.states, 0);
}

/* ---- tracing in steps ---- */

TEST(a_wave_may_be_dropped_in_the_middle)
{
    struct fixture *fixture = *state;
    struct error error = {0};
    struct frame_result ignored;
    build_scene(fixture);
    fixture->request.tracing.primary = PRIMARY_TRACE;
    struct frame_result expected = fixture_render(fixture);
    stand_in(fixture, fixture->renderer, &tracer_naive_impl, TRACER_NAIVE, 0, true);
    assert_true(frame_begin(fixture->renderer, fixture->scene, NULL, &fixture->request, &error));
    while (counts.steps % STEPS != 1)
        assert_int_equal(frame_step(fixture->renderer, &ignored, &error), FRAME_MORE);
    frame_abandon(fixture->renderer);
    counts.steps = 0;
    struct frame_result got = fixture_render(fixture);
    assert_int_equal(counts.steps % STEPS, 0);
    assert_memory_equal(got.pixels, expected.pixels, expected.size_bytes);
    frame_result_finish(&expected);
    frame_result_finish(&got);
}
