/* SPDX-License-Identifier: MIT */
/* The structure over a layer: its bound, and how it is brought up to date. */
#include "tests/unit/warp/views.h"

#include "warp/node.h"
#include "warp/tree.h"
#include "warp/march.h"

/* ---- a layer of planes, and rays in double precision ---- */

#define SURFACES 4u
#define NEARNESS_CLEARANCE 1.5 /* times the radius: nearer surfaces are left out, as eyes may be at them */

/* Columns and rows of a surface, the first beyond too; where several are, the last one is in front. */
struct surface {
    uint32_t left, top, right, bottom;
    double plane[3]; /* w = [0] + [1] x + [2] y */
};

static const struct surface surfaces[SURFACES] = {
    {0, 0, WIDTH, HEIGHT, {0.11, 0.0001, -0.0002}},   /* a wall */
    {0, 130, WIDTH, HEIGHT, {-0.32, 0.0002, 0.0033}}, /* a floor */
    {60, 40, 121, 170, {0.45, 0.0008, 0.0001}},       /* a board that stands in front of them */
    {200, 20, 205, 180, {0.7, 0, 0}},                 /* a post */
};

static double w_of(uint32_t surface, double x, double y)
{
    return surfaces[surface].plane[0] + surfaces[surface].plane[1] * x + surfaces[surface].plane[2] * y;
}

static uint32_t surface_at(uint32_t x, uint32_t y)
{
    uint32_t found = 0;
    for (uint32_t s = 0; s < SURFACES; s++)
        if (x >= surfaces[s].left && x < surfaces[s].right && y >= surfaces[s].top && y < surfaces[s].bottom)
            found = s;
    return found;
}

static void set_surfaces(uint32_t layer)
{
    for (uint32_t i = 0; i < COUNT; i++) {
        key_w[layer][i] = (float)w_of(surface_at(i % WIDTH, i / WIDTH), i % WIDTH + 0.5, i / WIDTH + 0.5);
        key_colours[layer][i] = 0xff000000u | i;
    }
}

static void layer_of(struct warp_layer *layer, float *scratch_rows, float pixels, float radius)
{
    assert_true(warp_layer_init(layer, WIDTH, HEIGHT));
    layer->tolerance = pixels / ((float)FOCAL * radius);
    layer->nearness = radius;
    for (uint32_t i = 0; i < COUNT; i++)
        layer->w[i / WIDTH * layer->padded_width + i % WIDTH] = key_w[0][i];
    const struct warp_rectangle all = {0, 0, WIDTH, HEIGHT}, parts = warp_layer_parts(layer, &all);
    for (uint32_t row = parts.top; row < parts.bottom; row++)
        warp_layer_build(layer, row, parts.left, parts.right, scratch_rows);
}

/* Texels of focal length f between two points of a line through the key view's eye, as seen from another eye. */
static double pixels_between(double x, double y, double w_a, double w_b, const double eye[3])
{
    double a[3], b[3], normal[3];
    for (int k = 0; k < 3; k++) {
        const double d = k == 0 ? (x - WIDTH / 2.0) / FOCAL : k == 1 ? (y - HEIGHT / 2.0) / FOCAL : 1;
        a[k] = d / w_a - eye[k];
        b[k] = d / w_b - eye[k];
    }
    for (int k = 0; k < 3; k++)
        normal[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
    return FOCAL * atan2(sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]),
                         a[0] * b[0] + a[1] * b[1] + a[2] * b[2]);
}

/* In a ball, half of them on its surface, where the bound is tightest: right, down, ahead. */
static void random_eye(uint64_t *seed, double radius, double eye[3])
{
    const double z = uniform(seed, -1, 1), phi = uniform(seed, 0, 6.283185307179586), r = sqrt(1 - z * z);
    const double size = random_bits(seed) & 1 ? radius : radius * cbrt(uniform(seed, 0, 1));
    eye[0] = size * r * cos(phi);
    eye[1] = size * r * sin(phi);
    eye[2] = size * z;
}

static void random_packet(uint64_t *seed, const double eye[3], struct warp_packet *packet)
{
    for (int k = 0; k < LANES; k++) {
        const double x = uniform(seed, 0, WIDTH), y = uniform(seed, 0, HEIGHT);
        packet->x[k] = (float)x;
        packet->y[k] = (float)y;
        packet->shift_x[k] = (float)(FOCAL * eye[0] - eye[2] * (x - WIDTH / 2.0));
        packet->shift_y[k] = (float)(FOCAL * eye[1] - eye[2] * (y - HEIGHT / 2.0));
    }
}

/* ---- the bound ---- */

#define EYES 10000u

struct proof {
    double worst_pixels;
    uint32_t hits, behind;
};

/* Between a hit and the surface that the texel shows there; at a border either of two texels. */
static double pixels_off(double x, double y, double w, const double eye[3])
{
    double least = INFINITY;
    for (int i = 0; i < 4; i++) {
        const double at_x = x + (i & 1 ? 1e-3 : -1e-3), at_y = y + (i & 2 ? 1e-3 : -1e-3);
        const uint32_t column = (uint32_t)fmin(fmax(at_x, 0), WIDTH - 1),
                       row = (uint32_t)fmin(fmax(at_y, 0), HEIGHT - 1);
        least = fmin(least, pixels_between(x, y, w, w_of(surface_at(column, row), x, y), eye));
    }
    return least;
}

/* Hits, each beside the surface that the texel shows there. */
static struct proof prove(float pixels, float radius)
{
    struct proof proof = {0};
    struct warp_layer layer = {0};
    float *scratch = calloc(13 * 384, sizeof(*scratch));
    uint64_t seed = 17;
    layer_of(&layer, scratch, pixels, radius);
    assert_true(warp_layer_scratch(&layer) <= 13 * 384);
    for (uint32_t e = 0; e < EYES; e++) {
        double eye[3];
        struct warp_packet packet;
        struct warp_march march = {.w = {0}};
        random_eye(&seed, radius, eye);
        random_packet(&seed, eye, &packet);
        for (int k = 0; k < LANES; k++)
            march.w[k] = 1.0f;
        warp_march(&layer, &packet, &march, 0.01f, QUADTREE_TOP);
        for (int k = 0; k < LANES; k++) {
            assert_true(march.state[k] != MARCH_ON);
            proof.behind += march.state[k] == MARCH_BEHIND;
            if (march.state[k] != MARCH_HIT)
                continue;
            const double x = march.x[k], y = march.y[k];
            assert_true(x > -0.01 && y > -0.01 && x < WIDTH + 0.01 && y < HEIGHT + 0.01);
            const double off = pixels_off(x, y, march.w[k], eye);
            /* The march allows itself 2^-12 of w more, for what rounds. */
            const double rounding =
                FOCAL * (double)radius * (double)march.w[k] / 4096 / pow(1 - (double)(radius * march.w[k]), 2);
            if (!(off <= (double)pixels + rounding))
                fail_msg("eye %u: the hit at %g, %g with w %g is off by %g pixels", e, x, y, (double)march.w[k],
                         off);
            proof.worst_pixels = fmax(proof.worst_pixels, off);
            proof.hits++;
        }
    }
    warp_layer_finish(&layer);
    free(scratch);
    return proof;
}

TEST(eyes_within_the_radius_see_each_point_within_the_pixels_of_the_bound)
{
    static const float cases[][2] = {{0.25f, 0.15f}, {0.5f, 0.15f}, {1, 0.3f}, {0.05f, 0.1f}};
    set_surfaces(0);
    for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
        const struct proof proof = prove(cases[i][0], cases[i][1]);
        print_message("e %g, R %g: %g pixels at most, %u hits, %u behind\n", (double)cases[i][0],
                      (double)cases[i][1], proof.worst_pixels, proof.hits, proof.behind);
        assert_true(proof.hits > EYES * LANES / 2);
        assert_true(proof.behind > EYES * LANES / 500); /* there are edges */
    }
}

/* A smooth surface that is no plane: merging uses what it may. */
TEST(curved_surfaces_become_planes_within_the_bound)
{
    struct warp_layer layer = {0};
    float *scratch = calloc(13 * 384, sizeof(*scratch));
    const double radius = 0.15, pixels = 0.25;
    uint64_t seed = 23;
    double worst = 0, leaves = 0;
    for (uint32_t i = 0; i < COUNT; i++)
        key_w[0][i] = (float)(0.3 + 0.1 * sin(i % WIDTH * 0.02) * cos(i / WIDTH * 0.03));
    layer_of(&layer, scratch, (float)pixels, (float)radius);
    const uint32_t texels = layer.padded_width * layer.padded_height;
    for (uint32_t i = 0; i < 100000; i++) {
        const uint32_t x = random_bits(&seed) % WIDTH, y = random_bits(&seed) % HEIGHT;
        uint32_t level = QUADTREE_TOP, node;
        do
            node = node_level_first(texels, level) + (y >> level) * (layer.padded_width >> level) + (x >> level);
        while (!node_is_plane(layer.nodes[2 * node]) && level-- > 0);
        const double half = 0.5 * (1 << level), centre_x = (x >> level << level) + half,
                     centre_y = (y >> level << level) + half;
        const double w = plane_w(layer.nodes[2 * node]) +
                         plane_slope_x(layer.nodes[2 * node + 1]) * (x + 0.5 - centre_x) +
                         plane_slope_y(layer.nodes[2 * node + 1]) * (y + 0.5 - centre_y);
        double eye[3];
        random_eye(&seed, radius, eye);
        const double off = pixels_between(x + 0.5, y + 0.5, w, key_w[0][y * WIDTH + x], eye);
        assert_true(off <= pixels);
        worst = fmax(worst, off);
        leaves += pow(0.25, level) / 100000;
    }
    print_message("%g pixels at most, %.1f %% leaves\n", worst, 100 * leaves);
    assert_true(worst > pixels / 2); /* else merging would stop too early */
    assert_true(leaves < 0.1);
    warp_layer_finish(&layer);
    free(scratch);
}

TEST(a_plane_is_one_node_and_a_step_is_a_box)
{
    struct warp_layer layer = {0};
    float *scratch = calloc(13 * 384, sizeof(*scratch));
    for (uint32_t i = 0; i < COUNT; i++)
        key_w[0][i] = i / WIDTH < 100 || i % WIDTH < 50 ? 0.25f : 0.5f;
    layer_of(&layer, scratch, 0.25f, 0.15f);
    const uint32_t top = node_level_first(layer.padded_width * layer.padded_height, QUADTREE_TOP);
    const uint32_t *first = layer.nodes + 2 * top, *second = first + 2;
    assert_false(node_is_plane(first[0]));
    assert_true(float_from_bits(first[0]) >= 0.5f && float_from_bits(first[0]) < 0.5002f);
    assert_true(float_from_bits(first[1]) <= 0.25f && float_from_bits(first[1]) > 0.2498f);
    /* Texels (128, 0) to (255, 127): the step lies in it, too; those above row 96 are a plane. */
    assert_false(node_is_plane(second[0]));
    const uint32_t level = 5, across = layer.padded_width >> level;
    const uint32_t *plane =
        layer.nodes + 2 * (node_level_first(layer.padded_width * layer.padded_height, level) + 2 * across + 5);
    assert_true(node_is_plane(plane[0]) && plane_w(plane[0]) == 0.25f && plane[1] == 0);
    warp_layer_finish(&layer);
    free(scratch);
}

TEST(half_floats_are_those_of_the_shaders)
{
    for (uint32_t half = 0; half < 65536; half++) {
        if ((half & 0x7c00) == 0x7c00)
            continue; /* infinite, or not a number */
        const int exponent = (int)(half >> 10 & 31), mantissa = (int)(half & 1023);
        const double value = exponent ? ldexp(1024 + mantissa, exponent - 25) : ldexp(mantissa, -24);
        const float slope = slope_from_half(half);
        assert_true((double)slope * 1024 == (half & 0x8000 ? -value : value));
        assert_int_equal(half_of_slope(slope), half);
        /* Between two of them the nearest, and of two that are as near the even one. */
        if ((half & 0x7fff) < 0x7bff) {
            const float next = slope_from_half(half + 1), middle = 0.5f * (slope + next);
            assert_int_equal(half_of_slope(middle), half + (half & 1));
            assert_int_equal(half_of_slope(0.25f * slope + 0.75f * next), half + 1);
        }
    }
    assert_int_equal(half_of_slope(1e9f), 0x7bff);
    assert_int_equal(half_of_slope(-1e9f), 0xfbff);
}

/* ---- updates ---- */

static void expect_same(struct fl_warp *a, struct fl_warp *b, uint32_t layers)
{
    static struct made of_a, of_b;
    for (uint32_t l = 0; l < layers; l++) {
        uint32_t count_a, count_b;
        const uint32_t *nodes_a = fl_warp_nodes(a, l, &count_a), *nodes_b = fl_warp_nodes(b, l, &count_b);
        assert_int_equal(count_a, count_b);
        assert_memory_equal(nodes_a, nodes_b, (size_t)count_a * 2 * sizeof(*nodes_a));
    }
    for (int k = 0; k < 3; k++) {
        const struct fl_warp_view view = view_of(camera_at(0.05 * k, 0.02 * k, -0.03 * k), FL_WARP_TREE);
        make(a, &view, &of_a);
        make(b, &view, &of_b);
        assert_memory_equal(of_a.colours, of_b.colours, sizeof(of_a.colours));
        assert_memory_equal(of_a.mask, of_b.mask, sizeof(of_a.mask));
        assert_true(of_a.counts.marched == of_b.counts.marched);
    }
}

TEST(an_update_of_a_rectangle_equals_the_build_anew)
{
    static uint32_t colours[COUNT];
    static float w[COUNT];
    uint64_t seed = 29;
    set_surfaces(0);
    set_surfaces(1);
    struct fl_warp_key key = key_of(2);
    struct fl_warp *warp = warp_with(2, &key);
    for (int round = 0; round < 60; round++) {
        struct fl_warp_part part = {.layer = random_bits(&seed) & 1, .texels = {colours, w, NULL}};
        struct fl_warp_error error = {0};
        part.x = random_bits(&seed) % WIDTH;
        part.y = random_bits(&seed) % HEIGHT;
        part.width = 1 + random_bits(&seed) % (round % 2 ? WIDTH - part.x : 1);
        part.height = 1 + random_bits(&seed) % (round % 3 ? HEIGHT - part.y : 1);
        const float level = (float)uniform(&seed, 0, 1);
        for (uint32_t y = 0; y < part.height; y++)
            for (uint32_t x = 0; x < part.width; x++) {
                const uint32_t at = (part.y + y) * WIDTH + part.x + x, i = y * part.width + x;
                w[i] = key_w[part.layer][at] = level + (random_bits(&seed) % 5 == 0 ? 0.3f : 0.0003f * (float)x);
                colours[i] = key_colours[part.layer][at] = random_bits(&seed);
            }
        assert_true(fl_warp_update(warp, &part, &error));
        if (round % 4 > 0)
            continue;
        struct fl_warp *anew = warp_with(1, &key);
        expect_same(warp, anew, 2);
        fl_warp_destroy(anew);
    }
    fl_warp_destroy(warp);
}

TEST(a_key_view_takes_the_place_of_another_one)
{
    set_surfaces(0);
    set_surfaces(1);
    struct fl_warp_key key = key_of(2), small = key_of(1);
    small.width = 100;
    small.height = 77;
    struct fl_warp *warp = warp_with(2, &small), *anew = warp_with(1, &key);
    struct fl_warp_error error = {0};
    uint32_t count;
    assert_true(fl_warp_set_key(warp, &key, &error));
    expect_same(warp, anew, 2);
    key.layer_count = 1;
    assert_true(fl_warp_set_key(warp, &key, &error) && fl_warp_set_key(anew, &small, &error));
    assert_true(!fl_warp_nodes(warp, 1, &count));
    assert_true(fl_warp_set_key(anew, &key, &error));
    expect_same(warp, anew, 1);
    fl_warp_destroy(warp);
    fl_warp_destroy(anew);
}

TEST(a_layer_that_comes_later_equals_one_that_was_there)
{
    set_surfaces(0);
    set_surfaces(1);
    struct fl_warp_key first = key_of(1), both = key_of(2);
    struct fl_warp *warp = warp_with(2, &both), *anew = warp_with(1, &both);
    struct fl_warp_error error = {0};
    uint32_t count;
    const struct fl_warp_layer none = {key_colours[1], NULL, NULL};
    assert_true(fl_warp_set_key(warp, &first, &error) && !fl_warp_nodes(warp, 1, &count));
    assert_false(fl_warp_add_layer(warp, &none, &error));
    assert_string_equal(error.field, "layers");
    assert_true(fl_warp_add_layer(warp, &both.layers[1], &error));
    expect_same(warp, anew, 2);
    assert_true(fl_warp_add_layer(warp, &both.layers[1], &error)); /* the last that there may be */
    assert_false(fl_warp_add_layer(warp, &both.layers[1], &error));
    assert_string_equal(error.field, "layer");
    fl_warp_destroy(warp);
    fl_warp_destroy(anew);
}
