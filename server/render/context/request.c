/* SPDX-License-Identifier: MIT */
/* Planes of a request's picture and their bytes, and what two requests have in common. */
#include "render/context/request.h"

#include "shared/layers.h"

#include <math.h>
#include <string.h>

uint32_t frame_request_layers(const struct frame_request *request)
{
    return request->layers ? request->layers : 1u << LAYER_BEAUTY;
}

bool frame_request_is_first_sample(enum layer layer)
{
    return layer == LAYER_DEPTH || layer == LAYER_POSITION || layer == LAYER_ID || layer == LAYER_MOTION;
}

bool frame_request_is_light(enum layer layer)
{
    return 1u << layer & LAYER_BITS_LIGHT;
}

uint32_t frame_request_planes(const struct frame_request *request)
{
    return frame_request_layers(request) |
           (request->attachments & 1u << ATTACHMENT_DEPTH ? 1u << LAYER_DEPTH : 0) |
           (request->attachments & 1u << ATTACHMENT_NORMALS ? 1u << LAYER_NORMAL : 0) |
           (request->attachments & 1u << ATTACHMENT_STICKING ? 1u << LAYER_STICKING : 0);
}

uint32_t frame_format_bytes(unsigned format)
{
    switch (format) {
    case PIXEL_FORMAT_RGBA8:
    case PIXEL_FORMAT_DEPTH32F:
    case PIXEL_FORMAT_NORMAL8:
    case PIXEL_FORMAT_SHARE8:
        return 4;
    case PIXEL_FORMAT_RGBA16F:
        return 8;
    case PIXEL_FORMAT_RGBA32F:
        return 16;
    }
    return 0;
}

unsigned frame_request_plane_format(const struct frame_request *request, enum layer layer)
{
    if (request->attachments & 1u << ATTACHMENT_DEPTH && layer == LAYER_DEPTH)
        return PIXEL_FORMAT_DEPTH32F;
    if (request->attachments & 1u << ATTACHMENT_NORMALS && layer == LAYER_NORMAL)
        return PIXEL_FORMAT_NORMAL8;
    if (layer == LAYER_STICKING)
        return PIXEL_FORMAT_SHARE8;
    return request->format;
}

uint64_t frame_request_plane_bytes(const struct frame_request *request, enum layer layer, uint32_t rows)
{
    if (layer == LAYER_BEAUTY && request->ycbcr != YCBCR_NONE)
        return (uint64_t)ycbcr_row_bytes(request->width) * ycbcr_row_count(rows);
    return (uint64_t)request->width * rows * frame_format_bytes(frame_request_plane_format(request, layer));
}

uint64_t frame_request_bytes(const struct frame_request *request)
{
    uint64_t bytes = 0;
    for (uint32_t left = frame_request_planes(request); left; left &= left - 1)
        bytes += frame_request_plane_bytes(request, (enum layer)__builtin_ctz(left), request->height);
    return bytes;
}

static bool same_camera(const struct frame_camera *a, const struct frame_camera *b)
{
    return memcmp(a->world_from_view, b->world_from_view, sizeof(a->world_from_view)) == 0 &&
           a->fov_y == b->fov_y && a->ortho_height == b->ortho_height && a->near == b->near;
}

static bool same_views(const struct frame_request *a, const struct frame_request *b)
{
    return a->views_across == b->views_across && a->views_down == b->views_down && a->baseline == b->baseline &&
           a->eyes_over == b->eyes_over && a->view_source == b->view_source && a->has_key == b->has_key &&
           (!a->has_key || same_camera(&a->key_camera, &b->key_camera));
}

static bool same_neighbours(const struct frame_request *a, const struct frame_request *b)
{
    return a->has_neighbours == b->has_neighbours &&
           (!a->has_neighbours ||
            (a->clips_time_s == b->clips_time_s && same_camera(&a->camera_earlier, &b->camera_earlier) &&
             same_camera(&a->camera_later, &b->camera_later)));
}

static bool same_tracer(const struct frame_request *a, const struct frame_request *b)
{
    return a->tracer == b->tracer && tracer_options_same(&a->tracer_options, &b->tracer_options) &&
           a->primary == b->primary && a->compare == b->compare;
}

float frame_request_radiance_limit(const struct frame_request *request)
{
    return request->clamp * exp2f(-request->exposure_stops);
}

/* Whether or not the integrator asks for them. */
static bool same_light(const struct frame_request *a, const struct frame_request *b)
{
    return a->integrator == b->integrator && a->brdf == b->brdf &&
           frame_request_radiance_limit(a) == frame_request_radiance_limit(b) &&
           a->ao_distance == b->ao_distance && a->ao_falloff == b->ao_falloff && a->ao_rays == b->ao_rays &&
           a->layer_opacity == b->layer_opacity && a->wireframe == b->wireframe &&
           memcmp(&a->ground, &b->ground, sizeof(a->ground)) == 0;
}

bool frame_request_hides_environment(const struct frame_request *request)
{
    return request->background != BACKGROUND_ENVIRONMENT;
}

bool frame_request_same_radiance(const struct frame_request *a, const struct frame_request *b)
{
    return a->depth == b->depth && a->seed == b->seed && same_light(a, b) && same_tracer(a, b) &&
           frame_request_hides_environment(a) == frame_request_hides_environment(b);
}

bool frame_request_goes_on(const struct frame_request *request)
{
    return request->accumulate || request->noise > 0.0f;
}

bool frame_request_adds_to(const struct frame_request *a, const struct frame_request *b)
{
    return a->accumulate && b->accumulate && !b->starts_anew && a->width == b->width && a->height == b->height &&
           memcmp(&a->crop, &b->crop, sizeof(a->crop)) == 0 && same_views(a, b) &&
           frame_request_same_radiance(a, b) && a->aperture == b->aperture && a->focus == b->focus &&
           a->filter == b->filter && same_camera(&a->camera, &b->camera) && same_neighbours(a, b) &&
           frame_request_planes(a) == frame_request_planes(b) && a->denoise == b->denoise && a->noise == b->noise;
}
