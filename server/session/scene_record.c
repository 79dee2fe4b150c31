/* SPDX-License-Identifier: MIT */
#include "session/scene_record.h"

#include "protocol/framing.h"
#include "protocol/reader.h"

#include <stdlib.h>
#include <string.h>

#define SCENE 1u               /* its number in the messages */
#define ABANDONED_CHECKS 1024u /* objects between two looks at whether the work is abandoned */

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
    struct record_blob_ref arrays[MESH_ARRAY_COUNT]; /* arrays of the message that is being made */
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

/* The scene's weights as the message has them, which only reads them. */
static struct record_morph_weight *weights_of(float *weights)
{
    _Static_assert(sizeof(struct record_morph_weight) == sizeof(float), "a weight is one float");
    return (struct record_morph_weight *)(void *)weights;
}

static void put_node(struct sink *sink, const struct scene_node *node)
{
    struct message message;
    message_init(&message, MESSAGE_SET_NODE);
    struct message_set_node *set = &message.set_node;
    set->node = node->base.id;
    set->value = node->value;
    set->weights = weights_of(node->weights);
    set->weights_count = node->weight_count;
    set->name = node->base.name;
    put(sink, &message);
}

static void put_mesh(struct sink *sink, const struct scene_mesh *mesh)
{
    struct message message;
    message_init(&message, MESSAGE_SET_MESH);
    struct message_set_mesh *set = &message.set_mesh;
    set->mesh = mesh->base.id;
    set->value = mesh->value;
    set->arrays = sink->arrays;
    set->arrays_count = put_blobs(sink, mesh->arrays, MESH_ARRAY_COUNT);
    set->ranges = mesh->ranges;
    set->ranges_count = mesh->range_count;
    set->weights = weights_of(mesh->weights);
    set->weights_count = mesh->weight_count;
    set->name = mesh->base.name;
    put(sink, &message);
}

static void put_spheres(struct sink *sink, const struct scene_spheres *spheres)
{
    struct message message;
    message_init(&message, MESSAGE_SET_SPHERES);
    struct message_set_spheres *set = &message.set_spheres;
    set->spheres = spheres->base.id;
    set->value = spheres->value;
    set->arrays = sink->arrays;
    set->arrays_count = put_blobs(sink, &spheres->centres_radii, 1);
    set->ranges = spheres->ranges;
    set->ranges_count = spheres->range_count;
    set->name = spheres->base.name;
    put(sink, &message);
}

static void put_disc(struct sink *sink, const struct scene_disc *disc)
{
    struct message message;
    message_init(&message, MESSAGE_SET_DISC);
    struct message_set_disc *set = &message.set_disc;
    set->disc = disc->base.id;
    set->value = disc->value;
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
    set->value = material->value;
    memcpy(textures, material->textures, sizeof(textures));
    for (uint32_t i = 0; i < MATERIAL_TEXTURE_COUNT; i++) {
        if (material->textures[i].texture)
            set->textures_count = i + 1;
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
    set->value = texture->value;
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
    set->value = light->value;
    set->name = light->base.name;
    put(sink, &message);
}

static void put_camera(struct sink *sink, const struct scene_camera *camera)
{
    struct message message;
    message_init(&message, MESSAGE_SET_CAMERA);
    struct message_set_camera *set = &message.set_camera;
    set->camera = camera->base.id;
    set->value = camera->value;
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
    set->value = skin->value;
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
    set->value = channel->value;
    put(sink, &message);
}

static void put_environment(struct sink *sink, const struct scene_environment *environment)
{
    struct message message;
    message_init(&message, MESSAGE_SET_ENVIRONMENT);
    struct message_set_environment *set = &message.set_environment;
    set->value = environment->value;
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
        if (sink->objects++ % ABANDONED_CHECKS == 0 && atomic_load(sink->abandoned))
            fail(sink);
        put_object(sink, kind, object);
    }
}

bool scene_record_object(const struct scene_edit *object,
                         void (*take)(void *context, const struct message *message), void *context)
{
    struct sink sink = {.take = take, .context = context};
    put_object(&sink, object->object, &object->set);
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
