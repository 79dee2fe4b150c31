/* SPDX-License-Identifier: MIT */
/* Packs materials and their texture slots for shared/material.h. */
#include "gpu_scene/state.h"

#include "shared/material.h"

#include <stdlib.h>
#include <string.h>

/* A hashmap holds pointers and no NULL: an index is stored as itself plus one. */
static void *pointer_of(uint32_t index)
{
    return (void *)((uintptr_t)index + 1);
}

static uint32_t index_of(const void *pointer)
{
    return (uint32_t)((uintptr_t)pointer - 1);
}

uint32_t gpu_scene_material_index(const struct gpu_scene *gpu, uint32_t material_id)
{
    const void *found = material_id ? hashmap_get(&gpu->state->material_indices.index_by_id, material_id) : NULL;
    return found ? index_of(found) : 0;
}

static bool add_free(struct material_indices *indices, uint32_t index)
{
    if (indices->free_count == indices->free_capacity) {
        uint32_t capacity = indices->free_capacity ? indices->free_capacity * 2 : 64;
        uint32_t *larger = realloc(indices->free, capacity * sizeof(*larger));
        if (!larger)
            return false;
        indices->free = larger;
        indices->free_capacity = capacity;
    }
    indices->free[indices->free_count++] = index;
    return true;
}

/* Frees the indices of removed materials. */
static bool drop_stale(struct material_indices *indices, const struct scene *scene)
{
    size_t cursor = 0, count = 0;
    uint64_t id;
    void *value;
    uint64_t *stale = malloc((indices->index_by_id.count + 1) * sizeof(*stale));
    if (!stale)
        return false;
    while (hashmap_next(&indices->index_by_id, &cursor, &id, &value))
        if (!scene_material(scene, (uint32_t)id))
            stale[count++] = id;
    bool ok = true;
    for (size_t i = 0; ok && i < count; i++)
        ok = add_free(indices, index_of(hashmap_remove(&indices->index_by_id, stale[i])));
    free(stale);
    return ok;
}

bool gpu_scene_index_materials(struct gpu_scene *gpu, const struct scene *scene, struct error *error)
{
    struct material_indices *indices = &gpu->state->material_indices;
    size_t cursor = 0;
    uint64_t id;
    void *value;
    if (indices->count == 0)
        indices->count = 1; /* the default material */
    bool ok = drop_stale(indices, scene);
    while (ok && hashmap_next(&scene->objects[OBJECT_MATERIAL], &cursor, &id, &value)) {
        if (hashmap_get(&indices->index_by_id, id))
            continue;
        uint32_t index = indices->free_count ? indices->free[--indices->free_count] : indices->count++;
        ok = hashmap_put(&indices->index_by_id, id, pointer_of(index));
    }
    return ok || error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for the indices of materials");
}

static uint32_t add_slot(const struct gpu_scene *gpu, const struct record_texture_use *use,
                         struct texture_slot *slots, uint32_t *slot_count)
{
    bool found = false;
    uint32_t texture = use->texture ? gpu_scene_texture_index(gpu, use->texture, &found) : 0;
    if (!found)
        return 0;
    slots[*slot_count] = (struct texture_slot){
        .uv_matrix = {use->uv_transform[0], use->uv_transform[1], use->uv_transform[3], use->uv_transform[4]},
        .offset_u = use->uv_transform[2],
        .offset_v = use->uv_transform[5],
        .strength = use->strength,
        .texture = texture | (use->texcoord_set == 1 ? 0x80000000u : 0),
    };
    return (*slot_count)++;
}

/* Flags for tangents: the first texture that needs one decides. */
static uint32_t tangent_flags(const struct scene_material *material)
{
    static const enum material_texture turned[] = {MATERIAL_NORMAL, MATERIAL_BUMP, MATERIAL_CLEARCOAT_NORMAL,
                                                   MATERIAL_ANISOTROPY};
    for (size_t i = 0; i < sizeof(turned) / sizeof(*turned); i++) {
        const struct record_texture_use *use = &material->textures[turned[i]];
        if (use->texture)
            return MATERIAL_TANGENT | (use->texcoord_set == 1 ? MATERIAL_TANGENT_SECOND : 0);
    }
    return material->value.anisotropy != 0.0f ? MATERIAL_TANGENT : 0;
}

static void pack_material(const struct gpu_scene *gpu, const struct scene_material *in, struct material *out,
                          struct texture_slot *slots, uint32_t *slot_count)
{
    const struct record_material *value = &in->value;
    *out = (struct material){
        .emission_ior = {value->emission[0], value->emission[1], value->emission[2], value->ior},
        .metallic = value->metallic,
        .roughness = value->roughness,
        .transmission = value->transmission,
        .alpha_cutoff = value->alpha_cutoff,
        .anisotropy = value->anisotropy,
        .anisotropy_rotation = value->anisotropy_rotation,
        .specular = value->specular,
        .specular_red = value->specular_colour[0],
        .specular_green = value->specular_colour[1],
        .specular_blue = value->specular_colour[2],
        .clearcoat = value->clearcoat,
        .clearcoat_roughness = value->clearcoat_roughness,
        .dispersion = value->dispersion,
        .iridescence = value->iridescence,
        .iridescence_ior = value->iridescence_ior,
        .iridescence_minimum = value->iridescence_minimum_nm,
        .iridescence_maximum = value->iridescence_maximum_nm,
        .sheen_red = value->sheen[0],
        .sheen_green = value->sheen[1],
        .sheen_blue = value->sheen[2],
        .sheen_roughness = value->sheen_roughness,
        .diffuse_red = value->diffuse_transmission_colour[0],
        .diffuse_green = value->diffuse_transmission_colour[1],
        .diffuse_blue = value->diffuse_transmission_colour[2],
        .diffuse_transmission = value->diffuse_transmission,
        .id = in->base.id,
    };
    memcpy(out->base_colour, value->base_colour, sizeof(out->base_colour));
    float *const absorbs[3] = {&out->absorbs_red, &out->absorbs_green, &out->absorbs_blue};
    float *const body[3] = {&out->body_red, &out->body_green, &out->body_blue};
    for (int i = 0; i < 3; i++) {
        *absorbs[i] = scene_material_absorption(in, i);
        *body[i] = scene_material_body_tint(in, i);
    }
    out->flags = (value->alpha_mode == ALPHA_MASK ? MATERIAL_ALPHA_MASK : 0) |
                 (value->alpha_mode == ALPHA_BLEND ? MATERIAL_ALPHA_BLEND : 0) |
                 (value->double_sided ? MATERIAL_DOUBLE_SIDED : 0) | (value->unlit ? MATERIAL_UNLIT : 0) |
                 (value->emission_seen_only ? MATERIAL_EMISSION_SEEN_ONLY : 0) |
                 (value->thin_walled ? MATERIAL_THIN_WALLED : 0) | tangent_flags(in);
    uint32_t *const places[MATERIAL_TEXTURE_COUNT] = {
        [MATERIAL_BASE_COLOUR] = &out->texture_base_colour,
        [MATERIAL_NORMAL] = &out->texture_normal,
        [MATERIAL_METALLIC_ROUGHNESS] = &out->texture_metallic_roughness,
        [MATERIAL_OCCLUSION] = &out->texture_occlusion,
        [MATERIAL_EMISSION] = &out->texture_emission,
        [MATERIAL_TRANSMISSION] = &out->texture_transmission,
        [MATERIAL_BUMP] = &out->texture_bump,
        [MATERIAL_SPECULAR] = &out->texture_specular,
        [MATERIAL_SPECULAR_COLOUR] = &out->texture_specular_colour,
        [MATERIAL_CLEARCOAT] = &out->texture_clearcoat,
        [MATERIAL_CLEARCOAT_ROUGHNESS] = &out->texture_clearcoat_roughness,
        [MATERIAL_CLEARCOAT_NORMAL] = &out->texture_clearcoat_normal,
        [MATERIAL_SHEEN] = &out->texture_sheen,
        [MATERIAL_SHEEN_ROUGHNESS] = &out->texture_sheen_roughness,
        [MATERIAL_IRIDESCENCE] = &out->texture_iridescence,
        [MATERIAL_IRIDESCENCE_THICKNESS] = &out->texture_iridescence_thickness,
        [MATERIAL_DIFFUSE_TRANSMISSION] = &out->texture_diffuse_transmission,
        [MATERIAL_DIFFUSE_TRANSMISSION_COLOUR] = &out->texture_diffuse_transmission_colour,
        [MATERIAL_ANISOTROPY] = &out->texture_anisotropy,
    };
    for (int i = 0; i < MATERIAL_TEXTURE_COUNT; i++)
        *places[i] = add_slot(gpu, &in->textures[i], slots, slot_count);
}

static void pack_default(struct material *out)
{
    *out = (struct material){
        .base_colour = {1.0f, 1.0f, 1.0f, 1.0f},
        .emission_ior = {0.0f, 0.0f, 0.0f, 1.5f},
        .roughness = 1.0f,
        .specular = 1.0f,
        .specular_red = 1.0f,
        .specular_green = 1.0f,
        .specular_blue = 1.0f,
        .body_red = 1.0f,
        .body_green = 1.0f,
        .body_blue = 1.0f,
        .diffuse_red = 1.0f,
        .diffuse_green = 1.0f,
        .diffuse_blue = 1.0f,
        .flags = MATERIAL_DOUBLE_SIDED,
    };
}

static bool same_textures(const struct material *a, const struct material *b)
{
    return a->texture_base_colour == b->texture_base_colour && a->texture_normal == b->texture_normal &&
           a->texture_metallic_roughness == b->texture_metallic_roughness &&
           a->texture_occlusion == b->texture_occlusion && a->texture_emission == b->texture_emission &&
           a->texture_transmission == b->texture_transmission && a->texture_bump == b->texture_bump;
}

/* Whether two materials differ in their factors at most; where alpha cuts something out, factors matter too. */
static bool same_surface(const struct material *a, const struct material *b)
{
    if (((a->flags ^ b->flags) & (MATERIAL_ALPHA_MASK | MATERIAL_ALPHA_BLEND)) != 0 || !same_textures(a, b))
        return false;
    return (a->flags & MATERIAL_ALPHA_MASK) == 0 ||
           (a->base_colour[3] == b->base_colour[3] && a->alpha_cutoff == b->alpha_cutoff);
}

/* Whether the slots equal those of the last update. */
static bool same_slots(const struct gpu_scene_state *state, const struct texture_slot *slots, uint32_t slot_count)
{
    return state->texture_slots && state->texture_slot_count == slot_count &&
           memcmp(slots, state->texture_slots, slot_count * sizeof(*slots)) == 0;
}

/* Finds what differs from the last update. A new material does not count as a changed surface: no present
 * surface has it. */
static unsigned changes_of(const struct gpu_scene *gpu, const struct material *materials, uint32_t count,
                           const struct texture_slot *slots, uint32_t slot_count)
{
    const struct gpu_scene_state *state = gpu->state;
    if (!same_slots(state, slots, slot_count))
        return CHANGED_SHADING | CHANGED_SURFACES;
    for (uint32_t i = 0; i < count && i < gpu->material_count; i++)
        if (!same_surface(&materials[i], &state->materials[i]))
            return CHANGED_SHADING | CHANGED_SURFACES;
    return count == gpu->material_count && memcmp(materials, state->materials, count * sizeof(*materials)) == 0
               ? 0
               : CHANGED_SHADING;
}

bool gpu_scene_pack_materials(struct gpu_scene *gpu, const struct scene *scene, const struct scene_motion *motion,
                              struct scene_changes *changes, struct error *error)
{
    const struct scene_pose *pose = motion ? &motion->poses[0] : NULL;
    struct gpu_scene_state *state = gpu->state;
    uint32_t count = state->material_indices.count, slot_count = 1;
    size_t slot_max = 1 + scene->objects[OBJECT_MATERIAL].count * MATERIAL_TEXTURE_COUNT, cursor = 0;
    struct material *packed = calloc(count, sizeof(*packed));
    struct texture_slot *slots = calloc(slot_max, sizeof(*slots));
    uint64_t id;
    void *value;
    if (!packed || !slots) {
        free(packed);
        free(slots);
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for %u materials", count);
    }
    pack_default(&packed[0]);
    while (hashmap_next(&scene->objects[OBJECT_MATERIAL], &cursor, &id, &value))
        pack_material(gpu, scene_pose_material(pose, value), &packed[gpu_scene_material_index(gpu, (uint32_t)id)],
                      slots, &slot_count);
    unsigned bits = changes_of(gpu, packed, count, slots, slot_count);
    changes->bits |= bits;
    state->stale_tables |= bits != 0;
    free(state->materials);
    free(state->texture_slots);
    state->materials = packed;
    state->texture_slots = slots;
    state->texture_slot_count = slot_count;
    gpu->material_count = count;
    return true;
}
