/* SPDX-License-Identifier: MIT */
/* Traversal of A-buffers made on the CPU, against the triangles that they were made of. */
#include "tests/unit/trace/abuffer/traversal_fixture.h"
#include "tests/harness/test.h"

#define CELLS 240u
#define VOXELS 16u

/* Of rays that the triangles' own answer is known of. */
struct outcome {
    uint32_t both, only_exact, only_samples; /* hit */
    uint32_t far;                            /* of both: farther than half a cell from where it is */
    uint32_t any_wrong;                      /* of the any-hit wave */
};

/* Where the triangles are met, which is the same for all forms; free(). */
static double *exact_distances(const struct fixture *fixture, const struct ray *rays, uint32_t count)
{
    double *distances = malloc(count * sizeof(*distances));
    struct abuffer_ball *balls = abuffer_balls(&fixture->samples);
    assert_true(distances && balls);
    for (uint32_t i = 0; i < count; i++) {
        double from[3], along[3];
        for (int k = 0; k < 3; k++) {
            from[k] = (double)rays[i].origin_t_min[k];
            along[k] = (double)rays[i].direction_t_max[k];
        }
        distances[i] = abuffer_exact(&fixture->samples, balls, from, along, (double)rays[i].origin_t_min[3],
                                     (double)rays[i].direction_t_max[3])
                           .distance;
    }
    free(balls);
    return distances;
}

static struct outcome compare(struct fixture *fixture, int form, const struct ray *rays, const double *exact,
                              uint32_t count)
{
    struct hit *hits = malloc(count * sizeof(*hits));
    uint32_t *visibility = malloc(count * sizeof(*visibility));
    struct outcome o = {0};
    trace(fixture, &forms[form].options, WAVE_CLOSEST, rays, count, hits, NULL);
    trace(fixture, &forms[form].options, WAVE_ANY, rays, count, NULL, visibility);
    for (uint32_t i = 0; i < count; i++) {
        double size = 0;
        for (int k = 0; k < 3; k++)
            size = fmax(size, fabs((double)rays[i].direction_t_max[k]));
        const bool hit = hits[i].distance >= 0, exact_hit = exact[i] < INFINITY;
        o.any_wrong += (visibility[i] == 0) != exact_hit;
        o.only_exact += exact_hit && !hit;
        o.only_samples += hit && !exact_hit;
        o.both += hit && exact_hit;
        o.far += hit && exact_hit && fabs((double)hits[i].distance - exact[i]) * size > 0.5;
        if (hit) {
            assert_int_equal(hits[i].instance, HIT_NO_PRIMITIVE - 1);
            assert_true(hits[i].primitive < fixture->samples.count);
        }
    }
    free(hits);
    free(visibility);
    return o;
}

/* Shares of all rays, in thousandths, that a search may get wrong: closest hits that are missed, or are where
 * nothing is; that are elsewhere; any-hit rays. */
struct limits {
    double hit, far, any;
};

static void expect_near(struct fixture *fixture, const char *name, const struct ray *rays, uint32_t count,
                        const struct limits limits[FORM_COUNT])
{
    double *exact = exact_distances(fixture, rays, count);
    for (int f = 0; f < FORM_COUNT; f++) {
        const struct outcome o = compare(fixture, f, rays, exact, count);
        const double each = 1000.0 / count, hit = (o.only_exact + o.only_samples) * each, far = o.far * each,
                     any = o.any_wrong * each;
        printf("%s, %s: of %u rays hit %u both, %u the shape alone, %u the samples alone; %u farther than half a "
               "cell; any-hit: %u wrong\n",
               name, forms[f].name, count, o.both, o.only_exact, o.only_samples, o.far, o.any_wrong);
        assert_true(o.both > count / 8); /* else little was tested */
        if (!(hit <= limits[f].hit && far <= limits[f].far && any <= limits[f].any))
            fail_msg("%s, %s: %.2f, %.2f, %.2f of a thousand rays are wrong, at most %.2f, %.2f, %.2f may be",
                     name, forms[f].name, hit, far, any, limits[f].hit, limits[f].far, limits[f].any);
    }
    free(exact);
}

static void random_rays(struct ray *rays, uint32_t count, uint64_t seed)
{
    for (uint32_t i = 0; i < count; i++) {
        double o[3], d[3];
        for (int k = 0; k < 3; k++) {
            o[k] = CELLS * (double)test_uniform(&seed, i % 2 ? 0 : -1, i % 2 ? 1 : 2);
            d[k] = CELLS * (double)test_uniform(&seed, 0.2f, 0.8f) - o[k];
        }
        rays[i] = ray_from(o, d, 0, i % 3 == 0 ? 0.7f : FAR);
    }
}

/* ---- shapes, from everywhere ---- */

static void add_one_ball(struct abuffer_samples *s)
{
    add_ball(s, (const double[3]){101.3, 120.1, 118.7}, 60.4, 40, true);
}

static void add_one_box(struct abuffer_samples *s)
{
    add_box(s, (const double[3]){61.3, 50.1, 68.7}, (const double[3]){161.3, 150.1, 128.7}, true);
}

/* A ball within a ball, which is cut by a box, beside another in one. */
static void add_nested(struct abuffer_samples *s)
{
    add_ball(s, (const double[3]){101.3, 120.1, 118.7}, 70.4, 40, true);
    add_ball(s, (const double[3]){96.3, 110.1, 121.7}, 40.2, 30, true);
    add_box(s, (const double[3]){81.3, 130.1, 28.7}, (const double[3]){221.3, 180.1, 98.7}, true);
    add_ball(s, (const double[3]){170.3, 150.1, 60.7}, 15.3, 20, true);
}

static void add_open_ball(struct abuffer_samples *s)
{
    add_ball(s, (const double[3]){101.3, 120.1, 118.7}, 60.4, 40, false);
}

/* Askew, one behind the other, without thickness. */
static void add_sheets(struct abuffer_samples *s)
{
    for (int i = 0; i < 5; i++) {
        double x = 40 + 35 * i, lean = 11.3 * (i - 2);
        const double p[4][3] = {
            {x - lean, 22.2, 31.1}, {x + lean, 201.3, 31.1}, {x + lean, 201.3, 202.2}, {x - lean, 22.2, 202.2}};
        add_quad(s, p, false);
    }
}

/* As thick as a cell and a half. */
static void add_plates(struct abuffer_samples *s)
{
    add_box(s, (const double[3]){61.3, 50.1, 68.7}, (const double[3]){62.8, 180.1, 198.7}, true);
    add_box(s, (const double[3]){81.3, 50.1, 68.7}, (const double[3]){181.3, 51.6, 198.7}, true);
    add_box(s, (const double[3]){81.3, 70.1, 100.7}, (const double[3]){181.3, 160.1, 102.2}, true);
}

/* A room: all walls are seen from within, and open. */
static void add_room(struct abuffer_samples *s)
{
    add_box(s, (const double[3]){10.3, 20.4, 15.2}, (const double[3]){230.3, 209.1, 221.7}, false);
    add_ball(s, (const double[3]){101.3, 60.1, 118.7}, 30.4, 30, true);
}

ALL_TESTS(open_device, close_device)

/* Where an edge passes a texel a sample's plane goes on beyond it, by up to half a texel: of the searches that
 * look at all texels a few rays in a thousand see that. Steps miss what is passed twice between two of them, which
 * is at edges and rims, by the length of a step: a voxel is 15 cells wide here, and shapes are some 100. And where
 * walls meet that no one image shows, they look in one of the images: some fifteen of a thousand rays pass the
 * walls of the room there. */
TEST(rays_meet_shapes_where_they_are)
{
    static const struct {
        const char *name;
        void (*add)(struct abuffer_samples *s);
        struct limits limits[FORM_COUNT];
    } rows[] = {
        {"a ball", add_one_ball, {{1, 1, 1}, {2, 2, 2}, {4, 4, 4}}},
        {"a box", add_one_box, {{4, 3, 4}, {10, 10, 10}, {30, 10, 30}}},
        {"bodies in bodies", add_nested, {{1, 2, 1}, {3, 15, 3}, {8, 25, 8}}},
        {"an open ball", add_open_ball, {{1, 1, 1}, {1, 1, 1}, {1, 1, 1}}},
        {"open sheets", add_sheets, {{1, 5, 1}, {1, 5, 1}, {1, 5, 1}}},
        {"plates", add_plates, {{7, 4, 7}, {18, 18, 18}, {30, 30, 30}}},
        {"a room", add_room, {{3, 3, 3}, {3, 3, 3}, {3, 3, 3}}},
    };
    struct ray *rays = malloc(RAY_COUNT * sizeof(*rays));
    for (size_t i = 0; i < sizeof(rows) / sizeof(*rows); i++) {
        struct fixture fixture;
        fixture_init(&fixture, NULL, CELLS, VOXELS);
        rows[i].add(&fixture.samples);
        fixture_build(&fixture);
        random_rays(rays, RAY_COUNT, 7);
        expect_near(&fixture, rows[i].name, rays, RAY_COUNT, rows[i].limits);
        fixture_finish(&fixture);
    }
    free(rays);
}

/* Voxels that are no whole number of cells wide, of a cell, and of nearly all of them. */
TEST(voxels_of_any_size_lead_to_the_same)
{
    static const uint32_t grids[][2] = {{97, 16}, {100, 64}, {64, 64}, {33, 16}, {130, 32}};
    static const struct limits limits[FORM_COUNT] = {{3, 5, 3}, {12, 40, 12}, {16, 50, 16}};
    struct ray *rays = malloc(RAY_COUNT * sizeof(*rays));
    for (size_t i = 0; i < sizeof(grids) / sizeof(*grids); i++) {
        const double n = grids[i][0];
        struct fixture fixture;
        uint64_t seed = 5 + i;
        char name[64];
        snprintf(name, sizeof(name), "%u cells, %u voxels", grids[i][0], grids[i][1]);
        fixture_init(&fixture, NULL, grids[i][0], grids[i][1]);
        add_ball(&fixture.samples, (const double[3]){0.45 * n, 0.52 * n, 0.5 * n}, 0.38 * n, 24, true);
        fixture_build(&fixture);
        for (uint32_t k = 0; k < RAY_COUNT; k++) {
            double o[3], d[3];
            for (int axis = 0; axis < 3; axis++) {
                o[axis] = n * (double)test_uniform(&seed, -1, 2);
                d[axis] = n * (double)test_uniform(&seed, 0, 1) - o[axis];
            }
            rays[k] = ray_from(o, d, 0, FAR);
        }
        expect_near(&fixture, name, rays, RAY_COUNT, limits);
        fixture_finish(&fixture);
    }
    free(rays);
}

/* Hundreds of sheets behind each texel, of which the rays begin between any two. */
TEST(deep_columns_are_searched_at_their_depth)
{
    enum { sheets = 150 };
    struct ray *rays = malloc(RAY_COUNT * sizeof(*rays));
    for (int body = 0; body < 2; body++) {
        struct fixture fixture;
        uint64_t seed = 9;
        fixture_init(&fixture, NULL, CELLS, VOXELS);
        for (int i = 0; i < sheets; i++) {
            const double low = 20.2 + 1.3 * i; /* body: every other gap is inside */
            const double p[4][3] = {{20, 20, low}, {220, 20, low}, {220, 220, low}, {20, 220, low}};
            const double turned[4][3] = {{20, 220, low}, {220, 220, low}, {220, 20, low}, {20, 20, low}};
            add_quad(&fixture.samples, i % 2 ? p : turned, body == 1);
        }
        fixture_build(&fixture);
        assert_true(fixture.store.depth_max == sheets);
        for (uint32_t i = 0; i < RAY_COUNT; i++) {
            const double sheet = floor((double)test_uniform(&seed, 0, sheets - 1));
            const double o[3] = {(double)test_uniform(&seed, 40, 200), (double)test_uniform(&seed, 40, 200),
                                 20.2 + 1.3 * (sheet + 0.5)};
            const double d[3] = {(double)test_uniform(&seed, -1, 1), (double)test_uniform(&seed, -1, 1),
                                 i % 2 ? 1.0 : -1.0};
            rays[i] = ray_from(o, d, 0, FAR);
        }
        double *exact = exact_distances(&fixture, rays, RAY_COUNT);
        for (int f = 0; f < FORM_COUNT; f++) {
            const struct outcome o = compare(&fixture, f, rays, exact, RAY_COUNT);
            if (o.both < RAY_COUNT / 2 || o.only_exact + o.only_samples + o.far + o.any_wrong > 0)
                fail_msg("%s, body %d: %u missed, %u where nothing is, %u elsewhere, %u any-hit rays wrong",
                         forms[f].name, body, o.only_exact, o.only_samples, o.far, o.any_wrong);
        }
        free(exact);
        fixture_finish(&fixture);
    }
    free(rays);
}

/* Sheets that share cells, and rays that go along between them without a hit: what a dispatch must have time for
 * (trace_rays_a_dispatch). */
TEST(no_ray_takes_more_rounds_than_the_structure_allows)
{
    enum { sheets = 60 };
    struct ray *rays = malloc(RAY_COUNT * sizeof(*rays));
    struct hit *counts = malloc(RAY_COUNT * sizeof(*counts));
    struct fixture fixture;
    uint64_t seed = 10;
    fixture_init(&fixture, NULL, CELLS, VOXELS);
    for (int i = 0; i < sheets; i++) {
        const double z = 120.1 + 0.015 * i;
        add_quad(&fixture.samples, (const double[4][3]){{20, 20, z}, {220, 20, z}, {220, 220, z}, {20, 220, z}},
                 i % 2);
    }
    fixture_build(&fixture);
    assert_true(fixture.store.depth_max == sheets);
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        const double o[3] = {1, (double)test_uniform(&seed, 30, 210), 120.1 + 0.015 * (i % (sheets - 1) + 0.5)};
        rays[i] = ray_from(o, (const double[3]){1, (double)test_uniform(&seed, -0.9f, 0.9f), 0}, 0, FAR);
    }
    for (int f = 0; f < FORM_COUNT; f++) {
        struct tracer_options options = forms[f].options;
        uint32_t scanned_max = 0;
        options.bench.abuffer_count_steps = 1;
        trace(&fixture, &options, WAVE_CLOSEST, rays, RAY_COUNT, counts, NULL);
        for (uint32_t i = 0; i < RAY_COUNT; i++) {
            const uint64_t rounds = (uint64_t)counts[i].distance + counts[i].primitive;
            if (rounds > abuffer_rounds_of_a_ray(&fixture.store, &options))
                fail_msg("%s: ray %u takes %llu rounds", forms[f].name, i, (unsigned long long)rounds);
            scanned_max = counts[i].primitive > scanned_max ? counts[i].primitive : scanned_max;
        }
        assert_true(scanned_max >= (f == DDA ? CELLS : VOXELS) * sheets / 4);
    }
    fixture_finish(&fixture);
    free(rays);
    free(counts);
}

/* ---- the paper's own forms ---- */

static struct outcome compare_by_voxels(void (*add)(struct abuffer_samples *s), int form)
{
    struct ray *rays = malloc(RAY_COUNT * sizeof(*rays));
    struct fixture fixture;
    fixture_init(&fixture, NULL, CELLS, VOXELS);
    fixture.store.whole_voxels = true;
    add(&fixture.samples);
    fixture_build(&fixture);
    random_rays(rays, RAY_COUNT, 7);
    double *exact = exact_distances(&fixture, rays, RAY_COUNT);
    const struct outcome o = compare(&fixture, form, rays, exact, RAY_COUNT);
    free(exact);
    printf("%s: of %u rays hit %u both, %u the shape alone, %u the samples alone; %u farther than half a cell; "
           "any-hit: %u wrong\n",
           forms[form].name, RAY_COUNT, o.both, o.only_exact, o.only_samples, o.far, o.any_wrong);
    fixture_finish(&fixture);
    free(rays);
    return o;
}

/* A ball within one, its surface not half a cell below: both are passed in the same step. */
static void add_two_shells(struct abuffer_samples *s)
{
    add_ball(s, (const double[3]){101.3, 120.1, 118.7}, 60.4, 40, true);
    add_ball(s, (const double[3]){101.3, 120.1, 118.7}, 60.0, 40, true);
}

/* One smooth surface in a voxel: what the paper assumes. A ray misses the ball where its chord is shorter than a
 * step: of one voxel, 15 cells, at most sqrt(3) times that across. Chords c of a ball of radius r are as long or
 * shorter for (c / 2r)^2 of parallel rays: 4.6 % of those that hit. */
TEST(steps_of_voxels_miss_no_more_of_a_ball_than_its_rim)
{
    for (int f = FORM_COUNT; f < FORMS_END; f++) {
        const struct outcome o = compare_by_voxels(add_one_ball, f);
        const double rim = pow(sqrt(3.0) * CELLS / VOXELS / (2 * 60.4), 2);
        assert_true(o.both > RAY_COUNT / 8);
        if (o.only_exact + o.far > rim * (o.both + o.only_exact) || o.only_samples > RAY_COUNT / 1000)
            fail_msg("%s: %u missed, %u where nothing is, %u elsewhere, of %u", forms[f].name, o.only_exact,
                     o.only_samples, o.far, o.both);
    }
}

/* The winding goes from 0 to 2, which differs; parity goes from even to even, but where a step ends between the
 * shells: of steps of 5 cells, 0.4 / 5 over the cosine, twice on a ray's way. */
TEST(parity_passes_two_shells_that_winding_meets)
{
    for (int f = FORM_COUNT; f < FORMS_END; f++) {
        const struct outcome o = compare_by_voxels(add_two_shells, f);
        const bool is_parity = f >= PARITY3;
        const double missed = o.only_exact / (double)(o.both + o.only_exact);
        if (is_parity ? missed < 0.5 : missed > 0.05)
            fail_msg("%s: a share of %.3f is missed", forms[f].name, missed);
    }
}
