/* SPDX-License-Identifier: MIT */
/* The white furnace: whatever is white and stands in a white world that is equally bright all around is not to be
 * seen. What is lost or made by a normal, a transform or a material shows. */
#include "tests/accuracy/render_fixture.h"

#include "shared/path.h"
#include "tests/harness/test.h"

#define PI 3.14159265358979323846

static const double weight_min = (double)PATH_WEIGHT_MIN;
/* A few roundings at each of up to 32 bounces. */
#define FLOAT_ERROR 1e-5
/* Of an angle of incidence: 16-bit normals are 3e-5 off, and rays start 8e-5 (PATH_OFFSET of the 5 that they came)
 * off their surface, which moves the next wall's normal by as much. */
#define SINE_ERROR 1.5e-4

enum shape { SHAPE_SPHERE, SHAPE_MESH, SHAPE_SPHERE_SQUEEZED, SHAPE_MESH_MIRRORED, SHAPE_COUNT };
static const char *const shape_names[SHAPE_COUNT] = {"sphere", "mesh with smooth normals", "squeezed sphere",
                                                     "mirrored and unevenly scaled mesh"};
/* Left-handed, a scale for each axis and a shear. */
static const float squeezed[12] = {0.9f, 0.3f, 0, 0, 0, 0.5f, 0.1f, 0, -0.2f, 0, 0.8f, 0};
static const float mirrored[12] = {-0.9f, 0.3f, 0, 0, 0, 0.5f, 0.1f, 0, 0.2f, 0, 0.8f, 0};

/* A coarse globe whose vertices have the sphere's normals. */
static void add_globe(struct fixture *fixture, uint32_t material, const float parent_from_node[12])
{
    enum { ROWS = 9, COLUMNS = 14, VERTICES = (ROWS + 1) * (COLUMNS + 1), TRIANGLES = 2 * ROWS * COLUMNS };
    float positions[VERTICES][3];
    uint32_t indices[TRIANGLES][3];
    for (int i = 0; i < VERTICES; i++) {
        double down = PI * (i / (COLUMNS + 1)) / ROWS, about = 2.0 * PI * (i % (COLUMNS + 1)) / COLUMNS;
        positions[i][0] = (float)(sin(down) * sin(about));
        positions[i][1] = (float)cos(down);
        positions[i][2] = (float)(sin(down) * cos(about));
    }
    for (uint32_t i = 0; i < ROWS * COLUMNS; i++) {
        uint32_t a = i / COLUMNS * (COLUMNS + 1) + i % COLUMNS, below = a + COLUMNS + 1;
        memcpy(indices[2 * i], (uint32_t[]){a, below, below + 1}, sizeof(indices[0]));
        memcpy(indices[2 * i + 1], (uint32_t[]){a, below + 1, a + 1}, sizeof(indices[0]));
    }
    struct scene_mesh *mesh = &fixture_edit(fixture, OBJECT_MESH)->set.mesh;
    mesh->base.id = fixture->next_id++;
    mesh->vertex_count = VERTICES;
    mesh->triangle_count = TRIANGLES;
    mesh->arrays[MESH_POSITIONS] = fixture_blob(positions, sizeof(positions));
    mesh->arrays[MESH_NORMALS] = fixture_blob(positions, sizeof(positions));
    mesh->arrays[MESH_INDICES] = fixture_blob(indices, sizeof(indices));
    mesh->ranges = calloc(1, sizeof(*mesh->ranges));
    assert_non_null(mesh->ranges);
    *mesh->ranges = (struct material_range){0, TRIANGLES, material};
    mesh->range_count = 1;
    fixture_node(fixture, NODE_MESH, mesh->base.id, parent_from_node);
}

static void add_shape(struct fixture *fixture, enum shape shape, uint32_t material)
{
    if (shape == SHAPE_MESH || shape == SHAPE_MESH_MIRRORED) {
        add_globe(fixture, material, shape == SHAPE_MESH ? NULL : mirrored);
        return;
    }
    fixture_sphere(fixture, 0.0f, 0.0f, 0.0f, 1.0f, material);
    if (shape == SHAPE_SPHERE_SQUEEZED)
        memcpy(fixture->edits[fixture->edit_count - 1].set.node.parent_from_node, squeezed, sizeof(squeezed));
}

static struct texture_use normal_texture(struct fixture *fixture, double x, double z)
{
    const uint8_t texel[4] = {(uint8_t)lrint((x + 1.0) / 2.0 * 255.0), 128,
                              (uint8_t)lrint((z + 1.0) / 2.0 * 255.0), 255};
    struct scene_texture *texture = &fixture_edit(fixture, OBJECT_TEXTURE)->set.texture;
    texture->base.id = fixture->next_id++;
    texture->width = texture->height = 1;
    texture->format = TEXTURE_RGBA8_LINEAR;
    texture->texels = fixture_blob(texel, sizeof(texel));
    return (struct texture_use){texture->base.id, .uv_transform = {1, 0, 0, 0, 1, 0}, .strength = 1.0f};
}

/* White all around. */
static struct scene_material *furnace_material(struct fixture *fixture, float roughness, float metallic, float ior)
{
    fixture_clear((void **)&fixture);
    fixture_environment(fixture, 1.0f, 1.0f, 1.0f);
    struct scene_material *material = fixture_material(fixture);
    material->roughness = roughness;
    material->metallic = metallic;
    material->ior = ior;
    return material;
}

struct range {
    double min, max;
    uint64_t secondary_rays;
};

static struct range picture_range(struct fixture *fixture)
{
    struct range range = {INFINITY, -INFINITY, 0};
    struct frame_result result = fixture_render(fixture);
    for (uint32_t y = 0; y < result.height; y++)
        for (uint32_t x = 0; x < result.width; x++)
            for (int channel = 0; channel < 4; channel++) {
                double value = (double)fixture_pixel(&result, x, y)[channel];
                range.min = fmin(range.min, value);
                range.max = fmax(range.max, value);
            }
    range.secondary_rays = result.secondary_rays;
    frame_result_finish(&result);
    return range;
}

ALL_TESTS(fixture_setup, fixture_teardown)
EACH_TEST(fixture_clear, NULL)

/* All that may be lost is a mirror ray that carries too little; a surface has one. */
TEST(white_surfaces_vanish)
{
    static const struct {
        const char *name;
        float roughness, metallic, ior;
    } materials[] = {
        {"diffuse", 1.0f, 0.0f, 1.0f},          {"metal mirror", 0.0f, 1.0f, 1.5f},
        {"rough metal", 0.6f, 1.0f, 1.5f},      {"glossy metal", 0.25f, 1.0f, 1.5f},
        {"rougher metal", 1.0f, 1.0f, 1.5f},    {"smooth dielectric", 0.0f, 0.0f, 1.5f},
        {"dense dielectric", 0.3f, 0.0f, 2.4f}, {"rough dielectric", 1.0f, 0.0f, 1.5f},
        {"half metal", 0.4f, 0.5f, 1.5f},
    };
    struct fixture *fixture = *state;
    for (size_t i = 0; i < sizeof(materials) / sizeof(materials[0]); i++) {
        double minimum = 1.0, maximum = 1.0;
        for (enum shape shape = 0; shape < SHAPE_COUNT; shape++) {
            struct scene_material *material =
                furnace_material(fixture, materials[i].roughness, materials[i].metallic, materials[i].ior);
            add_shape(fixture, shape, material->base.id);
            struct range range = picture_range(fixture);
            minimum = fmin(minimum, range.min);
            maximum = fmax(maximum, range.max);
            if (!(range.min >= 1.0 - weight_min - FLOAT_ERROR && range.max <= 1.0 + FLOAT_ERROR))
                fail_msg("%s, %s: %.6f .. %.6f", materials[i].name, shape_names[shape], range.min, range.max);
            if (materials[i].roughness == 0.0f)
                assert_true(range.secondary_rays > 0); /* there was something to be mirrored */
        }
        print_message("%-18s 1 %+.1e %+.1e\n", materials[i].name, minimum - 1.0, maximum - 1.0);
    }
}

TEST(grey_surfaces_do_not_vanish)
{
    struct fixture *fixture = *state;
    for (enum shape shape = 0; shape < SHAPE_COUNT; shape++) {
        struct scene_material *material = furnace_material(fixture, 1.0f, 0.0f, 1.0f);
        for (int i = 0; i < 3; i++)
            material->base_colour[i] = 0.5f;
        add_shape(fixture, shape, material->base.id);
        assert_near(picture_range(fixture).min, 0.5, FLOAT_ERROR); /* so the others were there, too */
    }
}

/* What of the light around reaches the eye over a smooth glass sphere whose wall mirrors that share: under one
 * angle all the way, the same at each wall. `depth` bounces are followed, of paths that carry enough. */
static double brought_home(double share, uint32_t depth)
{
    double arrived = share >= weight_min && depth > 0 ? share : 0.0, inside = 1.0 - share;
    for (uint32_t bounces = 1; bounces < depth && inside >= weight_min; bounces++) {
        if (inside * (1.0 - share) >= weight_min)
            arrived += inside * (1.0 - share);
        inside *= share;
    }
    return arrived;
}

/* The sine of incidence on the unit sphere, seen through the middle of a pixel; 1 and more: the ray misses it. */
static double incidence(const struct frame_request *request, uint32_t x, uint32_t y)
{
    const double eye_distance = 5.0, half = tan((double)request->camera.fov_y / 2.0);
    double right = ((x + 0.5) / request->width * 2.0 - 1.0) * half;
    double up = ((y + 0.5) / request->height * 2.0 - 1.0) * half;
    double off_axis2 = right * right + up * up;
    return eye_distance * sqrt(off_axis2 / (1.0 + off_axis2));
}

static double glass_pixel(double sine, uint32_t depth)
{
    if (sine >= 1.0)
        return 1.0;
    double n = 1.5, c = sqrt(1.0 - sine * sine), t = sqrt(1.0 - sine * sine / (n * n));
    double s = (c - n * t) / (c + n * t), p = (n * c - t) / (n * c + t);
    return brought_home((s * s + p * p) / 2.0, depth);
}

TEST(a_clear_glass_sphere_lacks_only_what_is_cut_off)
{
    struct fixture *fixture = *state;
    for (uint32_t depth = 0; depth <= 32; depth = depth * 2 + (depth == 0)) {
        struct scene_material *glass = furnace_material(fixture, 0.0f, 0.0f, 1.5f);
        glass->transmission = 1.0f;
        add_shape(fixture, SHAPE_SPHERE, glass->base.id);
        fixture->request.depth = depth;
        struct frame_result result = fixture_render(fixture);
        double minimum = 1.0, worst = 0.0;
        for (uint32_t y = 0; y < result.height; y++)
            for (uint32_t x = 0; x < result.width; x++) {
                double sine = incidence(&fixture->request, x, y), expected = glass_pixel(sine, depth);
                double nearer = glass_pixel(sine - SINE_ERROR, depth),
                       farther = glass_pixel(sine + SINE_ERROR, depth);
                double value = (double)fixture_pixel(&result, x, y)[0];
                minimum = fmin(minimum, value);
                worst = fmax(worst, fabs(value - expected));
                /* and a path that carries weight_min but for that may end or not */
                assert_true(value >= fmin(expected, fmin(nearer, farther)) - weight_min);
                assert_true(value <= fmax(expected, fmax(nearer, farther)) + weight_min);
            }
        frame_result_finish(&result);
        print_message("glass sphere, depth %2u: 1 %+.4f, from what is expected off by %.1e\n", depth,
                      minimum - 1.0, worst);
    }
}

/* Where no path is left after 32 bounces, all that lacks are side paths that carried too little: one a wall. */
TEST(clear_glass_vanishes_whatever_its_shape)
{
    struct fixture *fixture = *state;
    for (enum shape shape = 0; shape < SHAPE_COUNT; shape++) {
        struct scene_material *glass = furnace_material(fixture, 0.0f, 0.0f, 1.5f);
        glass->transmission = 1.0f;
        add_shape(fixture, shape, glass->base.id);
        fixture->request.depth = 32;
        struct range range = picture_range(fixture);
        print_message("glass, %-34s 1 %+.4f %+.1e\n", shape_names[shape], range.min - 1.0, range.max - 1.0);
        assert_true(range.max <= 1.0 + FLOAT_ERROR);
        assert_true(range.min >= 1.0 - 33.0 * weight_min);
    }
}

/* A square of two sides whose normal map leans all over by one angle, seen under another; 2 or 3 ways on from it.
 */
TEST(tilted_normals_lose_no_light)
{
    struct fixture *fixture = *state;
    double minimum = 1.0, maximum = 1.0;
    for (int transmission = 0; transmission < 2; transmission++)
        for (int tilt = -75; tilt <= 75; tilt += 15)
            for (int slant = 0; slant < 360; slant += 15) {
                if (slant % 180 == 90)
                    continue;
                struct scene_material *material = furnace_material(fixture, 0.0f, 0.0f, 1.5f);
                material->transmission = (float)transmission;
                double lean = tilt * PI / 180.0, from = slant * PI / 180.0;
                material->textures[MATERIAL_NORMAL] = normal_texture(fixture, sin(lean), cos(lean));
                fixture_square(fixture, 100.0f, material->base.id, NULL);
                fixture->request.width = fixture->request.height = 3;
                fixture_look(fixture, (float)(5.0 * sin(from)), 0.0f, (float)(5.0 * cos(from)), 0.01f);
                struct range range = picture_range(fixture);
                minimum = fmin(minimum, range.min);
                maximum = fmax(maximum, range.max);
                if (!(range.min >= 1.0 - 3.0 * weight_min && range.max <= 1.0 + FLOAT_ERROR))
                    fail_msg("transmission %d, tilt %d, slant %d: %.6f .. %.6f", transmission, tilt, slant,
                             range.min, range.max);
            }
    print_message("tilted normals: 1 %+.1e %+.1e\n", minimum - 1.0, maximum - 1.0);
}
