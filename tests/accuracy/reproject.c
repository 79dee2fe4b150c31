/* SPDX-License-Identifier: MIT */
/* Frames of a view while its camera moves, which have what frames before them show of the same places. */
#include "tests/accuracy/motion_scenes.h"
#include "tests/accuracy/path_fixture.h"
#include "tests/harness/test.h"

ALL_TESTS(fixture_setup, fixture_teardown)
EACH_TEST(fixture_clear, NULL)

enum { FRAMES = 8, WARM = 4 };

/* A wall under a sky, next to a ball that hides some of that and one that mirrors both. */
static void a_corner(struct fixture *fixture)
{
    path_begin(fixture, TRACER_BVH, 2);
    const uint32_t white = fixture_material(fixture)->base.id, dark = fixture_material(fixture)->base.id;
    struct scene_material *mirror = fixture_material(fixture);
    mirror->value.metallic = 1.0f;
    mirror->value.roughness = 0.0f;
    fixture_square(fixture, 3.0f, white, NULL);
    fixture_sphere(fixture, 0.8f, 0.0f, 0.5f, 0.5f, dark);
    fixture_sphere(fixture, -0.8f, 0.0f, 0.5f, 0.5f, mirror->base.id);
    fixture_environment(fixture, 1.0f, 1.0f, 1.0f);
    fixture->request.picture.denoise = DENOISE_AUTO;
}

/* Aside by a pixel a frame, and by a part of one that is not the same in each. */
static void look(struct fixture *fixture, int frame)
{
    fixture_set_camera(fixture, 0.137f * (float)frame, 0.05f * (float)frame, 5.0f, 0.6f);
}

static struct frame_result rendered(struct fixture *fixture, enum frame_history history, uint32_t samples)
{
    fixture->request.history = history;
    fixture->request.sampling.samples = samples;
    return fixture_render(fixture);
}

/* Errors of green: distance of pictures from true ones, and of errors from those of the previous frame at the
 * same pixel. */
struct quality {
    double squares, changes;
};

static void add_frame(struct quality *sum, const struct frame_result *picture, const float *truth, float *errors)
{
    for (uint32_t i = 0; i < PIXELS; i++) {
        const float error = fixture_pixel(picture, i % EDGE, i / EDGE)[1] - truth[i];
        sum->squares += (double)(error * error);
        sum->changes += (double)((error - errors[i]) * (error - errors[i]));
        errors[i] = error;
    }
}

/* Five samples in place of one leave 0.45 of the noise, and the denoiser a part of it that is smooth: so three
 * quarters of the error of the denoised frame, and of what changes in it, are not reached where nothing is found
 * again. */
TEST_LONG(moving_frames_have_less_noise_and_flicker_for_those_before_them)
{
    struct fixture *fixture = *state;
    struct quality alone = {0}, following = {0};
    float errors_alone[PIXELS], errors_following[PIXELS], *truths[FRAMES];
    a_corner(fixture);
    for (int frame = 0; frame < FRAMES; frame++) {
        look(fixture, frame);
        fixture->request.history = HISTORY_NONE;
        truths[frame] = path_render_pixels(fixture, 128, 99);
    }
    for (int i = 0; i < 2 * FRAMES; i++) {
        const int frame = i % FRAMES;
        struct quality ignored = {0}, *sum = i < FRAMES ? &alone : &following;
        look(fixture, frame);
        fixture->request.sampling.seed = (uint64_t)frame;
        struct frame_result result = rendered(fixture, i < FRAMES ? HISTORY_NONE : HISTORY_MOVING, 1);
        add_frame(frame >= WARM ? sum : &ignored, &result, truths[frame],
                  i < FRAMES ? errors_alone : errors_following);
        frame_result_finish(&result);
    }
    for (int frame = 0; frame < FRAMES; frame++)
        free(truths[frame]);
    print_message("error %.2f, change %.2f\n", sqrt(following.squares / alone.squares),
                  sqrt(following.changes / alone.changes));
    assert_true(sqrt(following.squares / alone.squares) < 0.75);
    assert_true(sqrt(following.changes / alone.changes) < 0.75);
}

TEST(a_view_at_rest_ends_in_the_same_picture_however_it_moved)
{
    struct fixture *fixture = *state;
    a_corner(fixture);
    struct frame_result direct = rendered(fixture, HISTORY_KEPT, 4);
    fixture->request.sampling.accumulate = true;
    for (int frame = 1; frame < 4; frame++) {
        look(fixture, frame - 3);
        struct frame_result moving = rendered(fixture, HISTORY_MOVING, 1);
        frame_result_finish(&moving);
    }
    struct frame_result first = rendered(fixture, HISTORY_USED, 1), second = rendered(fixture, HISTORY_USED, 1);
    struct frame_result last = rendered(fixture, HISTORY_KEPT, 2);
    assert_int_equal(first.samples, 1); /* the last one that moved was of this place, too */
    assert_int_equal(last.samples, 4);
    assert_same_picture(&direct, &last);
    /* And the first ones do not differ from what is there in the end as one without frames before it does. */
    float errors[PIXELS], truth[PIXELS];
    struct quality used = {0}, alone = {0};
    for (uint32_t i = 0; i < PIXELS; i++)
        truth[i] = fixture_pixel(&last, i % EDGE, i / EDGE)[1];
    memset(errors, 0, sizeof(errors));
    add_frame(&used, &first, truth, errors);
    fixture->request.sampling.accumulate = false;
    struct frame_result plain = rendered(fixture, HISTORY_NONE, 1);
    add_frame(&alone, &plain, truth, errors);
    assert_true(used.squares < alone.squares);
    frame_result_finish(&direct);
    frame_result_finish(&first);
    frame_result_finish(&second);
    frame_result_finish(&last);
    frame_result_finish(&plain);
}

static double distance_of(const struct frame_result *picture, const struct frame_result *truth)
{
    double squares = 0.0;
    for (uint32_t i = 0; i < picture->width * picture->height; i++) {
        const uint32_t x = i % picture->width, y = i / picture->width;
        const double error = (double)(fixture_pixel(picture, x, y)[1] - fixture_pixel(truth, x, y)[1]);
        squares += error * error;
    }
    return sqrt(squares / (double)(picture->width * picture->height));
}

/* A view that keeps a rate does this. */
TEST_LONG(a_frame_follows_frames_of_another_size)
{
    struct fixture *fixture = *state;
    a_corner(fixture);
    for (int frame = 0; frame < WARM; frame++) {
        look(fixture, frame);
        struct frame_result moving = rendered(fixture, HISTORY_MOVING, 1);
        frame_result_finish(&moving);
    }
    fixture->request.picture.width = fixture->request.picture.height = 3 * EDGE / 4;
    struct frame_result following = rendered(fixture, HISTORY_MOVING, 1),
                        alone = rendered(fixture, HISTORY_NONE, 1);
    struct frame_result truth = rendered(fixture, HISTORY_NONE, 128);
    assert_true(distance_of(&following, &truth) < 0.75 * distance_of(&alone, &truth));
    frame_result_finish(&following);
    frame_result_finish(&alone);
    frame_result_finish(&truth);
}

TEST(nothing_is_left_of_frames_before_an_edit)
{
    struct fixture *fixture = *state;
    a_corner(fixture);
    for (int frame = 0; frame < 3; frame++) {
        look(fixture, frame);
        struct frame_result lit = rendered(fixture, HISTORY_MOVING, 1);
        assert_true(fixture_pixel(&lit, EDGE / 2, 0)[1] > 0.1f);
        frame_result_finish(&lit);
    }
    fixture_environment(fixture, 0.0f, 0.0f, 0.0f);
    fixture_light(fixture, LIGHT_DIRECTIONAL, 0.0f, 0.0f, 0.0f, 0.001f); /* without any: the default */
    struct frame_result dark = rendered(fixture, HISTORY_MOVING, 1);
    for (uint32_t i = 0; i < PIXELS; i++)
        assert_true(fixture_pixel(&dark, i % EDGE, i / EDGE)[1] < 0.01f);
    frame_result_finish(&dark);
}

TEST(what_has_no_noise_does_not_follow_frames_before_it)
{
    struct fixture *fixture = *state;
    a_corner(fixture);
    fixture->request.light.integrator = INTEGRATOR_WHITTED;
    struct frame_result plain = rendered(fixture, HISTORY_NONE, 2);
    for (int frame = 1; frame >= 0; frame--) {
        look(fixture, frame);
        struct frame_result moving = rendered(fixture, HISTORY_MOVING, 2);
        if (frame == 0)
            assert_same_picture(&plain, &moving);
        frame_result_finish(&moving);
    }
    frame_result_finish(&plain);
}

/* How much of the error of frames alone is left in those that follow others while a square, at a depth, moves
 * aside by a pixel and a half a frame before an eye that does not. */
static double error_beside_alone(struct fixture *fixture, float half, uint32_t material, float depth)
{
    struct quality alone = {0}, following = {0};
    float errors[PIXELS], *truths[FRAMES];
    struct scene_motion motions[FRAMES];
    const uint32_t node = fixture->next_id;
    fixture_square(fixture, half, material, NULL); /* its mesh, then its node */
    for (int frame = 0; frame < FRAMES; frame++) {
        const float place[12] = {1, 0, 0, 0.15f * (float)frame - 0.5f, 0, 1, 0, -0.5f, 0, 0, 1, depth};
        test_motion_init(&motions[frame], 1);
        test_pose_node(motions[frame].poses, node + 1, place);
    }
    for (int i = 0; i < 3 * FRAMES; i++) {
        const int frame = i % FRAMES, pass = i / FRAMES;
        fixture->request.sampling.seed = pass == 0 ? 99 : (uint64_t)frame;
        fixture->request.sampling.samples = pass == 0 ? 128 : 1;
        fixture->request.history = pass == 2 ? HISTORY_MOVING : HISTORY_NONE;
        struct frame_result result = fixture_render_motion(fixture, &motions[frame]);
        if (pass == 0) {
            truths[frame] = malloc(PIXELS * sizeof(float));
            for (uint32_t k = 0; k < PIXELS; k++)
                truths[frame][k] = fixture_pixel(&result, k % EDGE, k / EDGE)[1];
        } else if (frame >= WARM) {
            add_frame(pass == 1 ? &alone : &following, &result, truths[frame], errors);
        }
        frame_result_finish(&result);
    }
    for (int frame = 0; frame < FRAMES; frame++) {
        free(truths[frame]);
        scene_motion_finish(&motions[frame]);
    }
    return sqrt(following.squares / alone.squares);
}

/* Still parts have less noise; nothing of the previous frames is left where the square was; its shadow lags
 * behind by less than its noise was. */
TEST_LONG(what_moves_by_itself_leaves_nothing_behind)
{
    struct fixture *fixture = *state;
    a_corner(fixture);
    const double left = error_beside_alone(fixture, 0.3f, 2, 0.7f); /* dark */
    print_message("error %.2f\n", left);
    assert_true(left < 0.85);
}

/* A wall that fills the picture and moves in its plane. Three samples of frames before and one are half of the
 * noise, 0.41 is left with the denoiser; where the wall begins anew and the ball alone is followed, 0.69. */
TEST_LONG(what_moves_is_followed)
{
    struct fixture *fixture = *state;
    path_begin(fixture, TRACER_BVH, 2);
    const uint32_t white = fixture_material(fixture)->base.id;
    fixture_sphere(fixture, 0.8f, 0.0f, 0.5f, 0.5f, white);
    fixture_environment(fixture, 1.0f, 1.0f, 1.0f);
    fixture->request.picture.denoise = DENOISE_AUTO;
    look(fixture, 0);
    const double left = error_beside_alone(fixture, 4.0f, white, 0.0f);
    print_message("error %.2f\n", left);
    assert_true(left < 0.55);
}
