/* SPDX-License-Identifier: MIT */
/* Small tables of a scene, in one buffer (shared/tables.h). */
#include "gpu_scene/state.h"

#include "shared/material.h"

#include <stdlib.h>
#include <string.h>

#define TEXEL_BYTES 16u

_Static_assert(sizeof(struct geometry) == GEOMETRY_TEXELS * TEXEL_BYTES, "geometry");
_Static_assert(sizeof(struct material) == MATERIAL_TEXELS * TEXEL_BYTES, "material");
_Static_assert(sizeof(struct texture_slot) == TEXTURE_SLOT_TEXELS * TEXEL_BYTES, "texture_slot");
_Static_assert(sizeof(struct texture_info) == TEXTURE_TEXELS * TEXEL_BYTES, "texture_info");
_Static_assert(sizeof(struct disc) == DISC_TEXELS * TEXEL_BYTES, "disc");
_Static_assert(sizeof(struct emitter_node) == EMITTER_NODE_TEXELS * TEXEL_BYTES, "emitter_node");
_Static_assert(sizeof(struct emitter_leaf) == EMITTER_LEAF_TEXELS * TEXEL_BYTES, "emitter_leaf");
_Static_assert(sizeof(struct emitter_run) == EMITTER_RUN_TEXELS * TEXEL_BYTES, "emitter_run");
_Static_assert(sizeof(struct table_starts) + sizeof(struct emitter_starts) == TABLES_HEAD_TEXELS * TEXEL_BYTES,
               "head");

static uint64_t node_count_of(const struct emitters *emitters)
{
    return emitters->leaf_count > 0 ? 2 * (uint64_t)emitters->leaf_count - 1 : 0;
}

/* Sets the starts; returns the texels of all tables. */
static uint64_t lay_out(const struct gpu_scene *gpu, struct table_starts *starts,
                        struct emitter_starts *emitter_starts)
{
    const struct gpu_scene_state *state = gpu->state;
    const struct emitters *emitters = &state->emitters;
    uint64_t materials = TABLES_HEAD_TEXELS + (uint64_t)gpu->geometry_count * GEOMETRY_TEXELS;
    uint64_t texture_slots = materials + (uint64_t)gpu->material_count * MATERIAL_TEXELS;
    uint64_t textures = texture_slots + (uint64_t)state->texture_slot_count * TEXTURE_SLOT_TEXELS;
    uint64_t discs = textures + (uint64_t)state->texture_count * TEXTURE_TEXELS;
    *starts =
        (struct table_starts){(uint32_t)materials, (uint32_t)texture_slots, (uint32_t)textures, (uint32_t)discs};
    uint64_t nodes = discs + (uint64_t)gpu->disc_count * DISC_TEXELS;
    uint64_t leaves = nodes + node_count_of(emitters) * EMITTER_NODE_TEXELS;
    uint64_t runs = leaves + (uint64_t)emitters->leaf_count * EMITTER_LEAF_TEXELS;
    uint64_t shares = runs + (uint64_t)emitters->run_count * EMITTER_RUN_TEXELS;
    *emitter_starts = (struct emitter_starts){.nodes = (uint32_t)nodes,
                                              .leaves = (uint32_t)leaves,
                                              .runs = (uint32_t)runs,
                                              .shares = (uint32_t)shares,
                                              .run_count = emitters->run_count,
                                              .cluster_size = emitters->cluster_size,
                                              .area = emitters->area};
    return shares + (emitters->share_count + 3) / 4;
}

/* Copies a table; `tables` may be NULL if there are no items. */
static void fill(char *tables, uint32_t first_texel, const void *items, size_t bytes)
{
    if (bytes > 0)
        memcpy(tables + (size_t)first_texel * TEXEL_BYTES, items, bytes);
}

static void pack_emitters(const struct emitters *emitters, const struct emitter_starts *starts, char *tables)
{
    memcpy(tables + sizeof(struct table_starts), starts, sizeof(*starts));
    fill(tables, starts->nodes, emitters->nodes, (size_t)node_count_of(emitters) * sizeof(struct emitter_node));
    fill(tables, starts->leaves, emitters->leaves, emitters->leaf_count * sizeof(struct emitter_leaf));
    fill(tables, starts->runs, emitters->runs, emitters->run_count * sizeof(struct emitter_run));
    fill(tables, starts->shares, emitters->shares, emitters->share_count * sizeof(float));
}

static void pack(const struct gpu_scene *gpu, const struct table_starts *starts, char *tables)
{
    const struct gpu_scene_state *state = gpu->state;
    struct geometry *geometries = (struct geometry *)(void *)(tables + TABLES_HEAD_TEXELS * TEXEL_BYTES);
    memcpy(tables, starts, sizeof(*starts));
    for (uint32_t i = 0; i < gpu->geometry_count; i++)
        geometries[i] = gpu->geometries[i].device;
    fill(tables, starts->materials, state->materials, gpu->material_count * sizeof(struct material));
    fill(tables, starts->texture_slots, state->texture_slots,
         state->texture_slot_count * sizeof(struct texture_slot));
    fill(tables, starts->textures, state->textures, state->texture_count * sizeof(struct texture_info));
    fill(tables, starts->discs, gpu->discs, gpu->disc_count * sizeof(struct disc));
}

/* Uploads from the first texel that differs from the mirror to the last; all of them if their number has
 * changed. */
static bool upload(struct gpu_scene *gpu, const char *now, size_t bytes, struct scene_changes *changes,
                   struct error *error)
{
    const char *before = gpu->state->tables;
    size_t first = 0, end = bytes;
    if (!before || gpu->tables.size_bytes != bytes) {
        changes->uploaded_bytes += bytes;
        return gpu_buffer_upload(gpu->device, &gpu->tables, now, bytes, error);
    }
    while (first < end && memcmp(now + first, before + first, TEXEL_BYTES) == 0)
        first += TEXEL_BYTES;
    while (end > first && memcmp(now + end - TEXEL_BYTES, before + end - TEXEL_BYTES, TEXEL_BYTES) == 0)
        end -= TEXEL_BYTES;
    if (first == end)
        return true;
    changes->uploaded_bytes += end - first;
    gpu_buffer_write(gpu->device, &gpu->tables, first, now + first, end - first);
    return true;
}

bool gpu_scene_upload_tables(struct gpu_scene *gpu, struct scene_changes *changes, struct error *error)
{
    struct gpu_scene_state *state = gpu->state;
    if (!state->stale_tables)
        return true;
    struct emitter_starts emitter_starts;
    uint64_t texels = lay_out(gpu, &gpu->table_starts, &emitter_starts);
    if (!gpu_scene_check_texels(gpu, texels, "texels of geometries, materials, textures and discs", error))
        return false;
    size_t bytes = (size_t)texels * TEXEL_BYTES;
    char *tables = calloc(1, bytes); /* zeroed, as the last texel of the shares may be partly unused */
    if (!tables)
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for the tables of a scene");
    pack(gpu, &gpu->table_starts, tables);
    pack_emitters(&state->emitters, &emitter_starts, tables);
    bool ok = upload(gpu, tables, bytes, changes, error);
    free(state->tables);
    state->tables = tables;
    state->stale_tables = !ok;
    return ok;
}
