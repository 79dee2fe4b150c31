/* SPDX-License-Identifier: MIT */
#include "render/primary.h"

#include "render/wave_trace.h"

#include "render/compact.h"
#include "shared/bindings.h"
#include "shared/path.h"

#include <epoxy/gl.h>

/* Keeps the number of a vertex in an int with room to spare. */
#define DRAW_PRIMITIVES_MAX (1u << 24)

enum primitive_kind { PRIMITIVE_TRIANGLES, PRIMITIVE_SPHERES, PRIMITIVE_DISCS };
static const unsigned vertices_per_primitive[] = {3, 36, 6};

bool primary_reserve(struct primary *primary, struct render_context *context, struct error *error)
{
    uint32_t width = context->request.width, height = context->request.height;
    if (primary->framebuffer.name && primary->visible.width == width && primary->visible.height == height)
        return true;
    primary_finish(primary, context->device);
    return gpu_texture_reserve(context->device, &primary->visible, GL_RG32UI, width, height, error) &&
           gpu_texture_reserve(context->device, &primary->depth, GL_DEPTH_COMPONENT32F, width, height, error) &&
           gpu_framebuffer_create(context->device, &primary->framebuffer, &primary->visible, 1, &primary->depth,
                                  error);
}

void primary_finish(struct primary *primary, struct gpu_device *device)
{
    gpu_framebuffer_finish(device, &primary->framebuffer);
    gpu_texture_finish(device, &primary->visible);
    gpu_texture_finish(device, &primary->depth);
}

static const struct gpu_program *use_program(struct render_context *context, enum primitive_kind kind, bool cutout,
                                             struct error *error)
{
    static const char *const numbers[] = {"0", "1", "2"};
    const struct gpu_define defines[] = {
        {"PRIMITIVE_KIND", numbers[kind]},
        {"HAS_SPHERES", "1"}, /* costs nothing where it is not called */
        {cutout ? "HAS_CUTOUT" : NULL, "1"},
        {NULL, NULL},
    };
    const struct gpu_program_source source = {
        .vertex = "render/primary.vert", .fragment = "render/primary.frag", .defines = defines};
    const struct gpu_program *program = gpu_program_get(context->device, &source, error);
    if (program)
        glUseProgram(program->name);
    return program;
}

static void draw(const struct gpu_program *program, enum primitive_kind kind, uint32_t instance, uint32_t first,
                 uint32_t count)
{
    gpu_uniform_uint(program, "instance_index", instance);
    while (count > 0) {
        uint32_t part = count < DRAW_PRIMITIVES_MAX ? count : DRAW_PRIMITIVES_MAX;
        gpu_uniform_uint(program, "first_primitive", first);
        glDrawArrays(GL_TRIANGLES, 0, (GLsizei)(part * vertices_per_primitive[kind]));
        first += part;
        count -= part;
    }
}

/* One of the three sorts of instances: meshes without holes, with holes, spheres; each under one program. */
static bool draw_instances(struct render_context *context, enum primitive_kind kind, bool cutout,
                           struct error *error)
{
    const struct scene_gpu *scene = context->scene;
    const struct gpu_program *program = NULL;
    for (uint32_t i = 0; i < scene->instance_count; i++) {
        const struct instance *instance = &scene->instances[i];
        const struct geometry *geometry = &scene->geometries[instance->geometry].device;
        bool spheres = geometry->kind == GEOMETRY_SPHERES;
        if (spheres != (kind == PRIMITIVE_SPHERES))
            continue;
        if (!spheres && ((geometry->flags & GEOMETRY_HAS_CUTOUT) != 0) != cutout)
            continue;
        if (!program) {
            program = use_program(context, kind, cutout, error);
            if (!program)
                return false;
        }
        if (spheres) /* the picture's y runs down, which turns every winding round */
            glFrontFace(instance->flags & INSTANCE_MIRRORED ? GL_CCW : GL_CW);
        draw(program, kind, i, geometry->first_primitive, geometry->primitive_count);
    }
    return true;
}

static bool draw_discs(struct render_context *context, struct error *error)
{
    if (context->scene->disc_count == 0)
        return true;
    const struct gpu_program *program = use_program(context, PRIMITIVE_DISCS, context->scene->has_cutout, error);
    if (program)
        draw(program, PRIMITIVE_DISCS, 0, 0, context->scene->disc_count);
    return program != NULL;
}

static bool draw_scene(struct render_context *context, struct error *error)
{
    if (!draw_instances(context, PRIMITIVE_TRIANGLES, false, error) ||
        !draw_instances(context, PRIMITIVE_TRIANGLES, true, error) || !draw_discs(context, error))
        return false;
    /* Of a sphere's box the inner sides: they are there also when the eye is in the box. */
    glEnable(GL_CULL_FACE);
    glCullFace(GL_FRONT);
    bool drawn = draw_instances(context, PRIMITIVE_SPHERES, context->scene->has_cutout, error);
    glDisable(GL_CULL_FACE);
    return drawn;
}

bool primary_rasterise(struct primary *primary, struct render_context *context, struct error *error)
{
    static const GLuint nothing[4] = {0};
    static const GLfloat farthest = 0.0f;
    context_span_begin(context, STAGE_PRIMARY);
    gpu_push_group(context->device, "rasterise primary");
    context_bind(context);
    glBindFramebuffer(GL_FRAMEBUFFER, primary->framebuffer.name);
    glViewport(0, 0, (GLsizei)primary->visible.width, (GLsizei)primary->visible.height);
    glDisable(GL_BLEND);
    glDisable(GL_SCISSOR_TEST);
    glEnable(GL_DEPTH_TEST);
    glDepthMask(GL_TRUE);
    glDepthFunc(GL_GREATER);
    glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
    glClearNamedFramebufferuiv(primary->framebuffer.name, GL_COLOR, 0, nothing);
    glClearNamedFramebufferfv(primary->framebuffer.name, GL_DEPTH, 0, &farthest);
    bool drawn = draw_scene(context, error);
    glDisable(GL_DEPTH_TEST);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glMemoryBarrier(GL_ALL_BARRIER_BITS);
    gpu_pop_group(context->device);
    context_span_end(context);
    return drawn && gpu_check(context->device, "rasterising primary hits", error);
}

/* Rays, paths, and what the rasteriser saw. */
static bool make_rays(const struct primary *primary, struct render_context *context, struct error *error)
{
    struct gpu_define defines[5] = {0};
    size_t n = 0;
    if (primary)
        defines[n++] = (struct gpu_define){"VISIBILITY", "1"};
    else if (context->spread)
        defines[n++] = (struct gpu_define){"SPREAD", "1"};
    if (context->uniforms.lens[0] > 0.0f)
        defines[n++] = (struct gpu_define){"HAS_LENS", "1"};
    if (context->scene->has_motion)
        defines[n++] = (struct gpu_define){"HAS_TIMES", "1"};
    const struct gpu_program_source source = {.compute = "render/primary.comp", .defines = defines};
    const struct gpu_program *program = gpu_program_get(context->device, &source, error);
    if (!program)
        return false;
    context_bind(context);
    glUseProgram(program->name);
    if (primary)
        gpu_texture_bind(&primary->visible, UNIT_PASS_0);
    gpu_buffer_bind_storage(&context->rays, BIND_RAYS);
    gpu_buffer_bind_storage(&context->hits, BIND_HITS);
    gpu_buffer_bind_storage(&context->paths, BIND_PATHS);
    gpu_buffer_bind_storage(&context->slice_sums, BIND_SLICE_SUMS);
    if (context->scene->has_motion)
        gpu_buffer_bind_storage(&context->ray_times, BIND_RAY_TIMES);
    gpu_uniform_uint(program, "first_slot", context->slice.first_slot);
    gpu_uniform_uint(program, "slot_count", context->slice.slot_count);
    gpu_dispatch(context->device, program, context->ray_count);
    return true;
}

static bool fill_hits(struct render_context *context, struct error *error)
{
    struct gpu_define defines[3] = {0};
    size_t n = 0;
    if (context->scene->has_spheres)
        defines[n++] = (struct gpu_define){"HAS_SPHERES", "1"};
    if (context->scene->has_spheres && context->scene->has_cutout)
        defines[n++] = (struct gpu_define){"HAS_CUTOUT", "1"};
    const struct gpu_program_source source = {.compute = "render/primary_fill.comp", .defines = defines};
    const struct gpu_program *program = gpu_program_get(context->device, &source, error);
    if (!program)
        return false;
    glUseProgram(program->name);
    gpu_uniform_uint(program, "hit_count", context->hit_count);
    gpu_buffer_bind_storage(&context->rays, BIND_RAYS);
    gpu_buffer_bind_storage(&context->hits, BIND_HITS);
    gpu_buffer_bind_storage(&context->hit_list, BIND_HIT_LIST);
    gpu_dispatch(context->device, program, context->hit_count);
    return true;
}

/* Between two spans of the caller's. */
static bool trace_hits(struct render_context *context, struct error *error)
{
    const struct wave wave = {
        .kind = WAVE_CLOSEST,
        .ray_count = context->ray_count,
        .rays = &context->rays,
        .hits = &context->hits,
        .times = context_ray_times(context),
        .shared_origin = context->request.camera.fov_y > 0.0f && !(context->uniforms.lens[0] > 0.0f), /* an eye */
        .origin_spread = context->request.camera.fov_y > 0.0f ? 2.0f * context->uniforms.lens[0] : 0.0f,
    };
    context_span_end(context);
    bool traced = wave_trace(context, RAY_PRIMARY, &wave, error);
    context_span_begin(context, STAGE_PRIMARY);
    return traced;
}

bool primary_slice(const struct primary *primary, struct render_context *context, struct error *error)
{
    context->ray_count = context->slice.slot_count << context->uniforms.sample_shift;
    context->wave_number = context->asked = 0;
    context->sampled_hits = !primary && context->tracer->impl->sampled;
    context->shadow_rays = context->secondary_rays = 0;
    context_span_begin(context, STAGE_PRIMARY);
    bool found = make_rays(primary, context, error) && (primary || trace_hits(context, error)) &&
                 compact_hits(context, error) &&
                 (!primary || context->hit_count == 0 || fill_hits(context, error));
    context_span_end(context);
    return found;
}
