/* SPDX-License-Identifier: MIT */
/* Bindings and constants of the denoiser (server/render/denoise/README.md). */
#ifndef FARLIGHT_SHARED_DENOISE_H
#define FARLIGHT_SHARED_DENOISE_H
#include "shared/path.h"

/* Of each sample of a slice, beside its radiance: albedo and the share of mirrors and glass; normal and depth;
 * with HAS_NOTED_MOTION where that place was in the picture before, less where it is, and DENOISE_SAYS .. as a
 * number. */
#define DENOISE_NOTE_TEXELS_MAX 3u
#ifdef HAS_NOTED_MOTION
#define DENOISE_NOTE_TEXELS 3u
#else
#define DENOISE_NOTE_TEXELS 2u
#endif
#define DENOISE_SAYS 1u      /* what guides; 0: the sample went another way than most of its pixel do */
#define DENOISE_MIRRORS 2u   /* most of what is seen there lies in a smooth mirror; */
#define DENOISE_PASSES 4u    /* behind glass */
#define DENOISE_WAVES_MAX 3u /* of bounces that are followed: into glass, out of it, and to what is behind */
/* So much of what is seen goes one way where that is followed. */
#define DENOISE_MOST 0.75f
/* The weight of what samples say that do not. */
#define DENOISE_WHISPER (1.0f / 4096.0f)
/* In place of a motion: it is not known. */
#define DENOISE_ANEW 1e30f
#define DENOISE_MOVED_TEXELS 3u /* an instance: rows of a matrix, from where it is to where it was */

/* In place of the share of mirrors and glass: the sample left the scene. */
#define DENOISE_LEFT 1e6f
/* Of the depth: a surface is not flatter than this, per pixel. */
#define DENOISE_DEPTH_SHARE 0.004f
/* A turn of the normal by 14 degrees is as far as one surface is expected to go. */
#define DENOISE_NORMAL_SCALE 32.0f
/* Black and white weigh by this power of two less: of their tones, roots of albedos, by as much less as they are
 * nearer. */
#define DENOISE_TONE_SCALE 8.0f
/* Light is divided by albedos no darker than this. */
#define DENOISE_ALBEDO_MIN 0.02f

/* The noise of the halves is believed up to twice the power that neighbours show: sparse noise shows in few of
 * them. */
#define DENOISE_NEIGHBOURS_TRUST 2.0f
/* The share of the noise of mirrors and glass that is not believed where there are many samples. */
#define DENOISE_MIRROR_DOUBT 0.5f
/* What is brighter than so many times what is around it, or than so much of white, is left out of the filter. */
#define DENOISE_CAP 4.0f
/* Of what is around it pixels that see another surface count so much less: where few see the same, all say what is
 * usual. */
#define DENOISE_UNLIKE 0.0625f
/* What is that much brighter is a speck where pixels beside it have less than this share of what is left of it. */
#define DENOISE_ALONE 0.5f
/* Light counts as like another that differs by this many standard deviations; in mirrors and glass by as much less
 * as DENOISE_MIRROR_EDGES says. */
#define DENOISE_LIGHT_SCALE 2.0f
#define DENOISE_MIRROR_EDGES 0.75f
/* Errors count by their share of the light, and of darker light as if it were this. */
#define DENOISE_DARK 0.01f
/* The pixels around whose estimates are summed, so many to each side. */
#define DENOISE_CHOICE_RADIUS 3
/* Of an estimated gain so many standard errors are left out. */
#define DENOISE_MARGIN 0.7f
/* A step by this share of the light (root of the sum over colours) is about one of 8 bits in the middle of their
 * range: noise below it is more often an error of the estimate than one of the picture. */
#define DENOISE_UNSEEN 0.02f
/* The square of such a step that is expected of detail, of each square of the turn of a normal: the light of a
 * surface that is seen and lit from above turns by about as much, and what is even on both sides cancels. */
#define DENOISE_TURNED_LIGHT 0.2f
/* An estimate that comes from one pixel says nothing, one from so many more all. */
#define DENOISE_WITNESSES 3.0f

/* What a picture before shows counts as the same place where normals differ by less than this (twice 1 - cos), and
 * where it is no farther off the surface than this, as a share of its depth. */
#define DENOISE_SAME_TURN 0.1f
#define DENOISE_SAME_DEPTH 0.01f
/* It is worth up to so many times the frame's own samples. */
#define DENOISE_HISTORY_MAX 8.0f
/* While things move, whose shadows and light fall on others: */
#define DENOISE_HISTORY_POSED_MAX 3.0f
/* Of mirrors and glass by so much less: they show other things as the eye moves. */
#define DENOISE_HISTORY_DOUBT 0.25f
/* It may differ from the pixels around in the frame by so many standard deviations of those. */
#define DENOISE_CLIP 3.0f

/* storage buffers */
#define BIND_DENOISE_NOTES BIND_PASS_0  /* vec4, DENOISE_NOTE_TEXELS a sample of the slice */
#define BIND_DENOISE_HALF BIND_PASS_1   /* uvec4 a slot of a band: render/denoise_half.glsl */
#define BIND_DENOISE_ALBEDO BIND_PASS_3 /* vec4 a slot: sums of notes */
#define BIND_DENOISE_NORMAL BIND_PASS_4 /* the same */
#define BIND_DENOISE_MOTION BIND_WAVE   /* the same, with HAS_NOTED_MOTION */
#define BIND_DENOISE_DOUBLED 0          /* vec4 a slot: the light of the last power of two of the samples */
#define BIND_DENOISE_SUM 3              /* the picture's, where BIND_ACCUMULATION is taken */
#define BIND_DENOISE_OUT BIND_PASS_2    /* what a pass over the strip writes */
#define BIND_DENOISE_GUIDE 0            /* the guide, where it writes that */
#define BIND_DENOISE_SLOPE 0            /* the slopes, where it writes those */
#define BIND_DENOISE_OUT_TOO 3          /* and what it writes beside these */

/* texture units */
#define UNIT_DENOISE_MOVED UNIT_PASS_0   /* vec4, DENOISE_MOVED_TEXELS an instance */
#define UNIT_DENOISE_LIGHT UNIT_TRACER_0 /* halves of the light at this level */
#define UNIT_DENOISE_GUIDE UNIT_TRACER_1
#define UNIT_DENOISE_FIRST UNIT_TRACER_2 /* halves of the light before any level */
#define UNIT_DENOISE_RISK UNIT_TRACER_3
#define UNIT_DENOISE_SLOPE UNIT_TRACER_5
#define UNIT_DENOISE_WIDER UNIT_TRACER_4 /* halves of the light at the next level */
#define UNIT_DENOISE_MOTION UNIT_PASS_0  /* of the strip */

#endif
