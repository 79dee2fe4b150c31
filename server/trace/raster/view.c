/* SPDX-License-Identifier: MIT */
/* Draws a view's surfaces in parts, sort by sort, each part as long as a step allows. */
#include "trace/raster/view.h"

#include "gpu/program.h"
#include "trace/raster/weight.h"

#include <epoxy/gl.h>
#include <math.h>
#include <string.h>

/* Near distance as a share of the scene's diagonal: small enough that it never cuts anything. Reversed
 * floating-point depth stays precise however small it is. */
#define NEAR_OF_DIAGONAL 1e-5f

/* Vertices per part, or pixels that cost as much, times step_scale: at most what takes some ten milliseconds, and
 * fewer where a part takes longer than a step should, as on a busy machine. A part has a fixed cost, so parts are
 * no smaller than needed. */
#define DRAW_VERTICES_MAX (3u << 16)
#define DRAW_VERTICES_FIRST (3u << 15) /* before anything is known of the scene */
#define DRAW_VERTICES_MIN (3u << 12)

enum primitive_kind { PRIMITIVE_TRIANGLES, PRIMITIVE_SPHERES, PRIMITIVE_DISCS };
static const unsigned vertices_per_primitive[] = {3, 36, 6};
/* Pixels that software GL draws in the time of a vertex, of plain triangles and of primitives whose shader decides
 * whether and where they are seen. */
#define PIXELS_A_VERTEX 64.0f
#define PIXELS_A_VERTEX_DECIDED 6.0f

float raster_near(const struct gpu_scene *scene, float near, bool orthographic)
{
    if (near > 0.0f || orthographic)
        return fmaxf(near, 0.0f);
    return fmaxf(scene->diagonal > 0.0f && isfinite(scene->diagonal) ? scene->diagonal * NEAR_OF_DIAGONAL : 1e-4f,
                 1e-6f);
}

void raster_camera_fill(struct frame_uniforms *uniforms, const struct raster_camera *camera)
{
    memcpy(uniforms->world_from_view, camera->world_from_view, sizeof(camera->world_from_view));
    uniforms->extent_near[0] = camera->extent[0];
    uniforms->extent_near[1] = camera->extent[1];
    uniforms->extent_near[2] = camera->near;
    uniforms->extent_near[3] = camera->orthographic ? 1.0f : 0.0f;
    uniforms->far_width[0] = camera->far;
    uniforms->width = uniforms->view_width = camera->width;
    uniforms->height = uniforms->view_height = camera->height;
    uniforms->tiles_across = (camera->width + 7) / 8;
}

static const struct gpu_program *get_program(struct gpu_device *device, enum primitive_kind kind, bool cutout,
                                             uint32_t layers, struct error *error)
{
    static const char *const numbers[] = {"0", "1", "2", "3"};
    struct gpu_define defines[6] = {
        {"PRIMITIVE_KIND", numbers[kind]}, {"HAS_SPHERES", "1"}, /* costs nothing where it is not called */
    };
    size_t n = 2;
    if (cutout)
        defines[n++] = (struct gpu_define){"HAS_CUTOUT", "1"};
    if (layers == 1)
        defines[n++] = (struct gpu_define){"HAS_LAYERS", "1"};
    if (layers > 1) {
        defines[n++] = (struct gpu_define){"K_BUFFER", numbers[layers]};
        defines[n++] = (struct gpu_define){"EXTENSION", "GL_EXT_shader_framebuffer_fetch"};
    }
    const struct gpu_program_source source = {
        .vertex = "raster/view.vert", .fragment = "raster/view.frag", .defines = defines};
    return gpu_program_get(device, &source, error);
}

/* Sorts of primitives, drawn one after the other, each with a program of its own. */
enum primitive_sort { SORT_WHOLE, SORT_WITH_HOLES, SORT_DISCS, SORT_SPHERES, SORT_COUNT };
static const enum primitive_kind kind_of_sort[SORT_COUNT] = {PRIMITIVE_TRIANGLES, PRIMITIVE_TRIANGLES,
                                                             PRIMITIVE_DISCS, PRIMITIVE_SPHERES};

/* Number of primitives of a sort in an instance (all discs count as one), and the first of them. */
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

static bool has_cutout(const struct gpu_scene *scene, enum primitive_sort sort)
{
    return sort == SORT_WITH_HOLES || (sort != SORT_WHOLE && scene->has_cutout);
}

/* The next span to draw of a sort; end 0: this span has none. */
static struct raster_span span_of(const struct raster_view *view, const struct raster_view_target *target,
                                  uint32_t *first_primitive)
{
    const enum primitive_sort sort = (enum primitive_sort)view->sort;
    const bool is_part = target->spans && sort != SORT_DISCS;
    struct raster_span span = {.instance = view->span};
    if (is_part)
        span = target->spans[view->span];
    const uint32_t count = primitives_of(target->scene, sort, span.instance, first_primitive);
    if (!is_part || span.end > count)
        span.end = count;
    return span;
}

/* Takes from the budget as many of `count` primitives of an instance from `first` on, or discs, as fit into it.
 * `some`: takes at least one. Returns their number. */
static uint32_t take_some(const struct raster_view_target *target, const struct raster_sight *sight,
                          enum primitive_sort sort, uint32_t first, uint32_t count, bool some, float *budget)
{
    const enum primitive_kind kind = kind_of_sort[sort];
    const bool decided = kind != PRIMITIVE_TRIANGLES || has_cutout(target->scene, sort) || target->layers > 0;
    uint32_t taken = 0;
    while (taken < count) {
        const uint32_t at = first + taken;
        const float pixels = kind == PRIMITIVE_DISCS ? raster_pixels_of_disc(sight, &target->scene->discs[at])
                                                     : raster_pixels_of_run(sight, at / GEOMETRY_RUN);
        const float each =
            (float)vertices_per_primitive[kind] + pixels / (decided ? PIXELS_A_VERTEX_DECIDED : PIXELS_A_VERTEX);
        const uint32_t run = kind == PRIMITIVE_DISCS ? 1 : GEOMETRY_RUN - at % GEOMETRY_RUN;
        const uint32_t left = count - taken < run ? count - taken : run;
        const float fitting = *budget / each;
        const uint32_t part = fitting >= (float)left ? left : fitting >= 1.0f ? (uint32_t)fitting : 0;
        const uint32_t drawn = part > 0 || !some || taken > 0 ? part : 1;
        taken += drawn;
        *budget -= each * (float)drawn;
        if (drawn < left)
            break;
    }
    return taken;
}

/* Continues a sort where the last part ended; *budget returns the vertices left. */
static bool draw_sort(struct raster_view *view, const struct raster_view_target *target,
                      struct raster_sight *sight, float *budget, struct error *error)
{
    const struct gpu_scene *scene = target->scene;
    enum primitive_sort sort = (enum primitive_sort)view->sort;
    enum primitive_kind kind = kind_of_sort[sort];
    uint32_t end = sort == SORT_DISCS ? 1 : target->spans ? target->span_count : scene->instance_count;
    const struct gpu_program *program = NULL;
    for (; view->span < end; view->span++, view->primitive = 0) {
        uint32_t first;
        const struct raster_span span = span_of(view, target, &first);
        if (span.first + view->primitive >= span.end)
            continue;
        const uint32_t begin = span.first + view->primitive, count = span.end - begin;
        first += begin;
        if (!program &&
            !(program = get_program(target->device, kind, has_cutout(scene, sort), target->layers, error)))
            return false;
        if (sort != SORT_DISCS)
            raster_sight_take(sight, scene, span.instance);
        const uint32_t part = take_some(target, sight, sort, begin, count, !view->has_some, budget);
        view->has_some |= part > 0;
        if (sort == SORT_SPHERES) /* the picture's y points down, which reverses every winding */
            glFrontFace(scene->instances[span.instance].flags & INSTANCE_MIRRORED ? GL_CCW : GL_CW);
        gpu_uniform_uint(program, "instance_index", span.instance);
        gpu_uniform_uint(program, "first_primitive", first);
        gpu_uniform_uint(program, "first_row", target->first_row);
        gpu_uniform_uint(program, "layer", target->sample);
        if (target->layers == 1)
            gpu_uniform_uint(program, "has_before", target->has_before);
        gpu_program_use(target->device, program);
        if (part > 0)
            glDrawArrays(GL_TRIANGLES, 0, (GLsizei)(part * vertices_per_primitive[kind]));
        view->primitive += part;
        if (part < count) {
            *budget = 0.0f;
            return true;
        }
    }
    view->span = 0;
    view->sort++;
    return true;
}

static bool draw_sorts(struct raster_view *view, const struct raster_view_target *target, float budget,
                       struct error *error)
{
    struct raster_sight sight;
    bool drawn = true;
    raster_sight_begin(&sight, target->frame);
    view->has_some = false;
    while (drawn && budget > 0.0f && view->sort < SORT_COUNT) {
        if (view->sort == SORT_SPHERES) { /* the inner sides of a sphere's box exist also when the eye is in the
                                             box */
            glEnable(GL_CULL_FACE);
            glCullFace(GL_FRONT);
        }
        drawn = draw_sort(view, target, &sight, &budget, error);
        glDisable(GL_CULL_FACE);
    }
    return drawn;
}

void raster_view_begin(struct raster_view *view)
{
    view->sort = SORT_WHOLE;
    view->span = view->primitive = 0;
}

bool raster_view_draw(struct raster_view *view, const struct raster_view_target *target, bool *whole,
                      struct error *error)
{
    if (view->part_vertices == 0)
        view->part_vertices = DRAW_VERTICES_FIRST;
    const uint32_t budget = view->part_vertices * target->device->facts.step_scale;
    glDisable(GL_BLEND);
    glDisable(GL_SCISSOR_TEST);
    glDisable(GL_CULL_FACE);
    if (target->layers < 2)
        glEnable(GL_DEPTH_TEST);
    else
        glDisable(GL_DEPTH_TEST);
    glDepthMask(GL_TRUE);
    glDepthFunc(GL_GREATER);
    glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
    bool drawn = draw_sorts(view, target, (float)budget, error);
    glDisable(GL_DEPTH_TEST);
    *whole = view->sort == SORT_COUNT;
    return drawn;
}

void raster_view_learn(struct raster_view *view, uint64_t took_ns, uint64_t step_ns)
{
    if (took_ns > step_ns && view->part_vertices > DRAW_VERTICES_MIN)
        view->part_vertices /= 2;
    else if (took_ns < step_ns / 8 && view->part_vertices < DRAW_VERTICES_MAX)
        view->part_vertices *= 2;
}

static bool has_sort(const struct gpu_scene *scene, enum primitive_sort sort)
{
    uint32_t first;
    for (uint32_t i = 0; i < scene->instance_count; i++)
        if (primitives_of(scene, sort, i, &first) > 0)
            return true;
    return sort == SORT_DISCS && scene->disc_count > 0;
}

void raster_view_announce(struct gpu_device *device, const struct gpu_scene *scene)
{
    for (enum primitive_sort sort = 0; sort < SORT_COUNT; sort++)
        if (has_sort(scene, sort))
            (void)get_program(device, kind_of_sort[sort], has_cutout(scene, sort), 0, NULL);
}
