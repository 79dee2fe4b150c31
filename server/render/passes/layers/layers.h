/* SPDX-License-Identifier: MIT */
/* What a picture's samples saw beside its light: layers of the first surface that each ray met, also where that
 * lets light through. One sample of the slice in hand after the other is noted in sums of the slice, which reach
 * the picture when the slice does; what a layer holds is said in protocol/words.def, ENUMERATION(LAYER). */
#ifndef FARLIGHT_RENDER_PASSES_LAYERS_H
#define FARLIGHT_RENDER_PASSES_LAYERS_H

#include "render/context/context.h"
#include "render/passes/layers/moves.h"
#include "render/picture/picture.h"

struct layers {
    uint32_t wanted;        /* bits, without LAYER_BEAUTY; 0: nothing is done, and no memory is held */
    struct gpu_buffer sums; /* shared/layers.h */
    struct gpu_buffer covers;
    struct moves moves;
    uint32_t environment_group; /* of the light groups; 0: none */
    bool covers_by_shading;     /* not by first hits: other surfaces show through some */
    struct gpu_buffer ao_rays, ao_times, ao_visibility;
    uint32_t noting;        /* of the current slice: those that hits are noted in */
    bool noted;             /* of the current slice: properties of its hits */
    uint32_t asked;         /* likewise: rays of ao that each hit has been given */
    uint32_t asking;        /* likewise: and that are made and not traced to the end; 0: none */
    uint32_t plane_samples; /* likewise: its samples, so many in each plane of the sums */
};

/* Finds the layers that another pass wants. `is_shaded`: it shades what its rays hit. */
void layers_begin(struct layers *layers, struct render_context *context, bool is_shaded);
/* Whether they need the waves that the beauty does. */
bool layers_are_shaded(const struct layers *layers);
/* Reserves them, for slices of `samples` samples and waves of wave_capacity rays. */
bool layers_reserve(struct layers *layers, struct render_context *context, uint32_t slice_samples,
                    struct error *error);
/* The context has rays and hits of a new slice. */
void layers_begin_slice(struct layers *layers, const struct render_context *context);
/* Of the current slice LAYER_UNKNOWN is the caller's to write: where in the sums its plane begins; UINT32_MAX: it
 * is not wanted. layers->noting: what is left to note. */
uint32_t layers_take_unknown(struct layers *layers);
/* A short part of a slice's work; *done: there is no more. Leaves rays and hits as they are, and
 * the rays that it traces count as shadow rays. Inside no span. */
bool layers_step(struct layers *layers, struct render_context *context, bool *done, struct error *error);
/* Of a wave of secondary rays that is traced, and whose hits are listed: those that came to where the tracer knows
 * nothing. Inside no span. */
bool layers_mark_unknown(struct layers *layers, struct render_context *context, struct error *error);
/* Adds the current slice to the picture. Call it once the slice cannot be repeated. */
bool layers_accumulate(struct layers *layers, struct picture *picture, struct render_context *context,
                       struct error *error);
/* Layers of light (shaders/render/light_layers.glsl): whether there are some, and the sums to a program that notes
 * them, with these defines. */
bool layers_have_light(const struct layers *layers);
#define LAYERS_LIGHT_DEFINES 2
size_t layers_light_defines(const struct layers *layers, struct gpu_define defines[LAYERS_LIGHT_DEFINES]);
void layers_bind_light(struct layers *layers, const struct gpu_program *program);
bool layers_are_of_light(enum layer layer);
/* Whether the layer holds the first sample of each pixel in place of the mean of all. */
bool layers_of_first_sample(enum layer layer);
uint64_t layers_device_bytes(const struct layers *layers);
void layers_finish(struct layers *layers, struct gpu_device *device);

#endif
