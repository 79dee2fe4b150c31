/* SPDX-License-Identifier: MIT */
/* Layers of a key view: rendered one by one as pictures, all of them or only marked tiles, and kept. */
#include "render/passes/key_view/key_view.h"

#include "render/waves/compact.h"
#include "render/context/request.h"
#include "render/waves/integrator.h"
#include "shared/layers.h"

#include <epoxy/gl.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Samples of a pixel for each of a texel. A pixel's samples, spread by its filter, read four texels each, so
 * a quarter of them in a texel gives the noise of a picture that is rendered with all: for a sharp classroom
 * and 16 samples a squared error of 3.1e-4, rendered 3.2e-4 (as many in a texel: 0.8e-4 for twice the time),
 * beside 2.1e-4 of blurred texels. Through a lens of 10 cm it is 35.6 dB, rendered 33.8. */
#define PIXEL_SAMPLES 4u

bool key_view_is_of(const struct key_view *key, const struct trace_view *view, const struct frame_request *request,
                    uint64_t showing)
{
    return key->is_made && key->showing == showing && memcmp(&key->view, view, sizeof(*view)) == 0 &&
           key->request.sampling.samples == request->sampling.samples &&
           frame_request_same_radiance(&key->request, request);
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
    own.picture.view_source = VIEW_SOURCE_RAYS;
    own.picture.views_across = own.picture.views_down = 0;
    own.picture.baseline = 0.0f;
    own.has_key = false;
    own.picture.width = texels->width;
    own.picture.height = texels->height;
    own.sampling.samples = (request->sampling.samples + PIXEL_SAMPLES - 1) / PIXEL_SAMPLES;
    own.camera.fov_y = texels->fov_y;
    own.camera.ortho_height = texels->ortho_height;
    own.camera.near = texels->near;
    memcpy(own.camera.world_from_view, texels->world_from_view, sizeof(own.camera.world_from_view));
    own.tracing.primary = PRIMARY_TRACE;
    own.aperture = 0.0f;
    own.picture.format = PIXEL_FORMAT_RGBA32F;
    own.ycbcr = YCBCR_NONE;
    own.picture.layers = 1u << LAYER_BEAUTY | 1u << LAYER_DEPTH;
    own.attachments = 0;
    own.sampling.accumulate = false;
    own.picture.denoise = DENOISE_OFF;
    return own;
}

/* ---- layers ---- */

static const struct gpu_program *keep_program(const struct render_frame *frame, struct error *error)
{
    const struct gpu_define defines[] = {{frame->tiles.list ? "HAS_TILES" : NULL, "1"}, {NULL, NULL}};
    return context_use_with(frame->device, "render/keep_layer.comp", defines, error);
}

bool key_view_keep_band(struct key_view *key, const struct render_frame *frame, uint32_t layer, uint32_t band,
                        struct error *error)
{
    struct picture *sums = &key->sums;
    const struct gpu_program *program = keep_program(frame, error);
    if (!program)
        return false;
    uint32_t first_slot = 0;
    const uint32_t slots = picture_band_slots(sums, band, &first_slot);
    context_span_begin(frame->device, STAGE_RESOLVE);
    context_bind_frame(frame);
    gpu_buffer_bind_storage(picture_band(sums, 0, band), BIND_ACCUMULATION); /* the beauty; then the depth */
    gpu_buffer_bind_storage(picture_band(sums, 1, band), BIND_KEY_DEPTHS);
    gpu_buffer_bind_storage(&key->layers[layer], BIND_KEY_LAYER);
    context_bind_tiles(frame, program);
    gpu_uniform_uint(program, "slot_count", slots);
    gpu_uniform_uint(program, "first_slot", first_slot);
    gpu_uniform_float(program, "scale", 1.0f / (float)sums->samples);
    gpu_uniform_uint(program, "shows_environment", layer == 0);
    gpu_dispatch(frame->device->gpu, program, slots);
    context_span_end(frame->device);
    return gpu_check(frame->device->gpu, "keeping a layer", error);
}

/* ---- marks ---- */

bool key_view_mark_anew(struct key_view *key, struct gpu_device *device, struct error *error)
{
    const size_t texels = (size_t)key->texels.width * key->texels.height;
    if (!gpu_buffer_reserve(device, &key->marks, texels * key->layer_count * sizeof(uint32_t), error))
        return false;
    gpu_buffer_clear(device, &key->marks, 0);
    /* Where rounding takes a texel that is not marked: it must be a number. */
    for (uint32_t i = 0; i < key->layer_count; i++)
        gpu_buffer_clear(device, &key->layers[i], 0);
    return true;
}

static bool is_tile_marked(const uint32_t *marks, const struct trace_view *texels, uint32_t x, uint32_t y)
{
    const uint32_t end_x = x + 8 < texels->width ? x + 8 : texels->width;
    const uint32_t end_y = y + 8 < texels->height ? y + 8 : texels->height;
    uint32_t any = 0;
    for (uint32_t j = y; j < end_y; j++)
        for (uint32_t i = x; i < end_x; i++)
            any |= marks[(size_t)j * texels->width + i];
    return any != 0;
}

/* Behind those that are marked ones beyond the layer, to the end of a row. Returns how many in all. */
static uint32_t list_tiles(const uint32_t *marks, const struct trace_view *texels, uint32_t *tiles)
{
    const uint32_t across = (texels->width + 7) / 8, down = (texels->height + 7) / 8;
    uint32_t count = 0;
    for (uint32_t tile = 0; tile < across * down; tile++)
        if (is_tile_marked(marks, texels, tile % across * 8, tile / across * 8))
            tiles[count++] = tile;
    while (count % across != 0)
        tiles[count++] = across * down;
    return count;
}

bool key_view_list_tiles(struct key_view *key, struct gpu_device *device, struct error *error)
{
    const struct trace_view *texels = &key->texels;
    const uint32_t across = (texels->width + 7) / 8, down = (texels->height + 7) / 8;
    const size_t mark_bytes = (size_t)texels->width * texels->height * sizeof(uint32_t);
    uint32_t *marks = malloc(mark_bytes), count = 0;
    uint32_t *tiles = malloc((size_t)across * down * key->layer_count * sizeof(uint32_t));
    bool good = marks && tiles;
    for (uint32_t layer = 0; good && layer < key->layer_count; layer++) {
        gpu_buffer_read(device, &key->marks, layer * mark_bytes, marks, mark_bytes);
        key->first_tile[layer] = count;
        key->tile_rows[layer] = list_tiles(marks, texels, tiles + count) / across;
        count += key->tile_rows[layer] * across;
    }
    good = good ? gpu_buffer_upload(device, &key->tiles, tiles, (count ? count : 1) * sizeof(uint32_t), error)
                : error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for the tiles of a key view");
    free(marks);
    free(tiles);
    return good;
}

/* ---- counts ---- */

bool key_view_count_anew(struct key_view *key, struct gpu_device *device, struct error *error)
{
    gpu_readback_drop(&key->copy);
    if (!gpu_buffer_reserve(device, &key->counts, sizeof(uint32_t), error))
        return false;
    gpu_buffer_clear(device, &key->counts, 0);
    return true;
}

bool key_view_copy_count(struct key_view *key, struct gpu_device *device, struct error *error)
{
    return gpu_readback_copy(device, &key->copy, &key->counts, 0, sizeof(uint32_t), error) &&
           gpu_readback_fence(&key->copy, error);
}

bool key_view_take_count(struct key_view *key, struct gpu_device *device, uint32_t *unknown, struct error *error)
{
    return gpu_readback_take(device, &key->copy, unknown, error);
}

uint64_t key_view_device_bytes(const struct key_view *key)
{
    uint64_t sum = picture_device_bytes(&key->sums) + key->counts.capacity_bytes + key->marks.capacity_bytes +
                   key->tiles.capacity_bytes + key->copy.capacity_bytes;
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
    gpu_buffer_finish(device, &key->tiles);
    gpu_readback_finish(device, &key->copy);
    *key = (struct key_view){0};
}
