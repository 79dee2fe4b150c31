/* SPDX-License-Identifier: MIT */
#include "render/primary.h"

#include "base/clock.h"
#include "render/compact.h"
#include "render/wave_trace.h"
#include "shared/bindings.h"
#include "shared/path.h"
#include "trace/program.h"
#include "trace/step.h"

#include <epoxy/gl.h>

/* Vertices that one step of the frame draws. On a GPU nearly as many as an int can number. On software GL at most
 * what takes some ten milliseconds if triangles are small, and fewer where that takes longer than a step should:
 * larger triangles, other work on the machine. Each part costs something of its own, so only then. */
#define DRAW_VERTICES_HARDWARE (3u << 24)
#define DRAW_VERTICES_SOFTWARE (3u << 16)
#define DRAW_VERTICES_FIRST (3u << 14) /* nothing is known of the scene yet */
#define DRAW_VERTICES_MIN (3u << 12)

enum primitive_kind { PRIMITIVE_TRIANGLES, PRIMITIVE_SPHERES, PRIMITIVE_DISCS };
static const unsigned vertices_per_primitive[] = {3, 36, 6};

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
    for (uint32_t i = 0; made && i < samples; i++)
        made = gpu_framebuffer_create_layer(device, &primary->framebuffers[i], &primary->visible, i,
                                            &primary->depth, error);
    return made;
}

void primary_finish(struct primary *primary, struct gpu_device *device)
{
    finish_framebuffers(primary, device);
    gpu_texture_finish(device, &primary->visible);
    gpu_texture_finish(device, &primary->depth);
}

static const struct gpu_program *get_program(struct render_context *context, enum primitive_kind kind, bool cutout,
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
    return gpu_program_get(context->device, &source, error);
}

/* What is drawn one after the other, each under one program. */
enum primitive_sort { SORT_WHOLE, SORT_WITH_HOLES, SORT_DISCS, SORT_SPHERES, SORT_COUNT };
static const enum primitive_kind kind_of_sort[SORT_COUNT] = {PRIMITIVE_TRIANGLES, PRIMITIVE_TRIANGLES,
                                                             PRIMITIVE_DISCS, PRIMITIVE_SPHERES};

/* Primitives of an instance (all discs count as one) that are of a sort. */
static uint32_t primitives_of(const struct gpu_scene *scene, enum primitive_sort sort, uint32_t instance,
                              uint32_t *first)
{
    *first = 0;
    if (sort == SORT_DISCS)
        return scene->disc_count;
    const struct geometry *geometry = &scene->geometries[scene->instances[instance].geometry].device;
    enum primitive_sort own = SORT_SPHERES;
    if (geometry->kind != GEOMETRY_SPHERES)
        own = geometry->flags & GEOMETRY_HAS_CUTOUT ? SORT_WITH_HOLES : SORT_WHOLE;
    *first = geometry->first_primitive;
    return own == sort ? geometry->primitive_count : 0;
}

static bool has_cutout(const struct render_context *context, enum primitive_sort sort)
{
    return sort == SORT_WITH_HOLES || (sort != SORT_WHOLE && context->scene->has_cutout);
}

/* Goes on with a sort where the last part ended; what is left of `budget` vertices comes back. */
static bool draw_sort(struct primary *primary, struct render_context *context, uint32_t *budget,
                      struct error *error)
{
    const struct gpu_scene *scene = context->scene;
    enum primitive_sort sort = (enum primitive_sort)primary->sort;
    enum primitive_kind kind = kind_of_sort[sort];
    uint32_t end = sort == SORT_DISCS ? 1 : scene->instance_count;
    const struct gpu_program *program = NULL;
    for (; primary->instance < end; primary->instance++, primary->primitive = 0) {
        uint32_t first, count = primitives_of(scene, sort, primary->instance, &first) - primary->primitive;
        if (count == 0)
            continue;
        if (!program && !(program = get_program(context, kind, has_cutout(context, sort), error)))
            return false;
        uint32_t maximum = *budget / vertices_per_primitive[kind], part = count < maximum ? count : maximum;
        if (sort == SORT_SPHERES) /* the picture's y runs down, which turns every winding round */
            glFrontFace(scene->instances[primary->instance].flags & INSTANCE_MIRRORED ? GL_CCW : GL_CW);
        gpu_uniform_uint(program, "instance_index", primary->instance);
        gpu_uniform_uint(program, "first_primitive", first + primary->primitive);
        gpu_uniform_uint(program, "first_row", primary->first_row);
        gpu_uniform_uint(program, "layer", primary->layer);
        gpu_program_use(context->device, program);
        if (part > 0)
            glDrawArrays(GL_TRIANGLES, 0, (GLsizei)(part * vertices_per_primitive[kind]));
        *budget -= part * vertices_per_primitive[kind];
        primary->primitive += part;
        if (part < count) {
            *budget = 0;
            return true;
        }
    }
    primary->instance = 0;
    primary->sort++;
    return true;
}

static void learn(struct primary *primary, uint64_t took_ns)
{
    if (took_ns > STEP_NS && primary->part_vertices > DRAW_VERTICES_MIN)
        primary->part_vertices /= 2;
    else if (took_ns < STEP_NS / 8 && primary->part_vertices < DRAW_VERTICES_SOFTWARE)
        primary->part_vertices *= 2;
}

static bool draw_layer(struct primary *primary, struct render_context *context, uint32_t *budget,
                       struct error *error)
{
    bool drawn = true;
    while (drawn && *budget > 0 && primary->sort < SORT_COUNT) {
        if (primary->sort == SORT_SPHERES) { /* of a sphere's box the inner sides: they are there also when the eye
                                              * is in the box */
            glEnable(GL_CULL_FACE);
            glCullFace(GL_FRONT);
        }
        drawn = draw_sort(primary, context, budget, error);
        glDisable(GL_CULL_FACE);
    }
    return drawn;
}

static void begin_layer(struct primary *primary, uint32_t layer)
{
    primary->layer = layer;
    primary->sort = SORT_WHOLE;
    primary->instance = primary->primitive = 0;
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
    uint32_t budget = context->device->facts.software ? primary->part_vertices : DRAW_VERTICES_HARDWARE;
    set_layer(primary);
    bool drawn = draw_layer(primary, context, &budget, error);
    *whole = primary->sort == SORT_COUNT;
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
    if (primary->part_vertices == 0)
        primary->part_vertices = DRAW_VERTICES_FIRST;
    context_span_begin(context, STAGE_PRIMARY);
    gpu_push_group(context->device, "rasterise primary");
    context_bind(context);
    /* All of the picture, of which the framebuffer has a strip. */
    glViewport(0, -(GLint)primary->first_row, (GLsizei)primary->visible.width, (GLsizei)context->request.height);
    glDisable(GL_BLEND);
    glDisable(GL_SCISSOR_TEST);
    glEnable(GL_DEPTH_TEST);
    glDepthMask(GL_TRUE);
    glDepthFunc(GL_GREATER);
    glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
    bool whole = false, drawn = draw_part(primary, context, &whole, error);
    glDisable(GL_DEPTH_TEST);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    *done = primary->layer == primary->layer_count;
    if (!whole || context->device->facts.software)
        gpu_finish(context->device); /* else all parts would be waited for at the end, at once */
    learn(primary, clock_now_ns() - start_ns);
    gpu_pop_group(context->device);
    context_span_end(context);
    return drawn && gpu_check(context->device, "rasterising primary hits", error);
}

static const struct gpu_program *rays_program(bool rasterised, struct render_context *context, struct error *error)
{
    struct gpu_define defines[5] = {0};
    size_t n = 0;
    if (rasterised)
        defines[n++] = (struct gpu_define){"VISIBILITY", "1"};
    else if (context->spread)
        defines[n++] = (struct gpu_define){"SPREAD", "1"};
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
        gpu_texture_bind(&primary->visible, UNIT_PASS_0);
        gpu_uniform_uint(program, "first_row", primary->first_row);
    }
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
    gpu_buffer_bind_storage(&context->rays, BIND_RAYS);
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

static bool find_layer(struct render_context *context, const struct wave *wave, bool *done, struct error *error)
{
    *done = true;
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

bool primary_begin_slice(const struct primary *primary, struct render_context *context, struct error *error)
{
    context->ray_count = context->slice.slot_count << context->uniforms.sample_shift;
    context->wave_number = context->asked = context->asking = 0;
    const struct tracer *tracer = context->layer_tracer ? context->layer_tracer : context->tracer;
    context->sampled_hits = !primary && tracer->impl->sampled;
    compact_begin(context);
    context_span_begin(context, STAGE_PRIMARY);
    bool made = make_rays(primary, context, error);
    context_span_end(context);
    return made;
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

static bool has_sort(const struct gpu_scene *scene, enum primitive_sort sort)
{
    uint32_t first;
    for (uint32_t i = 0; i < scene->instance_count; i++)
        if (primitives_of(scene, sort, i, &first) > 0)
            return true;
    return sort == SORT_DISCS && scene->disc_count > 0;
}

void primary_announce(struct render_context *context, bool rasterised)
{
    for (enum primitive_sort sort = 0; rasterised && sort < SORT_COUNT; sort++)
        if (has_sort(context->scene, sort))
            (void)get_program(context, kind_of_sort[sort], has_cutout(context, sort), NULL);
    (void)rays_program(rasterised, context, NULL);
    context->sampled_hits = !rasterised && context->tracer->impl->sampled;
    if (rasterised) {
        (void)fill_program(context, NULL);
    } else {
        const struct wave wave = camera_wave(context);
        wave_announce(context, &wave, true);
    }
}
