/* SPDX-License-Identifier: MIT */
/* Instances as draws: one call per sort. An instance's number reaches the vertices as an attribute that advances
 * with the instance, so that no uniform changes between two instances; a primitive is one vertex. */
#include "trace/raster/draw.h"

#include "gpu/barrier.h"
#include "gpu/registry.h"

#include <epoxy/gl.h>
#include <stdlib.h>
#include <string.h>

struct drawn { /* raster/layout.h */
    uint32_t first_id, id_offset, instance, flags;
};

_Static_assert(sizeof(struct drawn) + sizeof(struct axes_command) == AXES_INSTANCE_BYTES, "an instance");

void axes_draw_init(struct axes_draw *draw, struct gpu_device *device)
{
    *draw = (struct axes_draw){.device = device};
}

void axes_draw_finish(struct axes_draw *draw)
{
    gpu_buffer_finish(draw->device, &draw->drawn);
    gpu_buffer_finish(draw->device, &draw->commands);
    gpu_framebuffer_finish(draw->device, &draw->plain);
    gpu_object_destroy(draw->device->registry, GPU_VERTEX_ARRAY, draw->vertex_array);
    free(draw->runs);
    free(draw->listed);
    free(draw->instances);
    axes_draw_init(draw, draw->device);
}

enum axes_sort axes_sort_of(const struct geometry *geometry)
{
    if (geometry->kind == GEOMETRY_SPHERES)
        return AXES_SPHERES;
    return geometry->flags & GEOMETRY_HAS_CUTOUT ? AXES_TRIANGLES_CUTOUT : AXES_TRIANGLES;
}

static uint32_t flags_of(const struct instance *instance, const struct geometry *geometry)
{
    bool closed = geometry->kind == GEOMETRY_SPHERES || (geometry->flags & GEOMETRY_CLOSED) != 0;
    return (closed && (geometry->flags & GEOMETRY_HAS_CUTOUT) == 0 ? DRAWN_CLOSED : 0) |
           (geometry->flags & GEOMETRY_HAS_NORMALS ? DRAWN_NORMALS : 0) |
           (geometry->flags & GEOMETRY_HAS_COLOURS ? DRAWN_COLOURS : 0) |
           (geometry->kind == GEOMETRY_SPHERES ? DRAWN_SPHERES : 0) |
           (instance->flags & INSTANCE_MIRRORED ? DRAWN_MIRRORED : 0);
}

static int compare_uint(const void *a, const void *b)
{
    uint32_t left = *(const uint32_t *)a, right = *(const uint32_t *)b;
    return (left > right) - (left < right);
}

/* Fills both tables from `instances`, which ascend. */
static bool list_drawn(struct axes_draw *draw, const struct gpu_scene *scene, const uint32_t *instances,
                       uint32_t count, struct drawn *drawn, struct error *error)
{
    uint64_t id = 0;
    for (uint32_t i = 0; i < count; i++) {
        const struct instance *instance = &scene->instances[instances[i]];
        const struct geometry *geometry = &scene->geometries[instance->geometry].device;
        enum axes_sort sort = axes_sort_of(geometry);
        if (id + geometry->primitive_count > UINT32_MAX ||
            (uint64_t)geometry->first_primitive + geometry->primitive_count > INT32_MAX)
            return error_set(error, ERROR_LIMIT, NULL, "more primitives than can be numbered");
        drawn[i] = (struct drawn){(uint32_t)id, (uint32_t)id - geometry->first_primitive, instances[i],
                                  flags_of(instance, geometry)};
        const struct axes_command command = {geometry->primitive_count, 1, geometry->first_primitive, i,
                                             (uint32_t)id};
        id += geometry->primitive_count;
        if (i > 0 && instance->geometry == scene->instances[instances[i - 1]].geometry) {
            draw->listed[draw->command_count - 1].instance_count++;
            continue;
        }
        if (draw->run_count == 0 || draw->runs[draw->run_count - 1].sort != sort)
            draw->runs[draw->run_count++] = (struct axes_run){sort, draw->command_count, 0};
        draw->runs[draw->run_count - 1].count++;
        draw->listed[draw->command_count++] = command;
    }
    draw->primitive_count = (uint32_t)id;
    return true;
}

bool axes_list_instances(const struct gpu_scene *scene, uint32_t **instances, uint32_t *count, struct error *error)
{
    *count = 0;
    *instances = malloc(((size_t)scene->instance_count + 1) * sizeof(**instances));
    if (!*instances)
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for %u instances", scene->instance_count);
    for (uint32_t i = 0; i < scene->instance_count; i++)
        if (scene->geometries[scene->instances[i].geometry].device.primitive_count > 0)
            (*instances)[(*count)++] = i;
    return true;
}

static void forget_list(struct axes_draw *draw)
{
    free(draw->runs);
    free(draw->listed);
    free(draw->instances);
    draw->runs = NULL;
    draw->listed = NULL;
    draw->instances = NULL;
    draw->run_count = draw->command_count = draw->drawn_count = draw->primitive_count = 0;
}

bool axes_draw_prepare(struct axes_draw *draw, const struct gpu_scene *scene, const uint32_t *instances,
                       uint32_t instance_count, struct error *error)
{
    size_t count = instance_count ? instance_count : 1;
    struct drawn *drawn = calloc(count, sizeof(*drawn));
    forget_list(draw);
    uint32_t *ascending = draw->instances = malloc(count * sizeof(*ascending));
    draw->runs = calloc(count, sizeof(*draw->runs));
    draw->listed = calloc(count, sizeof(*draw->listed));
    bool listed = false;
    if (!ascending || !drawn || !draw->listed || !draw->runs) {
        error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for %u instances", instance_count);
        goto out;
    }
    for (uint32_t i = 0; i < instance_count; i++)
        ascending[i] = instances[i];
    qsort(ascending, instance_count, sizeof(*ascending), compare_uint);
    listed = list_drawn(draw, scene, ascending, instance_count, drawn, error) &&
             gpu_buffer_upload(draw->device, &draw->drawn, drawn, instance_count * sizeof(*drawn), error) &&
             gpu_buffer_upload(draw->device, &draw->commands, draw->listed, instance_count * sizeof(*draw->listed),
                               error);
    draw->drawn_count = instance_count;
out:
    free(drawn);
    if (!listed)
        forget_list(draw);
    return listed;
}

bool axes_draw_bind_plain(struct axes_draw *draw, uint32_t along, struct error *error)
{
    if (!draw->plain.name) {
        draw->plain.name = gpu_object_create(draw->device->registry, GPU_FRAMEBUFFER);
        if (!draw->plain.name)
            return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no more framebuffer names");
    }
    if (draw->plain_along != along) {
        glNamedFramebufferParameteri(draw->plain.name, GL_FRAMEBUFFER_DEFAULT_WIDTH, (GLint)along);
        glNamedFramebufferParameteri(draw->plain.name, GL_FRAMEBUFFER_DEFAULT_HEIGHT, (GLint)along);
        glNamedFramebufferParameteri(draw->plain.name, GL_FRAMEBUFFER_DEFAULT_LAYERS, 3);
        draw->plain_along = along;
    }
    glBindFramebuffer(GL_FRAMEBUFFER, draw->plain.name);
    return true;
}

static bool make_vertex_array(struct axes_draw *draw, struct error *error)
{
    if (!draw->vertex_array) {
        draw->vertex_array = gpu_object_create(draw->device->registry, GPU_VERTEX_ARRAY);
        if (!draw->vertex_array)
            return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no more vertex array names");
        glEnableVertexArrayAttrib(draw->vertex_array, 0);
        glVertexArrayAttribIFormat(draw->vertex_array, 0, 4, GL_UNSIGNED_INT, 0);
        glVertexArrayAttribBinding(draw->vertex_array, 0, 0);
        glVertexArrayBindingDivisor(draw->vertex_array, 0, 1);
    }
    glVertexArrayVertexBuffer(draw->vertex_array, 0, draw->drawn.name, 0, sizeof(struct drawn));
    return true;
}

static const struct gpu_program *get_program(const struct axes_draw *draw, const struct gpu_scene *scene,
                                             const struct axes_pass *pass, enum axes_sort sort,
                                             struct error *error)
{
    bool spheres = sort == AXES_SPHERES, has_spheres = false;
    bool cutout = spheres ? scene->has_cutout : sort == AXES_TRIANGLES_CUTOUT;
    struct gpu_define defines[AXES_PASS_DEFINES_MAX + 4] = {{"PRIMITIVE_KIND", spheres ? "1" : "0"}};
    size_t n = 1;
    if (cutout && !pass->cutouts_ignored)
        defines[n++] = (struct gpu_define){"HAS_CUTOUT", "1"};
    for (size_t i = 0; i < AXES_PASS_DEFINES_MAX && pass->defines && pass->defines[i].name; i++) {
        defines[n++] = pass->defines[i];
        has_spheres |= strcmp(pass->defines[i].name, "HAS_SPHERES") == 0;
    }
    if (spheres && !has_spheres)
        defines[n++] = (struct gpu_define){"HAS_SPHERES", "1"};
    const struct gpu_program_source source = {.vertex = "raster/draw.vert",
                                              .geometry = "raster/draw.geom",
                                              .fragment = pass->fragment,
                                              .defines = defines};
    return gpu_program_get(draw->device, &source, error);
}

static void set_uniforms(const struct axes_pass *pass, const struct gpu_program *program)
{
    gpu_uniform_vec(program, "lower_world", 3, pass->lower_world);
    gpu_uniform_float(program, "cell_world", pass->cell_world);
    gpu_uniform_float(program, "resolution", (float)pass->resolution);
    gpu_uniform_uint(program, "texels_along", pass->resolution);
    gpu_uniform_float(program, "overlap", pass->overlap);
    if (pass->set)
        pass->set(pass->context, program);
}

static void set_state(const struct axes_pass *pass)
{
    const GLsizei along = (GLsizei)pass->resolution;
    glViewport(0, 0, along, along);
    glDisable(GL_BLEND);
    glDisable(GL_SCISSOR_TEST);
    if (pass->end_row > 0) {
        glEnable(GL_SCISSOR_TEST);
        glScissor(0, (GLint)pass->first_row, along, (GLsizei)(pass->end_row - pass->first_row));
    }
    glDisable(GL_CULL_FACE);
    glFrontFace(GL_CCW); /* gl_FrontFacing depends on it, and other code may change it */
    glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
}

uint32_t axes_draw_command_of(const struct axes_draw *draw, uint32_t id)
{
    uint32_t first = 0, end = draw->command_count;
    while (end - first > 1) {
        uint32_t middle = first + (end - first) / 2;
        if (draw->listed[middle].first_id <= id)
            first = middle;
        else
            end = middle;
    }
    return first;
}

static uint32_t end_of(const struct axes_draw *draw, uint32_t command)
{
    return command + 1 < draw->command_count ? draw->listed[command + 1].first_id : draw->primitive_count;
}

/* Draws a range of a command's primitives: the rest of an instance, whole ones, the beginning of one. */
static void draw_some(const struct axes_command *command, uint32_t first, uint32_t end)
{
    const uint32_t each = command->vertex_count;
    while (first < end) {
        const uint32_t instance = (first - command->first_id) / each, before = (first - command->first_id) % each;
        const uint32_t left = end - first, whole = before == 0 ? left / each : 0;
        const uint32_t rest = left < each - before ? left : each - before, count = whole > 0 ? each : rest;
        glDrawArraysInstancedBaseInstance(GL_POINTS, (GLint)(command->first_vertex + before), (GLsizei)count,
                                          whole > 0 ? (GLsizei)whole : 1, command->base_instance + instance);
        first += whole > 0 ? whole * each : count;
    }
}

/* Draws the primitives of a run's commands that lie in the range; whole commands go together in one call. */
static void draw_run(const struct axes_draw *draw, const struct axes_run *run, uint32_t first, uint32_t end)
{
    const uint32_t run_end = run->first + run->count;
    uint32_t command = axes_draw_command_of(draw, first);
    command = command > run->first ? command : run->first;
    while (command < run_end && draw->listed[command].first_id < end) {
        const uint32_t from = draw->listed[command].first_id, to = end_of(draw, command);
        uint32_t whole = 0;
        while (first <= from && command + whole < run_end && end_of(draw, command + whole) <= end)
            whole++;
        if (whole > 0)
            glMultiDrawArraysIndirect(GL_POINTS, (const void *)(command * sizeof(struct axes_command)),
                                      (GLsizei)whole, sizeof(struct axes_command));
        else
            draw_some(&draw->listed[command], first > from ? first : from, end < to ? end : to);
        command += whole > 0 ? whole : 1;
    }
}

static bool run_has_any(const struct axes_draw *draw, const struct axes_run *run, uint32_t first, uint32_t end)
{
    return draw->listed[run->first].first_id < end && end_of(draw, run->first + run->count - 1) > first;
}

static bool draw_runs(struct axes_draw *draw, const struct gpu_scene *scene, const struct axes_pass *pass,
                      uint32_t first, uint32_t end, struct error *error)
{
    bool good = true;
    gpu_together_begin(draw->device);
    for (uint32_t i = 0; i < draw->run_count; i++) {
        const struct axes_run *run = &draw->runs[i];
        if (!run_has_any(draw, run, first, end))
            continue;
        const struct gpu_program *program = get_program(draw, scene, pass, run->sort, error);
        good = program != NULL;
        if (!good)
            break;
        set_uniforms(pass, program);
        gpu_program_use(draw->device, program);
        draw_run(draw, run, first, end);
    }
    gpu_together_end(draw->device);
    return good;
}

bool axes_draw_range(struct axes_draw *draw, const struct gpu_scene *scene, const struct axes_pass *pass,
                     uint32_t first, uint32_t end, struct error *error)
{
    GLint vertex_array = 0;
    if (draw->run_count == 0 || first >= end)
        return true;
    if (!make_vertex_array(draw, error))
        return false;
    set_state(pass);
    glGetIntegerv(GL_VERTEX_ARRAY_BINDING, &vertex_array);
    glBindVertexArray(draw->vertex_array);
    glBindBuffer(GL_DRAW_INDIRECT_BUFFER, draw->commands.name);
    bool drawn = draw_runs(draw, scene, pass, first, end, error);
    glDisable(GL_SCISSOR_TEST);
    glBindBuffer(GL_DRAW_INDIRECT_BUFFER, 0);
    glBindVertexArray((GLuint)vertex_array);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    return drawn && gpu_check(draw->device, "drawing along the axes", error);
}

bool axes_draw(struct axes_draw *draw, const struct gpu_scene *scene, const struct axes_pass *pass,
               struct error *error)
{
    return axes_draw_range(draw, scene, pass, 0, draw->primitive_count, error);
}
