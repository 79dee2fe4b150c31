/* SPDX-License-Identifier: MIT */
#ifndef FARLIGHT_SHARED_FRAME_H
#define FARLIGHT_SHARED_FRAME_H
#include "shared/types.h"

#define UNIFORM_FRAME 0 /* binding of the uniform block below */

/* What every pass of a frame may know; a std140 block. The order of the pixels is that of `slots`: 8x8 tiles row
 * by row, Morton order inside a tile; tiles at the right and lower edge may stick out of the picture. */
struct frame_uniforms {
    vec4 world_from_view[3]; /* rows; rigid; looks along -z, y up */
    vec4 extent_near;        /* xy: half width and half height of the view at distance 1 (perspective) or of
                                the view itself (orthographic), z: near distance, w: 1 if orthographic */
    vec4 jitter_pixel;       /* xy: where in each pixel this sample lies, 0..1, from the top left;
                                z: far distance of an orthographic view; w: width of a sample in pixels */
    vec4 environment_colour; /* radiance, or what the image is multiplied by; w: rotation about +y, radians */
    vec4 irradiance[9];      /* rgb: of the environment, divided by pi: harmonics of a world-space normal */
    uint width, height;      /* pixels */
    uint tiles_across;
    uint sample_index;
    uint environment_kind; /* ENVIRONMENT_* */
    uint light_count;
    uint depth; /* bounces after the first hit */
    uint seed;
};
SHARED_SIZE(frame_uniforms, 272)

#define ENVIRONMENT_NONE 0u /* black; leaves the picture transparent */
#define ENVIRONMENT_CONSTANT 1u
#define ENVIRONMENT_IMAGE 2u
#define ENVIRONMENT_SKY 3u /* the default of a scene without any light */

#endif
