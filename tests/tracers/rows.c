/* SPDX-License-Identifier: MIT */
/* The tracers of the product, and their forms. */
#include "tests/tracers/contract.h"

/* Rays on the border of a texel may see either side of it, and where the images of two axes meet a ray may
 * pass between their samples. */
#define BORDERS "planes of samples overlap or leave gaps where images meet"

/* Layers are ordered by what is at a texel's centre; where surfaces cross, the order turns round within the texel.
 */
#define CROSSINGS "where surfaces cross, a texel has them in one order"
#define BEYOND                                                                                                    \
    "a plane goes on to the end of its texel, beyond the outline of its surface and to the crease with the next"
#define SEEN_STILL "it holds what is seen as the shutter opens"

#define STILL "it holds samples of the scene as the shutter opens"

static const struct tracer_row rows[] = {
    {.name = "naive", .number = 1},
#define BVH(form, ...)                                                                                            \
    {                                                                                                             \
        .name = "bvh" form, .number = 0, __VA_ARGS__                                                              \
    }
    BVH("", .is_form = false),
    BVH(", nodes of eight", .is_form = true, .options.bvh.nodes = BVH_NODES_EIGHT),
    BVH(", as in the paper", .is_form = true, .options.bvh.form = TRACER_FORM_PAPER),
    {.name = "reference",
     .number = 2,
     .refuses_sizes = "Embree's numbers end at 1e18, and it cannot invert what is scaled by less"},
#define LDC(form, ...)                                                                                            \
    {                                                                                                             \
        .name = "ldc" form, .number = 3, .is_form = sizeof(form) > 1, .refuses_motion = STILL, __VA_ARGS__        \
    }
    LDC("", .options.ldc.resolution = 256,
        .sampled = {.resolution = 256, .cells = 0.25, .wrong_max = 0.004, .reason = BORDERS}),
    LDC(", as in the paper", .options.ldc = {.resolution = 256, .form = TRACER_FORM_PAPER},
        .sampled = {.resolution = 256,
                    .cells = 2.5,
                    .wrong_max = 0.03,
                    .reason = BORDERS,
                    .coarse = "what comes within a cell of a sample's depth has hit it"}),
#define ABUFFER(form, ...)                                                                                        \
    {                                                                                                             \
        .name = "abuffer" form, .number = 4, .is_form = sizeof(form) > 1, .refuses_motion = STILL, __VA_ARGS__    \
    }
    ABUFFER("", .options.abuffer.resolution = 256,
            .sampled = {.resolution = 256, .cells = 0.25, .wrong_max = 0.01, .reason = BORDERS}),
    ABUFFER(", in voxels of 16 cells", .options.abuffer = {.resolution = 256, .voxels = 16},
            .sampled = {.resolution = 256, .cells = 0.25, .wrong_max = 0.01, .reason = BORDERS}),
    ABUFFER(", as in the paper", .options.abuffer = {.resolution = 256, .form = TRACER_FORM_PAPER},
            .sampled = {.resolution = 256,
                        .cells = 0.25,
                        .wrong_max = 0.01,
                        .reason = BORDERS,
                        .own_way = "whether it is inside is asked a step away"}),
#define RAYSPACE(form, ...)                                                                                       \
    {                                                                                                             \
        .name = "rayspace" form, .number = 5, .is_form = sizeof(form) > 1, .options = { __VA_ARGS__ }             \
    }
    RAYSPACE("", .rayspace.mode = RAYSPACE_MODE_JOINT),
    RAYSPACE(", flat", .rayspace.mode = RAYSPACE_MODE_FLAT),
    RAYSPACE(", as in the paper", .rayspace.form = TRACER_FORM_PAPER),
/* 256 texels along a face: those of a scene 3 metres before the eye are 2 cm wide. A plane may be off by 1/4 pixel
 * for an eye 100 metres aside, which is 1/4 / (128 * 100) of 1 / depth: less than 1 mm at 3 metres. */
#define QUADTREE(form, ...)                                                                                       \
    {                                                                                                             \
        .name = "quadtree" form, .number = 6, .is_form = sizeof(form) > 1, .refuses_motion = SEEN_STILL,          \
        __VA_ARGS__                                                                                               \
    }
#define QUADTREE_OPTIONS(...) QUADTREE_BOUND(0.25f, 100, __VA_ARGS__)
#define QUADTREE_BOUND(e, r, ...) .options.quadtree = {.resolution = 256, .pixels = e, .radius = r, __VA_ARGS__}
/* A single wrong ray is allowed. Of so many a twentieth wrong are more than that in 19 of 20 cases: with 4.75
 * wrong on average the chance of 0 or 1 is exp(-4.75) (1 + 4.75), which is 0.05. */
#define JUDGED_MIN 95
#define QUADTREE_SEEN(...)                                                                                        \
    .seen = {.resolution = 256, .wrong_max = 0.0025, .judged_min = JUDGED_MIN, .reason = CROSSINGS, __VA_ARGS__}
    QUADTREE("", QUADTREE_OPTIONS(.layers = 3), QUADTREE_SEEN(.layers = 3)),
    QUADTREE(", of one layer", QUADTREE_OPTIONS(.layers = 1), QUADTREE_SEEN(.layers = 1)),
    /* Planes for eyes nearby: space before the view counts as empty where a ray begins there. */
    QUADTREE(", of the view",
             QUADTREE_BOUND(0.001f, 0.4f, .layers = 3, .margin = 0.1f, .faces = QUADTREE_FACES_VIEW),
             QUADTREE_SEEN(.layers = 3, .is_one_face = true, .margin = 2 * 26 / 256.0)),
    /* A plane that a ray meets within 1.5 texels across and down may be that of its own surface, gone on beyond
       it. */
    QUADTREE(", planes", QUADTREE_OPTIONS(.layers = 3, .hits = QUADTREE_HITS_PLANE),
             .seen = {.resolution = 256,
                      .wrong_max = 0.01,
                      .judged_min = JUDGED_MIN,
                      .reason = BEYOND,
                      .layers = 3,
                      .off = 0.25 / (128 * 100.0),
                      .blind = 2.2}),
    /* Its bounds grow to four times that where things are far off, and planes go on as much farther. */
    QUADTREE(", as in the paper", QUADTREE_OPTIONS(.form = TRACER_FORM_PAPER),
             .seen = {.resolution = 256,
                      .wrong_max = 0.02,
                      .judged_min = JUDGED_MIN,
                      .reason = BEYOND,
                      .layers = 1,
                      .off = 4 * 0.25 / (128 * 100.0),
                      .blind = 2.2}),
};
TRACER_ROWS(rows)
