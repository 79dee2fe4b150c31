/* SPDX-License-Identifier: MIT */
/* Layered depth cubes hold what is in the scene: each texel of the three images against the triangles and spheres
 * under its middle, found without a rasteriser (axes_oracle.h); and both builds give the same samples. */
#include "tests/accuracy/motion_scenes.h"
#include "tests/accuracy/test_scenes.h"
#include "tests/unit/trace/axes_oracle.h"
#include "tests/unit/trace/ldc/fixture.h"
#include "tests/unit/trace/stack_scene.h"
#include "trace/ldc/build_state.h"
#include "tests/harness/test.h"

#define RESOLUTION 64u
/* Minimum of compared texels of the images; with fewer, the test shows nothing. */
#define COMPARED_MIN 500

/* A rounding of places of about `resolution` cells in 24 bits, some of them added up, and a slope of one. */
#define DEPTH_TOLERANCE_CELLS 1e-3
/* A normal of 2 x 16 bits is exact to 0.003 degrees; that of a small triangle is rounded before it is packed. */
#define NORMAL_COSINE 0.99999

/* In linear light: a colour's root is 8 bits in a hit, twice as wide where it is bright, then 8 bits of sRGB,
 * which are 2.3 as wide there; and it is taken from inside the triangle where rounding puts the middle out of it.
 */
#define COLOUR_TOLERANCE ((0.5 * 2 + 0.5 * 2.3 + 0.5) / 255)

static void expect_sample(const struct contents *contents, const struct oracle_scene *scene,
                          const struct oracle_sample *expected, uint32_t k)
{
    double normal[3], depth = float_of(contents->geometry[k][0]);
    assert_true(fabs(depth - expected->depth_cells) < DEPTH_TOLERANCE_CELLS);
    unpack_unit(normal, contents->geometry[k][1]);
    assert_true(oracle_dot(normal, expected->normal) > NORMAL_COSINE);
    const struct geometry *g = &scene->gpu->geometries[scene->gpu->instances[expected->instance].geometry].device;
    uint32_t material = g->kind == GEOMETRY_SPHERES ? scene->sphere_materials[expected->primitive]
                                                    : scene->triangles[expected->primitive][3];
    assert_int_equal(contents->surface[k][2] & SAMPLE_MATERIAL_MASK, material);
    double colour[4] = {1, 1, 1, 1};
    if (g->flags & GEOMETRY_HAS_COLOURS)
        oracle_colour(colour, scene, expected);
    for (int c = 0; c < 4; c++) {
        double stored = (contents->surface[k][0] >> 8 * c & 255) / 255.0;
        double linear = c == 3 ? stored : stored <= 0.04045 ? stored / 12.92 : pow((stored + 0.055) / 1.055, 2.4);
        assert_true(fabs(linear - colour[c]) < COLOUR_TOLERANCE);
    }
}

/* Two samples nearer to each other than rounding may change places. */
static bool are_apart(const struct oracle_texel *texel)
{
    for (uint32_t k = 1; k < texel->count; k++)
        if (texel->samples[k].depth_cells - texel->samples[k - 1].depth_cells < 2 * DEPTH_TOLERANCE_CELLS)
            return false;
    return true;
}

/* Texels that were compared. */
static uint32_t expect_like_oracle(struct fixture *fixture, unsigned which, const uint32_t *instances,
                                   uint32_t count)
{
    struct oracle_scene scene;
    struct oracle oracle;
    struct contents contents;
    uint32_t compared = 0;
    contents_read(&contents, &fixture->store, which);
    expect_consistent(&contents);
    oracle_scene_init(&scene, &fixture->gpu);
    struct oracle_cube cube = {.resolution = contents.cube.resolution, .cell_world = contents.cube.cell_world};
    memcpy(cube.lower_world, contents.cube.lower_world, sizeof(cube.lower_world));
    oracle_init(&oracle, &scene, &cube,
                fixture->options.ldc.form == TRACER_FORM_PAPER ? ORACLE_ONE : ORACLE_LEANING, instances, count);
    for (uint32_t i = 0; i < 3 * oracle.resolution * oracle.resolution; i++) {
        const struct oracle_texel *expected = &oracle.texels[i];
        if (expected->open || !are_apart(expected))
            continue;
        assert_int_equal(count_of(&contents, i), expected->count);
        for (uint32_t k = 0; k < expected->count; k++)
            expect_sample(&contents, &scene, &expected->samples[k], sample_of(&contents, i) + k);
        compared += expected->count > 0;
    }
    oracle_finish(&oracle);
    oracle_scene_finish(&scene);
    contents_free(&contents);
    return compared;
}

/* A cube of all instances; returns its samples. */
static uint32_t expect_scene_like_oracle(struct scene *scene, const struct tracer_options *options,
                                         void (*move)(struct scene_motion *motion, uint32_t poses))
{
    struct fixture fixture;
    fixture_init(&fixture, scene);
    fixture.options = *options;
    if (move) {
        struct scene_motion motion = {0};
        move(&motion, 1);
        fixture_update(&fixture, &motion);
        scene_motion_finish(&motion);
    }
    place(&fixture, LDC_CUBE_STATIC, RESOLUTION);
    build(&fixture, LDC_CUBE_STATIC, fixture.instances, fixture.gpu.instance_count);
    uint32_t compared =
        expect_like_oracle(&fixture, LDC_CUBE_STATIC, fixture.instances, fixture.gpu.instance_count);
    print_message("%u samples, %u layers, %u texels compared\n", fixture.store.cubes[0].sample_count,
                  fixture.store.cubes[0].layers_needed, compared);
    assert_in_range(compared, COMPARED_MIN, 3 * RESOLUTION * RESOLUTION);
    uint32_t samples = fixture.store.cubes[0].sample_count;
    fixture_finish(&fixture);
    return samples;
}

static const struct tracer_options defaults;

ALL_TESTS(open_device, close_device)

/* Instances as they are, mirrored, scaled unevenly, nested; spheres; skins and morph targets as the shutter opens,
 * some of it cut out by the alpha of vertices. */
TEST(each_texel_has_the_surfaces_under_its_middle)
{
    expect_scene_like_oracle(test_scene_soup(), &defaults, NULL);
    expect_scene_like_oracle(test_scene_spheres(), &defaults, NULL);
    expect_scene_like_oracle(test_scene_deformed(), &defaults, test_motion_of_deformed);
}

/* The paper's cube, peeled: a surface is in the image that its normal leans to most, and in no other. */
TEST_LONG(a_surface_is_in_one_image_of_the_papers)
{
    const uint32_t one =
        expect_scene_like_oracle(test_scene_soup(), &(struct tracer_options){.ldc.form = TRACER_FORM_PAPER}, NULL);
    assert_true(one < expect_scene_like_oracle(test_scene_soup(), &defaults, NULL));
}

/* ---- one pass against peeling ---- */

static struct scene *many_layers(void)
{
    return stack_scene(120, SHUFFLED, true);
}

/* Peeled is also what lists have no room for. */
static void build_by(struct fixture *fixture, struct contents *contents, ldc_unit *way)
{
    struct error error = {0};
    place(fixture, LDC_CUBE_STATIC, RESOLUTION);
    gpu_scene_bind(&fixture->gpu);
    enum tracer_progress progress =
        ldc_build_begin(fixture->builder, &fixture->store, LDC_CUBE_STATIC, &fixture->gpu, fixture->instances,
                        fixture->gpu.instance_count, &fixture->options, &error);
    for (int unit = 0; progress == TRACER_MORE; unit++) {
        progress = ldc_build_step(fixture->builder, true, &error);
        if (unit == 0) /* the build has begun */
            fixture->builder->task.next = way;
    }
    expect_ok(progress == TRACER_DONE, &error);
    contents_read(contents, &fixture->store, LDC_CUBE_STATIC);
    expect_consistent(contents);
}

/* Both all layers, and only the nearest ones. */
TEST_LONG(peels_and_lists_are_the_same_samples)
{
    struct scene *(*const scenes[])(void) = {test_scene_spheres, test_scene_translucent, test_scene_deformed,
                                             many_layers};
    for (size_t i = 0; i < sizeof(scenes) / sizeof(scenes[0]); i++) {
        struct fixture fixture;
        fixture_init(&fixture, scenes[i]());
        for (uint32_t layers = 0; layers <= 3; layers += 3) {
            struct contents peeled, listed;
            fixture.options.limits.ldc_layers = layers;
            build_by(&fixture, &peeled, ldc_peel);
            build_by(&fixture, &listed, ldc_lists);
            expect_same(&peeled, &listed);
            contents_free(&listed);
            contents_free(&peeled);
        }
        fixture_finish(&fixture);
    }
}
