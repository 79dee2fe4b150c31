/* SPDX-License-Identifier: MIT */
/* The pass over a picture's eyes, in place of first hits and waves, where their view is made from a key view's
 * layers. */
#ifndef FARLIGHT_RENDER_PASSES_KEY_VIEW_EYES_H
#define FARLIGHT_RENDER_PASSES_KEY_VIEW_EYES_H

#include "render/context/pass.h"
#include "render/passes/key_view/key_view.h"
#include "render/passes/layers/layers.h"

struct key_eyes {
    struct key_view *key;
    struct layers *layers;
    const struct picture *picture;
    enum key_gather {
        KEY_GATHER,      /* gathers the slice's sums where its rays meet layers */
        KEY_GATHER_MARK, /* keeps the intersections as sums, and marks texels */
        KEY_GATHER_KEPT, /* takes the intersections from the picture, and leaves black there */
    } what;
    bool are_found; /* wave->hits have the form of shared/eye_hit.h; else there are rays and intersections */
};

/* Intersects the eyes of a slice with the structure of the key view and gathers their radiance. LAYER_UNKNOWN is
 * written too, if it is wanted. */
extern const struct pass eyes_pass;

void key_eyes_announce(struct key_eyes *eyes, struct render_wave *wave);

#endif
