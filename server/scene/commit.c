/* SPDX-License-Identifier: MIT */
/* Commits a transaction: everything that can fail is done on a draft, then the scene is changed in steps that
 * cannot. */
#include "scene/draft.h"

#include <stdlib.h>
#include <string.h>
#include <xxhash.h>

#define NODES_MAX_DEFAULT (4u << 20)
/* Limits of a transaction that takes about a millisecond: its edits, and the scene's objects. */
#define SHORT_EDITS 256
#define SHORT_OBJECTS 8192
#define SHORT_BYTES (UINT64_C(1) << 20)

/* ---- checks ------------------------------------------------------------------------------------- */

static bool shape_check(const struct scene_edit *edit, const struct edit_place *place)
{
    if (edit->kind == EDIT_SET_ENVIRONMENT)
        return environment_check_shape(&edit->set.environment, place);
    switch (edit->object) {
    case OBJECT_MESH:
        return mesh_check_shape(&edit->set.mesh, place);
    case OBJECT_SPHERES:
        return spheres_check_shape(&edit->set.spheres, place);
    case OBJECT_TEXTURE:
        return texture_check(&edit->set.texture, place);
    case OBJECT_LIGHT:
        return light_check(&edit->set.light, place);
    case OBJECT_CAMERA:
        return camera_check(&edit->set.camera, place);
    case OBJECT_DISC:
        return disc_check(&edit->set.disc, place);
    case OBJECT_NODE:
        return node_check(&edit->set.node, place);
    case OBJECT_SKIN:
        return skin_check_shape(&edit->set.skin, place);
    case OBJECT_CLIP:
        return clip_check_shape(&edit->set.clip, place);
    case OBJECT_CHANNEL:
        return channel_check(&edit->set.channel, place);
    case OBJECT_MATERIAL:
    case OBJECT_ENVIRONMENT:
    case OBJECT_COUNT:
        break;
    }
    return true;
}

static bool is_same_content(const struct scene_mesh *a, const struct scene_mesh *b)
{
    return memcmp(a->arrays, b->arrays, sizeof(a->arrays)) == 0 &&
           a->value.vertex_count == b->value.vertex_count && a->value.triangle_count == b->value.triangle_count &&
           a->value.influence_count == b->value.influence_count && a->value.target_count == b->value.target_count;
}

/* Checks a mesh's arrays; those that several meshes share are read once. */
static bool mesh_content_check(struct draft *draft, struct scene_mesh *mesh, const struct edit_place *place)
{
    const uint64_t key = XXH3_64bits(mesh->arrays, sizeof(mesh->arrays));
    const struct scene_mesh *checked = hashmap_get(&draft->checked_meshes, key);
    if (checked && is_same_content(checked, mesh)) {
        memcpy(mesh->lower, checked->lower, sizeof(mesh->lower));
        memcpy(mesh->upper, checked->upper, sizeof(mesh->upper));
        mesh->joint_places = checked->joint_places;
        return true;
    }
    if (!mesh_check_content(mesh, place))
        return false;
    hashmap_put(&draft->checked_meshes, key, mesh); /* without memory, the next mesh is read again */
    return true;
}

static bool content_check(struct draft *draft, struct scene_edit *edit, const struct edit_place *place)
{
    if (edit->kind == EDIT_SET_ENVIRONMENT) /* the image of the scene has been checked */
        return edit->set.environment.texels == draft->scene->environment.texels ||
               environment_check_content(&edit->set.environment, place);
    switch (edit->object) {
    case OBJECT_MESH:
        return mesh_content_check(draft, &edit->set.mesh, place);
    case OBJECT_SPHERES:
        return spheres_check_content(&edit->set.spheres, place);
    case OBJECT_SKIN:
        return skin_check_content(&edit->set.skin, place);
    case OBJECT_CLIP:
        return clip_check_content(&edit->set.clip, place);
    case OBJECT_NODE:
    case OBJECT_MATERIAL:
    case OBJECT_TEXTURE:
    case OBJECT_LIGHT:
    case OBJECT_CAMERA:
    case OBJECT_DISC:
    case OBJECT_CHANNEL:
    case OBJECT_ENVIRONMENT:
    case OBJECT_COUNT:
        break;
    }
    return true;
}

/* Keeps the present image: the previous edit's, if there is one. */
static void keep_image(const struct draft *draft, struct scene_environment *environment)
{
    const struct scene_environment *before =
        draft->last_environment ? &draft->last_environment->set.environment : &draft->scene->environment;
    struct blob *texels = blob_ref(before->texels);
    blob_unref(environment->texels);
    environment->texels = texels;
    environment->value.width = before->value.width;
    environment->value.height = before->value.height;
}

/* Makes an edit the last one of its object. */
static bool take_edit(struct draft *draft, struct scene_edit *edit)
{
    struct edit_place place = draft_place(draft, edit);
    if (edit->kind == EDIT_SET_ENVIRONMENT) {
        if (edit->set.environment.value.keeps_image)
            keep_image(draft, &edit->set.environment);
        draft->last_environment = edit;
        return true;
    }
    if ((unsigned)edit->object >= OBJECT_COUNT)
        return edit_error(&place, ERROR_INVALID, ".kind", "%u is no kind of object", (unsigned)edit->object);
    uint32_t id = edit_object_id(edit);
    if (!id)
        return edit_error(&place, ERROR_INVALID, "", "0 is no identifier: it means none");
    if (edit->kind == EDIT_REMOVE && !draft_find(draft, edit->object, id))
        return edit_error(&place, ERROR_UNKNOWN_ID, "", "cannot remove %s %u: it does not exist",
                          object_kind_name(edit->object), id);
    return hashmap_put(&draft->last[edit->object], id, edit) ||
           error_set(draft->error, ERROR_OUT_OF_MEMORY, "edits", "no memory for a table of %zu edits",
                     draft->edit_count);
}

static bool take_edits(struct draft *draft)
{
    bool sound = true;
    for (size_t i = 0; sound && i < draft->edit_count; i++)
        sound = !draft_is_abandoned(draft) && take_edit(draft, &draft->edits[i]);
    return sound;
}

static bool shapes_check(const struct draft *draft)
{
    bool sound = true;
    for (size_t i = 0; sound && i < draft->edit_count; i++) {
        const struct scene_edit *edit = &draft->edits[i];
        struct edit_place place = draft_place(draft, edit);
        sound = !draft_is_abandoned(draft) &&
                (edit->kind == EDIT_REMOVE || !draft_counts(draft, edit) || shape_check(edit, &place));
    }
    return sound;
}

static bool contents_check(struct draft *draft)
{
    bool sound = true;
    for (size_t i = 0; sound && i < draft->edit_count; i++) {
        struct scene_edit *edit = &draft->edits[i];
        struct edit_place place = draft_place(draft, edit);
        sound = !draft_is_abandoned(draft) &&
                (edit->kind == EDIT_REMOVE || !draft_counts(draft, edit) || content_check(draft, edit, &place));
    }
    return sound;
}

struct size {
    uint64_t host_bytes, table_bytes, nodes;
};

static void add_object(struct size *size, enum object_kind kind, const void *object)
{
    size->host_bytes += object_bytes(kind, object);
    size->table_bytes += object_table_bytes(kind, object);
    size->nodes += kind == OBJECT_NODE;
}

static void take_object(struct size *size, enum object_kind kind, const void *object)
{
    size->host_bytes -= object_bytes(kind, object);
    size->table_bytes -= object_table_bytes(kind, object);
    size->nodes -= kind == OBJECT_NODE;
}

/* Size of the scene after the transaction. */
static struct size draft_size(const struct draft *draft)
{
    const struct scene *scene = draft->scene;
    struct size size = {scene->host_bytes, scene->table_bytes, scene->objects[OBJECT_NODE].count};
    for (int k = 0; k < OBJECT_COUNT; k++) {
        enum object_kind kind = (enum object_kind)k;
        size_t cursor = 0;
        uint64_t id;
        void *value;
        while (hashmap_next(&draft->last[kind], &cursor, &id, &value)) {
            const struct scene_edit *edit = value;
            const void *now = hashmap_get(&scene->objects[kind], id);
            if (edit->kind == EDIT_SET)
                add_object(&size, kind, &edit->set);
            if (now)
                take_object(&size, kind, now);
        }
    }
    for (int k = 0; k < OBJECT_COUNT; k++) {
        for (size_t i = 0; i < draft->fallen[k].count; i++)
            take_object(&size, (enum object_kind)k, hashmap_get(&scene->objects[k], draft->fallen[k].ids[i]));
    }
    if (draft->last_environment)
        size.host_bytes +=
            environment_bytes(&draft->last_environment->set.environment) - environment_bytes(&scene->environment);
    return size;
}

/* Checks the limits of host memory and nodes after the transaction. A transaction that makes the scene smaller
 * is always allowed. */
static bool limits_check(const struct draft *draft, const struct size *size)
{
    const struct scene *scene = draft->scene;
    const struct scene_limits *limits = &scene->limits;
    uint64_t nodes_max = limits->nodes ? limits->nodes : NODES_MAX_DEFAULT;
    if (size->nodes > nodes_max && size->nodes > scene->objects[OBJECT_NODE].count) {
        error_set(draft->error, ERROR_LIMIT, "edits", "the scene would have %llu nodes; %llu are allowed",
                  (unsigned long long)size->nodes, (unsigned long long)nodes_max);
        return error_remedy(draft->error, "remove nodes, or raise limits.nodes in the daemon's configuration");
    }
    if (limits->host_bytes && size->host_bytes > limits->host_bytes && size->host_bytes > scene->host_bytes) {
        error_set(draft->error, ERROR_LIMIT, "edits",
                  "the scene would take %.1f MiB of the host's memory; %.1f MiB are allowed",
                  (double)size->host_bytes / 0x1p20, (double)limits->host_bytes / 0x1p20);
        return error_remedy(draft->error, "remove objects, or raise memory.scene in the daemon's configuration");
    }
    if (limits->table_bytes && size->table_bytes > limits->table_bytes && size->table_bytes > scene->table_bytes) {
        error_set(draft->error, ERROR_LIMIT, "edits",
                  "the scene's tables would take %.1f MiB of the host's memory; other scenes leave %.1f MiB",
                  (double)size->table_bytes / 0x1p20, (double)limits->table_bytes / 0x1p20);
        if (draft->error)
            draft->error->retryable = true; /* others may end meanwhile */
        return error_remedy(draft->error, "remove objects, close scenes, or raise memory.scene in the daemon's "
                                          "configuration");
    }
    return true;
}

/* ---- application -------------------------------------------------------------------------------- */

/* Adds an empty object of revision 0 for each that does not exist yet. */
static bool add_missing_objects(struct draft *draft)
{
    for (size_t i = 0; i < draft->edit_count; i++) {
        const struct scene_edit *edit = &draft->edits[i];
        if (edit->kind != EDIT_SET || !draft_counts(draft, edit))
            continue;
        struct hashmap *map = &draft->scene->objects[edit->object];
        uint32_t id = edit_object_id(edit);
        if (hashmap_get(map, id))
            continue;
        struct scene_object *object = calloc(1, object_struct_bytes(edit->object));
        if (!object || !hashmap_put(map, id, object)) {
            free(object);
            return error_set(draft->error, ERROR_OUT_OF_MEMORY, "edits", "no memory for %s %u",
                             object_kind_name(edit->object), id);
        }
    }
    return true;
}

static void give_room_back(struct draft *draft)
{
    for (size_t i = 0; i < draft->edit_count; i++) {
        const struct scene_edit *edit = &draft->edits[i];
        if (edit->kind != EDIT_SET || !draft_counts(draft, edit))
            continue;
        struct hashmap *map = &draft->scene->objects[edit->object];
        struct scene_object *object = hashmap_get(map, edit_object_id(edit));
        if (object && !object->revision)
            free(hashmap_remove(map, edit_object_id(edit)));
    }
}

/* Notes that a node of that kind appears, moves or is removed. If it has children, everything counts as moved.
 * Any node may be the joint of a skin, which moves meshes. */
static void touch_node(struct scene *scene, const struct scene_node *node)
{
    bool alone = node->child_count == 0;
    if (!alone || scene->objects[OBJECT_SKIN].count || node->value.kind == NODE_MESH ||
        node->value.kind == NODE_SPHERES)
        scene->instances_revision = scene->revision;
    if (!alone || node->value.kind == NODE_LIGHT)
        scene->lights_revision = scene->revision;
}

static void touch_kind(struct scene *scene, enum object_kind kind)
{
    if (kind == OBJECT_MESH || kind == OBJECT_SPHERES || kind == OBJECT_DISC)
        scene->geometry_revision = scene->revision;
    else if (kind == OBJECT_MATERIAL || kind == OBJECT_TEXTURE)
        scene->shading_revision = scene->revision;
    else if (kind == OBJECT_LIGHT)
        scene->lights_revision = scene->revision;
    else if (kind == OBJECT_SKIN)
        scene->instances_revision = scene->revision;
}

/* Notes that nodes with this mesh may begin or cease to deform. */
static void touch_mesh(struct scene *scene, const struct scene_mesh *mesh)
{
    if (mesh->value.influence_count || mesh->value.target_count)
        scene->instances_revision = scene->revision;
}

static void count_child(struct scene *scene, uint32_t parent, int change)
{
    struct scene_node *node = parent ? hashmap_get(&scene->objects[OBJECT_NODE], parent) : NULL;
    if (node)
        node->child_count += (uint32_t)change;
}

static void apply_set(struct scene *scene, struct scene_edit *edit)
{
    struct scene_object *object = hashmap_get(&scene->objects[edit->object], edit_object_id(edit));
    if (edit->object == OBJECT_NODE) {
        struct scene_node *node = (struct scene_node *)object, *next = &edit->set.node;
        next->child_count = node->child_count;
        if (object->revision) {
            count_child(scene, node->value.parent, -1);
            touch_node(scene, node);
        }
        count_child(scene, next->value.parent, +1);
        touch_node(scene, next);
    }
    if (edit->object == OBJECT_MESH) {
        touch_mesh(scene, (const struct scene_mesh *)object);
        touch_mesh(scene, &edit->set.mesh);
    }
    object_release(edit->object, object);
    memcpy(object, &edit->set, object_struct_bytes(edit->object));
    object->revision = scene->revision;
    touch_kind(scene, edit->object);
    /* The scene owns the blobs and ranges from here on. */
    memset(&edit->set, 0, sizeof(edit->set));
}

static void apply_remove(struct scene *scene, enum object_kind kind, uint32_t id)
{
    struct scene_object *object = hashmap_remove(&scene->objects[kind], id);
    if (!object)
        return; /* made and removed by this transaction */
    if (kind == OBJECT_NODE) {
        const struct scene_node *node = (const struct scene_node *)object;
        touch_node(scene, node);
        count_child(scene, node->value.parent, -1);
    }
    touch_kind(scene, kind);
    object_release(kind, object);
    free(object);
}

static void apply(struct draft *draft, const struct size *size)
{
    struct scene *scene = draft->scene;
    scene->revision++;
    scene->host_bytes = size->host_bytes;
    scene->table_bytes = size->table_bytes;
    for (size_t i = 0; i < draft->edit_count; i++) {
        struct scene_edit *edit = &draft->edits[i];
        if (!draft_counts(draft, edit))
            continue;
        if (edit->kind == EDIT_SET) {
            apply_set(scene, edit);
        } else if (edit->kind == EDIT_REMOVE) {
            apply_remove(scene, edit->object, edit->id);
        } else {
            blob_unref(scene->environment.texels);
            scene->environment = edit->set.environment;
            scene->environment.value.keeps_image = false;
            scene->environment.revision = scene->lights_revision = scene->revision;
            memset(&edit->set, 0, sizeof(edit->set));
        }
    }
    for (int k = 0; k < OBJECT_COUNT; k++) {
        for (size_t i = 0; i < draft->fallen[k].count; i++)
            apply_remove(scene, (enum object_kind)k, draft->fallen[k].ids[i]);
    }
}

/* Checks the transaction. Edits that others replace are skipped, and large data is checked only after the
 * limits. */
static bool is_sound(struct draft *draft, struct size *size)
{
    if (!take_edits(draft) || !shapes_check(draft) || !structure_check(draft) || !dependents_check(draft))
        return false;
    *size = draft_size(draft);
    return limits_check(draft, size) && contents_check(draft) && references_check(draft) && links_check(draft);
}

bool scene_commit_unless(struct scene *scene, struct scene_edit *edits, size_t edit_count,
                         const atomic_bool *abandoned, struct error *error)
{
    struct draft draft = {
        .scene = scene, .edits = edits, .edit_count = edit_count, .abandoned = abandoned, .error = error};
    struct size size = {0};
    bool sound = is_sound(&draft, &size);
    if (sound && !add_missing_objects(&draft)) {
        give_room_back(&draft);
        sound = false;
    }
    if (sound)
        apply(&draft, &size);
    draft_finish(&draft);
    return sound;
}

bool scene_commit(struct scene *scene, struct scene_edit *edits, size_t edit_count, struct error *error)
{
    return scene_commit_unless(scene, edits, edit_count, NULL, error);
}

bool scene_commit_is_short(const struct scene *scene, const struct scene_edit *edits, size_t edit_count)
{
    uint64_t bytes = 0;
    size_t objects = 0;
    for (int k = 0; k < OBJECT_COUNT; k++)
        objects += scene->objects[k].count;
    if (edit_count > SHORT_EDITS || objects > SHORT_OBJECTS)
        return false;
    for (size_t i = 0; i < edit_count; i++) {
        if (edits[i].kind == EDIT_SET)
            bytes += object_bytes(edits[i].object, &edits[i].set);
        else if (edits[i].kind == EDIT_SET_ENVIRONMENT)
            bytes += environment_bytes(&edits[i].set.environment);
    }
    return bytes <= SHORT_BYTES;
}

uint64_t scene_edits_table_bytes(const struct scene_edit *edits, size_t edit_count)
{
    uint64_t bytes = 0;
    for (size_t i = 0; i < edit_count; i++)
        bytes += edits[i].kind == EDIT_SET ? object_table_bytes(edits[i].object, &edits[i].set) : 0;
    return bytes;
}
