/* SPDX-License-Identifier: MIT */
/* The layer `motion`, against what is known of a square and of cameras that move. */
#include "tests/accuracy/motion_scenes.h"
#include "tests/accuracy/render_fixture.h"

#include "tests/harness/test.h"

/* A picture's rays and hits are floats of a few metres, each with a few roundings of 2^-24; 10 pixels are a metre.
 */
#define ROUNDING_PIXELS 5e-5
/* Pixels that a metre takes where the square is. */
#define SCALE (16 / tan(0.3) / 5)

ALL_TESTS(fixture_setup, fixture_teardown)
EACH_TEST(fixture_clear, NULL)

static void expect_motion(const struct frame_result *result, uint32_t x, uint32_t y, const double expected[4],
                          double tolerance)
{
    const float *motion = fixture_pixel(result, x, y);
    for (int i = 0; i < 4; i++)
        if (!(fabs((double)motion[i] - expected[i]) <= tolerance))
            fail_msg("pixel %u, %u: %g %g, %g %g; expected %g %g, %g %g", x, y, (double)motion[0],
                     (double)motion[1], (double)motion[2], (double)motion[3], expected[0], expected[1],
                     expected[2], expected[3]);
}

/* A square that fills the picture and more, in metres from where it is. */
static void expect_shift(struct fixture *fixture, const struct scene_motion *motion, const double metres[4])
{
    double expected[4];
    for (int i = 0; i < 4; i++)
        expected[i] = metres[i] * SCALE;
    struct frame_result result = fixture_render_motion(fixture, motion);
    for (uint32_t i = 0; i < 32; i++)
        expect_motion(&result, i, 31 - i, expected, ROUNDING_PIXELS);
    frame_result_finish(&result);
}

static void pose_shift(struct scene_pose *pose, uint32_t node, float x, float y)
{
    const float m[12] = {1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, 0};
    test_pose_node(pose, node, m);
}

/* Where it is as the shutter opens counts, whenever a sample sees it. */
TEST(a_node_moves_what_it_shows_by_the_pixels_that_it_moves)
{
    struct fixture *fixture = *state;
    struct scene_motion motion;
    fixture_square(fixture, 5, 0, NULL);
    const uint32_t node = fixture->next_id - 1;
    fixture->request.picture.layers = 1u << LAYER_MOTION;
    for (uint32_t poses = 1; poses <= 2; poses++) {
        test_motion_init(&motion, poses);
        motion.has_neighbours = true;
        pose_shift(&motion.earlier, node, -0.2f, 0.05f);
        for (uint32_t i = 0; i < poses; i++)
            pose_shift(&motion.poses[i], node, 0.1f * (float)i, 0);
        pose_shift(&motion.later, node, 0.3f, 0.1f);
        for (uint32_t way = 0; way < 2; way++) {
            fixture->request.tracing.primary = way ? PRIMARY_TRACE : PRIMARY_RASTER;
            fixture->request.sampling.samples = 1 + 3 * way;
            expect_shift(fixture, &motion, (double[4]){0.3, 0.1, -0.2, 0.05});
        }
        scene_motion_finish(&motion);
    }
}

/* The upper edge moves by a metre, and what is between in proportion. */
TEST(morph_targets_move_each_point_of_a_triangle)
{
    struct fixture *fixture = *state;
    const float target[12] = {0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 1, 0}, weights[3] = {0.25f, 0, 1};
    struct scene_mesh *mesh = fixture_square(fixture, 2, 0, NULL);
    mesh->value.target_count = 1;
    mesh->arrays[MESH_TARGET_POSITIONS] = fixture_blob(target, sizeof(target));
    const uint32_t node = fixture->next_id - 1;
    struct scene_motion motion;
    test_motion_init(&motion, 1);
    motion.has_neighbours = true;
    test_pose_weights(&motion.earlier, node, &weights[0], 1);
    test_pose_weights(&motion.poses[0], node, &weights[1], 1);
    test_pose_weights(&motion.later, node, &weights[2], 1);
    fixture->request.picture.layers = 1u << LAYER_MOTION;
    struct frame_result result = fixture_render_motion(fixture, &motion);
    for (uint32_t y = 0; y < 32; y++) {
        const double share = ((15.5 - y) / SCALE + 2) / 4;
        expect_motion(&result, 3 + y % 20, y, (double[4]){0, share * SCALE, 0, share * SCALE / 4},
                      ROUNDING_PIXELS);
    }
    frame_result_finish(&result);
    scene_motion_finish(&motion);
}

TEST(joints_move_a_skin)
{
    struct fixture *fixture = *state;
    const uint16_t joints[4] = {0};
    const float ones[4] = {1, 1, 1, 1}, identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    const uint32_t joint = fixture_node(fixture, NODE_GROUP, 0, NULL);
    struct scene_mesh *mesh = fixture_square(fixture, 5, 0, NULL);
    mesh->value.influence_count = 1;
    mesh->arrays[MESH_JOINTS] = fixture_blob(joints, sizeof(joints));
    mesh->arrays[MESH_WEIGHTS] = fixture_blob(ones, sizeof(ones));
    struct scene_node *node = &fixture->edits[fixture->edit_count - 1].set.node;
    node->value.skin = fixture->next_id++;
    struct scene_skin *skin = &fixture_edit(fixture, OBJECT_SKIN)->set.skin;
    skin->base.id = node->value.skin;
    skin->value.joint_count = 1;
    skin->joints = fixture_blob(&joint, sizeof(joint));
    skin->joint_from_mesh = fixture_blob(identity, sizeof(identity));
    struct scene_motion motion;
    test_motion_init(&motion, 1);
    motion.has_neighbours = true;
    pose_shift(&motion.earlier, joint, 0, -0.1f);
    pose_shift(&motion.poses[0], joint, 0, 0);
    pose_shift(&motion.later, joint, 0.25f, 0.2f);
    fixture->request.picture.layers = 1u << LAYER_MOTION;
    expect_shift(fixture, &motion, (double[4]){0.25, 0.2, 0, -0.1});
    scene_motion_finish(&motion);
}

/* Turned by an angle to the left, what was in the middle is as far to the right as its tangent says, and the same
 * holds for what lies behind all surfaces. */
TEST(a_camera_that_turns_moves_surfaces_and_what_lies_behind_them)
{
    struct fixture *fixture = *state;
    const double angle = 0.05, pixels = 16 / tan(0.3);
    fixture_square(fixture, 0.5f, 0, NULL);
    struct frame_request *request = &fixture->request;
    request->picture.layers = 1u << LAYER_MOTION;
    request->has_neighbours = true;
    request->camera_earlier = request->camera_later = request->camera;
    const float c = (float)cos(angle), s = (float)sin(angle), left[9] = {c, 0, s, 0, 1, 0, -s, 0, c};
    for (int i = 0; i < 9; i++)
        request->camera_later.world_from_view[i / 3 * 4 + i % 3] = left[i];
    struct frame_result result = fixture_render(fixture);
    for (uint32_t x = 0; x < 32; x++) {
        const double place = atan((x - 15.5) / pixels); /* row 15 is half a pixel above the middle */
        const double forward = pixels * tan(place + angle) - (x - 15.5);
        const double above = 0.5 * (cos(place) / cos(place + angle) - 1);
        expect_motion(&result, x, 15, (double[4]){forward, above, 0, 0}, ROUNDING_PIXELS);
    }
    frame_result_finish(&result);
}

/* A camera half a metre to the right in the next frame, of a view of 4 metres, and of two eyes in perspective. */
TEST(parallel_views_and_those_of_several_eyes_have_their_own_motion)
{
    struct fixture *fixture = *state;
    struct frame_request *request = &fixture->request;
    fixture_square(fixture, 5, 0, NULL);
    request->picture.layers = 1u << LAYER_MOTION;
    request->has_neighbours = true;
    request->camera_earlier = request->camera_later = request->camera;
    request->camera_later.world_from_view[3] = 0.5f;
    request->camera_later.world_from_view[11] = 4; /* a metre nearer */
    request->picture.width = 64;
    request->picture.views_across = 2;
    request->picture.baseline = 0.2f;
    struct frame_result result = fixture_render(fixture);
    for (uint32_t x = 0; x < 64; x++) {
        const double now = (x % 32) - 15.5, near = 5.0 / 4.0;
        expect_motion(&result, x, 15, (double[4]){now * (near - 1) - 0.5 * SCALE * near, 0.5 * (near - 1), 0, 0},
                      ROUNDING_PIXELS);
    }
    frame_result_finish(&result);
    *request = (struct frame_request){.picture.width = 32,
                                      .picture.height = 32,
                                      .sampling.samples = 1,
                                      .tracing.tracer = TRACER_BVH,
                                      .picture.format = PIXEL_FORMAT_RGBA32F,
                                      .picture.layers = 1u << LAYER_MOTION,
                                      .has_neighbours = true,
                                      .camera = request->camera,
                                      .camera_earlier = request->camera,
                                      .camera_later = request->camera_later};
    request->camera.fov_y = request->camera_earlier.fov_y = request->camera_later.fov_y = 0;
    request->camera.ortho_height = request->camera_earlier.ortho_height = request->camera_later.ortho_height = 4;
    result = fixture_render(fixture);
    for (uint32_t x = 0; x < 32; x++)
        expect_motion(&result, x, x, (double[4]){-0.5 * 8, 0, 0, 0}, ROUNDING_PIXELS);
    frame_result_finish(&result);
}

/* A still has the same camera beside it, and one that is told nothing has none. What passes the camera has no
 * place. */
TEST(what_stands_still_or_is_behind_the_camera_has_no_motion)
{
    struct fixture *fixture = *state;
    struct frame_request *request = &fixture->request;
    fixture_square(fixture, 0.5f, 0, NULL);
    request->picture.layers = 1u << LAYER_MOTION;
    for (int way = 0; way < 3; way++) {
        request->has_neighbours = way > 0;
        request->camera_earlier = request->camera_later = request->camera;
        if (way == 2) /* beyond the square */
            request->camera_later.world_from_view[11] = -1;
        struct frame_result result = fixture_render(fixture);
        for (uint32_t i = 0; i < 32; i++)
            expect_motion(&result, i, i, (double[4]){0}, 0);
        frame_result_finish(&result);
    }
}

/* Frames that add up keep the first one's sample, which is of no use to another frame's neighbours. */
TEST(frames_with_other_neighbours_do_not_add_up)
{
    struct fixture *fixture = *state;
    struct frame_request *request = &fixture->request;
    fixture_square(fixture, 5, 0, NULL);
    request->picture.layers = 1u << LAYER_MOTION;
    request->sampling.accumulate = request->has_neighbours = true;
    for (int way = 0; way < 3; way++) {
        request->camera_earlier = request->camera_later = request->camera;
        request->camera_later.world_from_view[3] = way == 2 ? -0.5f : -0.25f;
        struct frame_result result = fixture_render(fixture);
        assert_int_equal(result.samples, way == 1 ? 2 : 1);
        expect_motion(&result, 16, 16, (double[4]){way == 2 ? 0.5 * SCALE : 0.25 * SCALE, 0, 0, 0},
                      ROUNDING_PIXELS);
        frame_result_finish(&result);
    }
}

TEST(motion_that_is_not_known_is_refused)
{
    struct fixture *fixture = *state;
    fixture_square(fixture, 5, 0, NULL);
    fixture->request.picture.layers = 1u << LAYER_MOTION;
    fixture_commit(fixture);
    fixture->request.picture.views_across = 2;
    fixture->request.picture.view_source = VIEW_SOURCE_LAYERS;
    fixture_expect_no_layers(fixture, "depth layers have no motion");
    fixture->request.picture.views_across = 0;
    fixture->request.picture.view_source = VIEW_SOURCE_RAYS;
    fixture->request.tracing.tracer = TRACER_LDC;
    fixture->request.tracing.primary = PRIMARY_TRACE;
    struct scene_motion motion;
    test_motion_init(&motion, 1);
    motion.has_neighbours = true;
    struct error error = {0};
    struct frame_result result = {0};
    enum frame_progress progress = FRAME_FAILED;
    if (frame_begin(fixture->renderer, fixture->scene, &motion, &fixture->request, &error))
        while ((progress = frame_step(fixture->renderer, &result, &error)) == FRAME_MORE)
            ;
    assert_int_equal(progress, FRAME_FAILED);
    assert_non_null(strstr(error.text, "ldc"));
    scene_motion_finish(&motion);
}
