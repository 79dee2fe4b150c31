/* SPDX-License-Identifier: MIT */
/* Contents of the nodes of quadtrees: their bits, exact planes of leaves, flags, boxes, and effects of the
 * settings of a build. */
#include "tests/fixtures/shader_probe.h"
#include "tests/unit/trace/quadtree/layers.h"
#include "tests/unit/trace/quadtree/scenes.h"

ALL_TESTS(open_device, close_device)

static const struct layers_view usual = {.width = 160,
                                         .height = 100,
                                         .faces = 1,
                                         .layers = 3,
                                         .focal = 115,
                                         .near = 0.05,
                                         .far = 1000,
                                         .pixels = 0.25,
                                         .radius = 0.15};

/* ---- the bits ---- */

#define CASES 65536u

/* Case i packs a plane whose slopes are the half floats i and 65535 - i, and a box; then it unpacks the
 * plane. */
static const char probe[] =
    "#include \"common/dispatch.glsl\"\n"
    "#include \"quadtree/node.glsl\"\n"
    "layout(std430, binding = 0) buffer result_block { uvec4 results[]; };\n"
    "void main() {\n"
    "    uint i = item_index();\n"
    "    uvec2 halves = uvec2(i, 65535u - i);\n"
    "    uvec2 given = uvec2(0x80000000u | i << 15u, halves.x | halves.y << 16u);\n"
    "    vec2 slopes = plane_slopes(given);\n"
    "    uvec2 plane = plane_node(plane_w(given), slopes, (i & 1u) != 0u);\n"
    "    uvec2 box = box_node(plane_w(given), 0.5 * plane_w(given), (i & 2u) != 0u);\n"
    "    results[3u * i] = uvec4(floatBitsToUint(slopes), plane);\n"
    "    results[3u * i + 1u] = uvec4(box, uint(node_is_plane(plane)), uint(node_is_plane(box)));\n"
    "    results[3u * i + 2u] = uvec4(node_index(i % 7u, i % 8u, uvec2(i % 11u, i % 5u)),\n"
    "                                 uint(plane_is_at_edge(plane)),\n"
    "                                 floatBitsToUint(box_range(box)));\n"
    "}\n";

static void expect_case(const struct quadtree_uniforms *u, uint32_t i, const uint32_t result[12])
{
    const uint32_t given[2] = {0x80000000 | i << 15, i | (65535 - i) << 16};
    const struct tree_plane plane = tree_plane_of(given), packed = tree_plane_of(&result[2]);
    const uint32_t exponents = given[1] & 0x7c007c00;
    const bool is_finite = (exponents & 0x7c00) != 0x7c00 && exponents >> 16 != 0x7c00;
    if (is_finite) { /* also of the smallest ones */
        assert_true(tree_float(result[0]) == plane.slope_x);
        assert_true(tree_float(result[1]) == plane.slope_y);
        assert_true(packed.slope_x == plane.slope_x && packed.slope_y == plane.slope_y);
    }
    assert_int_equal(result[2], (given[0] & 0xfffffffe) | (i & 1));
    assert_true(packed.at_edge == (i & 1) && result[9] == (i & 1));
    assert_true(tree_is_plane(&result[2]) && result[6] == 1);
    if (plane.w == plane.w) {
        const struct tree_box box = tree_box_of(&result[4]);
        assert_true(box.w_max == plane.w);
        assert_true(box.w_least == plane.w / 2 || plane.w < 1e-37);
        assert_true(box.has_gaps == (i >> 1 & 1));
        assert_true(!tree_is_plane(&result[4]) && result[7] == 0);
        assert_true(tree_float(result[10]) == box.w_max && tree_float(result[11]) == box.w_min);
    }
    assert_int_equal(result[8], tree_index(u, i % 7, i % 8, i % 11, i % 5));
}

TEST(c_and_glsl_agree_on_every_bit_of_a_node_and_on_its_place)
{
    struct error error = {0};
    struct gpu_buffer uniforms = {0}, results = {0};
    const struct quadtree_uniforms u = uniforms_of(&usual);
    uint32_t(*read)[12] = malloc(CASES * sizeof(*read));
    struct gpu_program program = shader_probe_compile(probe, NULL);
    expect_ok(gpu_buffer_upload(device, &uniforms, &u, sizeof(u), &error), &error);
    expect_ok(gpu_buffer_reserve(device, &results, CASES * sizeof(*read), &error), &error);
    gpu_buffer_bind_uniform(&uniforms, UNIFORM_QUADTREE);
    gpu_buffer_bind_storage(&results, 0);
    gpu_dispatch(device, &program, CASES);
    gpu_buffer_read(device, &results, 0, read, CASES * sizeof(*read));
    expect_ok(gpu_check(device, "nodes", &error), &error);
    for (uint32_t i = 0; i < CASES; i++)
        expect_case(&u, i, read[i]);
    shader_probe_finish(&program);
    gpu_buffer_finish(device, &uniforms);
    gpu_buffer_finish(device, &results);
    free(read);
}

/* ---- leaves ---- */

/* Rounding of float arithmetic, for triangles of a centimetre some metres away. Slopes, half floats, round a
 * share; a small triangle leaves a share of w over half a texel open; and at a grazing angle of cosine c,
 * which is about w / (f slope), a surface has c^2 rounded by some 2^-24 of the distance over its size, and a
 * point of a sphere lies some 2^-22 / c of the distance aside, as its root has that. */
#define W_SHARE 1e-5
#define PLACE_METRES 1e-6 /* rounding of a point some metres away */
#define SLOPE_SHARE 2e-3
#define SLOPE_OF_W 1e-4
#define GRAZING 2e-6
#define W_GRAZING 2.4e-7

static void expect_leaf(const struct layers *layers, uint32_t slice, uint32_t x, uint32_t y)
{
    const struct quadtree_uniforms *u = &layers->store.uniforms;
    const uint32_t face = slice / u->layers, *node = node_at(layers, slice, 0, x, y);
    const struct surface *surface = surface_at(layers, slice, x, y);
    const struct tree_plane plane = tree_plane_of(node);
    assert_true(tree_is_plane(node));
    if (surface->z < 0) {
        assert_true(node[0] == 0x80000000 && node[1] == 0);
        return;
    }
    const double w = surface_w(u, face, surface, x + 0.5, y + 0.5);
    const double w_x = surface_w(u, face, surface, x + 1.0, y + 0.5), slope_x = 2 * (w_x - w);
    const double w_y = surface_w(u, face, surface, x + 0.5, y + 1.0), slope_y = 2 * (w_y - w);
    const double steep = fabs(slope_x) + fabs(slope_y), tangent = (double)u->scale_centre[0] * steep / w;
    if (fabs(plane.w - w) > (W_SHARE + PLACE_METRES / surface->z + W_GRAZING * tangent) * w)
        fail_msg("texel %u %u of slice %u: w %.9g is to be %.9g, %.3g from edge on", x, y, slice, plane.w, w,
                 1 / tangent);
    const double slack = SLOPE_OF_W * w + (SLOPE_SHARE + GRAZING * tangent * tangent) * steep;
    if (fabs(plane.slope_x - slope_x) > slack || fabs(plane.slope_y - slope_y) > slack)
        fail_msg("texel %u %u of slice %u: slopes %g %g are to be %g %g (w %g)", x, y, slice, plane.slope_x,
                 plane.slope_y, slope_x, slope_y, w);
}

static void expect_leaves(struct scene *scene, const struct layers_view *view, uint32_t seen_min)
{
    struct layers layers;
    layers_init(&layers, scene, view);
    const struct quadtree_uniforms *u = &layers.store.uniforms;
    uint32_t seen = 0;
    for (uint32_t slice = 0; slice < u->faces * u->layers; slice++)
        for (uint32_t i = 0; i < u->padded_width * u->padded_height; i++) {
            const uint32_t x = i % u->padded_width, y = i / u->padded_width;
            expect_leaf(&layers, slice, x, y);
            seen += surface_at(&layers, slice, x, y)->z > 0;
        }
    assert_in_range(seen, seen_min, UINT32_MAX);
    layers_finish(&layers);
}

TEST(a_leaf_is_the_exact_plane_of_what_its_texel_shows)
{
    struct layers_view view = usual;
    expect_leaves(curved_scene(), &view, 15000);
    view.orthographic = true;
    view.focal = 30;
    view.far = 20;
    expect_leaves(curved_scene(), &view, 7500);
    /* Random triangles and spheres inside one another: a layer may see the far side of a sphere alone. */
    view = usual;
    view.eye[2] = 3;
    expect_leaves(test_scene_spheres(), &view, 7500);
    view = usual; /* with all faces of a cube */
    view.width = view.height = 64;
    view.focal = 32;
    view.faces = 6;
    view.turn = 0.4;
    view.eye[1] = 0.6f;
    view.eye[2] = -1.8f;
    expect_leaves(curved_scene(), &view, 10000);
}

/* Its texels are set by hand, as no picture shows it: points, lines, and planes through the eye. */
TEST(a_triangle_without_a_plane_has_a_finite_w_between_those_of_its_corners)
{
    static const float positions[9][3] = {{0, 0, -2},       {1, 0, -2}, {2, 0, -2}, {0.1f, 0, -1}, {0.2f, 0, -3},
                                          {0.3f, 0.3f, -3}, {0, 0, 0},  {0, 1, -2}, {0, -1, -4}};
    static const uint32_t indices[4][3] = {{0, 0, 0}, {0, 1, 2}, {3, 3, 5}, {6, 7, 8}};
    struct test_edits edits = {.scene = test_scene_create()};
    struct layers_view view = usual;
    struct layers layers;
    view.layers = 1;
    test_mesh(&edits, 10, positions, 9, indices[0], 4);
    test_node(&edits, 1, 0, NODE_MESH, 10, NULL);
    test_commit(&edits);
    layers_init(&layers, edits.scene, &view);
    const struct quadtree_uniforms *u = &layers.store.uniforms;
    uint32_t(*visible)[2] = malloc((size_t)u->padded_width * u->padded_height * sizeof(*visible));
    for (uint32_t i = 0; i < u->padded_width * u->padded_height; i++) {
        visible[i][0] = 1;
        visible[i][1] = i % 4;
    }
    glBindTexture(GL_TEXTURE_2D_ARRAY, layers.store.visible.name);
    glTexSubImage3D(GL_TEXTURE_2D_ARRAY, 0, 0, 0, 0, (GLsizei)u->padded_width, (GLsizei)u->padded_height, 1,
                    GL_RG_INTEGER, GL_UNSIGNED_INT, visible);
    layers_build(&layers);
    for (uint32_t i = 0; i < u->width * u->height; i++) {
        const uint32_t x = i % u->width, y = i / u->width, *node = node_at(&layers, 0, 0, x, y);
        const struct tree_plane plane = tree_plane_of(node);
        assert_true(tree_is_plane(node));
        assert_true(plane.w >= view.near / 4.001 && plane.w <= 1.001);
        assert_true((node[1] & 0x7c00) != 0x7c00 && (node[1] >> 16 & 0x7c00) != 0x7c00);
    }
    free(visible);
    layers_finish(&layers);
}

/* ---- flags ---- */

/* How far the exact planes of two texels differ in the middle of their border, in terms of what a flag needs. */
static double gap(const struct layers *layers, uint32_t slice, uint32_t x, uint32_t y, int dx, int dy)
{
    const struct quadtree_uniforms *u = &layers->store.uniforms;
    const double at_x = x + 0.5 + 0.5 * dx, at_y = y + 0.5 + 0.5 * dy;
    const uint32_t x2 = (uint32_t)((int)x + dx), y2 = (uint32_t)((int)y + dy);
    if (x2 >= u->width || y2 >= u->height)
        return 0;
    const struct surface *here = surface_at(layers, slice, x, y), *there = surface_at(layers, slice, x2, y2);
    const double w = surface_w(u, slice / u->layers, here, at_x, at_y);
    const double w2 = surface_w(u, slice / u->layers, there, at_x, at_y);
    const double nearer = fmax(surface_w(u, slice / u->layers, here, x + 0.5, y + 0.5),
                               surface_w(u, slice / u->layers, there, x2 + 0.5, y2 + 0.5));
    return fabs(w - w2) / ((double)QUADTREE_EDGE_SHARE * nearer + (double)u->bounds[0]);
}

TEST(leaves_beside_a_surface_that_does_not_go_on_are_flagged_and_no_others)
{
    struct layers layers;
    layers_init(&layers, curved_scene(), &usual);
    const struct quadtree_uniforms *u = &layers.store.uniforms;
    uint32_t flagged = 0, smooth = 0;
    for (uint32_t slice = 0; slice < u->layers; slice++)
        for (uint32_t i = 0; i < u->width * u->height; i++) {
            const uint32_t x = i % u->width, y = i / u->width;
            const bool at_edge = tree_plane_of(node_at(&layers, slice, 0, x, y)).at_edge;
            const double widest = fmax(fmax(gap(&layers, slice, x, y, 1, 0), gap(&layers, slice, x, y, -1, 0)),
                                       fmax(gap(&layers, slice, x, y, 0, 1), gap(&layers, slice, x, y, 0, -1)));
            if (surface_at(&layers, slice, x, y)->z < 0) {
                assert_false(at_edge);
                continue;
            }
            if (widest > 1.1) /* slopes are rounded */
                assert_true(at_edge);
            if (widest < 0.9)
                assert_false(at_edge);
            flagged += at_edge;
            smooth += !at_edge;
        }
    print_message("%u leaves flagged, %u not\n", flagged, smooth);
    assert_in_range(flagged, 1000, smooth / 2);
    layers_finish(&layers);
}

/* ---- levels ---- */

/* Least and greatest w over the texel of its leaf, which the tests above hold against the exact plane. */
static struct tree_box leaf_range(const struct layers *layers, uint32_t slice, uint32_t x, uint32_t y)
{
    const struct tree_plane plane = tree_plane_of(node_at(layers, slice, 0, x, y));
    const double reach = (fabs(plane.slope_x) + fabs(plane.slope_y)) / 2;
    return (struct tree_box){
        .w_max = plane.w + reach, .w_min = fmax(plane.w - reach, 0), .has_gaps = !(plane.w > 0)};
}

TEST(a_box_has_all_that_is_below_it_and_a_plane_has_the_flags_of_its_leaves)
{
    struct layers layers;
    layers_init(&layers, curved_scene(), &usual);
    const struct quadtree_uniforms *u = &layers.store.uniforms;
    uint32_t with_gaps = 0, without = 0;
    for (uint32_t slice = 0; slice < u->layers; slice++)
        for (uint32_t i = 0; i < u->width * u->height; i++) {
            const uint32_t x = i % u->width, y = i / u->width;
            const struct tree_box leaf = leaf_range(&layers, slice, x, y);
            const bool at_edge = tree_plane_of(node_at(&layers, slice, 0, x, y)).at_edge;
            bool above_box = false;
            for (uint32_t level = 1; level <= QUADTREE_TOP; level++) {
                const uint32_t *node = node_at(&layers, slice, level, x >> level, y >> level);
                const struct tree_box box = tree_box_of(node);
                if (tree_is_plane(node)) {
                    assert_false(above_box); /* nothing above a box is a plane */
                    assert_true(!at_edge || (node[0] & 1));
                    continue;
                }
                above_box = true;
                assert_true(box.w_max >= leaf.w_max);
                assert_true(box.w_min <= leaf.w_min);
                assert_true(leaf.has_gaps ? box.has_gaps : box.w_least <= leaf.w_min);
                with_gaps += box.has_gaps;
                without += !box.has_gaps;
            }
        }
    print_message("boxes above leaves: %u with gaps, %u without\n", with_gaps, without);
    assert_true(with_gaps > 1000 && without > 1000);
    layers_finish(&layers);
}

/* Nodes above the leaves that are planes of surfaces. */
static uint32_t planes_above(const struct layers *layers)
{
    const struct quadtree_uniforms *u = &layers->store.uniforms;
    uint32_t planes = 0;
    for (uint32_t slice = 0; slice < u->faces * u->layers; slice++)
        for (uint32_t i = tree_level_first(u, 1); i < u->slice_nodes; i++) {
            const uint32_t *node = layers->nodes[slice * u->slice_nodes + i];
            planes += tree_is_plane(node) && tree_plane_of(node).w > 0;
        }
    return planes;
}

TEST_LONG(bounds_of_the_paper_make_more_planes_or_fewer)
{
    struct layers layers;
    layers_init(&layers, curved_scene(), &usual);
    struct quadtree_uniforms *u = &layers.store.uniforms;
    const uint32_t plain = planes_above(&layers);
    u->bounds[2] = u->depths[0] / 2; /* twice as much at two metres */
    layers_build(&layers);
    const uint32_t adaptive = planes_above(&layers);
    u->bounds[2] = 0;
    u->bounds[1] = cosf(0.03f);
    layers_build(&layers);
    const uint32_t turned = planes_above(&layers);
    print_message("%u planes, adaptive %u, within 1.7 degrees %u\n", plain, adaptive, turned);
    assert_true(adaptive > plain && turned < plain && turned > 0);
    layers_finish(&layers);
}

TEST(leaves_alone_are_those_of_the_tree_without_flags)
{
    struct layers layers;
    layers_init(&layers, curved_scene(), &usual);
    struct quadtree_uniforms *u = &layers.store.uniforms;
    const uint32_t texels = u->padded_width * u->padded_height, slices = u->faces * u->layers;
    const uint32_t whole_slice = u->slice_nodes;
    const size_t bytes = quadtree_nodes_count(u) * sizeof(*layers.nodes);
    uint32_t(*whole)[2] = malloc(bytes);
    memcpy(whole, layers.nodes, bytes);
    u->slice_nodes = texels;
    layers_build(&layers);
    for (uint32_t slice = 0; slice < slices; slice++)
        for (uint32_t i = 0; i < texels; i++) {
            const uint32_t *leaf = layers.nodes[slice * texels + i], *of_tree = whole[slice * whole_slice + i];
            assert_int_equal(leaf[0], of_tree[0] & ~1u);
            assert_int_equal(leaf[1], of_tree[1]);
        }
    free(whole);
    layers_finish(&layers);
}
