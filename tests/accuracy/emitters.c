/* SPDX-License-Identifier: MIT */
/* Emissive triangles as lights: the picture stays what it is where the rays that hit them find them alone, and has
 * less noise. A material with a mask that cuts nothing out looks the same and is not sampled; so both are compared
 * in one program. */
#include "tests/accuracy/path_fixture.h"
#include "scene/pose.h"
#include "tests/harness/test.h"

ALL_TESTS(fixture_setup, fixture_teardown)
EACH_TEST(fixture_clear, NULL)

/* A 2 m box about the origin, open towards the eye; a light that gives none keeps the default sky away. */
static struct scene_material *a_box(struct fixture *fixture)
{
    static const float walls[5][12] = {
        {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, -1},  {0, 0, 1, -1, 1, 0, 0, 0, 0, 1, 0, 0},
        {0, 0, -1, 1, 1, 0, 0, 0, 0, -1, 0, 0}, {0, 1, 0, 0, 0, 0, 1, -1, 1, 0, 0, 0},
        {0, -1, 0, 0, 0, 0, -1, 1, 1, 0, 0, 0},
    };
    struct scene_material *material = fixture_material(fixture);
    material->roughness = 0.6f;
    material->ior = 1.5f;
    for (int c = 0; c < 3; c++)
        material->base_colour[c] = 0.7f;
    for (int i = 0; i < 5; i++)
        fixture_square(fixture, 1.0f, material->base.id, walls[i]);
    fixture_light(fixture, LIGHT_POINT, 0.0f, 0.0f, 9.0f, 0.0f);
    fixture_look(fixture, 0.0f, 0.0f, 3.5f, 0.6f);
    return material;
}

/* A square that looks down. */
static struct scene_material *a_lamp(struct fixture *fixture, float x, float y, float z, float half,
                                     float radiance, bool sampled)
{
    const float place[12] = {1, 0, 0, x, 0, 0, -1, y, 0, 1, 0, z};
    struct scene_material *glow = fixture_material(fixture);
    for (int c = 0; c < 3; c++) {
        glow->base_colour[c] = 0.0f;
        glow->emission[c] = radiance;
    }
    glow->alpha_mode = sampled ? ALPHA_OPAQUE : ALPHA_MASK;
    fixture_square(fixture, half, glow->base.id, place);
    return glow;
}

/* What the box contains, apart from its one lamp. */
enum kind { PLAIN, TEXTURED, MANY, BESIDE_LIGHTS, GLASS, ROUGH_GLASS, VEIL, METAL, MIRRORED, KINDS };
static const char *const kind_names[] = {"plain",       "textured", "many",  "beside lights", "glass",
                                         "rough glass", "veil",     "metal", "uneven scale"};

static void a_texture(struct fixture *fixture, struct scene_material *material)
{
    enum { SIZE = 16 };
    static uint8_t texels[SIZE][SIZE][4];
    for (int y = 0; y < SIZE; y++)
        for (int x = 0; x < SIZE; x++)
            for (int c = 0; c < 4; c++)
                texels[y][x][c] = c == 3 ? 255 : x > y + 2 ? 255 : c == 0 ? 40 : 0;
    struct scene_texture *texture = &fixture_edit(fixture, OBJECT_TEXTURE)->set.texture;
    texture->base.id = fixture->next_id++;
    texture->width = texture->height = SIZE;
    texture->format = TEXTURE_RGBA8_SRGB;
    texture->texels = fixture_blob(texels, sizeof(texels));
    material->textures[MATERIAL_EMISSION] =
        (struct texture_use){.texture = texture->base.id, .uv_transform = {1, 0, 0, 0, 1, 0}, .strength = 1.0f};
}

static void many_lamps(struct fixture *fixture, bool sampled)
{
    for (int i = 0; i < 6; i++) {
        const float angle = (float)i;
        a_lamp(fixture, 0.7f * cosf(angle), 0.2f * (float)i - 0.6f, 0.7f * sinf(angle), 0.03f,
               10.0f * (float)(i + 1), sampled);
    }
}

static void a_pane(struct fixture *fixture, enum kind kind)
{
    const float below_lamp[12] = {1, 0, 0, 0, 0, 0, -1, 0.5f, 0, 1, 0, 0};
    struct scene_material *pane = fixture_material(fixture);
    pane->ior = 1.5f;
    pane->base_colour[1] = 0.8f;
    pane->roughness = kind == GLASS ? 0.0f : 0.4f;
    pane->transmission = kind == VEIL ? 0.0f : 1.0f;
    pane->alpha_mode = kind == VEIL ? ALPHA_BLEND : ALPHA_OPAQUE;
    pane->base_colour[3] = kind == VEIL ? 0.4f : 1.0f;
    fixture_square(fixture, 0.6f, pane->base.id, below_lamp);
}

/* What hangs on the ceiling has nearly all of its light below; farther down it makes a bright place above itself.
 */
enum place { ON_CEILING, BELOW_CEILING };

static void a_scene_with(struct fixture *fixture, enum kind kind, enum place where, bool sampled)
{
    struct scene_material *walls = a_box(fixture);
    const bool on_ceiling = where == ON_CEILING;
    struct scene_material *lamp = a_lamp(fixture, 0.1f, on_ceiling ? 0.9999f : 0.9f, 0.0f,
                                         on_ceiling ? 0.1f : 0.4f, on_ceiling ? 40.0f : 2.5f, sampled);
    if (kind == TEXTURED)
        a_texture(fixture, lamp);
    if (kind == MANY)
        many_lamps(fixture, sampled);
    if (kind == BESIDE_LIGHTS) {
        fixture_light(fixture, LIGHT_RECTANGLE, 0.4f, 0.0f, 0.9f, 5.0f);
        fixture_light(fixture, LIGHT_POINT, -0.5f, 0.3f, 0.5f, 0.3f);
    }
    if (kind == GLASS || kind == ROUGH_GLASS || kind == VEIL)
        a_pane(fixture, kind);
    if (kind == METAL) {
        walls->metallic = 1.0f;
        walls->roughness = 0.3f;
    }
    if (kind == MIRRORED) {
        struct scene_node *node = &fixture->edits[fixture->edit_count - 1].set.node;
        const float place[12] = {-2, 0.3f, 0, 0.1f, 0, 0.2f, -1, 0.9f, 0.5f, 1, 0, 0};
        memcpy(node->parent_from_node, place, sizeof(place));
    }
}

static void a_scene(struct fixture *fixture, enum kind kind, bool sampled)
{
    a_scene_with(fixture, kind, BELOW_CEILING, sampled);
}

static double whole(const struct frame_result *result)
{
    return mean_of_picture(result).value;
}

TEST(the_picture_is_that_of_the_rays_that_hit_the_lamps_alone)
{
    struct fixture *fixture = *state;
    static const unsigned tracers[] = {TRACER_REFERENCE, TRACER_BVH};
    for (enum kind kind = 0; kind < KINDS; kind++)
        for (size_t t = 0; t < (kind == VEIL || kind == GLASS ? 2 : 1); t++) {
            struct mean means[2];
            for (int sampled = 0; sampled < 2; sampled++) {
                path_begin(fixture, tracers[t], 3);
                a_scene(fixture, kind, sampled);
                fixture->request.samples = sampled ? 4 : 12;
                means[sampled] = mean_of_seeds(fixture, whole);
            }
            print_message("%s: met alone %.5f (%.0e), sampled %.5f (%.0e) of a third of the samples\n",
                          kind_names[kind], means[0].value, means[0].error, means[1].value, means[1].error);
            /* Rays that hit a texture see it filtered by their wide cones, shadow rays see its texels. */
            const double filtered = kind == TEXTURED ? 0.02 * means[0].value : 0.0;
            assert_mean(means[1], means[0].value, 5.0 * means[0].error + filtered);
            assert_true(means[0].error < 0.03 * means[0].value && means[1].error < 0.03 * means[1].value);
        }
}

/* Stored samples lie up to a cell or so off the surfaces, and off lights as well; cells are four times as wide as
 * by default. */
TEST(stored_samples_show_as_much_light)
{
    struct fixture *fixture = *state;
    static const enum kind kinds[] = {PLAIN, VEIL};
    for (size_t i = 0; i < COUNT(kinds); i++) {
        struct mean means[2];
        for (int sampled = 0; sampled < 2; sampled++) {
            path_begin(fixture, TRACER_LDC, 3);
            fixture->request.tracer_options.ldc.resolution = 256;
            a_scene(fixture, kinds[i], sampled);
            fixture->request.samples = sampled ? 4 : 12;
            means[sampled] = mean_of_seeds(fixture, whole);
        }
        print_message("ldc, %s: met alone %.5f (%.0e), sampled %.5f (%.0e)\n", kind_names[kinds[i]],
                      means[0].value, means[0].error, means[1].value, means[1].error);
        assert_mean(means[1], means[0].value, 5.0 * means[0].error + 0.02 * means[0].value);
    }
}

/* ---- noise ---- */

/* The mean squared error of 64 samples against the converged picture, in all pixels but those of the lamp, of
 * which those of its rim and of its texture's edges are dimmer than it is, and noisy however it is sampled. */
static double noise_of(struct fixture *fixture, enum kind kind, enum place where, bool sampled, const float *truth)
{
    path_begin(fixture, TRACER_REFERENCE, 3);
    a_scene_with(fixture, kind, where, sampled);
    float *noisy = path_render_pixels(fixture, 64, 1);
    double sum = 0.0;
    for (uint32_t i = 0; i < PIXELS; i++)
        sum +=
            truth[i] < 1.0f ? ((double)noisy[i] - (double)truth[i]) * ((double)noisy[i] - (double)truth[i]) : 0.0;
    free(noisy);
    return sum / PIXELS;
}

TEST(lamps_that_are_sampled_have_less_noise)
{
    struct fixture *fixture = *state;
    static const struct {
        enum kind kind;
        enum place where;
        double times; /* a third of what was measured */
    } rows[] = {{PLAIN, ON_CEILING, 10.0}, {TEXTURED, ON_CEILING, 10.0}, {MANY, BELOW_CEILING, 4.0}};
    for (size_t i = 0; i < COUNT(rows); i++) {
        path_begin(fixture, TRACER_REFERENCE, 3);
        a_scene_with(fixture, rows[i].kind, rows[i].where, true);
        /* Its own error adds a quarter to that of sampled emissive surfaces, and so makes the test stricter. */
        float *truth = path_render_pixels(fixture, 256, 77);
        const double before = noise_of(fixture, rows[i].kind, rows[i].where, false, truth);
        const double after = noise_of(fixture, rows[i].kind, rows[i].where, true, truth);
        free(truth);
        print_message("%s: squared error %.2e met alone, %.2e sampled: %.1f times less\n",
                      kind_names[rows[i].kind], before, after, before / after);
        assert_true(after * rows[i].times < before);
    }
}

/* ---- distributed ---- */

/* What is scattered is found by shadow rays alone: as of a rectangle that is declared as a light. */
TEST(distributed_lights_a_floor_by_a_lamp_as_by_a_rectangle)
{
    struct fixture *fixture = *state;
    struct mean means[2];
    for (int declared = 0; declared < 2; declared++) {
        path_begin(fixture, TRACER_REFERENCE, 1);
        fixture->request.integrator = INTEGRATOR_DISTRIBUTED;
        struct scene_material *floor = fixture_material(fixture);
        fixture_square(fixture, 50.0f, floor->base.id, NULL);
        fixture_look(fixture, 0.0f, 0.0f, 1.0f, 0.0f);
        fixture->request.camera.ortho_height = 3.0f;
        fixture->request.samples = 16;
        struct scene_light *light =
            fixture_light(fixture, LIGHT_RECTANGLE, 0.0f, 0.0f, 2.0f, declared ? 1.0f : 0.0f);
        light->size[0] = light->size[1] = 1.0f;
        if (!declared) {
            const float above[12] = {1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1, 2.0f};
            struct scene_material *glow = fixture_material(fixture);
            glow->base_colour[0] = glow->base_colour[1] = glow->base_colour[2] = 0.0f;
            glow->emission[0] = glow->emission[1] = glow->emission[2] = 1.0f;
            fixture_square(fixture, 0.5f, glow->base.id, above);
        }
        means[declared] = mean_of_seeds(fixture, whole);
    }
    print_message("lamp %.6f (%.0e), rectangle %.6f (%.0e)\n", means[0].value, means[0].error, means[1].value,
                  means[1].error);
    assert_mean(means[0], means[1].value, 5.0 * means[1].error);
    assert_true(means[0].error < 1e-3 * means[0].value);
}

/* Directions that are uniform in what the two triangles of a panel take of the half-space bring each sample twice
 * its cosine, whose standard deviation is 1 / sqrt(3); points that are uniform on 4 square metres at 0.1 m, whose
 * mean square is 4 / (3 pi 0.1^2), eleven times as much. */
TEST(a_panel_close_above_a_floor_has_little_noise)
{
    enum { SAMPLES = 16 };
    struct fixture *fixture = *state;
    const float above[12] = {1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1, 0.1f};
    path_begin(fixture, TRACER_REFERENCE, 1);
    fixture->request.integrator = INTEGRATOR_DISTRIBUTED;
    struct scene_material *floor = fixture_material(fixture), *glow = fixture_material(fixture);
    glow->base_colour[0] = glow->base_colour[1] = glow->base_colour[2] = 0.0f;
    glow->emission[0] = glow->emission[1] = glow->emission[2] = 1.0f;
    fixture_square(fixture, 50.0f, floor->base.id, NULL);
    fixture_square(fixture, 1.0f, glow->base.id, above);
    fixture_light(fixture, LIGHT_POINT, 0.0f, 0.0f, 9.0f, 0.0f); /* keeps the default sky away */
    fixture_look(fixture, 0.0f, 0.0f, 0.05f, 0.0f);
    fixture->request.camera.ortho_height = 0.5f;
    float *one = path_render_pixels(fixture, SAMPLES, 1), *other = path_render_pixels(fixture, SAMPLES, 2);
    double mean = 0.0, squares = 0.0;
    for (uint32_t i = 0; i < PIXELS; i++) {
        mean += (double)(one[i] + other[i]) / (2.0 * PIXELS);
        squares += (double)(one[i] - other[i]) * (double)(one[i] - other[i]) / (2.0 * PIXELS);
    }
    print_message("mean %.4f, standard deviation of a pixel %.3f\n", mean, sqrt(squares));
    free(one);
    free(other);
    assert_near(mean, 0.9919, 0.002); /* the form factor of a square seen from 0.1 m below its centre */
    assert_true(sqrt(squares) < 1.0 / sqrt(3.0 * SAMPLES));
}

/* The mean of a floor below a panel that glows, or whose emission is only seen, or 0, beside a light. */
static double floor_below(struct fixture *fixture, unsigned integrator, bool mirror, float emission,
                          bool seen_only)
{
    const float above[12] = {1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1, 1.0f};
    path_begin(fixture, TRACER_BVH, 3);
    fixture->request.integrator = integrator;
    struct scene_material *floor = fixture_material(fixture), *glow = fixture_material(fixture);
    floor->metallic = mirror ? 1.0f : 0.0f;
    floor->roughness = mirror ? 0.0f : 1.0f;
    glow->emission[0] = glow->emission[1] = glow->emission[2] = emission;
    glow->emission_seen_only = seen_only;
    fixture_square(fixture, 50.0f, floor->base.id, NULL);
    fixture_square(fixture, 1.0f, glow->base.id, above);
    fixture_light(fixture, LIGHT_POINT, 0.0f, 0.0f, 0.9f, 1.0f);
    fixture_look(fixture, 0.0f, 0.0f, 0.5f, 0.0f);
    fixture->request.camera.ortho_height = 0.5f;
    fixture->request.samples = 4;
    struct frame_result result = fixture_render(fixture);
    const double mean = whole(&result);
    frame_result_finish(&result);
    return mean;
}

/* The random numbers are the same, and so is what does not come from the panel, but for roundings. */
TEST(emission_that_is_seen_only_shows_in_mirrors_and_lights_nothing)
{
    struct fixture *fixture = *state;
    static const unsigned integrators[] = {INTEGRATOR_PATH, INTEGRATOR_DISTRIBUTED};
    for (size_t i = 0; i < COUNT(integrators); i++)
        for (int mirror = 0; mirror < 2; mirror++) {
            const double dark = floor_below(fixture, integrators[i], mirror, 0.0f, false);
            const double seen = floor_below(fixture, integrators[i], mirror, 2.0f, true);
            const double glowing = floor_below(fixture, integrators[i], mirror, 2.0f, false);
            print_message("dark %.5f, seen only %.5f, glowing %.5f\n", dark, seen, glowing);
            assert_near(seen, mirror ? dark + 2.0 : dark, 1e-4 * seen);
            assert_true(glowing > dark + 0.5); /* a panel of this size above a white floor, at least */
        }
}

/* ---- large meshes, and what moves ---- */

/* A ceiling of more triangles than leaves, so that several make one; brighter at one end. */
static void a_fine_ceiling(struct fixture *fixture, bool sampled)
{
    enum { CELLS = 160, EDGES = CELLS + 1 };
    const float place[12] = {1, 0, 0, 0, 0, 0, -1, 0.95f, 0, 1, 0, 0};
    struct scene_material *glow = a_lamp(fixture, 0.0f, 5.0f, 0.0f, 0.01f, 1.0f, sampled);
    struct scene_mesh *mesh = fixture_square(fixture, 1.0f, glow->base.id, place);
    blob_unref(mesh->arrays[MESH_POSITIONS]);
    blob_unref(mesh->arrays[MESH_INDICES]);
    blob_unref(mesh->arrays[MESH_TEXCOORDS_0]);
    mesh->arrays[MESH_TEXCOORDS_0] = NULL;
    float(*positions)[3] = calloc(EDGES * EDGES, sizeof(*positions));
    uint32_t(*indices)[3] = calloc(CELLS * CELLS * 2, sizeof(*indices));
    assert_true(positions && indices);
    for (uint32_t i = 0; i < EDGES * EDGES; i++) {
        const float u = (float)(i % EDGES) / CELLS, v = (float)(i / EDGES) / CELLS;
        positions[i][0] = 0.9f * (2.0f * u * u - 1.0f); /* triangles of many sizes */
        positions[i][1] = 0.3f * (2.0f * v - 1.0f);
    }
    for (uint32_t i = 0; i < CELLS * CELLS; i++) {
        const uint32_t corner = i / CELLS * EDGES + i % CELLS;
        const uint32_t own[2][3] = {{corner, corner + 1, corner + EDGES},
                                    {corner + 1, corner + EDGES + 1, corner + EDGES}};
        memcpy(indices[2 * i], own, sizeof(own));
    }
    mesh->vertex_count = EDGES * EDGES;
    mesh->triangle_count = CELLS * CELLS * 2;
    mesh->arrays[MESH_POSITIONS] = fixture_blob(positions, EDGES * EDGES * sizeof(*positions));
    mesh->arrays[MESH_INDICES] = fixture_blob(indices, CELLS * CELLS * 2 * sizeof(*indices));
    mesh->ranges[0].count = mesh->triangle_count;
    free(positions);
    free(indices);
}

TEST(a_mesh_of_many_triangles_lights_as_it_is_met)
{
    struct fixture *fixture = *state;
    struct mean means[2];
    for (int sampled = 0; sampled < 2; sampled++) {
        path_begin(fixture, TRACER_REFERENCE, 2);
        a_box(fixture);
        a_fine_ceiling(fixture, sampled);
        fixture->request.samples = 16;
        means[sampled] = mean_of_seeds(fixture, whole);
    }
    print_message("met alone %.5f (%.0e), sampled %.5f (%.0e)\n", means[0].value, means[0].error, means[1].value,
                  means[1].error);
    assert_mean(means[1], means[0].value, 5.0 * means[0].error);
    assert_true(means[1].error < means[0].error);
}

/* The tree of one scene that is edited is as good as that of a new one. */
TEST(a_lamp_that_moves_or_is_switched_lights_from_where_it_is)
{
    struct fixture *fixture = *state;
    struct mean means[2];
    for (int edited = 0; edited < 2; edited++) {
        path_begin(fixture, TRACER_REFERENCE, 2);
        a_scene(fixture, MANY, true);
        fixture->request.samples = 16;
        if (edited) {
            struct frame_result before = fixture_render(fixture);
            frame_result_finish(&before);
        }
        const uint32_t last = fixture->next_id - 1; /* its node; its mesh and material are before */
        const float place[12] = {1, 0, 0, 0.4f, 0, 0, -1, 0.3f, 0, 1, 0, 0.2f};
        if (edited) {
            struct scene_edit *edit = fixture_edit(fixture, OBJECT_NODE);
            edit->set.node = *scene_node(fixture->scene, last);
            edit->set.node.weights = NULL;
            memcpy(edit->set.node.parent_from_node, place, sizeof(place));
            struct scene_material *material = &fixture_edit(fixture, OBJECT_MATERIAL)->set.material;
            *material = *scene_material(fixture->scene, last - 2);
            material->emission[1] = 20.0f;
        } else {
            memcpy(fixture->edits[fixture->edit_count - 1].set.node.parent_from_node, place, sizeof(place));
            fixture->edits[fixture->edit_count - 3].set.material.emission[1] = 20.0f;
        }
        means[edited] = mean_of_seeds(fixture, whole);
    }
    print_message("new %.5f (%.0e), edited %.5f (%.0e)\n", means[0].value, means[0].error, means[1].value,
                  means[1].error);
    assert_mean(means[1], means[0].value, 5.0 * means[0].error);
    assert_true(means[1].error < 2.0 * means[0].error);
}

/* A lamp that crosses the box while the shutter is open, and casts light from where it is at each ray's time. */
TEST(a_lamp_lights_along_its_way_while_the_shutter_is_open)
{
    struct fixture *fixture = *state;
    static const unsigned tracers[] = {TRACER_REFERENCE, TRACER_BVH};
    struct mean means[2];
    for (int sampled = 0; sampled < 2; sampled++) {
        path_begin(fixture, tracers[sampled], 2);
        a_scene(fixture, PLAIN, sampled);
        fixture->request.samples = sampled ? 8 : 32;
        struct pose_node open = {.node = fixture->next_id - 1,
                                 .parent_from_node = {1, 0, 0, -0.7f, 0, 0, -1, 0.5f, 0, 1, 0, 0}};
        struct pose_node close = open;
        close.parent_from_node[3] = 0.7f;
        close.parent_from_node[11] = 0.5f;
        struct scene_pose poses[] = {{.nodes = &open, .node_count = 1}, {.nodes = &close, .node_count = 1}};
        const struct scene_motion motion = {.poses = poses, .pose_count = 2};
        double values[SEEDS];
        for (uint64_t seed = 0; seed < SEEDS; seed++) {
            fixture->request.seed = seed;
            struct frame_result result = fixture_render_motion(fixture, &motion);
            values[seed] = whole(&result);
            frame_result_finish(&result);
        }
        means[sampled] = mean_of(values, SEEDS);
    }
    print_message("met alone %.5f (%.0e), sampled %.5f (%.0e)\n", means[0].value, means[0].error, means[1].value,
                  means[1].error);
    assert_mean(means[1], means[0].value, 5.0 * means[0].error);
    assert_true(means[1].error < 0.02 * means[1].value);
}

/* The default sky is for scenes without light. */
TEST(a_scene_that_a_lamp_lights_has_no_sky_where_lamps_are_lights)
{
    struct fixture *fixture = *state;
    static const struct {
        unsigned integrator;
        float radiance;
        bool sky;
    } cases[] = {{INTEGRATOR_PATH, 2.0f, false},
                 {INTEGRATOR_DISTRIBUTED, 2.0f, false},
                 {INTEGRATOR_WHITTED, 2.0f, true},
                 {INTEGRATOR_PATH, 1.0f, true},
                 {INTEGRATOR_DISTRIBUTED, 1.0f, true}};
    for (size_t i = 0; i < COUNT(cases); i++) {
        path_begin(fixture, TRACER_REFERENCE, 2);
        fixture->request.integrator = cases[i].integrator;
        a_lamp(fixture, 0.0f, 0.0f, 0.0f, 0.1f, cases[i].radiance, true);
        fixture_look(fixture, 0.0f, 0.0f, 3.5f, 0.6f);
        struct frame_result result = fixture_render(fixture);
        const float *corner = fixture_pixel(&result, 0, 0);
        if ((corner[1] > 0.0f) != cases[i].sky)
            fail_msg("integrator %u, a lamp of %g: behind it is %g", cases[i].integrator,
                     (double)cases[i].radiance, (double)corner[1]);
        frame_result_finish(&result);
    }
}
