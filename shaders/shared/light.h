/* SPDX-License-Identifier: MIT */
/* Lights of a scene on the device. */
#ifndef FARLIGHT_SHARED_LIGHT_H
#define FARLIGHT_SHARED_LIGHT_H
#include "shared/types.h"

/* A light in world space. Units by kind as in the protocol. */
struct light {
    vec4 position_kind;   /* kind as a float: LIGHT_*; plus light group / LIGHT_GROUPS_MAX */
    vec4 direction_range; /* unit, the direction in which the light travels; range 0: unlimited */
    vec4 colour;          /* w: sphere radius */
    vec4 half_u_inner;    /* rectangle: half edge; w: cosine of the inner cone */
    vec4 half_v_outer;    /* rectangle: half edge; w: cosine of the outer cone */
};
SHARED_SIZE(light, 80)
#define LIGHT_TEXELS 5 /* RGBA32F */
#define LIGHT_KIND_POINT 0
#define LIGHT_KIND_SPOT 1
#define LIGHT_KIND_DIRECTIONAL 2
#define LIGHT_KIND_RECTANGLE 3
#define LIGHT_KIND_SPHERE 4
#define LIGHT_KIND_STEADY 5
#define LIGHT_GROUPS_MAX 8.0f /* no group, and the groups of LAYER in protocol/words.def */

#endif
