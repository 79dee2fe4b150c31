/* SPDX-License-Identifier: MIT */
/* Warping: pictures for other eyes, made on the client from the layers of one key view.
 *
 *   struct fl_warp_error error = {0};
 *   struct fl_warp *warp = fl_warp_create(2, &error);
 *   fl_warp_set_key(warp, &key, &error);       colours and inverse depths of one to three layers
 *   fl_warp_update(warp, &part, &error);       new texels of a rectangle of a layer
 *   fl_warp_make(warp, &view, &picture, &error);
 *   fl_warp_destroy(warp);
 *
 * A texel holds a colour and w = unit / Z, where Z is the distance along the key view and the unit is a length
 * that the caller chooses. In (x, y, w) planes are planes and rays are segments. Texel (i, j) covers [i, i + 1) x
 * [j, j + 1), its value belongs to its centre, row 0 is the top. w is 0 where there is no surface: in the first
 * layer this is the environment, infinitely far away; in the others it means unknown.
 *
 * Accuracy: for an eye within the radius of the key view's, each point appears within `pixels` of the place where
 * the given w puts it. If w was rounded, a point may lie up to f * radius * w_error / unit further
 * off, where f is the focal length in texels; struct fl_warp_counts has the sum.
 *
 * Arguments may come from a stranger: they are checked completely on entry, and a fault
 * becomes an error that names it. A failed call changes nothing. A context belongs to one thread at a time;
 * it has threads of its own, which work only while a call does. The number of threads does not change a picture.
 *
 * Widmer, Pajak, Schulz, Pulli, Kautz, Goesele, Luebke. An Adaptive Acceleration Structure for Screen-space Ray
 * Tracing. 2015. Bowles, Mitchell, Sumner, Moore, Gross. Iterative Image Warping. 2012. */
#ifndef FARLIGHT_CLIENT_WARP_WARP_H
#define FARLIGHT_CLIENT_WARP_WARP_H

#include <stdbool.h>
#include <stdint.h>

#define FL_WARP_LAYERS_MAX 3u
#define FL_WARP_SIDE_MAX 8192u        /* texels or pixels along a side, so that floats keep 1 / 1024 of them */
#define FL_WARP_TEXELS_MAX (1u << 24) /* limit for a layer, which takes some 25 bytes for each texel */
#define FL_WARP_THREADS_MAX 64u

enum fl_warp_error_code {
    FL_WARP_ERROR_NONE,
    FL_WARP_ERROR_ARGUMENT, /* the caller passed something that is not allowed */
    FL_WARP_ERROR_MEMORY,
    FL_WARP_ERROR_SYSTEM,  /* no thread could be started */
    FL_WARP_ERROR_GIVEN_UP /* the caller has cancelled the call */
};

struct fl_warp_error {
    enum fl_warp_error_code code;
    char field[48]; /* argument at fault */
    char text[208]; /* a sentence with the fault and the allowed values */
};

/* A perspective camera with square pixels; its axis passes through the middle of the picture. */
struct fl_warp_camera {
    float world_from_view[12]; /* three rows; rigid; looks along -z, y up */
    float fov_y;               /* radians, of the whole height of texels or pixels, a margin included */
};

struct fl_warp_layer {
    const uint32_t *colours; /* RGBA8, red in the lowest byte; rows without gaps */
    const float *w;          /* A layer of the key view. The arrays are the caller's and are copied. */
    const uint8_t *sticking; /* 255 times the share of a colour that follows the eye; NULL: nothing does */
};

/* A key view; its arrays are copied. */
struct fl_warp_key {
    uint32_t width, height; /* texels, including a margin around the picture */
    struct fl_warp_camera camera;
    float unit;      /* metres; 0: one metre. w times QUADTREE_SLOPE_SCALE should suit half floats */
    float w_error;   /* maximum error of the given w: half the step of rounded w; 0: exact */
    float radius;    /* metres around the key view's eye: for other eyes within it .. */
    float pixels;    /* .. each point is displaced by at most this number of texels */
    bool is_smeared; /* colours run over edges, as in a JPEG or a video: see FL_WARP_FILL */
    uint32_t layer_count;
    struct fl_warp_layer layers[FL_WARP_LAYERS_MAX]; /* layer i holds the surface behind i others */
};

/* A rectangle of a layer. */
struct fl_warp_part {
    uint32_t layer, x, y, width, height;
    struct fl_warp_layer texels; /* texels of the rectangle only; rows without gaps */
};

enum fl_warp_quality {
    FL_WARP_TREE,     /* rays through a quadtree of planes: handles occlusion, uses all layers, keeps the bound */
    FL_WARP_ITERATIVE /* fixed-point iteration in the first layer: takes a fraction of the time, keeps no bound */
};

enum fl_warp_holes {
    /* Unknown pixels get the colour of the background beside them, for smeared pictures half a texel further
     * from the edge */
    FL_WARP_FILL,
    FL_WARP_PATTERN /* like FL_WARP_FILL, with a faint pattern on top */
};

enum fl_warp_mask {
    FL_WARP_KNOWN,
    FL_WARP_BEHIND, /* behind the surfaces of the last layer */
    FL_WARP_OUTSIDE /* outside the key view */
};

struct fl_warp_view {
    uint32_t width, height; /* pixels */
    struct fl_warp_camera camera;
    enum fl_warp_quality quality;
    enum fl_warp_holes holes;
    /* Called from time to time, by several threads; true: the call ends with FL_WARP_ERROR_GIVEN_UP and a part
     * of the picture. NULL: never. */
    bool (*is_given_up)(const void *context);
    const void *given_up_context;
};

struct fl_warp_counts {
    float known, behind, outside; /* shares of the pixels */
    float deeper;                 /* share of the pixels that come from the second or the third layer */
    float marched;                /* share of the pixels whose rays were traced node by node */
    float sticking;               /* mean share of sticking over known pixels */
    /* Maximum displacement of a known point from this eye, in texels of the key view; infinite for an eye
     * beyond the radius, and for FL_WARP_ITERATIVE */
    float bound_pixels;
    uint64_t processor_ns; /* time of all threads */
};

/* A picture in the caller's memory: width * height elements of each array, or more with a stride. */
struct fl_warp_picture {
    uint32_t stride;   /* pixels from a row to the next, for all arrays; 0: the width */
    uint32_t *colours; /* like those of fl_warp_layer */
    uint8_t *mask;     /* enum fl_warp_mask */
    /* Like those of fl_warp_layer, for the visible texel; 0 where none is known; NULL: not computed */
    uint8_t *sticking;
    struct fl_warp_counts counts;
};

/* Creates a context. `threads` includes the caller's, which works too; 1 to FL_WARP_THREADS_MAX. NULL: failure. */
struct fl_warp *fl_warp_create(unsigned threads, struct fl_warp_error *error);
void fl_warp_destroy(struct fl_warp *warp);

/* Replaces the key view. False: the old one stays. */
bool fl_warp_set_key(struct fl_warp *warp, const struct fl_warp_key *key, struct fl_warp_error *error);
/* Adds a layer to the key view, behind its last one. */
bool fl_warp_add_layer(struct fl_warp *warp, const struct fl_warp_layer *texels, struct fl_warp_error *error);
/* Replaces texels of the key view; the structure becomes the same as for a new key view with these texels. */
bool fl_warp_update(struct fl_warp *warp, const struct fl_warp_part *part, struct fl_warp_error *error);
/* Processor time of all threads in the last fl_warp_set_key() or fl_warp_update(). */
uint64_t fl_warp_build_ns(const struct fl_warp *warp);

bool fl_warp_make(struct fl_warp *warp, const struct fl_warp_view *view, struct fl_warp_picture *picture,
                  struct fl_warp_error *error);

/* The nodes of a layer, as shaders/quadtree/layout.h arranges them in a slice; *count of two words each. NULL:
 * there is no such layer. Valid until the next call. */
const uint32_t *fl_warp_nodes(const struct fl_warp *warp, uint32_t layer, uint32_t *count);

#endif
