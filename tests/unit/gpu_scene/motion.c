/* SPDX-License-Identifier: MIT */
/* The device's copy of a scene while clips play: vertices are where the CPU has them, and each update uploads what
 * changed and nothing else. */
#include "tests/accuracy/motion_scenes.h"

#include "scene/affine.h"
#include "shared/light.h"
#include "shared/material.h"
#include "gpu_scene/scene.h"
#include "trace/tracer.h"
#include "tests/fixtures/device.h"
#include "tests/harness/test.h"

#include <stddef.h>

struct fixture {
    struct scene *scene;
    struct gpu_scene gpu;
    struct scene_changes changes;
    struct test_edits edits;
};

/* Updates the device to the motion; NULL: to the committed scene. The poses are no longer needed afterwards. */
static void update(struct fixture *fixture, struct scene_motion *motion)
{
    struct error error = {0};
    bool ok = gpu_scene_update(&fixture->gpu, fixture->scene, motion, &fixture->changes, NULL, &error);
    assert_string_equal(error.text, "");
    assert_true(ok);
    if (motion)
        scene_motion_finish(motion);
}

static void fixture_init(struct fixture *fixture, struct scene *scene)
{
    *fixture = (struct fixture){.scene = scene, .edits = {.scene = scene}};
    gpu_scene_init(&fixture->gpu, device);
    update(fixture, NULL);
}

static void fixture_finish(struct fixture *fixture)
{
    gpu_scene_finish(&fixture->gpu);
    scene_destroy(fixture->scene);
}

/* Names of what changed, in this order: geometry deformed instances shading lights. */
static void expect_changes(const struct fixture *fixture, const char *expected)
{
    char text[64];
    const struct scene_changes *changes = &fixture->changes;
    snprintf(text, sizeof(text), "%s%s%s%s%s", changes->bits & CHANGED_GEOMETRY ? "geometry " : "",
             changes->bits & CHANGED_DEFORMED ? "deformed " : "",
             changes->bits & CHANGED_INSTANCES ? "instances " : "",
             changes->bits & CHANGED_SHADING ? "shading " : "", changes->bits & CHANGED_LIGHTS ? "lights " : "");
    assert_string_equal(text, expected);
}

static const struct gpu_scene_geometry *geometry_of(const struct fixture *fixture, uint32_t node)
{
    for (uint32_t i = 0; i < fixture->gpu.instance_count; i++)
        if (fixture->gpu.instances[i].node == node)
            return &fixture->gpu.geometries[fixture->gpu.instances[i].geometry];
    fail_msg("node %u has no instance", node);
    return NULL;
}

/* Reads a geometry's vertices on the device, as the shutter opens or as it closes. */
static void read_vertices(const struct gpu_buffer *buffer, const struct geometry *geometry, bool closes,
                          size_t item_bytes, void *out)
{
    size_t first = geometry->first_vertex + (closes ? geometry->close_offset : 0);
    gpu_buffer_read(device, buffer, first * item_bytes, out, geometry->vertex_count * item_bytes);
}

/* ---- vertices ---- */

/* Some twenty operations make a position (targets, the mean of four matrices, a product), on numbers below 8; each
 * rounds by at most 2^-24 of its result. */
#define POSITION_TOLERANCE (20 * 8 / 16777216.0)
/* A normal goes through products of two entries whose difference can be an eighth of them. */
#define NORMAL_TOLERANCE (8 * 20 * 2 / 16777216.0)
/* 16 bits of an octahedron's side; and a tangent that the mean of matrices shortens to a twentieth. */
#define TANGENT_TOLERANCE (1.0 / 32767 * 2 + 20 * 20 / 16777216.0)

static void expect_near(const char *what, size_t vertex, const float *got, const double *expected,
                        double tolerance)
{
    for (int k = 0; k < 3; k++)
        if (!(fabs((double)got[k] - expected[k]) <= tolerance))
            fail_msg("%s of vertex %zu is %.9g %.9g %.9g, expected %.9g %.9g %.9g", what, vertex, (double)got[0],
                     (double)got[1], (double)got[2], expected[0], expected[1], expected[2]);
}

/* Tangents as scene_deform() would make them: it has no need of them itself. */
static void deformed_tangent(const struct fixture *fixture, const struct scene_pose *pose,
                             const struct scene_node *node, size_t vertex, double out[3])
{
    const struct scene_mesh *mesh = scene_mesh(fixture->scene, node->value.object);
    const float *tangents = (const float *)(const void *)mesh->arrays[MESH_TANGENTS]->data;
    const float *added = (const float *)(const void *)mesh->arrays[MESH_TARGET_TANGENTS]->data;
    const uint16_t *joints = (const uint16_t *)(const void *)mesh->arrays[MESH_JOINTS]->data;
    const float *joint_weights = (const float *)(const void *)mesh->arrays[MESH_WEIGHTS]->data;
    float weights[TEST_TARGETS], matrices[TEST_JOINTS][12];
    double tangent[3], moved[3] = {0}, sum = 0;
    struct error error = {0};
    scene_pose_weights(pose, node, mesh, weights);
    assert_true(scene_skin_matrices(fixture->scene, pose, scene_skin(fixture->scene, node->value.skin),
                                    matrices[0], &error));
    for (size_t k = 0; k < 3; k++) {
        tangent[k] = tangents[4 * vertex + k];
        for (size_t t = 0; t < TEST_TARGETS; t++)
            tangent[k] += (double)weights[t] * added[3 * (t * mesh->value.vertex_count + vertex) + k];
    }
    for (size_t i = 0; i < mesh->value.influence_count; i++) {
        size_t at = vertex * mesh->value.influence_count + i;
        const float *m = matrices[joints[at]];
        sum += joint_weights[at];
        for (size_t row = 0; row < 3; row++)
            for (size_t k = 0; k < 3; k++)
                moved[row] += (double)joint_weights[at] * m[4 * row + k] * tangent[k];
    }
    memcpy(out, sum > 0 ? moved : tangent, sizeof(moved));
    double length = sqrt(out[0] * out[0] + out[1] * out[1] + out[2] * out[2]);
    for (int k = 0; k < 3; k++)
        out[k] /= length;
}

static void unpack_unit(float out[3], uint32_t bits)
{
    float x = fmaxf((float)(int16_t)(bits & 0xffff) / 32767.0f, -1);
    float y = fmaxf((float)(int16_t)(bits >> 16) / 32767.0f, -1);
    float v[3] = {x, y, 1 - fabsf(x) - fabsf(y)};
    if (v[2] < 0) {
        v[0] = (1 - fabsf(y)) * (x >= 0 ? 1.0f : -1.0f);
        v[1] = (1 - fabsf(x)) * (y >= 0 ? 1.0f : -1.0f);
    }
    float length = sqrtf(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int k = 0; k < 3; k++)
        out[k] = v[k] / length;
}

static void expect_tangents(const struct fixture *fixture, const struct scene_pose *pose, uint32_t node_id,
                            bool closes)
{
    const struct scene_node *node = scene_node(fixture->scene, node_id);
    const struct geometry *geometry = &geometry_of(fixture, node_id)->device;
    uint32_t *packed = malloc(geometry->vertex_count * sizeof(*packed));
    read_vertices(&fixture->gpu.tangents, geometry, closes, sizeof(*packed), packed);
    for (size_t vertex = 0; vertex < geometry->vertex_count; vertex++) {
        float tangent[3];
        double expected[3];
        unpack_unit(tangent, packed[vertex]);
        deformed_tangent(fixture, pose, node, vertex, expected);
        expect_near("tangent", vertex, tangent, expected, TANGENT_TOLERANCE);
    }
    free(packed);
}

static void expect_vertices(const struct fixture *fixture, const struct scene_pose *pose, uint32_t node_id,
                            bool closes)
{
    const struct scene_node *node = scene_node(fixture->scene, node_id);
    const struct gpu_scene_geometry *gpu_geometry = geometry_of(fixture, node_id);
    const struct geometry *geometry = &gpu_geometry->device;
    size_t count = geometry->vertex_count;
    float(*positions)[4] = malloc(count * sizeof(*positions)), (*normals)[4] = malloc(count * sizeof(*normals));
    float(*right)[3] = malloc(count * sizeof(*right)), (*up)[3] = malloc(count * sizeof(*up));
    struct error error = {0};
    assert_int_equal(gpu_geometry->node, node_id);
    assert_true(scene_deform(fixture->scene, pose, node, right[0], up[0], &error));
    read_vertices(&fixture->gpu.positions, geometry, closes, sizeof(*positions), positions);
    read_vertices(&fixture->gpu.normals, geometry, closes, sizeof(*normals), normals);
    for (size_t vertex = 0; vertex < count; vertex++) {
        const double position[3] = {right[vertex][0], right[vertex][1], right[vertex][2]};
        const double normal[3] = {up[vertex][0], up[vertex][1], up[vertex][2]};
        expect_near("position", vertex, positions[vertex], position, POSITION_TOLERANCE);
        expect_near("normal", vertex, normals[vertex], normal, NORMAL_TOLERANCE);
        for (int k = 0; k < 3; k++) {
            assert_true(positions[vertex][k] >= gpu_geometry->lower[k] - (float)POSITION_TOLERANCE);
            assert_true(positions[vertex][k] <= gpu_geometry->upper[k] + (float)POSITION_TOLERANCE);
        }
    }
    free(positions);
    free(normals);
    free(right);
    free(up);
}

/* Each of those that deform, and tangents of the one that has some. */
static void expect_deformed(const struct fixture *fixture, const struct scene_pose *pose, bool closes)
{
    static const uint32_t nodes[] = {2, 4, 5};
    for (size_t i = 0; i < sizeof(nodes) / sizeof(nodes[0]); i++)
        expect_vertices(fixture, pose, nodes[i], closes);
    expect_tangents(fixture, pose, 2, closes);
}

ALL_TESTS(open_device, close_device)

TEST(vertices_are_where_the_cpu_has_them)
{
    struct fixture fixture;
    struct scene_motion motion, poses;
    fixture_init(&fixture, test_scene_deformed());
    expect_deformed(&fixture, NULL, false);
    test_motion_of_deformed(&motion, 1);
    test_motion_of_deformed(&poses, 1);
    update(&fixture, &motion);
    expect_deformed(&fixture, &poses.poses[0], false);
    assert_false(fixture.gpu.has_motion);
    scene_motion_finish(&poses);
    fixture_finish(&fixture);
}

TEST(an_open_shutter_has_vertices_of_its_first_and_its_last_pose)
{
    struct fixture fixture;
    struct scene_motion motion, poses;
    fixture_init(&fixture, test_scene_deformed());
    test_motion_of_deformed(&motion, 4);
    test_motion_of_deformed(&poses, 4);
    update(&fixture, &motion);
    expect_changes(&fixture, "deformed instances ");
    assert_true(fixture.gpu.has_motion);
    expect_deformed(&fixture, &poses.poses[0], false);
    expect_deformed(&fixture, &poses.poses[3], true);
    update(&fixture, NULL);
    expect_changes(&fixture, "deformed instances ");
    assert_false(fixture.gpu.has_motion);
    assert_int_equal(geometry_of(&fixture, 2)->device.close_offset, 0);
    expect_deformed(&fixture, NULL, false);
    scene_motion_finish(&poses);
    fixture_finish(&fixture);
}

TEST(a_mesh_has_a_geometry_for_each_node_that_deforms_it_and_one_for_all_others)
{
    struct fixture fixture;
    fixture_init(&fixture, test_scene_deformed());
    /* Meshes 7 and 8 as they are; 10 and 9 are shown by nobody so. */
    assert_int_equal(fixture.gpu.geometry_count, 5);
    assert_int_equal(geometry_of(&fixture, 6)->node, 0);
    assert_int_equal(geometry_of(&fixture, 4)->node, 4);
    assert_int_equal(geometry_of(&fixture, 4)->id, 8);
    assert_int_equal(geometry_of(&fixture, 6)->deformed_revision, 0);
    assert_int_not_equal(geometry_of(&fixture, 4)->deformed_revision, 0);
    fixture_finish(&fixture);
}

/* ---- what goes up ---- */

TEST(the_same_poses_again_upload_nothing)
{
    struct fixture fixture;
    struct scene_motion motion;
    fixture_init(&fixture, test_scene_deformed());
    for (int i = 0; i < 2; i++) {
        test_motion_of_deformed(&motion, 3);
        update(&fixture, &motion);
    }
    expect_changes(&fixture, "");
    assert_int_equal(fixture.changes.uploaded_bytes, 0);
    fixture_finish(&fixture);
}

TEST(a_turned_joint_uploads_the_matrices_of_its_skin)
{
    struct fixture fixture;
    struct scene_motion motion;
    float m[12];
    fixture_init(&fixture, test_scene_deformed());
    uint64_t skinned = geometry_of(&fixture, 2)->deformed_revision;
    uint64_t morphed = geometry_of(&fixture, 5)->deformed_revision;
    test_motion_init(&motion, 1);
    test_transform(m, 1, 1, 1, 2, 0.9f, 0, 0, 0);
    test_pose_node(&motion.poses[0], 12, m);
    update(&fixture, &motion);
    expect_changes(&fixture, "deformed ");
    /* Two nodes have the skin: three rows of 16 bytes a joint, and a row for each target of the first. */
    assert_int_equal(fixture.changes.uploaded_bytes, 2 * TEST_JOINTS * 48 + TEST_TARGETS * 16);
    assert_true(geometry_of(&fixture, 2)->deformed_revision > skinned);
    assert_true(geometry_of(&fixture, 4)->deformed_revision > skinned);
    assert_int_equal(geometry_of(&fixture, 5)->deformed_revision, morphed);
    fixture_finish(&fixture);
}

TEST(targets_without_weight_are_left_out)
{
    struct fixture fixture;
    struct scene_motion motion;
    static const float weights[TEST_TARGETS] = {0, 1};
    fixture_init(&fixture, test_scene_deformed());
    test_motion_init(&motion, 1);
    test_pose_weights(&motion.poses[0], 5, weights, TEST_TARGETS);
    update(&fixture, &motion);
    expect_changes(&fixture, "deformed ");
    assert_int_equal(fixture.changes.uploaded_bytes, 16);
    fixture_finish(&fixture);
}

/* Geometries are listed anew and their vertices packed elsewhere; those of before are the same shapes still. */
TEST(a_node_that_begins_to_deform_leaves_the_others_their_revisions)
{
    struct fixture fixture;
    fixture_init(&fixture, test_scene_deformed());
    uint64_t revisions[2] = {geometry_of(&fixture, 2)->deformed_revision,
                             geometry_of(&fixture, 5)->deformed_revision};
    test_node(&fixture.edits, 1, 0, NODE_MESH, 9, NULL);
    test_soup_mesh(&fixture.edits, 1, 50, 0.4f, 99);
    test_commit(&fixture.edits);
    update(&fixture, NULL);
    expect_changes(&fixture, "geometry deformed instances ");
    assert_int_equal(fixture.gpu.geometry_count, 7);
    assert_int_equal(geometry_of(&fixture, 2)->deformed_revision, revisions[0]);
    assert_int_equal(geometry_of(&fixture, 5)->deformed_revision, revisions[1]);
    expect_deformed(&fixture, NULL, false);
    expect_vertices(&fixture, NULL, 1, false);
    fixture_finish(&fixture);
}

/* A tracer keeps what it has made of vertices by their revision. */
TEST(vertices_have_a_new_revision_after_an_update_that_failed)
{
    struct fixture fixture;
    struct scene_motion motion;
    struct error error = {0};
    fixture_init(&fixture, test_scene_deformed());
    uint64_t before = geometry_of(&fixture, 2)->deformed_revision;
    uint64_t limit_bytes = device->memory_limit_bytes;
    device->memory_limit_bytes = 1;
    test_soup_mesh(&fixture.edits, 1, 5000, 0.4f, 99);
    test_commit(&fixture.edits);
    test_motion_init(&motion, 1);
    assert_false(gpu_scene_update(&fixture.gpu, fixture.scene, &motion, &fixture.changes, NULL, &error));
    scene_motion_finish(&motion);
    device->memory_limit_bytes = limit_bytes;
    update(&fixture, NULL);
    assert_true(geometry_of(&fixture, 2)->deformed_revision > before);
    expect_deformed(&fixture, NULL, false);
    fixture_finish(&fixture);
}

#define MANY 1000u

static struct scene *many_instances(void)
{
    struct test_edits edits = {.scene = test_scene_create()};
    test_material(&edits, 1, 0.1f, 0.2f, 0.3f);
    test_material(&edits, 2, 0.1f, 0.2f, 0.3f);
    test_soup_mesh(&edits, 10, 20, 0.3f, 1);
    for (uint32_t i = 0; i < MANY; i++)
        test_node(&edits, i + 1, 0, NODE_MESH, 10, NULL);
    test_commit(&edits);
    return edits.scene;
}

static void motion_of_many(struct scene_motion *motion, uint32_t pose_count, float time)
{
    test_motion_init(motion, pose_count);
    for (uint32_t p = 0; p < pose_count; p++)
        for (uint32_t i = 0; i < MANY; i++) {
            float m[12];
            test_transform(m, 1, 1, 1, 1, time + (float)p, (float)i, time, 0);
            test_pose_node(&motion->poses[p], i + 1, m);
        }
}

TEST(a_thousand_moving_instances_upload_their_transforms_alone)
{
    struct fixture fixture;
    struct scene_motion motion;
    fixture_init(&fixture, many_instances());
    for (int frame = 1; frame < 4; frame++) {
        motion_of_many(&motion, 1, 0.1f * (float)frame);
        update(&fixture, &motion);
        expect_changes(&fixture, "instances ");
        assert_int_equal(fixture.changes.uploaded_bytes, MANY * sizeof(struct instance));
    }
    for (int frame = 1; frame < 4; frame++) {
        motion_of_many(&motion, 2, 0.1f * (float)frame);
        update(&fixture, &motion);
        expect_changes(&fixture, "instances ");
        assert_int_equal(fixture.changes.uploaded_bytes, MANY * (sizeof(struct instance) + 2 * 48));
    }
    fixture_finish(&fixture);
}

TEST(an_instance_is_bounded_wherever_it_goes)
{
    struct fixture fixture;
    struct scene_motion motion, poses;
    fixture_init(&fixture, test_scene_soup());
    test_motion_of_soup(&motion, 5);
    test_motion_of_soup(&poses, 5);
    update(&fixture, &motion);
    for (uint32_t i = 0; i < fixture.gpu.instance_count; i++) {
        const struct instance *instance = &fixture.gpu.instances[i];
        float lower[3], upper[3];
        gpu_scene_instance_bounds(&fixture.gpu, i, lower, upper);
        assert_int_equal(instance->flags >> INSTANCE_POSES_SHIFT & INSTANCE_POSES_MASK, 5);
        for (uint32_t p = 0; p < 5; p++) {
            const struct scene_mesh *mesh = scene_mesh(fixture.scene, 10);
            float world[12], low[3], high[3];
            assert_true(scene_world_from_node(fixture.scene, &poses.poses[p], instance->node, world));
            assert_memory_equal(fixture.gpu.motions[(instance->motion - 1) / 3 + p], world, sizeof(world));
            affine_bounds(low, high, world, mesh->lower, mesh->upper);
            for (int k = 0; k < 3; k++) {
                assert_true(low[k] >= lower[k] && high[k] <= upper[k]);
                assert_true(lower[k] >= fixture.gpu.lower_world[k] && upper[k] <= fixture.gpu.upper_world[k]);
            }
        }
    }
    scene_motion_finish(&poses);
    fixture_finish(&fixture);
}

TEST(materials_and_lights_follow_the_first_pose)
{
    struct fixture fixture;
    struct scene_motion motion;
    float m[12];
    struct light light;
    fixture_init(&fixture, test_scene_soup());
    *(&test_add(&fixture.edits, OBJECT_LIGHT)->set.light) =
        (struct scene_light){.base.id = 1, .value.kind = LIGHT_POINT, .value.colour = {1, 2, 3}};
    test_node(&fixture.edits, 50, 0, NODE_LIGHT, 1, NULL);
    test_commit(&fixture.edits);
    update(&fixture, NULL);
    test_motion_init(&motion, 2);
    struct scene_pose *first = &motion.poses[0];
    first->materials = malloc(sizeof(*first->materials));
    first->materials[0] = *scene_material(fixture.scene, 2);
    first->materials[0].value.transmission = 0.5f;
    first->material_count = 1;
    first->lights = malloc(sizeof(*first->lights));
    first->lights[0] = *scene_light(fixture.scene, 1);
    first->lights[0].value.colour[0] = 9;
    first->light_count = 1;
    test_transform(m, 1, 1, 1, 0, 0, 7, 8, 9);
    test_pose_node(first, 50, m);
    update(&fixture, &motion);
    expect_changes(&fixture, "shading lights ");
    assert_in_range(fixture.changes.uploaded_bytes, 1 + sizeof(struct light),
                    sizeof(struct material) +
                        sizeof(struct light)); /* the different parts of the material, and the light */
    assert_true(fixture.gpu.has_transmission);
    gpu_buffer_read(device, &fixture.gpu.lights, 0, &light, sizeof(light));
    assert_float_equal(light.colour[0], 9, 0);
    assert_float_equal(light.position_kind[2], 9, 0);
    assert_float_equal(fixture.gpu.upper_world[1], 8, 0);
    update(&fixture, NULL);
    expect_changes(&fixture, "shading lights ");
    assert_false(fixture.gpu.has_transmission);
    fixture_finish(&fixture);
}

TEST(more_moving_instances_than_the_device_holds_are_refused)
{
    struct fixture fixture;
    struct scene_motion motion;
    struct error error = {0};
    fixture_init(&fixture, many_instances());
    uint64_t texels_max = device->facts.texture_buffer_texels_max;
    device->facts.texture_buffer_texels_max = MANY * 5 * MOTION_TEXELS - 1;
    motion_of_many(&motion, 5, 0);
    assert_false(gpu_scene_update(&fixture.gpu, fixture.scene, &motion, &fixture.changes, NULL, &error));
    assert_int_equal(error.kind, ERROR_LIMIT);
    device->facts.texture_buffer_texels_max++;
    update(&fixture, &motion);
    assert_int_equal(fixture.gpu.motion_count, MANY * 5);
    device->facts.texture_buffer_texels_max = texels_max;
    fixture_finish(&fixture);
}

/* Without a look at what is flat no ray could be taken to its space. */
TEST(what_is_flat_in_some_pose_is_left_out)
{
    struct fixture fixture;
    struct scene_motion motion;
    float m[12];
    fixture_init(&fixture, test_scene_soup());
    assert_int_equal(fixture.gpu.instance_count, 4);
    test_motion_init(&motion, 2);
    test_transform(m, 1, 1, 1, 0, 0, 0, 0, 0);
    test_pose_node(&motion.poses[0], 1, m);
    test_transform(m, 1, 0, 1, 0, 0, 0, 0, 0);
    test_pose_node(&motion.poses[1], 1, m);
    update(&fixture, &motion);
    assert_int_equal(fixture.gpu.instance_count, 3);
    fixture_finish(&fixture);
}

/* Half way through a half turn in two poses everything lies in a line. Embree would divide by that. */
TEST(the_reference_refuses_what_turns_flat_between_two_poses)
{
    struct fixture fixture;
    struct error error = {0};
    const struct tracer_impl *impl = tracer_find(2, "tracer", &error);
    if (!impl) {
        printf("SKIP: %s\n", error.text);
        return;
    }
    fixture_init(&fixture, test_scene_soup());
    struct tracer *reference = tracer_create(impl, device, &(struct tracer_options){0}, &error);
    assert_non_null(reference);
    for (uint32_t poses = 2; poses <= 9; poses += 7) {
        struct scene_motion motion;
        test_motion_init(&motion, poses);
        for (uint32_t p = 0; p < poses; p++) {
            float m[12];
            test_transform(m, 1, 1, 1, 1, 3.14159265f * (float)p / (float)(poses - 1), 1, 2, 3);
            test_pose_node(&motion.poses[p], 1, m);
        }
        assert_true(gpu_scene_update(&fixture.gpu, fixture.scene, &motion, &fixture.changes, NULL, &error));
        assert_int_equal(tracer_update(reference, &fixture.gpu,
                                       &(struct tracer_update){.changed = fixture.changes.bits}, &error),
                         poses > 2);
        if (poses == 2) {
            assert_int_equal(error.kind, ERROR_UNSUPPORTED);
            assert_string_equal(error.field, "node 1.parent_from_node");
        }
        error = (struct error){0};
        scene_motion_finish(&motion);
    }
    tracer_destroy(reference);
    fixture_finish(&fixture);
}
