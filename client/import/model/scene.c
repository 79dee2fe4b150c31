/* SPDX-License-Identifier: MIT */
/* The scene under construction: edits, notes and blobs. */
#include "scene.h"
#include "edits.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "protocol/describe.h"
#include "protocol/plain_text.h"

#define FIELDS_MAX 64 /* fields of an object's message */

/* ---- text ---- */

/* Copies as many whole characters as fit; bytes that are not UTF-8 and control characters become '?'. */
void import_copy_text(char *out, size_t out_bytes, const char *text)
{
    size_t used = 0;

    for (const char *at = text ? text : ""; *at;) {
        uint32_t code = 0;
        size_t length = utf8_read(at, UTF8_BYTES_MAX, &code);
        bool bad = length == 0 || code < 0x20 || code == 0x7f;

        if (length == 0)
            length = 1;
        if (used + length >= out_bytes)
            break;
        if (bad)
            out[used] = '?';
        else
            memcpy(out + used, at, length);
        used += length;
        at += length;
    }
    out[used] = '\0';
}

void import_prefix_name(const struct import_scene *scene, char out[IMPORT_NAME_MAX + 1], const char *name)
{
    const size_t length = name && name[0] != '\0' ? strlen(scene->prefix) : 0;

    memcpy(out, scene->prefix, length);
    import_copy_text(out + length, IMPORT_NAME_MAX + 1 - length, name);
}

static void format_text(char *out, size_t out_bytes, const char *format, va_list arguments)
{
    char text[1024];

    vsnprintf(text, sizeof(text), format, arguments);
    import_copy_text(out, out_bytes, text);
}

/* ---- the scene ---- */

void import_scene_init(struct import_scene *scene, const char *file)
{
    memset(scene, 0, sizeof(*scene));
    import_copy_text(scene->file, sizeof(scene->file), file);
}

static void edit_finish(struct import_edit *edit)
{
    switch (edit->message.type) {
    case MESSAGE_SET_NODE:
        free((char *)(uintptr_t)edit->message.set_node.name);
        free(edit->message.set_node.weights);
        break;
    case MESSAGE_SET_MESH:
        free((char *)(uintptr_t)edit->message.set_mesh.name);
        free(edit->message.set_mesh.ranges);
        free(edit->message.set_mesh.weights);
        break;
    case MESSAGE_SET_SPHERES:
        free((char *)(uintptr_t)edit->message.set_spheres.name);
        free(edit->message.set_spheres.ranges);
        break;
    case MESSAGE_SET_MATERIAL:
        free((char *)(uintptr_t)edit->message.set_material.name);
        free(edit->message.set_material.textures);
        break;
    case MESSAGE_SET_TEXTURE:
        free((char *)(uintptr_t)edit->message.set_texture.name);
        break;
    case MESSAGE_SET_LIGHT:
        free((char *)(uintptr_t)edit->message.set_light.name);
        break;
    case MESSAGE_SET_CAMERA:
        free((char *)(uintptr_t)edit->message.set_camera.name);
        break;
    case MESSAGE_SET_SKIN:
        free((char *)(uintptr_t)edit->message.set_skin.name);
        break;
    case MESSAGE_SET_CLIP:
        free((char *)(uintptr_t)edit->message.set_clip.name);
        break;
    default:
        break; /* owns nothing */
    }
}

void import_scene_finish(struct import_scene *scene)
{
    for (size_t i = 0; i < scene->edit_count; i++)
        edit_finish(&scene->edits[i]);
    for (size_t i = 0; i < scene->blob_count; i++)
        free(scene->blobs[i].bytes);
    free(scene->edits);
    free(scene->blobs);
    free(scene->clips);
    free(scene->variants);
    free(scene->bounds);
    memset(scene, 0, sizeof(*scene));
}

bool import_fail(struct import_scene *scene, const char *where, const char *format, ...)
{
    va_list arguments;

    if (scene->failed)
        return false;
    scene->failed = true;
    scene->failure.severity = PROTOCOL_SEVERITY_ERROR;
    scene->failure.count = 1;
    memcpy(scene->failure.file, scene->file, sizeof(scene->file));
    import_copy_text(scene->failure.where, sizeof(scene->failure.where), where);
    va_start(arguments, format);
    format_text(scene->failure.text, sizeof(scene->failure.text), format, arguments);
    va_end(arguments);
    return false;
}

void import_note(struct import_scene *scene, enum protocol_severity severity, const char *where,
                 const char *format, ...)
{
    struct import_notice note = {.severity = severity, .count = 1};
    va_list arguments;

    memcpy(note.file, scene->file, sizeof(note.file));
    import_copy_text(note.where, sizeof(note.where), where);
    va_start(arguments, format);
    format_text(note.text, sizeof(note.text), format, arguments);
    va_end(arguments);
    for (size_t i = 0; i < scene->note_count; i++) {
        if (strcmp(scene->notes[i].text, note.text) == 0 && strcmp(scene->notes[i].file, note.file) == 0) {
            scene->notes[i].count += scene->notes[i].count < UINT32_MAX;
            return;
        }
    }
    if (scene->note_count < IMPORT_NOTES_MAX)
        scene->notes[scene->note_count++] = note;
    else
        scene->notes_lost += scene->notes_lost < UINT32_MAX;
}

void *import_grow(struct import_scene *scene, void *array, size_t count, size_t *capacity, size_t element_bytes)
{
    size_t wanted = *capacity + *capacity / 2 + 16;
    void *grown;

    if (count < *capacity)
        return array;
    grown = wanted > SIZE_MAX / element_bytes ? NULL : realloc(array, wanted * element_bytes);
    if (!grown)
        import_fail(scene, NULL, "out of memory");
    else
        *capacity = wanted;
    return grown;
}

uint32_t import_add_blob(struct import_scene *scene, void *bytes, uint64_t size_bytes)
{
    struct import_blob *grown;

    if (!bytes)
        return 0;
    if (scene->failed || scene->blob_count >= UINT32_MAX - 1)
        goto release;
    if (size_bytes > IMPORT_BYTES_MAX - scene->blob_bytes) {
        import_fail(scene, NULL, "the scene would need more than %llu GiB",
                    (unsigned long long)(IMPORT_BYTES_MAX >> 30));
        goto release;
    }
    grown = import_grow(scene, scene->blobs, scene->blob_count, &scene->blob_capacity, sizeof(*scene->blobs));
    if (!grown)
        goto release;
    scene->blobs = grown;
    scene->blobs[scene->blob_count++] = (struct import_blob){.bytes = bytes, .size_bytes = size_bytes};
    scene->blob_bytes += size_bytes;
    return (uint32_t)scene->blob_count;
release:
    free(bytes);
    return 0;
}

struct import_edit *import_append(struct import_scene *scene, enum message_type type)
{
    struct import_edit *grown;

    if (scene->failed)
        return NULL;
    grown = import_grow(scene, scene->edits, scene->edit_count, &scene->edit_capacity, sizeof(*scene->edits));
    if (!grown)
        return NULL;
    scene->edits = grown;
    memset(&grown[scene->edit_count], 0, sizeof(*grown));
    grown[scene->edit_count].message.type = type;
    return &grown[scene->edit_count++];
}

char *import_copy_name(struct import_scene *scene, const char *name)
{
    char text[IMPORT_NAME_MAX + 1];
    char *copy;

    import_prefix_name(scene, text, name);
    copy = strdup(text);
    if (!copy)
        import_fail(scene, NULL, "out of memory");
    return copy;
}

struct record_morph_weight *import_copy_weights(struct import_scene *scene, const struct record_morph_weight *from,
                                                uint32_t count)
{
    struct record_morph_weight *copy;

    if (scene->failed || count == 0)
        return NULL;
    copy = malloc(count * sizeof(*copy));
    if (!copy) {
        import_fail(scene, NULL, "out of memory");
        return NULL;
    }
    memcpy(copy, from, count * sizeof(*copy));
    for (uint32_t i = 0; i < count; i++) {
        if (!(fabsf(copy[i].weight) <= 1e6f)) { /* NaN, too */
            import_fail(scene, NULL, "a weight of a morph target is not finite or beyond 1e6");
            break;
        }
    }
    return copy;
}

uint32_t import_next_id(struct import_scene *scene, enum protocol_object_kind kind)
{
    return ++scene->last_id[kind];
}

static bool within(const float *values, size_t count, float minimum, float maximum)
{
    for (size_t i = 0; i < count; i++)
        if (!(values[i] >= minimum && values[i] <= maximum)) /* NaN fails, too */
            return false;
    return true;
}

/* Checks the real numbers of a struct against the table of messages. */
static bool within_fields(const struct struct_desc *desc, const void *body)
{
    struct field_desc leaves[FIELDS_MAX];
    const size_t count = struct_leaves(desc, leaves, FIELDS_MAX);
    bool ok = true;
    for (const struct field_desc *field = leaves; field < leaves + count; field++)
        if (field->kind == FIELD_REAL)
            ok &= within((const float *)(const void *)((const char *)body + field->offset), field->count,
                         field->real_min, field->real_max);
    return ok;
}

/* ---- small objects ---- */

uint32_t import_add_node(struct import_scene *scene, const struct message_set_node *node)
{
    struct import_edit *edit;

    if (!within(node->value.parent_from_node, 12, -1e12f, 1e12f)) {
        import_fail(scene, node->name, "a node's transform is not finite or beyond 1e12");
        return 0;
    }
    edit = import_append(scene, MESSAGE_SET_NODE);
    if (!edit)
        return 0;
    edit->message.set_node = *node;
    if (node->value.parent == 0)
        edit->message.set_node.value.parent = scene->root;
    if (scene->is_added && node->value.kind == PROTOCOL_NODE_CAMERA) {
        edit->message.set_node.value.kind = PROTOCOL_NODE_GROUP;
        edit->message.set_node.value.object = 0;
    }
    edit->message.set_node.name = import_copy_name(scene, node->name);
    edit->message.set_node.weights = import_copy_weights(scene, node->weights, node->weights_count);
    return edit->message.set_node.node = import_next_id(scene, PROTOCOL_OBJECT_NODE);
}

uint32_t import_add_material(struct import_scene *scene, const struct message_set_material *material)
{
    struct import_edit *edit;
    struct record_texture_use *textures = NULL;
    uint32_t count = material->textures_count;

    if (!within_fields(message_describe(MESSAGE_SET_MATERIAL)->body(), material)) {
        import_fail(scene, material->name, "a material has a number that is not allowed");
        return 0;
    }
    for (uint32_t i = 0; i < count; i++) {
        if (!within(material->textures[i].uv_transform, 6, -1e9f, 1e9f) ||
            !within(&material->textures[i].strength, 1, -1e6f, 1e6f)) {
            import_fail(scene, material->name, "a material's texture has a number that is not allowed");
            return 0;
        }
    }
    while (count > 0 && material->textures[count - 1].texture == 0)
        count--;
    edit = import_append(scene, MESSAGE_SET_MATERIAL);
    if (!edit)
        return 0;
    if (count > 0) {
        textures = malloc(count * sizeof(*textures));
        if (!textures) {
            import_fail(scene, NULL, "out of memory");
            return 0;
        }
        memcpy(textures, material->textures, count * sizeof(*textures));
    }
    edit->message.set_material = *material;
    edit->message.set_material.textures = textures;
    edit->message.set_material.textures_count = count;
    edit->message.set_material.name = import_copy_name(scene, material->name);
    return edit->message.set_material.material = import_next_id(scene, PROTOCOL_OBJECT_MATERIAL);
}

uint32_t import_add_light(struct import_scene *scene, const struct message_set_light *light)
{
    struct import_edit *edit;

    if (!within(light->value.colour, 3, 0, 1e12f) || !within(&light->value.range, 1, 0, 1e12f) ||
        !within(&light->value.inner_cone, 1, 0, 1.5708f) ||
        !within(&light->value.outer_cone, 1, light->value.inner_cone, 1.5708f) ||
        !within(light->value.size, 2, 0, 1e12f)) {
        import_fail(scene, light->name, "a light has a number that is not allowed");
        return 0;
    }
    edit = import_append(scene, MESSAGE_SET_LIGHT);
    if (!edit)
        return 0;
    edit->message.set_light = *light;
    edit->message.set_light.name = import_copy_name(scene, light->name);
    return edit->message.set_light.light = import_next_id(scene, PROTOCOL_OBJECT_LIGHT);
}

uint32_t import_add_camera(struct import_scene *scene, const struct message_set_camera *camera)
{
    struct import_edit *edit;

    if (!within(&camera->value.fov_y, 1, 0, 3.1f) || !within(&camera->value.height, 1, 0, 1e12f) ||
        !within(&camera->value.near, 1, 0, 1e12f)) {
        import_fail(scene, camera->name, "a camera has a number that is not allowed");
        return 0;
    }
    if (scene->is_added)
        return import_next_id(scene, PROTOCOL_OBJECT_CAMERA);
    edit = import_append(scene, MESSAGE_SET_CAMERA);
    if (!edit)
        return 0;
    edit->message.set_camera = *camera;
    edit->message.set_camera.name = import_copy_name(scene, camera->name);
    return edit->message.set_camera.camera = import_next_id(scene, PROTOCOL_OBJECT_CAMERA);
}

uint32_t import_add_texture(struct import_scene *scene, const struct message_set_texture *texture, uint32_t texels)
{
    struct import_edit *edit;

    if (!scene->failed &&
        (texels == 0 || texels > scene->blob_count || texture->value.width == 0 || texture->value.height == 0 ||
         scene->blobs[texels - 1].size_bytes != 4ull * texture->value.width * texture->value.height)) {
        import_fail(scene, texture->name, "a texture's size does not fit its texels");
        return 0;
    }
    edit = import_append(scene, MESSAGE_SET_TEXTURE);
    if (!edit)
        return 0;
    edit->message.set_texture = *texture;
    edit->message.set_texture.name = import_copy_name(scene, texture->name);
    edit->message.set_texture.arrays_count = 1;
    edit->blobs[0] = texels;
    return edit->message.set_texture.texture = import_next_id(scene, PROTOCOL_OBJECT_TEXTURE);
}

void import_set_environment(struct import_scene *scene, const struct message_set_environment *environment,
                            uint32_t texels)
{
    struct import_edit *edit;

    if (!within(environment->value.colour, 3, 0, 1e9f) || !within(&environment->value.rotation, 1, -100, 100)) {
        import_fail(scene, NULL, "the background has a number that is not allowed");
        return;
    }
    if (scene->is_added)
        return;
    edit = import_append(scene, MESSAGE_SET_ENVIRONMENT);
    if (!edit)
        return;
    edit->message.set_environment = *environment;
    edit->message.set_environment.arrays_count = texels != 0;
    edit->blobs[0] = texels;
}

/* ---- defaults ---- */

void import_identity(float parent_from_node[12])
{
    for (int i = 0; i < 12; i++)
        parent_from_node[i] = i % 5 == 0 ? 1.0f : 0.0f; /* 0, 5 and 10: the diagonal of a 3x4 matrix */
}

void import_material_default(struct message_set_material *material)
{
    struct_defaults(message_describe(MESSAGE_SET_MATERIAL)->body(), material);
    material->value.roughness = 1;
    material->value.ior = 1.5f;
    material->value.alpha_cutoff = 0.5f;
    for (int i = 0; i < 4; i++)
        material->value.base_colour[i] = 1;
}

void import_texture_use_default(struct record_texture_use *use, uint32_t texture)
{
    *use = (struct record_texture_use){.texture = texture, .strength = 1};
    use->uv_transform[0] = use->uv_transform[4] = 1;
}
