/* SPDX-License-Identifier: MIT */
/* The layers that are drawn of a view's faces against what a computation in double precision finds along the rays
 * through the texels' centres. */
#include "tests/unit/trace/quadtree/layers.h"
#include "tests/unit/trace/quadtree/scenes.h"

#include "trace/quadtree/layers.h"

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

/* Vertices are rounded to 1/256 texel or finer, and so are edges. */
#define EDGE_TEXELS 0.0079
/* Depths closer than this share may change places: floats, interpolated. */
#define DEPTH_SHARE 4e-6
#define SHIFTS 5

struct drawn {
    struct layers seen; /* by the host, one layer more than are drawn */
    struct quadtree_store store;
    struct quadtree_layers layers;
    uint32_t (*visible)[2]; /* read back, slice after slice, padded */
    struct surface *shifted[SHIFTS];
};

static size_t texels_of(const struct quadtree_uniforms *u)
{
    return (size_t)u->padded_width * u->padded_height * u->faces * u->layers;
}

static void read_back(struct drawn *drawn)
{
    const size_t bytes = texels_of(&drawn->store.uniforms) * sizeof(*drawn->visible);
    drawn->visible = drawn->visible ? drawn->visible : malloc(bytes);
    glGetTextureImage(drawn->store.visible.name, 0, GL_RG_INTEGER, GL_UNSIGNED_INT, (GLsizei)bytes,
                      drawn->visible);
}

static void draw_one_way(struct drawn *drawn)
{
    struct error error = {0};
    enum tracer_progress progress;
    expect_ok(quadtree_layers_begin(&drawn->layers, &drawn->store, &error), &error);
    do
        progress = quadtree_layers_step(&drawn->layers, &drawn->seen.gpu, true, &error);
    while (progress == TRACER_MORE);
    expect_ok(progress == TRACER_DONE, &error);
    read_back(drawn);
}

static float *read_depths(const struct gpu_texture *texture, GLenum format, uint32_t components)
{
    const size_t bytes = (size_t)texture->width * texture->height * components * sizeof(float);
    float *depths = malloc(bytes);
    glGetTextureImage(texture->name, 0, format, GL_FLOAT, (GLsizei)bytes, depths);
    return depths;
}

/* In one pass, and then peeled. Both compare the same depths, in the same order, and keep of those that are equal
 * the first one: no texel may differ. Peels leave the depths of their last two layers. */
static void draw_both_ways(struct drawn *drawn)
{
    const struct quadtree_uniforms *u = &drawn->store.uniforms;
    const size_t bytes = texels_of(u) * sizeof(*drawn->visible),
                 slice = (size_t)u->padded_width * u->padded_height;
    draw_one_way(drawn);
    assert_int_equal(drawn->layers.pass_layers, u->layers);
    uint32_t(*at_once)[2] = malloc(bytes);
    memcpy(at_once, drawn->visible, bytes);
    float *depths_at_once =
        read_depths(drawn->layers.depths, u->layers == 2 ? GL_RG : GL_RGBA, u->layers == 2 ? 2 : 4);
    device->facts.fetches_framebuffer = false;
    draw_one_way(drawn);
    device->facts.fetches_framebuffer = true;
    assert_int_equal(drawn->layers.pass_layers, 1);
    assert_memory_equal(drawn->visible, at_once, bytes);
    for (uint32_t layer = u->layers - 2; layer < u->layers; layer++) {
        float *depths = read_depths(&drawn->layers.depths[layer & 1], GL_DEPTH_COMPONENT, 1);
        for (size_t i = 0; i < slice; i++)
            assert_true(depths[i] == depths_at_once[(u->layers == 2 ? 2 : 4) * i + layer]);
        free(depths);
    }
    free(depths_at_once);
    free(at_once);
}

/* In all ways that the device has, which give the same. */
static void draw(struct drawn *drawn)
{
    if (device->facts.fetches_framebuffer && drawn->store.uniforms.layers > 1)
        draw_both_ways(drawn);
    else
        draw_one_way(drawn);
}

/* Visibility on the host at places about the texels' centres, of which the first are the centres themselves. */
static void see_shifted(struct drawn *drawn)
{
    static const double shifts[SHIFTS][2] = {{0, 0}, {1, 1}, {-1, 1}, {1, -1}, {-1, -1}};
    struct layers *seen = &drawn->seen;
    const struct quadtree_uniforms uniforms = drawn->store.uniforms;
    for (int i = 0; i < SHIFTS; i++) {
        seen->store.uniforms = uniforms;
        seen->store.uniforms.layers++;
        for (int k = 0; k < 2; k++)
            seen->store.uniforms.scale_centre[2 + k] += (float)(EDGE_TEXELS * shifts[i][k]);
        see_all(seen);
        drawn->shifted[i] = seen->surfaces;
    }
}

/* Owns the scene. */
static void drawn_init(struct drawn *drawn, struct scene *scene, const struct quadtree_uniforms *u)
{
    struct error error = {0};
    struct scene_changes changes;
    *drawn = (struct drawn){.seen = {.scene = scene, .memory_before_bytes = device->memory_used_bytes}};
    drawn->store = (struct quadtree_store){.device = device, .uniforms = *u};
    drawn->seen.store = (struct quadtree_store){.device = device, .uniforms = *u};
    gpu_scene_init(&drawn->seen.gpu, device);
    expect_ok(gpu_scene_update(&drawn->seen.gpu, scene, NULL, &changes, NULL, &error), &error);
    expect_ok(gpu_texture_reserve_array(device, &drawn->store.visible, GL_RG32UI, u->padded_width,
                                        u->padded_height, u->faces * u->layers, &error),
              &error);
}

static void drawn_finish(struct drawn *drawn)
{
    for (int i = 0; i < SHIFTS; i++)
        free(drawn->shifted[i]);
    drawn->seen.surfaces = NULL;
    quadtree_layers_finish(&drawn->layers);
    gpu_texture_finish(device, &drawn->store.visible);
    quadtree_runs_finish(&drawn->store.runs);
    free(drawn->visible);
    layers_finish(&drawn->seen);
}

/* ---- against the host ---- */

/* Whether the surfaces round a texel's centre are the same, and far enough from one another. */
static bool is_settled(const struct drawn *drawn, uint32_t face, uint32_t texel)
{
    const struct quadtree_uniforms *u = &drawn->store.uniforms;
    const size_t slice = (size_t)u->padded_width * u->padded_height;
    double before = 0;
    for (uint32_t layer = 0; layer <= u->layers; layer++) {
        const size_t at = (face * (u->layers + 1) + layer) * slice + texel;
        const struct surface *own = &drawn->shifted[0][at];
        for (int i = 1; i < SHIFTS; i++)
            if (memcmp(drawn->shifted[i][at].what, own->what, sizeof(own->what)) != 0)
                return false;
        if (own->z > 0 && own->z - before < DEPTH_SHARE * own->z)
            return false;
        before = own->z;
    }
    return true;
}

/* True if all layers of a texel are as on the host. */
static bool is_right(const struct drawn *drawn, uint32_t face, uint32_t texel)
{
    const struct quadtree_uniforms *u = &drawn->store.uniforms;
    const size_t slice = (size_t)u->padded_width * u->padded_height;
    bool right = true;
    for (uint32_t layer = 0; layer < u->layers; layer++) {
        const uint32_t *found = drawn->visible[(face * u->layers + layer) * slice + texel];
        const struct surface *own = &drawn->shifted[0][(face * (u->layers + 1) + layer) * slice + texel];
        right = right && memcmp(found, own->what, sizeof(own->what)) == 0;
    }
    return right;
}

static void print_texel(const struct drawn *drawn, uint32_t face, uint32_t texel)
{
    const struct quadtree_uniforms *u = &drawn->store.uniforms;
    const size_t slice = (size_t)u->padded_width * u->padded_height;
    for (uint32_t layer = 0; layer < u->layers; layer++) {
        const uint32_t *found = drawn->visible[(face * u->layers + layer) * slice + texel];
        const struct surface *own = &drawn->shifted[0][(face * (u->layers + 1) + layer) * slice + texel];
        print_message("face %u texel %u %u layer %u: %u %u is to be %u %u (z %.9g)\n", face,
                      texel % u->padded_width, texel / u->padded_width, layer, found[0], found[1], own->what[0],
                      own->what[1], own->z);
    }
}

/* Texels at edges are not compared: a tenth at most. */
static void expect_drawn(struct scene *scene, const struct quadtree_uniforms *u, uint32_t settled_min)
{
    struct drawn drawn;
    uint32_t settled = 0, wrong = 0, texels = u->width * u->height * u->faces;
    drawn_init(&drawn, scene, u);
    draw(&drawn);
    see_shifted(&drawn);
    for (uint32_t i = 0; i < texels; i++) {
        const uint32_t face = i / (u->width * u->height), in_face = i % (u->width * u->height);
        const uint32_t texel = in_face / u->width * u->padded_width + in_face % u->width;
        if (!is_settled(&drawn, face, texel))
            continue;
        settled++;
        if (!is_right(&drawn, face, texel) && ++wrong < 5)
            print_texel(&drawn, face, texel);
    }
    print_message("%u of %u texels settled, %u wrong\n", settled, texels, wrong);
    assert_int_equal(wrong, 0);
    assert_in_range(settled, settled_min, texels);
    drawn_finish(&drawn);
}

/* Triangles, spheres, mirrored instances and a disc; in an orthographic view; cut off by the near distance, which
 * of spheres leaves the far sides; two layers alone; from outside of spheres and among them. */
TEST(layers_show_the_first_surfaces_along_the_ray_in_order)
{
    static const struct {
        struct scene *(*create)(void);
        double focal, near, far;
        uint32_t layers;
        float eye_z;
        bool orthographic;
    } rows[] = {
        {curved_scene, 115, 0.05, 1000, 3, 0, false},       {curved_scene, 30, 0.05, 20, 3, 0, true},
        {curved_scene, 115, 2, 1000, 3, 0, false},          {flat_scene, 115, 0.05, 1000, 2, 0, false},
        {test_scene_spheres, 115, 0.05, 1000, 2, 3, false}, {test_scene_spheres, 115, 0.05, 1000, 3, 0, false},
    };
    for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++) {
        struct layers_view view = usual;
        view.focal = rows[i].focal;
        view.near = rows[i].near;
        view.far = rows[i].far;
        view.layers = rows[i].layers;
        view.eye[2] = rows[i].eye_z;
        view.orthographic = rows[i].orthographic;
        const struct quadtree_uniforms u = uniforms_of(&view);
        print_message("row %zu: ", i);
        expect_drawn(rows[i].create(), &u, u.width * u.height / 10 * 9);
    }
}

/* Faces lie as the view does: one of them sees all that is before the eye. */
TEST(faces_of_a_cube_that_see_nothing_are_left_out)
{
    struct error error = {0};
    struct scene_changes changes;
    struct gpu_scene gpu;
    struct test_edits edits = {.scene = test_scene_create()};
    static const float positions[3][3] = {{-1, -1, -5}, {1, -1, -5}, {0, 1, -5}};
    static const uint32_t indices[3] = {0, 1, 2};
    const struct quadtree_settings settings = {
        .faces = QUADTREE_FACES_CUBE, .layers = 1, .resolution = 128, .pixels = 0.5f, .radius = 0.1f};
    /* Looks at the triangle; likewise between two axes of the world; away from it. */
    const float s = 0.70710678f;
    const struct trace_view views[] = {
        {.world_from_view = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}, .fov_y = 1, .width = 64, .height = 64},
        {.world_from_view = {s, 0, s, 5, 0, 1, 0, 0, -s, 0, s, 0}, .fov_y = 1, .width = 64, .height = 64},
        {.world_from_view = {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0}, .fov_y = 1, .width = 64, .height = 64}};
    test_mesh(&edits, 10, positions, 3, indices, 1);
    test_node(&edits, 1, 0, NODE_MESH, 10, NULL);
    test_commit(&edits);
    gpu_scene_init(&gpu, device);
    expect_ok(gpu_scene_update(&gpu, edits.scene, NULL, &changes, NULL, &error), &error);
    for (size_t i = 0; i < sizeof(views) / sizeof(views[0]); i++) {
        struct quadtree_store store = {.device = device};
        expect_ok(quadtree_store_place(&store, &gpu, &views[i], &settings, &error), &error);
        assert_int_equal(store.uniforms.faces, 1);
        assert_float_equal(store.uniforms.face_from_world[2][2], i == 1 ? -s : -1, 1e-6);
        quadtree_store_finish(&store);
    }
    gpu_scene_finish(&gpu);
    scene_destroy(edits.scene);
}

/* A floor beneath an eye that looks down by 30 degrees: the face above it sees none, though no side of what it
 * sees has all corners of the floor beyond. */
TEST(a_face_that_a_large_floor_passes_by_is_left_out)
{
    struct error error = {0};
    struct scene_changes changes;
    struct gpu_scene gpu;
    struct test_edits edits = {.scene = test_scene_create()};
    static const float positions[4][3] = {{-12, -1, -12}, {12, -1, -12}, {12, -1, 12}, {-12, -1, 12}};
    static const uint32_t indices[6] = {0, 1, 2, 0, 2, 3};
    const struct quadtree_settings settings = {
        .faces = QUADTREE_FACES_CUBE, .layers = 1, .resolution = 128, .pixels = 0.5f, .radius = 0.1f};
    const float c = 0.8660254f;
    const struct trace_view view = {
        .world_from_view = {1, 0, 0, 0, 0, c, 0.5f, 0, 0, -0.5f, c, 0}, .fov_y = 1, .width = 64, .height = 64};
    struct quadtree_store store = {.device = device};
    test_mesh(&edits, 10, positions, 4, indices, 2);
    test_node(&edits, 1, 0, NODE_MESH, 10, NULL);
    test_commit(&edits);
    gpu_scene_init(&gpu, device);
    expect_ok(gpu_scene_update(&gpu, edits.scene, NULL, &changes, NULL, &error), &error);
    expect_ok(quadtree_store_place(&store, &gpu, &view, &settings, &error), &error);
    assert_int_equal(store.uniforms.faces, 5);
    for (uint32_t face = 0; face < store.uniforms.faces; face++)
        assert_true(store.uniforms.face_from_world[3 * face + 2][1] < 0.6f); /* forward: none is the one above */
    quadtree_store_finish(&store);
    gpu_scene_finish(&gpu);
    scene_destroy(edits.scene);
}

/* Placed as the tracer does it, with five faces, as nothing is behind the eye. */
static struct quadtree_uniforms cube_round_the_eye(struct scene *scene)
{
    struct error error = {0};
    struct scene_changes changes;
    struct gpu_scene gpu;
    struct quadtree_store store = {.device = device};
    const struct trace_view view = {
        .world_from_view = {1, 0, 0, 0.1f, 0, 1, 0, 0.6f, 0, 0, 1, -1.8f}, .fov_y = 1, .width = 64, .height = 64};
    const struct quadtree_settings settings = {
        .faces = QUADTREE_FACES_CUBE, .layers = 3, .resolution = 64, .pixels = 0.5f, .radius = 0.1f};
    gpu_scene_init(&gpu, device);
    expect_ok(gpu_scene_update(&gpu, scene, NULL, &changes, NULL, &error), &error);
    expect_ok(quadtree_store_place(&store, &gpu, &view, &settings, &error), &error);
    const struct quadtree_uniforms u = store.uniforms;
    gpu_scene_finish(&gpu);
    quadtree_store_finish(&store);
    assert_int_equal(u.faces, 5);
    return u;
}

TEST(layers_of_all_faces_of_a_cube_show_the_first_surfaces_in_order)
{
    struct scene *scene = curved_scene();
    const struct quadtree_uniforms u = cube_round_the_eye(scene);
    expect_drawn(scene, &u, u.width * u.height * u.faces / 10 * 9);
}

static uint32_t primitives_in_spans(const struct quadtree_layers *layers)
{
    uint32_t count = 0;
    for (uint32_t i = 0; i < layers->span_count; i++)
        count += layers->spans[i].end - layers->spans[i].first;
    return count;
}

/* The hills have 18432 triangles, and there are balls: no texel of any face misses them. */
TEST(layers_are_the_same_where_what_lies_beside_a_face_is_left_out)
{
    struct error error = {0};
    struct scene *scene = curved_scene();
    const struct quadtree_uniforms u = cube_round_the_eye(scene);
    struct drawn drawn;
    drawn_init(&drawn, scene, &u);
    draw_one_way(&drawn);
    const uint32_t of_whole = primitives_in_spans(&drawn.layers); /* in the last face, without boxes */
    const size_t bytes = texels_of(&u) * sizeof(*drawn.visible);
    uint32_t(*whole)[2] = malloc(bytes);
    memcpy(whole, drawn.visible, bytes);
    expect_ok(quadtree_runs_update(&drawn.store.runs, &drawn.seen.gpu, &error), &error);
    draw_one_way(&drawn);
    print_message("%u primitives of %u\n", primitives_in_spans(&drawn.layers), of_whole);
    assert_in_range(primitives_in_spans(&drawn.layers), 1, of_whole - QUADTREE_RUN);
    assert_memory_equal(drawn.visible, whole, bytes);
    free(whole);
    drawn_finish(&drawn);
}

/* ---- sheets ---- */

/* Squares that face the eye, or lean back, at these distances; each an instance of its own. */
static struct scene *sheets(const float *distances, uint32_t count, float lean)
{
    struct test_edits edits = {.scene = test_scene_create()};
    static const uint32_t indices[6] = {0, 1, 2, 2, 1, 3};
    for (uint32_t i = 0; i < count; i++) {
        const float z = -distances[i];
        const float positions[4][3] = {{-4, -4, z + lean}, {4, -4, z + lean}, {-4, 4, z - lean}, {4, 4, z - lean}};
        test_mesh(&edits, 10 + i, positions, 4, indices, 2);
        test_node(&edits, 1 + i, 0, NODE_MESH, 10 + i, NULL);
    }
    test_commit(&edits);
    return edits.scene;
}

/* Draws sheets; of how many texels within them the instances are such in layers 0, 1, 2. */
static uint32_t texels_with(struct scene *scene, const uint32_t instances[3], uint32_t *covered)
{
    struct drawn drawn;
    const struct quadtree_uniforms u = uniforms_of(&usual);
    const size_t slice = (size_t)u.padded_width * u.padded_height;
    uint32_t count = 0;
    *covered = 0;
    drawn_init(&drawn, scene, &u);
    draw(&drawn);
    for (size_t i = 0; i < slice; i++) {
        const uint32_t layers[3] = {drawn.visible[i][0], drawn.visible[slice + i][0],
                                    drawn.visible[2 * slice + i][0]};
        *covered += layers[0] != 0;
        count += memcmp(layers, instances, sizeof(layers)) == 0;
    }
    drawn.seen.store.visible = (struct gpu_texture){0};
    drawn_finish(&drawn);
    return count;
}

TEST(two_sides_of_a_sheet_are_two_layers)
{
    static const float distances[3] = {1.000001f, 1, 2};
    static const uint32_t order[3] = {2, 1, 3};
    uint32_t covered, count = texels_with(sheets(distances, 3, 0), order, &covered);
    print_message("%u of %u texels\n", count, covered);
    assert_in_range(covered, 15000, 16000);
    assert_int_equal(count, covered);
    count = texels_with(sheets(distances, 3, 0.3f), order, &covered);
    print_message("leaning: %u of %u texels\n", count, covered);
}

TEST(of_surfaces_that_coincide_one_is_kept)
{
    static const float distances[3] = {1, 1, 2};
    static const uint32_t one[3] = {1, 3, 0}, other[3] = {2, 3, 0};
    uint32_t covered, count = texels_with(sheets(distances, 3, 0.3f), one, &covered);
    count += texels_with(sheets(distances, 3, 0.3f), other, &covered);
    assert_in_range(covered, 10000, 16000);
    print_message("%u of %u texels\n", count, covered);
    assert_int_equal(count, covered);
}

/* ---- cutouts ---- */

/* A sphere two metres ahead of which one half is cut out: the one towards the eye, or the other. */
static struct scene *half_sphere(bool far_half)
{
    static const float sphere[1][4] = {{0, 0, 0, 0.9f}};
    float m[12];
    const uint8_t texels[2][4] = {{255, 255, 255, far_half ? 255 : 0}, {255, 255, 255, far_half ? 0 : 255}};
    struct test_edits edits = {.scene = test_scene_create()};
    test_texture(&edits, 1, 2, 1, TEXTURE_RGBA8_LINEAR, WRAP_CLAMP, WRAP_CLAMP, 1);
    memcpy(edits.edits[edits.count - 1].set.texture.texels->data, texels, sizeof(texels));
    struct scene_material *cutout = test_material(&edits, 1, 0.4f, 0.5f, 0.6f);
    cutout->value.alpha_mode = ALPHA_MASK;
    cutout->textures[MATERIAL_BASE_COLOUR].texture = 1;
    struct scene_spheres *spheres = test_spheres(&edits, 20, sphere, 1);
    spheres->ranges = test_ranges((const struct record_material_range[]){{0, 1, 1}}, 1);
    spheres->range_count = 1;
    test_transform(m, 1, 1, 1, 1, 1.5707963f, 0, 0, -2); /* the texture's middle is on the side */
    test_node(&edits, 1, 0, NODE_SPHERES, 20, m);
    test_commit(&edits);
    return edits.scene;
}

/* Leaves of the first layer that lie on the half towards the eye, and on the other. */
static void count_halves(struct scene *scene, uint32_t counts[2])
{
    struct drawn drawn;
    const struct quadtree_uniforms u = uniforms_of(&usual);
    drawn_init(&drawn, scene, &u);
    draw(&drawn);
    struct gpu_texture visible = drawn.seen.store.visible;
    drawn.seen.store.visible = drawn.store.visible;
    layers_build(&drawn.seen);
    drawn.seen.store.visible = visible;
    counts[0] = counts[1] = 0;
    for (uint32_t i = 0; i < u.width * u.height; i++) {
        const double w = tree_plane_of(node_at(&drawn.seen, 0, 0, i % u.width, i / u.width)).w;
        if (w > 0)
            counts[depth_of_w(&u, w) > 2]++;
    }
    drawn_finish(&drawn);
}

TEST_LONG(where_a_sphere_is_cut_out_its_far_side_is_the_first_layer_and_its_leaf)
{
    uint32_t near_gone[2], far_gone[2];
    count_halves(half_sphere(true), far_gone);
    count_halves(half_sphere(false), near_gone);
    print_message("far half gone: %u near, %u far; near half gone: %u near, %u far\n", far_gone[0], far_gone[1],
                  near_gone[0], near_gone[1]);
    const bool swapped = far_gone[0] < near_gone[0]; /* whichever half the texture's columns are */
    const uint32_t *whole = swapped ? near_gone : far_gone, *inside = swapped ? far_gone : near_gone;
    assert_in_range(whole[0], 7500, 16000);
    assert_int_equal(whole[1], 0);
    assert_int_equal(inside[0], 0);
    assert_in_range(inside[1], 3750, 16000);
}

/* ---- steps ---- */

/* Leaves bindings as another job of the same context may. */
static void do_something_else(void)
{
    glEnable(GL_SCISSOR_TEST);
    glScissor(3, 5, 7, 9);
    glEnable(GL_BLEND);
    glEnable(GL_CULL_FACE);
    glCullFace(GL_BACK);
    glFrontFace(GL_CW);
    glDepthFunc(GL_LESS);
    glDepthMask(GL_FALSE);
    glClipControl(GL_UPPER_LEFT, GL_NEGATIVE_ONE_TO_ONE);
    glViewport(1, 2, 3, 4);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glBindTextureUnit(UNIT_QUADTREE_DEPTH, 0);
    glBindBufferBase(GL_UNIFORM_BUFFER, UNIFORM_FRAME, 0);
}

static void expect_parts_alike(struct drawn *drawn)
{
    struct error error = {0};
    const size_t bytes = texels_of(&drawn->store.uniforms) * sizeof(*drawn->visible);
    enum tracer_progress progress;
    uint32_t steps = 0;
    draw_one_way(drawn);
    uint32_t(*at_once)[2] = malloc(bytes);
    memcpy(at_once, drawn->visible, bytes);
    expect_ok(quadtree_layers_begin(&drawn->layers, &drawn->store, &error), &error);
    do {
        do_something_else();
        drawn->layers.drawing.part_vertices = 300;
        progress = quadtree_layers_step(&drawn->layers, &drawn->seen.gpu, false, &error);
        steps++;
    } while (progress == TRACER_MORE);
    expect_ok(progress == TRACER_DONE, &error);
    read_back(drawn);
    print_message("%u steps, %u layers a pass\n", steps, drawn->layers.pass_layers);
    /* A step has as many parts as fit into some milliseconds: on a GPU, all. */
    assert_in_range(steps, device->facts.software ? 3 : 1, 1000);
    assert_memory_equal(drawn->visible, at_once, bytes);
    free(at_once);
}

TEST(parts_with_other_work_between_them_give_the_same_layers)
{
    struct layers_view view = usual;
    struct drawn drawn;
    view.width *= 4; /* a pass takes some steps */
    view.height *= 4;
    view.focal *= 4;
    const struct quadtree_uniforms u = uniforms_of(&view);
    const bool fetches_framebuffer = device->facts.fetches_framebuffer;
    drawn_init(&drawn, curved_scene(), &u);
    expect_parts_alike(&drawn);
    device->facts.fetches_framebuffer = false;
    expect_parts_alike(&drawn);
    device->facts.fetches_framebuffer = fetches_framebuffer;
    drawn_finish(&drawn);
}
