/* SPDX-License-Identifier: MIT */
/* Layers of a picture beside its light: properties of the first surface of each ray, also if light passes
 * through it. Each sample of a slice is noted in sums of the slice, which reach the picture with the slice;
 * protocol/words.def defines the layers, ENUMERATION(LAYER). */
#ifndef FARLIGHT_RENDER_PASSES_LAYERS_H
#define FARLIGHT_RENDER_PASSES_LAYERS_H

#include "render/context/pass.h"
#include "render/passes/layers/moves.h"
#include "render/picture/picture.h"
#include "render/waves/notes.h"

struct layers {
    struct wave_notes notes; /* notes.layers 0: no layer is wanted, and no memory is held */
    struct moves moves;
    struct gpu_buffer ao_rays, ao_times, ao_visibility;
    uint32_t noting; /* the slice's layers that hits are noted in */
    bool noted;      /* properties of the slice's hits are noted */
    uint32_t asked;  /* rays of ao that each hit of the slice has been given */
    uint32_t asking; /* rays of ao that are made and not traced to the end; 0: none */
};

/* Notes properties of first hits, and of other hits the places unknown to the tracer. */
extern const struct pass layers_pass;

/* Finds the layers that another pass wants. `is_shaded`: it shades the hits of its rays. */
void layers_begin(struct layers *layers, const struct render_frame *frame, bool is_shaded);
/* Whether they need the waves that the beauty does. */
bool layers_are_shaded(const struct layers *layers);
/* A new slice begins. */
void layers_begin_slice(struct layers *layers, const struct render_wave *wave);
/* Leaves LAYER_UNKNOWN of the current slice to the caller and returns the beginning of its plane in the sums;
 * UINT32_MAX: it is not wanted. layers->noting: the layers that remain. */
uint32_t layers_take_unknown(struct layers *layers);
/* Adds the current slice to the picture. Call it once the slice cannot be repeated. */
bool layers_accumulate(struct layers *layers, struct picture *picture, struct render_wave *wave,
                       struct error *error);
uint64_t layers_device_bytes(const struct layers *layers);

#endif
