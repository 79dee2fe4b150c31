/* SPDX-License-Identifier: MIT */
/* Draws the visibility buffer, makes the camera's rays, and finds their hits. */
#include "render/passes/primary/primary.h"

#include "base/clock.h"
#include "render/waves/compact.h"
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

static bool reserve_strip(struct primary *primary, const struct render_frame *frame, uint32_t rows,
                          uint32_t samples, struct error *error)
{
    struct gpu_device *device = frame->device->gpu;
    uint32_t width = frame->request.picture.width;
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

static void finish(void *self, struct gpu_device *device)
{
    struct primary *primary = self;
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

/* Draws a layer, or a part of it. *whole: the layer is done. */
static bool draw_part(struct primary *primary, const struct render_frame *frame, bool *whole, struct error *error)
{
    const struct raster_view_target target = {
        .device = frame->device->gpu,
        .scene = frame->scene,
        .frame = &frame->uniforms,
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

bool primary_rasterise(struct primary *primary, const struct render_frame *frame, bool *done, struct error *error)
{
    const uint64_t start_ns = clock_now_ns();
    context_span_begin(frame->device, STAGE_PRIMARY);
    gpu_push_group(frame->device->gpu, "rasterise primary");
    context_bind_frame(frame);
    /* The viewport is the whole picture, of which the framebuffer has a strip. */
    glViewport(0, -(GLint)primary->first_row, (GLsizei)primary->visible.width,
               (GLsizei)frame->request.picture.height);
    glDepthMask(GL_TRUE); /* clearing heeds both */
    glDisable(GL_SCISSOR_TEST);
    bool whole = false, drawn = draw_part(primary, frame, &whole, error);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    *done = primary->layer == primary->layer_count;
    if (!whole) {
        gpu_finish(frame->device->gpu); /* else all parts would be waited for at the end, at once */
        raster_view_learn(&primary->view, clock_now_ns() - start_ns, STEP_NS);
    }
    gpu_pop_group(frame->device->gpu);
    context_span_end(frame->device);
    return drawn && gpu_check(frame->device->gpu, "rasterising primary hits", error);
}

static const struct gpu_program *rays_program(bool rasterised, const struct render_frame *frame,
                                              struct error *error)
{
    struct gpu_define defines[7] = {0};
    size_t n = 0;
    if (frame->tiles.list)
        defines[n++] = (struct gpu_define){"HAS_TILES", "1"};
    if (rasterised)
        defines[n++] = (struct gpu_define){"VISIBILITY", "1"};
    else if (frame->spread)
        defines[n++] = (struct gpu_define){"SPREAD", "1"};
    if (frame->tile_samples)
        defines[n++] = (struct gpu_define){"HAS_TILE_SAMPLES", "1"};
    if (frame->uniforms.lens[0] > 0.0f)
        defines[n++] = (struct gpu_define){"HAS_LENS", "1"};
    if (frame->scene->has_motion)
        defines[n++] = (struct gpu_define){"HAS_TIMES", "1"};
    const struct gpu_program_source source = {.compute = "render/primary.comp", .defines = defines};
    return gpu_program_get(frame->device->gpu, &source, error);
}

/* Makes rays, paths, and hits of the rasteriser. */
static bool make_rays(const struct primary *primary, struct render_wave *wave, struct error *error)
{
    const struct gpu_program *program = rays_program(primary != NULL, wave->frame, error);
    if (!program)
        return false;
    context_bind(wave);
    if (primary) {
        gpu_texture_bind_image(&primary->visible, IMAGE_VISIBLE);
        gpu_uniform_uint(program, "first_row", primary->first_row);
    }
    gpu_buffer_bind_storage(&wave->rays, BIND_RAYS);
    gpu_buffer_bind_storage(&wave->hits, BIND_HITS);
    gpu_buffer_bind_storage(&wave->paths, BIND_PATHS);
    context_bind_sums(wave);
    if (wave->frame->scene->has_motion)
        gpu_buffer_bind_storage(&wave->ray_times, BIND_RAY_TIMES);
    if (wave->frame->tiles.list) {
        gpu_buffer_bind_texels(wave->device->gpu, wave->frame->tiles.marks, UNIT_KEY_MARKS, GL_R32UI);
        gpu_uniform_uint(program, "first_mark", wave->frame->tiles.first_mark);
    }
    context_bind_tiles(wave->frame, program);
    if (wave->frame->tile_samples)
        gpu_buffer_bind_texels(wave->device->gpu, wave->frame->tile_samples, UNIT_TILE_SAMPLES, GL_R32UI);
    gpu_uniform_uint(program, "first_slot", wave->slice.first_slot);
    gpu_uniform_uint(program, "slot_count", wave->slice.slot_count);
    gpu_dispatch(wave->device->gpu, program, wave->ray_count);
    return true;
}

static const struct gpu_program *fill_program(const struct render_frame *frame, struct error *error)
{
    struct gpu_define defines[TRACE_SURFACE_DEFINES + 2] = {0};
    size_t n = trace_surface_defines(frame->scene, defines);
    if (frame->scene->has_spheres && frame->scene->has_cutout)
        defines[n++] = (struct gpu_define){"HAS_CUTOUT", "1"};
    const struct gpu_program_source source = {.compute = "render/primary_fill.comp", .defines = defines};
    return gpu_program_get(frame->device->gpu, &source, error);
}

static bool fill_hits(struct render_wave *wave, struct error *error)
{
    const struct gpu_program *program = fill_program(wave->frame, error);
    if (!program)
        return false;
    context_bind(wave);
    gpu_buffer_bind_texels(wave->device->gpu, &wave->rays, UNIT_RAYS, GL_RGBA32F);
    gpu_buffer_bind_storage(&wave->hits, BIND_HITS);
    gpu_buffer_bind_storage(&wave->hit_list, BIND_HIT_LIST);
    compact_dispatch(wave, program, WAVE_HITS);
    return true;
}

static struct wave camera_wave(struct render_wave *wave)
{
    return (struct wave){
        .kind = WAVE_CLOSEST,
        .rays = &wave->rays,
        .hits = &wave->hits,
        .times = context_ray_times(wave),
        .shared_origin =
            wave->frame->request.camera.fov_y > 0.0f && !(wave->frame->uniforms.lens[0] > 0.0f), /* an eye */
        .origin_spread = wave->frame->request.camera.fov_y > 0.0f ? 2.0f * wave->frame->uniforms.lens[0] : 0.0f,
    };
}

static bool find_layer(struct render_wave *wave, struct wave *rays, bool *done, struct error *error)
{
    *done = true;
    rays->within_reach = wave->frame->request.hidden_layer > 0;
    context_span_begin(wave->device, STAGE_PRIMARY);
    context_bind(wave);
    bool found = tracer_layer_hits(wave->frame->layer_tracer, wave->frame->scene, rays, wave->frame->layer, error);
    context_span_end(wave->device);
    return found;
}

static bool trace_hits(struct render_wave *wave, bool *done, struct error *error)
{
    struct wave rays = camera_wave(wave);
    compact_rays(wave, &rays);
    if (wave->frame->layer_tracer)
        return find_layer(wave, &rays, done, error);
    return wave_trace(wave, RAY_PRIMARY, &rays, done, error);
}

static void begin_wave(struct render_wave *wave, bool sampled)
{
    wave->ray_count = wave->slice.slot_count << wave->frame->uniforms.sample_shift;
    wave->asked = wave->asking = 0;
    context_set_number(wave, 0);
    wave->sampled_hits = sampled;
    compact_begin(wave);
}

/* `primary` NULL: hits will be traced. */
static bool begin_slice(const struct primary *primary, struct render_wave *wave, struct error *error)
{
    const struct tracer *tracer = wave->frame->layer_tracer ? wave->frame->layer_tracer : wave->frame->tracer;
    begin_wave(wave, !primary && tracer->impl->sampled);
    context_span_begin(wave->device, STAGE_PRIMARY);
    bool made = make_rays(primary, wave, error);
    context_span_end(wave->device);
    return made;
}

bool primary_begin_traced(struct render_wave *wave, struct error *error)
{
    return begin_slice(NULL, wave, error);
}

void primary_begin_eyes(struct render_wave *wave)
{
    begin_wave(wave, false);
}

bool primary_find_eyes(struct render_wave *wave, struct error *error)
{
    const struct eye_rays rays = {
        .frame = &wave->frame->uniforms,
        .first_slot = wave->slice.first_slot,
        .slot_count = wave->slice.slot_count,
        .spread = wave->frame->spread,
        .reach =
            wave->frame->spread ? (float)pixel_filter_radius(wave->frame->request.sampling.pixel_filter) : 0.0f,
        .hits = &wave->hits,
    };
    context_span_begin(wave->device, STAGE_PRIMARY);
    context_bind(wave);
    const bool found =
        tracer_eye_hits(wave->frame->tracer, wave->frame->scene, wave->frame->trace_state, &rays, error);
    context_span_end(wave->device);
    return found;
}

bool primary_intersect(struct render_wave *wave, bool *done, struct error *error)
{
    struct wave rays = camera_wave(wave);
    rays.bare = true;
    compact_rays(wave, &rays);
    return wave_trace(wave, RAY_PRIMARY, &rays, done, error);
}

bool primary_make_surfaces(struct render_wave *wave, struct error *error)
{
    struct wave rays = camera_wave(wave);
    compact_rays(wave, &rays);
    context_span_begin(wave->device, STAGE_PRIMARY);
    context_bind(wave);
    bool made =
        tracer_surfaces(wave->frame->tracer, wave->frame->scene, &rays, error) && compact_hits(wave, error);
    context_span_end(wave->device);
    return made;
}

static bool find(const struct primary *primary, struct render_wave *wave, bool *done, struct error *error)
{
    *done = true;
    if (!primary && !trace_hits(wave, done, error))
        return false;
    if (!*done)
        return true;
    context_span_begin(wave->device, STAGE_PRIMARY);
    bool found = compact_hits(wave, error) && (!primary || wave->hit_count == 0 || fill_hits(wave, error));
    context_span_end(wave->device);
    return found;
}

void primary_announce(struct render_wave *wave, bool rasterised)
{
    if (rasterised)
        raster_view_announce(wave->device->gpu, wave->frame->scene);
    wave->sampled_hits = !rasterised && wave->frame->tracer->impl->sampled;
    if (rasterised) {
        (void)rays_program(true, wave->frame, NULL);
        (void)fill_program(wave->frame, NULL);
    } else { /* the wave's program takes longest: other threads compile it while this one compiles that of the rays
              */
        const struct wave rays = camera_wave(wave);
        wave_announce(wave, &rays);
        (void)rays_program(false, wave->frame, NULL);
    }
}

/* ---- as a pass ---- */

static bool wants(const void *self, const struct render_wave *wave)
{
    (void)self;
    return wave->number == 0 && wave->frame->request.picture.view_source != VIEW_SOURCE_LAYERS;
}

static bool reserve(void *self, struct render_wave *wave, uint32_t slice_samples, struct error *error)
{
    struct primary *primary = self;
    (void)slice_samples;
    return !primary->rasterises ||
           reserve_strip(primary, wave->frame, primary->strip_rows, 1u << primary->sample_shift_max, error);
}

static enum pass_progress begin(const struct primary *primary, struct render_wave *wave, struct error *error)
{
    const bool begun =
        begin_slice(primary, wave, error) && gpu_check_reset(wave->device->gpu, "primary rays", error);
    wave->has_rays = true;
    return begun ? PASS_MORE : PASS_FAILED;
}

static enum pass_progress run(void *self, struct render_wave *wave, struct error *error)
{
    const struct primary *rasterised = ((const struct primary *)self)->rasterises ? self : NULL;
    bool done = false;
    if (!wave->has_rays)
        return begin(rasterised, wave, error);
    if (!find(rasterised, wave, &done, error) || !gpu_check(wave->device->gpu, "primary hits", error))
        return PASS_FAILED;
    return done ? PASS_DONE : PASS_MORE;
}

const struct pass primary_pass = {
    .name = "primary",
    .wants = wants,
    .reserve = reserve,
    .run = run,
    .finish = finish,
};
