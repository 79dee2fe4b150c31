/* SPDX-License-Identifier: MIT */
/* The walk through layered depth cubes against brute force over all samples of cubes made on the CPU: every form
 * of levels, of rays and of layers together. What is a crossing is the shader's rule (ldc/cube.glsl) in doubles;
 * where it hangs on rounding whether one counts, either answer is taken, see judge(). */
#include "tests/accuracy/test_scenes.h"
#include "tests/unit/ldc_samples.h"

#include "gpu/device.h"
#include "shared/hit.h"
#include "shared/ray.h"
#include "trace/ldc_levels.h"
#include "trace/ldc_trace.h"

#include <float.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#define RAY_COUNT 4096u
#define PI_F 3.14159265f
#define FAR 1e30f
/* ldc/plane.glsl, ldc/cube.glsl */
#define SLACK 0.05
#define OWN_WAY 1.5
#define OWN_BEHIND 0.5
#define OWN_BEFORE 0.2
/* Cells: what floats round of places in cubes of some hundred cells, and of rays that begin some hundred away. */
#define ROUNDING 1e-3

static struct gpu_device *device;

static const struct form {
    const char *name;
    struct tracer_options options;
} forms[] = {
    {"cells", {0}},
    {"cells, 4 rays", {.ldc_rays_together = 4}},
    {"pyramid", {.ldc_levels = LDC_LEVELS_PYRAMID}},
    {"pyramid, 4 rays, layers one by one",
     {.ldc_levels = LDC_LEVELS_PYRAMID, .ldc_rays_together = 4, .ldc_layers_together = 1}},
    {"blocks of 8", {.ldc_levels = LDC_LEVELS_BLOCKS}},
    {"blocks of 2, 4 rays", {.ldc_levels = LDC_LEVELS_BLOCKS, .ldc_block = 2, .ldc_rays_together = 4}},
    {"blocks of 32, layers one by one",
     {.ldc_levels = LDC_LEVELS_BLOCKS, .ldc_block = 32, .ldc_layers_together = 1}},
};
#define FORM_COUNT (sizeof forms / sizeof *forms)

/* ---- what is walked ---- */

struct fixture {
    struct scene *scene;
    struct scene_gpu gpu; /* has the materials, and no geometry that a tracer would see */
    struct ldc_store store;
    struct ldc_samples samples[TRACER_CUBES_MAX];
};

static void expect_ok(bool ok, const struct error *error)
{
    if (!ok)
        fail_msg("%s: %s", error->field, error->text);
}

static void start_samples(struct ldc_samples *s, uint32_t resolution, float size, float x, float y, float z)
{
    *s = (struct ldc_samples){.lower = {x, y, z}, .cell = size / (float)resolution, .resolution = resolution};
}

static void fixture_init(struct fixture *fixture, struct scene *scene)
{
    struct error error = {0};
    struct scene_changes changes;
    *fixture = (struct fixture){.scene = scene ? scene : test_scene_create()};
    scene_gpu_init(&fixture->gpu, device);
    expect_ok(scene_gpu_update(&fixture->gpu, fixture->scene, NULL, &changes, NULL, &error), &error);
    ldc_store_init(&fixture->store, device);
}

static void fixture_finish(struct fixture *fixture)
{
    ldc_store_finish(&fixture->store);
    scene_gpu_finish(&fixture->gpu);
    scene_destroy(fixture->scene);
    for (int i = 0; i < TRACER_CUBES_MAX; i++)
        free(fixture->samples[i].list);
}

/* The samples of both cubes, sorted, and their nodes in a form. */
static void build(struct fixture *fixture, const struct tracer_options *options)
{
    struct error error = {0};
    for (unsigned i = 0; i < TRACER_CUBES_MAX; i++)
        if (fixture->samples[i].resolution)
            expect_ok(ldc_upload(&fixture->samples[i], &fixture->store, i, &error), &error);
    for (unsigned i = 0; i < TRACER_CUBES_MAX; i++)
        expect_ok(ldc_levels_build(&fixture->store, i, options, &error), &error);
}

static void trace(struct fixture *fixture, const struct tracer_options *options, enum wave_kind kind,
                  const struct ray *rays, uint32_t count, struct hit *hits, uint32_t *visibility)
{
    struct error error = {0};
    struct gpu_buffer ray_buffer = {0}, answers = {0};
    expect_ok(gpu_buffer_upload(device, &ray_buffer, rays, count * sizeof *rays, &error), &error);
    expect_ok(gpu_buffer_reserve(device, &answers, count * sizeof *hits, &error), &error);
    const struct wave wave = {.kind = kind,
                              .ray_count = count,
                              .rays = &ray_buffer,
                              .hits = &answers,
                              .visibility = &answers,
                              .crossings_only = true};
    scene_gpu_bind(&fixture->gpu);
    expect_ok(ldc_trace(&fixture->store, &fixture->gpu, &wave, options, &error), &error);
    if (kind == WAVE_ANY)
        gpu_buffer_read(device, &answers, 0, visibility, count * sizeof *visibility);
    else
        gpu_buffer_read(device, &answers, 0, hits, count * sizeof *hits);
    expect_ok(gpu_check(device, "the walk", &error), &error);
    gpu_buffer_finish(device, &ray_buffer);
    gpu_buffer_finish(device, &answers);
}

static void add_quad(struct ldc_samples *s, const float a[3], const float b[3], const float c[3], const float d[3],
                     uint32_t material)
{
    const float first[3][3] = {{a[0], a[1], a[2]}, {b[0], b[1], b[2]}, {c[0], c[1], c[2]}};
    const float second[3][3] = {{a[0], a[1], a[2]}, {c[0], c[1], c[2]}, {d[0], d[1], d[2]}};
    ldc_add_triangle(s, first, material);
    ldc_add_triangle(s, second, material);
}

static void on_sphere(float p[3], const float centre[3], float radius, float theta, float phi)
{
    p[0] = centre[0] + radius * sinf(theta) * cosf(phi);
    p[1] = centre[1] + radius * cosf(theta);
    p[2] = centre[2] + radius * sinf(theta) * sinf(phi);
}

static void add_sphere(struct ldc_samples *s, const float centre[3], float radius, int steps, uint32_t material)
{
    for (int i = 0; i < steps; i++) {
        for (int j = 0; j < 2 * steps; j++) {
            float p[4][3];
            for (int k = 0; k < 4; k++)
                on_sphere(p[k], centre, radius, PI_F * (float)(i + (k == 1 || k == 2)) / (float)steps,
                          PI_F * (float)(j + (k >= 2)) / (float)steps);
            add_quad(s, p[0], p[3], p[2], p[1], material);
        }
    }
}

/* Outside is outside. */
static void add_box(struct ldc_samples *s, const float lower[3], const float upper[3], uint32_t material)
{
    for (int side = 0; side < 6; side++) {
        const int axis = side / 2, u = (axis + 1) % 3, v = (axis + 2) % 3;
        float p[4][3];
        for (int k = 0; k < 4; k++) {
            p[k][axis] = side % 2 ? upper[axis] : lower[axis];
            p[k][u] = (k == 1 || k == 2) == (side % 2 == 1) ? upper[u] : lower[u];
            p[k][v] = k >= 2 ? upper[v] : lower[v];
        }
        add_quad(s, p[0], p[1], p[2], p[3], material);
    }
}

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

/* Of one sample: where a ray crosses its plane. */
struct crossing {
    double distance; /* in lengths of the direction; no number: not at all */
    double beyond;   /* cells: how far outside of the texel, <= 0: inside */
    bool is_in_cube; /* not only the sample is */
    bool is_own, is_surely_not_own;
};

static struct crossing cross(const struct ldc_samples *s, const struct ldc_sample *sample, const struct ray *ray)
{
    const uint32_t n = s->resolution, axis = sample->texel / (n * n), iu = (axis + 1) % 3, iv = (axis + 2) % 3;
    double o[3], d[3], to[3], height = 0, slope = 0, size = 0;
    float normal[3];
    ldc_unpack_unit(normal, sample->normal);
    for (int k = 0; k < 3; k++)
        size = fmax(size, fabs((double)ray->direction_t_max[k]));
    for (int k = 0; k < 3; k++) {
        o[k] = ((double)ray->origin_t_min[k] - s->lower[k]) / s->cell;
        d[k] = ray->direction_t_max[k] / size;
    }
    to[iu] = (double)(sample->texel % n) + 0.5 - o[iu];
    to[iv] = (double)(sample->texel / n % n) + 0.5 - o[iv];
    to[axis] = (double)sample->depth - o[axis];
    for (int k = 0; k < 3; k++) {
        height += normal[k] * to[k];
        slope += normal[k] * d[k];
    }
    const double along = height / slope, own = slope > 0 ? OWN_BEHIND : OWN_BEFORE;
    struct crossing c = {.distance = along * s->cell / size};
    c.beyond = fmax(fabs(along * d[iu] - to[iu]), fabs(along * d[iv] - to[iv])) - 0.5;
    c.is_in_cube = along * d[axis] + o[axis] > 0 && along * d[axis] + o[axis] < n;
    c.is_own = along < OWN_WAY - ROUNDING && fabs(height) < own - ROUNDING;
    c.is_surely_not_own = along > OWN_WAY + ROUNDING || fabs(height) > own + ROUNDING;
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

static struct verdict judge(const struct fixture *fixture, const struct ray *ray)
{
    struct verdict verdict = {.nearest_sure = INFINITY};
    const double t_min = ray->origin_t_min[3], t_max = ray->direction_t_max[3];
    for (int which = 0; which < TRACER_CUBES_MAX; which++) {
        const struct ldc_samples *s = &fixture->samples[which];
        for (size_t i = 0; i < s->count; i++) {
            const struct crossing c = cross(s, &s->list[i], ray);
            const double margin = fabs(ROUNDING / cells_of(s, ray, 1));
            if (!(c.distance > t_min - margin && c.distance < t_max + margin))
                continue;
            verdict.may_hit = verdict.may_hit || (c.beyond < SLACK + ROUNDING && !c.is_own);
            if (c.beyond < -ROUNDING && c.is_in_cube && c.is_surely_not_own && c.distance > t_min + margin &&
                c.distance < t_max - margin)
                verdict.nearest_sure = fmin(verdict.nearest_sure, c.distance);
        }
    }
    return verdict;
}

/* A crossing that was found is one, and there is no nearer one. */
static void expect_crossing(const struct fixture *fixture, const struct ray *ray, const struct hit *hit,
                            const struct verdict *verdict, const char *form, uint32_t number)
{
    if (hit->distance < 0) {
        if (verdict->nearest_sure < INFINITY)
            fail_msg("%s: ray %u misses what is at %g", form, number, verdict->nearest_sure);
        return;
    }
    assert_int_equal(hit->instance, HIT_NO_PRIMITIVE - 1);
    const uint32_t behind = fixture->store.cubes[TRACER_CUBE_DYNAMIC].first_sample;
    const bool is_dynamic = fixture->samples[TRACER_CUBE_DYNAMIC].resolution && hit->primitive >= behind;
    const struct ldc_samples *s = &fixture->samples[is_dynamic ? TRACER_CUBE_DYNAMIC : TRACER_CUBE_STATIC];
    const size_t index = hit->primitive - (is_dynamic ? behind : 0);
    assert_true(index < s->count);
    const struct crossing c = cross(s, &s->list[index], ray);
    /* A plane that is nearly along the ray multiplies what is rounded. */
    const double wrong = fabs(cells_of(s, ray, hit->distance - c.distance));
    if (!(c.beyond < SLACK + 0.01 && !c.is_own && wrong < 0.05))
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
    struct verdict *verdicts = malloc(count * sizeof *verdicts);
    struct hit *hits = malloc(count * sizeof *hits);
    uint32_t *visibility = malloc(count * sizeof *visibility), hit_count = 0;
    for (size_t f = 0; f < FORM_COUNT; f++) {
        build(fixture, &forms[f].options);
        if (f == 0) { /* now the samples are sorted */
            for (uint32_t i = 0; i < count; i++) {
                verdicts[i] = judge(fixture, &rays[i]);
                hit_count += verdicts[i].nearest_sure < INFINITY;
            }
            assert_true(hit_count >= hits_min);
        }
        trace(fixture, &forms[f].options, WAVE_CLOSEST, rays, count, hits, NULL);
        for (uint32_t i = 0; i < count; i++)
            expect_crossing(fixture, &rays[i], &hits[i], &verdicts[i], forms[f].name, i);
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

/* ---- rays ---- */

static struct ray ray_from(const float origin[3], const float direction[3], float t_min, float t_max)
{
    return (struct ray){.origin_t_min = {origin[0], origin[1], origin[2], t_min},
                        .direction_t_max = {direction[0], direction[1], direction[2], t_max}};
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

static void rays_cross_samples_as_by_brute_force(void **state)
{
    (void)state;
    static const uint32_t resolutions[] = {97, 64, 33};
    struct ray *rays = malloc(RAY_COUNT * sizeof *rays);
    for (size_t r = 0; r < sizeof resolutions / sizeof *resolutions; r++) {
        struct fixture fixture;
        fixture_init(&fixture, NULL);
        struct ldc_samples *s = &fixture.samples[TRACER_CUBE_STATIC];
        start_samples(s, resolutions[r], 4, -2, -1, -3);
        add_sphere(s, (const float[3]){0, 1, -1}, 1.2f, 24, 0);
        add_soup(s, 40, 0.6f, 5 + r);
        random_rays(rays, RAY_COUNT, s, 11 + r);
        expect_like_brute_force(&fixture, rays, RAY_COUNT, RAY_COUNT / 4);
        fixture_finish(&fixture);
    }
    free(rays);
}

static void two_cubes_are_walked_as_one(void **state)
{
    (void)state;
    struct ray *rays = malloc(RAY_COUNT * sizeof *rays);
    struct fixture fixture;
    fixture_init(&fixture, NULL);
    start_samples(&fixture.samples[TRACER_CUBE_STATIC], 70, 4, -2, -2, -2);
    add_soup(&fixture.samples[TRACER_CUBE_STATIC], 30, 0.8f, 21);
    start_samples(&fixture.samples[TRACER_CUBE_DYNAMIC], 45, 1.5f, -0.5f, 0.2f, -1);
    add_sphere(&fixture.samples[TRACER_CUBE_DYNAMIC], (const float[3]){0.2f, 0.9f, -0.3f}, 0.6f, 16, 0);
    random_rays(rays, RAY_COUNT, &fixture.samples[TRACER_CUBE_STATIC], 22);
    expect_like_brute_force(&fixture, rays, RAY_COUNT, RAY_COUNT / 8);
    fixture_finish(&fixture);
    /* And where only what moves is there. */
    fixture_init(&fixture, NULL);
    start_samples(&fixture.samples[TRACER_CUBE_DYNAMIC], 45, 4, -2, -2, -2);
    add_soup(&fixture.samples[TRACER_CUBE_DYNAMIC], 30, 0.8f, 23);
    random_rays(rays, RAY_COUNT, &fixture.samples[TRACER_CUBE_DYNAMIC], 24);
    expect_like_brute_force(&fixture, rays, RAY_COUNT, RAY_COUNT / 8);
    fixture_finish(&fixture);
    free(rays);
}

/* A few samples that stand still, and behind them more that move than this device has room for in cells. */
static void where_cells_do_not_fit_a_pyramid_is_walked(void **state)
{
    (void)state;
    struct ray *rays = malloc(RAY_COUNT * sizeof *rays);
    struct error error = {0};
    struct fixture fixture;
    fixture_init(&fixture, NULL);
    start_samples(&fixture.samples[TRACER_CUBE_STATIC], 40, 4, -2, -2, -2);
    add_soup(&fixture.samples[TRACER_CUBE_STATIC], 3, 0.8f, 25);
    start_samples(&fixture.samples[TRACER_CUBE_DYNAMIC], 70, 4, -2, -2, -2);
    add_sphere(&fixture.samples[TRACER_CUBE_DYNAMIC], (const float[3]){0.2f, 0.1f, -0.3f}, 1.4f, 20, 0);
    random_rays(rays, RAY_COUNT, &fixture.samples[TRACER_CUBE_DYNAMIC], 26);
    build(&fixture, &forms[0].options);
    assert_false(fixture.store.no_cells);
    const uint64_t texels_max = device->facts.texture_buffer_texels_max;
    device->facts.texture_buffer_texels_max = 4ull * fixture.store.cubes[TRACER_CUBE_DYNAMIC].entry_count;
    assert_true(ldc_levels_build(&fixture.store, TRACER_CUBE_STATIC, &forms[0].options, &error));
    assert_false(fixture.store.no_cells);
    assert_true(ldc_levels_build(&fixture.store, TRACER_CUBE_DYNAMIC, &forms[0].options, &error));
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
static void what_shares_cells_is_in_each_of_them_once(void **state)
{
    (void)state;
    const int layers = 12;
    const float n = 24;
    struct error error = {0};
    struct fixture fixture;
    fixture_init(&fixture, NULL);
    struct ldc_samples *s = &fixture.samples[TRACER_CUBE_STATIC];
    start_samples(s, 24, n, 0, 0, 0);
    for (int i = 0; i < layers; i++) {
        /* Where u and v are a texel's middle the depth is nearly a whole number: four cells are passed. */
        const float c = n + 0.006f * (float)i;
        const float corners[3][3] = {{c - 4, 2, 2}, {2, c - 4, 2}, {2, 2, c - 4}};
        ldc_add_triangle(s, corners, 0);
    }
    build(&fixture, &(struct tracer_options){.ldc_levels = LDC_LEVELS_CELLS});
    const struct ldc_cube *cube = &fixture.store.cubes[TRACER_CUBE_STATIC];
    uint32_t(*entries)[4] = malloc(cube->entry_count * sizeof *entries);
    uint32_t *times = calloc(s->count, sizeof *times);
    gpu_buffer_read(device, &fixture.store.entries, 0, entries, cube->entry_count * sizeof *entries);
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

/* Blocks over more samples than software GL lets a loop go round, and what is last of them is the only thing that
 * is far. */
static void blocks_of_many_layers_hold_all_of_them(void **state)
{
    (void)state;
    static const float up[3] = {0, 0, 1};
    enum { n = 64, layers = 100, rays_along = 8 };
    struct ray rays[rays_along * rays_along];
    struct fixture fixture;
    fixture_init(&fixture, NULL);
    struct ldc_samples *s = &fixture.samples[TRACER_CUBE_STATIC];
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
static void rays_along_axes_and_borders_cross_samples_as_by_brute_force(void **state)
{
    (void)state;
    struct ray *rays = malloc(RAY_COUNT * sizeof *rays);
    struct fixture fixture;
    uint64_t seed = 31;
    fixture_init(&fixture, NULL);
    struct ldc_samples *s = &fixture.samples[TRACER_CUBE_STATIC];
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
static void what_lies_in_the_sides_of_the_cube_is_hit(void **state)
{
    (void)state;
    struct ray *rays = malloc(RAY_COUNT * sizeof *rays);
    struct hit *hits = malloc(RAY_COUNT * sizeof *hits);
    struct fixture fixture;
    uint64_t seed = 41;
    fixture_init(&fixture, NULL);
    struct ldc_samples *s = &fixture.samples[TRACER_CUBE_STATIC];
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
            double exit = INFINITY;
            for (int k = 0; k < 3; k++) {
                const double d = rays[i].direction_t_max[k], o = rays[i].origin_t_min[k];
                exit = fmin(exit, ((d > 0 ? 37 : 0) - o) / d);
            }
            if (!(fabs(hits[i].distance - exit) <= 1e-4 * exit))
                fail_msg("%s: ray %u leaves at %g, not at %g", forms[f].name, i, exit, (double)hits[i].distance);
        }
    }
    fixture_finish(&fixture);
    free(rays);
    free(hits);
}

static void directions_that_are_none_and_dead_rays_hit_nothing(void **state)
{
    (void)state;
    const float bad[] = {NAN, INFINITY, -INFINITY, 0, 1e-42f, FLT_MAX};
    struct ray rays[64];
    struct hit hits[64];
    uint32_t count = 0;
    struct fixture fixture;
    fixture_init(&fixture, NULL);
    struct ldc_samples *s = &fixture.samples[TRACER_CUBE_STATIC];
    start_samples(s, 40, 4, -2, -2, -2);
    add_sphere(s, (const float[3]){0, 0, 0}, 1.5f, 16, 0);
    const float middle[3] = {0.1f, 0.2f, 0.3f}, right[3] = {1, 0, 0};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        rays[count++] = ray_from(middle, (const float[3]){bad[i], bad[i], bad[i]}, 0, FAR);
    for (int k = 0; k < 3; k++) {
        float origin[3] = {0.1f, 0.2f, 0.3f}, direction[3] = {0.5f, 0.6f, 0.7f};
        direction[k] = NAN;
        rays[count++] = ray_from(middle, direction, 0, FAR);
        direction[k] = 0.5f;
        origin[k] = NAN;
        rays[count++] = ray_from(origin, direction, 0, FAR);
        origin[k] = INFINITY;
        rays[count++] = ray_from(origin, direction, 0, FAR);
    }
    rays[count++] = ray_from(middle, right, 1, 1);
    rays[count++] = ray_from(middle, right, 0, -1);
    rays[count++] = ray_from(middle, right, 0, NAN);
    rays[count++] = ray_from(middle, right, NAN, FAR);
    const uint32_t living = count;
    rays[count++] = ray_from(middle, right, 0, FAR); /* beside them */
    while (count % 4)
        rays[count++] = ray_from(middle, right, 0, INFINITY);
    for (size_t f = 0; f < FORM_COUNT; f++) {
        build(&fixture, &forms[f].options);
        trace(&fixture, &forms[f].options, WAVE_CLOSEST, rays, count, hits, NULL);
        for (uint32_t i = 0; i < count; i++)
            if ((hits[i].distance < 0) != (i < living))
                fail_msg("%s: ray %u: %g", forms[f].name, i, (double)hits[i].distance);
    }
    fixture_finish(&fixture);
}

static void where_there_is_nothing_nothing_is_hit(void **state)
{
    (void)state;
    struct ray *rays = malloc(RAY_COUNT * sizeof *rays);
    struct hit *hits = malloc(RAY_COUNT * sizeof *hits);
    for (int with_cube = 0; with_cube < 2; with_cube++) {
        struct fixture fixture;
        fixture_init(&fixture, NULL);
        struct ldc_samples empty = {0};
        start_samples(&empty, 33, 4, -2, -2, -2);
        if (with_cube) /* without a sample in it */
            fixture.samples[TRACER_CUBE_STATIC] = empty;
        random_rays(rays, RAY_COUNT, &empty, 51);
        for (size_t f = 0; f < FORM_COUNT; f++) {
            build(&fixture, &forms[f].options);
            trace(&fixture, &forms[f].options, WAVE_CLOSEST, rays, RAY_COUNT, hits, NULL);
            for (uint32_t i = 0; i < RAY_COUNT; i++)
                assert_true(hits[i].distance < 0);
        }
        fixture_finish(&fixture);
    }
    free(rays);
    free(hits);
}

/* ---- rays that begin on surfaces ---- */

/* As integrators move origins off surfaces: by 2^-16 of the coordinates, here of the size of the cube. */
static void ray_on_sphere(struct ray *ray, const float centre[3], float radius, float extent, bool inwards,
                          float grazing, uint64_t *seed)
{
    float n[3], o[3], d[3], side = inwards ? -1.0f : 1.0f, z = test_uniform(seed, -0.999f, 0.999f),
                            phi = test_uniform(seed, 0, 2 * PI_F), cosine = 0;
    n[0] = sqrtf(1 - z * z) * cosf(phi), n[1] = z, n[2] = sqrtf(1 - z * z) * sinf(phi);
    for (int k = 0; k < 3; k++) {
        o[k] = centre[k] + n[k] * (radius + side * extent / 65536);
        d[k] = test_uniform(seed, -1, 1);
        cosine += d[k] * n[k];
    }
    for (int k = 0; k < 3; k++) /* of the part along the normal only its size and side */
        d[k] += n[k] * (side * fabsf(cosine) * grazing - cosine);
    *ray = ray_from(o, d, 0, FAR);
}

/* No ray that goes away from a ball outside hits it; and one that goes inside meets its other side, where a chord
 * ends. */
static void a_ray_does_not_hit_the_ball_that_it_leaves(void **state)
{
    (void)state;
    const float centre[3] = {0.1f, -0.05f, 0.2f}, radius = 1.3f, extent = 4;
    struct ray *rays = malloc(RAY_COUNT * sizeof *rays);
    struct hit *hits = malloc(RAY_COUNT * sizeof *hits);
    struct fixture fixture;
    fixture_init(&fixture, NULL);
    struct ldc_samples *s = &fixture.samples[TRACER_CUBE_STATIC];
    start_samples(s, 150, extent, -2, -2, -2);
    add_sphere(s, centre, radius, 400, 0); /* facets smaller than cells: it is round */
    uint64_t seed = 61;
    for (int inwards = 0; inwards < 2; inwards++) {
        /* Steep; any; almost along the surface: a chord of a few cells says nothing there. */
        for (int way = 0; way < (inwards ? 2 : 3); way++) {
            for (uint32_t i = 0; i < RAY_COUNT; i++)
                ray_on_sphere(&rays[i], centre, radius, extent, inwards,
                              way == 0   ? 3.0f
                              : way == 1 ? 1.0f
                                         : 0.02f,
                              &seed);
            build(&fixture, &forms[0].options);
            trace(&fixture, &forms[0].options, WAVE_CLOSEST, rays, RAY_COUNT, hits, NULL);
            uint32_t wrong = 0;
            for (uint32_t i = 0; i < RAY_COUNT; i++) {
                double b = 0, c = 0, a = 0;
                for (int k = 0; k < 3; k++) {
                    const double f = (double)rays[i].origin_t_min[k] - centre[k], d = rays[i].direction_t_max[k];
                    a += d * d, b += f * d, c += f * f;
                }
                const double chord = (-b + sqrt(fmax(b * b - a * (c - radius * radius), 0))) / a;
                const double cells = sqrt(a) / s->cell;
                if (!inwards)
                    wrong += hits[i].distance >= 0;
                else if (chord * cells > 4)
                    wrong += (uint32_t) !(fabs(hits[i].distance - chord) * cells < 0.5);
            }
            /* Where the images of two axes meet a plane may stick out, or a gap be left. */
            if (wrong > RAY_COUNT / 500)
                fail_msg("%u of %u rays are wrong, %s, way %d", wrong, RAY_COUNT, inwards ? "inwards" : "outwards",
                         way);
        }
    }
    fixture_finish(&fixture);
    free(rays);
    free(hits);
}

/* A floor with a box that stands on it in the middle of a cell: from the floor, a cell and more from the box,
 * straight and steeply towards it. And along the floor, as low as integrators begin, which the floor must not
 * stop. */
static void what_stands_on_a_floor_is_met_from_a_cell_on(void **state)
{
    (void)state;
    struct ray *rays = malloc(RAY_COUNT * sizeof *rays);
    struct hit *hits = malloc(RAY_COUNT * sizeof *hits);
    struct fixture fixture;
    uint64_t seed = 71;
    fixture_init(&fixture, NULL);
    struct ldc_samples *s = &fixture.samples[TRACER_CUBE_STATIC];
    start_samples(s, 60, 60, 0, 0, 0);
    const float low = 10.3f;
    add_quad(s, (const float[3]){0, low, 0}, (const float[3]){0, low, 60}, (const float[3]){60, low, 60},
             (const float[3]){60, low, 0}, 0);
    add_box(s, (const float[3]){30.4f, low, 20.2f}, (const float[3]){45.7f, 30, 40.3f}, 0);
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        const float away = i % 2 ? test_uniform(&seed, 1, 4) : test_uniform(&seed, 4, 28);
        const float o[3] = {30.4f - away, low + 60.0f / 65536, test_uniform(&seed, 24, 36)};
        const float rise = i % 4 == 0 ? 0 : test_uniform(&seed, 0, 1.5f);
        rays[i] =
            ray_from(o, (const float[3]){1, rise * 15 / (away + 15), test_uniform(&seed, -0.1f, 0.1f)}, 0, FAR);
    }
    for (size_t f = 0; f < FORM_COUNT; f++) {
        build(&fixture, &forms[f].options);
        trace(&fixture, &forms[f].options, WAVE_CLOSEST, rays, RAY_COUNT, hits, NULL);
        for (uint32_t i = 0; i < RAY_COUNT; i++) {
            const float wall = 30.4f - rays[i].origin_t_min[0];
            if (wall * rays[i].direction_t_max[1] > 18) /* above the box, or at its edge */
                continue;
            if (!(fabsf(hits[i].distance - wall) < 1e-3f * wall + 1e-3f))
                fail_msg("%s: ray %u, %g cells from the wall, meets something at %g", forms[f].name, i,
                         (double)wall, (double)hits[i].distance);
        }
    }
    fixture_finish(&fixture);
    free(rays);
    free(hits);
}

/* In the corner of a room: from beside a wall, nearer than a cell, into it. What would look through it would see
 * the sky along all its corners. */
static void a_wall_beside_the_origin_is_not_passed(void **state)
{
    (void)state;
    struct ray *rays = malloc(RAY_COUNT * sizeof *rays);
    struct hit *hits = malloc(RAY_COUNT * sizeof *hits);
    struct fixture fixture;
    uint64_t seed = 81;
    fixture_init(&fixture, NULL);
    struct ldc_samples *s = &fixture.samples[TRACER_CUBE_STATIC];
    start_samples(s, 60, 60, 0, 0, 0);
    const float low = 10.4f, wall = 20.3f;
    add_quad(s, (const float[3]){wall, low, 5}, (const float[3]){wall, low, 55}, (const float[3]){55, low, 55},
             (const float[3]){55, low, 5}, 0); /* seen from above */
    add_quad(s, (const float[3]){wall, low, 5}, (const float[3]){wall, 50, 5}, (const float[3]){wall, 50, 55},
             (const float[3]){wall, low, 55}, 0); /* seen from the right */
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        const float o[3] = {wall + test_uniform(&seed, 0.25f, 1), low + 60.0f / 65536,
                            test_uniform(&seed, 10, 50)};
        rays[i] =
            ray_from(o, (const float[3]){-1, test_uniform(&seed, 0.6f, 3), test_uniform(&seed, -1, 1)}, 0, FAR);
    }
    build(&fixture, &forms[0].options);
    trace(&fixture, &forms[0].options, WAVE_CLOSEST, rays, RAY_COUNT, hits, NULL);
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        const float away = rays[i].origin_t_min[0] - wall, above = away * rays[i].direction_t_max[1];
        /* Below, the wall may have no sample: it begins within the texel. */
        if (above > 1 && !(fabsf(hits[i].distance - away) < 1e-3f))
            fail_msg("ray %u: a wall at %g is met at %g", i, (double)away, (double)hits[i].distance);
    }
    fixture_finish(&fixture);
    free(rays);
    free(hits);
}

/* ---- light that passes ---- */

/* Glass whose every crossing leaves half of red, a quarter of green, all of blue. Its index on the device is 1. */
static struct scene *scene_of_glass(void)
{
    struct test_edits edits = {.scene = test_scene_create()};
    test_material(&edits, 1, 0.5f, 0.25f, 1)->transmission = 1;
    const float corners[3][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    const uint32_t indices[3] = {0, 1, 2};
    const struct material_range ranges[] = {{0, 1, 1}};
    struct scene_mesh *mesh = test_mesh(&edits, 10, corners, 3, indices, 1);
    mesh->ranges = test_ranges(ranges, 1);
    mesh->range_count = 1;
    test_node(&edits, 1, 0, NODE_MESH, 10, NULL);
    test_commit(&edits);
    return edits.scene;
}

static bool is_tint(uint32_t visibility, int crossings)
{
    const float expected[3] = {powf(0.5f, (float)crossings), powf(0.25f, (float)crossings), 1};
    for (int k = 0; k < 3; k++)
        if (fabsf((float)(visibility >> 8 * k & 255) - 255 * expected[k]) > 1)
            return false;
    return true;
}

/* Panes across each axis and askew: neighbouring samples' texels overlap, but a pane tints once. */
static void a_pane_of_glass_tints_once(void **state)
{
    (void)state;
    struct ray *rays = malloc(RAY_COUNT * sizeof *rays);
    uint32_t *visibility = malloc(RAY_COUNT * sizeof *visibility);
    struct fixture fixture;
    uint64_t seed = 91;
    fixture_init(&fixture, scene_of_glass());
    assert_true(fixture.gpu.has_transmission);
    struct ldc_samples *s = &fixture.samples[TRACER_CUBE_STATIC];
    start_samples(s, 64, 64, 0, 0, 0);
    for (int pane = 0; pane < 3; pane++) {
        const float x = 15 + 12 * (float)pane, lean = 9 * (float)(pane - 1);
        add_quad(s, (const float[3]){x - lean, 2, 2}, (const float[3]){x - lean, 2, 62},
                 (const float[3]){x + lean, 62, 62}, (const float[3]){x + lean, 62, 2}, 1);
    }
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        const float o[3] = {0.5f, test_uniform(&seed, 20, 44), test_uniform(&seed, 20, 44)};
        const float d[3] = {1, test_uniform(&seed, -0.3f, 0.3f), test_uniform(&seed, -0.3f, 0.3f)};
        rays[i] = ray_from(o, d, 0, FAR);
    }
    for (size_t f = 0; f < FORM_COUNT; f++) {
        build(&fixture, &forms[f].options);
        trace(&fixture, &forms[f].options, WAVE_ANY, rays, RAY_COUNT, NULL, visibility);
        for (uint32_t i = 0; i < RAY_COUNT; i++)
            if (!is_tint(visibility[i], 3))
                fail_msg("%s: ray %u: 0x%08x", forms[f].name, i, visibility[i]);
    }
    fixture_finish(&fixture);
    free(rays);
    free(visibility);
}

/* A ball is two crossings, also where the images of two axes meet, but where it is grazed. */
static void a_ball_of_glass_tints_twice(void **state)
{
    (void)state;
    const float centre[3] = {0, 0, 0}, radius = 1.2f;
    struct ray *rays = malloc(RAY_COUNT * sizeof *rays);
    uint32_t *visibility = malloc(RAY_COUNT * sizeof *visibility), wrong = 0;
    struct fixture fixture;
    uint64_t seed = 95;
    fixture_init(&fixture, scene_of_glass());
    struct ldc_samples *s = &fixture.samples[TRACER_CUBE_STATIC];
    start_samples(s, 128, 4, -2, -2, -2);
    add_sphere(s, centre, radius, 200, 1);
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        float o[3], d[3], length = 0;
        for (int k = 0; k < 3; k++) {
            o[k] = test_uniform(&seed, -1, 1);
            length += o[k] * o[k];
        }
        for (int k = 0; k < 3; k++) {
            o[k] *= 3 / sqrtf(length);
            d[k] = test_uniform(&seed, -0.6f, 0.6f) - o[k];
        }
        rays[i] = ray_from(o, d, 0, FAR);
    }
    for (size_t f = 0; f < FORM_COUNT; f++) {
        build(&fixture, &forms[f].options);
        trace(&fixture, &forms[f].options, WAVE_ANY, rays, RAY_COUNT, NULL, visibility);
        for (uint32_t i = 0; i < RAY_COUNT; i++)
            wrong += !is_tint(visibility[i], 2);
        /* Gaps where images meet: a few rays in a thousand pass through one. */
        if (wrong > RAY_COUNT / 200)
            fail_msg("%s: %u of %u rays are not tinted twice", forms[f].name, wrong, RAY_COUNT);
        wrong = 0;
    }
    fixture_finish(&fixture);
    free(rays);
    free(visibility);
}

/* ---- the paper's test ---- */

/* With a tolerance a hit is where the ray comes as near to a sample's depth, in its texel: rays straight down on a
 * slope meet samples' own depths; a tolerance of nearly nothing is passed by rays that are aslant. */
static void a_tolerance_takes_depths_for_planes(void **state)
{
    (void)state;
    struct ray *rays = malloc(RAY_COUNT * sizeof *rays);
    struct hit *hits = malloc(RAY_COUNT * sizeof *hits);
    struct fixture fixture;
    uint64_t seed = 101;
    fixture_init(&fixture, NULL);
    struct ldc_samples *s = &fixture.samples[TRACER_CUBE_STATIC];
    start_samples(s, 50, 50, 0, 0, 0);
    add_quad(s, (const float[3]){1, 1, 10}, (const float[3]){49, 1, 34}, (const float[3]){49, 49, 34},
             (const float[3]){1, 49, 10}, 0); /* z = 9.5 + x / 2 */
    for (uint32_t i = 0; i < RAY_COUNT; i++) {
        const float o[3] = {test_uniform(&seed, 5, 45), test_uniform(&seed, 5, 45), 60};
        rays[i] = ray_from(o, (const float[3]){0, 0, -1}, 0, FAR);
    }
    const struct tracer_options kinds[] = {{.ldc_tolerance = 0.01f},
                                           {.ldc_tolerance = 0.01f, .ldc_levels = LDC_LEVELS_BLOCKS},
                                           {.ldc_tolerance = 0.01f, .ldc_layers_together = 1}};
    for (size_t f = 0; f < sizeof kinds / sizeof *kinds; f++) {
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
        const struct tracer_options options = {.ldc_tolerance = wide ? 1.5f : 0.1f};
        build(&fixture, &options);
        trace(&fixture, &options, WAVE_CLOSEST, rays, RAY_COUNT, hits, NULL);
        for (uint32_t i = 0; i < RAY_COUNT; i++)
            assert_true((hits[i].distance >= 0) == (wide == 1));
    }
    fixture_finish(&fixture);
    free(rays);
    free(hits);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rays_cross_samples_as_by_brute_force),
        cmocka_unit_test(two_cubes_are_walked_as_one),
        cmocka_unit_test(where_cells_do_not_fit_a_pyramid_is_walked),
        cmocka_unit_test(what_shares_cells_is_in_each_of_them_once),
        cmocka_unit_test(blocks_of_many_layers_hold_all_of_them),
        cmocka_unit_test(rays_along_axes_and_borders_cross_samples_as_by_brute_force),
        cmocka_unit_test(what_lies_in_the_sides_of_the_cube_is_hit),
        cmocka_unit_test(directions_that_are_none_and_dead_rays_hit_nothing),
        cmocka_unit_test(where_there_is_nothing_nothing_is_hit),
        cmocka_unit_test(a_ray_does_not_hit_the_ball_that_it_leaves),
        cmocka_unit_test(what_stands_on_a_floor_is_met_from_a_cell_on),
        cmocka_unit_test(a_wall_beside_the_origin_is_not_passed),
        cmocka_unit_test(a_pane_of_glass_tints_once),
        cmocka_unit_test(a_ball_of_glass_tints_twice),
        cmocka_unit_test(a_tolerance_takes_depths_for_planes),
    };
    struct error error = {0};
    device = gpu_device_create(&(struct gpu_options){.index = -1}, &error);
    if (!device) {
        printf("SKIP: no OpenGL device: %s\n", error.text);
        return 0;
    }
    int failures = cmocka_run_group_tests(tests, NULL, NULL);
    gpu_device_destroy(device);
    return failures;
}
