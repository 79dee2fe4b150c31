/* SPDX-License-Identifier: MIT */
/* Builds of a layered depth cube: their beginning, their units, and passes that both ways of building share. */
#include "trace/ldc/build.h"

#include "ldc/layout.h"
#include "shared/bindings.h"
#include "trace/ldc/build_state.h"

#include <epoxy/gl.h>
#include <stdlib.h>

struct ldc_builder *ldc_builder_create(struct gpu_device *device, struct error *error)
{
    struct ldc_builder *builder = calloc(1, sizeof(*builder));
    if (!builder) {
        error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for a builder of layered depth cubes");
        return NULL;
    }
    builder->device = device;
    axes_draw_init(&builder->draw, device);
    return builder;
}

#define BUFFER_COUNT 11

static void list_buffers(struct ldc_builder *builder, struct gpu_buffer *buffers[BUFFER_COUNT])
{
    struct gpu_buffer *all[BUFFER_COUNT] = {&builder->counts,     &builder->occupied,     &builder->ordered,
                                            &builder->places,     &builder->fragments,    &builder->found,
                                            &builder->build,      &builder->histogram,    &builder->peeled,
                                            &builder->draw.drawn, &builder->draw.commands};
    for (size_t i = 0; i < BUFFER_COUNT; i++)
        buffers[i] = all[i];
}

void ldc_builder_clear(struct ldc_builder *builder)
{
    struct gpu_device *device = builder->device;
    struct gpu_buffer *buffers[BUFFER_COUNT];
    list_buffers(builder, buffers);
    for (size_t i = 0; i < BUFFER_COUNT; i++)
        gpu_buffer_finish(device, buffers[i]);
    for (int i = 0; i < 2; i++) {
        gpu_framebuffer_finish(device, &builder->layer_framebuffers[i]);
        gpu_texture_finish(device, &builder->layers[i]);
    }
    gpu_texture_finish(device, &builder->layer_surface);
    gpu_texture_finish(device, &builder->depth);
    axes_draw_finish(&builder->draw);
    *builder = (struct ldc_builder){.device = device, .draw = builder->draw};
}

void ldc_builder_destroy(struct ldc_builder *builder)
{
    if (!builder)
        return;
    ldc_builder_clear(builder);
    free(builder);
}

uint64_t ldc_builder_bytes(const struct ldc_builder *builder)
{
    struct gpu_buffer *buffers[BUFFER_COUNT];
    uint64_t bytes = builder->layers[0].size_bytes + builder->layers[1].size_bytes +
                     builder->layer_surface.size_bytes + builder->depth.size_bytes;
    struct ldc_builder copy = *builder;
    list_buffers(&copy, buffers);
    for (size_t i = 0; i < BUFFER_COUNT; i++)
        bytes += buffers[i]->capacity_bytes;
    return bytes;
}

const struct gpu_program *ldc_use(struct gpu_device *device, const char *path, struct error *error)
{
    const struct gpu_program *program =
        gpu_program_get(device, &(struct gpu_program_source){.compute = path}, error);
    return program;
}

bool ldc_give_places(struct ldc_task *task, uint32_t kept, struct error *error)
{
    struct ldc_builder *builder = task->builder;
    struct gpu_device *device = builder->device;
    const size_t texel_numbers = (size_t)task->texel_count * sizeof(uint32_t);
    const struct gpu_program *program = ldc_use(device, "ldc/places.comp", error);
    if (!program || !gpu_buffer_reserve(device, &builder->places, texel_numbers, error) ||
        !gpu_buffer_reserve(device, &builder->occupied, texel_numbers, error))
        return false;
    gpu_buffer_clear(device, &builder->build, 0);
    gpu_buffer_bind_texels(device, &builder->counts, UNIT_LDC_COUNTS, GL_R32UI);
    gpu_buffer_bind_image(device, &builder->places, IMAGE_LDC_PLACES, GL_R32UI);
    gpu_buffer_bind_image(device, &builder->occupied, IMAGE_LDC_OCCUPIED, GL_R32UI);
    gpu_buffer_bind_storage(&builder->build, BIND_LDC_BUILD_COUNTS);
    gpu_uniform_uint(program, "texel_count", task->texel_count);
    gpu_uniform_uint(program, "texels_along", task->cube->resolution);
    gpu_uniform_uint(program, "slots", task->slots);
    gpu_uniform_uint(program, "fragments_kept", kept);
    gpu_dispatch(device, program, (task->texel_count + LDC_PLACES_TEXELS - 1) / LDC_PLACES_TEXELS);
    ldc_read_counts(task);
    return true;
}

void ldc_bind_runs(struct ldc_task *task, const struct gpu_program *program)
{
    struct ldc_builder *builder = task->builder;
    struct gpu_device *device = builder->device;
    gpu_buffer_bind_texels(device, &builder->counts, UNIT_LDC_COUNTS, GL_R32UI);
    gpu_buffer_bind_texels(device, &builder->places, UNIT_LDC_PLACES, GL_R32UI);
    gpu_buffer_bind_texels(device, &builder->occupied, UNIT_LDC_OCCUPIED, GL_R32UI);
    gpu_buffer_bind_image(device, &builder->ordered, IMAGE_LDC_ORDERED, GL_RG32UI);
    gpu_uniform_uint(program, "occupied_count", task->counts.occupied);
    gpu_uniform_uint(program, "texel_count", task->texel_count);
    gpu_uniform_uint(program, "texels_along", task->cube->resolution);
    gpu_uniform_uint(program, "slots", task->slots);
}

void ldc_read_counts(struct ldc_task *task)
{
    gpu_buffer_read(task->builder->device, &task->builder->build, 0, &task->counts, sizeof(task->counts));
}

/* Places a cube behind the cubes before it. */
static void place_cube(struct ldc_store *store, unsigned which)
{
    struct ldc_cube *cube = &store->cubes[which];
    cube->first_texel = cube->first_sample = cube->first_quad = 0;
    if (which > 0 && store->cubes[which - 1].resolution > 0) {
        const struct ldc_cube *before = &store->cubes[which - 1];
        cube->first_texel = before->first_texel + 3 * before->resolution * before->resolution;
        cube->first_sample = before->first_sample + before->sample_count;
        cube->first_quad = before->first_quad + before->quad_count;
    }
    cube->sample_count = cube->quad_count = 0;
    cube->layers_needed = cube->layers_kept = 0;
    cube->samples_lost = 0;
    for (unsigned behind = which + 1; behind < LDC_CUBES_MAX; behind++)
        store->cubes[behind].resolution = 0;
}

/* Begins with one pass, which is faster wherever it was measured (software GL: 8.5 times at 8 layers, 40 times
 * at 48); with peeling in the paper's form, or where the lists of one pass do not fit. */
static bool begin(struct ldc_task *task, struct error *error)
{
    struct ldc_builder *builder = task->builder;
    struct gpu_device *device = builder->device;
    size_t texel_numbers = (size_t)task->texel_count * sizeof(uint32_t);
    uint64_t texels = (uint64_t)task->cube->first_texel + task->texel_count;
    task->next = task->options->ldc.form == TRACER_FORM_PAPER ? ldc_peel : ldc_lists;
    if (texels > device->facts.texture_buffer_texels_max)
        return error_set(error, ERROR_LIMIT, "options.ldc_resolution",
                         "%llu texels are more than the device takes", (unsigned long long)texels);
    return ldc_store_grow(device, &task->store->texels, (uint64_t)task->cube->first_texel * LDC_TEXEL_BYTES,
                          texels * LDC_TEXEL_BYTES, error) &&
           gpu_buffer_reserve(device, &builder->counts, texel_numbers, error) &&
           gpu_buffer_reserve(device, &builder->build, sizeof(struct ldc_build_counts), error);
}

/* Progress after a unit. */
static enum tracer_progress progress_of(const struct ldc_task *task, bool good)
{
    if (good)
        return task->next ? TRACER_MORE : TRACER_DONE;
    task->cube->resolution = 0;
    task->cube->sample_count = task->cube->quad_count = 0;
    return TRACER_FAILED;
}

enum tracer_progress ldc_build_begin(struct ldc_builder *builder, struct ldc_store *store, unsigned which,
                                     struct gpu_scene *scene, const uint32_t *instances, uint32_t instance_count,
                                     const struct tracer_options *options, struct error *error)
{
    struct ldc_cube *cube = &store->cubes[which];
    uint32_t resolution = cube->resolution;
    place_cube(store, which);
    builder->task = (struct ldc_task){
        .builder = builder,
        .store = store,
        .cube = cube,
        .scene = scene,
        .options = options,
        .next = begin,
        .texel_count = 3 * resolution * resolution,
        .layers_max = options->limits.ldc_layers > 0 && options->limits.ldc_layers < LDC_LAYERS_MAX
                          ? options->limits.ldc_layers
                          : LDC_LAYERS_MAX,
    };
    return progress_of(&builder->task, axes_draw_prepare(&builder->draw, scene, instances, instance_count, error));
}

enum tracer_progress ldc_build_step(struct ldc_builder *builder, bool at_once, struct error *error)
{
    struct ldc_task *task = &builder->task;
    task->at_once = at_once;
    gpu_push_group(builder->device, "build a layered depth cube");
    bool good = task->next(task, error) && gpu_check(builder->device, "building a layered depth cube", error);
    gpu_pop_group(builder->device);
    return progress_of(task, good);
}
