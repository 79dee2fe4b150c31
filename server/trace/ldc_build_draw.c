/* SPDX-License-Identifier: MIT */
/* Instances as draws: one call for all of a sort. An instance's number comes to the vertices as an attribute that
 * advances with the instance, so that no uniform has to be set between two of them; a primitive is one vertex. */
#include "gpu/registry.h"
#include "trace/ldc_build_state.h"

#include <epoxy/gl.h>
#include <stdlib.h>

struct draw_command { /* as GL has it */
    uint32_t vertex_count, instance_count, first_vertex, base_instance;
};

struct drawn { /* shared/ldc_build.h */
    uint32_t first_id, id_offset, instance, flags;
};

_Static_assert(sizeof(struct drawn) + sizeof(struct draw_command) == LDC_BUILD_INSTANCE_BYTES, "an instance");

static enum ldc_sort sort_of(const struct geometry *geometry)
{
    if (geometry->kind == GEOMETRY_SPHERES)
        return LDC_SPHERES;
    return geometry->flags & GEOMETRY_HAS_CUTOUT ? LDC_TRIANGLES_CUTOUT : LDC_TRIANGLES;
}

static uint32_t flags_of(const struct instance *instance, const struct geometry *geometry)
{
    return (geometry->flags & GEOMETRY_HAS_NORMALS ? LDC_DRAWN_NORMALS : 0) |
           (geometry->flags & GEOMETRY_HAS_COLOURS ? LDC_DRAWN_COLOURS : 0) |
           (geometry->kind == GEOMETRY_SPHERES ? LDC_DRAWN_SPHERES : 0) |
           (instance->flags & INSTANCE_MIRRORED ? LDC_DRAWN_MIRRORED : 0);
}

static int compare_uint(const void *a, const void *b)
{
    uint32_t left = *(const uint32_t *)a, right = *(const uint32_t *)b;
    return (left > right) - (left < right);
}

/* Fills both tables from `instances`, which ascend. */
static bool list_drawn(struct ldc_builder *builder, const struct scene_gpu *scene, const uint32_t *instances,
                       uint32_t count, struct drawn *drawn, struct draw_command *commands, struct error *error)
{
    uint64_t id = 0;
    uint32_t command_count = 0;
    for (uint32_t i = 0; i < count; i++) {
        const struct instance *instance = &scene->instances[instances[i]];
        const struct geometry *geometry = &scene->geometries[instance->geometry].device;
        enum ldc_sort sort = sort_of(geometry);
        if (id + geometry->primitive_count > UINT32_MAX ||
            (uint64_t)geometry->first_primitive + geometry->primitive_count > INT32_MAX)
            return error_set(error, ERROR_LIMIT, NULL, "more primitives than a layered depth cube can number");
        drawn[i] = (struct drawn){(uint32_t)id, (uint32_t)id - geometry->first_primitive, instances[i],
                                  flags_of(instance, geometry)};
        id += geometry->primitive_count;
        if (i > 0 && instance->geometry == scene->instances[instances[i - 1]].geometry) {
            commands[command_count - 1].instance_count++;
            continue;
        }
        if (builder->run_count == 0 || builder->runs[builder->run_count - 1].sort != sort)
            builder->runs[builder->run_count++] = (struct ldc_run){sort, command_count, 0};
        builder->runs[builder->run_count - 1].count++;
        commands[command_count++] =
            (struct draw_command){geometry->primitive_count, 1, geometry->first_primitive, i};
    }
    return true;
}

bool ldc_draw_prepare(struct ldc_builder *builder, const struct scene_gpu *scene, const uint32_t *instances,
                      uint32_t instance_count, struct error *error)
{
    size_t count = instance_count ? instance_count : 1;
    uint32_t *ascending = malloc(count * sizeof(*ascending));
    struct drawn *drawn = calloc(count, sizeof(*drawn));
    struct draw_command *commands = calloc(count, sizeof(*commands));
    free(builder->runs);
    builder->runs = calloc(count, sizeof(*builder->runs));
    builder->run_count = 0;
    builder->drawn_count = instance_count;
    bool listed = false;
    if (!ascending || !drawn || !commands || !builder->runs) {
        error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for %u instances", instance_count);
        goto out;
    }
    for (uint32_t i = 0; i < instance_count; i++)
        ascending[i] = instances[i];
    qsort(ascending, instance_count, sizeof(*ascending), compare_uint);
    listed = list_drawn(builder, scene, ascending, instance_count, drawn, commands, error) &&
             gpu_buffer_upload(builder->device, &builder->drawn, drawn, instance_count * sizeof(*drawn), error) &&
             gpu_buffer_upload(builder->device, &builder->commands, commands, instance_count * sizeof(*commands),
                               error);
out:
    free(ascending);
    free(drawn);
    free(commands);
    return listed;
}

bool ldc_draw_bind_plain(struct ldc_task *task, struct error *error)
{
    struct ldc_builder *builder = task->builder;
    uint32_t along = task->cube->resolution;
    if (!builder->plain.name) {
        builder->plain.name = gpu_object_create(builder->device->registry, GPU_FRAMEBUFFER);
        if (!builder->plain.name)
            return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no more framebuffer names");
    }
    if (builder->plain_along != along) {
        glNamedFramebufferParameteri(builder->plain.name, GL_FRAMEBUFFER_DEFAULT_WIDTH, (GLint)along);
        glNamedFramebufferParameteri(builder->plain.name, GL_FRAMEBUFFER_DEFAULT_HEIGHT, (GLint)along);
        glNamedFramebufferParameteri(builder->plain.name, GL_FRAMEBUFFER_DEFAULT_LAYERS, 3);
        builder->plain_along = along;
    }
    glBindFramebuffer(GL_FRAMEBUFFER, builder->plain.name);
    return true;
}

static bool make_vertex_array(struct ldc_builder *builder, struct error *error)
{
    if (!builder->vertex_array) {
        builder->vertex_array = gpu_object_create(builder->device->registry, GPU_VERTEX_ARRAY);
        if (!builder->vertex_array)
            return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no more vertex array names");
        glEnableVertexArrayAttrib(builder->vertex_array, 0);
        glVertexArrayAttribIFormat(builder->vertex_array, 0, 4, GL_UNSIGNED_INT, 0);
        glVertexArrayAttribBinding(builder->vertex_array, 0, 0);
        glVertexArrayBindingDivisor(builder->vertex_array, 0, 1);
    }
    glVertexArrayVertexBuffer(builder->vertex_array, 0, builder->drawn.name, 0, sizeof(struct drawn));
    return true;
}

static const struct gpu_program *get_program(const struct ldc_task *task, enum ldc_sort sort, enum ldc_pass pass,
                                             struct error *error)
{
    static const char *const passes[] = {[LDC_PASS_LISTS] = "0", [LDC_PASS_COUNT] = "1", [LDC_PASS_PEEL] = "2"};
    bool spheres = sort == LDC_SPHERES;
    bool cutout = spheres ? task->scene->has_cutout : sort == LDC_TRIANGLES_CUTOUT;
    struct gpu_define defines[4 + LDC_SAMPLE_DEFINES_MAX] = {{"PRIMITIVE_KIND", spheres ? "1" : "0"},
                                                             {"BUILD_PASS", passes[pass]}};
    size_t n = 2;
    if (cutout)
        defines[n++] = (struct gpu_define){"HAS_CUTOUT", "1"};
    if (pass == LDC_PASS_PEEL)
        ldc_sample_defines(task, &defines[n]);
    else if (spheres)
        defines[n++] = (struct gpu_define){"HAS_SPHERES", "1"};
    const struct gpu_program_source source = {.vertex = "ldc/build.vert",
                                              .geometry = "ldc/build.geom",
                                              .fragment = "ldc/build.frag",
                                              .defines = defines};
    return gpu_program_get(task->builder->device, &source, error);
}

static void set_uniforms(const struct ldc_task *task, const struct gpu_program *program)
{
    gpu_uniform_vec(program, "lower_world", 3, task->cube->lower_world);
    gpu_uniform_float(program, "cell_world", task->cube->cell_world);
    gpu_uniform_float(program, "resolution", (float)task->cube->resolution);
    gpu_uniform_uint(program, "texels_along", task->cube->resolution);
    gpu_uniform_float(program, "overlap", task->options->ldc_images == LDC_IMAGES_ONE ? 1.0f : LDC_OVERLAP);
}

static void set_state(uint32_t along)
{
    glViewport(0, 0, (GLsizei)along, (GLsizei)along);
    glDisable(GL_BLEND);
    glDisable(GL_SCISSOR_TEST);
    glDisable(GL_CULL_FACE);
    glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
}

bool ldc_draw(struct ldc_task *task, enum ldc_pass pass,
              void (*set)(const struct ldc_task *task, const struct gpu_program *program), struct error *error)
{
    struct ldc_builder *builder = task->builder;
    GLint vertex_array = 0;
    bool drawn = true;
    if (builder->run_count == 0)
        return true;
    if (!make_vertex_array(builder, error))
        return false;
    set_state(task->cube->resolution);
    glGetIntegerv(GL_VERTEX_ARRAY_BINDING, &vertex_array);
    glBindVertexArray(builder->vertex_array);
    glBindBuffer(GL_DRAW_INDIRECT_BUFFER, builder->commands.name);
    for (uint32_t i = 0; i < builder->run_count && drawn; i++) {
        const struct ldc_run *run = &builder->runs[i];
        const struct gpu_program *program = get_program(task, run->sort, pass, error);
        drawn = program != NULL;
        if (!drawn)
            break;
        glUseProgram(program->name);
        set_uniforms(task, program);
        if (set)
            set(task, program);
        glMultiDrawArraysIndirect(GL_POINTS, (const void *)(run->first * sizeof(struct draw_command)),
                                  (GLsizei)run->count, sizeof(struct draw_command));
    }
    glBindBuffer(GL_DRAW_INDIRECT_BUFFER, 0);
    glBindVertexArray((GLuint)vertex_array);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glMemoryBarrier(GL_ALL_BARRIER_BITS);
    return drawn && gpu_check(builder->device, "drawing into a layered depth cube", error);
}
