/* SPDX-License-Identifier: MIT */
/* Two tracers' answers to the same rays, compared ray by ray on the host. Pure: arrays in, statistics out.
 *
 * The first answer is the one under examination, the second the reference. Tallies add up in any order of rays, of
 * slices and of samples.
 *
 * Two exact tracers may differ where a ray passes within rounding of an edge, and neither is wrong. So a ray with
 * different answers is a suspect: the reference traces WAVE_MOVES copies of it, moved by a few rounding steps, and
 * if one of its answers is that of the first tracer, the ray was on an edge.
 *
 *   uint32_t n = wave_compare(tally, &settings, &answers, suspects);
 *   for each suspect: wave_moved_rays(..), traced by the reference, wave_settle(..) */
#ifndef FARLIGHT_RENDER_COMPARE_RAYS_H
#define FARLIGHT_RENDER_COMPARE_RAYS_H

#include "base/words.h"
#include "protocol/values.h"
#include "shared/hit.h"
#include "shared/ray.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Waves of a frame, and kinds of ray in each; further waves are counted with the last one. The wire's number.
 */
#define COMPARED_WAVES_MAX 64
#define COMPARISONS_MAX (COMPARED_WAVES_MAX * 2)

#define WAVE_MOVES 8
/* Default of `far_share`: some hundred times the rounding, and far below the distance between surfaces that a
 * picture shows apart. */
#define WAVE_FAR_SHARE 1e-4f
/* Beyond this two transmittances differ. */
#define WAVE_FAR_TRANSMITTANCE (2.0 / 255.0)
/* Beyond this two normals are those of two surfaces. */
#define WAVE_TURNED_DEGREES 5.0

/* Errors by size, in bins of the float's upper bits: seven of the mantissa, so that a percentile is true to 0.4 %
 * however many errors there are. Below 2^-48 counts as 0, from 2^16 on as the maximum. */
#define ERROR_BINS (64 * 128 + 2)
#define ERROR_MAX 1e30f /* in place of greater errors, and of NaN */
struct error_histogram {
    uint64_t counts[ERROR_BINS];
    uint64_t count;
    float max; /* exact */
};

void error_histogram_add(struct error_histogram *histogram, float error);
/* The smallest value that at least `share` (0 to 1) of the errors do not exceed; 0 without errors. */
float error_histogram_percentile(const struct error_histogram *histogram, double share);

/* The counts of one wave and kind; all-zero is empty. Large: keep it on the heap. */
struct wave_tally {
    uint32_t wave;
    enum ray_kind kind;
    uint64_t rays; /* alive rays, and dead ones with a hit */
    uint64_t both_hit, both_missed, only_first, only_second;
    uint64_t far;           /* among both_hit */
    uint64_t edges;         /* among only_first, only_second and far */
    uint64_t other_surface; /* among both_hit, not far and not on an edge: another normal, material or side */
    uint64_t first_ns, second_ns; /* tracing */
    struct error_histogram distance, relative, normal;
};

/* Adds the counts of `from`, whatever its wave. */
void wave_tally_merge(struct wave_tally *into, const struct wave_tally *from);

/* The figures of a tally. A shadow ray hits if it is not fully lit, and is far if the transmittances of both
 * differ by more than WAVE_FAR_TRANSMITTANCE; it has no distance and no normal. The first tracer is the job's, the
 * second one the reference. */
void wave_tally_figures(const struct wave_tally *tally, struct record_wave_comparison *figures);

struct wave_compare_settings {
    float diagonal;  /* the scene's, in world space; above 0 */
    float far_share; /* two hits are far from each other from this share on of the diagonal, or of the distance if
                        that is longer than the diagonal; above 0 */
};

/* Rays 0 .. count - 1 and both answers: hits of closest-hit waves, else (NULL) visibilities of any-hit ones. */
struct wave_answers {
    uint32_t count;
    const struct ray *rays;
    const struct hit *first_hits, *second_hits;
    const uint *first_visibility, *second_visibility;
};

/* Adds all rays. Returns the number of suspects, whose answers differ, with their indices in `suspects` (capacity
 * `count`), ascending: each must be settled. */
uint32_t wave_compare(struct wave_tally *tally, const struct wave_compare_settings *settings,
                      const struct wave_answers *answers, uint32_t *suspects);
/* The corners of a cube of a few rounding steps about the origin, with the same direction. */
void wave_moved_rays(const struct wave_compare_settings *settings, const struct wave_answers *answers,
                     uint32_t index, struct ray moved[WAVE_MOVES]);
/* The reference's answers to the moved rays; of hits and visibilities, one as in `answers`, the other NULL. */
void wave_settle(struct wave_tally *tally, const struct wave_compare_settings *settings,
                 const struct wave_answers *answers, uint32_t index, const struct hit *moved_hits,
                 const uint *moved_visibility);

#endif
