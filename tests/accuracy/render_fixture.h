/* SPDX-License-Identifier: MIT */
/* Small scenes and pictures of them, for the tests of the renderer. */
#ifndef FARLIGHT_TESTS_RENDER_FIXTURE_H
#define FARLIGHT_TESTS_RENDER_FIXTURE_H

#include "base/blob.h"
#include "render/context/camera.h"
#include "render/frame/frame.h"
#include "scene/scene.h"
#include "tests/fixtures/device.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define FIXTURE_EDITS_MAX 128

/* Objects get the numbers 1, 2, .. in the order in which they are added. */
struct fixture {
    struct gpu_device *device;
    struct frame_scene *shared;
    struct frame_renderer *renderer;
    struct scene *scene;
    struct scene_edit edits[FIXTURE_EDITS_MAX];
    size_t edit_count;
    uint32_t next_id;
    struct frame_request request; /* 32x32, one sample, bvh, raster, linear floats; from (0,0,5) to the origin */
};

static inline struct scene_edit *fixture_edit(struct fixture *fixture, enum object_kind object)
{
    assert_true(fixture->edit_count < FIXTURE_EDITS_MAX);
    struct scene_edit *edit = &fixture->edits[fixture->edit_count++];
    *edit = (struct scene_edit){.kind = EDIT_SET, .object = object};
    return edit;
}

static inline struct blob *fixture_blob(const void *data, size_t size_bytes)
{
    struct blob *blob = blob_create(size_bytes);
    assert_non_null(blob);
    memcpy(blob->data, data, size_bytes);
    return blob;
}

static inline void fixture_set_camera(struct fixture *fixture, float x, float y, float z, float fov_y)
{
    const float eye[3] = {x, y, z}, target[3] = {0.0f, 0.0f, 0.0f};
    const float up[3] = {0.0f, x == 0.0f && z == 0.0f ? 0.0f : 1.0f, x == 0.0f && z == 0.0f ? -1.0f : 0.0f};
    assert_true(frame_camera_look_at(&fixture->request.camera, eye, target, up, fov_y));
}

static inline int fixture_setup(void **state)
{
    static struct fixture fixture;
    open_device(state);
    fixture.device = device;
    *state = &fixture;
    return 0;
}

static inline int fixture_teardown(void **state)
{
    struct fixture *fixture = *state;
    scene_destroy(fixture->scene);
    frame_renderer_destroy(fixture->renderer);
    frame_scene_destroy(fixture->shared);
    return close_device(state);
}

/* An empty scene and the default request; before each test. */
static inline int fixture_clear(void **state)
{
    struct fixture *fixture = *state;
    struct error error = {0};
    scene_destroy(fixture->scene);
    frame_renderer_destroy(fixture->renderer); /* the renderer keeps data of one scene */
    frame_scene_destroy(fixture->shared);
    fixture->shared = frame_scene_create(fixture->device, &error);
    assert_non_null(fixture->shared);
    fixture->renderer = frame_renderer_create(fixture->shared, &error);
    fixture->scene = scene_create("test", &(struct scene_limits){.host_bytes = 1u << 30});
    assert_non_null(fixture->renderer);
    assert_non_null(fixture->scene);
    fixture->edit_count = 0;
    fixture->next_id = 1;
    fixture->device->facts.packet_rays = 1; /* else rounding at edges follows the slices */
    fixture->request = (struct frame_request){.picture.width = 32,
                                              .picture.height = 32,
                                              .sampling.samples = 1,
                                              .light.depth = 4,
                                              .tracing.tracer = TRACER_BVH,
                                              .picture.format = PIXEL_FORMAT_RGBA32F};
    fixture_set_camera(fixture, 0.0f, 0.0f, 5.0f, 0.6f);
    return 0;
}

static inline uint32_t fixture_node(struct fixture *fixture, enum node_kind kind, uint32_t object,
                                    const float parent_from_node[12])
{
    static const float identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    struct scene_node *node = &fixture_edit(fixture, OBJECT_NODE)->set.node;
    node->base.id = fixture->next_id++;
    node->value.kind = kind;
    node->value.object = object;
    memcpy(node->value.parent_from_node, parent_from_node ? parent_from_node : identity, sizeof(identity));
    return node->base.id;
}

/* White, Lambert and nothing else (an index of refraction of 1 reflects nothing); change the rest yourself. */
static inline struct scene_material *fixture_material(struct fixture *fixture)
{
    struct scene_material *material = &fixture_edit(fixture, OBJECT_MATERIAL)->set.material;
    material->base.id = fixture->next_id++;
    for (int i = 0; i < 4; i++)
        material->value.base_colour[i] = 1.0f;
    material->value.roughness = 1.0f;
    material->value.ior = 1.0f;
    material->value.alpha_cutoff = 0.5f;
    material->value.specular = material->value.specular_colour[0] = material->value.specular_colour[1] =
        material->value.specular_colour[2] = 1.0f;
    material->value.attenuation_colour[0] = material->value.attenuation_colour[1] =
        material->value.attenuation_colour[2] = 1.0f;
    return material;
}

static inline void fixture_sphere(struct fixture *fixture, float x, float y, float z, float radius,
                                  uint32_t material)
{
    const float centre_radius[4] = {x, y, z, radius};
    struct scene_spheres *spheres = &fixture_edit(fixture, OBJECT_SPHERES)->set.spheres;
    spheres->base.id = fixture->next_id++;
    spheres->value.sphere_count = 1;
    spheres->centres_radii = fixture_blob(centre_radius, sizeof(centre_radius));
    spheres->ranges = calloc(1, sizeof(*spheres->ranges));
    assert_non_null(spheres->ranges);
    *spheres->ranges = (struct record_material_range){0, 1, material};
    spheres->range_count = 1;
    fixture_node(fixture, NODE_SPHERES, spheres->base.id, NULL);
}

/* A square in the plane z = 0 of its node, looking along +z; texture coordinates as an image stands on it. */
static inline struct scene_mesh *fixture_square(struct fixture *fixture, float half, uint32_t material,
                                                const float parent_from_node[12])
{
    const float positions[12] = {-half, -half, 0, half, -half, 0, half, half, 0, -half, half, 0};
    const float texcoords[8] = {0, 1, 1, 1, 1, 0, 0, 0};
    const uint32_t indices[6] = {0, 1, 2, 0, 2, 3};
    struct scene_mesh *mesh = &fixture_edit(fixture, OBJECT_MESH)->set.mesh;
    mesh->base.id = fixture->next_id++;
    mesh->value.vertex_count = 4;
    mesh->value.triangle_count = 2;
    mesh->arrays[MESH_POSITIONS] = fixture_blob(positions, sizeof(positions));
    mesh->arrays[MESH_INDICES] = fixture_blob(indices, sizeof(indices));
    mesh->arrays[MESH_TEXCOORDS_0] = fixture_blob(texcoords, sizeof(texcoords));
    mesh->ranges = calloc(1, sizeof(*mesh->ranges));
    assert_non_null(mesh->ranges);
    *mesh->ranges = (struct record_material_range){0, 2, material};
    mesh->range_count = 1;
    fixture_node(fixture, NODE_MESH, mesh->base.id, parent_from_node);
    return mesh;
}

static inline struct scene_light *fixture_light(struct fixture *fixture, enum light_kind kind, float x, float y,
                                                float z, float power)
{
    /* along -z of the node, as lights shine */
    const float parent_from_node[12] = {1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z};
    struct scene_light *light = &fixture_edit(fixture, OBJECT_LIGHT)->set.light;
    light->base.id = fixture->next_id++;
    light->value.kind = kind;
    light->value.colour[0] = light->value.colour[1] = light->value.colour[2] = power;
    light->value.outer_cone = 0.5f;
    light->value.size[0] = light->value.size[1] = 0.5f;
    fixture_node(fixture, NODE_LIGHT, light->base.id, parent_from_node);
    return light;
}

static inline void fixture_environment(struct fixture *fixture, float r, float g, float b)
{
    struct scene_edit *edit = fixture_edit(fixture, OBJECT_NODE);
    edit->kind = EDIT_SET_ENVIRONMENT;
    edit->set.environment.value.colour[0] = r;
    edit->set.environment.value.colour[1] = g;
    edit->set.environment.value.colour[2] = b;
}

/* Mirrors, glass, blend, cutout, shadows, area light, discs: something of everything. */
static inline void fixture_mixture(struct fixture *fixture)
{
    struct scene_material *glass = fixture_material(fixture);
    glass->value.transmission = 1.0f;
    glass->value.roughness = 0.0f;
    glass->value.ior = 1.5f;
    struct scene_material *mirror = fixture_material(fixture);
    mirror->value.metallic = 1.0f;
    mirror->value.roughness = 0.05f;
    mirror->value.base_colour[2] = 0.6f;
    struct scene_material *veil = fixture_material(fixture);
    veil->value.alpha_mode = ALPHA_BLEND;
    veil->value.base_colour[3] = 0.4f;
    veil->value.base_colour[0] = 0.1f;
    struct scene_material *plain = fixture_material(fixture);
    plain->value.ior = 1.5f;
    plain->value.roughness = 0.4f;
    plain->value.base_colour[1] = 0.5f;
    fixture_sphere(fixture, -0.7f, 0.1f, 0.3f, 0.5f, glass->base.id);
    fixture_sphere(fixture, 0.6f, 0.0f, -0.2f, 0.6f, mirror->base.id);
    fixture_sphere(fixture, 0.1f, -0.3f, 0.9f, 0.2f, plain->base.id);
    const float floor_transform[12] = {1, 0, 0, 0, 0, 0, 1, -0.6f, 0, -1, 0, 0};
    fixture_square(fixture, 3.0f, plain->base.id, floor_transform);
    const float veil_transform[12] = {1, 0, 0, 0.9f, 0, 1, 0, 0.2f, 0, 0, 1, 0.8f};
    fixture_square(fixture, 0.4f, veil->base.id, veil_transform);
    struct scene_disc *disc = &fixture_edit(fixture, OBJECT_DISC)->set.disc;
    disc->base.id = fixture->next_id++;
    disc->value.material = plain->base.id;
    disc->value.normal_world[2] = 1.0f;
    disc->value.centre_world[2] = -3.0f;
    disc->value.radius = 1.2f;
    fixture_environment(fixture, 0.3f, 0.4f, 0.5f);
    fixture_light(fixture, LIGHT_POINT, -2.0f, 3.0f, 3.0f, 20.0f);
    struct scene_light *sphere = fixture_light(fixture, LIGHT_SPHERE, 2.0f, 2.0f, 2.0f, 10.0f);
    sphere->value.size[0] = 0.4f;
    fixture->request.picture.width = 96;
    fixture->request.picture.height = 72;
    fixture_set_camera(fixture, 0.5f, 0.6f, 4.0f, 0.7f);
}

static inline void fixture_commit(struct fixture *fixture)
{
    struct error error = {0};
    if (!scene_commit(fixture->scene, fixture->edits, fixture->edit_count, &error))
        fail_msg("commit: %s: %s", error.field, error.text);
    fixture->edit_count = 0;
}

/* Commits what waits and renders the request while things move so (NULL: not at all). */
static inline struct frame_result fixture_render_motion(struct fixture *fixture, const struct scene_motion *motion)
{
    struct error error = {0};
    struct frame_result result = {0};
    if (fixture->edit_count > 0)
        fixture_commit(fixture);
    if (!frame_begin(fixture->renderer, fixture->scene, motion, &fixture->request, &error))
        fail_msg("frame_begin: %s: %s", error.field, error.text);
    enum frame_progress progress;
    do {
        progress = frame_step(fixture->renderer, &result, &error);
    } while (progress == FRAME_MORE);
    if (progress != FRAME_DONE)
        fail_msg("frame_step: %s: %s", error.field, error.text);
    return result;
}

static inline struct frame_result fixture_render(struct fixture *fixture)
{
    return fixture_render_motion(fixture, NULL);
}

/* The request asks for layers that the frame cannot have. The error's text holds `text`. */
static inline void fixture_expect_no_layers(struct fixture *fixture, const char *text)
{
    struct error error = {0};
    assert_false(frame_begin(fixture->renderer, fixture->scene, NULL, &fixture->request, &error));
    assert_int_equal(error.kind, ERROR_UNSUPPORTED);
    assert_string_equal(error.field, "layers");
    assert_non_null(strstr(error.text, text));
    assert_true(error.remedy[0] != '\0');
}

static inline const float *fixture_pixel(const struct frame_result *result, uint32_t x, uint32_t y)
{
    return (const float *)(const void *)result->pixels + ((size_t)y * result->width + x) * 4;
}

#define assert_near(value, expected, tolerance)                                                                   \
    do {                                                                                                          \
        double value_ = (double)(value), expected_ = (double)(expected);                                          \
        if (!(fabs(value_ - expected_) <= (double)(tolerance)))                                                   \
            fail_msg("%s is %.9g, expected %.9g within %g", #value, value_, expected_, (double)(tolerance));      \
    } while (0)

static inline void assert_same_picture(const struct frame_result *a, const struct frame_result *b)
{
    assert_int_equal(a->size_bytes, b->size_bytes);
    for (size_t i = 0; i < a->size_bytes; i++)
        if (a->pixels[i] != b->pixels[i])
            fail_msg("byte %zu of %zu is %u in one and %u in the other", i, a->size_bytes, a->pixels[i],
                     b->pixels[i]);
}

/* Writes an RGBA8 picture as a PPM where FARLIGHT_TEST_PICTURES names a folder; for the eye. */
static inline void fixture_keep(const struct frame_result *result, const char *name)
{
    const char *folder = getenv("FARLIGHT_TEST_PICTURES");
    char path[512];
    if (!folder || result->format != PIXEL_FORMAT_RGBA8)
        return;
    snprintf(path, sizeof(path), "%s/%s.ppm", folder, name);
    FILE *file = fopen(path, "wb");
    if (!file)
        return;
    fprintf(file, "P6\n%u %u\n255\n", result->width, result->height);
    for (size_t i = 0; i < result->size_bytes; i += 4)
        fwrite(result->pixels + i, 1, 3, file);
    fclose(file);
}

#endif
