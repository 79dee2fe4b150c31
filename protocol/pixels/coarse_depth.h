/* SPDX-License-Identifier: MIT */
/* Coarse depths in few bytes, which precede a frame's full depths so that a client can warp its picture early.
 * The full depths (inverse_depth.h) follow as `predicted` and do not depend on the coarse ones.
 *
 * Each square of 8 x 8 texels has its nearest depth. Between four similar depths the decoder interpolates
 * bilinearly, elsewhere a texel gets its square's depth, so that edges stay sharp. They lie up to 7 texels outside
 * the nearer object: background that moves with the object disturbs less than parts of it that stay behind.
 *
 * Measured on four models, 1280x720, e 0.25 pixels within 15 cm: bytes relative to the full depths, and PSNR of
 * views from 6.5 cm aside and from 15 cm aside, 5 ahead; with colours alone, with coarse depths, with full depths:
 *
 *   class room   0.107   22.2, 33.6, 35.4 dB   21.0, 31.0, 33.2 dB
 *   helmet       0.066   22.2, 37.6, 38.3      21.1, 35.0, 36.5
 *   kitchen      0.063   19.5, 27.6, 27.9      17.4, 24.3, 24.5
 *   dragon       0.050   13.6, 30.0, 35.3      11.2, 25.3, 28.1
 *
 * Any thread. */
#ifndef FARLIGHT_PROTOCOL_PIXELS_COARSE_DEPTH_H
#define FARLIGHT_PROTOCOL_PIXELS_COARSE_DEPTH_H

#include "protocol/pixels/predicted.h"

#include <stddef.h>
#include <stdint.h>

#define COARSE_DEPTH_SIDE 8u

/* Maximum size that coarse_depth_encode() may need; 0: it exceeds a size_t. */
size_t coarse_depth_bound(uint32_t width, uint32_t height);
/* Encodes rounded depths, pixels of two bytes as for `predicted`. Fails if `capacity` is too small. */
struct predicted_result coarse_depth_encode(const struct predicted_source *source, uint8_t *out, size_t capacity);
/* Fills width * height depths, all at least 1. *off is the encoder's bound of their error in steps; it is large
 * at the edges of near objects, so it does not serve as noise of w. Fails if `encoded` is damaged or has
 * another size. */
struct predicted_result coarse_depth_decode(uint32_t width, uint32_t height, const uint8_t *encoded,
                                            size_t encoded_bytes, uint16_t *rounded, uint16_t *off);

#endif
