/* SPDX-License-Identifier: MIT */
/* Depths as whole multiples of a step of 1 / depth. In a picture's coordinates and 1 / depth planes stay planes,
 * so neighbours predict one another well; and the displacement that an error of 1 / depth causes in another eye's
 * view depends on the distance of the eyes alone, so one step serves all depths.
 *
 * As `predicted` of 1280x720 depths of four models, e 0.25 pixels within 15 cm, rounded ones take 1/22 (a helmet),
 * 1/38 (a class room), 1/81 and 1/246 (a room, a kitchen in its own units) of the bytes of floats. Any thread. */
#ifndef FARLIGHT_PROTOCOL_PIXELS_INVERSE_DEPTH_H
#define FARLIGHT_PROTOCOL_PIXELS_INVERSE_DEPTH_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* The step, in 1 / metres, whose multiples move no point by more than `pixels` in the view of an eye within
 * `radius` metres, for a picture that is `height` pixels high and `fov_y` radians. Points nearer than some
 * radii move by up to (1 - radius / depth)^-2 times as much. */
float inverse_depth_step(float pixels, float radius, uint32_t height, float fov_y);
/* Rounds depths in metres; 0 means no surface in both forms. False: a depth is too near for 16 bits, or
 * invalid. */
bool inverse_depth_round(const float *depths, size_t count, float step, uint16_t *rounded);
void inverse_depth_restore(const uint16_t *rounded, size_t count, float step, float *depths);

#endif
