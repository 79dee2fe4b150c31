/* SPDX-License-Identifier: MIT */
#include "session/scene_record.h"

#include "protocol/framing.h"
#include "protocol/reader.h"

#include <stdlib.h>
#include <string.h>

#define SCENE 1u              /* its number in the messages */
#define ABANDONED_LOOKS 1024u /* objects between two looks at whether the work is abandoned */

/* ---- writing ----------------------------------------------------------------------------------------- */

struct sink {
    struct store_record *record;
    /* Instead of the record, for a single object; NULL: there is a record. */
    void (*take)(void *context, const struct message *message);
    void *context;
    size_t capacity_bytes, blob_capacity;
    const atomic_bool *abandoned;
    size_t objects;
    bool failed;
    /* Of the message that is being made. */
    struct record_blob_ref arrays[MESH_ARRAY_COUNT];
    struct record_material_range *ranges; /* owned */
    struct record_morph_weight *weights;  /* owned */
    size_t range_capacity, weight_capacity;
};

static bool fail(struct sink *sink)
{
    sink->failed = true;
    return false;
}

/* Doubles the array until it has place for `needed` elements. */
static bool grow(struct sink *sink, void **array, size_t *capacity, size_t needed, size_t element_bytes)
{
    size_t grown = *capacity ? *capacity : 64;
    while (grown < needed)
        grown *= 2;
    void *moved = grown == *capacity ? *array : realloc(*array, grown * element_bytes);
    if (!moved)
        return fail(sink);
    *array = moved;
    *capacity = grown;
    return true;
}

static void put(struct sink *sink, const struct message *message)
{
    if (sink->take) {
        if (!sink->failed)
            sink->take(sink->context, message);
        return;
    }
    struct store_record *record = sink->record;
    void *content = record->content;
    size_t message_bytes = message_write_bytes(message);
    if (sink->failed || !grow(sink, &content, &sink->capacity_bytes, record->content_bytes + message_bytes, 1))
        return;
    record->content = content;
    struct writer writer;
    writer_init(&writer, record->content + record->content_bytes, message_bytes);
    if (!message_write(&writer, 0, 0, message))
        fail(sink);
    record->content_bytes += writer.used_bytes;
}

/* Returns how many of the arrays the message has: missing ones at the end are left out. */
static uint16_t put_blobs(struct sink *sink, struct blob *const *blobs, uint16_t count)
{
    struct store_record *record = sink->record;
    uint16_t used = 0;
    for (uint16_t i = 0; i < count; i++) {
        sink->arrays[i] = (struct record_blob_ref){0};
        if (!blobs[i])
            continue;
        void *array = record->blobs;
        if (!grow(sink, &array, &sink->blob_capacity, record->blob_count + 1, sizeof(struct blob *)))
            continue;
        record->blobs = array;
        record->blobs[record->blob_count++] = blob_ref(blobs[i]);
        memcpy(sink->arrays[i].hash, blobs[i]->hash, BLOB_HASH_BYTES);
        sink->arrays[i].size_bytes = blobs[i]->size_bytes;
        used = (uint16_t)(i + 1);
    }
    return used;
}

static uint16_t put_ranges(struct sink *sink, const struct material_range *ranges, uint32_t count)
{
    void *array = sink->ranges;
    if (count > UINT16_MAX || !grow(sink, &array, &sink->range_capacity, count, sizeof(*sink->ranges)))
        return (uint16_t)fail(sink);
    sink->ranges = array;
    for (uint32_t i = 0; i < count; i++)
        sink->ranges[i] = (struct record_material_range){
            .first = ranges[i].first, .count = ranges[i].count, .material = ranges[i].material};
    return (uint16_t)count;
}

static uint16_t put_weights(struct sink *sink, const float *weights, uint32_t count)
{
    void *array = sink->weights;
    if (count > UINT16_MAX || !grow(sink, &array, &sink->weight_capacity, count, sizeof(*sink->weights)))
        return (uint16_t)fail(sink);
    sink->weights = array;
    for (uint32_t i = 0; i < count; i++)
        sink->weights[i] = (struct record_morph_weight){.weight = weights[i]};
    return (uint16_t)count;
}

static void put_node(struct sink *sink, const struct scene_node *node)
{
    struct message message;
    message_init(&message, MESSAGE_SET_NODE);
    struct message_set_node *set = &message.set_node;
    set->node = node->base.id;
    set->parent = node->parent;
    set->kind = (enum protocol_node_kind)node->kind;
    set->object = node->object;
    set->hidden = node->hidden;
    memcpy(set->parent_from_node, node->parent_from_node, sizeof(set->parent_from_node));
    set->skin = node->skin;
    set->light_group = node->light_group;
    set->weights_count = put_weights(sink, node->weights, node->weight_count);
    set->weights = sink->weights;
    set->name = node->base.name;
    put(sink, &message);
}

static void put_mesh(struct sink *sink, const struct scene_mesh *mesh)
{
    struct message message;
    message_init(&message, MESSAGE_SET_MESH);
    struct message_set_mesh *set = &message.set_mesh;
    set->mesh = mesh->base.id;
    set->vertex_count = mesh->vertex_count;
    set->triangle_count = mesh->triangle_count;
    set->influence_count = mesh->influence_count;
    set->target_count = mesh->target_count;
    set->closed = mesh->closed;
    set->arrays = sink->arrays;
    set->arrays_count = put_blobs(sink, mesh->arrays, MESH_ARRAY_COUNT);
    set->ranges_count = put_ranges(sink, mesh->ranges, mesh->range_count);
    set->ranges = sink->ranges;
    set->weights_count = put_weights(sink, mesh->weights, mesh->weight_count);
    set->weights = sink->weights;
    set->name = mesh->base.name;
    put(sink, &message);
}

static void put_spheres(struct sink *sink, const struct scene_spheres *spheres)
{
    struct message message;
    message_init(&message, MESSAGE_SET_SPHERES);
    struct message_set_spheres *set = &message.set_spheres;
    set->spheres = spheres->base.id;
    set->sphere_count = spheres->sphere_count;
    set->arrays = sink->arrays;
    set->arrays_count = put_blobs(sink, &spheres->centres_radii, 1);
    set->ranges_count = put_ranges(sink, spheres->ranges, spheres->range_count);
    set->ranges = sink->ranges;
    set->name = spheres->base.name;
    put(sink, &message);
}

static void put_disc(struct sink *sink, const struct scene_disc *disc)
{
    struct message message;
    message_init(&message, MESSAGE_SET_DISC);
    struct message_set_disc *set = &message.set_disc;
    set->disc = disc->base.id;
    set->material = disc->material;
    memcpy(set->centre_world, disc->centre_world, sizeof(set->centre_world));
    memcpy(set->normal_world, disc->normal_world, sizeof(set->normal_world));
    set->radius = disc->radius;
    set->name = disc->base.name;
    put(sink, &message);
}

static void put_material(struct sink *sink, const struct scene_material *material)
{
    struct record_texture_use textures[MATERIAL_TEXTURE_COUNT];
    struct message message;
    message_init(&message, MESSAGE_SET_MATERIAL);
    struct message_set_material *set = &message.set_material;
    set->material = material->base.id;
    set->alpha_mode = (enum protocol_alpha_mode)material->alpha_mode;
    set->double_sided = material->double_sided;
    set->unlit = material->unlit;
    memcpy(set->base_colour, material->base_colour, sizeof(set->base_colour));
    memcpy(set->emission, material->emission, sizeof(set->emission));
    set->metallic = material->metallic;
    set->roughness = material->roughness;
    set->transmission = material->transmission;
    set->ior = material->ior;
    set->alpha_cutoff = material->alpha_cutoff;
    set->anisotropy = material->anisotropy;
    set->anisotropy_rotation = material->anisotropy_rotation;
    set->emission_seen_only = material->emission_seen_only;
    set->specular = material->specular;
    set->specular_red = material->specular_colour[0];
    set->specular_green = material->specular_colour[1];
    set->specular_blue = material->specular_colour[2];
    set->attenuation_distance = material->attenuation_distance;
    set->attenuation_red = material->attenuation[0];
    set->attenuation_green = material->attenuation[1];
    set->attenuation_blue = material->attenuation[2];
    set->thickness = material->thickness;
    set->clearcoat = material->clearcoat;
    set->clearcoat_roughness = material->clearcoat_roughness;
    memcpy(set->sheen, material->sheen, sizeof(set->sheen));
    set->sheen_roughness = material->sheen_roughness;
    set->iridescence = material->iridescence;
    set->iridescence_ior = material->iridescence_ior;
    set->iridescence_minimum_nm = material->iridescence_minimum_nm;
    set->iridescence_maximum_nm = material->iridescence_maximum_nm;
    set->dispersion = material->dispersion;
    set->diffuse_transmission = material->diffuse_transmission;
    set->diffuse_transmission_red = material->diffuse_transmission_colour[0];
    set->diffuse_transmission_green = material->diffuse_transmission_colour[1];
    set->diffuse_transmission_blue = material->diffuse_transmission_colour[2];
    set->thin_walled = material->thin_walled;
    for (int i = 0; i < MATERIAL_TEXTURE_COUNT; i++) {
        const struct texture_use *use = &material->textures[i];
        textures[i] = (struct record_texture_use){
            .texture = use->texture, .texcoord_set = use->texcoord_set, .strength = use->strength};
        memcpy(textures[i].uv_transform, use->uv_transform, sizeof(textures[i].uv_transform));
        if (use->texture)
            set->textures_count = (uint16_t)(i + 1);
    }
    set->textures = textures;
    set->name = material->base.name;
    put(sink, &message);
}

static void put_texture(struct sink *sink, const struct scene_texture *texture)
{
    struct message message;
    message_init(&message, MESSAGE_SET_TEXTURE);
    struct message_set_texture *set = &message.set_texture;
    set->texture = texture->base.id;
    set->width = texture->width;
    set->height = texture->height;
    set->format = (enum protocol_texture_format)texture->format;
    set->wrap_u = (enum protocol_wrap)texture->wrap_u;
    set->wrap_v = (enum protocol_wrap)texture->wrap_v;
    set->nearest = texture->nearest;
    set->arrays = sink->arrays;
    set->arrays_count = put_blobs(sink, &texture->texels, 1);
    set->name = texture->base.name;
    put(sink, &message);
}

static void put_light(struct sink *sink, const struct scene_light *light)
{
    struct message message;
    message_init(&message, MESSAGE_SET_LIGHT);
    struct message_set_light *set = &message.set_light;
    set->light = light->base.id;
    set->kind = (enum protocol_light_kind)light->kind;
    memcpy(set->colour, light->colour, sizeof(set->colour));
    set->range = light->range;
    set->inner_cone = light->inner_cone;
    set->outer_cone = light->outer_cone;
    memcpy(set->size, light->size, sizeof(set->size));
    set->name = light->base.name;
    put(sink, &message);
}

static void put_camera(struct sink *sink, const struct scene_camera *camera)
{
    struct message message;
    message_init(&message, MESSAGE_SET_CAMERA);
    struct message_set_camera *set = &message.set_camera;
    set->camera = camera->base.id;
    set->fov_y = camera->fov_y;
    set->height = camera->height;
    set->near = camera->near;
    set->name = camera->base.name;
    put(sink, &message);
}

static void put_skin(struct sink *sink, const struct scene_skin *skin)
{
    struct blob *const arrays[] = {skin->joints, skin->joint_from_mesh};
    struct message message;
    message_init(&message, MESSAGE_SET_SKIN);
    struct message_set_skin *set = &message.set_skin;
    set->skin = skin->base.id;
    set->joint_count = skin->joint_count;
    set->arrays = sink->arrays;
    set->arrays_count = put_blobs(sink, arrays, 2);
    set->name = skin->base.name;
    put(sink, &message);
}

static void put_clip(struct sink *sink, const struct scene_clip *clip)
{
    struct message message;
    message_init(&message, MESSAGE_SET_CLIP);
    message.set_clip.clip = clip->base.id;
    message.set_clip.arrays = sink->arrays;
    message.set_clip.arrays_count = put_blobs(sink, &clip->floats, 1);
    message.set_clip.name = clip->base.name;
    put(sink, &message);
}

static void put_channel(struct sink *sink, const struct scene_channel *channel)
{
    struct message message;
    message_init(&message, MESSAGE_SET_CHANNEL);
    struct message_set_channel *set = &message.set_channel;
    set->channel = channel->base.id;
    set->clip = channel->clip;
    set->path = (enum protocol_channel_path)channel->path;
    set->object = channel->object;
    set->interpolation = (enum protocol_interpolation)channel->interpolation;
    set->width = channel->width;
    set->key_count = channel->key_count;
    set->first_time = channel->first_time;
    set->first_value = channel->first_value;
    put(sink, &message);
}

static void put_environment(struct sink *sink, const struct scene_environment *environment)
{
    struct message message;
    message_init(&message, MESSAGE_SET_ENVIRONMENT);
    struct message_set_environment *set = &message.set_environment;
    memcpy(set->colour, environment->colour, sizeof(set->colour));
    set->rotation = environment->rotation;
    set->width = environment->width;
    set->height = environment->height;
    set->backdrop = environment->backdrop ? 1 : 0;
    set->keeps_image = environment->keeps_image ? 1 : 0;
    set->display_values = environment->display_values ? 1 : 0;
    set->light_group = environment->light_group;
    set->arrays = sink->arrays;
    set->arrays_count = put_blobs(sink, &environment->texels, 1);
    put(sink, &message);
}

static void put_object(struct sink *sink, enum object_kind kind, const void *object)
{
    switch (kind) {
    case OBJECT_NODE:
        put_node(sink, object);
        return;
    case OBJECT_MESH:
        put_mesh(sink, object);
        return;
    case OBJECT_SPHERES:
        put_spheres(sink, object);
        return;
    case OBJECT_DISC:
        put_disc(sink, object);
        return;
    case OBJECT_MATERIAL:
        put_material(sink, object);
        return;
    case OBJECT_TEXTURE:
        put_texture(sink, object);
        return;
    case OBJECT_LIGHT:
        put_light(sink, object);
        return;
    case OBJECT_CAMERA:
        put_camera(sink, object);
        return;
    case OBJECT_SKIN:
        put_skin(sink, object);
        return;
    case OBJECT_CLIP:
        put_clip(sink, object);
        return;
    case OBJECT_CHANNEL:
        put_channel(sink, object);
        return;
    case OBJECT_ENVIRONMENT:
        put_environment(sink, object);
        return;
    case OBJECT_COUNT:
        return;
    }
}

static void put_objects(struct sink *sink, enum object_kind kind, const struct hashmap *objects)
{
    size_t cursor = 0;
    void *object;
    while (!sink->failed && hashmap_next(objects, &cursor, NULL, &object)) {
        if (sink->objects++ % ABANDONED_LOOKS == 0 && atomic_load(sink->abandoned))
            fail(sink);
        put_object(sink, kind, object);
    }
}

bool scene_record_object(const struct scene_edit *object,
                         void (*take)(void *context, const struct message *message), void *context)
{
    struct sink sink = {.take = take, .context = context};
    put_object(&sink, object->object, &object->set);
    free(sink.ranges);
    free(sink.weights);
    return !sink.failed;
}

bool scene_record_write(struct store_record *record, const struct scene *scene, enum sharing sharing,
                        const atomic_bool *abandoned)
{
    struct sink sink = {.record = record, .abandoned = abandoned};
    struct message message;
    message_init(&message, MESSAGE_SCENE_OPEN);
    message.scene_open.scene = SCENE;
    message.scene_open.sharing = (enum protocol_sharing)sharing;
    message.scene_open.name = scene->name;
    put(&sink, &message);
    message_init(&message, MESSAGE_SCENE_CHANGED);
    message.scene_changed.scene = SCENE;
    message.scene_changed.revision = scene->revision;
    put(&sink, &message);
    for (int kind = 0; kind < OBJECT_COUNT; kind++)
        put_objects(&sink, (enum object_kind)kind, &scene->objects[kind]);
    if (scene->environment.revision)
        put_environment(&sink, &scene->environment);
    free(sink.ranges);
    free(sink.weights);
    return !sink.failed;
}

/* ---- reading ----------------------------------------------------------------------------------------- */

struct source {
    const uint8_t *content;
    size_t left_bytes;
    uint8_t scratch_data[SCRATCH_BYTES];
    struct scratch scratch;
};

/* The next message; false and *error: it is none. */
static bool next(struct source *source, struct message *message, struct error *error)
{
    struct frame frame;
    struct decode_error why = {0};
    enum framing_result result =
        framing_parse(&frame, source->content, source->left_bytes, MESSAGE_FROM_BOTH, &why);
    if (result == FRAMING_NEED_MORE)
        return error_set(error, ERROR_INVALID, "", "a message ends too early");
    scratch_init(&source->scratch, source->scratch_data, sizeof(source->scratch_data));
    if (result == FRAMING_CONSUMED && !frame.info)
        return error_set(error, ERROR_INVALID, "", "a message that is not known");
    if (result == FRAMING_FATAL || !message_decode(message, frame.header.type, frame.payload,
                                                   frame.header.payload_bytes, &source->scratch, &why))
        return error_set(error, ERROR_INVALID, why.field, "%s", why.text);
    source->content += frame.consumed_bytes;
    source->left_bytes -= frame.consumed_bytes;
    return true;
}

static bool read_head(struct scene_record *record, struct source *source, struct error *error)
{
    struct message message;
    if (!next(source, &message, error))
        return false;
    if (message.type != MESSAGE_SCENE_OPEN || !message.scene_open.name[0] ||
        message.scene_open.sharing == PROTOCOL_SHARING_PRIVATE)
        return error_set(error, ERROR_INVALID, "", "not the beginning of a kept or shared scene");
    record->sharing = (enum sharing)message.scene_open.sharing;
    strncpy(record->name, message.scene_open.name, SCENE_NAME_MAX);
    if (!next(source, &message, error))
        return false;
    if (message.type != MESSAGE_SCENE_CHANGED || !message.scene_changed.revision)
        return error_set(error, ERROR_INVALID, "", "the revision is missing");
    record->revision = message.scene_changed.revision;
    return true;
}

static bool read_edits(struct scene_record *record, struct source *source, const struct edit_source *blobs,
                       struct error *error)
{
    size_t capacity = 0;
    while (source->left_bytes) {
        struct message message;
        if (!next(source, &message, error))
            return false;
        if (record->edit_count == capacity) {
            capacity = capacity ? 2 * capacity : 64;
            struct scene_edit *edits = realloc(record->edits, capacity * sizeof(*edits));
            if (!edits)
                return error_set(error, ERROR_OUT_OF_MEMORY, "", "no memory for %zu edits", capacity);
            record->edits = edits;
        }
        if (!edit_from_message(blobs, &message, &record->edits[record->edit_count++], error))
            return false;
    }
    return true;
}

bool scene_record_read(struct scene_record *record, const uint8_t *content, size_t content_bytes,
                       const struct edit_source *blobs, struct error *error)
{
    *record = (struct scene_record){0};
    struct source *source = calloc(1, sizeof(*source));
    if (!source)
        return error_set(error, ERROR_OUT_OF_MEMORY, "", "no memory");
    source->content = content;
    source->left_bytes = content_bytes;
    bool read = read_head(record, source, error) && read_edits(record, source, blobs, error);
    free(source);
    if (!read)
        scene_record_finish(record);
    return read;
}

void scene_record_finish(struct scene_record *record)
{
    for (size_t i = 0; i < record->edit_count; i++)
        scene_edit_finish(&record->edits[i]);
    free(record->edits);
    record->edits = NULL;
    record->edit_count = 0;
}
