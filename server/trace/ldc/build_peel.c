/* SPDX-License-Identifier: MIT */
/* Depth peeling, as the paper has it (section 1.2): fragments are counted first, and the maximum in one texel is
 * the number of passes. Each pass draws the scene into all three images with both targets, rejects what is not
 * behind the layer before, and the depth test keeps the nearest of the rest. Everitt. Interactive
 * Order-Independent Transparency. 2001. */
#include "ldc/layout.h"
#include "shared/bindings.h"
#include "trace/ldc/build_state.h"

#include <epoxy/gl.h>
#include <math.h>
#include <string.h>

static bool reserve(struct ldc_task *task, struct error *error)
{
    struct ldc_builder *builder = task->builder;
    struct gpu_device *device = builder->device;
    uint32_t along = task->cube->resolution;
    if (!gpu_buffer_reserve(device, &builder->ordered, (size_t)task->counts.places * LDC_ORDERED_BYTES, error) ||
        !gpu_buffer_reserve(device, &builder->peeled, (size_t)task->counts.places * LDC_PEELED_BYTES, error) ||
        !gpu_buffer_reserve(device, &builder->found, (size_t)task->texel_count * sizeof(uint32_t), error))
        return false;
    if (builder->depth.name && builder->depth.width == along)
        return true;
    bool made =
        gpu_texture_reserve_array(device, &builder->depth, GL_DEPTH_COMPONENT32F, along, along, 3, error) &&
        gpu_texture_reserve_array(device, &builder->layer_surface, GL_RGBA32UI, along, along, 3, error);
    for (int i = 0; i < 2 && made; i++) {
        gpu_framebuffer_finish(device, &builder->layer_framebuffers[i]);
        made = gpu_texture_reserve_array(device, &builder->layers[i], GL_RGBA32UI, along, along, 3, error);
        const struct gpu_texture targets[] = {builder->layers[i], builder->layer_surface};
        made = made &&
               gpu_framebuffer_create(device, &builder->layer_framebuffers[i], targets, 2, &builder->depth, error);
    }
    if (!made)
        gpu_texture_finish(device, &builder->depth); /* the next build makes them again */
    return made;
}

/* The scale of depths is a power of two, so that depths in cells stay exact and below 1. */
static void set_peel(const void *context, const struct gpu_program *program)
{
    const struct ldc_task *task = context;
    int exponent;
    frexpf((float)task->cube->resolution, &exponent);
    gpu_uniform_float(program, "unit_per_cell", ldexpf(1.0f, -exponent - 1));
}

static ldc_unit note_layer;

static bool draw_layer(struct ldc_task *task, struct error *error)
{
    static const GLuint nothing[4] = {LDC_NO_DEPTH_BITS, 0, 0, 0};
    static const GLfloat farthest = 1.0f;
    struct ldc_builder *builder = task->builder;
    const unsigned into = task->layer & 1, framebuffer = builder->layer_framebuffers[into].name;
    glDepthMask(GL_TRUE);
    if (task->drawn == 0) {
        glClearNamedFramebufferuiv(framebuffer, GL_COLOR, 0, nothing);
        glClearNamedFramebufferfv(framebuffer, GL_DEPTH, 0, &farthest);
    }
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_LESS); /* at equal depths the first stays: instances are drawn in order */
    gpu_texture_bind(&builder->layers[!into], UNIT_LDC_LAYER);
    bool drawn = ldc_draw(task, LDC_PASS_PEEL, set_peel, note_layer, error);
    glDisable(GL_DEPTH_TEST);
    return drawn;
}

static bool note_layer(struct ldc_task *task, struct error *error)
{
    struct ldc_builder *builder = task->builder;
    struct gpu_device *device = builder->device;
    const struct gpu_program *program = ldc_use(device, "ldc/peeled.comp", error);
    if (!program)
        return false;
    gpu_buffer_bind_texels(device, &builder->occupied, UNIT_LDC_OCCUPIED, GL_R32UI);
    gpu_buffer_bind_texels(device, &builder->counts, UNIT_LDC_COUNTS, GL_R32UI);
    gpu_buffer_bind_texels(device, &builder->places, UNIT_LDC_PLACES, GL_R32UI);
    gpu_texture_bind(&builder->layers[task->layer & 1], UNIT_LDC_LAYER);
    gpu_texture_bind(&builder->layer_surface, UNIT_LDC_LAYER_SURFACE);
    gpu_buffer_bind_image(device, &builder->peeled, IMAGE_LDC_PEELED_SURFACE, GL_RGBA32UI);
    gpu_buffer_bind_image(device, &builder->ordered, IMAGE_LDC_ORDERED, GL_RG32UI);
    gpu_buffer_bind_image(device, &builder->found, IMAGE_LDC_FOUND, GL_R32UI);
    gpu_buffer_bind_storage(&builder->build, BIND_LDC_BUILD_COUNTS);
    gpu_uniform_uint(program, "occupied_count", task->counts.occupied);
    gpu_uniform_uint(program, "texels_along", task->cube->resolution);
    gpu_uniform_uint(program, "layer", task->layer);
    gpu_dispatch(device, program, task->counts.occupied);
    task->next = ++task->layer < task->layers ? draw_layer : ldc_pack;
    return true;
}

static bool begin_layers(struct ldc_task *task, struct error *error)
{
    /* The layer before the first: every fragment lies behind it. */
    static const GLfloat before_all = -1.0f;
    GLuint first[4] = {0};
    memcpy(&first[0], &before_all, sizeof(first[0]));
    struct ldc_builder *builder = task->builder;
    if (!reserve(task, error))
        return false;
    task->peeled = true;
    task->layer = 0;
    task->layers = task->counts.layers_needed < task->layers_max ? task->counts.layers_needed : task->layers_max;
    task->next = task->layers > 0 ? draw_layer : ldc_pack;
    gpu_buffer_clear(builder->device, &builder->found, 0);
    glClearNamedFramebufferuiv(builder->layer_framebuffers[1].name, GL_COLOR, 0, first);
    return true;
}

static bool count_places(struct ldc_task *task, struct error *error)
{
    const uint32_t layers_allowed = task->layers_max;
    task->next = begin_layers;
    return ldc_give_places(task, layers_allowed, error) && ldc_limit(task, error) &&
           (task->layers_max == layers_allowed || ldc_give_places(task, task->layers_max, error));
}

bool ldc_peel(struct ldc_task *task, struct error *error)
{
    struct ldc_builder *builder = task->builder;
    task->slots = 0;
    if (task->drawn == 0)
        gpu_buffer_clear(builder->device, &builder->counts, 0);
    gpu_buffer_bind_image(builder->device, &builder->counts, IMAGE_LDC_COUNTS, GL_R32UI);
    return axes_draw_bind_plain(&builder->draw, task->cube->resolution, error) &&
           ldc_draw(task, LDC_PASS_COUNT, NULL, count_places, error);
}
