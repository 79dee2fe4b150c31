/* SPDX-License-Identifier: MIT */
/* Pictures of other eyes, made on the client from the layers of one key view.
 *
 *   struct fl_warp_error error = {0};
 *   struct fl_warp *warp = fl_warp_create(2, &error);
 *   fl_warp_set_key(warp, &key, &error);       colours and inverse depths of one to three layers
 *   fl_warp_update(warp, &part, &error);       a rectangle of a layer has come anew
 *   fl_warp_make(warp, &view, &picture, &error);
 *   fl_warp_destroy(warp);
 *
 * A texel holds a colour and w = unit / Z, where Z is the distance along the key view and the unit is a length
 * that the caller chooses. In (x, y, w) planes are planes and rays are segments. Texel (i, j) covers [i, i + 1) x
 * [j, j + 1), its value is that at its centre, row 0 is the top. w is 0 where nothing is there: in the first layer
 * that is the environment, infinitely far away; in the others nothing is known there.
 *
 * What may be off: from an eye within the radius of the key view's, each point is seen within `pixels` of where
 * the w that was given puts it. Where w was rounded, a point truly lies up to f * radius * w_error / unit further
 * off, f being the focal length in texels; struct fl_warp_counts says the sum.
 *
 * Everything that is given may come from a stranger: it is checked where it comes in, completely, and what is
 * wrong ends in an error that names it. A refused call changes nothing. A context belongs to one thread at a time;
 * it has threads of its own, which work only while a call does. The number of threads does not change a picture.
 *
 * Widmer, Pajak, Schulz, Pulli, Kautz, Goesele, Luebke. An Adaptive Acceleration Structure for Screen-space Ray
 * Tracing. 2015. Bowles, Mitchell, Sumner, Moore, Gross. Iterative Image Warping. 2012. */
#ifndef FARLIGHT_CLIENT_WARP_WARP_H
#define FARLIGHT_CLIENT_WARP_WARP_H

#include <stdbool.h>
#include <stdint.h>

#define FL_WARP_LAYERS_MAX 3u
#define FL_WARP_SIDE_MAX 8192u /* texels or pixels along a side: their coordinates keep 1 / 1024 as floats */
#define FL_WARP_TEXELS_MAX (1u << 24) /* of a layer, which takes some 25 bytes for each */
#define FL_WARP_THREADS_MAX 64u

enum fl_warp_error_code {
    FL_WARP_ERROR_NONE,
    FL_WARP_ERROR_ARGUMENT, /* what was given cannot be meant */
    FL_WARP_ERROR_MEMORY,
    FL_WARP_ERROR_SYSTEM,  /* no thread could be started */
    FL_WARP_ERROR_GIVEN_UP /* the caller said so */
};

struct fl_warp_error {
    enum fl_warp_error_code code;
    char field[48]; /* of what was given */
    char text[208]; /* what is wrong, and what is allowed */
};

/* Perspective, with square pixels; the axis of the view goes through the middle of the picture. */
struct fl_warp_camera {
    float world_from_view[12]; /* three rows; rigid; looks along -z, y up */
    float fov_y;               /* radians, of the whole height of texels or pixels, a margin included */
};

struct fl_warp_layer {
    const uint32_t *colours; /* RGBA8, red in the lowest byte; rows without gaps */
    const float *w;          /* not negative */
    const uint8_t *sticking; /* 255 times the share of a colour that follows the eye; NULL: nothing does */
};

/* What the arrays hold is copied. */
struct fl_warp_key {
    uint32_t width, height; /* texels, a margin round the picture included */
    struct fl_warp_camera camera;
    float unit;      /* metres; 0: one metre. w times QUADTREE_SLOPE_SCALE should suit half floats */
    float w_error;   /* the given w is at most so far from the true one: half the step of rounded w; 0: exact */
    float radius;    /* metres round the key view's eye: other eyes are within .. */
    float pixels;    /* .. and see each point off by at most so many texels */
    bool is_smeared; /* colours run over edges, as those of a JPEG or a video do: see FL_WARP_FILL */
    uint32_t layer_count;
    struct fl_warp_layer layers[FL_WARP_LAYERS_MAX]; /* the surface that 0, 1, 2 others hide at a texel */
};

/* A rectangle of one layer. */
struct fl_warp_part {
    uint32_t layer, x, y, width, height;
    struct fl_warp_layer texels; /* of the rectangle alone; rows without gaps */
};

enum fl_warp_quality {
    FL_WARP_TREE,     /* rays through a quadtree of planes: occlusion, all layers, the bound */
    FL_WARP_ITERATIVE /* a fixed-point iteration in the first layer: a fraction of the time, and no bound */
};

enum fl_warp_holes {
    FL_WARP_FILL,   /* what is not known has the colour of what lies behind it in the picture, of smeared pictures
                       half a texel further from the edge */
    FL_WARP_PATTERN /* likewise, under a faint pattern */
};

enum fl_warp_mask {
    FL_WARP_KNOWN,
    FL_WARP_BEHIND, /* behind what the last layer holds */
    FL_WARP_OUTSIDE /* outside what the key view sees */
};

struct fl_warp_view {
    uint32_t width, height; /* pixels */
    struct fl_warp_camera camera;
    enum fl_warp_quality quality;
    enum fl_warp_holes holes;
    /* NULL: never. Asked from time to time, by several threads; true: the call ends in FL_WARP_ERROR_GIVEN_UP,
     * with a part of the picture. */
    bool (*is_given_up)(const void *context);
    const void *given_up_context;
};

struct fl_warp_counts {
    float known, behind, outside; /* shares of the pixels */
    float deeper;                 /* of all pixels: known from the second or the third layer */
    float walked;                 /* of all pixels: rays that were traced node by node */
    float sticking;               /* mean of the pixels' shares that follow the eye: those of what is known */
    float bound_pixels;    /* texels of the key view that a known point may be off, from this eye; infinite for an
                              eye beyond the radius, and for FL_WARP_ITERATIVE */
    uint64_t processor_ns; /* of all threads */
};

/* The caller has the memory: width * height of each, or more with a stride. */
struct fl_warp_picture {
    uint32_t stride;   /* pixels from a row to the next one, of both; 0: the width */
    uint32_t *colours; /* as in layers */
    uint8_t *mask;     /* enum fl_warp_mask */
    uint8_t *sticking; /* as in layers, of the texel that is seen; 0 where none is known; NULL: not wanted */
    struct fl_warp_counts counts;
};

/* `threads` counts the caller's, which works too; 1 to FL_WARP_THREADS_MAX. */
struct fl_warp *fl_warp_create(unsigned threads, struct fl_warp_error *error);
void fl_warp_destroy(struct fl_warp *warp);

/* Replaces the key view. */
bool fl_warp_set_key(struct fl_warp *warp, const struct fl_warp_key *key, struct fl_warp_error *error);
/* One more layer of the key view that was set: what comes behind the last one. */
bool fl_warp_add_layer(struct fl_warp *warp, const struct fl_warp_layer *texels, struct fl_warp_error *error);
/* Of the key view that was set; the structure is what it would be if all had been set at once. */
bool fl_warp_update(struct fl_warp *warp, const struct fl_warp_part *part, struct fl_warp_error *error);
/* Of all threads, for the last fl_warp_set_key() or fl_warp_update(). */
uint64_t fl_warp_build_ns(const struct fl_warp *warp);

bool fl_warp_make(struct fl_warp *warp, const struct fl_warp_view *view, struct fl_warp_picture *picture,
                  struct fl_warp_error *error);

/* The nodes of a layer, as shaders/quadtree/layout.h has them in a slice; *count of two words each. NULL: there is
 * no such layer. Valid until the next call. */
const uint32_t *fl_warp_nodes(const struct fl_warp *warp, uint32_t layer, uint32_t *count);

#endif
