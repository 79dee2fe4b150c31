/* SPDX-License-Identifier: MIT */
/* One function per edit message: its fields into a struct scene_edit. The decoder has checked each field; how
 * they fit together is for the scene to check when the transaction is applied. */
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

static bool take_ranges(struct material_range **ranges, uint32_t *range_count,
                        const struct record_material_range *from, uint32_t count, struct error *error)
{
    if (!count)
        return true;
    *ranges = malloc(count * sizeof(**ranges));
    if (!*ranges)
        return error_set(error, ERROR_OUT_OF_MEMORY, "ranges", "no memory");
    for (uint32_t i = 0; i < count; i++) {
        (*ranges)[i] =
            (struct material_range){.first = from[i].first, .count = from[i].count, .material = from[i].material};
    }
    *range_count = count;
    return true;
}

static bool take_weights(float **weights, uint32_t *weight_count, const struct record_morph_weight *from,
                         uint32_t count, struct error *error)
{
    if (!count)
        return true;
    *weights = malloc(count * sizeof(**weights));
    if (!*weights)
        return error_set(error, ERROR_OUT_OF_MEMORY, "weights", "no memory");
    for (uint32_t i = 0; i < count; i++)
        (*weights)[i] = from[i].weight;
    *weight_count = count;
    return true;
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
    node->parent = message->parent;
    node->kind = (enum node_kind)message->kind;
    node->object = message->object;
    node->hidden = message->hidden;
    memcpy(node->parent_from_node, message->parent_from_node, sizeof(node->parent_from_node));
    node->skin = message->skin;
    node->light_group = message->light_group;
    return take_weights(&node->weights, &node->weight_count, message->weights, message->weights_count, error);
}

static bool from_mesh(const struct edit_source *source, const struct message_set_mesh *message,
                      struct scene_edit *edit, struct error *error)
{
    struct scene_mesh *mesh = &edit->set.mesh;
    begin_set(edit, OBJECT_MESH, &mesh->base, message->mesh, message->name);
    mesh->vertex_count = message->vertex_count;
    mesh->triangle_count = message->triangle_count;
    mesh->influence_count = message->influence_count;
    mesh->target_count = message->target_count;
    mesh->closed = message->closed != 0;
    for (uint32_t i = 0; i < MESH_ARRAY_COUNT; i++) {
        if (!take_blob(source, message->arrays, message->arrays_count, i, "set_mesh", message->mesh,
                       &mesh->arrays[i], error))
            return false;
    }
    return take_ranges(&mesh->ranges, &mesh->range_count, message->ranges, message->ranges_count, error) &&
           take_weights(&mesh->weights, &mesh->weight_count, message->weights, message->weights_count, error);
}

static bool from_spheres(const struct edit_source *source, const struct message_set_spheres *message,
                         struct scene_edit *edit, struct error *error)
{
    struct scene_spheres *spheres = &edit->set.spheres;
    begin_set(edit, OBJECT_SPHERES, &spheres->base, message->spheres, message->name);
    spheres->sphere_count = message->sphere_count;
    return take_blob(source, message->arrays, message->arrays_count, 0, "set_spheres", message->spheres,
                     &spheres->centres_radii, error) &&
           take_ranges(&spheres->ranges, &spheres->range_count, message->ranges, message->ranges_count, error);
}

static void from_disc(const struct message_set_disc *message, struct scene_edit *edit)
{
    struct scene_disc *disc = &edit->set.disc;
    begin_set(edit, OBJECT_DISC, &disc->base, message->disc, message->name);
    disc->material = message->material;
    memcpy(disc->centre_world, message->centre_world, sizeof(disc->centre_world));
    memcpy(disc->normal_world, message->normal_world, sizeof(disc->normal_world));
    disc->radius = message->radius;
}

static void from_material(const struct message_set_material *message, struct scene_edit *edit)
{
    struct scene_material *material = &edit->set.material;
    begin_set(edit, OBJECT_MATERIAL, &material->base, message->material, message->name);
    material->alpha_mode = (enum alpha_mode)message->alpha_mode;
    material->double_sided = message->double_sided;
    material->unlit = message->unlit;
    memcpy(material->base_colour, message->base_colour, sizeof(material->base_colour));
    memcpy(material->emission, message->emission, sizeof(material->emission));
    material->metallic = message->metallic;
    material->roughness = message->roughness;
    material->transmission = message->transmission;
    material->ior = message->ior;
    material->alpha_cutoff = message->alpha_cutoff;
    material->anisotropy = message->anisotropy;
    material->anisotropy_rotation = message->anisotropy_rotation;
    material->emission_seen_only = message->emission_seen_only;
    material->specular = message->specular;
    material->specular_colour[0] = message->specular_red;
    material->specular_colour[1] = message->specular_green;
    material->specular_colour[2] = message->specular_blue;
    const float attenuation[3] = {message->attenuation_red, message->attenuation_green, message->attenuation_blue};
    memcpy(material->attenuation, attenuation, sizeof(attenuation));
    material->attenuation_distance = message->attenuation_distance;
    material->thickness = message->thickness;
    material->clearcoat = message->clearcoat;
    material->clearcoat_roughness = message->clearcoat_roughness;
    memcpy(material->sheen, message->sheen, sizeof(material->sheen));
    material->sheen_roughness = message->sheen_roughness;
    material->iridescence = message->iridescence;
    material->iridescence_ior = message->iridescence_ior;
    material->iridescence_minimum_nm = message->iridescence_minimum_nm;
    material->iridescence_maximum_nm = message->iridescence_maximum_nm;
    material->dispersion = message->dispersion;
    material->diffuse_transmission = message->diffuse_transmission;
    const float through[3] = {message->diffuse_transmission_red, message->diffuse_transmission_green,
                              message->diffuse_transmission_blue};
    memcpy(material->diffuse_transmission_colour, through, sizeof(through));
    material->thin_walled = message->thin_walled;
    for (uint32_t i = 0; i < message->textures_count && i < MATERIAL_TEXTURE_COUNT; i++) {
        const struct record_texture_use *from = &message->textures[i];
        struct texture_use *use = &material->textures[i];
        use->texture = from->texture;
        use->texcoord_set = from->texcoord_set;
        memcpy(use->uv_transform, from->uv_transform, sizeof(use->uv_transform));
        use->strength = from->strength;
    }
}

static const char texture_remedy[] = "make it smaller, or raise limits.texture_edge in the daemon's configuration";

static bool from_texture(const struct edit_source *source, const struct message_set_texture *message,
                         struct scene_edit *edit, struct error *error)
{
    struct scene_texture *texture = &edit->set.texture;
    begin_set(edit, OBJECT_TEXTURE, &texture->base, message->texture, message->name);
    uint32_t limit_texels = source->texture_edge_texels;
    if (message->width > limit_texels || message->height > limit_texels) {
        error_set(error, ERROR_LIMIT, "set_texture", "texture %u has %u x %u texels, the limit is %u a side",
                  message->texture, message->width, message->height, limit_texels);
        return error_remedy(error, texture_remedy);
    }
    texture->width = message->width;
    texture->height = message->height;
    texture->format = (enum texture_format)message->format;
    texture->wrap_u = (enum wrap)message->wrap_u;
    texture->wrap_v = (enum wrap)message->wrap_v;
    texture->nearest = message->nearest;
    return take_blob(source, message->arrays, message->arrays_count, 0, "set_texture", message->texture,
                     &texture->texels, error);
}

static void from_light(const struct message_set_light *message, struct scene_edit *edit)
{
    struct scene_light *light = &edit->set.light;
    begin_set(edit, OBJECT_LIGHT, &light->base, message->light, message->name);
    light->kind = (enum light_kind)message->kind;
    memcpy(light->colour, message->colour, sizeof(light->colour));
    light->range = message->range;
    light->inner_cone = message->inner_cone;
    light->outer_cone = message->outer_cone;
    memcpy(light->size, message->size, sizeof(light->size));
}

static void from_camera(const struct message_set_camera *message, struct scene_edit *edit)
{
    struct scene_camera *camera = &edit->set.camera;
    begin_set(edit, OBJECT_CAMERA, &camera->base, message->camera, message->name);
    camera->fov_y = message->fov_y;
    camera->height = message->height;
    camera->near = message->near;
}

static bool from_environment(const struct edit_source *source, const struct message_set_environment *message,
                             struct scene_edit *edit, struct error *error)
{
    struct scene_environment *environment = &edit->set.environment;
    edit->kind = EDIT_SET_ENVIRONMENT;
    memcpy(environment->colour, message->colour, sizeof(environment->colour));
    environment->rotation = message->rotation;
    environment->backdrop = message->backdrop != 0;
    environment->display_values = message->display_values != 0;
    environment->light_group = message->light_group;
    environment->keeps_image = message->keeps_image != 0;
    if (environment->keeps_image)
        return true;
    uint32_t limit_texels = source->texture_edge_texels;
    if (message->width > limit_texels || message->height > limit_texels) {
        error_set(error, ERROR_LIMIT, "set_environment", "%u x %u texels, the limit is %u a side", message->width,
                  message->height, limit_texels);
        return error_remedy(error, texture_remedy);
    }
    environment->width = message->width;
    environment->height = message->height;
    return take_blob(source, message->arrays, message->arrays_count, 0, "set_environment", 0, &environment->texels,
                     error);
}

static bool from_skin(const struct edit_source *source, const struct message_set_skin *message,
                      struct scene_edit *edit, struct error *error)
{
    struct scene_skin *skin = &edit->set.skin;
    begin_set(edit, OBJECT_SKIN, &skin->base, message->skin, message->name);
    skin->joint_count = message->joint_count;
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
    channel->clip = message->clip;
    channel->path = (enum channel_path)message->path;
    channel->object = message->object;
    channel->interpolation = (enum interpolation)message->interpolation;
    channel->width = message->width;
    channel->key_count = message->key_count;
    channel->first_time = message->first_time;
    channel->first_value = message->first_value;
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
