/* SPDX-License-Identifier: MIT */
#include "render/key_view.h"

#include "render/compact.h"
#include "render/frame_request.h"
#include "render/integrators/integrator.h"
#include "shared/layers.h"

#include <epoxy/gl.h>
#include <math.h>
#include <string.h>

bool key_view_is_of(const struct key_view *key, const struct trace_view *view, const struct frame_request *request,
                    uint64_t showing)
{
    return key->is_made && key->showing == showing && memcmp(&key->view, view, sizeof(*view)) == 0 &&
           key->request.samples == request->samples && frame_request_same_radiance(&key->request, request);
}

bool key_view_reserve(struct key_view *key, struct gpu_device *device, const struct trace_view *texels,
                      uint32_t layer_count, struct error *error)
{
    const uint64_t bytes = (uint64_t)texels->width * texels->height * sizeof(vec4);
    if (layer_count == 0 || layer_count > KEY_LAYERS_MAX)
        return error_set(error, ERROR_INTERNAL, NULL, "a key view of %u layers", layer_count);
    if (bytes > device->facts.storage_block_bytes_max ||
        bytes / sizeof(vec4) > device->facts.texture_buffer_texels_max)
        return error_set(error, ERROR_LIMIT, "quadtree_resolution",
                         "a key view of %ux%u texels is larger than a buffer of this device; fewer are possible",
                         texels->width, texels->height);
    for (uint32_t i = 0; i < layer_count; i++)
        if (!gpu_buffer_reserve(device, &key->layers[i], (size_t)bytes, error))
            return false;
    key->texels = *texels;
    key->layer_count = layer_count;
    return true;
}

struct frame_request key_view_layer_request(const struct key_view *key, const struct frame_request *request)
{
    const struct trace_view *texels = &key->texels;
    struct frame_request own = *request;
    own.view_source = VIEW_SOURCE_RAYS;
    own.views_across = own.views_down = 0;
    own.baseline = 0.0f;
    own.has_key = false;
    own.width = texels->width;
    own.height = texels->height;
    own.camera.fov_y = texels->fov_y;
    own.camera.ortho_height = texels->ortho_height;
    own.camera.near = texels->near;
    memcpy(own.camera.world_from_view, texels->world_from_view, sizeof(own.camera.world_from_view));
    own.primary = PRIMARY_TRACE;
    own.aperture = 0.0f;
    own.format = PIXEL_FORMAT_RGBA32F;
    own.ycbcr = YCBCR_NONE;
    own.layers = 1u << LAYER_BEAUTY | 1u << LAYER_DEPTH;
    own.attachments = 0;
    own.accumulate = false;
    return own;
}

/* ---- layers ---- */

bool key_view_keep_band(struct key_view *key, struct render_context *context, uint32_t layer, uint32_t band,
                        struct error *error)
{
    struct picture *sums = &key->sums;
    const struct gpu_program *program = context_use(context, "render/keep_layer.comp", error);
    if (!program)
        return false;
    const uint32_t texels = picture_band_row_count(sums, band) * sums->width;
    context_span_begin(context, STAGE_RESOLVE);
    context_bind(context);
    gpu_buffer_bind_storage(picture_band(sums, 0, band), BIND_ACCUMULATION); /* the beauty; then the depth */
    gpu_buffer_bind_storage(picture_band(sums, 1, band), BIND_KEY_DEPTHS);
    gpu_buffer_bind_storage(&key->layers[layer], BIND_KEY_LAYER);
    gpu_uniform_uint(program, "texel_count", texels);
    gpu_uniform_uint(program, "first_texel", picture_band_first_row(sums, band) * sums->width);
    gpu_uniform_float(program, "scale", 1.0f / (float)sums->samples);
    gpu_uniform_uint(program, "shows_environment", layer == 0);
    gpu_dispatch(context->device, program, texels);
    context_span_end(context);
    return gpu_check(context->device, "keeping a layer", error);
}

/* ---- eyes ---- */

bool key_view_mark_anew(struct key_view *key, struct gpu_device *device, struct error *error)
{
    const size_t texels = (size_t)key->texels.width * key->texels.height;
    if (!gpu_buffer_reserve(device, &key->marks, texels * key->layer_count * sizeof(uint32_t), error))
        return false;
    gpu_buffer_clear(device, &key->marks, 0);
    return true;
}

void key_view_take_marks(struct key_view *key, struct gpu_device *device)
{
    struct key_counts counts;
    gpu_buffer_read(device, &key->counts, 0, &counts, sizeof(counts));
    key->looked_at = 1;
    for (uint32_t i = 1; i < key->layer_count; i++)
        key->looked_at |= counts.is_looked_at[i] << i;
}

static const struct gpu_program *gather_program(struct render_context *context, bool has_unknown,
                                                enum key_gather what, struct error *error)
{
    const struct integrator *integrator = integrator_by_number(context->request.integrator);
    struct gpu_define defines[5] = {0};
    size_t n = 0;
    if (what != KEY_GATHER)
        defines[n++] = (struct gpu_define){what == KEY_GATHER_MARK ? "MARK" : "KEPT", "1"};
    if (context->environment->kind == ENVIRONMENT_IMAGE)
        defines[n++] = (struct gpu_define){"HAS_ENVIRONMENT_IMAGE", "1"};
    if (integrator->left_scene && strcmp(integrator->left_scene, "OPEN") == 0)
        defines[n++] = (struct gpu_define){"OPEN", "1"};
    if (has_unknown)
        defines[n++] = (struct gpu_define){"HAS_UNKNOWN", "1"};
    return context_use_with(context, "render/gather_views.comp", defines, error);
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
    gpu_uniform_uint(program, "key_layers", key->layer_count);
    gpu_uniform_float(program, "key_bound", bound_of(key, settings, half_height));
}

static void bind_layers(struct key_view *key, struct gpu_device *device)
{
    static const unsigned units[KEY_LAYERS_MAX] = {UNIT_KEY_LAYER_0, UNIT_KEY_LAYER_1, UNIT_KEY_LAYER_2};
    for (uint32_t i = 0; i < KEY_LAYERS_MAX; i++) /* those that are not there are not read */
        gpu_buffer_bind_texels(device, &key->layers[i < key->layer_count ? i : 0], units[i], GL_RGBA32F);
}

static void bind_eyes(struct key_view *key, struct render_context *context, const struct picture *picture,
                      enum key_gather what, const struct gpu_program *program)
{
    uint32_t first_slot = 0;
    struct gpu_buffer *band = picture_slice_band(picture, &context->slice, &first_slot);
    gpu_buffer_bind_texels(context->device, &context->rays, UNIT_RAYS, GL_RGBA32F);
    gpu_buffer_bind_texels(context->device, &context->hits, UNIT_SHADE_HITS, GL_RGBA32UI);
    gpu_buffer_bind_storage(&context->slice_sums, BIND_SLICE_SUMS);
    gpu_buffer_bind_storage(&key->counts, BIND_KEY_COUNTS);
    if (what == KEY_GATHER_MARK)
        gpu_buffer_bind_storage(&key->marks, BIND_KEY_MARKS);
    if (what == KEY_GATHER_KEPT) {
        gpu_buffer_bind_storage(band, BIND_ACCUMULATION);
        gpu_uniform_uint(program, "first_slot", first_slot);
    }
}

bool key_view_gather(struct key_view *key, struct render_context *context, struct layers *layers,
                     const struct picture *picture, enum key_gather what, struct error *error)
{
    const uint32_t first_unknown = layers_take_unknown(layers);
    const bool has_unknown = first_unknown != UINT32_MAX;
    const struct gpu_program *program = gather_program(context, has_unknown, what, error);
    if (!program)
        return false;
    context_span_begin(context, STAGE_SHADE);
    context_bind(context);
    bind_eyes(key, context, picture, what, program);
    bind_layers(key, context->device);
    if (has_unknown) {
        gpu_buffer_bind_storage(&layers->sums, BIND_LAYER_SUMS);
        gpu_uniform_uint(program, "first_unknown", first_unknown);
    }
    set_view(key, &context->tracer->options.quadtree, program);
    compact_dispatch(context, program, WAVE_RAYS);
    context_span_end(context);
    return gpu_check(context->device, "gathering from a key view", error);
}

void key_view_announce(struct render_context *context, bool has_unknown, enum key_gather what)
{
    (void)gather_program(context, has_unknown, what, NULL);
}

/* ---- counts ---- */

bool key_view_count_anew(struct key_view *key, struct gpu_device *device, struct error *error)
{
    gpu_readback_drop(&key->copy);
    if (!gpu_buffer_reserve(device, &key->counts, sizeof(struct key_counts), error))
        return false;
    gpu_buffer_clear(device, &key->counts, 0);
    return true;
}

bool key_view_copy_count(struct key_view *key, struct gpu_device *device, struct error *error)
{
    return gpu_readback_copy(device, &key->copy, &key->counts, sizeof(uint32_t), error) &&
           gpu_readback_fence(&key->copy, error);
}

bool key_view_take_count(struct key_view *key, struct gpu_device *device, uint32_t *unknown, struct error *error)
{
    return gpu_readback_take(device, &key->copy, unknown, error);
}

uint64_t key_view_device_bytes(const struct key_view *key)
{
    uint64_t sum = picture_device_bytes(&key->sums) + key->counts.capacity_bytes +
                   key->marks.capacity_bytes + key->copy.capacity_bytes;
    for (int i = 0; i < KEY_LAYERS_MAX; i++)
        sum += key->layers[i].capacity_bytes;
    return sum;
}

void key_view_finish(struct key_view *key, struct gpu_device *device)
{
    picture_finish(&key->sums, device);
    for (int i = 0; i < KEY_LAYERS_MAX; i++)
        gpu_buffer_finish(device, &key->layers[i]);
    gpu_buffer_finish(device, &key->counts);
    gpu_buffer_finish(device, &key->marks);
    gpu_readback_finish(device, &key->copy);
    *key = (struct key_view){0};
}
