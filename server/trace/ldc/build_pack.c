/* SPDX-License-Identifier: MIT */
/* The last units of a build: sorted fragments become the samples and quads of a cube. */
#include "ldc/layout.h"
#include "shared/bindings.h"
#include "trace/ldc/build_state.h"

#include <epoxy/gl.h>
#include <string.h>

/* Reserves at most `samples` samples and `quads` quads. */
static bool reserve(struct ldc_task *task, uint32_t samples, uint32_t quads, struct error *error)
{
    struct gpu_device *device = task->builder->device;
    struct ldc_store *store = task->store;
    const struct ldc_cube *cube = task->cube;
    return ldc_store_grow(device, &store->quads, (uint64_t)cube->first_quad * LDC_QUAD_BYTES,
                          ((uint64_t)cube->first_quad + quads) * LDC_QUAD_BYTES, error) &&
           ldc_store_grow(device, &store->geometry, (uint64_t)cube->first_sample * LDC_GEOMETRY_BYTES,
                          ((uint64_t)cube->first_sample + samples) * LDC_GEOMETRY_BYTES, error) &&
           ldc_store_grow(device, &store->surface, (uint64_t)cube->first_sample * LDC_SURFACE_BYTES,
                          ((uint64_t)cube->first_sample + samples) * LDC_SURFACE_BYTES, error) &&
           ldc_store_grow(device, &store->primitives, (uint64_t)cube->first_sample * LDC_PRIMITIVE_BYTES,
                          ((uint64_t)cube->first_sample + samples) * LDC_PRIMITIVE_BYTES, error);
}

/* Makes all texels empty. */
static void clear_texels(struct ldc_task *task)
{
    static const float no_range[2] = {LDC_NO_DEPTH, -LDC_NO_DEPTH};
    uint32_t empty[4] = {0};
    memcpy(&empty[2], no_range, sizeof(no_range));
    gpu_buffer_fill(task->store->device, &task->store->texels, (size_t)task->cube->first_texel * LDC_TEXEL_BYTES,
                    (size_t)task->texel_count * LDC_TEXEL_BYTES, empty);
}

void ldc_sample_defines(const struct ldc_task *task, struct gpu_define defines[LDC_SAMPLE_DEFINES_MAX])
{
    size_t n = 0, cursor = 0;
    bool textures = false, bump = false;
    uint64_t id;
    for (void *value; hashmap_next(&task->scene->scene->objects[OBJECT_MATERIAL], &cursor, &id, &value);) {
        const struct scene_material *material = value;
        for (int i = 0; i < MATERIAL_TEXTURE_COUNT; i++)
            textures |= material->textures[i].texture != 0;
        bump |= material->textures[MATERIAL_BUMP].texture != 0;
    }
    if (textures)
        defines[n++] = (struct gpu_define){"HAS_TEXTURES", "1"};
    if (bump)
        defines[n++] = (struct gpu_define){"HAS_BUMP", "1"};
    if (task->scene->colours.size_bytes > 0)
        defines[n++] = (struct gpu_define){"HAS_COLOURS", "1"};
    if (task->scene->has_spheres)
        defines[n++] = (struct gpu_define){"HAS_SPHERES", "1"};
    defines[n] = (struct gpu_define){0};
}

static bool sample(struct ldc_task *task, struct error *error)
{
    struct gpu_device *device = task->builder->device;
    struct gpu_define defines[LDC_SAMPLE_DEFINES_MAX];
    ldc_sample_defines(task, defines);
    const struct gpu_program *program = gpu_program_get(
        device, &(struct gpu_program_source){.compute = "ldc/sample.comp", .defines = defines}, error);
    if (!program)
        return false;
    gpu_buffer_bind_texels(device, &task->builder->draw.drawn, UNIT_LDC_DRAWN, GL_RGBA32UI);
    gpu_buffer_bind_image(device, &task->store->geometry, IMAGE_LDC_GEOMETRY, GL_RG32UI);
    gpu_buffer_bind_image(device, &task->store->surface, IMAGE_LDC_SURFACE, GL_RGBA32UI);
    gpu_buffer_bind_image(device, &task->store->primitives, IMAGE_LDC_PRIMITIVES, GL_RG32UI);
    gpu_uniform_uint(program, "sample_count", task->counts.samples);
    gpu_uniform_uint(program, "first_sample", task->cube->first_sample);
    gpu_uniform_uint(program, "drawn_count", task->builder->draw.drawn_count);
    gpu_uniform_uint(program, "texels_along", task->cube->resolution);
    gpu_uniform_vec(program, "lower_world", 3, task->cube->lower_world);
    gpu_uniform_float(program, "cell_world", task->cube->cell_world);
    gpu_dispatch(device, program, task->counts.samples);
    return true;
}

/* Reads the counts back, and makes the surfaces of samples unless peeling has made them. */
static bool settle(struct ldc_task *task, struct error *error)
{
    struct ldc_cube *cube = task->cube;
    task->next = NULL;
    ldc_read_counts(task);
    if (!task->peeled && task->counts.samples > 0 && !sample(task, error))
        return false;
    cube->sample_count = task->counts.samples;
    cube->quad_count = task->counts.quads;
    cube->layers_needed = task->counts.layers_needed;
    cube->layers_kept = cube->layers_needed < task->layers_max ? cube->layers_needed : task->layers_max;
    cube->samples_lost = task->counts.samples_lost;
    return true;
}

static bool pack(struct ldc_task *task, struct error *error)
{
    task->next = settle;
    struct gpu_device *device = task->builder->device;
    struct ldc_builder *builder = task->builder;
    struct ldc_store *store = task->store;
    const struct gpu_define defines[] = {{task->peeled ? "PEELED" : NULL, "1"}, {0}};
    const struct gpu_program *program = gpu_program_get(
        device, &(struct gpu_program_source){.compute = "ldc/pack.comp", .defines = defines}, error);
    if (!program)
        return false;
    if (task->peeled) {
        gpu_buffer_bind_texels(device, &builder->found, UNIT_LDC_FOUND, GL_R32UI);
        gpu_buffer_bind_texels(device, &builder->peeled, UNIT_LDC_PEELED_SURFACE, GL_RGBA32UI);
        gpu_buffer_bind_image(device, &store->geometry, IMAGE_LDC_GEOMETRY, GL_RG32UI);
        gpu_buffer_bind_image(device, &store->primitives, IMAGE_LDC_PRIMITIVES, GL_RG32UI);
    }
    gpu_buffer_bind_image(device, &store->surface, IMAGE_LDC_SURFACE, GL_RGBA32UI);
    ldc_bind_runs(task, program);
    gpu_buffer_bind_image(device, &store->texels, IMAGE_LDC_TEXELS, GL_RGBA32UI);
    gpu_buffer_bind_image(device, &store->quads, IMAGE_LDC_QUADS, GL_RGBA32F);
    gpu_buffer_bind_storage(&builder->build, BIND_LDC_BUILD_COUNTS);
    gpu_uniform_uint(program, "first_texel", task->cube->first_texel);
    gpu_uniform_uint(program, "first_sample", task->cube->first_sample);
    gpu_uniform_uint(program, "first_quad", task->cube->first_quad);
    gpu_uniform_uint(program, "layers_max", task->layers_max);
    gpu_dispatch(device, program, (task->counts.occupied + LDC_PACK_TEXELS - 1) / LDC_PACK_TEXELS);
    return true;
}

bool ldc_pack(struct ldc_task *task, struct error *error)
{
    task->next = pack;
    clear_texels(task);
    return reserve(task, task->counts.samples_max, task->counts.quads_max, error);
}
