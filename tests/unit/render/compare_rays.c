/* SPDX-License-Identifier: MIT */
/* Two tracers' answers compared: made rays and hits, of which it is known what must come out. */
#include <stddef.h>
#include <stdint.h>

#include "render/compare/rays.h"
#include "tests/harness/test.h"
#include "trace/visibility.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Half a bin: seven bits of mantissa are kept. */
#define PERCENTILE_TOLERANCE (1.0 / 256)

static const struct wave_compare_settings settings = {.diagonal = 10.0f, .far_share = 1e-3f};
static const struct ray down = {.origin_t_min = {1, 2, 3, 0}, .direction_t_max = {0, 0, -1, 1e30f}};

/* Octahedral, 2 x 16 bit snorm, as shaders pack it. */
static uint pack_normal(double x, double y, double z)
{
    double sum = fabs(x) + fabs(y) + fabs(z), u = x / sum, v = y / sum;
    if (z < 0) {
        double old = u;
        u = copysign(1 - fabs(v), u);
        v = copysign(1 - fabs(old), v);
    }
    return (uint)(uint16_t)(int16_t)lrint(u * 32767) | (uint)(uint16_t)(int16_t)lrint(v * 32767) << 16;
}

static struct hit hit_at(float distance)
{
    return (struct hit){.distance = distance, .normal_shading = pack_normal(0, 0, 1)};
}

#define MISS hit_at(-1.0f)

/* Compares a ray with both results, where the reference's results for the moved rays are always `moved`. */
static void compare_moved(struct wave_tally *tally, const struct ray *ray, struct hit first, struct hit second,
                          struct hit moved)
{
    struct wave_answers answers = {.count = 1, .rays = ray, .first_hits = &first, .second_hits = &second};
    struct hit all[WAVE_MOVES];
    uint32_t suspect = 77;
    for (int i = 0; i < WAVE_MOVES; i++)
        all[i] = i == 5 ? moved : second;
    if (wave_compare(tally, &settings, &answers, &suspect) == 0)
        return;
    assert_int_equal(suspect, 0);
    wave_settle(tally, &settings, &answers, 0, all, NULL);
}

static void compare(struct wave_tally *tally, const struct ray *ray, struct hit first, struct hit second)
{
    compare_moved(tally, ray, first, second, second);
}

static int make_tally(void **state)
{
    *state = calloc(1, sizeof(struct wave_tally));
    return *state ? 0 : -1;
}

static int free_tally(void **state)
{
    free(*state);
    return 0;
}

#define assert_counts(tally, hits, misses, first, second, far_, edges_, other)                                    \
    do {                                                                                                          \
        assert_int_equal((tally)->both_hit, hits);                                                                \
        assert_int_equal((tally)->both_missed, misses);                                                           \
        assert_int_equal((tally)->only_first, first);                                                             \
        assert_int_equal((tally)->only_second, second);                                                           \
        assert_int_equal((tally)->far, far_);                                                                     \
        assert_int_equal((tally)->edges, edges_);                                                                 \
        assert_int_equal((tally)->other_surface, other);                                                          \
        assert_int_equal((tally)->rays, (hits) + (misses) + (first) + (second));                                  \
    } while (0)

static void assert_close(double value, double expected, double relative)
{
    if (!(fabs(value - expected) <= relative * fabs(expected)))
        fail_msg("%.9g, expected %.9g within a share of %g", value, expected, relative);
}

/* ---- histograms --------------------------------------------------------------------------------- */

EACH_TEST(make_tally, free_tally)

TEST(percentiles_are_true_to_a_bin_and_the_maximum_is_exact)
{
    struct error_histogram *histogram = calloc(1, sizeof(*histogram));
    for (int i = 1000; i >= 1; i--)
        error_histogram_add(histogram, (float)i * 1e-7f);
    assert_close(error_histogram_percentile(histogram, 0.5), 500e-7, PERCENTILE_TOLERANCE);
    assert_close(error_histogram_percentile(histogram, 0.99), 990e-7, PERCENTILE_TOLERANCE);
    assert_close(error_histogram_percentile(histogram, 0.0), 1e-7, PERCENTILE_TOLERANCE);
    assert_true(histogram->max == 1000 * 1e-7f);
    assert_true(error_histogram_percentile(histogram, 1.0) <= histogram->max);
    free(histogram);
}

TEST(zeros_stay_zero_and_nan_is_the_maximum)
{
    struct error_histogram *histogram = calloc(1, sizeof(*histogram));
    assert_true(error_histogram_percentile(histogram, 0.5) == 0.0f);
    for (int i = 0; i < 60; i++)
        error_histogram_add(histogram, 0.0f);
    for (int i = 0; i < 39; i++)
        error_histogram_add(histogram, 1.0f);
    assert_true(error_histogram_percentile(histogram, 0.5) == 0.0f);
    assert_close(error_histogram_percentile(histogram, 0.61), 1.0, PERCENTILE_TOLERANCE);
    error_histogram_add(histogram, NAN);
    assert_true(histogram->max == ERROR_MAX);
    assert_true(error_histogram_percentile(histogram, 1.0) == ERROR_MAX);
    error_histogram_add(histogram, INFINITY);
    error_histogram_add(histogram, -1.0f);
    assert_true(error_histogram_percentile(histogram, 0.98) == ERROR_MAX);
    free(histogram);
}

TEST(every_size_of_error_falls_into_its_own_bin)
{
    for (float error = 1e-14f; error < 6e4f; error *= 1.7f) {
        struct error_histogram *histogram = calloc(1, sizeof(*histogram));
        error_histogram_add(histogram, 2.0f * error);
        error_histogram_add(histogram, error);
        assert_close(error_histogram_percentile(histogram, 0.5), error, PERCENTILE_TOLERANCE);
        free(histogram);
    }
}

/* ---- classes ------------------------------------------------------------------------------------ */

TEST(hits_and_misses_fall_into_their_classes)
{
    struct wave_tally *tally = *state;
    compare(tally, &down, hit_at(4), hit_at(4));
    compare(tally, &down, hit_at(0), hit_at(0)); /* a distance of 0 is a hit */
    compare(tally, &down, MISS, MISS);
    compare(tally, &down, hit_at(4), MISS);
    compare(tally, &down, MISS, hit_at(4));
    compare(tally, &down, MISS, hit_at(5));
    assert_counts(tally, 2, 1, 1, 2, 0, 0, 0);
}

TEST(far_is_a_share_of_the_diagonal_or_of_a_longer_way)
{
    struct wave_tally *tally = *state;
    compare(tally, &down, hit_at(4), hit_at(4.0099f)); /* 1/1000 of 10 metres is 0.01 */
    assert_int_equal(tally->far, 0);
    compare(tally, &down, hit_at(4), hit_at(4.0101f));
    assert_int_equal(tally->far, 1);
    struct ray stretched = down; /* its lengths are of 100 metres */
    stretched.direction_t_max[2] = -100;
    compare(tally, &stretched, hit_at(0.04f), hit_at(0.0402f));
    assert_int_equal(tally->far, 2);
    compare(tally, &down, hit_at(1000), hit_at(1000.9f)); /* seen from 100 diagonals away: 1 metre */
    assert_int_equal(tally->far, 2);
    compare(tally, &down, hit_at(1000), hit_at(1001.1f));
    assert_counts(tally, 5, 0, 0, 0, 3, 0, 0);
}

TEST(errors_are_in_scene_diagonals_and_in_shares_of_the_distance)
{
    struct wave_tally *tally = *state;
    struct record_wave_comparison figures;
    for (int i = 0; i < 99; i++)
        compare(tally, &down, hit_at(4.001f), hit_at(4));
    compare(tally, &down, hit_at(4.004f), hit_at(4));
    wave_tally_figures(tally, &figures);
    /* 4.001 as a float is off by up to 2.4e-7, of 1e-3 */
    assert_close(figures.distance_median, 1e-4, PERCENTILE_TOLERANCE + 2.4e-4);
    assert_close(figures.distance_p99, 1e-4, PERCENTILE_TOLERANCE + 2.4e-4);
    assert_close(figures.distance_max, 4e-4, 1e-4);
    assert_close(figures.relative_median, 2.5e-4, PERCENTILE_TOLERANCE + 2.4e-4);
    assert_true(figures.normal_max == 0.0f);
}

TEST(a_real_far_hit_counts_among_the_errors_and_one_on_an_edge_does_not)
{
    struct wave_tally *tally = *state;
    compare(tally, &down, hit_at(4), hit_at(4));
    compare_moved(tally, &down, hit_at(9), hit_at(4), hit_at(9.001f));
    assert_counts(tally, 2, 0, 0, 0, 1, 1, 0);
    assert_true(tally->distance.max == 0.0f);
    compare(tally, &down, hit_at(9), hit_at(4));
    assert_counts(tally, 3, 0, 0, 0, 2, 1, 0);
    assert_close(tally->distance.max, 0.5, 1e-6);
}

TEST(an_edge_is_where_the_reference_says_the_same_to_a_moved_ray)
{
    struct wave_tally *tally = *state;
    compare_moved(tally, &down, hit_at(4), MISS, hit_at(4.001f));
    compare_moved(tally, &down, MISS, hit_at(4), MISS);
    assert_counts(tally, 0, 0, 1, 1, 0, 2, 0);
    compare_moved(tally, &down, hit_at(4), MISS, hit_at(6)); /* hits, but something else */
    compare_moved(tally, &down, MISS, hit_at(4), hit_at(6)); /* another surface, but the tracer saw none */
    assert_counts(tally, 0, 0, 2, 2, 0, 2, 0);
}

TEST(another_normal_material_or_side_is_another_surface_unless_on_an_edge)
{
    struct wave_tally *tally = *state;
    struct hit good = hit_at(4), turned = good, inside = good, other = good;
    turned.normal_shading = pack_normal(1, 0, 1);
    inside.material = HIT_BACK_FACE;
    other.material = 3;
    compare(tally, &down, turned, good);
    compare(tally, &down, inside, good);
    compare(tally, &down, other, good);
    assert_counts(tally, 3, 0, 0, 0, 0, 0, 3);
    assert_close(tally->normal.max, 45.0, 1e-4);
    compare_moved(tally, &down, turned, good, turned); /* a crease */
    assert_counts(tally, 4, 0, 0, 0, 0, 0, 3);
    struct hit tangent = good; /* is shading's own affair */
    tangent.material = HIT_HAS_TANGENT;
    compare(tally, &down, tangent, good);
    assert_counts(tally, 5, 0, 0, 0, 0, 0, 3);
}

TEST(angles_are_right_all_over_the_sphere)
{
    struct wave_tally *tally = *state;
    for (int i = 0; i < 200; i++) {
        double longitude = 0.37 * i, height = -0.995 + 0.01 * i, across = sqrt(1 - height * height);
        double tilt = 3.0 * 3.14159265358979323846 / 180.0; /* along the meridian */
        double c = cos(tilt), s = sin(tilt);
        double x = across * cos(longitude), y = across * sin(longitude);
        struct hit first = hit_at(4), second = hit_at(4);
        first.normal_shading = pack_normal(x, y, height);
        second.normal_shading = pack_normal(c * x - s * height * cos(longitude),
                                            c * y - s * height * sin(longitude), c * height + s * across);
        compare(tally, &down, first, second);
    }
    assert_counts(tally, 200, 0, 0, 0, 0, 0, 0);
    /* two normals packed to 0.003 degrees each */
    assert_close(tally->normal.max, 3.0, 0.006 / 3.0);
    assert_close(error_histogram_percentile(&tally->normal, 0.01), 3.0, 0.006 / 3.0 + PERCENTILE_TOLERANCE);
}

TEST(dead_rays_do_not_count_unless_something_was_hit)
{
    struct wave_tally *tally = *state;
    struct ray dead = down;
    dead.direction_t_max[3] = -1;
    compare(tally, &dead, MISS, MISS);
    assert_int_equal(tally->rays, 0);
    compare(tally, &dead, hit_at(4), MISS);
    assert_counts(tally, 0, 0, 1, 0, 0, 0, 0);
}

TEST(distances_that_are_no_numbers_are_errors)
{
    struct wave_tally *tally = *state;
    struct record_wave_comparison figures;
    compare(tally, &down, hit_at(NAN), hit_at(4));
    assert_counts(tally, 0, 0, 0, 1, 0, 0, 0);
    compare(tally, &down, hit_at(INFINITY), hit_at(4));
    assert_counts(tally, 1, 0, 0, 1, 1, 0, 0);
    wave_tally_figures(tally, &figures);
    assert_true(figures.distance_max == ERROR_MAX);
}

/* ---- shadows ------------------------------------------------------------------------------------ */

static void compare_shadow(struct wave_tally *tally, const struct ray *ray, uint first, uint second, uint moved)
{
    struct wave_answers answers = {
        .count = 1, .rays = ray, .first_visibility = &first, .second_visibility = &second};
    uint32_t suspect;
    uint all[WAVE_MOVES];
    for (int i = 0; i < WAVE_MOVES; i++)
        all[i] = i == 2 ? moved : second;
    if (wave_compare(tally, &settings, &answers, &suspect) > 0)
        wave_settle(tally, &settings, &answers, suspect, NULL, all);
}

static uint veil(double red, double green, double blue)
{
    return visibility_of((const float[3]){(float)red, (float)green, (float)blue});
}

TEST(shadows_agree_to_two_255ths_of_transmittance)
{
    struct wave_tally *tally = *state;
    /* 0.5 is within 0.001 as it is stored */
    const uint lit = 0xffffffff, dark = 0, veiled = veil(0.5, 0.5, 0.5);
    compare_shadow(tally, &down, lit, lit, lit);
    compare_shadow(tally, &down, dark, dark, dark);
    assert_counts(tally, 1, 1, 0, 0, 0, 0, 0);
    compare_shadow(tally, &down, lit, dark, dark);
    compare_shadow(tally, &down, dark, lit, lit);
    assert_counts(tally, 1, 1, 1, 1, 0, 0, 0);
    compare_shadow(tally, &down, veiled, veil(0.506, 0.5, 0.494), veiled);
    assert_counts(tally, 2, 1, 1, 1, 0, 0, 0);
    compare_shadow(tally, &down, veiled, veil(0.5, 0.51, 0.5), veil(0.5, 0.51, 0.5));
    assert_counts(tally, 3, 1, 1, 1, 1, 0, 0);
    compare_shadow(tally, &down, veil(0.997, 0.997, 1), lit, lit); /* rounding, not a shadow */
    assert_counts(tally, 3, 2, 1, 1, 1, 0, 0);
    compare_shadow(tally, &down, dark, lit, dark); /* at the shadow's edge */
    assert_counts(tally, 3, 2, 2, 1, 1, 1, 0);
    struct ray dead = down;
    dead.direction_t_max[3] = -1;
    compare_shadow(tally, &dead, lit, lit, lit);
    assert_int_equal(tally->rays, 8);
}

/* ---- the whole ---------------------------------------------------------------------------------- */

TEST(moved_rays_are_a_few_rounding_steps_off_and_still_different_rays)
{
    struct ray ray = {.origin_t_min = {1000, 2, 3, 0.5f}, .direction_t_max = {0, 0, -1, 1e30f}};
    struct hit first = hit_at(-1), second = hit_at(4000);
    struct wave_answers answers = {.count = 1, .rays = &ray, .first_hits = &first, .second_hits = &second};
    struct ray moved[WAVE_MOVES];
    wave_moved_rays(&settings, &answers, 0, moved);
    for (int i = 0; i < WAVE_MOVES; i++) {
        for (int axis = 0; axis < 3; axis++) {
            float off = fabsf(moved[i].origin_t_min[axis] - ray.origin_t_min[axis]);
            assert_true(off > 4000 * 1.2e-7f); /* the place that it hits is 4000 metres out */
            assert_true(off < 4000 * 2e-6f);
        }
        assert_true(moved[i].origin_t_min[3] == 0.5f);
        assert_memory_equal(moved[i].direction_t_max, ray.direction_t_max, sizeof(ray.direction_t_max));
        for (int j = 0; j < i; j++)
            assert_memory_not_equal(&moved[i], &moved[j], sizeof(moved[i]));
    }
    /* A shadow ray to a sun may end anywhere; what is in its way is in the scene. */
    uint lit = ~0u, dark = 0;
    struct ray to_sun = {.origin_t_min = {1, 0, 0, 0}, .direction_t_max = {0, 1, 0, 1e30f}};
    struct wave_answers shadow = {
        .count = 1, .rays = &to_sun, .first_visibility = &lit, .second_visibility = &dark};
    wave_moved_rays(&settings, &shadow, 0, moved);
    assert_true(fabsf(moved[0].origin_t_min[1]) < 10 * 2e-6f);
    assert_true(fabsf(moved[0].origin_t_min[1]) > 0);
}

TEST(the_order_of_rays_and_slices_changes_no_figure)
{
    struct wave_tally *forward = *state, *parts[3];
    struct record_wave_comparison a, b;
    for (int i = 0; i < 3; i++)
        parts[i] = calloc(1, sizeof(*parts[i]));
    for (int i = 0; i < 3000; i++)
        compare(forward, &down, hit_at(4), hit_at(4 + (float)(i % 997) * 1e-6f));
    for (int i = 2999; i >= 0; i--)
        compare(parts[i % 3], &down, hit_at(4), hit_at(4 + (float)(i % 997) * 1e-6f));
    parts[0]->first_ns = 5;
    parts[2]->first_ns = 7;
    wave_tally_merge(parts[1], parts[0]);
    wave_tally_merge(parts[1], parts[2]);
    wave_tally_figures(forward, &a);
    wave_tally_figures(parts[1], &b);
    assert_int_equal(b.tracer_ns, 12);
    b.tracer_ns = 0;
    assert_memory_equal(&a, &b, offsetof(struct record_wave_comparison, normal_max) + sizeof(a.normal_max));
    assert_int_equal(b.rays, 3000);
    for (int i = 0; i < 3; i++)
        free(parts[i]);
}

TEST(suspects_are_named_in_order_and_settled_rays_are_not)
{
    struct wave_tally *tally = *state;
    struct ray rays[6];
    struct hit first[6], second[6];
    uint32_t suspects[6];
    for (int i = 0; i < 6; i++) {
        rays[i] = down;
        first[i] = hit_at(4);
        second[i] = i == 1 || i == 4 ? MISS : hit_at(4);
    }
    struct wave_answers answers = {.count = 6, .rays = rays, .first_hits = first, .second_hits = second};
    assert_int_equal(wave_compare(tally, &settings, &answers, suspects), 2);
    assert_int_equal(suspects[0], 1);
    assert_int_equal(suspects[1], 4);
    assert_int_equal(tally->rays, 6);
}
