/* SPDX-License-Identifier: MIT */
/* Promises of the tracer `rayspace` alone: its hits are brute force's to the bit, in batches of any size,
 * also where these are halved or memory is short. Also its report on its waves. */
#include "tests/unit/trace/tracer_fixture.h"

#include "shared/wave.h"
#include "tests/fixtures/structure.h"
#include "trace/rayspace/tracer.h"

#define BVH_NUMBER 0u
#define NAIVE_NUMBER 1u
#define RAYSPACE_NUMBER 5u
#define RAY_COUNT 4096u
/* Pairs that a stack has room for, for so many rays. */
#define STACK_PAIRS (1u << 16)

ALL_TESTS(open_device, close_device)

struct pair {
    struct fixture naive, rayspace; /* fixtures of equal scenes */
};

static void pair_init_by(struct pair *pair, struct scene *(*create)(void), const struct tracer_options *options)
{
    fixture_init_by(&pair->naive, NAIVE_NUMBER, create(), NULL);
    fixture_init_by(&pair->rayspace, RAYSPACE_NUMBER, create(), options);
}

static void pair_init(struct pair *pair, struct scene *(*create)(void))
{
    pair_init_by(pair, create, NULL);
}

/* Before the first wave. */
static struct rayspace_state *begin_state(struct fixture *fixture)
{
    struct error error = {0};
    struct tracer *tracer = fixture->tracer;
    tracer->state = trace_state_create(tracer->impl, device, &tracer->options, &error);
    expect_ok(tracer->state != NULL, &error);
    return (struct rayspace_state *)tracer->state;
}

static void pair_finish(struct pair *pair)
{
    fixture_finish(&pair->rayspace);
    fixture_finish(&pair->naive);
}

static void random_rays(struct ray *rays, uint32_t count, uint64_t seed)
{
    for (uint32_t i = 0; i < count; i++) {
        rays[i] = (struct ray){.direction_t_max[3] = i % 5 ? 1e30f : 2.0f};
        for (int k = 0; k < 3; k++) {
            /* Some of one point, as neighbours are. */
            rays[i].origin_t_min[k] = i % 2048 < 1024 ? (float)(k + 1) : test_uniform(&seed, -3, 3);
            rays[i].direction_t_max[k] =
                test_uniform(&seed, -1, 1) - (i % 2048 < 1024 ? 0.5f * (float)(k + 1) : 0);
        }
    }
}

struct answers {
    struct hit *hits;
    uint32_t *visibility;
};

static struct answers ask(struct fixture *fixture, const struct ray *rays, uint32_t count)
{
    struct answers answers = {calloc(count, sizeof(*answers.hits)), calloc(count, sizeof(*answers.visibility))};
    trace_rays(trace_by_tracer, fixture, WAVE_ANY, rays, count, NULL, answers.visibility);
    trace_rays(trace_by_tracer, fixture, WAVE_CLOSEST, rays, count, answers.hits, NULL);
    return answers;
}

/* Frees them. */
static void expect_alike(struct answers own, struct answers other, uint32_t count, const char *what)
{
    uint32_t found = 0, through = 0;
    for (uint32_t i = 0; i < count; i++) {
        if (memcmp(&own.hits[i], &other.hits[i], sizeof(*own.hits)) != 0)
            fail_msg("%s: the closest hit of ray %u: %.9g for %.9g", what, i, (double)own.hits[i].distance,
                     (double)other.hits[i].distance);
        if (own.visibility[i] != other.visibility[i])
            fail_msg("%s: the transmittance of ray %u: %08x for %08x", what, i, own.visibility[i],
                     other.visibility[i]);
        found += other.hits[i].distance >= 0;
        through += other.visibility[i] != 0;
    }
    /* The rays see both. */
    assert_in_range(found, count / 20, count);
    assert_in_range(through, 1, count);
    free(own.hits);
    free(own.visibility);
    free(other.hits);
    free(other.visibility);
}

static void expect_same_answers(struct pair *pair, const struct ray *rays, uint32_t count, const char *what)
{
    expect_alike(ask(&pair->rayspace, rays, count), ask(&pair->naive, rays, count), count, what);
}

/* Control of the last wave. */
static struct rayspace_control control_of(const struct fixture *fixture)
{
    struct rayspace_control control;
    const struct rayspace_state *state = (const struct rayspace_state *)fixture->tracer->state;
    gpu_buffer_read(device, &state->control, 0, &control, sizeof(control));
    return control;
}

TEST(answers_are_those_of_brute_force_to_the_bit_in_small_batches)
{
    const uint32_t room = 256;
    struct ray *rays = malloc(RAY_COUNT * sizeof(*rays));
    struct pair pair;
    random_rays(rays, RAY_COUNT, 3);
    pair_init_by(&pair, test_scene_soup, &(struct tracer_options){.rayspace.mode = RAYSPACE_MODE_FLAT});
    struct rayspace_state *own = begin_state(&pair.rayspace);
    own->capacity_fits = room;
    expect_same_answers(&pair, rays, RAY_COUNT, "in small batches");
    assert_in_range(own->batch_max, 1, room);
    assert_in_range(((const struct rayspace *)pair.rayspace.tracer)->rank_count, room + 1, UINT32_MAX);
    pair_finish(&pair);
    free(rays);
}

/* ---- discs ---- */

/* A soup, and above it a disc that hides it from rays near its axis, and of glass a second one above that. */
static struct scene *scene_below_disc(float radius)
{
    struct test_edits edits = {.scene = test_scene_create()};
    test_material(&edits, 1, 0.9f, 0.95f, 0.9f);
    struct scene_material *pane = test_material(&edits, 2, 0.4f, 0.5f, 0.6f);
    pane->value.alpha_mode = ALPHA_BLEND;
    pane->value.base_colour[3] = 0.4f;
    test_soup_mesh(&edits, 10, 600, 0.3f, 29);
    test_node(&edits, 1, 0, NODE_MESH, 10, NULL);
    for (uint32_t i = 0; i < 2; i++) {
        struct scene_disc *disc = &test_add(&edits, OBJECT_DISC)->set.disc;
        disc->base.id = i + 1;
        disc->value.material = i + 1;
        disc->value.centre_world[2] = 1.5f + 0.5f * (float)i;
        disc->value.normal_world[2] = 1.0f;
        disc->value.radius = radius;
    }
    test_commit(&edits);
    return edits.scene;
}

static struct scene *scene_below_small_disc(void)
{
    return scene_below_disc(0.01f);
}

static struct scene *scene_below_disc_of_a_half(void)
{
    return scene_below_disc(0.8f);
}

static struct scene *scene_below_large_disc(void)
{
    return scene_below_disc(100);
}

TEST(rays_do_not_descend_beyond_a_disc)
{
    static const struct {
        struct scene *(*create)(void);
        const char *name;
    } scenes[] = {{scene_below_small_disc, "a small disc"},
                  {scene_below_disc_of_a_half, "a disc above a half"},
                  {scene_below_large_disc, "a disc above all"}};
    struct ray *rays = malloc(RAY_COUNT * sizeof(*rays));
    struct hit *hits = calloc(RAY_COUNT, sizeof(*hits)), *expected = calloc(RAY_COUNT, sizeof(*hits));
    uint32_t cone_tests[3], triangle_tests[3];
    uint64_t seed = 31;
    for (uint32_t i = 0; i < RAY_COUNT; i++)
        rays[i] = (struct ray){{test_uniform(&seed, -1, 1), test_uniform(&seed, -1, 1), 3, 0},
                               {test_uniform(&seed, -0.1f, 0.1f), test_uniform(&seed, -0.1f, 0.1f), -1, 1e30f}};
    for (unsigned i = 0; i < 3; i++) {
        struct pair pair;
        pair_init(&pair, scenes[i].create);
        trace_rays(trace_by_tracer, &pair.naive, WAVE_CLOSEST, rays, RAY_COUNT, expected, NULL);
        trace_rays(trace_by_tracer, &pair.rayspace, WAVE_CLOSEST, rays, RAY_COUNT, hits, NULL);
        assert_memory_equal(hits, expected, RAY_COUNT * sizeof(*hits));
        cone_tests[i] = control_of(&pair.rayspace).cone_tests;
        triangle_tests[i] = control_of(&pair.rayspace).triangle_tests;
        print_message("%s: %u cone tests, %u triangle tests\n", scenes[i].name, cone_tests[i], triangle_tests[i]);
        pair_finish(&pair);
    }
    /* A half of the rays are above the disc, whose neighbours often are not: nodes of both go on. */
    assert_true(cone_tests[1] < cone_tests[0]);
    assert_true(triangle_tests[1] < triangle_tests[0] * 3 / 4);
    assert_true(cone_tests[2] < cone_tests[0] / 100);
    assert_int_equal(triangle_tests[2], 0);
    free(rays);
    free(hits);
    free(expected);
}

/* ---- queued whole ---- */

/* With a word that a wave sets where it was not traced to its end: then no pass is waited for. */
struct ahead {
    struct fixture *fixture;
    struct gpu_buffer stopped;
};

static bool trace_ahead(void *user, const struct wave *wave, struct error *error)
{
    struct ahead *ahead = user;
    struct wave own = *wave;
    own.stopped = &ahead->stopped;
    return trace_by_tracer(ahead->fixture, &own, error);
}

/* Whether the rays have been traced to their ends; their answers are then those of brute force. */
static bool is_traced_ahead(struct pair *pair, const struct ray *rays, uint32_t count, const struct hit *expected)
{
    struct ahead ahead = {.fixture = &pair->rayspace};
    struct hit *hits = calloc(count, sizeof(*hits));
    struct error error = {0};
    uint32_t stopped = 0;
    expect_ok(gpu_buffer_upload(device, &ahead.stopped, &stopped, sizeof(stopped), &error), &error);
    trace_rays(trace_ahead, &ahead, WAVE_CLOSEST, rays, count, hits, NULL);
    gpu_buffer_read(device, &ahead.stopped, 0, &stopped, sizeof(stopped));
    gpu_buffer_finish(device, &ahead.stopped);
    assert_true(stopped == 0 || stopped == WAVE_STOPPED_LONG);
    if (!stopped)
        assert_memory_equal(hits, expected, count * sizeof(*hits));
    free(hits);
    return !stopped;
}

TEST(a_wave_that_is_queued_whole_has_its_answers_or_stops_its_slice)
{
    struct ray *rays = malloc(RAY_COUNT * sizeof(*rays));
    struct hit *expected = calloc(RAY_COUNT, sizeof(*expected));
    random_rays(rays, RAY_COUNT, 3);
    for (int little = 0; little < 2;
         little++) { /* a round's passes may take too few pairs: then something is left */
        struct pair pair;
        pair_init(&pair, test_scene_soup);
        begin_state(&pair.rayspace)->capacity_fits = little ? 384 : 0;
        trace_rays(trace_by_tracer, &pair.naive, WAVE_CLOSEST, rays, RAY_COUNT, expected, NULL);
        assert_int_equal(is_traced_ahead(&pair, rays, RAY_COUNT, expected), !little);
        pair_finish(&pair);
    }
    free(expected);
    free(rays);
}

/* ---- halving ---- */

/* Every ray passes most of them. */
static struct scene *scene_of_large_triangles(void)
{
    struct test_edits edits = {.scene = test_scene_create()};
    struct scene_material *pane = test_material(&edits, 1, 0.9f, 0.95f, 0.9f);
    test_material(&edits, 2, 0.4f, 0.5f, 0.6f);
    pane->value.alpha_mode = ALPHA_BLEND;
    pane->value.base_colour[3] = 0.02f;
    test_soup_mesh(&edits, 10, 600, 3.0f, 23);
    const struct record_material_range ranges[] = {{0, 600, 1}};
    struct scene_mesh *mesh = test_last_mesh(&edits);
    free(mesh->ranges);
    mesh->ranges = test_ranges(ranges, 1);
    mesh->range_count = 1;
    test_node(&edits, 1, 0, NODE_MESH, 10, NULL);
    test_commit(&edits);
    return edits.scene;
}

TEST(a_pass_that_overflows_is_halved_and_no_answer_is_lost)
{
    const uint32_t count = 2 * RAY_COUNT, room = RAY_COUNT / 2;
    struct pair pair;
    struct ray *rays = malloc(count * sizeof(*rays));
    pair_init(&pair, scene_of_large_triangles);
    begin_state(&pair.rayspace)->capacity_fits = room;
    random_rays(rays, count, 5);
    expect_same_answers(&pair, rays, count, "large triangles");
    const struct rayspace_control control = control_of(&pair.rayspace);
    print_message("%u passes, %u of them halved, at most %u pairs\n", control.passes, control.halvings,
                  control.pairs_max);
    assert_in_range(control.halvings, 1, control.passes / 2);
    assert_true(control.triangle_tests > STACK_PAIRS);
    /* Two stacks and the leaves. */
    assert_in_range(control.pairs_max, room / 2, 3 * room);
    pair_finish(&pair);
    free(rays);
}

/* ---- what is said of waves ---- */

static bool trace_shadows(void *user, const struct wave *wave, struct error *error)
{
    struct wave own = *wave;
    own.family = RAY_SHADOW * WAVE_BOUNCES + 3; /* a wave of some bounce */
    return trace_by_tracer(user, &own, error);
}

static struct structure_rows rows_of(struct fixture *fixture)
{
    struct structure_rows rows = {0};
    struct error error = {0};
    expect_ok(trace_state_copy_counts(fixture->tracer->state, &error), &error);
    expect_ok(trace_state_report(fixture->tracer->state, &rows, &error), &error);
    return rows;
}

/* Rows are floats. */
static void expect_mean(const struct structure_rows *rows, const char *name, uint32_t sum, uint32_t count)
{
    const struct structure_row row = structure_row(rows, name);
    const double wanted = (double)sum / count;
    assert_int_equal(row.unit, UNIT_PER_RAY);
    if (wanted <= 0 || fabs((double)row.measure - wanted) > 1e-6 * wanted)
        fail_msg("%s: %.9g for %.9g", name, (double)row.measure, wanted);
}

TEST(waves_of_each_kind_are_told_apart_until_the_reset)
{
    struct ray rays[512];
    struct hit hits[512];
    uint32_t visibility[512];
    random_rays(rays, 512, 17);
    struct fixture fixture;
    fixture_init_by(&fixture, RAYSPACE_NUMBER, test_scene_soup(), NULL);
    struct rayspace_state *own = begin_state(&fixture);
    own->turns = RAYSPACE_CHANCE_ON;
    own->sorts = RAYSPACE_CHANCE_OFF;
    trace_rays(trace_by_tracer, &fixture, WAVE_CLOSEST, rays, 512, hits, NULL);
    const struct rayspace_control closest = control_of(&fixture);
    trace_rays(trace_shadows, &fixture, WAVE_ANY, rays, 512, NULL, visibility);
    const struct rayspace_control first = control_of(&fixture);
    trace_rays(trace_shadows, &fixture, WAVE_ANY, rays, 256, NULL, visibility);
    const struct rayspace_control second = control_of(&fixture);
    const struct structure_rows rows = rows_of(&fixture);
    expect_mean(&rows, "primary/cone_tests", closest.cone_tests, 512);
    expect_mean(&rows, "primary/triangle_tests", closest.triangle_tests, 512);
    expect_mean(&rows, "shadow/cone_tests", first.cone_tests + second.cone_tests, 512 + 256);
    expect_mean(&rows, "shadow/triangle_tests", first.triangle_tests + second.triangle_tests, 512 + 256);
    assert_int_equal(structure_row(&rows, "primary/waves").number, 1);
    assert_int_equal(structure_row(&rows, "shadow/waves").number, 2);
    assert_int_equal(structure_row(&rows, "shadow/passes").number, first.passes + second.passes);
    assert_int_equal(structure_row(&rows, "shadow/pairs_max").number, first.pairs_max);
    assert_int_equal(structure_row(&rows, "shadow/turned").number, 2);
    assert_int_equal(structure_row(&rows, "primary/turned").number, 0); /* they have no end in common */
    assert_int_equal(structure_row(&rows, "shadow/sorted").number, 0);
    assert_int_equal(rows.count, 2 * 8);
    trace_state_reset(fixture.tracer->state);
    assert_int_equal(rows_of(&fixture).count, 0);
    trace_rays(trace_shadows, &fixture, WAVE_ANY, rays, 256, NULL, visibility);
    /* Not the counts of before: which rays are found stopped in time to spare others' tests varies. */
    const struct rayspace_control third = control_of(&fixture);
    const struct structure_rows after = rows_of(&fixture);
    expect_mean(&after, "shadow/cone_tests", third.cone_tests, 256);
    assert_int_equal(after.count, 8);
    fixture_finish(&fixture);
}

TEST(a_wave_that_was_sorted_or_halved_says_so)
{
    struct ray rays[512];
    struct hit hits[512];
    struct fixture fixture;
    random_rays(rays, 512, 19);
    fixture_init_by(&fixture, RAYSPACE_NUMBER, test_scene_soup(), NULL);
    struct rayspace_state *own = begin_state(&fixture);
    own->sorts = RAYSPACE_CHANCE_ON;
    own->capacity_fits = 256;
    trace_rays(trace_by_tracer, &fixture, WAVE_CLOSEST, rays, 512, hits, NULL);
    const struct structure_rows rows = rows_of(&fixture);
    assert_int_equal(structure_row(&rows, "primary/sorted").number, 1);
    assert_in_range(structure_row(&rows, "primary/halvings").number, 1,
                    structure_row(&rows, "primary/passes").number);
    /* Two stacks and the leaves. */
    assert_in_range(structure_row(&rows, "primary/pairs_max").number, 128, 3 * 256);
    fixture_finish(&fixture);
}

/* ---- little memory ---- */

TEST(stacks_are_smaller_where_memory_is_short)
{
    const uint64_t limit = device->memory_limit_bytes;
    struct ray *rays = malloc(RAY_COUNT * sizeof(*rays));
    struct pair pair;
    random_rays(rays, RAY_COUNT, 5);
    pair_init(&pair, test_scene_soup);
    struct answers expected = ask(&pair.naive, rays, RAY_COUNT);
    /* Three stacks and the leaves take 4 MiB; rays, hits and nodes less than 1 MiB. */
    device->memory_limit_bytes = device->memory_used_bytes + ((uint64_t)2 << 20);
    const struct answers found = ask(&pair.rayspace, rays, RAY_COUNT);
    const struct rayspace_state *own = (const struct rayspace_state *)pair.rayspace.tracer->state;
    assert_in_range(own->capacity, 1, STACK_PAIRS / 2);
    expect_alike(found, expected, RAY_COUNT, "little memory");
    device->memory_limit_bytes = limit;
    pair_finish(&pair);
    free(rays);
}

static uint64_t device_bytes_by(unsigned tracer)
{
    struct test_edits edits = {.scene = test_scene_create()};
    struct fixture fixture;
    test_material(&edits, 1, 0.1f, 0.2f, 0.3f);
    test_material(&edits, 2, 0.4f, 0.5f, 0.6f);
    test_soup_mesh(&edits, 10, 20000, 0.05f, 7);
    test_node(&edits, 1, 0, NODE_MESH, 10, NULL);
    test_commit(&edits);
    fixture_init_by(&fixture, tracer, edits.scene, NULL);
    const uint64_t bytes = fixture.tracer->stats.device_bytes;
    fixture_finish(&fixture);
    return bytes;
}

/* bvh keeps its elements in eight orders, one for each octant of directions. Of 20,000 triangles these are
 * somewhat less than one half of its bytes, of which one eighth stays; the rest are triangles, which both keep. */
TEST(a_tree_is_kept_in_one_order)
{
    const uint64_t own = device_bytes_by(RAYSPACE_NUMBER), bvh = device_bytes_by(BVH_NUMBER);
    print_message("%llu bytes, of bvh %llu\n", (unsigned long long)own, (unsigned long long)bvh);
    assert_true(own < bvh / 3 * 2);
}
