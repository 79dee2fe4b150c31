/* SPDX-License-Identifier: MIT */
/* The errors of a picture as colours, and their figures. */
#ifndef FARLIGHT_VIEWER_OVERLAY_HEAT_H
#define FARLIGHT_VIEWER_OVERLAY_HEAT_H

#include <stddef.h>
#include <stdint.h>

/* An error is the difference of display values, 0 to 1, the maximum of a pixel's channels. */
struct heat_figures {
    double mean, max; /* over pixels */
    double beyond;    /* share of the pixels with more than HEAT_BEYOND */
};
#define HEAT_BEYOND 0.01

/* Pictures of 4 bytes a pixel, alpha is ignored. Black is no error, the brightest colour `top`, in between by the
 * square root of the error. */
void heat_map(const uint8_t *picture, const uint8_t *reference, size_t pixels, double top, uint8_t *out,
              struct heat_figures *figures);
/* The colour of a share of the top. */
void heat_colour(double share, uint8_t colour[3]);

#endif
