/* SPDX-License-Identifier: MIT */
/* Uniforms of a frame: camera, pixels, samples and environment. */
#ifndef FARLIGHT_SHARED_FRAME_H
#define FARLIGHT_SHARED_FRAME_H
#include "shared/types.h"

#define UNIFORM_FRAME 0         /* binding of the uniform block below */
#define SAMPLES_TOGETHER_MAX 16 /* per pixel in a wave; a power of two */

/* Uniforms of every pass of a frame; a std140 block. Pixels are in the order of `slots`: 8x8 tiles row by row,
 * Morton order inside a tile; tiles at the right and lower edge may extend beyond the picture. */
struct frame_uniforms {
    vec4 world_from_view[3]; /* rows; rigid; looks along -z, y up */
    vec4 extent_near;        /* xy: half width and half height of the view at distance 1 (perspective) or of
                                the view itself (orthographic), z: near distance, w: 1 if orthographic */
    vec4 far_width; /* x: far distance of an orthographic view; y: width of a sample in pixels; z: 1: the picture
                       does not show the environment behind its surfaces; w unused */
    /* Positions of the current samples from each pixel's top left, two in each vector, if these are the same in
     * all pixels. */
    vec4 sample_places[8];
    /* eye_steps: xy: in view space, from the eye of a view to that of the next one to the right; zw: to that of
     * the next one below. eyes_middle: xy: the number of views across and down from the first eye to the
     * camera; z, w unused */
    vec4 eye_steps, eyes_middle;
    vec4 lens; /* x: radius, 0: a pinhole; y: distance of the plane of focus along the view; z, w unused */
    vec4 environment_colour; /* radiance, or the image's factor; w: rotation about +y, radians */
    vec4 irradiance[9];      /* rgb: of the environment, divided by pi: harmonics of a world-space normal */
    vec4 filter_places[17];  /* table of the pixel filter, see server/render/picture/pixel_filter.h */
    uint width, height;      /* pixels of the picture */
    uint tiles_across;
    uint sample_index;     /* first of the current samples */
    uint sample_shift;     /* 2 to this power samples of each pixel are traced together, adjacent in a wave */
    uint environment_kind; /* ENVIRONMENT_* */
    uint light_count;
    uint depth; /* bounces after the first hit */
    uint seed;
    uint group_shift; /* 2 to this power samples of a pixel have their lights in order: sequence_pair_sorted */
    uint view_width, view_height; /* size of each view in pixels; views lie in the picture row by row */
};
SHARED_SIZE(frame_uniforms, 736)

#define ENVIRONMENT_NONE 0u /* black; leaves the picture transparent */
#define ENVIRONMENT_CONSTANT 1u
#define ENVIRONMENT_IMAGE 2u
#define ENVIRONMENT_SKY 3u      /* default of a scene without any light */
#define ENVIRONMENT_BACKDROP 4u /* a colour for rays that leave the scene; no light */

/* Dimensions of a sample, see common/sequence.glsl. Those from SEQUENCE_WAVE on are repeated for each wave of
 * its path, SEQUENCE_WAVE_SIZE apart. */
#define SEQUENCE_PIXEL 0u /* 2: place in the pixel */
#define SEQUENCE_LENS 1u  /* 2: place on the lens */
#define SEQUENCE_TIME 2u  /* 1 */
#define SEQUENCE_WAVE 3u
#define SEQUENCE_WAVE_SIZE 4u
#define SEQUENCE_LIGHT 0u          /* 2: choice of a light and the place on it */
#define SEQUENCE_LOBE 1u           /* 1: the lobe of the surface */
#define SEQUENCE_LOBE_DIRECTION 2u /* 2 */
#define SEQUENCE_PATH 0x8000u      /* integrator path has its own waves from here on; their number: */
#define SEQUENCE_PATH_SIZE 8u
#define SEQUENCE_PATH_LIGHT 0u       /* 2: choice of a light and the place on it */
#define SEQUENCE_PATH_ENVIRONMENT 1u /* 2 */
#define SEQUENCE_PATH_LOBE 2u        /* 1: the lobe of the surface */
#define SEQUENCE_PATH_DIRECTION 3u   /* 2 */
#define SEQUENCE_PATH_END 4u         /* 1: Russian roulette */
#define SEQUENCE_PATH_MET_LIGHT 5u   /* 1: choice among the lights that it hits */
#define SEQUENCE_PATH_PASS 6u        /* 1: glass: the light that is sampled */
/* Plus wave number * 0x10000 + light number, 2: for every light at every hit. */
#define SEQUENCE_EVERY_LIGHT 0x10000u

#endif
