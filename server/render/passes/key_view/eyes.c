/* SPDX-License-Identifier: MIT */
/* Eyes of a key view: the hits of their rays in its layers, and the radiance of these. */
#include "render/passes/key_view/eyes.h"

#include "render/light/environment.h"
#include "render/passes/primary/primary.h"
#include "render/waves/compact.h"
#include "render/waves/integrator.h"
#include "shared/layers.h"

#include <epoxy/gl.h>
#include <math.h>
#include <string.h>

/* Samples of a lens that are not traced, beside each that is: gather_views.comp. Of panels before a chequered
 * wall, by software GL, three give 4 samples a pixel the noise of 12 (41.9 dB in place of 36.3, 16 have 44.0) for
 * 14 % more time; seven 0.3 dB more for another 12 %, one 39.9 for 11 %. */
#define LENS_MORE 3

static const struct gpu_program *gather_program(const struct key_eyes *eyes, const struct render_frame *frame,
                                                bool has_unknown, struct error *error)
{
    static const char *const numbers[KEY_LAYERS_MAX + 1] = {"0", "1", "2", "3"};
    const struct integrator *integrator = frame->integrator;
    struct gpu_define defines[9] = {0};
    size_t n = 0;
    defines[n++] = (struct gpu_define){"KEY_LAYERS", numbers[eyes->key->layer_count]};
    if (eyes->what != KEY_GATHER)
        defines[n++] = (struct gpu_define){eyes->what == KEY_GATHER_MARK ? "MARK" : "KEPT", "1"};
    if (eyes->are_found && eyes->what != KEY_GATHER_KEPT)
        defines[n++] = (struct gpu_define){"EYES", "1"};
    if (frame->spread)
        defines[n++] = (struct gpu_define){"SPREAD", "1"};
    if (frame->environment->kind == ENVIRONMENT_IMAGE)
        defines[n++] = (struct gpu_define){"HAS_ENVIRONMENT_IMAGE", "1"};
    if (integrator->left_scene && strcmp(integrator->left_scene, "OPEN") == 0)
        defines[n++] = (struct gpu_define){"OPEN", "1"};
    if (frame->uniforms.lens[0] > 0.0f)
        defines[n++] = (struct gpu_define){"HAS_LENS", "1"};
    if (has_unknown)
        defines[n++] = (struct gpu_define){"HAS_UNKNOWN", "1"};
    return context_use_with(frame->device, "render/gather_views.comp", defines, error);
}

/* How far inverse distances of the structure may be off: pixels / (pixels a radian * radius), as its planes keep.
 */
static float bound_of(const struct key_view *key, const struct quadtree_settings *settings, float half_height)
{
    const float scale = (float)key->texels.height / (2.0f * half_height);
    return key->texels.fov_y > 0.0f ? settings->pixels / (scale * settings->radius) : settings->pixels / scale;
}

static void set_view(const struct key_view *key, const struct quadtree_settings *settings,
                     const struct gpu_program *program)
{
    static const char *const names[] = {"key_right", "key_up", "key_back", "key_eye"};
    const struct trace_view *view = &key->texels;
    const bool orthographic = view->fov_y == 0.0f;
    const float half_height = orthographic ? view->ortho_height / 2.0f : tanf(view->fov_y / 2.0f);
    const float extent[2] = {half_height * (float)view->width / (float)view->height, half_height};
    for (int column = 0; column < 4; column++) {
        const float *m = view->world_from_view + column, values[3] = {m[0], m[4], m[8]};
        gpu_uniform_vec(program, names[column], 3, values);
    }
    gpu_uniform_vec(program, "key_extent", 2, extent);
    gpu_uniform_uint(program, "key_orthographic", orthographic);
    gpu_uniform_uint(program, "key_width", view->width);
    gpu_uniform_uint(program, "key_height", view->height);
    gpu_uniform_float(program, "key_bound", bound_of(key, settings, half_height));
}

static void bind_layers(struct key_view *key, struct gpu_device *device)
{
    static const unsigned units[KEY_LAYERS_MAX] = {UNIT_KEY_LAYER_0, UNIT_KEY_LAYER_1, UNIT_KEY_LAYER_2};
    for (uint32_t i = 0; i < key->layer_count; i++)
        gpu_buffer_bind_texels(device, &key->layers[i], units[i], GL_RGBA32F);
}

static void bind_eyes(const struct key_eyes *eyes, struct render_wave *wave, const struct gpu_program *program)
{
    struct key_view *key = eyes->key;
    uint32_t first_slot = 0;
    struct gpu_buffer *band = picture_slice_band(eyes->picture, &wave->slice, &first_slot);
    if (!eyes->are_found)
        gpu_buffer_bind_texels(wave->device->gpu, &wave->rays, UNIT_RAYS, GL_RGBA32F);
    gpu_buffer_bind_texels(wave->device->gpu, &wave->hits, UNIT_SHADE_HITS,
                           eyes->are_found ? GL_RGBA32F : GL_RGBA32UI);
    gpu_buffer_bind_storage(&wave->slice_sums, BIND_SLICE_SUMS);
    gpu_buffer_bind_storage(&key->counts, BIND_KEY_COUNTS);
    gpu_uniform_uint(program, "first_slot", wave->slice.first_slot);
    if (eyes->what == KEY_GATHER_MARK)
        gpu_buffer_bind_storage(&key->marks, BIND_KEY_MARKS);
    if (eyes->what == KEY_GATHER_KEPT) {
        gpu_buffer_bind_storage(band, BIND_ACCUMULATION);
        gpu_uniform_uint(program, "first_kept", first_slot);
    }
}

static bool gather(const struct key_eyes *eyes, struct render_wave *wave, struct error *error)
{
    struct layers *layers = eyes->layers;
    const uint32_t first_unknown = layers_take_unknown(layers);
    const bool has_unknown = first_unknown != UINT32_MAX;
    const struct gpu_program *program = gather_program(eyes, wave->frame, has_unknown, error);
    if (!program)
        return false;
    context_span_begin(wave->device, STAGE_SHADE);
    context_bind(wave);
    bind_eyes(eyes, wave, program);
    bind_layers(eyes->key, wave->device->gpu);
    if (has_unknown) {
        gpu_buffer_bind_storage(&layers->notes.sums, BIND_LAYER_SUMS);
        gpu_uniform_uint(program, "first_unknown", first_unknown);
    }
    if (wave->frame->uniforms.lens[0] > 0.0f)
        gpu_uniform_uint(program, "lens_more", LENS_MORE);
    set_view(eyes->key, &wave->frame->tracer->options.quadtree, program);
    compact_dispatch(wave, program, WAVE_RAYS);
    context_span_end(wave->device);
    return gpu_check(wave->device->gpu, "gathering from a key view", error);
}

/* ---- as a pass ---- */

/* Other layers of the picture are made from the surfaces that rays hit. */
static bool are_found(const struct key_eyes *eyes, const struct render_frame *frame)
{
    return eyes->what == KEY_GATHER_KEPT ||
           (!(eyes->layers->notes.layers & ~LAYER_BIT_UNKNOWN) && !frame->comparison &&
            tracer_finds_eyes(frame->tracer, frame->scene, &frame->uniforms));
}

void key_eyes_announce(struct key_eyes *eyes, struct render_wave *wave)
{
    eyes->are_found = are_found(eyes, wave->frame);
    if (!eyes->are_found)
        primary_announce(wave, false);
    else if (eyes->what != KEY_GATHER_KEPT)
        (void)primary_find_eyes(wave, NULL);
    (void)gather_program(eyes, wave->frame, eyes->layers->notes.layers & LAYER_BIT_UNKNOWN, NULL);
}

static bool wants(const void *self, const struct render_wave *wave)
{
    (void)self;
    return wave->number == 0 && wave->frame->request.picture.view_source == VIEW_SOURCE_LAYERS;
}

static enum pass_progress begin(struct key_eyes *eyes, struct render_wave *wave, struct error *error)
{
    eyes->are_found = are_found(eyes, wave->frame);
    wave->has_rays = true;
    if (eyes->are_found)
        primary_begin_eyes(wave);
    else if (!primary_begin_traced(wave, error))
        return PASS_FAILED;
    return gpu_check_reset(wave->device->gpu, "rays of eyes", error) ? PASS_MORE : PASS_FAILED;
}

static bool intersect(const struct key_eyes *eyes, struct render_wave *wave, bool *done, struct error *error)
{
    *done = true;
    if (eyes->what == KEY_GATHER_KEPT)
        return true;
    return eyes->are_found ? primary_find_eyes(wave, error) : primary_intersect(wave, done, error);
}

static enum pass_progress run(void *self, struct render_wave *wave, struct error *error)
{
    struct key_eyes *eyes = self;
    bool done = false;
    if (!wave->has_rays)
        return begin(eyes, wave, error);
    if (!intersect(eyes, wave, &done, error))
        return PASS_FAILED;
    if (!done)
        return PASS_MORE;
    const bool gathered =
        gather(eyes, wave, error) && (!eyes->layers->noting || primary_make_surfaces(wave, error));
    return gathered ? PASS_DONE : PASS_FAILED;
}

const struct pass eyes_pass = {.name = "eyes", .wants = wants, .run = run};
