/* SPDX-License-Identifier: MIT */
/* Notes of shading beside radiance, for layers of a picture: the parts of the light, and the covers of
 * samples. */
#ifndef FARLIGHT_RENDER_WAVES_NOTES_H
#define FARLIGHT_RENDER_WAVES_NOTES_H

#include "gpu/buffer.h"
#include "gpu/program.h"

#include <stdint.h>

/* Notes of the frame's layers; all-zero: none. */
struct wave_notes {
    uint32_t layers;            /* bits of the picture's layers beside the beauty */
    uint32_t plane_samples;     /* samples of the slice, in each plane of the sums */
    uint32_t environment_group; /* light group of the environment; 0: none */
    bool
        covers_by_shading; /* shading, not first hits, finds the covers of samples: surfaces show through others */
    struct gpu_buffer sums; /* shared/layers.h; also of layers that other passes note */
    struct gpu_buffer covers;
};

/* The number of a layer's plane in the sums. */
uint32_t notes_plane(const struct wave_notes *notes, uint32_t layer_bit);
/* The surfaces that cover samples, where shading finds them; NULL: it does not. */
struct gpu_buffer *notes_covers(struct wave_notes *notes);
/* Layers of light (shaders/render/light_layers.glsl): whether there are some, the defines of a program that notes
 * them, and their sums bound to it. */
bool notes_have_light(const struct wave_notes *notes);
#define NOTES_LIGHT_DEFINES 2
size_t notes_light_defines(const struct wave_notes *notes, struct gpu_define defines[NOTES_LIGHT_DEFINES]);
void notes_bind_light(struct wave_notes *notes, const struct gpu_program *program);

#endif
