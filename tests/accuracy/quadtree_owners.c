/* SPDX-License-Identifier: MIT */
/* The structure of the tracer quadtree belongs to one view: another viewer's is never used, a moved camera
 * outdates it and an unmoved one does not, and what is edited or moves is followed. */
#include "tests/accuracy/render_fixture.h"
#include "tests/fixtures/structure.h"
#include "tests/harness/test.h"

ALL_TESTS(fixture_setup, fixture_teardown)
EACH_TEST(fixture_clear, NULL)

/* First hits of exact primitives, so that a picture shows what the structure is of. */
static struct frame_result render_by(struct fixture *fixture, struct frame_renderer *renderer, unsigned tracer,
                                     const struct scene_motion *motion)
{
    struct frame_renderer *own = fixture->renderer;
    fixture->renderer = renderer;
    fixture->request.tracing.primary = PRIMARY_TRACE;
    fixture->request.tracing.tracer = tracer;
    fixture->request.tracer_options.quadtree = (struct quadtree_settings){.faces = QUADTREE_FACES_VIEW};
    struct frame_result result = fixture_render_motion(fixture, motion);
    fixture->renderer = own;
    return result;
}

static bool is_built(const struct frame_result *result)
{
    return structure_row(&result->structure, "built").number != 0;
}

/* The picture is that of bvh but on outlines, which texels have to their middle: one in fifty pixels. True: the
 * structure was built for it. */
static bool shows_what_is_there(struct fixture *fixture, struct frame_renderer *renderer,
                                const struct scene_motion *motion)
{
    struct frame_result got = render_by(fixture, renderer, TRACER_QUADTREE, motion);
    struct frame_result expected = render_by(fixture, fixture->renderer, TRACER_BVH, motion);
    const uint32_t pixels = got.width * got.height;
    uint32_t other = 0;
    for (uint32_t i = 0; i < pixels; i++) {
        const float *a = fixture_pixel(&got, i % got.width, i / got.width);
        const float *b = fixture_pixel(&expected, i % got.width, i / got.width);
        other += fabsf(a[0] - b[0]) + fabsf(a[1] - b[1]) + fabsf(a[2] - b[2]) > 0.02f;
    }
    if (other > pixels / 50)
        fail_msg("%u of %u pixels show something else", other, pixels);
    const bool built = is_built(&got);
    frame_result_finish(&got);
    frame_result_finish(&expected);
    return built;
}

static uint32_t add_scene(struct fixture *fixture)
{
    struct scene_material *red = fixture_material(fixture);
    red->value.base_colour[1] = red->value.base_colour[2] = 0.1f;
    const uint32_t material = red->base.id;
    const uint32_t square = fixture_square(fixture, 1.0f, material, NULL)->base.id;
    fixture_light(fixture, LIGHT_POINT, 0.0f, 0.0f, 3.0f, 10.0f);
    fixture_sphere(fixture, 0.5f, 0.2f, 0.8f, 0.3f, fixture_material(fixture)->base.id);
    fixture->request.picture.width = fixture->request.picture.height = 96;
    return square;
}

static uint32_t add_mover(struct fixture *fixture, uint32_t mesh)
{
    const float m[12] = {0.3f, 0, 0, -0.6f, 0, 0.3f, 0, 0.3f, 0, 0, 0.3f, 0.5f};
    return fixture_node(fixture, NODE_MESH, mesh, m);
}

static void skip_without(void)
{
    struct error error = {0};
    if (tracer_find(TRACER_QUADTREE, "tracer", &error))
        return;
    printf("skipped: %s\n", error.text);
    skip();
}

TEST(another_viewers_structure_is_never_used)
{
    struct fixture *fixture = *state;
    struct error error = {0};
    skip_without();
    add_scene(fixture);
    fixture_commit(fixture);
    struct frame_renderer *other = frame_renderer_create(fixture->shared, &error);
    assert_non_null(other);
    for (int round = 0; round < 2; round++) {
        /* By turns, each from its own place: each is built once, and shows what is there from its place. */
        fixture_set_camera(fixture, 0.3f, 0.1f, 5.0f, 0.6f);
        assert_int_equal(shows_what_is_there(fixture, fixture->renderer, NULL), round == 0);
        fixture_set_camera(fixture, 2.5f, 1.0f, 3.0f, 0.7f);
        assert_int_equal(shows_what_is_there(fixture, other, NULL), round == 0);
    }
    frame_renderer_destroy(other);
}

TEST(a_moved_camera_outdates_the_structure_and_an_unmoved_one_does_not)
{
    struct fixture *fixture = *state;
    skip_without();
    add_scene(fixture);
    fixture_commit(fixture);
    assert_true(shows_what_is_there(fixture, fixture->renderer, NULL));
    assert_false(shows_what_is_there(fixture, fixture->renderer, NULL));
    fixture_set_camera(fixture, 0.4f, 0.1f, 4.5f, 0.6f);
    assert_true(shows_what_is_there(fixture, fixture->renderer, NULL));
    assert_false(shows_what_is_there(fixture, fixture->renderer, NULL));
    fixture->request.picture.width = 80;
    assert_true(shows_what_is_there(fixture, fixture->renderer, NULL));
    assert_false(shows_what_is_there(fixture, fixture->renderer, NULL));
}

static void set_mover(struct fixture *fixture, uint32_t node, uint32_t mesh, float x, bool hidden)
{
    const float m[12] = {0.3f, 0, 0, x, 0, 0.3f, 0, 0.3f, 0, 0, 0.3f, 0.5f};
    struct scene_node *moved = &fixture_edit(fixture, OBJECT_NODE)->set.node;
    moved->base.id = node;
    moved->value.kind = NODE_MESH;
    moved->value.object = mesh;
    moved->value.hidden = hidden;
    memcpy(moved->value.parent_from_node, m, sizeof(m));
}

TEST(edits_and_poses_are_followed)
{
    struct fixture *fixture = *state;
    skip_without();
    const uint32_t mesh = add_scene(fixture), node = add_mover(fixture, mesh);
    fixture_commit(fixture);
    assert_true(shows_what_is_there(fixture, fixture->renderer, NULL));
    set_mover(fixture, node, mesh, 0.2f, false);
    assert_true(shows_what_is_there(fixture, fixture->renderer, NULL));
    set_mover(fixture, node, mesh, 0.2f, true);
    assert_true(shows_what_is_there(fixture, fixture->renderer, NULL));
    set_mover(fixture, node, mesh, -0.7f, false);
    assert_true(shows_what_is_there(fixture, fixture->renderer, NULL));
    fixture_environment(fixture, 0.1f, 0.1f, 0.1f); /* no surface */
    assert_false(shows_what_is_there(fixture, fixture->renderer, NULL));
    /* A pose of a clip, one after another, as the shutter is closed. */
    for (int i = 0; i < 3; i++) {
        const float m[12] = {0.3f, 0, 0, 0.3f * (float)i - 0.3f, 0, 0.3f, 0, 0, 0, 0, 0.3f, 0.6f};
        struct pose_node posed = {.node = node};
        struct scene_pose pose = {.nodes = &posed, .node_count = 1};
        const struct scene_motion motion = {.poses = &pose, .pose_count = 1};
        memcpy(posed.parent_from_node, m, sizeof(m));
        assert_true(shows_what_is_there(fixture, fixture->renderer, &motion));
    }
}
