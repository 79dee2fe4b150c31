/* SPDX-License-Identifier: MIT */
/* Pictures of another eye, made of a picture with depths: by client/warp, and in ways that others take, its
 * baselines and those of the tracer `quadtree`. Plain C, one thread.
 *
 * A pixel holds a colour and w = 1 / Z, where Z is the distance along the view; w is 0 where there is nothing but
 * the environment, which is infinitely far away. In (x, y, w) the way from one perspective camera to another is a
 * projective map. Pixel (i, j) covers [i, i + 1) x [j, j + 1), its value is that at its centre, row 0 is the top.
 */
#ifndef FARLIGHT_TESTS_BENCH_WARPS_H
#define FARLIGHT_TESTS_BENCH_WARPS_H

#include "render/frame.h"
#include "warp/warp.h"

#include <stdbool.h>
#include <stdint.h>

#define WARP_LAYERS_MAX FL_WARP_LAYERS_MAX

struct warp_layer {
    const uint32_t *colours; /* RGBA8, the red in the lowest byte */
    const float *w;          /* not negative */
    const uint8_t *sticking; /* as of client/warp; NULL: nothing does */
};

/* What there is, and what is wanted; the caller owns the arrays. */
struct warp_view {
    uint32_t width, height;
    uint32_t key_width, key_height; /* of the layers: as large at the least, a margin on both sides included */
    struct frame_camera from, to;   /* perspective; each of the whole height */
    float radius;                   /* metres round the eye, of the bound that client/warp keeps */
    uint32_t layer_count;           /* of the surfaces behind one another at a pixel */
    struct warp_layer layers[WARP_LAYERS_MAX];
};

/* What was made. */
struct warp_picture {
    uint32_t *colours;
    uint8_t *seen;     /* 1: some pixel of the view has what is here; 0: the colour is a guess */
    uint8_t *sticking; /* of client/warp: as of its pictures */
    float *w;          /* of mesh and splats: of what is here; negative: nothing was drawn */
    float *vertices;   /* of the mesh: x, y and w of each pixel of the key; w negative: behind the eye */
    uint64_t processor_ns;
    uint64_t
        build_ns; /* of client/warp: the structure, which serves all pictures of a key view; not in the other */
    struct fl_warp *client;
};

enum warp_method {
    WARP_NONE,       /* the picture as it is, all of it seen */
    WARP_ROTATION,   /* turned as the camera has, as if all were infinitely far away: a time warp */
    WARP_ITERATIVE,  /* client/warp: the pixel that comes to lie at this one, by a fixed-point iteration */
    WARP_QUADTREE,   /* client/warp: rays through a quadtree of planes */
    WARP_SPLAT,      /* each pixel is drawn as one pixel; cracks one pixel wide are closed along rows */
    WARP_SPLAT_BOTH, /* cracks are closed along columns too */
    WARP_MESH,       /* a vertex a pixel, two triangles between four, but across discontinuities */
    WARP_METHODS
};
extern const char *const warp_method_names[WARP_METHODS];

/* For views of that size, of layers with so many texels. False: no memory. */
bool warp_picture_init(struct warp_picture *picture, uint32_t width, uint32_t height, uint32_t key_texels);
void warp_picture_finish(struct warp_picture *picture);
/* Of the layers WARP_NONE, WARP_ROTATION and WARP_ITERATIVE take the first. Holes of splats and of the mesh have
 * the colour of the farther end of their row. False: client/warp refuses the view. */
bool warp_picture_make(struct warp_picture *picture, const struct warp_view *view, enum warp_method method);

/* Where a point of the first picture comes to lie in the second; false: behind its eye. */
bool warp_point(const struct warp_view *view, const float from[3], float to[3]);

/* Peak signal to noise ratio of 8-bit colours without their alpha, over the pixels that are seen; `seen` NULL:
 * all. Same pictures: infinite. */
double warp_psnr_db(const uint32_t *a, const uint32_t *b, const uint8_t *seen, uint32_t count);

/* As PPM, what is not seen in red; `seen` NULL: all is. False: it cannot be written. */
bool warp_write(const char *path, uint32_t width, uint32_t height, const uint32_t *colours, const uint8_t *seen);

#endif
