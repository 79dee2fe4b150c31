/* SPDX-License-Identifier: MIT */
#include "render/passes/primary/primary.h"

#include "base/clock.h"
#include "render/waves/compact.h"
#include "render/passes/key_view/key_view.h"
#include "render/picture/pixel_filter.h"
#include "render/waves/trace.h"
#include "shared/bindings.h"
#include "shared/key_view.h"
#include "shared/path.h"
#include "trace/program.h"
#include "trace/step.h"

#include <epoxy/gl.h>

static void finish_framebuffers(struct primary *primary, struct gpu_device *device)
{
    for (int i = 0; i < SAMPLES_TOGETHER_MAX; i++)
        gpu_framebuffer_finish(device, &primary->framebuffers[i]);
}

static bool has_room(const struct primary *primary, uint32_t width, uint32_t rows, uint32_t samples)
{
    const struct gpu_texture *visible = &primary->visible;
    return primary->framebuffers[samples - 1].name && visible->width == width && visible->height == rows;
}

bool primary_reserve(struct primary *primary, struct render_context *context, uint32_t rows, uint32_t samples,
                     struct error *error)
{
    struct gpu_device *device = context->device;
    uint32_t width = context->request.width;
    if (has_room(primary, width, rows, samples))
        return true;
    finish_framebuffers(primary, device);
    bool made = gpu_texture_reserve_array(device, &primary->visible, GL_RG32UI, width, rows, samples, error) &&
                gpu_texture_reserve(device, &primary->depth, GL_DEPTH_COMPONENT32F, width, rows, error);
    for (uint32_t i = 0; made && i < samples; i++) {
        const struct gpu_layer_target target = {
            .colours = &primary->visible, .first = i, .count = 1, .depth = &primary->depth};
        made = gpu_framebuffer_create_layers(device, &primary->framebuffers[i], &target, error);
    }
    return made;
}

void primary_finish(struct primary *primary, struct gpu_device *device)
{
    finish_framebuffers(primary, device);
    gpu_texture_finish(device, &primary->visible);
    gpu_texture_finish(device, &primary->depth);
}

static void begin_layer(struct primary *primary, uint32_t layer)
{
    primary->layer = layer;
    raster_view_begin(&primary->view);
    primary->cleared = false;
}

static void set_layer(struct primary *primary)
{
    static const GLuint nothing[4] = {0};
    static const GLfloat farthest = 0.0f;
    const unsigned name = primary->framebuffers[primary->layer].name;
    glBindFramebuffer(GL_FRAMEBUFFER, name);
    if (!primary->cleared) {
        glClearNamedFramebufferuiv(name, GL_COLOR, 0, nothing);
        glClearNamedFramebufferfv(name, GL_DEPTH, 0, &farthest);
    }
    primary->cleared = true;
}

/* What one layer still needs, or a part of it. *whole: the layer is done. */
static bool draw_part(struct primary *primary, struct render_context *context, bool *whole, struct error *error)
{
    const struct raster_view_target target = {
        .device = context->device,
        .scene = context->scene,
        .first_row = primary->first_row,
        .sample = primary->layer,
    };
    set_layer(primary);
    bool drawn = raster_view_draw(&primary->view, &target, whole, error);
    if (*whole)
        begin_layer(primary, primary->layer + 1);
    return drawn;
}

void primary_rasterise_begin(struct primary *primary, uint32_t first_row, uint32_t samples)
{
    primary->first_row = first_row;
    primary->layer_count = samples;
    begin_layer(primary, 0);
}

bool primary_rasterise(struct primary *primary, struct render_context *context, bool *done, struct error *error)
{
    const uint64_t start_ns = clock_now_ns();
    context_span_begin(context, STAGE_PRIMARY);
    gpu_push_group(context->device, "rasterise primary");
    context_bind(context);
    /* All of the picture, of which the framebuffer has a strip. */
    glViewport(0, -(GLint)primary->first_row, (GLsizei)primary->visible.width, (GLsizei)context->request.height);
    glDepthMask(GL_TRUE); /* clearing heeds both */
    glDisable(GL_SCISSOR_TEST);
    bool whole = false, drawn = draw_part(primary, context, &whole, error);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    *done = primary->layer == primary->layer_count;
    if (!whole) {
        gpu_finish(context->device); /* else all parts would be waited for at the end, at once */
        raster_view_learn(&primary->view, clock_now_ns() - start_ns, STEP_NS);
    }
    gpu_pop_group(context->device);
    context_span_end(context);
    return drawn && gpu_check(context->device, "rasterising primary hits", error);
}

static const struct gpu_program *rays_program(bool rasterised, struct render_context *context, struct error *error)
{
    struct gpu_define defines[7] = {0};
    size_t n = 0;
    if (context->marked_key)
        defines[n++] = (struct gpu_define){"HAS_TILES", "1"};
    if (rasterised)
        defines[n++] = (struct gpu_define){"VISIBILITY", "1"};
    else if (context->spread)
        defines[n++] = (struct gpu_define){"SPREAD", "1"};
    if (context->tile_samples)
        defines[n++] = (struct gpu_define){"HAS_TILE_SAMPLES", "1"};
    if (context->uniforms.lens[0] > 0.0f)
        defines[n++] = (struct gpu_define){"HAS_LENS", "1"};
    if (context->scene->has_motion)
        defines[n++] = (struct gpu_define){"HAS_TIMES", "1"};
    const struct gpu_program_source source = {.compute = "render/primary.comp", .defines = defines};
    return gpu_program_get(context->device, &source, error);
}

/* Rays, paths, and what the rasteriser saw. */
static bool make_rays(const struct primary *primary, struct render_context *context, struct error *error)
{
    const struct gpu_program *program = rays_program(primary != NULL, context, error);
    if (!program)
        return false;
    context_bind(context);
    if (primary) {
        gpu_texture_bind_image(&primary->visible, IMAGE_VISIBLE);
        gpu_uniform_uint(program, "first_row", primary->first_row);
    }
    gpu_buffer_bind_storage(&context->rays, BIND_RAYS);
    gpu_buffer_bind_storage(&context->hits, BIND_HITS);
    gpu_buffer_bind_storage(&context->paths, BIND_PATHS);
    context_bind_sums(context);
    if (context->scene->has_motion)
        gpu_buffer_bind_storage(&context->ray_times, BIND_RAY_TIMES);
    if (context->marked_key) {
        gpu_buffer_bind_texels(context->device, &context->marked_key->marks, UNIT_KEY_MARKS, GL_R32UI);
        gpu_uniform_uint(program, "first_mark",
                         context->layer * context->uniforms.width * context->uniforms.height);
    }
    context_bind_tiles(context, program);
    if (context->tile_samples)
        gpu_buffer_bind_texels(context->device, context->tile_samples, UNIT_TILE_SAMPLES, GL_R32UI);
    gpu_uniform_uint(program, "first_slot", context->slice.first_slot);
    gpu_uniform_uint(program, "slot_count", context->slice.slot_count);
    gpu_dispatch(context->device, program, context->ray_count);
    return true;
}

static const struct gpu_program *fill_program(struct render_context *context, struct error *error)
{
    struct gpu_define defines[TRACE_SURFACE_DEFINES + 2] = {0};
    size_t n = trace_surface_defines(context->scene, defines);
    if (context->scene->has_spheres && context->scene->has_cutout)
        defines[n++] = (struct gpu_define){"HAS_CUTOUT", "1"};
    const struct gpu_program_source source = {.compute = "render/primary_fill.comp", .defines = defines};
    return gpu_program_get(context->device, &source, error);
}

static bool fill_hits(struct render_context *context, struct error *error)
{
    const struct gpu_program *program = fill_program(context, error);
    if (!program)
        return false;
    context_bind(context);
    gpu_buffer_bind_texels(context->device, &context->rays, UNIT_RAYS, GL_RGBA32F);
    gpu_buffer_bind_storage(&context->hits, BIND_HITS);
    gpu_buffer_bind_storage(&context->hit_list, BIND_HIT_LIST);
    compact_dispatch(context, program, WAVE_HITS);
    return true;
}

static struct wave camera_wave(struct render_context *context)
{
    return (struct wave){
        .kind = WAVE_CLOSEST,
        .rays = &context->rays,
        .hits = &context->hits,
        .times = context_ray_times(context),
        .shared_origin = context->request.camera.fov_y > 0.0f && !(context->uniforms.lens[0] > 0.0f), /* an eye */
        .origin_spread = context->request.camera.fov_y > 0.0f ? 2.0f * context->uniforms.lens[0] : 0.0f,
    };
}

static bool find_layer(struct render_context *context, struct wave *wave, bool *done, struct error *error)
{
    *done = true;
    wave->within_reach = context->request.hidden_layer > 0;
    context_span_begin(context, STAGE_PRIMARY);
    context_bind(context);
    bool found = tracer_layer_hits(context->layer_tracer, context->scene, wave, context->layer, error);
    context_span_end(context);
    return found;
}

static bool trace_hits(struct render_context *context, bool *done, struct error *error)
{
    struct wave wave = camera_wave(context);
    compact_rays(context, &wave);
    if (context->layer_tracer)
        return find_layer(context, &wave, done, error);
    return wave_trace(context, RAY_PRIMARY, &wave, done, error);
}

static void begin_wave(struct render_context *context, bool sampled)
{
    context->ray_count = context->slice.slot_count << context->uniforms.sample_shift;
    context->wave_number = context->asked = context->asking = 0;
    context->sampled_hits = sampled;
    compact_begin(context);
}

bool primary_begin_slice(const struct primary *primary, struct render_context *context, struct error *error)
{
    const struct tracer *tracer = context->layer_tracer ? context->layer_tracer : context->tracer;
    begin_wave(context, !primary && tracer->impl->sampled);
    context_span_begin(context, STAGE_PRIMARY);
    bool made = make_rays(primary, context, error);
    context_span_end(context);
    return made;
}

void primary_begin_eyes(struct render_context *context)
{
    begin_wave(context, false);
}

bool primary_find_eyes(struct render_context *context, struct error *error)
{
    const struct eye_rays rays = {
        .frame = &context->uniforms,
        .first_slot = context->slice.first_slot,
        .slot_count = context->slice.slot_count,
        .spread = context->spread,
        .reach = context->spread ? (float)pixel_filter_radius(context->request.filter) : 0.0f,
        .hits = &context->hits,
    };
    context_span_begin(context, STAGE_PRIMARY);
    context_bind(context);
    const bool found = tracer_eye_hits(context->tracer, context->scene, context->trace_state, &rays, error);
    context_span_end(context);
    return found;
}

bool primary_intersect(struct render_context *context, bool *done, struct error *error)
{
    struct wave wave = camera_wave(context);
    wave.bare = true;
    compact_rays(context, &wave);
    return wave_trace(context, RAY_PRIMARY, &wave, done, error);
}

bool primary_make_surfaces(struct render_context *context, struct error *error)
{
    struct wave wave = camera_wave(context);
    compact_rays(context, &wave);
    context_span_begin(context, STAGE_PRIMARY);
    context_bind(context);
    bool made = tracer_surfaces(context->tracer, context->scene, &wave, error) && compact_hits(context, error);
    context_span_end(context);
    return made;
}

bool primary_find(const struct primary *primary, struct render_context *context, bool *done, struct error *error)
{
    *done = true;
    if (!primary && !trace_hits(context, done, error))
        return false;
    if (!*done)
        return true;
    context_span_begin(context, STAGE_PRIMARY);
    bool found =
        compact_hits(context, error) && (!primary || context->hit_count == 0 || fill_hits(context, error));
    context_span_end(context);
    return found;
}

void primary_announce(struct render_context *context, bool rasterised)
{
    if (rasterised)
        raster_view_announce(context->device, context->scene);
    context->sampled_hits = !rasterised && context->tracer->impl->sampled;
    if (rasterised) {
        (void)rays_program(true, context, NULL);
        (void)fill_program(context, NULL);
    } else { /* the wave takes longest, while this thread makes what makes the rays */
        const struct wave wave = camera_wave(context);
        wave_announce(context, &wave);
        (void)rays_program(false, context, NULL);
    }
}
