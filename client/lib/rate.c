/* SPDX-License-Identifier: MIT */
/* Exact frame rates from decimal numbers. */
#include "lib/rate.h"

#include <math.h>
#include <stdbool.h>

/* These whole numbers are nominal NTSC rates; 23.98 for 24000/1001 is off by 1.7e-4 of it. */
static bool is_ntsc(double rate, uint32_t *nominal)
{
    static const uint32_t known[] = {24, 30, 48, 60, 120, 240};
    for (unsigned i = 0; i < sizeof(known) / sizeof(known[0]); i++) {
        const double exact = known[i] * 1000.0 / 1001.0;
        *nominal = known[i];
        if (fabs(rate - exact) < 2e-4 * exact)
            return true;
    }
    return false;
}

void fl_rate_exact(float frames_per_second, uint32_t *numerator, uint32_t *denominator)
{
    const double rate = frames_per_second > 0.001f ? (double)frames_per_second : 0.001;
    uint32_t nominal;
    if (is_ntsc(rate, &nominal)) {
        /* 24, 30, .. have factors in common with 1000 but none with 1001, which is 7 * 11 * 13. */
        *numerator = nominal * 1000;
        *denominator = 1001;
        return;
    }
    for (*denominator = 1; *denominator < 1000; ++*denominator) {
        *numerator = (uint32_t)lround(rate * *denominator);
        if (*numerator > 0 && (float)((double)*numerator / *denominator) == (float)rate)
            return;
    }
    /* The nearest thousandth: only floats with many digits get here. */
    *numerator = (uint32_t)lround(rate * *denominator);
    *numerator += *numerator == 0;
}

uint32_t fl_rate_gif_delay(float frames_per_second)
{
    const double delay = round(100.0 / (double)frames_per_second);
    return delay < 2 ? 2 : delay > UINT16_MAX ? UINT16_MAX : (uint32_t)delay;
}
