/* SPDX-License-Identifier: MIT */
/* A-buffers hold what is in the scene: each texel of the three images against the triangles and spheres under its
 * middle, found without a rasteriser (axes_oracle.h); and voxels know of what is in them. */
#include "tests/unit/trace/abuffer/fixture.h"
#include "tests/unit/trace/abuffer/scenes.h"
#include "tests/unit/trace/axes_oracle.h"

#include "gpu/registry.h"
#include "tests/harness/test.h"

#define RESOLUTION 64u
#define VOXELS 16u
/* Minimum of compared texels of the images; with fewer, the test shows nothing. */
#define COMPARED_MIN 500

/* A rounding of places of about `resolution` cells in 24 bits, some of them added up: of places aside it counts as
 * often as the plane rises with them. */
#define PLACE_TOLERANCE_CELLS 1e-3
/* A normal of 2 x 12 bits is exact to 0.05 degrees; that of a small triangle is rounded before it is packed. */
#define NORMAL_COSINE 0.99999

static double depth_tolerance(const struct oracle_sample *sample)
{
    return PLACE_TOLERANCE_CELLS * (1 + sample->slope);
}

/* Two samples nearer to each other than rounding may change places. */
static bool are_apart(const struct oracle_texel *texel)
{
    for (uint32_t k = 1; k < texel->count; k++)
        if (texel->samples[k].depth_cells - texel->samples[k - 1].depth_cells <
            depth_tolerance(&texel->samples[k]) + depth_tolerance(&texel->samples[k - 1]))
            return false;
    return true;
}

static bool is_body(const struct oracle_scene *scene, const struct oracle_sample *sample)
{
    const struct geometry *g = &scene->gpu->geometries[scene->gpu->instances[sample->instance].geometry].device;
    bool closed = g->kind == GEOMETRY_SPHERES || g->flags & GEOMETRY_CLOSED;
    return closed && (g->flags & GEOMETRY_HAS_CUTOUT) == 0;
}

static void expect_texel(const struct contents *contents, const struct oracle_scene *scene,
                         const struct oracle_texel *expected, uint32_t texel)
{
    int winding = 0, axis = (int)(texel / (contents->store.resolution * contents->store.resolution));
    assert_int_equal(contents->texels[texel][1], expected->count);
    for (uint32_t i = 0; i < expected->count; i++) {
        const struct oracle_sample *sample = &expected->samples[i];
        uint32_t k = contents->texels[texel][0] + i;
        double normal[3];
        assert_true(fabs(depth_of(contents, k) - sample->depth_cells) < depth_tolerance(sample));
        normal_of(normal, contents, k);
        assert_true(oracle_dot(normal, sample->normal) > NORMAL_COSINE);
        assert_int_equal(drawn_of(contents, k)[2], sample->instance);
        assert_int_equal(primitive_of(contents, k), sample->primitive);
        assert_int_equal(bounds_body(contents, k), is_body(scene, sample));
        if (is_body(scene, sample))
            winding += sample->normal[axis] < 0 ? 1 : -1;
        assert_int_equal(winding_of(contents, k), winding);
    }
}

/* Texels that were compared. */
static uint32_t expect_like_oracle(struct fixture *fixture, const struct contents *contents)
{
    struct oracle_scene scene;
    struct oracle oracle;
    struct oracle_cube cube = {.resolution = contents->store.resolution, .cell_world = contents->store.cell_world};
    uint32_t compared = 0, count = fixture->gpu.instance_count;
    uint32_t *instances = malloc((count + 1) * sizeof(*instances));
    for (uint32_t i = 0; i < count; i++)
        instances[i] = i;
    memcpy(cube.lower_world, contents->store.lower_world, sizeof(cube.lower_world));
    oracle_scene_init(&scene, &fixture->gpu);
    oracle_init(&oracle, &scene, &cube, ORACLE_ALL, instances, count);
    for (uint32_t i = 0; i < texel_count_of(contents); i++) {
        const struct oracle_texel *expected = &oracle.texels[i];
        if (expected->open || !are_apart(expected))
            continue;
        expect_texel(contents, &scene, expected, i);
        compared += expected->count > 0;
    }
    oracle_finish(&oracle);
    oracle_scene_finish(&scene);
    free(instances);
    return compared;
}

/* Who goes through a body comes out of it, whatever rounding has made of its sides. */
static void expect_balance(const struct contents *contents)
{
    for (uint32_t i = 0; i < texel_count_of(contents); i++)
        if (contents->texels[i][1] > 0)
            assert_int_equal(winding_of(contents, contents->texels[i][0] + contents->texels[i][1] - 1), 0);
}

/* ---- voxels ---- */

/* Known properties of a sample: its place, and the slopes of its plane. */
struct patch {
    double middle[3], normal[3];
    double half_depth; /* how far its plane reaches in depth over the texel */
    int axis;
    bool body;
};

static struct patch patch_of(const struct contents *contents, uint32_t texel, uint32_t sample)
{
    uint32_t along = contents->store.resolution;
    struct patch patch = {.axis = (int)(texel / (along * along)), .body = bounds_body(contents, sample)};
    int u = (patch.axis + 1) % 3, v = (patch.axis + 2) % 3;
    patch.middle[patch.axis] = depth_of(contents, sample);
    patch.middle[u] = texel % along + 0.5;
    patch.middle[v] = texel / along % along + 0.5;
    normal_of(patch.normal, contents, sample);
    patch.half_depth = 0.5 * (fabs(patch.normal[u]) + fabs(patch.normal[v])) / fabs(patch.normal[patch.axis]);
    return patch;
}

/* Rounding of a normal of 24 bits; within it of a bound, a sample may be on either side. */
#define NORMAL_SLACK 2e-3

/* Bits that a sample sets (`certain`), or may set. */
static int bits_of(const struct patch *patch, bool certain)
{
    const double *n = patch->normal, slack = certain ? NORMAL_SLACK : -NORMAL_SLACK;
    double maximum = fmax(fabs(n[0]), fmax(fabs(n[1]), fabs(n[2])));
    int bits = patch->body ? 0 : (int)ABUFFER_SUM_OPEN, axis = patch->axis;
    if (fabs(n[axis]) >= (double)AXES_OVERLAP * maximum + slack)
        bits |= (int)(n[axis] > 0 ? ABUFFER_SUM_UP : ABUFFER_SUM_DOWN) << axis;
    for (int k = 0; k < 3; k++) {
        bits |= fabs(n[k]) >= (double)AXES_OVERLAP * maximum + slack ? (int)ABUFFER_SUM_LEANS << k : 0;
        bits |= fabs(n[k]) < (double)ABUFFER_STEEP - slack ? (int)ABUFFER_SUM_STEEP << k : 0;
    }
    return bits;
}

/* Adds the bits to the cells, so many along a side, voxels or subvoxels, that the patch touches. */
static void spread(int *marks, int along, const struct contents *contents, const struct patch *patch, int bits,
                   double half, double half_depth)
{
    int first[3], last[3];
    double scale = along / (double)contents->store.resolution;
    for (int k = 0; k < 3; k++) {
        double reach = k == patch->axis ? half_depth : half;
        first[k] = (int)fmax(0, floor((patch->middle[k] - reach) * scale));
        last[k] = (int)fmin(along - 1, floor((patch->middle[k] + reach) * scale));
    }
    for (int z = first[2]; z <= last[2]; z++)
        for (int y = first[1]; y <= last[1]; y++)
            for (int x = first[0]; x <= last[0]; x++)
                marks[(z * along + y) * along + x] |= bits;
}

/* In the image that a surface leans to it is seen by as many samples as in any; the others say nothing. */
static bool leans(const struct patch *patch, double slack)
{
    const double *n = patch->normal, maximum = fmax(fabs(n[0]), fmax(fabs(n[1]), fabs(n[2])));
    return fabs(n[patch->axis]) >= (double)AXES_OVERLAP * maximum + slack;
}

/* Voxels or subvoxels, `along` along a side: the patches that they must have, and those that they may have.
 * The reach of a curved sphere is larger than that of the plane. */
static void spread_all(int *certain, int *possible, int along, const struct contents *contents, bool has_spheres)
{
    for (uint32_t i = 0; i < texel_count_of(contents); i++)
        for (uint32_t k = 0; k < contents->texels[i][1]; k++) {
            struct patch patch = patch_of(contents, i, contents->texels[i][0] + k);
            if (!leans(&patch, -NORMAL_SLACK))
                continue;
            if (leans(&patch, NORMAL_SLACK))
                spread(certain, along, contents, &patch, bits_of(&patch, true), 0.499, patch.half_depth - 0.01);
            double maximum = has_spheres ? 2 * patch.half_depth + 1 : patch.half_depth;
            spread(possible, along, contents, &patch, bits_of(&patch, false), 0.501, maximum * 1.02 + 0.03);
        }
}

/* Each voxel has all bits of the patches that touch it, and no others. */
static void expect_marks(const struct contents *contents, bool has_spheres)
{
    uint32_t along = contents->store.voxels_along, voxels = along * along * along, set = 0;
    int *certain = calloc(voxels, sizeof(int)), *possible = calloc(voxels, sizeof(int));
    spread_all(certain, possible, (int)along, contents, has_spheres);
    for (uint32_t i = 0; i < voxels; i++) {
        int bits = contents->sums[i][3];
        assert_int_equal(certain[i] & ~bits, 0);
        assert_int_equal(bits & ~possible[i], 0);
        set += bits != 0;
    }
    assert_in_range(set, 1, voxels);
    free(certain);
    free(possible);
}

/* Expects a mark on each subvoxel that a patch touches, and on no other. */
static void expect_subvoxels(const struct contents *contents, bool has_spheres)
{
    uint32_t along = 4 * contents->store.voxels_along, count = along * along * along, set = 0;
    int *certain = calloc(count, sizeof(int)), *possible = calloc(count, sizeof(int));
    assert_true(abuffer_has_subvoxels(&contents->store));
    spread_all(certain, possible, (int)along, contents, has_spheres);
    for (uint32_t i = 0; i < count; i++) {
        uint32_t x = i % along, y = i / along % along, z = i / along / along;
        uint32_t voxel = (z / 4 * (along / 4) + y / 4) * (along / 4) + x / 4,
                 bit = x % 4 + 4 * (y % 4) + 16 * (z % 4);
        bool is_set = false;
        for (int axis = 0; axis < 3; axis++)
            is_set |= (contents->subvoxels[voxel][axis][bit / 32] >> bit % 32 & 1) != 0;
        assert_true(is_set || certain[i] == 0);
        assert_true(!is_set || possible[i] != 0);
        set += is_set;
    }
    assert_in_range(set, 1, count);
    free(certain);
    free(possible);
}

/* ---- scenes ---- */

static void expect_scene_like_oracle(struct scene *scene,
                                     void (*move)(struct scene_motion *motion, uint32_t poses))
{
    struct fixture fixture;
    struct contents contents;
    fixture_init(&fixture, scene);
    if (move) {
        struct scene_motion motion = {0};
        move(&motion, 1);
        fixture_update(&fixture, &motion);
        scene_motion_finish(&motion);
    }
    build(&fixture, RESOLUTION, VOXELS);
    contents_read(&contents, &fixture.store);
    expect_consistent(&contents);
    uint32_t compared = expect_like_oracle(&fixture, &contents);
    print_message("%llu samples, at most %u of a texel, %u texels compared\n",
                  (unsigned long long)contents.store.sample_count, contents.store.depth_max, compared);
    assert_in_range(compared, COMPARED_MIN, 3 * RESOLUTION * RESOLUTION);
    expect_balance(&contents);
    expect_marks(&contents, fixture.gpu.has_spheres);
    contents_free(&contents);
    fixture.options.abuffer.form = TRACER_FORM_FAST; /* whose voxels know their occupied parts */
    build(&fixture, RESOLUTION, VOXELS);
    contents_read(&contents, &fixture.store);
    expect_subvoxels(&contents, fixture.gpu.has_spheres);
    contents_free(&contents);
    fixture_finish(&fixture);
}

ALL_TESTS(open_device, close_device)

/* Instances as they are, mirrored, scaled unevenly, nested; bodies in and through each other among open surfaces
 * and spheres, which balance; skins and morph targets as the shutter opens, some of it cut out by the alpha of
 * vertices.
 */
TEST(each_texel_has_the_surfaces_under_its_middle_and_voxels_know_of_them)
{
    expect_scene_like_oracle(test_scene_soup(), NULL);
    expect_scene_like_oracle(scene_of_bodies_and_others(), NULL);
    expect_scene_like_oracle(test_scene_deformed(), test_motion_of_deformed);
}

TEST(what_is_cut_out_bounds_no_body)
{
    struct fixture fixture;
    struct contents contents;
    fixture_init(&fixture, scene_of_cut_bodies());
    build(&fixture, RESOLUTION, VOXELS);
    contents_read(&contents, &fixture.store);
    expect_consistent(&contents);
    assert_in_range(expect_like_oracle(&fixture, &contents), COMPARED_MIN, 3 * RESOLUTION * RESOLUTION);
    for (uint32_t i = 0; i < contents.store.sample_count; i++)
        assert_false(bounds_body(&contents, i));
    contents_free(&contents);
    fixture_finish(&fixture);
}

/* Whether the image of an axis shows a sample well, 1, or not, 0; -1: rounding decides. */
static int is_shown(const struct contents *contents, uint32_t sample, uint32_t axis)
{
    double n[3], maximum = 0;
    normal_of(n, contents, sample);
    for (int k = 0; k < 3; k++)
        maximum = fmax(maximum, fabs(n[k]));
    const double beyond_steep = fabs(n[axis]) - (double)FACE_STEEP_BELOW;
    const double leans = fabs(n[axis]) - (double)AXES_OVERLAP * maximum;
    if (fabs(beyond_steep) < 0.002 || (beyond_steep < 0 && fabs(leans) < 0.002))
        return -1;
    return beyond_steep > 0 || leans > 0;
}

/* The search by planes looks at a surface where it is not steep. */
TEST(without_windings_no_image_has_steep_samples)
{
    struct fixture fixture;
    struct contents all, some;
    uint32_t left_out = 0;
    fixture_init(&fixture, scene_of_bodies_and_others());
    build(&fixture, RESOLUTION, VOXELS);
    contents_read(&all, &fixture.store);
    fixture.options.abuffer.form = TRACER_FORM_FAST;
    build(&fixture, RESOLUTION, VOXELS);
    contents_read(&some, &fixture.store);
    for (uint32_t texel = 0; texel < texel_count_of(&all); texel++) {
        const uint32_t axis = texel / (RESOLUTION * RESOLUTION);
        uint32_t at = some.texels[texel][0], end = at + some.texels[texel][1];
        for (uint32_t k = all.texels[texel][0]; k < all.texels[texel][0] + all.texels[texel][1]; k++) {
            const int shown = is_shown(&all, k, axis);
            const bool is_there =
                at < end && all.ids[k] == some.ids[at] && all.samples[k][0] == some.samples[at][0];
            if (shown >= 0)
                assert_int_equal(is_there, shown);
            at += is_there;
            left_out += !is_there;
        }
        assert_int_equal(at, end);
    }
    assert_true(left_out > all.store.sample_count / 10);
    contents_free(&all);
    contents_free(&some);
    fixture_finish(&fixture);
}
