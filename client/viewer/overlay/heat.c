/* SPDX-License-Identifier: MIT */
/* Maps of errors as colours. */
#include "heat.h"

#include <math.h>
#include <stdlib.h>

/* Entries of the map "inferno" (van der Walt, Smith. 2015), evenly spaced. */
static const uint8_t places[][3] = {{0, 0, 4},     {31, 12, 72},   {85, 15, 109},  {136, 34, 106}, {186, 54, 85},
                                    {227, 89, 51}, {249, 140, 10}, {249, 201, 50}, {252, 255, 164}};
#define PLACE_COUNT (sizeof(places) / sizeof(places[0]))

void heat_colour(double share, uint8_t colour[3])
{
    const double at = fmax(0, fmin(1, share)) * (PLACE_COUNT - 1);
    const size_t low = at < PLACE_COUNT - 2 ? (size_t)at : PLACE_COUNT - 2;
    for (int c = 0; c < 3; c++)
        colour[c] = (uint8_t)lround(places[low][c] + (places[low + 1][c] - places[low][c]) * (at - (double)low));
}

static int error_of(const uint8_t *a, const uint8_t *b)
{
    int maximum = 0;
    for (int c = 0; c < 3; c++) {
        const int error = abs(a[c] - b[c]);
        maximum = error > maximum ? error : maximum;
    }
    return maximum;
}

void heat_map(const uint8_t *picture, const uint8_t *reference, size_t pixels, double top, uint8_t *out,
              struct heat_figures *figures)
{
    uint8_t colours[256][3];
    size_t counts[256] = {0};
    for (int error = 0; error < 256; error++)
        heat_colour(sqrt(error / 255.0 / top), colours[error]);
    for (size_t i = 0; i < pixels; i++) {
        const int error = error_of(picture + i * 4, reference + i * 4);
        counts[error]++;
        for (int c = 0; c < 3; c++)
            out[i * 4 + (size_t)c] = colours[error][c];
        out[i * 4 + 3] = 255;
    }
    *figures = (struct heat_figures){0};
    for (int error = 0; error < 256; error++) {
        const double share = pixels > 0 ? (double)counts[error] / (double)pixels : 0;
        figures->mean += share * error / 255;
        figures->max = counts[error] > 0 ? error / 255.0 : figures->max;
        figures->beyond += error / 255.0 > HEAT_BEYOND ? share : 0;
    }
}
