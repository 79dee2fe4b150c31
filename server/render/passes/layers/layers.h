/* SPDX-License-Identifier: MIT */
/* What a picture's samples saw beside its light: layers of the first surface that each ray met, also where that
 * lets light through. One sample of the slice in hand after the other is noted in sums of the slice, which reach
 * the picture when the slice does; what a layer holds is said in protocol/words.def, ENUMERATION(LAYER). */
#ifndef FARLIGHT_RENDER_PASSES_LAYERS_H
#define FARLIGHT_RENDER_PASSES_LAYERS_H

#include "render/context/pass.h"
#include "render/passes/layers/moves.h"
#include "render/picture/picture.h"
#include "render/waves/notes.h"

struct layers {
    struct wave_notes notes; /* notes.layers 0: nothing is done, and no memory is held */
    struct moves moves;
    struct gpu_buffer ao_rays, ao_times, ao_visibility;
    uint32_t noting; /* of the current slice: those that hits are noted in */
    bool noted;      /* of the current slice: properties of its hits */
    uint32_t asked;  /* likewise: rays of ao that each hit has been given */
    uint32_t asking; /* likewise: and that are made and not traced to the end; 0: none */
};

/* Notes properties of first hits, and of other hits what the tracer does not know. */
extern const struct pass layers_pass;

/* Finds the layers that another pass wants. `is_shaded`: it shades what its rays hit. */
void layers_begin(struct layers *layers, const struct render_frame *frame, bool is_shaded);
/* Whether they need the waves that the beauty does. */
bool layers_are_shaded(const struct layers *layers);
/* A new slice begins. */
void layers_begin_slice(struct layers *layers, const struct render_wave *wave);
/* Of the current slice LAYER_UNKNOWN is the caller's to write: where in the sums its plane begins; UINT32_MAX: it
 * is not wanted. layers->noting: what is left to note. */
uint32_t layers_take_unknown(struct layers *layers);
/* Adds the current slice to the picture. Call it once the slice cannot be repeated. */
bool layers_accumulate(struct layers *layers, struct picture *picture, struct render_wave *wave,
                       struct error *error);
uint64_t layers_device_bytes(const struct layers *layers);

#endif
