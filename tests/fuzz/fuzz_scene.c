/* SPDX-License-Identifier: MIT */
/* Transactions of nodes, meshes, skins and clips that may or may not fit together: a refused one changes nothing,
 * and what a scene has become can be posed, deformed and measured, at any time of any clip.
 * Input: one byte an edit, then the bytes that it takes; missing ones are 0. */
#include "tests/fuzz/fuzz.h"

#include "scene/edit.h"
#include "scene/pose.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define IDS 6
#define EDITS_MAX 4

struct input {
    const uint8_t *next, *end;
};

static unsigned take(struct input *input)
{
    return input->next < input->end ? *input->next++ : 0;
}

static uint32_t take_id(struct input *input)
{
    unsigned byte = take(input);
    return byte == 255 ? 0 : 1 + byte % IDS;
}

static float take_float(struct input *input, bool tame)
{
    static const float special[] = {0,     1,     -1,      0.5f,    2,     -0.0f, 1e-30f, -3,
                                    1e12f, 1e18f, 2.9e18f, 3.4e38f, -1e6f, 0.25f, NAN,    INFINITY};
    unsigned byte = take(input);
    return tame || byte < 240 ? ((float)byte - 100.0f) / 32 : special[byte - 240];
}

/* Mostly of the size that is wanted. Whole numbers below a limit, or floats where that is 0. */
static struct blob *take_array(struct input *input, size_t elements, size_t element_bytes, unsigned limit)
{
    unsigned how = take(input);
    if (how >= 252)
        return NULL;
    size_t bytes = (elements + (how == 251)) * element_bytes - (how == 250 && elements > 0);
    struct blob *blob = blob_create(bytes ? bytes : 1);
    FUZZ_REQUIRE(blob);
    memset(blob->data, 0, bytes ? bytes : 1);
    for (size_t i = 0; i + 4 <= bytes && !limit; i += 4) {
        float value = take_float(input, how < 200);
        memcpy(blob->data + i, &value, 4);
    }
    for (size_t i = 0; i + element_bytes <= bytes && limit; i += element_bytes)
        blob->data[i] = (uint8_t)(how == 249 ? take(input) : take(input) % limit);
    return blob;
}

static void take_weights(struct input *input, float **weights, uint32_t *count)
{
    *count = take(input) % 4;
    *weights = *count ? malloc(*count * sizeof(**weights)) : NULL;
    for (uint32_t i = 0; i < *count; i++)
        (*weights)[i] = take_float(input, false);
}

static void make_node(struct input *input, struct scene_node *node)
{
    static const enum node_kind kinds[] = {NODE_MESH, NODE_GROUP, NODE_MESH, NODE_LIGHT};
    node->value.parent = take(input) % 2 ? 0 : take_id(input);
    node->value.kind = kinds[take(input) % 4];
    node->value.object = node->value.kind == NODE_GROUP ? 0 : take_id(input);
    node->value.skin = node->value.kind == NODE_MESH && take(input) % 2 ? take_id(input) : 0;
    node->value.hidden = take(input) % 8 == 7;
    node->value.parent_from_node[0] = node->value.parent_from_node[5] = node->value.parent_from_node[10] = 1;
    for (unsigned i = take(input) % 4; i > 0; i--) {
        float value = take_float(input, false);
        node->value.parent_from_node[take(input) % 12] = fabsf(value) <= 1e12f ? value : 0;
    }
    take_weights(input, &node->weights, &node->weight_count);
}

static void make_mesh(struct input *input, struct scene_mesh *mesh)
{
    mesh->value.vertex_count = 3 + take(input) % 2;
    mesh->value.triangle_count = 1;
    mesh->value.influence_count = take(input) % 3;
    mesh->value.target_count = take(input) % 3;
    mesh->arrays[MESH_POSITIONS] = take_array(input, mesh->value.vertex_count, 12, 0);
    mesh->arrays[MESH_INDICES] = take_array(input, 3, 4, 3);
    if (take(input) % 2)
        mesh->arrays[MESH_NORMALS] = take_array(input, mesh->value.vertex_count, 12, 0);
    if (mesh->value.influence_count) {
        mesh->arrays[MESH_JOINTS] =
            take_array(input, (size_t)mesh->value.vertex_count * mesh->value.influence_count, 2, 3);
        mesh->arrays[MESH_WEIGHTS] =
            take_array(input, mesh->value.vertex_count, 4 * mesh->value.influence_count, 0);
        struct blob *weights = mesh->arrays[MESH_WEIGHTS];
        for (size_t i = 0; weights && i + 4 <= weights->size_bytes && take(input) % 16; i += 4)
            weights->data[i + 3] &= 0x7f; /* not negative */
    }
    for (int i = MESH_TARGET_POSITIONS; i < MESH_ARRAY_COUNT && mesh->value.target_count; i++)
        mesh->arrays[i] = take_array(input, (size_t)mesh->value.target_count * mesh->value.vertex_count, 12, 0);
    take_weights(input, &mesh->weights, &mesh->weight_count);
}

static void make_channel(struct input *input, struct scene_channel *channel)
{
    static const uint32_t paths[] = {CHANNEL_NODE_TRANSLATION,     CHANNEL_NODE_ROTATION, CHANNEL_NODE_SCALE,
                                     CHANNEL_NODE_WEIGHTS,         CHANNEL_NODE_HIDDEN,   CHANNEL_LIGHT_SIZE,
                                     CHANNEL_MATERIAL_BASE_COLOUR, CHANNEL_VIEW_EYE,      7};
    static const uint32_t widths[] = {3, 4, 3, 2, 1, 2, 4, 3, 1};
    unsigned which = take(input) % 9;
    channel->value.clip = take_id(input);
    channel->value.path = (enum channel_path)paths[which];
    channel->value.width = widths[which] + (take(input) % 16 == 15);
    channel->value.object = channel->value.path == CHANNEL_VIEW_EYE ? 0 : take_id(input);
    channel->value.interpolation = (enum interpolation)(take(input) % 16 % 6);
    channel->value.key_count = 1 + take(input) % 4;
    channel->value.first_time = take(input) % 4;
    channel->value.first_value = take(input) % 16;
}

static void make_clip(struct input *input, struct scene_clip *clip)
{
    clip->floats = take_array(input, 64u + take(input) % 64, 4, 0);
    size_t rising = 8u + take(input) % 8;
    for (size_t i = 0; clip->floats && i < rising && 4 * i + 4 <= clip->floats->size_bytes; i++) {
        float time_s = (float)i / 4;
        memcpy(clip->floats->data + 4 * i, &time_s, 4);
    }
}

static void make_edit(struct input *input, struct scene_edit *edit)
{
    static const enum object_kind kinds[] = {OBJECT_NODE, OBJECT_MESH,    OBJECT_SKIN,  OBJECT_CLIP,
                                             OBJECT_NODE, OBJECT_CHANNEL, OBJECT_LIGHT, OBJECT_MATERIAL};
    unsigned what = take(input);
    *edit = (struct scene_edit){.kind = what >= 208 ? EDIT_REMOVE : EDIT_SET, .object = kinds[what % 8]};
    edit->id = take_id(input);
    if (edit->kind == EDIT_REMOVE)
        return;
    edit->set.node.base.id = edit->id;
    switch (edit->object) {
    case OBJECT_NODE:
        make_node(input, &edit->set.node);
        break;
    case OBJECT_MESH:
        make_mesh(input, &edit->set.mesh);
        break;
    case OBJECT_SKIN:
        edit->set.skin.value.joint_count = 2 + take(input) % 4;
        edit->set.skin.joints = take_array(input, edit->set.skin.value.joint_count, 4, IDS + 1);
        if (take(input) % 2)
            edit->set.skin.joint_from_mesh = take_array(input, edit->set.skin.value.joint_count, 48, 0);
        break;
    case OBJECT_CLIP:
        make_clip(input, &edit->set.clip);
        break;
    case OBJECT_CHANNEL:
        make_channel(input, &edit->set.channel);
        break;
    default:
        break;
    }
}

static void check_accounts(const struct scene *scene)
{
    uint64_t host_bytes = 0, table_bytes = 0;
    for (int kind = 0; kind < OBJECT_COUNT; kind++) {
        size_t cursor = 0;
        void *object;
        while (hashmap_next(&scene->objects[kind], &cursor, NULL, &object)) {
            host_bytes += object_bytes((enum object_kind)kind, object);
            table_bytes += object_table_bytes((enum object_kind)kind, object);
        }
    }
    FUZZ_REQUIRE(host_bytes == scene->host_bytes);
    FUZZ_REQUIRE(table_bytes == scene->table_bytes);
}

static void check_pose(const struct scene *scene, const struct scene_pose *pose)
{
    struct scene_instance *instances;
    size_t count;
    float lower[3], upper[3];
    for (uint32_t i = 0; i < pose->node_count; i++) {
        FUZZ_REQUIRE(i == 0 || pose->nodes[i].node > pose->nodes[i - 1].node);
        for (int k = 0; k < 12; k++)
            FUZZ_REQUIRE(fabsf(pose->nodes[i].parent_from_node[k]) <= 1e12f);
    }
    for (uint32_t i = 0; i < pose->weight_count; i++)
        FUZZ_REQUIRE(fabsf(pose->weights[i]) <= 1e6f);
    FUZZ_REQUIRE(scene_flatten(scene, pose, NODE_MESH, &instances, &count));
    for (size_t i = 0; i < count; i++) {
        float positions[12], normals[12];
        FUZZ_REQUIRE(scene_deform(scene, pose, instances[i].node, positions, normals, NULL));
    }
    free(instances);
    if (scene_bounds(scene, pose, lower, upper)) {
        for (int axis = 0; axis < 3; axis++)
            FUZZ_REQUIRE(lower[axis] <= upper[axis]);
    }
}

static void play(const struct scene *scene, struct input *input)
{
    struct record_clip_use uses[3];
    uint32_t use_count = 0;
    for (uint32_t clip = 1; clip <= IDS && use_count < 3; clip++) {
        if (scene_clip(scene, clip))
            uses[use_count++] =
                (struct record_clip_use){clip, (float)(take(input) % 4) / 8, 1, take(input) % 2 == 1};
    }
    struct scene_motion motion;
    double open_s = (double)take(input) / 32;
    FUZZ_REQUIRE(scene_motion_evaluate(&motion, scene, uses, use_count, open_s, take(input) % 4, NULL));
    FUZZ_REQUIRE(motion.pose_count >= 1 && motion.pose_count <= MOTION_POSES_MAX);
    for (uint32_t i = 0; i < motion.pose_count; i++)
        check_pose(scene, &motion.poses[i]);
    scene_motion_finish(&motion);
}

static struct blob *array_of(const void *data, size_t bytes)
{
    struct blob *blob = blob_create(bytes);
    FUZZ_REQUIRE(blob);
    memcpy(blob->data, data, bytes);
    return blob;
}

static void set(struct scene_edit *edit, enum object_kind kind, uint32_t id)
{
    *edit = (struct scene_edit){.kind = EDIT_SET, .object = kind};
    edit->set.node.base.id = id;
}

/* Scene at the beginning of the edits: a skinned mesh at node 3, a clip that turns one of its joints. */
static struct scene *make_scene(void)
{
    static const float triangle[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0}, weights[6] = {1, 0, 0, 1, 1, 1};
    static const uint32_t indices[3] = {0, 1, 2}, joints[2] = {1, 2};
    static const uint16_t places[6] = {0, 1, 0, 1, 0, 1};
    static const float turning[10] = {0, 1, 0, 0, 0, 1, 0, 1, 0, 0};
    struct scene_edit edits[7];
    for (uint32_t i = 0; i < 3; i++) {
        set(&edits[i], OBJECT_NODE, i + 1);
        float *m = edits[i].set.node.value.parent_from_node;
        m[0] = m[5] = m[10] = 1;
    }
    edits[2].set.node.value.kind = NODE_MESH;
    edits[2].set.node.value.object = edits[2].set.node.value.skin = 1;
    set(&edits[3], OBJECT_MESH, 1);
    struct scene_mesh *mesh = &edits[3].set.mesh;
    mesh->value.vertex_count = 3;
    mesh->value.triangle_count = 1;
    mesh->value.influence_count = 2;
    mesh->value.target_count = 1;
    mesh->arrays[MESH_POSITIONS] = array_of(triangle, sizeof(triangle));
    mesh->arrays[MESH_NORMALS] = array_of(triangle, sizeof(triangle));
    mesh->arrays[MESH_INDICES] = array_of(indices, sizeof(indices));
    mesh->arrays[MESH_JOINTS] = array_of(places, sizeof(places));
    mesh->arrays[MESH_WEIGHTS] = array_of(weights, sizeof(weights));
    mesh->arrays[MESH_TARGET_POSITIONS] = array_of(triangle, sizeof(triangle));
    set(&edits[4], OBJECT_SKIN, 1);
    edits[4].set.skin.value.joint_count = 2;
    edits[4].set.skin.joints = array_of(joints, sizeof(joints));
    set(&edits[5], OBJECT_CLIP, 1);
    edits[5].set.clip.floats = array_of(turning, sizeof(turning));
    set(&edits[6], OBJECT_CHANNEL, 1);
    edits[6].set.channel = (struct scene_channel){.base.id = 1,
                                                  .value.clip = 1,
                                                  .value.path = CHANNEL_NODE_ROTATION,
                                                  .value.object = 2,
                                                  .value.width = 4,
                                                  .value.key_count = 2,
                                                  .value.first_value = 2};
    struct scene *scene = scene_create("fuzz", NULL);
    FUZZ_REQUIRE(scene && scene_commit(scene, edits, 7, NULL));
    return scene;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct input input = {data, data + size};
    struct scene *scene = make_scene();
    static struct scene_edit edits[EDITS_MAX];
    while (input.next < input.end) {
        size_t count = 1 + take(&input) % 4;
        for (size_t i = 0; i < count; i++)
            make_edit(&input, &edits[i]);
        struct scene before = *scene;
        struct error error = {0};
        bool committed = scene_commit(scene, edits, count, &error);
        for (size_t i = 0; i < count; i++)
            scene_edit_finish(&edits[i]);
        FUZZ_REQUIRE(committed || (error.kind != ERROR_NONE && error.field[0] && error.text[0]));
        FUZZ_REQUIRE(scene->revision == before.revision + committed);
        check_accounts(scene);
        play(scene, &input);
    }
    scene_destroy(scene);
    return 0;
}
