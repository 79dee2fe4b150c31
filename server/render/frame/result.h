/* SPDX-License-Identifier: MIT */
/* The result of a frame: pixels, layers, stage times and statistics. */
#ifndef FARLIGHT_RENDER_FRAME_RESULT_H
#define FARLIGHT_RENDER_FRAME_RESULT_H

#include "base/stage_times.h"
#include "render/compare/rays.h"
#include "render/context/request.h"

/* A single sample, to which no other is added, lies in the pixel's middle; several are spread by the filter.
 * With a lens, several views, or where something moves, first hits are traced whatever `primary` says. What
 * PRIMARY_AUTO chooses follows from tracer, scene, size, whether there are several samples, and device: for a
 * device it is measured once. Where something moves, a tracer of stored samples is refused: ERROR_UNSUPPORTED,
 * "shutter".
 *
 * What a picture holds:
 *   linear formats  mean radiance of the samples times 2^exposure_stops, premultiplied by alpha
 *   RGBA8           the same divided by alpha, tone-mapped, sRGB
 *   planes          that, without alpha
 *                   If the scene's light is display values, RGBA8 is clamped and nothing else, and the linear
 *                   formats, the albedo too, have what a display emits for it
 *   layers          those beside the beauty are what protocol/words.def says of them (LAYER), and know of no
 *                   exposure
 *   attachments     those layers in 4 bytes a pixel, see frame_result_attachment()
 *   alpha           1 where there is a surface (what blended surfaces leave open goes on to what lies behind) and
 *                   where a background is seen; 0 where there is neither
 * What integrators do with `depth`: whitted, distributed and path bounce so often after the first hit (path: and
 * ask for light at the last hit too); raycast and ao do not bounce, and going straight on through layers is no
 * bounce. What `ao` shows is how open a first hit is, 1 where nothing is hit; all else show radiance. A scene with
 * no light and a black environment is lit by the default of shaders/shared/sky.h, unless it has emissive surfaces
 * that are brighter than 1 and the integrator (distributed, path) has them for lights. The same request on the
 * same revision and device gives the same bytes. Crops of one picture agree to the byte wherever they overlap.
 * With software GL and the tracer `bvh` they differ from the frame without a crop, and that cut into other slices,
 * by rounding: rays are traversed in packets there, whose size follows the coherence of the slice's wave. */
struct frame_result {
    /* Owned; free(). Layer after layer, each of width x height pixels, or planes; behind size_bytes lie the
     * attachments. */
    uint8_t *pixels;
    uint32_t layers; /* bits, at least one */
    uint32_t attachments;
    size_t size_bytes;
    uint32_t width, height;
    /* Samples held per pixel, those of earlier frames that it continues included; with noise: at most. */
    uint32_t samples;
    float noise; /* with noise in the request: the largest error of a tile, as far as is known; else 0 */
    enum pixel_format format;
    enum ycbcr ycbcr; /* in place of the RGBA8; base/ycbcr.h says how the planes lie in size_bytes */
    uint64_t revision;
    uint64_t primary_rays, shadow_rays, secondary_rays, splits;
    uint32_t sorted_waves; /* waves whose rays were sorted by direction */
    uint32_t device_waits; /* how often the host has waited for the device, bringing the scene there included */
    uint32_t dispatches, barriers; /* compute passes, and barriers between passes of any kind */
    uint64_t uploaded_bytes, structure_bytes;
    struct structure_rows structure; /* rows of the tracer about its structure and its waves */
    struct stage_times times;
    struct record_wave_comparison
        *comparisons; /* owned; ascending by wave and kind; NULL: tracers were not compared */
    uint32_t comparison_count;
};
void frame_result_finish(struct frame_result *result);
/* An attachment of width x height pixels: DEPTH f32, metres along the view to the first surface that the pixel's
 * first sample met, 0 where there is none; NORMALS 4 u8, (n / 2 + 1/2) * 255 of the mean of the samples in world
 * space, then 255, all 0 where there is none; STICKING 4 u8, the first: 255 times the mean of the samples' shares
 * that mirrors, glass and highlights have in them (shaders/common/sticking.glsl), of each 2 x 2 pixels the first
 * one's, the others 0. Valid as long as the pixels; `which` is one of the result's attachments. */
const uint8_t *frame_result_attachment(const struct frame_result *result, enum attachment which);

#endif
