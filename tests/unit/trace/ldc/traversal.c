/* SPDX-License-Identifier: MIT */
/* Traversal of layered depth cubes against brute force over all samples of cubes made on the CPU: every form
 * of levels, of rays and of layers together. What is an intersection is the shader's rule (ldc/cube.glsl) in
 * doubles; where it hangs on rounding whether one counts, either answer is taken, see judge(). */
#include "tests/unit/trace/ldc/traversal_fixture.h"
#include "tests/harness/test.h"

/* Cells: what floats round of places in cubes of some hundred cells, and of rays that begin some hundred away. */
#define ROUNDING 1e-3

static void add_soup(struct ldc_samples *s, int count, float size, uint64_t seed)
{
    const float extent = s->cell * (float)s->resolution;
    for (int i = 0; i < count; i++) {
        float corners[3][3], centre[3];
        for (int k = 0; k < 3; k++)
            centre[k] = s->lower[k] + extent * test_uniform(&seed, 0, 1);
        for (int c = 0; c < 3; c++)
            for (int k = 0; k < 3; k++)
                corners[c][k] = centre[k] + test_uniform(&seed, -size, size);
        ldc_add_triangle(s, (const float(*)[3])corners, 0);
    }
}

/* ---- brute force ---- */

/* Of one sample: where a ray intersects its plane. */
struct intersection {
    double distance; /* in lengths of the direction; no number: not at all */
    double beyond;   /* cells: how far outside of the texel, <= 0: inside */
    bool is_in_cube; /* not only the sample is */
    bool is_own, is_surely_not_own;
};

/* A ray in cells; no component of its direction is above 1. */
struct ray_in_cells {
    double o[3], d[3], size;
};

static struct ray_in_cells in_cells(const struct ldc_samples *s, const struct ray *ray)
{
    struct ray_in_cells r = {.size = 0};
    for (int k = 0; k < 3; k++)
        r.size = fmax(r.size, fabs((double)ray->direction_t_max[k]));
    for (int k = 0; k < 3; k++) {
        r.o[k] = ((double)ray->origin_t_min[k] - s->lower[k]) / s->cell;
        r.d[k] = ray->direction_t_max[k] / r.size;
    }
    return r;
}

static struct intersection cross(const struct ldc_samples *s, const struct ldc_sample *sample,
                                 const float normal[3], const struct ray_in_cells *ray)
{
    const uint32_t n = s->resolution, axis = sample->texel / (n * n), iu = (axis + 1) % 3, iv = (axis + 2) % 3;
    const double *o = ray->o, *d = ray->d;
    double to[3], height = 0, slope = 0;
    to[iu] = (double)(sample->texel % n) + 0.5 - o[iu];
    to[iv] = (double)(sample->texel / n % n) + 0.5 - o[iv];
    to[axis] = (double)sample->depth - o[axis];
    for (int k = 0; k < 3; k++) {
        height += normal[k] * to[k];
        slope += normal[k] * d[k];
    }
    const double along = height / slope, own = slope > 0 ? (double)LDC_OWN_BEHIND : (double)LDC_OWN_BEFORE;
    const double off_u = fabs(along * d[iu] - to[iu]), off_v = fabs(along * d[iv] - to[iv]);
    struct intersection c = {.distance = along * s->cell / ray->size};
    c.beyond = (off_u > off_v ? off_u : off_v) - 0.5; /* fmax() is a call, and there are millions */
    c.is_in_cube = along * d[axis] + o[axis] > 0 && along * d[axis] + o[axis] < n;
    c.is_own = along < (double)LDC_OWN_WAY - ROUNDING && fabs(height) < own - ROUNDING;
    c.is_surely_not_own = along > (double)LDC_OWN_WAY + ROUNDING || fabs(height) > own + ROUNDING;
    return c;
}

/* What the ray has to find at the latest, and whether it may find anything. */
struct verdict {
    double nearest_sure; /* distance; infinite: it need not find anything */
    bool may_hit;
};

static double cells_of(const struct ldc_samples *s, const struct ray *ray, double distance)
{
    double size = 0;
    for (int k = 0; k < 3; k++)
        size = fmax(size, fabs((double)ray->direction_t_max[k]));
    return distance * size / s->cell;
}

static struct verdict judge(const struct fixture *fixture, float (*const normals[LDC_CUBES_MAX])[3],
                            const struct ray *ray)
{
    struct verdict verdict = {.nearest_sure = INFINITY};
    const double t_min = ray->origin_t_min[3], t_max = ray->direction_t_max[3];
    for (int which = 0; which < LDC_CUBES_MAX; which++) {
        const struct ldc_samples *s = &fixture->samples[which];
        if (s->count == 0)
            continue;
        const struct ray_in_cells in = in_cells(s, ray);
        const double margin = fabs(ROUNDING / cells_of(s, ray, 1));
        for (size_t i = 0; i < s->count; i++) {
            const struct intersection c = cross(s, &s->list[i], normals[which][i], &in);
            if (!(c.distance > t_min - margin && c.distance < t_max + margin))
                continue;
            verdict.may_hit = verdict.may_hit || (c.beyond < (double)LDC_SLACK + ROUNDING && !c.is_own);
            if (c.beyond < -ROUNDING && c.is_in_cube && c.is_surely_not_own && c.distance > t_min + margin &&
                c.distance < t_max - margin)
                verdict.nearest_sure = fmin(verdict.nearest_sure, c.distance);
        }
    }
    return verdict;
}

/* Of all rays, once the samples are sorted; how many have something to find. */
static uint32_t judge_all(const struct fixture *fixture, const struct ray *rays, uint32_t count,
                          struct verdict *verdicts)
{
    float(*normals[LDC_CUBES_MAX])[3];
    uint32_t hit_count = 0;
    for (int which = 0; which < LDC_CUBES_MAX; which++) {
        const struct ldc_samples *s = &fixture->samples[which];
        normals[which] = malloc((s->count + 1) * sizeof(*normals[which]));
        assert_non_null(normals[which]);
        for (size_t i = 0; i < s->count; i++)
            ldc_unpack_unit(normals[which][i], s->list[i].normal);
    }
    for (uint32_t i = 0; i < count; i++) {
        verdicts[i] = judge(fixture, normals, &rays[i]);
        hit_count += verdicts[i].nearest_sure < INFINITY;
    }
    for (int which = 0; which < LDC_CUBES_MAX; which++)
        free(normals[which]);
    return hit_count;
}

/* An intersection that was found is one, and there is no nearer one. */
static void expect_intersection(const struct fixture *fixture, const struct ray *ray, const struct hit *hit,
                                const struct verdict *verdict, const char *form, uint32_t number)
{
    if (hit->distance < 0) {
        if (verdict->nearest_sure < INFINITY)
            fail_msg("%s: ray %u misses what is at %g", form, number, verdict->nearest_sure);
        return;
    }
    assert_int_equal(hit->instance, HIT_NO_PRIMITIVE - 1);
    const uint32_t behind = fixture->store.cubes[LDC_CUBE_DYNAMIC].first_sample;
    const bool is_dynamic = fixture->samples[LDC_CUBE_DYNAMIC].resolution && hit->primitive >= behind;
    const struct ldc_samples *s = &fixture->samples[is_dynamic ? LDC_CUBE_DYNAMIC : LDC_CUBE_STATIC];
    const size_t index = hit->primitive - (is_dynamic ? behind : 0);
    assert_true(index < s->count);
    const struct ray_in_cells in = in_cells(s, ray);
    float normal[3];
    ldc_unpack_unit(normal, s->list[index].normal);
    const struct intersection c = cross(s, &s->list[index], normal, &in);
    /* A plane that is nearly along the ray multiplies what is rounded. */
    const double wrong = fabs(cells_of(s, ray, hit->distance - c.distance));
    if (!(c.beyond < (double)LDC_SLACK + 0.01 && !c.is_own && wrong < 0.05))
        fail_msg("%s: ray %u: sample %u at %g, which is met at %g, %g cells beyond its texel", form, number,
                 hit->primitive, (double)hit->distance, c.distance, c.beyond);
    if (cells_of(s, ray, hit->distance - verdict->nearest_sure) > 0.05)
        fail_msg("%s: ray %u hits at %g and not what is nearer, at %g", form, number, (double)hit->distance,
                 verdict->nearest_sure);
}

/* In every form, closest and any. `hits_min`: at least so many rays hit, so that something is tested. */
static void expect_like_brute_force(struct fixture *fixture, const struct ray *rays, uint32_t count,
                                    uint32_t hits_min)
{
    struct verdict *verdicts = malloc(count * sizeof(*verdicts));
    struct hit *hits = malloc(count * sizeof(*hits));
    uint32_t *visibility = malloc(count * sizeof(*visibility));
    for (size_t f = 0; f < FORM_COUNT; f++) {
        build(fixture, &forms[f].options);
        if (f == 0) /* now the samples are sorted */
            assert_true(judge_all(fixture, rays, count, verdicts) >= hits_min);
        trace(fixture, &forms[f].options, WAVE_CLOSEST, rays, count, hits, NULL);
        for (uint32_t i = 0; i < count; i++)
            expect_intersection(fixture, &rays[i], &hits[i], &verdicts[i], forms[f].name, i);
        trace(fixture, &forms[f].options, WAVE_ANY, rays, count, NULL, visibility);
        for (uint32_t i = 0; i < count; i++)
            if (visibility[i] == 0 ? !verdicts[i].may_hit : verdicts[i].nearest_sure < INFINITY)
                fail_msg("%s: ray %u is %s", forms[f].name, i,
                         visibility[i] ? "not stopped" : "stopped by nothing");
    }
    free(verdicts);
    free(hits);
    free(visibility);
}

/* From inside a box and around it, everywhere and in directions of any length; some end, some begin late. */
static void random_rays(struct ray *rays, uint32_t count, const struct ldc_samples *s, uint64_t seed)
{
    const float extent = s->cell * (float)s->resolution;
    for (uint32_t i = 0; i < count; i++) {
        float o[3], d[3], scale = i % 5 == 0 ? 1e-6f : i % 5 == 1 ? 1e5f : 1;
        for (int k = 0; k < 3; k++) {
            o[k] = s->lower[k] + extent * test_uniform(&seed, i % 2 ? 0 : -1, i % 2 ? 1 : 2);
            d[k] = scale * (s->lower[k] + extent * test_uniform(&seed, 0, 1) - o[k]);
        }
        rays[i] = ray_from(o, d, i % 7 == 0 ? 0.3f / scale : 0, i % 3 == 0 ? 0.7f / scale : FAR);
    }
}

/* ---- tests ---- */

ALL_TESTS(open_device, close_device)

TEST(rays_intersect_samples_as_by_brute_force)
{
    static const uint32_t resolutions[] = {97, 64, 33};
    struct ray *rays = malloc(RAY_COUNT * sizeof(*rays));
    for (size_t r = 0; r < sizeof(resolutions) / sizeof(*resolutions); r++) {
        struct fixture fixture;
        fixture_init(&fixture, NULL);
        struct ldc_samples *s = &fixture.samples[LDC_CUBE_STATIC];
        start_samples(s, resolutions[r], 4, -2, -1, -3);
        add_sphere(s, (const float[3]){0, 1, -1}, 1.2f, 24, 0);
        add_soup(s, 40, 0.6f, 5 + r);
        random_rays(rays, RAY_COUNT, s, 11 + r);
        expect_like_brute_force(&fixture, rays, RAY_COUNT, RAY_COUNT / 4);
        fixture_finish(&fixture);
    }
    free(rays);
}

TEST(two_cubes_are_traversed_as_one)
{
    struct ray *rays = malloc(RAY_COUNT * sizeof(*rays));
    struct fixture fixture;
    fixture_init(&fixture, NULL);
    start_samples(&fixture.samples[LDC_CUBE_STATIC], 70, 4, -2, -2, -2);
    add_soup(&fixture.samples[LDC_CUBE_STATIC], 30, 0.8f, 21);
    start_samples(&fixture.samples[LDC_CUBE_DYNAMIC], 45, 1.5f, -0.5f, 0.2f, -1);
    add_sphere(&fixture.samples[LDC_CUBE_DYNAMIC], (const float[3]){0.2f, 0.9f, -0.3f}, 0.6f, 16, 0);
    random_rays(rays, RAY_COUNT, &fixture.samples[LDC_CUBE_STATIC], 22);
    expect_like_brute_force(&fixture, rays, RAY_COUNT, RAY_COUNT / 8);
    fixture_finish(&fixture);
    /* And where only what moves is there. */
    fixture_init(&fixture, NULL);
    start_samples(&fixture.samples[LDC_CUBE_DYNAMIC], 45, 4, -2, -2, -2);
    add_soup(&fixture.samples[LDC_CUBE_DYNAMIC], 30, 0.8f, 23);
    random_rays(rays, RAY_COUNT, &fixture.samples[LDC_CUBE_DYNAMIC], 24);
    expect_like_brute_force(&fixture, rays, RAY_COUNT, RAY_COUNT / 8);
    fixture_finish(&fixture);
    free(rays);
}

/* Sheets that all pass the same cells, and rays that go along between them without a hit: what a dispatch must
 * have time for (trace_rays_a_dispatch). */
TEST(no_ray_takes_more_rounds_than_the_structure_allows)
{
    enum { sheets = 40, resolution = 64 };
    struct ray *rays = malloc(RAY_COUNT * sizeof(*rays));
    struct hit *counts = malloc(RAY_COUNT * sizeof(*counts));
    struct fixture fixture;
    uint64_t seed = 31;
    fixture_init(&fixture, NULL);
    struct ldc_samples *s = &fixture.samples[LDC_CUBE_STATIC];
    start_samples(s, resolution, resolution, 0, 0, 0);
    for (int i = 0; i < sheets; i++) {
        const float y = 32.1f + 0.02f * (float)i;
        add_quad(s, (const float[3]){1, y, 1}, (const float[3]){63, y, 1}, (const float[3]){63, y, 63},
                 (const float[3]){1, y, 63}, 0);
    }
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        const float o[3] = {-1, 32.11f + 0.02f * (float)(i % (sheets - 1)), test_uniform(&seed, 2, 62)};
        rays[i] = ray_from(o, (const float[3]){1, 0, test_uniform(&seed, -0.9f, 0.9f)}, 0, FAR);
    }
    for (size_t f = 0; f < FORM_COUNT; f++) {
        struct tracer_options options = forms[f].options;
        uint32_t tests_max = 0;
        build(&fixture, &options);
        fixture.store.cubes[LDC_CUBE_STATIC].layers_kept = sheets;
        options.bench.ldc_count_steps = 1;
        trace(&fixture, &options, WAVE_CLOSEST, rays, RAY_COUNT, counts, NULL);
        for (uint32_t i = 0; i < RAY_COUNT; i++) {
            const uint64_t rounds = (uint64_t)counts[i].distance + counts[i].primitive;
            if (rounds > ldc_rounds_of_a_ray(&fixture.store))
                fail_msg("%s: ray %u takes %llu rounds", forms[f].name, i, (unsigned long long)rounds);
            tests_max = counts[i].primitive > tests_max ? counts[i].primitive : tests_max;
        }
        assert_true(tests_max >= sheets * resolution / 2);
    }
    fixture_finish(&fixture);
    free(rays);
    free(counts);
}

/* A few samples that stand still, and behind them more that move than this device has room for in cells. */
TEST(where_cells_do_not_fit_a_pyramid_is_traversed)
{
    struct ray *rays = malloc(RAY_COUNT * sizeof(*rays));
    struct fixture fixture;
    fixture_init(&fixture, NULL);
    start_samples(&fixture.samples[LDC_CUBE_STATIC], 40, 4, -2, -2, -2);
    add_soup(&fixture.samples[LDC_CUBE_STATIC], 3, 0.8f, 25);
    start_samples(&fixture.samples[LDC_CUBE_DYNAMIC], 70, 4, -2, -2, -2);
    add_sphere(&fixture.samples[LDC_CUBE_DYNAMIC], (const float[3]){0.2f, 0.1f, -0.3f}, 1.4f, 20, 0);
    random_rays(rays, RAY_COUNT, &fixture.samples[LDC_CUBE_DYNAMIC], 26);
    build(&fixture, &forms[0].options);
    assert_false(fixture.store.no_cells);
    const uint64_t texels_max = device->facts.texture_buffer_texels_max;
    device->facts.texture_buffer_texels_max = 4ull * fixture.store.cubes[LDC_CUBE_DYNAMIC].entry_count;
    build_levels(&fixture, LDC_CUBE_STATIC, &forms[0].options);
    assert_false(fixture.store.no_cells);
    build_levels(&fixture, LDC_CUBE_DYNAMIC, &forms[0].options);
    assert_true(fixture.store.no_cells);
    expect_like_brute_force(&fixture, rays, RAY_COUNT, RAY_COUNT / 8);
    device->facts.texture_buffer_texels_max = texels_max;
    expect_like_brute_force(&fixture, rays, RAY_COUNT, RAY_COUNT / 8);
    assert_false(fixture.store.no_cells);
    fixture_finish(&fixture);
    free(rays);
}

/* Planes that lean as much to one axis as to another, so close to each other that all pass the same cells: nothing
 * is lost of them, and nothing is there twice. */
TEST(what_shares_cells_is_in_each_of_them_once)
{
    const int layers = 12;
    const float n = 24;
    struct error error = {0};
    struct fixture fixture;
    fixture_init(&fixture, NULL);
    struct ldc_samples *s = &fixture.samples[LDC_CUBE_STATIC];
    start_samples(s, 24, n, 0, 0, 0);
    for (int i = 0; i < layers; i++) {
        /* Where u and v are a texel's middle the depth is nearly a whole number: four cells are passed. */
        const float c = n + 0.006f * (float)i;
        const float corners[3][3] = {{c - 4, 2, 2}, {2, c - 4, 2}, {2, 2, c - 4}};
        ldc_add_triangle(s, corners, 0);
    }
    build(&fixture, &(struct tracer_options){.ldc = {.levels = LDC_LEVELS_CELLS}});
    const struct ldc_cube *cube = &fixture.store.cubes[LDC_CUBE_STATIC];
    uint32_t(*entries)[4] = malloc(cube->entry_count * sizeof(*entries));
    uint32_t *times = calloc(s->count, sizeof(*times));
    gpu_buffer_read(device, &fixture.store.entries, 0, entries, cube->entry_count * sizeof(*entries));
    expect_ok(gpu_check(device, "entries", &error), &error);
    for (uint32_t i = 0; i < cube->entry_count; i++) {
        const uint32_t sample = entries[i][0] & LDC_ENTRY_SAMPLE_MASK;
        assert_true(sample < s->count);
        times[sample]++;
    }
    for (size_t i = 0; i < s->count; i++)
        if (times[i] != 4)
            fail_msg("sample %zu is in %u cells", i, times[i]);
    free(entries);
    free(times);
    fixture_finish(&fixture);
}

/* What the cells of a cube hold, in an order in which places do not matter: of each the samples as its list has
 * them, and where it is; of an empty node how far it is empty around it. */
static uint32_t list_cells(struct fixture *fixture, unsigned which, uint32_t (*listed)[4], uint32_t listed_max)
{
    const struct ldc_store *store = &fixture->store;
    const struct ldc_cube *cube = &store->cubes[which];
    const uint32_t node_total = cube->first_node + cube->node_count;
    const uint32_t entry_total = cube->first_entry + cube->entry_count;
    uint32_t(*nodes)[4] = malloc(node_total * sizeof(*nodes)),
    (*entries)[4] = malloc(entry_total * sizeof(*nodes));
    const uint32_t grid = (cube->resolution + (1u << LDC_NODE_SHIFT) - 1) >> LDC_NODE_SHIFT;
    uint32_t count = 0;
    gpu_buffer_read(device, &store->nodes, 0, nodes, node_total * sizeof(*nodes));
    gpu_buffer_read(device, &store->entries, 0, entries, entry_total * sizeof(*entries));
    for (uint32_t node = 0; node < grid * grid * grid; node++) {
        const uint32_t *of_node = nodes[cube->first_node + node];
        if ((of_node[0] | of_node[1]) == 0) {
            assert_true(count < listed_max);
            const uint32_t empty[4] = {0, node, of_node[2], UINT32_MAX};
            memcpy(listed[count++], empty, sizeof(empty));
        }
        for (uint32_t part = 0, block = of_node[2]; part < 64; part++) {
            if ((of_node[part / 32] >> part % 32 & 1u) == 0)
                continue;
            for (uint32_t cell = 0, first = nodes[block][2]; cell < 64; cell++) {
                if ((nodes[block][cell / 32] >> cell % 32 & 1u) == 0)
                    continue;
                uint32_t at = first++;
                do {
                    assert_true(at < entry_total && count < listed_max);
                    memcpy(listed[count], entries[at], sizeof(listed[count]));
                    listed[count++][1] = node << 12 | part << 6 | cell;
                    at = entries[at][1];
                } while (at != 0);
            }
            block++;
        }
    }
    free(nodes);
    free(entries);
    return count;
}

TEST(host_and_device_make_the_same_cells)
{
    const struct tracer_options by_host = {.ldc = {0}}, on_device = {.bench = {.ldc_on_device = 1}};
    struct fixture fixture;
    fixture_init(&fixture, NULL);
    start_samples(&fixture.samples[LDC_CUBE_STATIC], 70, 4, -2, -2, -2);
    add_soup(&fixture.samples[LDC_CUBE_STATIC], 60, 0.8f, 31);
    start_samples(&fixture.samples[LDC_CUBE_DYNAMIC], 97, 4, -2, -2, -2);
    add_sphere(&fixture.samples[LDC_CUBE_DYNAMIC], (const float[3]){0.2f, 0.1f, -0.3f}, 1.4f, 20, 0);
    add_soup(&fixture.samples[LDC_CUBE_DYNAMIC], 60, 0.8f, 32);
    for (unsigned which = 0; which < LDC_CUBES_MAX; which++) {
        build(&fixture, &by_host);
        const struct ldc_cube *cube = &fixture.store.cubes[which];
        const uint32_t entries = cube->entry_count, most = entries + cube->node_count;
        uint32_t(*host)[4] = malloc(most * sizeof(*host)), (*shaders)[4] = malloc(most * sizeof(*shaders));
        const uint32_t count = list_cells(&fixture, which, host, most);
        assert_in_range(count, entries + 1, most);
        build(&fixture, &on_device);
        assert_int_equal(cube->entry_count, entries);
        assert_int_equal(list_cells(&fixture, which, shaders, most), count);
        assert_memory_equal(host, shaders, count * sizeof(*host));
        free(host);
        free(shaders);
    }
    fixture_finish(&fixture);
}

/* Blocks over more samples than software GL lets a loop go round, and what is last of them is the only thing that
 * is far. */
TEST(blocks_of_many_layers_hold_all_of_them)
{
    static const float up[3] = {0, 0, 1};
    enum { n = 64, layers = 100, rays_along = 8 };
    struct ray rays[rays_along * rays_along];
    struct fixture fixture;
    fixture_init(&fixture, NULL);
    struct ldc_samples *s = &fixture.samples[LDC_CUBE_STATIC];
    start_samples(s, n, n, 0, 0, 0);
    for (uint32_t v = 0; v < n; v++)
        for (uint32_t u = 0; u < n; u++)
            for (int i = 0; i < layers; i++)
                ldc_add_sample(s, 2, u, v, (v % 32 < 28 ? 5.0f : 40.0f) + 0.1f * (float)i, up, 0);
    for (int i = 0; i < rays_along * rays_along; i++) {
        const float step = (float)n / rays_along;
        const float o[3] = {step * ((float)(i % rays_along) + 0.4f), step * ((float)(i / rays_along) + 0.9f), 30};
        const float d[3] = {0.01f, 0.02f, 1};
        rays[i] = ray_from(o, d, 0, FAR);
    }
    expect_like_brute_force(&fixture, rays, rays_along * rays_along, rays_along * 2);
    fixture_finish(&fixture);
}

/* Along axes through the middles of texels, along their borders, through corners, and nearly so. */
TEST(rays_along_axes_and_borders_intersect_samples_as_by_brute_force)
{
    struct ray *rays = malloc(RAY_COUNT * sizeof(*rays));
    struct fixture fixture;
    uint64_t seed = 31;
    fixture_init(&fixture, NULL);
    struct ldc_samples *s = &fixture.samples[LDC_CUBE_STATIC];
    start_samples(s, 48, 48, 0, 0, 0);
    add_sphere(s, (const float[3]){24, 24, 24}, 15, 20, 0);
    add_soup(s, 20, 8, 33);
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        float o[3], d[3];
        for (int k = 0; k < 3; k++) {
            o[k] = floorf(test_uniform(&seed, -10, 58)) + (i & 1 ? 0.5f : 0);
            d[k] = floorf(test_uniform(&seed, -1, 2));
        }
        if (d[0] == 0 && d[1] == 0 && d[2] == 0)
            d[i % 3] = -1;
        if (i % 4 >= 2)
            d[i % 3] += test_uniform(&seed, -1e-7f, 1e-7f);
        rays[i] = ray_from(o, d, 0, FAR);
    }
    expect_like_brute_force(&fixture, rays, RAY_COUNT, RAY_COUNT / 16);
    fixture_finish(&fixture);
    free(rays);
}

/* Samples in the outermost texels and depths, a floor that lies in the cube's own side. */
TEST(what_lies_in_the_sides_of_the_cube_is_hit)
{
    struct ray *rays = malloc(RAY_COUNT * sizeof(*rays));
    struct hit *hits = malloc(RAY_COUNT * sizeof(*hits));
    struct fixture fixture;
    uint64_t seed = 41;
    fixture_init(&fixture, NULL);
    struct ldc_samples *s = &fixture.samples[LDC_CUBE_STATIC];
    start_samples(s, 37, 37, 0, 0, 0);
    add_box(s, (const float[3]){0, 0, 0}, (const float[3]){37, 37, 37}, 0);
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        float o[3], d[3];
        for (int k = 0; k < 3; k++) {
            o[k] = test_uniform(&seed, 10, 27);
            d[k] = test_uniform(&seed, -1, 1);
        }
        rays[i] = ray_from(o, d, 0, FAR);
    }
    for (size_t f = 0; f < FORM_COUNT; f++) {
        build(&fixture, &forms[f].options);
        trace(&fixture, &forms[f].options, WAVE_CLOSEST, rays, RAY_COUNT, hits, NULL);
        for (uint32_t i = 0; i < RAY_COUNT; i++) {
            double exit = INFINITY, size = 0;
            for (int k = 0; k < 3; k++) {
                const double d = rays[i].direction_t_max[k], o = rays[i].origin_t_min[k];
                exit = fmin(exit, ((d > 0 ? 37 : 0) - o) / d);
                size = fmax(size, fabs(d));
            }
            /* The cells are as long as the unit. These samples have no triangles, so planes stand for them. */
            const double before = exit - hits[i].distance;
            if (!(before >= -1e-4 * exit && before <= 1e-4 * exit + (double)LDC_STANDS_BEFORE / size))
                fail_msg("%s: ray %u leaves at %g, not at %g", forms[f].name, i, exit, (double)hits[i].distance);
        }
    }
    fixture_finish(&fixture);
    free(rays);
    free(hits);
}

/* ---- the paper's test ---- */

/* With a tolerance a hit is where the ray comes as near to a sample's depth, in its texel: rays straight down on a
 * slope meet samples' own depths; a tolerance of nearly nothing is passed by rays that are aslant. */
TEST(a_tolerance_takes_depths_for_planes)
{
    struct ray *rays = malloc(RAY_COUNT * sizeof(*rays));
    struct hit *hits = malloc(RAY_COUNT * sizeof(*hits));
    struct fixture fixture;
    uint64_t seed = 101;
    fixture_init(&fixture, NULL);
    struct ldc_samples *s = &fixture.samples[LDC_CUBE_STATIC];
    start_samples(s, 50, 50, 0, 0, 0);
    add_quad(s, (const float[3]){1, 1, 10}, (const float[3]){49, 1, 34}, (const float[3]){49, 49, 34},
             (const float[3]){1, 49, 10}, 0); /* z = 9.5 + x / 2 */
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        const float o[3] = {test_uniform(&seed, 5, 45), test_uniform(&seed, 5, 45), 60};
        rays[i] = ray_from(o, (const float[3]){0, 0, -1}, 0, FAR);
    }
    const struct tracer_options kinds[] = {{.ldc = {.tolerance = 0.01f}},
                                           {.ldc = {.tolerance = 0.01f, .levels = LDC_LEVELS_BLOCKS, .block = 8}},
                                           {.ldc = {.tolerance = 0.01f}, .bench = {.ldc_layers_together = 1}}};
    for (size_t f = 0; f < sizeof(kinds) / sizeof(*kinds); f++) {
        build(&fixture, &kinds[f]);
        trace(&fixture, &kinds[f], WAVE_CLOSEST, rays, RAY_COUNT, hits, NULL);
        for (uint32_t i = 0; i < RAY_COUNT; i++) {
            const float middle = floorf(rays[i].origin_t_min[0]) + 0.5f;
            if (fabsf(hits[i].distance - (60 - 9.5f - middle / 2)) > 1e-3f)
                fail_msg("kind %zu: ray %u at %g meets depth %g", f, i, (double)rays[i].origin_t_min[0],
                         60 - (double)hits[i].distance);
        }
    }
    /* Along the slope, half a cell above: within a tolerance of a cell, and not within one of a tenth. */
    for (uint32_t i = 0; i < RAY_COUNT; i++)
        rays[i] =
            ray_from((const float[3]){2, test_uniform(&seed, 5, 45), 11.5f}, (const float[3]){1, 0, 0.5f}, 0, FAR);
    for (int wide = 0; wide < 2; wide++) {
        const struct tracer_options options = {.ldc.tolerance = wide ? 1.5f : 0.1f};
        build(&fixture, &options);
        trace(&fixture, &options, WAVE_CLOSEST, rays, RAY_COUNT, hits, NULL);
        for (uint32_t i = 0; i < RAY_COUNT; i++)
            assert_true((hits[i].distance >= 0) == (wide == 1));
    }
    fixture_finish(&fixture);
    free(rays);
    free(hits);
}
