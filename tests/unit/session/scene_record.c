/* SPDX-License-Identifier: MIT */
/* A scene as bytes and back, also by way of the disk: nothing is lost, and any bytes may be given. */
#include "session/scene_record.h"

#include "session/keeper.h"
#include "tests/fixtures/engine_port.h"
#include "tests/harness/test.h"
#include "tests/unit/scene/drafts.h"

#include <unistd.h>

static const uint8_t texels[16] = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16};
static const uint8_t half_floats[2 * 8];
static const float numbers[8] = {0, 1, 0, 0, 0, 1, 2, 3};
static const float four_weights[16] = {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0};
static const uint16_t four_joints[16];
static const uint32_t joint[1] = {2};
static const float offsets[12] = {0.5f};

static void name_it(struct scene_object *object, const char *name)
{
    snprintf(object->name, sizeof(object->name), "%s", name);
}

static float *weights_of(float first, float second)
{
    float *weights = malloc(2 * sizeof(*weights));
    assert_non_null(weights);
    weights[0] = first;
    weights[1] = second;
    return weights;
}

static void add_geometry(struct draft_list *list)
{
    struct scene_mesh *mesh = add_mesh(list, 10);
    name_it(&mesh->base, "mesh");
    mesh->value.closed = true;
    mesh->value.influence_count = 4;
    mesh->arrays[MESH_JOINTS] = make_blob(four_joints, sizeof(four_joints));
    mesh->arrays[MESH_WEIGHTS] = make_blob(four_weights, sizeof(four_weights));
    mesh->value.target_count = 1;
    mesh->arrays[MESH_TARGET_POSITIONS] = make_blob(offsets, sizeof(offsets));
    mesh->weights = weights_of(0.25f, 0);
    mesh->weight_count = 1;
    add_range(mesh, 1, 1, 30);
    static const float two[8] = {0, 0, 0, 1, 2, 0, 0, 0.5f};
    struct scene_spheres *spheres = add_spheres(list, 20, two, 2);
    name_it(&spheres->base, "spheres");
    spheres->ranges = malloc(sizeof(*spheres->ranges));
    assert_non_null(spheres->ranges);
    spheres->ranges[0] = (struct record_material_range){0, 2, 30};
    spheres->range_count = 1;
    struct scene_disc *disc = &add_set(list, OBJECT_DISC, 25)->set.disc;
    name_it(&disc->base, "disc");
    disc->value.material = 30;
    disc->value.normal_world[1] = 1;
    disc->value.radius = 3;
}

static void add_looks(struct draft_list *list)
{
    struct scene_texture *texture = &add_set(list, OBJECT_TEXTURE, 40)->set.texture;
    name_it(&texture->base, "texture");
    texture->value.width = texture->value.height = 2;
    texture->value.format = TEXTURE_RGBA8_SRGB;
    texture->value.nearest = true;
    texture->texels = make_blob(texels, sizeof(texels));
    struct scene_material *material = &add_set(list, OBJECT_MATERIAL, 30)->set.material;
    name_it(&material->base, "material");
    material->value.double_sided = material->value.unlit = material->value.emission_seen_only = true;
    material->value.base_colour[0] = 0.25f;
    material->value.emission[1] = 5;
    material->value.metallic = 0.5f;
    material->value.roughness = 0.75f;
    material->value.transmission = 0.125f;
    material->value.ior = 1.25f;
    material->value.alpha_cutoff = 0.375f;
    material->value.anisotropy = 0.625f;
    material->value.anisotropy_rotation = -2;
    material->value.attenuation_distance = 3;
    material->value.attenuation_colour[2] = 0.25f;
    material->value.thickness = 1.5f;
    material->value.specular = 0.75f;
    material->value.specular_colour[1] = 2.5f;
    material->value.clearcoat = 0.5f;
    material->value.clearcoat_roughness = 0.375f;
    material->value.sheen[2] = 0.25f;
    material->value.sheen_roughness = 0.125f;
    material->value.iridescence = 0.75f;
    material->value.iridescence_ior = 1.5f;
    material->value.iridescence_minimum_nm = 50;
    material->value.iridescence_maximum_nm = 500;
    material->value.dispersion = 2;
    material->value.diffuse_transmission = 0.625f;
    material->value.diffuse_transmission_colour[1] = 0.5f;
    material->value.thin_walled = true;
    material->textures[MATERIAL_ANISOTROPY] = (struct record_texture_use){40, 0, {1, 0, 0, 0, 1, 0}, 1};
    material->textures[MATERIAL_EMISSION] = (struct record_texture_use){40, 1, {1, 2, 3, 4, 5, 6}, 0.5f};
    struct scene_light *light = &add_set(list, OBJECT_LIGHT, 50)->set.light;
    name_it(&light->base, "light");
    light->value.kind = LIGHT_SPOT;
    light->value.colour[2] = 9;
    light->value.range = 11;
    light->value.inner_cone = 0.25f;
    light->value.outer_cone = 0.5f;
    struct scene_camera *camera = &add_set(list, OBJECT_CAMERA, 60)->set.camera;
    name_it(&camera->base, "camera");
    camera->value.fov_y = 0.75f;
    camera->value.near = 0.125f;
    struct scene_edit *edit = &list->edits[list->count++];
    *edit = (struct scene_edit){.kind = EDIT_SET_ENVIRONMENT};
    edit->set.environment.value.colour[0] = 2;
    edit->set.environment.value.rotation = 1.5f;
    edit->set.environment.value.display_values = true;
    edit->set.environment.value.light_group = 7;
    edit->set.environment.value.width = 2;
    edit->set.environment.value.height = 1;
    edit->set.environment.texels = make_blob(half_floats, sizeof(half_floats));
}

static void add_nodes(struct draft_list *list)
{
    add_node(list, 2, 0)->value.parent_from_node[3] = 7;
    struct scene_node *shown = add_shown(list, 1, NODE_MESH, 10);
    name_it(&shown->base, "shown");
    shown->value.parent = 2;
    shown->value.hidden = true;
    shown->value.skin = 70;
    shown->value.light_group = 3;
    shown->weights = weights_of(0.5f, 0);
    shown->weight_count = 1;
    struct scene_skin *skin = &add_set(list, OBJECT_SKIN, 70)->set.skin;
    name_it(&skin->base, "skin");
    skin->value.joint_count = 1;
    skin->joints = make_blob(joint, sizeof(joint));
    struct scene_clip *clip = &add_set(list, OBJECT_CLIP, 80)->set.clip;
    name_it(&clip->base, "clip");
    clip->floats = make_blob(numbers, sizeof(numbers));
    add_channel(list, 90, 80, CHANNEL_NODE_TRANSLATION, 2, 3, 2);
}

/* A scene with something of each kind, and with numbers that are no defaults. */
static struct scene *make_scene(void)
{
    struct scene *scene = scene_create("of all kinds", &(struct scene_limits){0});
    static struct draft_list list;
    assert_non_null(scene);
    add_geometry(&list);
    add_looks(&list);
    add_nodes(&list);
    expect_commit(scene, &list);
    for (int kind = 0; kind < OBJECT_ENVIRONMENT; kind++) /* this kind is in no table */
        assert_true(scene->objects[kind].count > 0);
    return scene;
}

/* Blobs of these tests have no hashes yet. */
static void hash_blobs(struct store_record *record)
{
    for (size_t i = 0; i < record->blob_count; i++)
        blob_hash(record->blobs[i]->hash, record->blobs[i]->data, record->blobs[i]->size_bytes);
}

static struct store_record record_of(const struct scene *scene)
{
    static const atomic_bool not_abandoned;
    struct store_record record = {0};
    assert_true(scene_record_write(&record, scene, SHARING_KEPT, &not_abandoned));
    return record;
}

/* In place of the store: the blobs of the record. */
static bool resolve(void *context, const struct record_blob_ref *reference, const char *field, struct blob **blob,
                    struct error *error)
{
    const struct store_record *record = context;
    *blob = NULL;
    for (size_t i = 0; i < record->blob_count && reference->size_bytes && !*blob; i++) {
        if (record->blobs[i]->size_bytes == reference->size_bytes &&
            memcmp(record->blobs[i]->hash, reference->hash, BLOB_HASH_BYTES) == 0)
            *blob = blob_ref(record->blobs[i]);
    }
    return *blob || !reference->size_bytes || error_set(error, ERROR_UNKNOWN_ID, field, "it is not there");
}

TEST(a_scene_of_all_kinds_is_the_same_afterwards)
{
    struct scene *scene = make_scene();
    struct store_record first = record_of(scene);
    hash_blobs(&first);
    store_record_finish(&first);
    first = record_of(scene); /* with the hashes */
    const struct edit_source source = {resolve, &first, 16384};
    struct scene_record read;
    struct error error = {0};
    if (!scene_record_read(&read, first.content, first.content_bytes, &source, &error))
        fail_msg("%s: %s", error.field, error.text);
    assert_string_equal(read.name, "of all kinds");
    assert_int_equal(read.sharing, SHARING_KEPT);
    assert_int_equal(read.revision, 1);
    struct scene *again = scene_create(read.name, &(struct scene_limits){0});
    assert_non_null(again);
    if (!scene_commit(again, read.edits, read.edit_count, &error))
        fail_msg("%s: %s", error.field, error.text);
    for (int kind = 0; kind < OBJECT_COUNT; kind++)
        assert_int_equal(again->objects[kind].count, scene->objects[kind].count);
    assert_int_equal(again->host_bytes, scene->host_bytes);
    /* Structs are compared but for what they own, and where it is compared by the bytes below. */
    const struct scene_material *one = scene_material(scene, 30), *other = scene_material(again, 30);
    assert_memory_equal(one->textures, other->textures, sizeof(one->textures));
    assert_true(
        one->value.ior == other->value.ior && one->value.anisotropy_rotation == other->value.anisotropy_rotation &&
        one->value.specular == other->value.specular && one->value.thickness == other->value.thickness &&
        one->value.attenuation_distance == other->value.attenuation_distance &&
        memcmp(one->value.attenuation_colour, other->value.attenuation_colour,
               sizeof(one->value.attenuation_colour)) == 0 &&
        memcmp(one->value.specular_colour, other->value.specular_colour, sizeof(one->value.specular_colour)) == 0);
    const size_t layers =
        offsetof(struct scene_material, value.thin_walled) - offsetof(struct scene_material, value.clearcoat);
    assert_memory_equal(&one->value.clearcoat, &other->value.clearcoat, layers);
    assert_true(other->value.thin_walled);
    assert_true(other->value.unlit && other->value.double_sided && other->value.emission_seen_only &&
                other->value.alpha_cutoff == 0.375f && other->value.emission[1] == 5);
    assert_string_equal(other->base.name, "material");
    const struct scene_node *node = scene_node(again, 1);
    assert_true(node->value.parent == 2 && node->value.hidden && node->value.skin == 70 &&
                node->weight_count == 1 && node->weights[0] == 0.5f);
    const struct scene_mesh *mesh = scene_mesh(again, 10);
    assert_true(mesh->value.closed && mesh->range_count == 1 && mesh->ranges[0].material == 30 &&
                mesh->weights[0] == 0.25f && mesh->value.influence_count == 4 && mesh->value.target_count == 1);
    for (int i = 0; i < MESH_ARRAY_COUNT; i++)
        assert_true(mesh->arrays[i] == scene_mesh(scene, 10)->arrays[i]);
    assert_true(scene_light(again, 50)->value.outer_cone == 0.5f &&
                scene_light(again, 50)->value.kind == LIGHT_SPOT);
    assert_true(scene_camera(again, 60)->value.near == 0.125f && scene_texture(again, 40)->value.nearest);
    assert_true(again->environment.value.display_values && again->environment.value.light_group == 7 &&
                node->value.light_group == 3);
    assert_true(again->environment.value.rotation == 1.5f &&
                again->environment.texels == scene->environment.texels);
    struct store_record second = record_of(again);
    assert_int_equal(second.content_bytes, first.content_bytes);
    assert_int_equal(second.blob_count, first.blob_count);
    store_record_finish(&second);
    store_record_finish(&first);
    scene_record_finish(&read);
    scene_destroy(again);
    scene_destroy(scene);
}

TEST(any_bytes_may_be_given)
{
    struct scene *scene = make_scene();
    struct store_record record = record_of(scene);
    hash_blobs(&record);
    store_record_finish(&record);
    record = record_of(scene);
    const struct edit_source source = {resolve, &record, 16384};
    struct scene_record read;
    for (size_t at = 0; at < record.content_bytes; at++) {
        struct error error = {0};
        uint8_t before = record.content[at];
        /* Cut off: a scene that ends between two messages is one, as far as its bytes say. */
        if (scene_record_read(&read, record.content, at, &source, &error))
            scene_record_finish(&read);
        else
            assert_true(error.text[0]);
        record.content[at] = (uint8_t)(before ^ (1u << at % 8));
        error = (struct error){0};
        if (scene_record_read(&read, record.content, record.content_bytes, &source, &error))
            scene_record_finish(&read);
        record.content[at] = before;
    }
    store_record_finish(&record);
    scene_destroy(scene);
}

TEST(what_is_abandoned_is_not_written)
{
    static const atomic_bool abandoned = true;
    struct scene *scene = make_scene();
    struct store_record record = {0};
    assert_false(scene_record_write(&record, scene, SHARING_SHARED, &abandoned));
    store_record_finish(&record);
    scene_destroy(scene);
}

/* ---- by way of the disk ------------------------------------------------------------------------------ */

#define PRINCIPAL 1000u /* a user: found again by the next process */

static size_t edits_committed;

/* An engine that does what it is told and keeps nothing. */
static bool submit(void *context, struct engine_command *command, struct error *error)
{
    (void)context, (void)error;
    edits_committed += command->edit_count;
    port_say(port_event(ENGINE_DONE, command->client, command->request));
    engine_command_destroy(command);
    return true;
}

static void keep(struct store *store, const struct scene *scene)
{
    static const atomic_bool not_abandoned;
    const struct engine_keeper keeper = keeper_port(&store);
    struct store_record record = record_of(scene);
    hash_blobs(&record);
    store_record_finish(&record);
    void *made = keeper.read(keeper.context, scene, PRINCIPAL, SHARING_KEPT, &not_abandoned);
    assert_non_null(made);
    keeper.write(keeper.context, made, &not_abandoned);
}

TEST(blobs_of_a_restored_scene_end_with_it)
{
    char folder[] = "/tmp/farlight-keeper-XXXXXX", command[64];
    struct error error = {0};
    assert_non_null(mkdtemp(folder));
    struct store *store = store_open(folder, 1 << 20, &error);
    assert_string_equal(error.text, "");
    struct scene *scene = make_scene();
    keep(store, scene);
    struct hub hub = {.options.engine = port_begin(submit),
                      .options.limits.texture_edge_texels = 16384,
                      .blobs = blob_store_create(1 << 20, 0)}; /* none that is not in use stays */
    edits_committed = 0;
    keeper_restore(store, &hub);
    assert_in_range(edits_committed, OBJECT_ENVIRONMENT, SIZE_MAX);
    blob_store_trim(hub.blobs);
    assert_int_equal(blob_store_count(hub.blobs), 0);
    blob_store_destroy(hub.blobs);
    port_end();
    scene_destroy(scene);
    store_close(store);
    snprintf(command, sizeof(command), "rm -r %s", folder);
    assert_int_equal(system(command), 0);
}
