/* SPDX-License-Identifier: MIT */
/* Packs textures with their mip chains into the single texel buffer of shared/material.h. */
#include "gpu_scene/state.h"

#include "base/parallel.h"
#include "shared/material.h"
#include "protocol/common/srgb.h"

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

uint32_t gpu_scene_texture_index(const struct gpu_scene *gpu, uint32_t texture_id, bool *found)
{
    const void *value = hashmap_get(&gpu->state->texture_index_by_id, texture_id);
    *found = value != NULL;
    return value ? (uint32_t)((uintptr_t)value - 1) : 0;
}

/* Tables for averaging sRGB as linear light: bytes are decoded to 16 bits, averaged, and encoded again. */
struct srgb_tables {
    uint16_t linear_from_byte[256];
    uint8_t byte_from_linear[65536];
    uint16_t plain[256]; /* for channels that are linear already */
};

static struct srgb_tables *create_tables(void)
{
    struct srgb_tables *tables = malloc(sizeof(*tables));
    if (!tables)
        return NULL;
    for (int i = 0; i < 256; i++) {
        tables->linear_from_byte[i] = (uint16_t)lrint(linear_from_srgb(i / 255.0) * 65535.0);
        tables->plain[i] = (uint16_t)(i * 257);
    }
    /* Byte b is the result from the point on where its value is nearer than its predecessor's, perceptually. */
    unsigned at = 0;
    for (int b = 0; b < 256; b++) {
        double edge = linear_from_srgb((b + 0.5) / 255.0);
        unsigned end = b == 255 ? 65536u : (unsigned)lrint(edge * 65535.0);
        while (at < end && at < 65536u)
            tables->byte_from_linear[at++] = (uint8_t)b;
    }
    return tables;
}

/* Stores the mean of `count` texels, from the sums of their channels in 16 bits. */
static void store_mean(const struct srgb_tables *tables, bool srgb, const uint32_t sum[4], uint32_t count,
                       uint8_t *out)
{
    for (int k = 0; k < 4; k++) {
        uint32_t mean = (sum[k] + count / 2) / count;
        out[k] = srgb && k < 3 ? tables->byte_from_linear[mean] : (uint8_t)((mean + 128) / 257);
    }
}

/* Halves a level that is even both ways, as most are: four texels each, without a loop over them. */
static void halve_even(const struct srgb_tables *tables, bool srgb, const uint8_t *in, uint32_t width,
                       uint32_t height, uint8_t *out)
{
    const uint16_t *colour = srgb ? tables->linear_from_byte : tables->plain;
    size_t row_bytes = (size_t)width * 4;
    for (uint32_t y = 0; y < height / 2; y++) {
        const uint8_t *upper = in + 2 * y * row_bytes, *lower = upper + row_bytes;
        for (uint32_t x = 0; x < width / 2; x++, upper += 8, lower += 8, out += 4) {
            uint32_t sum[4];
            for (int k = 0; k < 3; k++)
                sum[k] =
                    (uint32_t)colour[upper[k]] + colour[upper[k + 4]] + colour[lower[k]] + colour[lower[k + 4]];
            sum[3] = ((uint32_t)upper[3] + upper[7] + lower[3] + lower[7]) * 257;
            store_mean(tables, srgb, sum, 4, out);
        }
    }
}

/* Halves a level: a texel of the next one covers two of this one in each direction, three at the end of an odd
 * row. */
static void halve(const struct srgb_tables *tables, bool srgb, const uint8_t *in, uint32_t width, uint32_t height,
                  uint8_t *out)
{
    uint32_t out_width = width > 1 ? width / 2 : 1, out_height = height > 1 ? height / 2 : 1;
    const uint16_t *colour = srgb ? tables->linear_from_byte : tables->plain;
    if (width % 2 == 0 && height % 2 == 0) {
        halve_even(tables, srgb, in, width, height, out);
        return;
    }
    for (uint32_t y = 0; y < out_height; y++) {
        uint32_t y_end = y + 1 == out_height ? height : 2 * y + 2;
        for (uint32_t x = 0; x < out_width; x++, out += 4) {
            uint32_t x_end = x + 1 == out_width ? width : 2 * x + 2;
            uint32_t sum[4] = {0}, count = 0;
            for (uint32_t j = 2 * y; j < y_end; j++) {
                for (uint32_t i = 2 * x; i < x_end; i++, count++) {
                    const uint8_t *texel = in + ((size_t)j * width + i) * 4;
                    for (int k = 0; k < 3; k++)
                        sum[k] += colour[texel[k]];
                    sum[3] += tables->plain[texel[3]];
                }
            }
            store_mean(tables, srgb, sum, count, out);
        }
    }
}

static uint64_t chain_texels(uint32_t width, uint32_t height, uint32_t *levels)
{
    uint64_t texels = (uint64_t)width * height;
    *levels = 1;
    while (width > 1 || height > 1) {
        width = width > 1 ? width / 2 : 1;
        height = height > 1 ? height / 2 : 1;
        texels += (uint64_t)width * height;
        ++*levels;
    }
    return texels;
}

/* Packs all levels of a texture into `out`; each is made in `chain` first, since mapped memory is slow to read. */
static void pack_texture(const struct srgb_tables *tables, const struct scene_texture *texture, uint8_t *chain,
                         uint8_t *out)
{
    uint32_t width = texture->value.width, height = texture->value.height;
    const uint8_t *level = texture->texels->data;
    uint8_t *next = chain;
    memcpy(out, level, (size_t)width * height * 4);
    out += (size_t)width * height * 4;
    while (width > 1 || height > 1) {
        halve(tables, texture->value.format == TEXTURE_RGBA8_SRGB, level, width, height, next);
        width = width > 1 ? width / 2 : 1;
        height = height > 1 ? height / 2 : 1;
        size_t bytes = (size_t)width * height * 4;
        memcpy(out, next, bytes);
        out += bytes;
        level = next;
        next += bytes;
    }
}

/* Fills the table of textures and gives each its index. */
static bool lay_out(struct gpu_scene *gpu, const struct scene *scene, struct texture_info *infos,
                    uint64_t *texel_count, struct error *error)
{
    struct hashmap *indices = &gpu->state->texture_index_by_id;
    uint64_t id, max = gpu->device->facts.texture_buffer_texels_max;
    size_t cursor = 0;
    uint32_t index = 0;
    void *value;
    hashmap_finish(indices);
    hashmap_init(indices);
    *texel_count = 0;
    while (hashmap_next(&scene->objects[OBJECT_TEXTURE], &cursor, &id, &value)) {
        const struct scene_texture *texture = value;
        uint32_t levels;
        uint64_t texels = chain_texels(texture->value.width, texture->value.height, &levels);
        if (texels > max || *texel_count > max - texels)
            return error_set(error, ERROR_LIMIT, "scene",
                             "the textures have more than the %llu texels that this device's texel buffers hold",
                             (unsigned long long)max);
        infos[index] = (struct texture_info){
            .first_texel = (uint32_t)*texel_count,
            .width = texture->value.width,
            .height = texture->value.height,
            .flags = (texture->value.format == TEXTURE_RGBA8_SRGB ? TEXTURE_SRGB : 0) |
                     (texture->value.nearest ? TEXTURE_NEAREST : 0) |
                     (uint32_t)texture->value.wrap_u << TEXTURE_WRAP_U_SHIFT |
                     (uint32_t)texture->value.wrap_v << TEXTURE_WRAP_V_SHIFT | levels << TEXTURE_LEVELS_SHIFT,
        };
        *texel_count += texels;
        if (!hashmap_put(indices, id, (void *)((uintptr_t)index + 1)))
            return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for the indices of textures");
        index++;
    }
    return true;
}

/* Maximum of threads that pack textures: halving is arithmetic on the host. */
#define PACK_THREADS_MAX 8

struct texture_packing {
    struct texture_info *infos;
    const struct scene_texture **list; /* in the order of `infos` */
    uint32_t count;
    uint64_t texel_count;
    struct srgb_tables *tables;
    atomic_bool failed; /* there was no memory for halving */
};

struct texture_run {
    struct texture_packing *packing;
    uint8_t *out;
    const atomic_bool *stop;
};

static void pack_one(void *context, uint32_t i)
{
    const struct texture_run *run = context;
    struct texture_packing *packing = run->packing;
    const struct scene_texture *texture = packing->list[i];
    if (atomic_load(run->stop))
        return;
    uint32_t levels;
    uint64_t below = chain_texels(texture->value.width, texture->value.height, &levels) -
                     (uint64_t)texture->value.width * texture->value.height;
    uint8_t *chain = malloc((size_t)below * 4 + 1);
    if (chain)
        pack_texture(packing->tables, texture, chain, run->out + (size_t)packing->infos[i].first_texel * 4);
    else
        atomic_store(&packing->failed, true);
    free(chain);
}

static void write_texels(const struct gpu_scene *gpu, const struct packing_part *part, const atomic_bool *stop)
{
    struct texture_packing *packing = gpu->state->texture_packing;
    struct texture_run run = {.packing = packing, .out = part->out, .stop = stop};
    unsigned threads = parallel_processors();
    /* For a few texels one thread is enough. */
    if (packing->texel_count < (1u << 18))
        threads = 1;
    parallel_run(threads > PACK_THREADS_MAX ? PACK_THREADS_MAX : threads, packing->count, pack_one, &run);
}

void gpu_scene_drop_texture_packing(struct gpu_scene *gpu)
{
    struct texture_packing *packing = gpu->state->texture_packing;
    if (!packing)
        return;
    free(packing->infos);
    free(packing->list);
    free(packing->tables);
    free(packing);
    gpu->state->texture_packing = NULL;
}

static bool list_textures(struct gpu_scene *gpu, const struct scene *scene, struct texture_packing *packing,
                          struct error *error)
{
    size_t cursor = 0, count = scene->objects[OBJECT_TEXTURE].count;
    uint64_t id;
    void *value;
    packing->infos = calloc(count + 1, sizeof(*packing->infos));
    packing->list = calloc(count + 1, sizeof(*packing->list));
    packing->tables = create_tables();
    if (!packing->infos || !packing->list || !packing->tables)
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for %zu textures", count);
    while (hashmap_next(&scene->objects[OBJECT_TEXTURE], &cursor, &id, &value))
        packing->list[packing->count++] = value;
    return lay_out(gpu, scene, packing->infos, &packing->texel_count, error);
}

bool gpu_scene_list_textures(struct gpu_scene *gpu, const struct scene *scene, struct error *error)
{
    uint64_t signature = gpu_scene_signature(scene, OBJECT_TEXTURE);
    if (gpu->state->any_update && signature == gpu->state->textures_signature)
        return true;
    struct texture_packing *packing = gpu->state->texture_packing = calloc(1, sizeof(*packing));
    if (!packing)
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for textures");
    if (!list_textures(gpu, scene, packing, error))
        return false;
    gpu->state->textures_signature = signature;
    gpu->state->brought.bits |= CHANGED_SHADING | CHANGED_SURFACES;
    packing_add(&gpu->state->packing, &(struct packing_part){.buffer = &gpu->texels,
                                                             .bytes = (size_t)packing->texel_count * 4,
                                                             .write = write_texels});
    return true;
}

bool gpu_scene_finish_textures(struct gpu_scene *gpu, struct error *error)
{
    struct gpu_scene_state *state = gpu->state;
    struct texture_packing *packing = state->texture_packing;
    if (!packing)
        return true;
    const bool failed = atomic_load(&packing->failed);
    free(state->textures);
    state->textures = packing->infos;
    state->texture_count = packing->count;
    state->stale_tables = true;
    packing->infos = NULL;
    gpu_scene_drop_texture_packing(gpu);
    return !failed || error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory to halve textures in");
}
