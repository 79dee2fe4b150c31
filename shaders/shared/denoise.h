/* SPDX-License-Identifier: MIT */
/* Bindings and constants of the denoiser (server/render/passes/denoise/README.md). */
#ifndef FARLIGHT_SHARED_DENOISE_H
#define FARLIGHT_SHARED_DENOISE_H
#include "shared/path.h"

/* Texels noted for each sample of a slice, besides its radiance: albedo and the share of mirrors and glass;
 * normal and depth; with HAS_NOTED_MOTION the displacement of that place since the previous picture, and
 * DENOISE_SAYS .. as a number. */
#define DENOISE_NOTE_TEXELS_MAX 3u
#ifdef HAS_NOTED_MOTION
#define DENOISE_NOTE_TEXELS 3u
#else
#define DENOISE_NOTE_TEXELS 2u
#endif
#define DENOISE_SAYS 1u      /* the sample has a guide; 0: it took another way than most samples of its pixel */
#define DENOISE_MIRRORS 2u   /* most of the light at that place is seen in a smooth mirror; */
#define DENOISE_PASSES 4u    /* or through glass */
#define DENOISE_WAVES_MAX 3u /* bounces that are followed: into glass, out of it, and to the surface behind */
/* Share of the light that must go one way for that way to be followed. */
#define DENOISE_MOST 0.75f
/* Weight of samples that took another way. */
#define DENOISE_WHISPER (1.0f / 4096.0f)
/* Stands for a motion that is not known. */
#define DENOISE_ANEW 1e30f
#define DENOISE_MOVED_TEXELS 3u /* per instance: rows of a matrix, from its present place to its previous one */

/* Stands for the share of mirrors and glass: the sample left the scene. */
#define DENOISE_LEFT 1e6f
/* Minimum change of a surface's depth per pixel, as a share of the depth. */
#define DENOISE_DEPTH_SHARE 0.004f
/* Scale of normals: a turn by 14 degrees is the most that is expected within one surface. */
#define DENOISE_NORMAL_SCALE 32.0f
/* Scale of tones, roots of albedos: black and white lower the weight by this power of two, nearer tones by
 * less. */
#define DENOISE_TONE_SCALE 8.0f
/* Minimum albedo by which light is divided. */
#define DENOISE_ALBEDO_MIN 0.02f

/* Factor of the power that neighbours show up to which the noise of the halves is believed: sparse noise shows
 * in few of them. */
#define DENOISE_NEIGHBOURS_TRUST 2.0f
/* Share of the noise of mirrors and glass that is not believed where there are many samples. */
#define DENOISE_MIRROR_DOUBT 0.5f
/* Limit of brightness for the filter, in multiples of the surroundings, or of white. */
#define DENOISE_CAP 4.0f
/* Weight, among the surroundings, of pixels that see another surface: where few see the same one, all of them
 * together show the usual brightness. */
#define DENOISE_UNLIKE 0.0625f
/* Share of a pixel's filtered brightness that a pixel beside it must show; otherwise it counts as a speck. */
#define DENOISE_ALONE 0.5f
/* Number of standard deviations by which similar light may differ; in mirrors and glass lower by
 * DENOISE_MIRROR_EDGES. */
#define DENOISE_LIGHT_SCALE 2.0f
#define DENOISE_MIRROR_EDGES 0.75f
/* Errors count relative to the light; darker light counts as this. */
#define DENOISE_DARK 0.01f
/* Distance to each side of the pixels whose estimates are summed. */
#define DENOISE_CHOICE_RADIUS 3
/* Number of standard errors subtracted from an estimated gain. */
#define DENOISE_MARGIN 0.7f
/* Share of the light (root of the sum over colours) in about one step of 8 bits in the middle of their range:
 * noise below it is more often an error of the estimate than one of the picture. */
#define DENOISE_UNSEEN 0.02f
/* Square of such a step expected from detail, per square of a normal's turn: the light of a surface seen and
 * lit from above changes by about as much, and changes that are even on both sides cancel. */
#define DENOISE_TURNED_LIGHT 0.2f
/* Number of pixels beyond the first by which an estimate becomes fully trusted; an estimate from one pixel is
 * not. */
#define DENOISE_WITNESSES 3.0f

/* Limits within which the previous picture shows the same place: difference of normals (twice 1 - cos), and
 * distance from the surface as a share of its depth. */
#define DENOISE_SAME_TURN 0.1f
#define DENOISE_SAME_DEPTH 0.01f
/* Maximum worth of the history, in multiples of the frame's own samples. */
#define DENOISE_HISTORY_MAX 8.0f
/* Maximum while objects move, whose shadows and light fall on others. */
#define DENOISE_HISTORY_POSED_MAX 3.0f
/* Factor for mirrors and glass: they show other things as the eye moves. */
#define DENOISE_HISTORY_DOUBT 0.25f
/* Number of standard deviations by which history may differ from the frame's surrounding pixels. */
#define DENOISE_CLIP 3.0f

/* Storage buffers. */
#define BIND_DENOISE_NOTES BIND_PASS_0  /* vec4, DENOISE_NOTE_TEXELS per sample of the slice */
#define BIND_DENOISE_HALF BIND_PASS_1   /* uvec4 per slot of a band: render/denoise_half.glsl */
#define BIND_DENOISE_ALBEDO BIND_PASS_3 /* vec4 per slot: sums of notes */
#define BIND_DENOISE_NORMAL BIND_PASS_4 /* vec4 per slot: sums of notes */
#define BIND_DENOISE_MOTION BIND_WAVE   /* vec4 per slot: sums of notes, with HAS_NOTED_MOTION */
#define BIND_DENOISE_DOUBLED 0          /* vec4 per slot: the light of the last power of two of the samples */
#define BIND_DENOISE_SUM 3              /* sums of the picture, where BIND_ACCUMULATION is occupied */
#define BIND_DENOISE_OUT BIND_PASS_2    /* output of a pass over the strip */
#define BIND_DENOISE_GUIDE 0            /* the guide, in the pass that writes it */
#define BIND_DENOISE_SLOPE 0            /* the slopes, in the pass that writes them */
#define BIND_DENOISE_OUT_TOO 3          /* further output of these passes */

/* Texture units. */
#define UNIT_DENOISE_MOVED UNIT_PASS_0   /* vec4, DENOISE_MOVED_TEXELS per instance */
#define UNIT_DENOISE_LIGHT UNIT_TRACER_0 /* halves of the light at this level */
#define UNIT_DENOISE_GUIDE UNIT_TRACER_1
#define UNIT_DENOISE_FIRST UNIT_TRACER_2 /* halves of the light before any level */
#define UNIT_DENOISE_RISK UNIT_TRACER_3
#define UNIT_DENOISE_SLOPE UNIT_TRACER_5
#define UNIT_DENOISE_WIDER UNIT_TRACER_4 /* halves of the light at the next level */
#define UNIT_DENOISE_MOTION UNIT_PASS_0  /* motion of the strip's pixels */

#endif
