/* SPDX-License-Identifier: MIT */
/* A frame goes on in short steps, so that a cancel is served soon, whatever the integrator: counted in rays and in
 * triangles rather than in time, which is another on every machine and every day. */
#include "render_fixture.h"

#define TRACER_BVH 0

/* On software GL with two cores incoherent rays take up to a microsecond each (871 thousand triangles, other work
 * on the machine), and half of that where it is quiet; a cancel is to be served within 50 ms. */
#define STEP_RAYS_MAX 32768u

static uint64_t rays_of_step;
static unsigned waves_of_step;

static bool count_rays(struct tracer *tracer, struct scene_gpu *scene, const struct wave *wave,
                       struct error *error)
{
    rays_of_step += wave->ray_count;
    waves_of_step++;
    return tracer_bvh_impl.trace(tracer, scene, wave, error);
}

/* More lamps than go into one batch, mirrors, glass and panes. */
static void a_crowded_scene(struct fixture *fixture)
{
    struct scene_material *ground = fixture_material(fixture), *mirror = fixture_material(fixture),
                          *glass = fixture_material(fixture), *pane = fixture_material(fixture);
    ground->roughness = 0.2f;
    ground->ior = 1.5f;
    mirror->metallic = 1.0f;
    mirror->roughness = 0.0f;
    glass->transmission = 1.0f;
    glass->roughness = 0.0f;
    glass->ior = 1.5f;
    pane->alpha_mode = ALPHA_BLEND;
    pane->base_colour[3] = 0.5f;
    const float before[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 1.5f};
    fixture_square(fixture, 9.0f, ground->base.id, NULL);
    fixture_square(fixture, 1.0f, pane->base.id, before);
    fixture_sphere(fixture, -1.0f, 0.2f, 0.7f, 0.6f, mirror->base.id);
    fixture_sphere(fixture, 0.8f, -0.2f, 0.7f, 0.6f, glass->base.id);
    for (int i = 0; i < 6; i++)
        fixture_light(fixture, i % 2 ? LIGHT_RECTANGLE : LIGHT_POINT, (float)i - 2.5f, 1.0f, 3.0f, 1.0f);
    fixture_environment(fixture, 0.2f, 0.2f, 0.3f);
}

static void no_step_traces_more_than_it_may(void **state)
{
    struct fixture *fixture = *state;
    static const struct form {
        const char *name;
        enum frame_integrator integrator;
        uint32_t samples, ao_rays, layers;
        enum frame_primary primary;
    } forms[] = {
        {"whitted", INTEGRATOR_WHITTED, 1, 0, 0, PRIMARY_RASTER},
        {"whitted, traced", INTEGRATOR_WHITTED, 2, 0, 0, PRIMARY_TRACE},
        {"distributed", INTEGRATOR_DISTRIBUTED, 4, 0, 0, PRIMARY_TRACE},
        {"raycast", INTEGRATOR_RAYCAST, 1, 0, 0, PRIMARY_RASTER},
        {"ao, 8 rays", INTEGRATOR_AO, 1, 8, 0, PRIMARY_RASTER},
        {"ao, 64 rays", INTEGRATOR_AO, 1, 64, 0, PRIMARY_TRACE},
        {"path", INTEGRATOR_PATH, 2, 0, 0, PRIMARY_TRACE},
        {"layer ao", INTEGRATOR_WHITTED, 1, 16, 1u << LAYER_AO, PRIMARY_RASTER},
    };
    struct tracer_impl counted = tracer_bvh_impl;
    counted.trace = count_rays;
    frame_renderer_stand_in(fixture->renderer, TRACER_BVH, &counted);
    a_crowded_scene(fixture);
    fixture_commit(fixture);
    fixture->request.width = 320;
    fixture->request.height = 180;
    fixture->request.tracer = TRACER_BVH;
    for (size_t i = 0; i < sizeof(forms) / sizeof(forms[0]); i++) {
        struct error error = {0};
        struct frame_result result = {0};
        uint64_t most = 0, all = 0, steps = 0;
        fixture->request.integrator = forms[i].integrator;
        fixture->request.samples = forms[i].samples;
        fixture->request.ao_rays = forms[i].ao_rays;
        fixture->request.layers = forms[i].layers;
        fixture->request.primary = forms[i].primary;
        if (!frame_begin(fixture->renderer, fixture->scene, NULL, &fixture->request, &error))
            fail_msg("frame_begin: %s: %s", error.field, error.text);
        enum frame_progress progress;
        do {
            rays_of_step = waves_of_step = 0;
            progress = frame_step(fixture->renderer, &result, &error);
            assert_true(waves_of_step <= 1);
            most = rays_of_step > most ? rays_of_step : most;
            all += rays_of_step;
            steps++;
        } while (progress == FRAME_MORE);
        assert_int_equal(progress, FRAME_DONE);
        frame_result_finish(&result);
        print_message("%s: %llu rays in %llu steps, %llu in one at most\n", forms[i].name, (unsigned long long)all,
                      (unsigned long long)steps, (unsigned long long)most);
        if (fixture->device->facts.software)
            assert_true(most <= STEP_RAYS_MAX);
        assert_true(most >= 4096); /* else it would be slow */
    }
}

/* ---- triangles ---- */

enum { COLUMNS = 400, ROWS = 300, TRIANGLES = COLUMNS * ROWS * 2 };

/* A hilly field of more triangles than are drawn in one step. */
static void a_field(struct fixture *fixture, uint32_t material)
{
    enum { VERTICES = (COLUMNS + 1) * (ROWS + 1) };
    float(*positions)[3] = malloc(VERTICES * sizeof(*positions));
    uint32_t(*indices)[6] = malloc((size_t)COLUMNS * ROWS * sizeof(*indices));
    assert_non_null(positions);
    assert_non_null(indices);
    for (uint32_t v = 0; v < VERTICES; v++) {
        float x = (float)(v % (COLUMNS + 1)) / COLUMNS, y = (float)(v / (COLUMNS + 1)) / ROWS;
        positions[v][0] = 4.0f * x - 2.0f;
        positions[v][1] = 4.0f * y - 2.0f;
        positions[v][2] = 0.2f * sinf(9.0f * x) * cosf(7.0f * y);
    }
    for (uint32_t i = 0; i < COLUMNS * ROWS; i++) {
        uint32_t a = i / COLUMNS * (COLUMNS + 1) + i % COLUMNS, b = a + COLUMNS + 1;
        memcpy(indices[i], (uint32_t[6]){a, a + 1, b, a + 1, b + 1, b}, sizeof(indices[i]));
    }
    struct scene_mesh *mesh = &fixture_edit(fixture, SCENE_MESH)->set.mesh;
    mesh->base.id = fixture->next_id++;
    mesh->vertex_count = VERTICES;
    mesh->triangle_count = TRIANGLES;
    mesh->arrays[MESH_POSITIONS] = fixture_blob(positions, VERTICES * sizeof(*positions));
    mesh->arrays[MESH_INDICES] = fixture_blob(indices, (size_t)COLUMNS * ROWS * sizeof(*indices));
    mesh->ranges = calloc(1, sizeof(*mesh->ranges));
    assert_non_null(mesh->ranges);
    *mesh->ranges = (struct material_range){0, TRIANGLES, material};
    mesh->range_count = 1;
    fixture_node(fixture, NODE_MESH, mesh->base.id, NULL);
    const float above[12] = {0.4f, 0, 0, 0.3f, 0, 0.4f, 0, 0.2f, 0, 0, 0.4f, 0.5f}; /* a second instance */
    fixture_node(fixture, NODE_MESH, mesh->base.id, above);
    free(positions);
    free(indices);
}

static uint32_t count_steps(struct fixture *fixture, struct frame_result *result)
{
    struct error error = {0};
    uint32_t steps = 0;
    enum frame_progress progress;
    if (!frame_begin(fixture->renderer, fixture->scene, NULL, &fixture->request, &error))
        fail_msg("frame_begin: %s: %s", error.field, error.text);
    do {
        progress = frame_step(fixture->renderer, result, &error);
        steps++;
    } while (progress == FRAME_MORE);
    assert_int_equal(progress, FRAME_DONE);
    return steps;
}

static void many_triangles_are_drawn_in_parts_and_none_is_left_out(void **state)
{
    struct fixture *fixture = *state;
    struct scene_material *ground = fixture_material(fixture), *ball = fixture_material(fixture);
    ball->base_colour[0] = 0.2f;
    a_field(fixture, ground->base.id);
    fixture_sphere(fixture, -0.8f, 0.4f, 0.4f, 0.4f, ball->base.id); /* drawn after all triangles */
    fixture_light(fixture, LIGHT_DIRECTIONAL, 0.0f, 0.0f, 0.0f, 3.0f);
    fixture_commit(fixture);
    fixture->request.width = fixture->request.height = 64;
    fixture->request.tracer = TRACER_BVH;
    struct frame_result drawn = {0}, traced = {0};
    uint32_t steps = count_steps(fixture, &drawn);
    fixture->request.primary = PRIMARY_TRACE;
    uint32_t steps_traced = count_steps(fixture, &traced);
    print_message("%u steps, traced %u\n", steps, steps_traced);
    /* Two instances: 480,000 triangles. */
    assert_true(steps >= steps_traced + (fixture->device->facts.software ? 8 : 1));
    uint32_t off = 0;
    for (uint32_t i = 0; i < 64 * 64; i++) {
        const float *a = fixture_pixel(&drawn, i % 64, i / 64), *b = fixture_pixel(&traced, i % 64, i / 64);
        off += fabsf(a[0] - b[0]) + fabsf(a[1] - b[1]) > 0.01f;
    }
    assert_true(off <= 64 * 64 / 500); /* pixels' middles within rounding of an edge */
    frame_result_finish(&drawn);
    frame_result_finish(&traced);
}

int main(void)
{
#define TEST(name) cmocka_unit_test_setup(name, fixture_clear)
    const struct CMUnitTest tests[] = {
        TEST(no_step_traces_more_than_it_may),
        TEST(many_triangles_are_drawn_in_parts_and_none_is_left_out),
    };
    return cmocka_run_group_tests(tests, fixture_setup, fixture_teardown);
}
