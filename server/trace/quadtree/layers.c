/* SPDX-License-Identifier: MIT */
/* Draws the layers of each face, part by part. */
#include "trace/quadtree/layers.h"

#include "base/clock.h"
#include "shared/path.h"
#include "trace/quadtree/faces.h"

#include <epoxy/gl.h>
#include <stdlib.h>
#include <string.h>

/* Formats by the number of layers in a pass. */
static const GLenum formats_of_depths[] = {0, GL_DEPTH_COMPONENT32F, GL_RG32F, GL_RGBA32F};

bool quadtree_layers_begin(struct quadtree_layers *layers, struct quadtree_store *store, struct error *error)
{
    const struct quadtree_uniforms *u = &store->uniforms;
    layers->store = store;
    layers->face = layers->layer = 0;
    layers->begun = false;
    layers->pass_layers = store->device->facts.fetches_framebuffer ? u->layers : 1;
    const GLenum formats[2] = {formats_of_depths[layers->pass_layers], GL_DEPTH_COMPONENT32F};
    for (uint32_t i = 0; i < (layers->pass_layers < u->layers ? 2 : 1); i++)
        if (!gpu_texture_reserve(store->device, &layers->depths[i], formats[i], u->padded_width, u->padded_height,
                                 error))
            return false;
    return true;
}

static bool add_span(struct quadtree_layers *layers, struct raster_span span, struct error *error)
{
    struct raster_span *last = layers->span_count > 0 ? &layers->spans[layers->span_count - 1] : NULL;
    if (last && last->instance == span.instance && last->end == span.first) {
        last->end = span.end;
        return true;
    }
    if (layers->span_count == layers->span_capacity) {
        const uint32_t capacity = layers->span_capacity > 0 ? 2 * layers->span_capacity : 64;
        struct raster_span *larger = realloc(layers->spans, capacity * sizeof(*larger));
        if (!larger)
            return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for what a face may see");
        layers->spans = larger;
        layers->span_capacity = capacity;
    }
    layers->spans[layers->span_count++] = span;
    return true;
}

/* Adds the runs of an instance that the face may see. */
static bool add_spans(struct quadtree_layers *layers, const struct gpu_scene *scene,
                      const struct raster_camera *camera, uint32_t instance, struct error *error)
{
    const uint32_t count = quadtree_runs_of(&layers->store->runs, scene, instance);
    bool good = true;
    for (uint32_t run = 0; good && run < count; run++)
        if (!quadtree_is_run_beside(camera, &layers->store->runs, scene, instance, run))
            good = add_span(layers, quadtree_run_span(&layers->store->runs, scene, instance, run), error);
    return good;
}

static bool begin_face(struct quadtree_layers *layers, const struct gpu_scene *scene, struct error *error)
{
    const struct raster_camera camera = quadtree_face_camera(&layers->store->uniforms, layers->face);
    struct frame_uniforms *uniforms = &layers->uniforms;
    *uniforms = (struct frame_uniforms){.sample_places = {{0.5f, 0.5f}}};
    raster_camera_fill(uniforms, &camera);
    layers->span_count = 0;
    for (uint32_t i = 0; i < scene->instance_count; i++)
        if (!quadtree_is_beside(&camera, scene, i) && !add_spans(layers, scene, &camera, i, error))
            return false;
    return gpu_buffer_upload(layers->store->device, &layers->frame, uniforms, sizeof(*uniforms), error);
}

static void clear(const struct quadtree_layers *layers)
{
    static const GLuint nothing[4] = {VISIBLE_NOTHING};
    static const GLfloat farthest[4] = {0.0f};
    const GLint count = (GLint)layers->pass_layers;
    glDisable(GL_SCISSOR_TEST); /* glClear() would heed scissor and mask */
    glDepthMask(GL_TRUE);
    for (GLint i = 0; i < count; i++)
        glClearNamedFramebufferuiv(layers->framebuffer.name, GL_COLOR, i, nothing);
    if (count > 1)
        glClearNamedFramebufferfv(layers->framebuffer.name, GL_COLOR, count, farthest);
    else
        glClearNamedFramebufferfv(layers->framebuffer.name, GL_DEPTH, 0, farthest);
}

static bool begin_pass(struct quadtree_layers *layers, const struct gpu_scene *scene, struct error *error)
{
    struct quadtree_store *store = layers->store;
    if (layers->layer == 0 && !begin_face(layers, scene, error))
        return false;
    const struct gpu_texture *depths = &layers->depths[layers->layer & 1];
    const struct gpu_layer_target target = {
        .colours = &store->visible,
        .first = layers->face * store->uniforms.layers + layers->layer,
        .count = layers->pass_layers,
        .last = layers->pass_layers > 1 ? depths : NULL,
        .depth = layers->pass_layers > 1 ? NULL : depths,
    };
    gpu_framebuffer_finish(store->device, &layers->framebuffer);
    if (!gpu_framebuffer_create_layers(store->device, &layers->framebuffer, &target, error))
        return false;
    clear(layers);
    raster_view_begin(&layers->drawing);
    layers->begun = true;
    return true;
}

static bool draw_part(struct quadtree_layers *layers, struct gpu_scene *scene, bool *whole, struct error *error)
{
    const struct raster_view_target target = {
        .device = layers->store->device,
        .scene = scene,
        .frame = &layers->uniforms,
        .layers = layers->pass_layers,
        .has_before = layers->layer > 0,
        .spans = layers->spans,
        .span_count = layers->span_count,
    };
    gpu_scene_bind(scene);
    gpu_buffer_bind_uniform(&layers->frame, UNIFORM_FRAME);
    gpu_texture_bind(&layers->depths[~layers->layer & 1], UNIT_QUADTREE_DEPTH);
    glBindFramebuffer(GL_FRAMEBUFFER, layers->framebuffer.name);
    glViewport(0, 0, (GLsizei)layers->store->uniforms.width, (GLsizei)layers->store->uniforms.height);
    bool drawn = raster_view_draw(&layers->drawing, &target, whole, error);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    return drawn;
}

static bool continue_pass(struct quadtree_layers *layers, struct gpu_scene *scene, struct error *error)
{
    const uint64_t start_ns = clock_now_ns();
    bool whole = false;
    if ((!layers->begun && !begin_pass(layers, scene, error)) || !draw_part(layers, scene, &whole, error))
        return false;
    if (!whole) {
        gpu_finish(layers->store->device); /* otherwise the end would wait for all parts at once */
        raster_view_learn(&layers->drawing, clock_now_ns() - start_ns, STEP_NS);
        return true;
    }
    layers->begun = false;
    layers->layer += layers->pass_layers;
    if (layers->layer == layers->store->uniforms.layers) {
        layers->layer = 0;
        layers->face++;
    }
    return true;
}

enum tracer_progress quadtree_layers_step(struct quadtree_layers *layers, struct gpu_scene *scene, bool at_once,
                                          struct error *error)
{
    struct gpu_device *device = layers->store->device;
    const uint64_t end_ns = at_once ? STEP_WITHOUT_END : clock_now_ns() + STEP_BATCH_NS;
    bool good = true;
    gpu_push_group(device, "layers of the view");
    while (good && layers->face < layers->store->uniforms.faces) {
        good = continue_pass(layers, scene, error);
        if (step_is_over(end_ns))
            break;
    }
    gpu_pop_group(device);
    if (!good || !gpu_check(device, "drawing the layers of a view", error))
        return TRACER_FAILED;
    return layers->face < layers->store->uniforms.faces ? TRACER_MORE : TRACER_DONE;
}

void quadtree_layers_finish(struct quadtree_layers *layers)
{
    if (layers->store) {
        struct gpu_device *device = layers->store->device;
        gpu_framebuffer_finish(device, &layers->framebuffer);
        for (int i = 0; i < 2; i++)
            gpu_texture_finish(device, &layers->depths[i]);
        gpu_buffer_finish(device, &layers->frame);
    }
    free(layers->spans);
    *layers = (struct quadtree_layers){0};
}

uint64_t quadtree_layers_bytes(const struct quadtree_layers *layers)
{
    return layers->depths[0].size_bytes + layers->depths[1].size_bytes + layers->frame.capacity_bytes;
}
