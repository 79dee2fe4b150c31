/* SPDX-License-Identifier: MIT */
#include "tests/bench/paper_scene.h"

#include "render/context/camera.h"
#include "tests/accuracy/test_scenes.h"

#define PI_F 3.14159265f
enum { FLAKE_SPHERES = 820, FLAKE_DEPTH = 3, LOOSE_SPHERES = 64, BLOB_STEPS = 21, TEXTURE_EDGE = 64 };
_Static_assert(FLAKE_SPHERES + LOOSE_SPHERES + 2 * BLOB_STEPS * BLOB_STEPS + 1 == PAPER_SCENE_PRIMITIVES, "");

/* Object and node identifiers. */
enum { MATERIAL_GROUND = 1, MATERIAL_FLAKE, MATERIAL_BLOB, MATERIAL_LOOSE, LOOSE_MATERIALS = 4 };
enum { OBJECT_FLAKE = 1, OBJECT_LOOSE, OBJECT_FALLING, OBJECT_BLOB };
enum { NODE_FLAKE = 1, NODE_LOOSE, NODE_FALLING, NODE_BLOB, NODE_LIGHTS };
static const float blob_place[3] = {2.6f, 1.0f, 0.6f};

static void add_materials(struct test_edits *edits)
{
    uint8_t texels[TEXTURE_EDGE][TEXTURE_EDGE][4];
    for (int y = 0; y < TEXTURE_EDGE; y++)
        for (int x = 0; x < TEXTURE_EDGE; x++) {
            uint8_t grey = (x / 2 + y / 2) % 2 ? 200 : 110;
            memcpy(texels[y][x], (uint8_t[4]){grey, (uint8_t)(grey - 10), (uint8_t)(grey - 40), 255}, 4);
        }
    struct scene_texture *texture = &test_add(edits, OBJECT_TEXTURE)->set.texture;
    texture->base.id = 1;
    texture->value.width = texture->value.height = TEXTURE_EDGE;
    texture->texels = test_blob(texels, sizeof(texels));
    struct scene_material *ground = test_material(edits, MATERIAL_GROUND, 1.0f, 1.0f, 1.0f);
    ground->value.roughness = 0.7f;
    ground->textures[MATERIAL_BASE_COLOUR].texture = 1;
    struct scene_material *flake = test_material(edits, MATERIAL_FLAKE, 0.95f, 0.75f, 0.45f);
    flake->value.metallic = 1.0f;
    flake->value.roughness = 0.2f;
    struct scene_material *blob = test_material(edits, MATERIAL_BLOB, 0.1f, 0.3f, 0.6f);
    blob->value.roughness = 0.15f;
    struct scene_material *rough = test_material(edits, MATERIAL_LOOSE, 0.7f, 0.2f, 0.15f);
    rough->value.roughness = 0.9f;
    struct scene_material *glossy = test_material(edits, MATERIAL_LOOSE + 1, 0.2f, 0.6f, 0.2f);
    glossy->value.roughness = 0.25f;
    struct scene_material *glass = test_material(edits, MATERIAL_LOOSE + 2, 0.95f, 0.97f, 1.0f);
    glass->value.roughness = 0.0f;
    glass->value.transmission = 1.0f;
    struct scene_material *mirror = test_material(edits, MATERIAL_LOOSE + 3, 0.9f, 0.9f, 0.9f);
    mirror->value.roughness = 0.0f;
    mirror->value.metallic = 1.0f;
}

static void unit_cross(float out[3], const float a[3], const float b[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
    float length = sqrtf(out[0] * out[0] + out[1] * out[1] + out[2] * out[2]);
    for (int i = 0; i < 3; i++)
        out[i] /= length;
}

/* Haines. A Proposal for Standard Graphics Environments. 1987: nine spheres of a third on each, six about its
 * waist and three above them. Returns how many were written. */
static uint32_t add_flake(float (*spheres)[4], const float centre[3], float radius, const float up[3], int depth)
{
    uint32_t count = 1;
    memcpy(spheres[0], (float[4]){centre[0], centre[1], centre[2], radius}, sizeof(spheres[0]));
    if (depth == 0)
        return count;
    const float other[3] = {up[1], up[2], -up[0]};
    float x[3], y[3];
    unit_cross(x, up, other);
    unit_cross(y, up, x);
    for (int i = 0; i < 9; i++) {
        float turn = i < 6 ? PI_F / 3.0f * (float)i : PI_F / 6.0f + 2.0f * PI_F / 3.0f * (float)i;
        float rise = i < 6 ? 0.0f : 0.95f, at[3], away[3];
        for (int k = 0; k < 3; k++) {
            away[k] = cosf(rise) * (cosf(turn) * x[k] + sinf(turn) * y[k]) + sinf(rise) * up[k];
            at[k] = centre[k] + radius * 4.0f / 3.0f * away[k];
        }
        count += add_flake(spheres + count, at, radius / 3.0f, away, depth - 1);
    }
    return count;
}

/* On a spiral about the middle, each lying on the ground. */
static void add_loose(struct test_edits *edits)
{
    float spheres[LOOSE_SPHERES][4];
    struct record_material_range ranges[LOOSE_SPHERES];
    for (uint32_t i = 0; i < LOOSE_SPHERES; i++) {
        float angle = 2.4f * (float)i, away = 2.0f + 0.55f * sqrtf((float)(i * 3 + 4)),
              radius = 0.16f + 0.04f * (float)(i % 7);
        memcpy(spheres[i], (float[4]){away * cosf(angle), radius, away * sinf(angle), radius}, sizeof(spheres[i]));
        ranges[i] = (struct record_material_range){i, 1, MATERIAL_LOOSE + i % LOOSE_MATERIALS};
    }
    const uint32_t falling = LOOSE_SPHERES / 8, lying = LOOSE_SPHERES - falling;
    struct scene_spheres *set = test_spheres(edits, OBJECT_LOOSE, (const float(*)[4])spheres, lying);
    set->ranges = test_ranges(ranges, lying);
    set->range_count = lying;
    set = test_spheres(edits, OBJECT_FALLING, (const float(*)[4])(spheres + lying), falling);
    set->ranges = test_ranges(ranges, falling);
    set->range_count = falling;
    test_node(edits, NODE_LOOSE, 0, NODE_SPHERES, OBJECT_LOOSE, NULL);
    test_node(edits, NODE_FALLING, 0, NODE_SPHERES, OBJECT_FALLING, NULL);
}

static void add_blob(struct test_edits *edits)
{
    enum { ROW = BLOB_STEPS + 1 };
    float positions[ROW * ROW][3], normals[ROW * ROW][3];
    uint32_t indices[BLOB_STEPS * BLOB_STEPS][6];
    for (uint32_t i = 0; i < ROW; i++)
        for (uint32_t j = 0; j < ROW; j++) {
            float theta = PI_F * (float)i / BLOB_STEPS, phi = 2.0f * PI_F * (float)j / BLOB_STEPS;
            float radius = 1.0f + 0.12f * sinf(3.0f * theta) * sinf(2.0f * phi);
            const float unit[3] = {sinf(theta) * cosf(phi), cosf(theta), sinf(theta) * sinf(phi)};
            for (int k = 0; k < 3; k++) {
                positions[i * ROW + j][k] = 0.9f * radius * unit[k];
                normals[i * ROW + j][k] = unit[k];
            }
        }
    for (uint32_t i = 0; i < BLOB_STEPS; i++)
        for (uint32_t j = 0; j < BLOB_STEPS; j++) {
            uint32_t a = i * ROW + j, b = a + ROW;
            memcpy(indices[i * BLOB_STEPS + j], (uint32_t[6]){a, a + 1, b, a + 1, b + 1, b}, sizeof(indices[0]));
        }
    struct scene_mesh *mesh = test_mesh(edits, OBJECT_BLOB, (const float(*)[3])positions, ROW * ROW, indices[0],
                                        2 * BLOB_STEPS * BLOB_STEPS);
    mesh->arrays[MESH_NORMALS] = test_blob(normals, sizeof(normals));
    mesh->ranges = test_ranges(&(struct record_material_range){0, 2 * BLOB_STEPS * BLOB_STEPS, MATERIAL_BLOB}, 1);
    mesh->range_count = 1;
    const float at[12] = {1, 0, 0, blob_place[0], 0, 1, 0, blob_place[1], 0, 0, 1, blob_place[2]};
    test_node(edits, NODE_BLOB, 0, NODE_MESH, OBJECT_BLOB, at);
}

static void add_lights(struct test_edits *edits)
{
    static const float lights[3][7] = {/* place, radius, radiance */
                                       {-5.0f, 8.0f, 4.0f, 0.6f, 22.0f, 20.0f, 17.0f},
                                       {6.0f, 7.0f, 5.0f, 0.5f, 14.0f, 16.0f, 22.0f},
                                       {1.0f, 9.0f, -6.0f, 0.8f, 12.0f, 12.0f, 12.0f}};
    for (uint32_t i = 0; i < 3; i++) {
        struct scene_light *light = &test_add(edits, OBJECT_LIGHT)->set.light;
        light->base.id = 1 + i;
        light->value.kind = LIGHT_SPHERE;
        light->value.size[0] = lights[i][3];
        memcpy(light->value.colour, &lights[i][4], sizeof(light->value.colour));
        const float at[12] = {1, 0, 0, lights[i][0], 0, 1, 0, lights[i][1], 0, 0, 1, lights[i][2]};
        test_node(edits, NODE_LIGHTS + i, 0, NODE_LIGHT, 1 + i, at);
    }
    struct scene_edit *sky = test_add(edits, OBJECT_NODE);
    sky->kind = EDIT_SET_ENVIRONMENT;
    memcpy(sky->set.environment.value.colour, (float[3]){0.18f, 0.24f, 0.32f},
           sizeof(sky->set.environment.value.colour));
}

struct scene *paper_scene_create(void)
{
    struct test_edits edits = {.scene = test_scene_create()};
    if (!edits.scene)
        return NULL;
    float flake[FLAKE_SPHERES][4];
    const float centre[3] = {0.0f, 1.75f, 0.0f}, up[3] = {0.0f, 1.0f, 0.0f};
    add_materials(&edits);
    add_flake(flake, centre, 0.9f, up, FLAKE_DEPTH);
    struct scene_spheres *set = test_spheres(&edits, OBJECT_FLAKE, (const float(*)[4])flake, FLAKE_SPHERES);
    set->ranges = test_ranges(&(struct record_material_range){0, FLAKE_SPHERES, MATERIAL_FLAKE}, 1);
    set->range_count = 1;
    test_node(&edits, NODE_FLAKE, 0, NODE_SPHERES, OBJECT_FLAKE, NULL);
    add_loose(&edits);
    add_blob(&edits);
    struct scene_disc *disc = &test_add(&edits, OBJECT_DISC)->set.disc;
    disc->base.id = 1;
    disc->value.material = MATERIAL_GROUND;
    disc->value.normal_world[1] = 1.0f;
    disc->value.radius = 40.0f;
    add_lights(&edits);
    test_commit(&edits);
    return edits.scene;
}

void paper_scene_request(struct frame_request *request)
{
    const float eye[3] = {-1.5f, 3.4f, 9.0f}, look_at[3] = {0.3f, 1.2f, 0.0f}, up[3] = {0.0f, 1.0f, 0.0f};
    *request = (struct frame_request){
        .picture.width = 640, .picture.height = 480, .sampling.samples = 1, .light.depth = 4};
    frame_camera_look_at(&request->camera, eye, look_at, up, 0.65f);
    request->focus = 9.2f;
}

bool paper_scene_motion(struct scene_motion *motion)
{
    *motion = (struct scene_motion){.poses = calloc(2, sizeof(*motion->poses)), .pose_count = 2};
    if (!motion->poses)
        return false;
    for (uint32_t i = 0; i < 2; i++) {
        struct pose_node *nodes = calloc(2, sizeof(*nodes));
        motion->poses[i].nodes = nodes;
        if (!nodes)
            return false;
        motion->poses[i].node_count = 2;
        nodes[0].node = NODE_FALLING;
        nodes[1].node = NODE_BLOB;
        test_transform(nodes[0].parent_from_node, 1, 1, 1, 1, 0, 0, 0.5f - 0.3f * (float)i, 0);
        test_transform(nodes[1].parent_from_node, 1, 1, 1, 1, 0.3f * (float)i, blob_place[0], blob_place[1],
                       blob_place[2]);
    }
    return true;
}

void paper_scene_motion_finish(struct scene_motion *motion)
{
    for (uint32_t i = 0; motion->poses && i < motion->pose_count; i++)
        free(motion->poses[i].nodes);
    free(motion->poses);
    *motion = (struct scene_motion){0};
}
