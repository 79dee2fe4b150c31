/* SPDX-License-Identifier: MIT */
/* The tracers of the product, and their forms. */
#include "tests/tracers/contract.h"

/* What falls on the border of a texel may be seen from either side of it, and where the images of two axes meet a
 * ray may pass between their samples. */
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
    BVH(", one ray alone", .is_form = true, .options.bvh.rays = 1),
    BVH(", packets of two", .is_form = true, .options.bvh.rays = 2),
    BVH(", packets of eight", .is_form = true, .options.bvh.rays = 8),
    BVH(" in the plain form", .is_form = true, .options.bench.bvh_layout = BVH_LAYOUT_PLAIN),
    BVH(" with spheres, packets of four", .is_form = true,
        .options = {.bvh.bounds = BVH_BOUNDS_SPHERE, .bvh.rays = 4}),
#define REFERENCE(form, ...)                                                                                      \
    {                                                                                                             \
        .name = "reference" form, .number = 2, __VA_ARGS__                                                        \
    }
    /* As many rays a call as the processor takes at once. */
    REFERENCE("", .refuses_sizes = "Embree's numbers end at 1e18, and it cannot invert what is scaled by less"),
    REFERENCE(", one ray a call", .is_form = true, .options.bench.reference_rays = 1),
    REFERENCE(", four rays a call", .is_form = true, .options.bench.reference_rays = 4),
    REFERENCE(", eight rays a call", .is_form = true, .options.bench.reference_rays = 8),
#define LDC(form, ...)                                                                                            \
    {                                                                                                             \
        .name = "ldc" form, .number = 3, .is_form = sizeof(form) > 1,                                             \
        .options = {.ldc.resolution = 256, __VA_ARGS__}, .sampled = {256, 0.25, 0.004, BORDERS},                  \
        .refuses_motion = STILL                                                                                   \
    }
    LDC("", .ldc.build = LDC_BUILD_AUTO),
    LDC(", peeled, packets of four", .ldc.build = LDC_BUILD_PEEL, .ldc.rays = 4),
    LDC(", in lists, by a pyramid", .ldc.build = LDC_BUILD_LISTS, .ldc.levels = LDC_LEVELS_PYRAMID),
    LDC(" by a pyramid, packets of four, layers one by one", .ldc.levels = LDC_LEVELS_PYRAMID, .ldc.rays = 4,
        .bench.ldc_layers_together = 1),
    LDC(" by blocks of 8", .ldc.levels = LDC_LEVELS_BLOCKS),
    LDC(" by blocks of 2, packets of four", .ldc.levels = LDC_LEVELS_BLOCKS, .ldc.block = 2, .ldc.rays = 4),
    LDC(" by blocks of 32, layers one by one", .ldc.levels = LDC_LEVELS_BLOCKS, .ldc.block = 32,
        .bench.ldc_layers_together = 1),
#define ABUFFER(form, ...)                                                                                        \
    {                                                                                                             \
        .name = "abuffer" form, .number = 4, .is_form = sizeof(form) > 1,                                         \
        .options.abuffer = {.resolution = 256, __VA_ARGS__}, .sampled = {256, 0.25, 0.01, BORDERS},               \
        .refuses_motion = STILL                                                                                   \
    }
    ABUFFER("", .search = ABUFFER_SEARCH_DDA),
    ABUFFER(", three columns a step", .search = ABUFFER_SEARCH_LINEAR3),
    ABUFFER(", one column a step", .search = ABUFFER_SEARCH_LINEAR1),
    ABUFFER(", in voxels of 16 cells", .voxels = 16),
#define RAYSPACE(form, ...)                                                                                       \
    {                                                                                                             \
        .name = "rayspace" form, .number = 5, .is_form = sizeof(form) > 1, .options = { __VA_ARGS__ }             \
    }
    RAYSPACE("", .rayspace.mode = RAYSPACE_MODE_JOINT),
    RAYSPACE(", flat", .rayspace.mode = RAYSPACE_MODE_FLAT),
    RAYSPACE(", flat, by spheres, in batches of 256", .rayspace.mode = RAYSPACE_MODE_FLAT,
             .rayspace.bounds = RAYSPACE_BOUNDS_SPHERE, .rayspace.batch = 256),
    RAYSPACE(", sorted, turned round, in four rounds, reduced by segments", .rayspace.sort = RAYSPACE_CHANCE_ON,
             .rayspace.turn = RAYSPACE_CHANCE_ON, .rayspace.rounds = 4,
             .rayspace.reduce = RAYSPACE_REDUCE_SEGMENTS),
    RAYSPACE(" with little room, in two rounds, reduced by a geometry shader", .bench.rayspace_pairs = 512,
             .rayspace.rounds = 2, .rayspace.reduce = RAYSPACE_REDUCE_GEOMETRY),
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
    /* The same planes, for eyes nearby: what lies before the view is taken to be empty where a ray begins there.
     */
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
    QUADTREE(", of boxes", QUADTREE_OPTIONS(.layers = 3, .nodes = QUADTREE_NODES_MINMAX),
             QUADTREE_SEEN(.layers = 3)),
    QUADTREE(", texel by texel", QUADTREE_OPTIONS(.layers = 3, .walk = QUADTREE_WALK_DDA),
             QUADTREE_SEEN(.layers = 3)),
};
TRACER_ROWS(rows)
