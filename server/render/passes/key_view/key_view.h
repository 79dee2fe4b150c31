/* SPDX-License-Identifier: MIT */
/* Pictures of the depth layers of one view, the key view, kept from frame to frame, and pictures of other eyes
 * made from them: rays of an eye ask a structure of the key view where they hit, and take the radiance from there.
 * Widmer, Pajak, Schulz, Pulli, Kautz, Goesele, Luebke. An Adaptive Acceleration Structure for Screen-space Ray
 * Tracing. 2015, section 5. GL thread. */
#ifndef FARLIGHT_RENDER_PASSES_KEY_VIEW_H
#define FARLIGHT_RENDER_PASSES_KEY_VIEW_H

#include "gpu/readback.h"
#include "render/picture/picture.h"
#include "shared/key_view.h"

/* Zero is empty. Owner: a renderer. */
struct key_view {
    struct picture sums;                      /* sums of the layer that is rendered */
    struct gpu_buffer layers[KEY_LAYERS_MAX]; /* shared/key_view.h */
    struct gpu_buffer counts;                 /* uint: samples of eyes that no layer shows, of the current frame */
    struct gpu_buffer marks, tiles;           /* shared/key_view.h: texels that eyes see, of all layers */
    struct gpu_readback copy;                 /* a copy of the counts */
    /* Made layers are of this view, request and scene: */
    bool is_made;
    uint32_t first_sample;          /* first sample of the pixels that were texels */
    struct trace_view view, texels; /* the requested view; and the view whose pixels are texels */
    struct frame_request request;   /* the frame's that they were rendered for */
    uint64_t showing;               /* the scene's, see frame/state.h */
    uint32_t layer_count;
    bool is_marked; /* only texels that the eyes of the current frame see are rendered: of no use to others */
    uint32_t first_tile[KEY_LAYERS_MAX]; /* then, of each layer, in `tiles` */
    uint32_t tile_rows[KEY_LAYERS_MAX];
};

/* Whether the layers are those of that frame. */
bool key_view_is_of(const struct key_view *key, const struct trace_view *view, const struct frame_request *request,
                    uint64_t showing);
/* Makes room for layers of that view. */
bool key_view_reserve(struct key_view *key, struct gpu_device *device, const struct trace_view *texels,
                      uint32_t layer_count, struct error *error);
/* The request of a layer's picture: through the middle of each texel, without a lens. */
struct frame_request key_view_layer_request(const struct key_view *key, const struct frame_request *request);
/* Keeps a band of the layer's picture, which is key->sums. */
bool key_view_keep_band(struct key_view *key, const struct render_frame *frame, uint32_t layer, uint32_t band,
                        struct error *error);
/* Clears the marks: no texel is seen yet. */
bool key_view_mark_anew(struct key_view *key, struct gpu_device *device, struct error *error);
/* Lists the tiles; waits for the device. */
bool key_view_list_tiles(struct key_view *key, struct gpu_device *device, struct error *error);
/* The samples of the frame that no layer shows: clears their count, begins to copy it, and takes the copy. */
bool key_view_count_anew(struct key_view *key, struct gpu_device *device, struct error *error);
bool key_view_copy_count(struct key_view *key, struct gpu_device *device, struct error *error);
bool key_view_take_count(struct key_view *key, struct gpu_device *device, uint32_t *unknown, struct error *error);
uint64_t key_view_device_bytes(const struct key_view *key);
void key_view_finish(struct key_view *key, struct gpu_device *device); /* leaves it empty */

#endif
