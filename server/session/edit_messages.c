/* SPDX-License-Identifier: MIT */
/* Edit messages as edits of the scene, which keeps their values. The decoder has checked each field; how they fit
 * together is for the scene to check when the transaction is applied. */
#include "session/edits.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void begin_set(struct scene_edit *edit, enum object_kind kind, struct scene_object *base, uint32_t id,
                      const char *name)
{
    edit->kind = EDIT_SET;
    edit->object = kind;
    edit->id = id;
    base->id = id;
    snprintf(base->name, sizeof(base->name), "%s", name);
}

/* A copy of an array that the scene is to own; NULL where it is empty. */
static bool keep_array(void **kept, uint32_t *kept_count, const void *array, uint32_t count, size_t element_bytes,
                       struct error *error)
{
    if (!count)
        return true;
    *kept = malloc(count * element_bytes);
    if (!*kept)
        return error_set(error, ERROR_OUT_OF_MEMORY, "edit", "no memory for its arrays");
    memcpy(*kept, array, count * element_bytes);
    *kept_count = count;
    return true;
}

static bool keep_ranges(struct record_material_range **ranges, uint32_t *range_count,
                        const struct record_material_range *array, uint32_t count, struct error *error)
{
    void *kept = NULL;
    const bool done = keep_array(&kept, range_count, array, count, sizeof(*array), error);
    *ranges = kept;
    return done;
}

static bool keep_weights(float **weights, uint32_t *weight_count, const struct record_morph_weight *array,
                         uint32_t count, struct error *error)
{
    _Static_assert(sizeof(*array) == sizeof(**weights), "a weight is one float");
    void *kept = NULL;
    const bool done = keep_array(&kept, weight_count, array, count, sizeof(*array), error);
    *weights = kept;
    return done;
}

/* "set_mesh 7.arrays[2]" */
static bool take_blob(const struct edit_source *source, const struct record_blob_ref *arrays, uint32_t array_count,
                      uint32_t index, const char *what, uint32_t id, struct blob **blob, struct error *error)
{
    char field[64];
    snprintf(field, sizeof(field), "%s %u.arrays[%u]", what, id, index);
    if (index >= array_count)
        return true;
    return source->resolve(source->context, &arrays[index], field, blob, error);
}

static bool from_node(const struct message_set_node *message, struct scene_edit *edit, struct error *error)
{
    struct scene_node *node = &edit->set.node;
    begin_set(edit, OBJECT_NODE, &node->base, message->node, message->name);
    node->value = message->value;
    return keep_weights(&node->weights, &node->weight_count, message->weights, message->weights_count, error);
}

static bool from_mesh(const struct edit_source *source, const struct message_set_mesh *message,
                      struct scene_edit *edit, struct error *error)
{
    struct scene_mesh *mesh = &edit->set.mesh;
    begin_set(edit, OBJECT_MESH, &mesh->base, message->mesh, message->name);
    mesh->value = message->value;
    for (uint32_t i = 0; i < MESH_ARRAY_COUNT; i++) {
        if (!take_blob(source, message->arrays, message->arrays_count, i, "set_mesh", message->mesh,
                       &mesh->arrays[i], error))
            return false;
    }
    return keep_ranges(&mesh->ranges, &mesh->range_count, message->ranges, message->ranges_count, error) &&
           keep_weights(&mesh->weights, &mesh->weight_count, message->weights, message->weights_count, error);
}

static bool from_spheres(const struct edit_source *source, const struct message_set_spheres *message,
                         struct scene_edit *edit, struct error *error)
{
    struct scene_spheres *spheres = &edit->set.spheres;
    begin_set(edit, OBJECT_SPHERES, &spheres->base, message->spheres, message->name);
    spheres->value = message->value;
    return take_blob(source, message->arrays, message->arrays_count, 0, "set_spheres", message->spheres,
                     &spheres->centres_radii, error) &&
           keep_ranges(&spheres->ranges, &spheres->range_count, message->ranges, message->ranges_count, error);
}

static void from_disc(const struct message_set_disc *message, struct scene_edit *edit)
{
    struct scene_disc *disc = &edit->set.disc;
    begin_set(edit, OBJECT_DISC, &disc->base, message->disc, message->name);
    disc->value = message->value;
}

static void from_material(const struct message_set_material *message, struct scene_edit *edit)
{
    struct scene_material *material = &edit->set.material;
    begin_set(edit, OBJECT_MATERIAL, &material->base, message->material, message->name);
    material->value = message->value;
    for (uint32_t i = 0; i < message->textures_count && i < MATERIAL_TEXTURE_COUNT; i++)
        material->textures[i] = message->textures[i];
}

static bool check_texels(const struct edit_source *source, const char *field, const char *what, uint32_t width,
                         uint32_t height, struct error *error)
{
    const uint32_t limit = source->texture_edge_texels;
    if (width <= limit && height <= limit)
        return true;
    error_set(error, ERROR_LIMIT, field, "%s has %u x %u texels, the limit is %u a side", what, width, height,
              limit);
    return error_remedy(error, "make it smaller, or raise limits.texture_edge in the daemon's configuration");
}

static bool from_texture(const struct edit_source *source, const struct message_set_texture *message,
                         struct scene_edit *edit, struct error *error)
{
    struct scene_texture *texture = &edit->set.texture;
    char what[32];
    begin_set(edit, OBJECT_TEXTURE, &texture->base, message->texture, message->name);
    snprintf(what, sizeof(what), "texture %u", message->texture);
    texture->value = message->value;
    return check_texels(source, "set_texture", what, texture->value.width, texture->value.height, error) &&
           take_blob(source, message->arrays, message->arrays_count, 0, "set_texture", message->texture,
                     &texture->texels, error);
}

static void from_light(const struct message_set_light *message, struct scene_edit *edit)
{
    struct scene_light *light = &edit->set.light;
    begin_set(edit, OBJECT_LIGHT, &light->base, message->light, message->name);
    light->value = message->value;
}

static void from_camera(const struct message_set_camera *message, struct scene_edit *edit)
{
    struct scene_camera *camera = &edit->set.camera;
    begin_set(edit, OBJECT_CAMERA, &camera->base, message->camera, message->name);
    camera->value = message->value;
}

static bool from_environment(const struct edit_source *source, const struct message_set_environment *message,
                             struct scene_edit *edit, struct error *error)
{
    struct scene_environment *environment = &edit->set.environment;
    edit->kind = EDIT_SET_ENVIRONMENT;
    environment->value = message->value;
    if (environment->value.keeps_image) {
        environment->value.width = environment->value.height = 0;
        return true;
    }
    return check_texels(source, "set_environment", "the image", environment->value.width,
                        environment->value.height, error) &&
           take_blob(source, message->arrays, message->arrays_count, 0, "set_environment", 0, &environment->texels,
                     error);
}

static bool from_skin(const struct edit_source *source, const struct message_set_skin *message,
                      struct scene_edit *edit, struct error *error)
{
    struct scene_skin *skin = &edit->set.skin;
    begin_set(edit, OBJECT_SKIN, &skin->base, message->skin, message->name);
    skin->value = message->value;
    return take_blob(source, message->arrays, message->arrays_count, 0, "set_skin", message->skin, &skin->joints,
                     error) &&
           take_blob(source, message->arrays, message->arrays_count, 1, "set_skin", message->skin,
                     &skin->joint_from_mesh, error);
}

static bool from_clip(const struct edit_source *source, const struct message_set_clip *message,
                      struct scene_edit *edit, struct error *error)
{
    struct scene_clip *clip = &edit->set.clip;
    begin_set(edit, OBJECT_CLIP, &clip->base, message->clip, message->name);
    return take_blob(source, message->arrays, message->arrays_count, 0, "set_clip", message->clip, &clip->floats,
                     error);
}

static void from_channel(const struct message_set_channel *message, struct scene_edit *edit)
{
    struct scene_channel *channel = &edit->set.channel;
    begin_set(edit, OBJECT_CHANNEL, &channel->base, message->channel, "");
    channel->value = message->value;
}

bool edit_from_message(const struct edit_source *source, const struct message *message, struct scene_edit *edit,
                       struct error *error)
{
    memset(edit, 0, sizeof(*edit));
    switch (message->type) {
    case MESSAGE_SET_NODE:
        return from_node(&message->set_node, edit, error);
    case MESSAGE_SET_MESH:
        return from_mesh(source, &message->set_mesh, edit, error);
    case MESSAGE_SET_SPHERES:
        return from_spheres(source, &message->set_spheres, edit, error);
    case MESSAGE_SET_DISC:
        from_disc(&message->set_disc, edit);
        return true;
    case MESSAGE_SET_MATERIAL:
        from_material(&message->set_material, edit);
        return true;
    case MESSAGE_SET_TEXTURE:
        return from_texture(source, &message->set_texture, edit, error);
    case MESSAGE_SET_LIGHT:
        from_light(&message->set_light, edit);
        return true;
    case MESSAGE_SET_CAMERA:
        from_camera(&message->set_camera, edit);
        return true;
    case MESSAGE_SET_ENVIRONMENT:
        return from_environment(source, &message->set_environment, edit, error);
    case MESSAGE_SET_SKIN:
        return from_skin(source, &message->set_skin, edit, error);
    case MESSAGE_SET_CLIP:
        return from_clip(source, &message->set_clip, edit, error);
    case MESSAGE_SET_CHANNEL:
        from_channel(&message->set_channel, edit);
        return true;
    case MESSAGE_REMOVE:
        edit->kind = EDIT_REMOVE;
        edit->object = (enum object_kind)message->remove.kind;
        edit->id = message->remove.object;
        return true;
    default:
        return error_set(error, ERROR_PROTOCOL, NULL, "%s is no edit", message_type_text(message->type));
    }
}
