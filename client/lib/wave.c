/* SPDX-License-Identifier: MIT */
/* Figures of compared waves. A daemon's numbers may be inconsistent; nothing here depends on them. */
#include "lib/farlight.h"

static double larger(double a, double b)
{
    return a > b ? a : b;
}

double fl_wave_agreement(const struct record_wave_comparison *comparison)
{
    const double edges = (double)comparison->edges;
    const double rays = larger((double)comparison->rays - edges, 0);
    const double differing = (double)comparison->only_tracer + (double)comparison->only_reference +
                             (double)comparison->far + (double)comparison->other_surface - edges;
    return rays > 0 ? larger(1 - larger(differing, 0) / rays, 0) : 1;
}

void fl_wave_add(struct record_wave_comparison *into, const struct record_wave_comparison *from)
{
    into->rays += from->rays;
    into->both_hit += from->both_hit;
    into->both_missed += from->both_missed;
    into->only_tracer += from->only_tracer;
    into->only_reference += from->only_reference;
    into->far += from->far;
    into->edges += from->edges;
    into->other_surface += from->other_surface;
    into->tracer_ns += from->tracer_ns;
    into->reference_ns += from->reference_ns;
    into->distance_median = into->distance_p99 = into->relative_median = 0;
    into->normal_median = into->normal_p99 = 0;
    if (from->distance_max > into->distance_max)
        into->distance_max = from->distance_max;
    if (from->normal_max > into->normal_max)
        into->normal_max = from->normal_max;
}
