/* SPDX-License-Identifier: MIT */
/* Distributions of the pixel filters, inverted into places. */
#include "render/picture/pixel_filter.h"

#include <math.h>

#define PI 3.14159265358979323846
#define GAUSSIAN_SIGMA 0.5

double pixel_filter_radius(enum pixel_filter filter)
{
    switch (filter) {
    case FILTER_BLACKMAN_HARRIS:
    case FILTER_GAUSSIAN:
        return 1.5;
    case FILTER_TENT:
        return 1.0;
    case FILTER_BOX:
    case FILTER_COUNT:
        break;
    }
    return 0.5;
}

/* Harris. On the Use of Windows for Harmonic Analysis. 1978: the window of four terms, -92 dB. */
static double blackman_harris_integral(double x, double radius)
{
    double k = PI / radius;
    return 0.35875 * x + 0.48829 * sin(k * x) / k + 0.14128 * sin(2.0 * k * x) / (2.0 * k) +
           0.01168 * sin(3.0 * k * x) / (3.0 * k);
}

double pixel_filter_share(enum pixel_filter filter, double distance)
{
    double radius = pixel_filter_radius(filter), x = fmin(fmax(distance, 0.0), radius);
    switch (filter) {
    case FILTER_BLACKMAN_HARRIS:
        return blackman_harris_integral(x, radius) / blackman_harris_integral(radius, radius);
    case FILTER_GAUSSIAN:
        return erf(x / (GAUSSIAN_SIGMA * sqrt(2.0))) / erf(radius / (GAUSSIAN_SIGMA * sqrt(2.0)));
    case FILTER_TENT:
        return x * (2.0 - x);
    case FILTER_BOX:
    case FILTER_COUNT:
        break;
    }
    return x / radius;
}

void pixel_filter_places(float *places, enum pixel_filter filter)
{
    for (int i = 0; i < PIXEL_FILTER_INTERVALS; i++) {
        double beyond = (double)i / PIXEL_FILTER_INTERVALS, share = 1.0 - beyond * beyond;
        double low = 0.0, high = pixel_filter_radius(filter);
        for (int step = 0; step < 60; step++) {
            double middle = (low + high) / 2.0;
            if (pixel_filter_share(filter, middle) < share)
                low = middle;
            else
                high = middle;
        }
        places[i] = (float)high;
    }
    places[PIXEL_FILTER_INTERVALS] = 0.0f;
}

float pixel_filter_offset(const float *places, float number)
{
    float side = 2.0f * number - 1.0f;
    float at = sqrtf(1.0f - fabsf(side)) * (float)PIXEL_FILTER_INTERVALS;
    int i = at < (float)PIXEL_FILTER_INTERVALS ? (int)at : PIXEL_FILTER_INTERVALS - 1;
    float place = places[i] + (places[i + 1] - places[i]) * (at - (float)i);
    return side < 0.0f ? -place : place;
}
