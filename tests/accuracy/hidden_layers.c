/* SPDX-License-Identifier: MIT */
/* Pictures of what is hidden: what is in them follows from similar triangles. */
#include "tests/accuracy/render_fixture.h"
#include "tests/harness/test.h"

#define EDGE 512u
#define FOCAL 512.0 /* pixels: half the picture is half as wide as far */
#define RADIUS 0.15
#define HALF 0.25 /* half the side of the square that hides, at the distance 1 */
#define WALL 2.0  /* distance of a wall behind it */

ALL_TESTS(fixture_setup, fixture_teardown)
EACH_TEST(fixture_clear, NULL)

static void add_square(struct fixture *fixture, double half, double distance, uint32_t material)
{
    const float place[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, (float)(1.0 - distance)};
    fixture_square(fixture, (float)half, material, place);
}

/* A square before a wall, and behind it, nearer than the wall, a plate: bodies have two sides. */
static void set_up(struct fixture *fixture, double plate_half, double plate)
{
    const uint32_t material = fixture_material(fixture)->base.id;
    add_square(fixture, HALF, 1.0, material);
    add_square(fixture, plate_half, plate, material);
    add_square(fixture, 4.0, WALL, material);
    fixture_light(fixture, LIGHT_POINT, 0.0f, 0.0f, -0.5f, 10.0f);
    fixture_set_camera(fixture, 0.0f, 0.0f, 1.0f, (float)(2.0 * atan(EDGE / 2.0 / FOCAL)));
    struct frame_request *request = &fixture->request;
    request->picture.width = request->picture.height = EDGE;
    request->light.integrator = INTEGRATOR_WHITTED;
    request->attachments = 1u << ATTACHMENT_DEPTH;
    request->hidden_radius = (float)RADIUS;
    fixture_commit(fixture);
}

static const float *render_hidden(struct fixture *fixture, uint32_t layer, struct frame_result *result)
{
    fixture->request.hidden_layer = layer;
    *result = fixture_render(fixture);
    return (const float *)(const void *)frame_result_attachment(result, ATTACHMENT_DEPTH);
}

/* Pixels from the square's outline inwards. */
static double inwards(uint32_t x, uint32_t y)
{
    const double across = fabs(x + 0.5 - EDGE / 2.0), over = fabs(y + 0.5 - EDGE / 2.0);
    return FOCAL * HALF - fmax(across, over);
}

/* How far an eye at the radius sees past what is nearer: what is at the distance comes so many pixels from behind
 * it. */
static double reach_past(double nearer, double distance)
{
    return FOCAL * RADIUS * (1.0 / nearer - 1.0 / distance);
}

static double reach_of(double distance)
{
    return reach_past(1.0, distance);
}

/* Places are looked at by whole texels. */
#define SLACK 1.5

/* Behind the square the plate ends before the strip that an eye sees past it begins. */
TEST(what_an_eye_sees_past_a_body_is_there_and_its_far_side_is_not)
{
    struct fixture *fixture = *state;
    set_up(fixture, HALF, 1.05);
    struct frame_result result;
    const float *depths = render_hidden(fixture, 1, &result);
    const double reach = reach_of(WALL);
    assert_true(reach_of(1.05) + SLACK < FOCAL * HALF * (1.0 - 1.0 / 1.05) + 2.0);
    uint32_t there = 0;
    for (uint32_t y = 0; y < EDGE; y++)
        for (uint32_t x = 0; x < EDGE; x++) {
            const double depth = (double)depths[y * EDGE + x], in = inwards(x, y);
            there += depth > 0.0;
            if (in < 0.0 || in > reach + SLACK)
                assert_near(depth, 0.0, 0.0);
            else if (in < reach - SLACK)
                assert_near(depth, WALL, 1e-4);
            assert_true((fixture_pixel(&result, x, y)[0] > 0.0f) == (depth > 0.0)); /* and lit */
        }
    print_message("%.1f %% of the picture\n", 100.0 * there / (EDGE * EDGE));
    frame_result_finish(&result);
    depths = render_hidden(fixture, 2, &result);
    for (uint32_t i = 0; i < EDGE * EDGE; i++)
        assert_near(depths[i], 0.0f, 0.0f);
    frame_result_finish(&result);
}

/* A plate whose outline is the square's own, from the eye: in the strip in which it is seen it is the first, and
 * the wall the second. */
TEST(what_is_behind_what_is_hidden_comes_second)
{
    struct fixture *fixture = *state;
    const double plate = 1.25, reach = reach_of(plate);
    set_up(fixture, HALF * plate, plate);
    struct frame_result first, second;
    const float *depths = render_hidden(fixture, 1, &first);
    const float *behind = render_hidden(fixture, 2, &second);
    for (uint32_t y = 0; y < EDGE; y++)
        for (uint32_t x = 0; x < EDGE; x++) {
            const double in = inwards(x, y);
            if (in > 1.0 && in < reach - SLACK) {
                assert_near(depths[y * EDGE + x], plate, 1e-4);
                assert_near(behind[y * EDGE + x], WALL, 1e-4);
            } else if (in > reach + SLACK && in < reach_past(plate, WALL) - SLACK) {
                assert_near(depths[y * EDGE + x], WALL, 1e-4);
                assert_near(behind[y * EDGE + x], 0.0, 0.0);
            }
        }
    frame_result_finish(&first);
    frame_result_finish(&second);
}

TEST(a_picture_is_the_same_before_and_after_what_it_hides)
{
    struct fixture *fixture = *state;
    set_up(fixture, 2.0, 1.5);
    struct frame_result before = fixture_render(fixture), hidden;
    (void)render_hidden(fixture, 1, &hidden);
    fixture->request.hidden_layer = 0;
    struct frame_result after = fixture_render(fixture);
    assert_same_picture(&before, &after);
    frame_result_finish(&before);
    frame_result_finish(&hidden);
    frame_result_finish(&after);
}

TEST(hidden_layers_that_cannot_be_are_refused)
{
    struct fixture *fixture = *state;
    set_up(fixture, HALF, 1.05);
    const struct frame_request good = fixture->request;
    for (int i = 0; i < 5; i++) {
        struct frame_request *request = &fixture->request;
        struct error error = {0};
        *request = good;
        request->hidden_layer = i == 0 ? 3 : 1;
        request->sampling.accumulate = i == 1;
        request->aperture = i == 2 ? 0.1f : 0.0f;
        request->picture.view_source = i == 3 ? VIEW_SOURCE_LAYERS : VIEW_SOURCE_RAYS;
        request->picture.views_across = i == 4 ? 2 : 0;
        assert_false(frame_begin(fixture->renderer, fixture->scene, NULL, request, &error));
        assert_string_equal(error.field, "hidden_layers");
    }
}
