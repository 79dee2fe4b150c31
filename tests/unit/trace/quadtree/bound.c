/* SPDX-License-Identifier: MIT */
/* The proof of the bound: wherever an eye within the radius is, it sees what a node stands for within so many
 * pixels of where the surface is.
 *
 * A surface that is off by dw is off by |dw| / w of its distance along a line through the view's eye. An eye at r
 * sees that as the angle |dw| / w |P| |r| / |P - r|^2 at most, P being the point. With w = near / Z and Z <= |P|
 * that is |dw| R / near / (1 - R / Z)^2, and e pixels in the middle of a picture of focal length f are the angle e
 * / f. */
#include "tests/unit/trace/quadtree/layers.h"
#include "tests/unit/trace/quadtree/scenes.h"

ALL_TESTS(open_device, close_device)

#define EYES 100000u

static double uniform(uint64_t *seed, double low, double high)
{
    return low + (high - low) * ((double)test_random(seed) / 4294967296.0);
}

/* In a ball, half of them on its surface, where the bound is tightest. */
static void random_eye(uint64_t *seed, double radius, double eye[3])
{
    const double z = uniform(seed, -1, 1), phi = uniform(seed, 0, 6.283185307179586), r = sqrt(1 - z * z);
    const double size = test_random(seed) & 1 ? radius : radius * cbrt(uniform(seed, 0, 1));
    eye[0] = size * r * cos(phi);
    eye[1] = size * r * sin(phi);
    eye[2] = size * z;
}

/* The point at texel coordinates with this w, relative to the eye. */
static void point_of(const struct quadtree_uniforms *u, uint32_t face, double x, double y, double w,
                     double point[3])
{
    double begin[3], step[3];
    sight_line(u, face, x, y, begin, step);
    for (int k = 0; k < 3; k++)
        point[k] = begin[k] + depth_of_w(u, w) * step[k];
}

/* Pixels of focal length f between two points, as seen from an eye. */
static double pixels_between(double focal, const double a[3], const double b[3], const double eye[3])
{
    double to_a[3], to_b[3], normal[3];
    for (int k = 0; k < 3; k++) {
        to_a[k] = a[k] - eye[k];
        to_b[k] = b[k] - eye[k];
    }
    cross3(normal, to_a, to_b);
    return focal * atan2(sqrt(dot3(normal, normal)), dot3(to_a, to_b));
}

/* Nodes that are planes below boxes, for each texel that shows a surface. */
static double share_of_leaves(const struct layers *layers)
{
    const struct quadtree_uniforms *u = &layers->store.uniforms;
    double leaves = 0, texels = 0;
    for (uint32_t slice = 0; slice < u->faces * u->layers; slice++)
        for (uint32_t i = 0; i < u->width * u->height; i++) {
            const uint32_t x = i % u->width, y = i / u->width;
            struct tree_plane plane;
            if (surface_at(layers, slice, x, y)->z < 0)
                continue;
            leaves += pow(0.25, tree_find(u, (const void *)layers->nodes, slice, x, y, &plane));
            texels++;
        }
    return leaves / texels;
}

struct proof {
    double worst_pixels;
    uint32_t tested, steep;
};

/* Random texels of all slices that show a surface, in random places of each, seen by random eyes. */
static struct proof prove(const struct layers *layers, const struct layers_view *view, uint64_t seed)
{
    const struct quadtree_uniforms *u = &layers->store.uniforms;
    struct proof proof = {0};
    while (proof.tested < EYES) {
        const uint32_t slice = test_random(&seed) % (u->faces * u->layers), face = slice / u->layers;
        const double x = uniform(&seed, 0, u->width), y = uniform(&seed, 0, u->height);
        const struct surface *surface = surface_at(layers, slice, (uint32_t)x, (uint32_t)y);
        struct tree_plane plane;
        double eye[3], at_node[3], at_surface[3];
        if (surface->z < 0)
            continue;
        const uint32_t level = tree_find(u, (const void *)layers->nodes, slice, (uint32_t)x, (uint32_t)y, &plane);
        const double w = surface_w(u, face, surface, x, y);
        const double w_node = tree_plane_at(&plane, level, (uint32_t)x >> level, (uint32_t)y >> level, x, y);
        proof.tested++;
        /* Seen on edge: in a part of its texel the plane comes to the eyes, or is behind them. */
        if (level == 0 && (w <= 0 || depth_of_w(u, w) < 1.5 * view->radius)) {
            proof.steep++;
            continue;
        }
        random_eye(&seed, view->radius, eye);
        point_of(u, face, x, y, w_node, at_node);
        point_of(u, face, x, y, w, at_surface);
        const double pixels = pixels_between(view->focal, at_node, at_surface, eye);
        if (!(pixels <= view->pixels))
            fail_msg("texel %.2f, %.2f of slice %u: the node of level %u is off by %g pixels, by %g of w %g", x, y,
                     slice, level, pixels, w_node - w, w);
        proof.worst_pixels = fmax(proof.worst_pixels, pixels);
    }
    return proof;
}

static const struct layers_view usual = {.width = 640,
                                         .height = 360,
                                         .faces = 1,
                                         .layers = 2,
                                         .focal = 460,
                                         .near = 0.05,
                                         .far = 1000,
                                         .pixels = 0.25,
                                         .radius = 0.15};

static void expect_bound(struct scene *scene, const struct layers_view *view, double leaves_max, double tight)
{
    struct layers layers;
    layers_init(&layers, scene, view);
    const struct proof proof = prove(&layers, view, 7);
    const double leaves = share_of_leaves(&layers);
    print_message("e %g, R %g, near %g: %g pixels at most, %.1f %% leaves, %u of %u texels on edge\n",
                  view->pixels, view->radius, view->near, proof.worst_pixels, 100 * leaves, proof.steep,
                  proof.tested);
    assert_true(leaves <= leaves_max);
    assert_true(proof.worst_pixels >= tight * view->pixels); /* else merging would stop too early */
    assert_in_range(proof.steep, 0, EYES / 500);
    layers_finish(&layers);
}

TEST(eyes_within_the_radius_see_every_node_within_the_pixels_of_the_bound)
{
    expect_bound(curved_scene(), &usual, 0.15, 0.5);
}

TEST_LONG(the_bound_holds_for_a_hundredth_of_a_pixel_and_for_four)
{
    struct layers_view view = usual;
    view.pixels = 0.01;
    expect_bound(curved_scene(), &view, 0.5, 0.3);
    view.pixels = 4;
    expect_bound(curved_scene(), &view, 0.05, 0.3);
}

/* From 0.4 metres on, some surfaces are hardly farther away than the eyes come. */
TEST_LONG(the_bound_holds_for_eyes_that_come_near_to_the_surface)
{
    struct layers_view view = usual;
    view.radius = 0.35;
    view.eye[2] = -0.4f;
    expect_bound(curved_scene(), &view, 0.3, 0.3);
}

TEST(the_bound_holds_on_all_faces_of_a_cube_and_with_another_near_distance)
{
    struct layers_view view = usual;
    view.width = view.height = 128;
    view.focal = 64;
    view.faces = 6;
    view.near = 0.001;
    view.turn = 0.4;
    view.eye[2] = -1.8f;
    view.eye[1] = 0.6f;
    view.radius = 0.05;
    expect_bound(curved_scene(), &view, 0.5, 0.3);
}

/* ---- flat surfaces ---- */

/* Where the picture of an eye at `eye`, turned about y and then about x, has a point; false: behind it. */
static bool pixel_of(const struct layers_view *view, const double eye[3], const double turn[2],
                     const double point[3], double pixel[2])
{
    const double p[3] = {point[0] - eye[0], point[1] - eye[1], point[2] - eye[2]};
    const double c = cos(turn[0]), s = sin(turn[0]), c2 = cos(turn[1]), s2 = sin(turn[1]);
    const double a[3] = {c * p[0] + s * p[2], p[1], c * p[2] - s * p[0]};
    const double b[3] = {a[0], c2 * a[1] - s2 * a[2], s2 * a[1] + c2 * a[2]};
    pixel[0] = 0.5 * view->width + view->focal * b[0] / -b[2];
    pixel[1] = 0.5 * view->height - view->focal * b[1] / -b[2];
    return b[2] < -1e-3;
}

/* Maximum error of flat surfaces from the nodes between the pictures of two eyes, in pixels: from their 64
 * bits alone, whatever the bound is. */
static double worst_of_planes(const struct layers *layers, const struct layers_view *view, const double eye[3],
                              const double turn[2])
{
    const struct quadtree_uniforms *u = &layers->store.uniforms;
    double worst = 0;
    uint32_t seen = 0;
    for (uint32_t i = 0; i < view->width * view->height; i++) {
        const uint32_t x = i % view->width, y = i / view->width;
        const struct surface *surface = surface_at(layers, 0, x, y);
        struct tree_plane plane;
        double points[2][3], pixels[2][2];
        if (surface->z < 0)
            continue;
        const uint32_t level = tree_find(u, (const void *)layers->nodes, 0, x, y, &plane);
        point_of(u, 0, x + 0.5, y + 0.5, surface_w(u, 0, surface, x + 0.5, y + 0.5), points[0]);
        point_of(u, 0, x + 0.5, y + 0.5, tree_plane_at(&plane, level, x >> level, y >> level, x + 0.5, y + 0.5),
                 points[1]);
        for (int k = 0; k < 2; k++)
            if (!pixel_of(view, eye, turn, points[k], pixels[k]))
                return INFINITY;
        worst = fmax(worst, hypot(pixels[0][0] - pixels[1][0], pixels[0][1] - pixels[1][1]));
        seen++;
    }
    assert_in_range(seen, view->width * view->height * 9 / 10, view->width * view->height);
    return worst;
}

TEST(a_flat_surface_in_another_picture_is_within_a_64th_of_a_pixel_of_its_homography)
{
    static const double eyes[][3] = {{0.065, 0, 0}, {0.1, -0.05, -0.08}, {0, 0, 0.15}};
    static const double turn[2] = {0.1, -0.05};
    struct layers_view view = usual;
    struct layers layers;
    view.width = 1280;
    view.height = 720;
    view.focal = 920;
    view.layers = 1;
    layers_init(&layers, flat_scene(), &view);
    const double leaves = share_of_leaves(&layers);
    for (int i = 0; i < 3; i++) {
        const double worst = worst_of_planes(&layers, &view, eyes[i], turn);
        print_message("eye %d: %g pixels at most, %.4f %% leaves\n", i, worst, 100 * leaves);
        assert_true(worst <= 1.0 / 64);
    }
    assert_true(leaves < 0.01);
    layers_finish(&layers);
}

/* Whatever depth a node has: an eye that only turns sees the same point. What is left is rounding of this test. */
TEST(an_eye_that_only_turns_sees_the_same_points)
{
    static const double turn[2] = {0.3, 0.2}, eye[3] = {0};
    struct layers_view view = usual;
    struct layers layers;
    view.layers = 1;
    view.pixels = 4;
    layers_init(&layers, flat_scene(), &view);
    assert_true(worst_of_planes(&layers, &view, eye, turn) <= 1e-9);
    layers_finish(&layers);
}
