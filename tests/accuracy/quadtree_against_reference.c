/* SPDX-License-Identifier: MIT */
/* Surfaces that the tracer quadtree claims to have seen are first hits of the reference: for eyes round the
 * view of its structure, and all pixels that each of them sees. Each test prints the known share of the
 * pixels, by layers. */
#include "tests/accuracy/test_scenes.h"
#include "tests/fixtures/device.h"

#include "gpu_scene/scene.h"
#include "shared/hit.h"
#include "shared/ray.h"
#include "trace/tracer.h"

#define SIDE 256u
#define PIXELS (SIDE * SIDE)
#define EYES 8u
#define FOV 1.05f
#define LAYERS 3u
#define BOUND_PIXELS 0.25f /* bound of the planes */
/* Minimum share of known pixels with the reference's first hit, or that of a pixel beside it: an outline lies
 * at the middle of its texel, so pixels on either side may show the other surface. */
#define SEEN_MIN 0.998
#define BESIDE 0.01 /* change of 1 / depth of a surface from one pixel to the next */
/* The outline of a surface passes anywhere through a texel, all of which shows what its middle sees. Along an axis
 * that is 1/4 texel of the wrong side on average, and less of a slanted outline by its steps: so of as many pixels
 * as there are steps along the outlines, 1/4 at most are not the first hit of a plane. Half of them are beyond the
 * outline of what the texel shows. There primitives are missed, and those of the neighbours tried. */
#define WRONG_OF_OUTLINES_PLANES 0.25
#define WRONG_OF_OUTLINES_PRIMITIVES 0.125

struct room {
    struct gpu_scene gpu;
    struct tracer *exact;
    struct trace_view view;
    float radius; /* metres, of the sphere in which eyes are */
    struct gpu_buffer rays, answers;
    struct ray host_rays[PIXELS];
    struct hit hits[PIXELS], expected[EYES][PIXELS];
};

static void expect_ok(bool ok, const struct error *error)
{
    if (!ok)
        fail_msg("%s: %s", error->field, error->text);
}

ALL_TESTS(open_device, close_device)

/* ---- scenes ---- */

static void add_box_at(struct test_edits *edits, uint32_t node, float x, float y, float z, float turn)
{
    float m[12];
    test_transform(m, 0.3f, 0.6f, 0.3f, 1, turn, x, y, z);
    test_node(edits, node, 0, NODE_MESH, 2, m);
}

/* A floor and a wall, boxes before one another, and a soup of small things. */
static struct scene *scene_of_a_room(void)
{
    static const float corners[8][3] = {{-1, -1, -1}, {1, -1, -1}, {-1, 1, -1}, {1, 1, -1},
                                        {-1, -1, 1},  {1, -1, 1},  {-1, 1, 1},  {1, 1, 1}};
    static const uint32_t sides[36] = {0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5, 0, 1, 5, 0, 5, 4,
                                       2, 6, 7, 2, 7, 3, 0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6};
    struct test_edits edits = {.scene = test_scene_create()};
    float m[12];
    test_material(&edits, 1, 0.1f, 0.2f, 0.3f);
    test_material(&edits, 2, 0.4f, 0.5f, 0.6f);
    test_mesh(&edits, 2, corners, 8, sides, 12);
    test_soup_mesh(&edits, 3, 60, 0.25f, 11);
    test_transform(m, 4, 3, 4, 1, 0, 0, 1.5f, 0);
    test_node(&edits, 1, 0, NODE_MESH, 2, m); /* the room itself */
    for (uint32_t i = 0; i < 6; i++)
        add_box_at(&edits, 10 + i, -2 + 0.8f * (float)i, -0.9f, -1.2f - 0.9f * (float)(i % 3), 0.4f * (float)i);
    test_transform(m, 0.8f, 0.8f, 0.8f, 0, 0.5f, 0.4f, 1.2f, -1.5f);
    test_node(&edits, 20, 0, NODE_MESH, 3, m);
    test_commit(&edits);
    return edits.scene;
}

/* ---- rays ---- */

static void set_eye(struct room *room, float x, float y, float z)
{
    room->view = (struct trace_view){
        .world_from_view = {1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z}, .fov_y = FOV, .width = SIDE, .height = SIDE};
}

/* Through the middles of the pixels, from so far beside the eye. */
static void make_rays(struct room *room, const float beside[3])
{
    const float tangent = tanf(FOV / 2);
    for (uint32_t i = 0; i < PIXELS; i++) {
        struct ray *ray = &room->host_rays[i];
        for (int k = 0; k < 3; k++)
            ray->origin_t_min[k] = room->view.world_from_view[4 * k + 3] + beside[k];
        ray->origin_t_min[3] = 0;
        ray->direction_t_max[0] = tangent * (2 * ((float)(i % SIDE) + 0.5f) / SIDE - 1);
        ray->direction_t_max[1] = tangent * (1 - 2 * ((float)(i / SIDE) + 0.5f) / SIDE);
        ray->direction_t_max[2] = -1;
        ray->direction_t_max[3] = 1e6f;
    }
}

static void eye_beside(uint32_t eye, float radius, float beside[3])
{
    uint64_t seed = 77 + eye;
    float squared = 2;
    while (squared > 1) {
        squared = 0;
        for (int k = 0; k < 3; k++) {
            beside[k] = test_uniform(&seed, -1, 1);
            squared += beside[k] * beside[k];
        }
    }
    for (int k = 0; k < 3; k++)
        beside[k] *= radius;
}

static void trace(struct room *room, struct tracer *tracer, struct hit *hits)
{
    struct error error = {0};
    expect_ok(gpu_buffer_upload(device, &room->rays, room->host_rays, sizeof(room->host_rays), &error), &error);
    const struct wave wave = {
        .kind = WAVE_CLOSEST, .ray_count = PIXELS, .rays = &room->rays, .hits = &room->answers};
    gpu_scene_bind(&room->gpu);
    expect_ok(tracer_trace(tracer, &room->gpu, &wave, &error), &error);
    gpu_buffer_read(device, &room->answers, 0, hits, PIXELS * sizeof(*hits));
}

static struct tracer *bring(struct room *room, unsigned number, const struct tracer_options *options)
{
    struct error error = {0};
    struct tracer *tracer = tracer_create(tracer_impl_by_number(number), device, options, &error);
    expect_ok(tracer != NULL, &error);
    const struct tracer_update update = {.changed = CHANGED_ALL, .view = &room->view};
    expect_ok(tracer_update(tracer, &room->gpu, &update, &error), &error);
    return tracer;
}

static void skip_without_quadtree(void)
{
    if (tracer_impl_by_number(TRACER_QUADTREE))
        return;
    printf("skipped: the build leaves the tracer out\n");
    skip();
}

/* The scene must outlive it. */
static void room_init(struct room *room, struct scene *scene)
{
    struct scene_changes changes;
    struct error error = {0};
    gpu_scene_init(&room->gpu, device);
    expect_ok(gpu_scene_update(&room->gpu, scene, NULL, &changes, NULL, &error), &error);
    expect_ok(gpu_buffer_reserve(device, &room->answers, PIXELS * sizeof(struct hit), &error), &error);
}

/* Brings the tracer of exact hits to the view. */
static struct tracer *bring_exact(struct room *room)
{
    return bring(room, tracer_impl_by_number(TRACER_REFERENCE) ? TRACER_REFERENCE : TRACER_BVH,
                 &(struct tracer_options){0});
}

/* Frees it, too. */
static void room_finish(struct room *room)
{
    tracer_destroy(room->exact);
    gpu_buffer_finish(device, &room->rays);
    gpu_buffer_finish(device, &room->answers);
    gpu_scene_finish(&room->gpu);
    free(room);
}

/* ---- comparing ---- */

/* Distances are depths here. `off`: how far 1 / depth may be off where a surface is seen straight on; a plane that
 * is seen at a slant is off by more along the ray, and so is one that a texel's rounding moves. */
static bool is_same(const struct hit *got, const struct hit *expected, double off)
{
    if (got->distance < 0 || expected->distance < 0)
        return got->distance < 0 && expected->distance < 0;
    const double apart = fabs(1 / (double)got->distance - 1 / (double)expected->distance);
    return apart < 4 * off + 1e-4 / (double)expected->distance;
}

static bool is_beside(const struct hit *got, const struct hit *expected, uint32_t pixel)
{
    for (uint32_t i = 0; i < 9; i++) {
        const uint32_t x = pixel % SIDE + i % 3, y = pixel / SIDE + i / 3; /* coordinates plus 1 */
        if (x < 1 || x > SIDE || y < 1 || y > SIDE)
            continue;
        const struct hit *one = &expected[(y - 1) * SIDE + x - 1];
        if (is_same(got, one, one->distance > 0 ? BESIDE / 4 / (double)one->distance : 0))
            return true;
    }
    return false;
}

/* ---- beside the view ---- */

#define MARGIN 0.05f
#define POSTS_DEPTH 1.0f /* metres; the wall behind them is four more away */

static void add_square(struct test_edits *edits, uint32_t id, float x, float half_width, float half_height,
                       float z)
{
    static const uint32_t indices[6] = {0, 1, 2, 2, 1, 3};
    const float corners[4][3] = {{x - half_width, -half_height, z},
                                 {x + half_width, -half_height, z},
                                 {x - half_width, half_height, z},
                                 {x + half_width, half_height, z}};
    test_mesh(edits, id, corners, 4, indices, 2);
    test_node(edits, id, 0, NODE_MESH, id, NULL);
}

/* A wall, and on either side of the view a post just outside of its margin. */
static struct scene *scene_of_posts(void)
{
    struct test_edits edits = {.scene = test_scene_create()};
    const float side = tanf(FOV / 2) * (1 + 2 * MARGIN) * POSTS_DEPTH;
    add_square(&edits, 1, 0, 9, 9, -POSTS_DEPTH - 4);
    add_square(&edits, 2, side + 0.17f, 0.15f, 2, -POSTS_DEPTH);
    add_square(&edits, 3, -side - 0.17f, 0.15f, 2, -POSTS_DEPTH);
    test_commit(&edits);
    return edits.scene;
}

/* From the eye in hand: how many pixels show a post to the reference, how many of these a tracer claims to know as
 * something else, and how many it knows in all. */
static void count_posts(struct room *room, struct tracer *tracer, struct hit *expected, uint32_t counts[3])
{
    trace(room, room->exact, expected);
    trace(room, tracer, room->hits);
    for (uint32_t i = 0; i < PIXELS; i++) {
        const bool is_known = !(room->hits[i].material & HIT_UNKNOWN);
        const bool is_post = expected[i].distance > 0 && expected[i].distance < 1.01f * POSTS_DEPTH;
        counts[0] += is_post;
        counts[1] += is_post && is_known && !is_same(&room->hits[i], &expected[i], 0);
        counts[2] += is_known;
    }
}

/* Eyes aside see the posts before their rays come into the view, which shows only the wall. An eye as far aside as
 * those of a head knows all of its picture nevertheless, for its rays come in within 8 radii. */
TEST(what_stands_beside_the_view_is_not_taken_for_what_the_view_shows)
{
    struct room *room = calloc(1, sizeof(*room));
    const struct tracer_options options = {
        .quadtree = {
            .layers = 1, .faces = QUADTREE_FACES_VIEW, .margin = MARGIN, .pixels = BOUND_PIXELS, .radius = 0.14f}};
    uint32_t counts[3] = {0, 0, 0}, near_counts[3] = {0, 0, 0};
    (void)state;
    skip_without_quadtree();
    struct scene *scene = scene_of_posts();
    room_init(room, scene);
    set_eye(room, 0, 0, 0);
    room->radius = options.quadtree.radius;
    room->exact = bring_exact(room);
    struct tracer *tracer = bring(room, TRACER_QUADTREE, &options);
    for (uint32_t eye = 0; eye < EYES; eye++) {
        float beside[3];
        eye_beside(eye, room->radius, beside);
        make_rays(room, beside);
        count_posts(room, tracer, room->expected[eye], counts);
    }
    make_rays(room, (const float[3]){0.0325f, 0, 0});
    count_posts(room, tracer, room->expected[0], near_counts);
    print_message(
        "%u pixels show posts, %u of these are claimed to show something else; of %u pixels %u are known, "
        "and %u of an eye 33 mm aside\n",
        counts[0], counts[1], EYES * PIXELS, counts[2], near_counts[2]);
    assert_in_range(counts[0], 500, EYES * PIXELS);
    assert_int_equal(counts[1], 0);
    assert_int_equal(near_counts[2], PIXELS);
    tracer_destroy(tracer);
    room_finish(room);
    scene_destroy(scene);
}

/* ---- what is seen, and the first hit ---- */

struct share {
    uint64_t known, right, beside, outlines;
};

/* Pairs of pixels side by side of which one shows another surface than the other. */
static uint64_t count_outlines(const struct hit *expected)
{
    uint64_t count = 0;
    for (uint32_t i = 0; i < PIXELS; i++) {
        const double distance = (double)expected[i].distance, off = distance > 0 ? BESIDE / 4 / distance : 0;
        count += i % SIDE + 1 < SIDE && !is_same(&expected[i + 1], &expected[i], off);
        count += i / SIDE + 1 < SIDE && !is_same(&expected[i + SIDE], &expected[i], off);
    }
    return count;
}

static struct share compare(struct room *room, struct tracer *tracer, double off)
{
    struct share share = {0, 0, 0, 0};
    for (uint32_t eye = 0; eye < EYES; eye++) {
        float beside[3];
        eye_beside(eye, room->radius, beside);
        make_rays(room, beside);
        trace(room, tracer, room->hits);
        share.outlines += count_outlines(room->expected[eye]);
        for (uint32_t i = 0; i < PIXELS; i++) {
            if (room->hits[i].material & HIT_UNKNOWN)
                continue;
            share.known++;
            const bool is_right = is_same(&room->hits[i], &room->expected[eye][i], off);
            share.right += is_right;
            share.beside += !is_right && is_beside(&room->hits[i], room->expected[eye], i);
        }
    }
    return share;
}

static void expect_seen_is_first(struct room *room, const char *name)
{
    const bool is_long = getenv("FARLIGHT_TEST_LONG") != NULL; /* else planes of two layers */
    for (int planes = is_long ? 0 : 1; planes < 2; planes++) {
        uint64_t known_before = 0;
        for (uint32_t layers = is_long ? 1 : 2; layers <= (is_long ? LAYERS : 2); layers++) {
            const struct tracer_options options = {
                .quadtree = {.layers = layers,
                             .faces = QUADTREE_FACES_VIEW,
                             .pixels = BOUND_PIXELS,
                             .radius = room->radius,
                             .hits = planes ? QUADTREE_HITS_PLANE : QUADTREE_HITS_PRIMITIVE}};
            const double focal_pixels = SIDE / 2.0 / tan((double)FOV / 2);
            const double off = (double)BOUND_PIXELS / (focal_pixels * (double)room->radius);
            struct tracer *tracer = bring(room, TRACER_QUADTREE, &options);
            const struct share share = compare(room, tracer, off);
            const double known = (double)share.known, right = (double)(share.right + share.beside) / known;
            tracer_destroy(tracer);
            const double of_outlines = (known - (double)share.right) / (double)share.outlines;
            printf("%s, hits of %s, %u layers: %.2f %% of the pixels are known, of which %.3f %% are the first "
                   "hit, %.3f %% one beside it; those wrong are %.3f of the steps along outlines\n",
                   name, planes ? "planes" : "primitives", layers, 100 * known / (EYES * PIXELS),
                   100 * (double)share.right / known, 100 * (double)share.beside / known, of_outlines);
            assert_true(of_outlines <= (planes ? WRONG_OF_OUTLINES_PLANES : WRONG_OF_OUTLINES_PRIMITIVES));
            if (!(right >= SEEN_MIN))
                fail_msg("%s: %.3f %% of what is known is the first hit", name, 100 * right);
            assert_true(share.known >= EYES * PIXELS / 2); /* else it says little */
            assert_true(share.known >= known_before);
            known_before = share.known;
        }
    }
}

/* With the eye at a share of what bounds the scene, looking against the third axis; eyes are within a share of its
 * longest side. */
static void expect_seen_of(struct scene *scene, const char *name, const float place[3], float radius)
{
    struct room *room = calloc(1, sizeof(*room));
    float eye[3], longest = 0;
    skip_without_quadtree();
    room_init(room, scene);
    for (int k = 0; k < 3; k++) {
        const float size = room->gpu.upper_world[k] - room->gpu.lower_world[k];
        eye[k] = room->gpu.lower_world[k] + place[k] * size;
        longest = fmaxf(longest, size);
    }
    set_eye(room, eye[0], eye[1], eye[2]);
    room->radius = radius * longest;
    room->exact = bring_exact(room);
    for (uint32_t i = 0; i < EYES; i++) {
        float beside[3];
        eye_beside(i, room->radius, beside);
        make_rays(room, beside);
        trace(room, room->exact, room->expected[i]);
    }
    expect_seen_is_first(room, name);
    room_finish(room);
}

TEST(what_is_seen_of_a_room_is_the_first_hit_of_the_reference)
{
    (void)state;
    struct scene *scene = scene_of_a_room();
    expect_seen_of(scene, "a room", (const float[3]){0.51f, 0.4f, 0.9f}, 0.02f);
    scene_destroy(scene);
}
