/* SPDX-License-Identifier: MIT */
/* Binding points that more than one room uses. Those of a tracer are in its layout.h, defined by the points
 * reserved here for tracers. */
#ifndef FARLIGHT_SHARED_BINDINGS_H
#define FARLIGHT_SHARED_BINDINGS_H

/* Storage buffers. OpenGL promises eight points, some of which have two meanings: no pass needs both. */
#define BIND_RAYS 0       /* passes that make rays; tracers have UNIT_RAYS */
#define BIND_VISIBILITY 0 /* any-hit waves: unorm 4x8 transmittance, 0: occluded */
#define BIND_HITS 1       /* passes without radiance; tracers have IMAGE_HITS */
#define BIND_WAVE 2       /* struct wave_state */
#define BIND_RAY_TIMES 3  /* passes that make rays; tracers have UNIT_RAY_TIMES */
#define BIND_TRACER_0 4   /* tracers' own */
#define BIND_TRACER_1 1
#define BIND_OPTICAL_DEPTHS 5 /* trace/wave.comp */
#define BIND_PASS_0 4         /* integrators' own, in passes without a tracer */
#define BIND_PASS_1 1
#define BIND_PASS_2 5
#define BIND_PASS_3 6
#define BIND_PASS_4 7

/* Image units. */
#define IMAGE_HITS 0
#define IMAGE_VISIBLE 0   /* primary.comp */
#define IMAGE_POSITIONS 0 /* deform.comp */
#define IMAGE_NORMALS 1
#define IMAGE_TANGENTS 2

/* Texture units. */
#define UNIT_TRIANGLES 0
#define UNIT_POSITIONS 1
#define UNIT_NORMALS 2
#define UNIT_TANGENTS 3
#define UNIT_TEXCOORDS 4
#define UNIT_COLOURS 5
#define UNIT_SPHERES 6
#define UNIT_SPHERE_MATERIALS 7
#define UNIT_TEXELS 8
#define UNIT_ENVIRONMENT 9
#define UNIT_TRACER_0 10
#define UNIT_TRACER_1 11
#define UNIT_TRACER_2 12
#define UNIT_TRACER_3 13
#define UNIT_TRACER_4 14
#define UNIT_TRACER_5 15

/* Units of deform.comp, which writes the scene and reads nothing of it. */
#define UNIT_REST_POSITIONS 0
#define UNIT_REST_NORMALS 1
#define UNIT_REST_TANGENTS 2
#define UNIT_JOINTS 3
#define UNIT_JOINT_WEIGHTS 4
#define UNIT_TARGET_POSITIONS 5
#define UNIT_TARGET_NORMALS 6
#define UNIT_TARGET_TANGENTS 7
#define UNIT_DEFORM_PARAMETERS 8

#define UNIT_SHADE_HITS UNIT_TRACER_0 /* passes without a tracer */
#define UNIT_SHADE_PATHS UNIT_TRACER_1
#define UNIT_SHADE_LIGHTS UNIT_TRACER_2
#define UNIT_SHADE_ENVIRONMENT UNIT_TRACER_3 /* choice among its directions: common/environment_choice.glsl */
#define UNIT_MOVE_CHILDREN UNIT_TRACER_0
#define UNIT_PASS_0 16
#define UNIT_PASS_1 17
#define UNIT_RAYS 18
#define UNIT_INSTANCES 19
#define UNIT_TABLES 20
#define UNIT_MOTIONS 21
#define UNIT_TRACER_6 23
#define UNIT_TRACER_7 24
#define UNIT_RAY_TILES 25 /* passes over a part of a picture: shared/key_view.h */
#define UNIT_RAY_TIMES 22 /* R32F, one per ray: 0 the shutter opens .. 1 it closes */

#endif
