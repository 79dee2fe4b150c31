/* SPDX-License-Identifier: MIT */
/* How a structure comes about: in steps, abandoned in the middle, at a limit of memory, of an empty scene; and
 * that it is left alone where nothing of it has changed. */
#include "tests/tracers/contract.h"

#include "gpu/registry.h"

struct answers {
    struct hit *hits;
    uint32_t *visibilities;
};

static struct answers trace_both(struct fixture *fixture)
{
    return (struct answers){fixture_trace(fixture, WAVE_CLOSEST, RAY_COUNT),
                            fixture_trace(fixture, WAVE_ANY, RAY_COUNT)};
}

static void answers_finish(struct answers *answers)
{
    free(answers->hits);
    free(answers->visibilities);
}

static void expect_same_answers(struct fixture *fixture, const struct answers *expected)
{
    struct answers got = trace_both(fixture);
    for (uint32_t i = 0; i < RAY_COUNT; i++)
        if (memcmp(&got.hits[i], &expected->hits[i], sizeof(struct hit)) != 0 ||
            got.visibilities[i] != expected->visibilities[i])
            fail_msg("ray %u: distance %.9g, visibility %08x; before %.9g, %08x", i, (double)got.hits[i].distance,
                     got.visibilities[i], (double)expected->hits[i].distance, expected->visibilities[i]);
    answers_finish(&got);
}

static void expect_below(struct fixture *fixture, float x, float y, double expected)
{
    const struct ray ray = ray_down(x, y);
    struct hit hit;
    fixture_trace_rays(fixture, WAVE_CLOSEST, &ray, 1, &hit);
    if (hit.material & HIT_UNKNOWN) { /* the ray begins behind the eye, or something hides its end */
        const struct seen_answer seen = fixture_seen(fixture, &ray);
        assert_false(seen_knows(&seen, expected));
    } else if (!(fabs((double)hit.distance - expected) < 1e-4 * expected + fixture_cell_metres(fixture))) {
        fail_msg("distance %.9g, expected %.9g", (double)hit.distance, expected);
    }
}

CHECK(a_structure_built_in_steps_answers_as_one_built_at_once, CHECK_FORMS)
{
    const struct contract_case *of = *state;
    struct fixture fixture;
    struct error error = {0};
    uint32_t steps;
    fixture_init(&fixture, of->tracer, test_scene_soup());
    struct answers at_once = trace_both(&fixture);
    tracer_outdate(fixture.tracer);
    assert_int_equal(fixture_update_in_steps(&fixture, UINT32_MAX, &steps, &error), TRACER_DONE);
    print_message("  %u steps\n", steps);
    expect_same_answers(&fixture, &at_once);
    /* Every other one edits the scene: the structure that is there is brought to it in steps, too. */
    add_box(&fixture.edits, 2, 0, 0, 0);
    struct scene_changes changes;
    fixture_commit(&fixture, &changes);
    const struct tracer_update update = fixture_tracer_update(&fixture, changes.bits);
    enum tracer_progress progress = TRACER_MORE;
    while (progress == TRACER_MORE)
        progress = tracer_update_step(fixture.tracer, &fixture.gpu, &update, 0, &error);
    expect_ok(progress == TRACER_DONE, &error);
    struct answers in_steps = trace_both(&fixture);
    tracer_outdate(fixture.tracer);
    fixture_update(&fixture);
    expect_same_answers(&fixture, &in_steps);
    answers_finish(&at_once);
    answers_finish(&in_steps);
    fixture_finish(&fixture);
}

/* Whatever it had by then. The next update is a first one. */
CHECK(an_abandoned_update_gives_all_memory_back, CHECK_FORMS)
{
    const struct contract_case *of = *state;
    struct fixture fixture;
    struct error error = {0};
    fixture_init(&fixture, of->tracer, test_scene_spheres());
    struct answers expected = trace_both(&fixture);
    for (uint32_t steps = 1;; steps += 1 + steps / 2) {
        tracer_outdate(fixture.tracer);
        enum tracer_progress progress = fixture_update_in_steps(&fixture, steps, NULL, &error);
        expect_ok(progress != TRACER_FAILED, &error);
        if (progress == TRACER_DONE)
            break;
        tracer_update_abandon(fixture.tracer);
        assert_int_equal(fixture.tracer->stats.device_bytes, 0);
        assert_int_equal(device->memory_used_bytes, fixture.others_bytes + tracer_device_bytes(fixture.tracer));
    }
    expect_same_answers(&fixture, &expected);
    answers_finish(&expected);
    fixture_finish(&fixture);
}

/* A limit that comes in the middle, and limits from nothing to almost all that is needed: the update fails by an
 * error or keeps to it, other tracers go on, and afterwards it is as it was. */
CHECK(at_a_limit_of_memory_an_update_fails_alone, CHECK_FORMS)
{
    const struct contract_case *of = *state;
    enum { PARTS = 6 };
    const uint64_t limit = device->memory_limit_bytes;
    struct fixture fixture, other;
    struct error error = {0};
    fixture_init(&other, of->tracer, test_scene_spheres());
    struct answers of_other = trace_both(&other);
    fixture_init(&fixture, of->tracer, test_scene_spheres());
    struct answers expected = trace_both(&fixture);
    const uint64_t needed = fixture.tracer->stats.device_bytes;
    if (needed > 0) {
        tracer_destroy(fixture.tracer);
        fixture.tracer =
            tracer_create(tracer_impl_by_number(of->tracer->number), device, &of->tracer->options, &error);
        expect_ok(fixture.tracer != NULL, &error);
    }
    for (uint64_t part = 0; part < PARTS && needed > 0; part++) {
        error = (struct error){0};
        device->memory_limit_bytes = fixture.others_bytes + part * needed / PARTS;
        enum tracer_progress progress = fixture_update_in_steps(&fixture, UINT32_MAX, NULL, &error);
        expect_same_answers(&other, &of_other);
        device->memory_limit_bytes = limit;
        if (part == 0)
            assert_int_equal(progress, TRACER_FAILED);
        if (progress == TRACER_FAILED) {
            assert_true(error.kind == ERROR_OUT_OF_MEMORY || error.kind == ERROR_LIMIT);
            assert_int_equal(fixture.tracer->stats.device_bytes, 0);
            assert_int_equal(device->memory_used_bytes,
                             fixture.others_bytes + tracer_device_bytes(fixture.tracer));
        }
        tracer_outdate(fixture.tracer);
    }
    fixture_update(&fixture);
    expect_same_answers(&fixture, &expected);
    expect_same_answers(&other, &of_other);
    answers_finish(&expected);
    answers_finish(&of_other);
    fixture_finish(&fixture);
    fixture_finish(&other);
}

static void expect_nothing_built(const struct fixture *fixture, uint64_t uploaded_bytes_max)
{
    assert_int_equal(fixture->tracer->stats.nodes_rebuilt, 0);
    assert_int_equal(fixture->tracer->stats.nodes_refitted, 0);
    assert_in_range(fixture->tracer->stats.uploaded_bytes, 0, uploaded_bytes_max);
}

CHECK(without_a_change_nothing_is_built, 0)
{
    const struct contract_case *of = *state;
    struct fixture fixture;
    fixture_init(&fixture, of->tracer, scene_of_boxes(3));
    fixture_update(&fixture);
    expect_nothing_built(&fixture, 0);
    add_box(&fixture.edits, 2, 2, 0, 0); /* its present place */
    fixture_update(&fixture);
    expect_nothing_built(&fixture, 0);
    struct scene_light *light = &test_add(&fixture.edits, OBJECT_LIGHT)->set.light;
    light->base.id = 50;
    light->value.colour[0] = 1.0f;
    test_node(&fixture.edits, 50, 0, NODE_LIGHT, 50, NULL);
    fixture_update(&fixture);
    expect_nothing_built(&fixture, 0);
    /* Materials that nothing is of: a tracer may have a copy of all. */
    test_material(&fixture.edits, 77, 0.5f, 0.5f, 0.5f);
    fixture_update(&fixture);
    expect_nothing_built(&fixture, fixture.gpu.material_count * sizeof(struct material));
    test_material(&fixture.edits, 77, 0.9f, 0.1f, 0.5f)->value.roughness = 0.1f;
    fixture_update(&fixture);
    expect_nothing_built(&fixture, fixture.gpu.material_count * sizeof(struct material));
    expect_below(&fixture, 2, 0, 9.5);
    fixture_finish(&fixture);
}

/* Moving geometry is built with every frame. */
CHECK(a_build_again_allocates_nothing, CHECK_FORMS)
{
    const struct contract_case *of = *state;
    struct fixture fixture;
    fixture_init(&fixture, of->tracer, test_scene_spheres());
    uint64_t used = 0;
    size_t buffers = 0;
    for (int i = 0; i < 6; i++) {
        tracer_outdate(fixture.tracer);
        fixture_update(&fixture);
        if (i >= 3) {
            assert_int_equal(device->memory_used_bytes, used);
            assert_int_equal(gpu_registry_count(device->registry, GPU_BUFFER), buffers);
        }
        used = device->memory_used_bytes;
        buffers = gpu_registry_count(device->registry, GPU_BUFFER);
        assert_int_equal(used - fixture.others_bytes, fixture.tracer->stats.device_bytes);
    }
    fixture_finish(&fixture);
}

CHECK(an_empty_scene_is_missed_and_filled_and_emptied_again, CHECK_FORMS)
{
    const struct contract_case *of = *state;
    struct fixture fixture;
    fixture_init(&fixture, of->tracer, test_scene_create());
    struct answers answers = trace_both(&fixture);
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        assert_float_equal(answers.hits[i].distance, -1.0f, 0.0f);
        assert_int_equal(answers.visibilities[i], 0xffffffff);
    }
    answers_finish(&answers);
    struct scene_disc *disc = &test_add(&fixture.edits, OBJECT_DISC)->set.disc;
    disc->base.id = 1;
    disc->value.centre_world[2] = -2;
    disc->value.normal_world[2] = 1;
    disc->value.radius = 3;
    fixture_update(&fixture);
    expect_below(&fixture, 0, 0, 12);
    add_box_mesh(&fixture.edits, 10);
    add_box(&fixture.edits, 1, 0, 0, 0);
    fixture_update(&fixture);
    expect_below(&fixture, 0, 0, 9.5);
    expect_below(&fixture, 1, 0, 12);
    test_node(&fixture.edits, 1, 0, NODE_MESH, 10, NULL)->value.hidden = true;
    fixture_update(&fixture);
    expect_below(&fixture, 0, 0, 12);
    fixture_finish(&fixture);
}

/* Scenes as flat as can be, one point wide, far away and of any size. */
CHECK(flat_and_tiny_and_huge_scenes_are_met_where_they_are, 0)
{
    const struct contract_case *of = *state;
    static const struct {
        float size[3], place[3], longest;
    } rows[] = {
        {{4, 4, 1e-7f}, {0, 0, 0}, 4},
        {{1e-3f, 1e-3f, 1e-3f}, {0, 0, 0}, 1e-3f},
        {{1e6f, 1e6f, 1}, {0, 0, 0}, 1e6f},
        {{1e-3f, 20, 1e-3f}, {1e3f, 0, 0}, 20},
        {{1e15f, 1e15f, 1e15f}, {0, 0, 0}, 1e15f},
    };
    for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++) {
        struct scene *scene = scene_of_boxes(1);
        struct fixture fixture;
        struct hit hit;
        float m[12];
        const float *size = rows[i].size, *place = rows[i].place, above = rows[i].longest, middle = 0.01f;
        struct error error = {0};
        test_transform(m, size[0], size[1], size[2], 0, 0, place[0], place[1], place[2]);
        fixture_init(&fixture, of->tracer, scene);
        test_node(&fixture.edits, 1, 0, NODE_MESH, 10, m);
        bool ok = fixture_try_update(&fixture, &error);
        if (!ok && of->tracer->refuses_sizes) {
            assert_int_equal(error.kind, ERROR_UNSUPPORTED);
            assert_true(error.field[0] != 0);
            fixture_finish(&fixture);
            continue;
        }
        expect_ok(ok, &error);
        /* In its middle, from a size above it: cells that hold a sample there are no wider than the box. */
        const double cell = fixture_cell_metres(&fixture) + fixture_texel_metres(&fixture);
        struct ray ray = {{place[0] + middle * size[0], place[1] + middle * size[1], place[2] + above, 0},
                          {0, 0, -1, 10 * above}};
        if ((double)size[0] > cell && (double)size[1] > cell) {
            fixture_trace_rays(&fixture, WAVE_CLOSEST, &ray, 1, &hit);
            assert_float_equal(hit.distance / (above - 0.5f * size[2]), 1.0f, 1e-4f);
        }
        fixture_finish(&fixture);
    }
}
