/* SPDX-License-Identifier: MIT */
/* Counts and errors of two answers to the same rays, in histograms. */
#include "render/compare/rays.h"

#include "trace/visibility.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* ---- histograms --------------------------------------------------------------------------------- */

#define BIN_SHIFT 16                          /* keeps the exponent and seven bits of the mantissa */
#define BIN_LOWEST ((127u - 48u) << 7)        /* the bin of 2^-48 */
#define BIN_HIGHEST (BIN_LOWEST + 64u * 128u) /* the bin of 2^16 */

static uint32_t bits_of(float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof(bits));
    return bits;
}

static float float_of(uint32_t bits)
{
    float value;
    memcpy(&value, &bits, sizeof(value));
    return value;
}

static uint32_t bin_of(float error)
{
    uint32_t upper = bits_of(error) >> BIN_SHIFT;
    return upper < BIN_LOWEST ? 0 : upper >= BIN_HIGHEST ? ERROR_BINS - 1 : upper - BIN_LOWEST + 1;
}

void error_histogram_add(struct error_histogram *histogram, float error)
{
    if (!(error >= 0.0f && error <= ERROR_MAX))
        error = ERROR_MAX;
    histogram->counts[bin_of(error)]++;
    histogram->count++;
    if (error > histogram->max)
        histogram->max = error;
}

static void error_histogram_merge(struct error_histogram *into, const struct error_histogram *from)
{
    if (from->count == 0)
        return;
    for (uint32_t i = 0; i < ERROR_BINS; i++)
        into->counts[i] += from->counts[i];
    into->count += from->count;
    if (from->max > into->max)
        into->max = from->max;
}

float error_histogram_percentile(const struct error_histogram *histogram, double share)
{
    if (histogram->count == 0)
        return 0.0f;
    double rank = ceil(share * (double)histogram->count);
    uint64_t below = 0;
    uint32_t bin = 0;
    while (bin < ERROR_BINS - 1 && (below += histogram->counts[bin], (double)below < fmax(rank, 1.0)))
        bin++;
    if (bin == 0)
        return 0.0f;
    if (bin == ERROR_BINS - 1)
        return histogram->max;
    float middle = float_of((bin - 1 + BIN_LOWEST) << BIN_SHIFT | 1u << (BIN_SHIFT - 1));
    return fminf(middle, histogram->max);
}

/* ---- tallies ------------------------------------------------------------------------------------ */

void wave_tally_merge(struct wave_tally *into, const struct wave_tally *from)
{
    into->rays += from->rays;
    into->both_hit += from->both_hit;
    into->both_missed += from->both_missed;
    into->only_first += from->only_first;
    into->only_second += from->only_second;
    into->far += from->far;
    into->edges += from->edges;
    into->other_surface += from->other_surface;
    into->first_ns += from->first_ns;
    into->second_ns += from->second_ns;
    error_histogram_merge(&into->distance, &from->distance);
    error_histogram_merge(&into->relative, &from->relative);
    error_histogram_merge(&into->normal, &from->normal);
}

void wave_tally_figures(const struct wave_tally *tally, struct record_wave_comparison *figures)
{
    *figures = (struct record_wave_comparison){
        .wave = tally->wave,
        .kind = tally->kind,
        .rays = tally->rays,
        .both_hit = tally->both_hit,
        .both_missed = tally->both_missed,
        .only_tracer = tally->only_first,
        .only_reference = tally->only_second,
        .far = tally->far,
        .edges = tally->edges,
        .other_surface = tally->other_surface,
        .tracer_ns = tally->first_ns,
        .reference_ns = tally->second_ns,
        .distance_median = error_histogram_percentile(&tally->distance, 0.5),
        .distance_p99 = error_histogram_percentile(&tally->distance, 0.99),
        .distance_max = tally->distance.max,
        .relative_median = error_histogram_percentile(&tally->relative, 0.5),
        .normal_median = error_histogram_percentile(&tally->normal, 0.5),
        .normal_p99 = error_histogram_percentile(&tally->normal, 0.99),
        .normal_max = tally->normal.max,
    };
}

/* ---- two answers -------------------------------------------------------------------------------- */

static bool is_alive(const struct ray *ray)
{
    return ray->direction_t_max[3] > ray->origin_t_min[3];
}

static bool is_hit(const struct hit *hit)
{
    return hit->distance >= 0.0f;
}

static bool is_shadowed(uint visibility)
{
    return (visibility & VISIBILITY_LIT) != VISIBILITY_LIT;
}

static double direction_length(const struct ray *ray)
{
    double x = (double)ray->direction_t_max[0], y = (double)ray->direction_t_max[1];
    double z = (double)ray->direction_t_max[2];
    return sqrt(x * x + y * y + z * z);
}

/* Whether two hits are far apart. */
static bool are_far(const struct wave_compare_settings *settings, const struct ray *ray, const struct hit *first,
                    const struct hit *second)
{
    double length = direction_length(ray);
    double difference = fabs((double)first->distance - (double)second->distance) * length;
    double yardstick =
        fmax((double)settings->diagonal, fmin((double)first->distance, (double)second->distance) * length);
    return !(difference <= (double)settings->far_share * yardstick); /* far if it is not a number, too */
}

static bool distances_agree(const struct wave_compare_settings *settings, const struct ray *ray,
                            const struct hit *first, const struct hit *second)
{
    return is_hit(first) == is_hit(second) && (!is_hit(first) || !are_far(settings, ray, first, second));
}

static bool transmittances_agree(uint first, uint second)
{
    for (unsigned k = 0; k < 3; k++)
        if (fabs(visibility_transmittance(first, k) - visibility_transmittance(second, k)) >
            WAVE_FAR_TRANSMITTANCE)
            return false;
    return true;
}

static double snorm16(uint bits)
{
    return fmax((double)(int16_t)(uint16_t)bits / 32767.0, -1.0);
}

/* Unpacks like unpack_unit() of shaders/common/math.glsl, without normalising. */
static void unpack_normal(uint bits, double v[3])
{
    v[0] = snorm16(bits & 0xffffu);
    v[1] = snorm16(bits >> 16);
    v[2] = 1.0 - fabs(v[0]) - fabs(v[1]);
    if (v[2] < 0.0) {
        double x = v[0];
        v[0] = copysign(1.0 - fabs(v[1]), x);
        v[1] = copysign(1.0 - fabs(x), v[1]);
    }
}

/* By the arc tangent: a cosine knows no small angles. */
static double degrees_between(uint first, uint second)
{
    double a[3], b[3], cross = 0.0, cosine = 0.0;
    if (first == second)
        return 0.0;
    unpack_normal(first, a);
    unpack_normal(second, b);
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        double part = a[j] * b[k] - a[k] * b[j];
        cross += part * part;
        cosine += a[i] * b[i];
    }
    return atan2(sqrt(cross), cosine) * (180.0 / 3.14159265358979323846);
}

/* Whether two hits at the same distance are of the same surface. */
static bool same_surface(const struct hit *first, const struct hit *second)
{
    return ((first->material ^ second->material) & (HIT_MATERIAL_MASK | HIT_BACK_FACE)) == 0 &&
           degrees_between(first->normal_shading, second->normal_shading) <= WAVE_TURNED_DEGREES;
}

static void add_distance(struct wave_tally *tally, const struct wave_compare_settings *settings,
                         const struct ray *ray, const struct hit *first, const struct hit *second)
{
    double difference = fabs((double)first->distance - (double)second->distance);
    double relative = difference > 0.0 ? difference / (double)second->distance : 0.0;
    error_histogram_add(&tally->distance,
                        (float)(difference * direction_length(ray) / (double)settings->diagonal));
    error_histogram_add(&tally->relative, (float)relative);
}

static void add_normal(struct wave_tally *tally, const struct hit *first, const struct hit *second)
{
    error_histogram_add(&tally->normal, (float)degrees_between(first->normal_shading, second->normal_shading));
}

static void count_classes(struct wave_tally *tally, bool first_hit, bool second_hit)
{
    tally->rays++;
    tally->both_hit += first_hit && second_hit;
    tally->both_missed += !first_hit && !second_hit;
    tally->only_first += first_hit && !second_hit;
    tally->only_second += !first_hit && second_hit;
}

/* ---- waves -------------------------------------------------------------------------------------- */

/* False: it is a suspect. */
static bool compare_hits(struct wave_tally *tally, const struct wave_compare_settings *settings,
                         const struct ray *ray, const struct hit *first, const struct hit *second)
{
    if (!is_alive(ray) && !is_hit(first) && !is_hit(second))
        return true;
    count_classes(tally, is_hit(first), is_hit(second));
    if (!is_hit(first) || !is_hit(second))
        return is_hit(first) == is_hit(second);
    if (are_far(settings, ray, first, second)) {
        tally->far++;
        return false;
    }
    add_distance(tally, settings, ray, first, second);
    if (!same_surface(first, second))
        return false;
    add_normal(tally, first, second);
    return true;
}

static bool compare_visibility(struct wave_tally *tally, const struct ray *ray, uint first, uint second)
{
    bool first_hit = is_shadowed(first), second_hit = is_shadowed(second);
    if (!is_alive(ray) && !first_hit && !second_hit)
        return true;
    bool agree = transmittances_agree(first, second);
    /* The faintest translucency is lost in rounding: the reference decides. */
    count_classes(tally, agree ? second_hit : first_hit, second_hit);
    tally->far += !agree && first_hit && second_hit;
    return agree;
}

uint32_t wave_compare(struct wave_tally *tally, const struct wave_compare_settings *settings,
                      const struct wave_answers *answers, uint32_t *suspects)
{
    uint32_t count = 0;
    for (uint32_t i = 0; i < answers->count; i++) {
        const struct ray *ray = &answers->rays[i];
        bool settled =
            answers->first_hits
                ? compare_hits(tally, settings, ray, &answers->first_hits[i], &answers->second_hits[i])
                : compare_visibility(tally, ray, answers->first_visibility[i], answers->second_visibility[i]);
        if (!settled)
            suspects[count++] = i;
    }
    return count;
}

/* The error of a ray by rounding, in units of the last place: an intersection is a handful of operations on
 * coordinates of that size, and so is a change of space. */
#define MOVE_STEPS 8

void wave_moved_rays(const struct wave_compare_settings *settings, const struct wave_answers *answers,
                     uint32_t index, struct ray moved[WAVE_MOVES])
{
    const struct ray *ray = &answers->rays[index];
    float along = ray->direction_t_max[3];
    if (answers->first_hits)
        along = fmaxf(answers->first_hits[index].distance, answers->second_hits[index].distance);
    double length = direction_length(ray);
    /* A shadow ray's occluder is in the scene. */
    double reach = answers->first_hits ? (double)along : fmin((double)along, (double)settings->diagonal / length);
    double size = 0.0;
    for (int i = 0; i < 3; i++) {
        double from = (double)ray->origin_t_min[i], to = from + reach * (double)ray->direction_t_max[i];
        size = fmax(size, fmax(fabs(from), fabs(to)));
    }
    float step = (float)(MOVE_STEPS * (double)FLT_EPSILON * size);
    for (int corner = 0; corner < WAVE_MOVES; corner++) {
        moved[corner] = *ray;
        for (int i = 0; i < 3; i++)
            moved[corner].origin_t_min[i] += corner >> i & 1 ? step : -step;
    }
}

static bool is_on_edge(const struct wave_compare_settings *settings, const struct ray *ray,
                       const struct hit *first, bool agree, const struct hit *moved)
{
    for (int i = 0; i < WAVE_MOVES; i++)
        if (distances_agree(settings, ray, first, &moved[i]) && (!agree || same_surface(first, &moved[i])))
            return true;
    return false;
}

static void settle_hits(struct wave_tally *tally, const struct wave_compare_settings *settings,
                        const struct ray *ray, const struct hit *first, const struct hit *second,
                        const struct hit *moved)
{
    bool agree = distances_agree(settings, ray, first, second);
    if (is_on_edge(settings, ray, first, agree, moved)) {
        tally->edges += !agree;
        return;
    }
    if (agree) {
        tally->other_surface++;
        add_normal(tally, first, second);
    } else if (is_hit(first) && is_hit(second)) {
        add_distance(tally, settings, ray, first, second);
    }
}

void wave_settle(struct wave_tally *tally, const struct wave_compare_settings *settings,
                 const struct wave_answers *answers, uint32_t index, const struct hit *moved_hits,
                 const uint *moved_visibility)
{
    if (moved_hits) {
        settle_hits(tally, settings, &answers->rays[index], &answers->first_hits[index],
                    &answers->second_hits[index], moved_hits);
        return;
    }
    bool is_edge = false;
    for (int i = 0; i < WAVE_MOVES; i++)
        is_edge = is_edge || transmittances_agree(answers->first_visibility[index], moved_visibility[i]);
    tally->edges += is_edge;
}
