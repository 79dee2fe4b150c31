/* SPDX-License-Identifier: MIT */
/* Planes of a request's picture and their bytes, and what two requests have in common. */
#include "render/context/request.h"

#include "base/same.h"
#include "shared/layers.h"

#include <math.h>
#include <string.h>

struct frame_crop frame_request_crop(const struct frame_request *request)
{
    const struct record_picture *picture = &request->picture;
    if (!frame_request_is_cropped(request))
        return (struct frame_crop){0, 0, picture->width, picture->height};
    return (struct frame_crop){picture->crop_x, picture->crop_y, picture->crop_width, picture->crop_height};
}

bool frame_request_is_cropped(const struct frame_request *request)
{
    return request->picture.crop_width > 0;
}

uint32_t frame_request_layers(const struct frame_request *request)
{
    return request->picture.layers ? request->picture.layers : 1u << LAYER_BEAUTY;
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
    return request->picture.format;
}

uint64_t frame_request_plane_bytes(const struct frame_request *request, enum layer layer, uint32_t rows)
{
    if (layer == LAYER_BEAUTY && request->ycbcr != YCBCR_NONE)
        return (uint64_t)ycbcr_row_bytes(request->picture.width) * ycbcr_row_count(rows);
    return (uint64_t)request->picture.width * rows *
           frame_format_bytes(frame_request_plane_format(request, layer));
}

uint64_t frame_request_bytes(const struct frame_request *request)
{
    uint64_t bytes = 0;
    for (uint32_t left = frame_request_planes(request); left; left &= left - 1)
        bytes += frame_request_plane_bytes(request, (enum layer)__builtin_ctz(left), request->picture.height);
    return bytes;
}

static bool same_camera(const struct frame_camera *a, const struct frame_camera *b)
{
    return memcmp(a->world_from_view, b->world_from_view, sizeof(a->world_from_view)) == 0 &&
           a->fov_y == b->fov_y && a->ortho_height == b->ortho_height && a->near == b->near;
}

static bool same_key(const struct frame_request *a, const struct frame_request *b)
{
    return a->has_key == b->has_key && (!a->has_key || same_camera(&a->key_camera, &b->key_camera));
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
    return a->tracing.tracer == b->tracing.tracer && tracer_options_same(&a->tracer_options, &b->tracer_options) &&
           a->tracing.primary == b->tracing.primary && a->comparison.compare == b->comparison.compare;
}

float frame_request_radiance_limit(const struct frame_request *request)
{
    return request->light.clamp * exp2f(-request->picture.exposure_stops);
}

/* Whether or not the integrator asks for them. */
static bool same_light(const struct frame_request *a, const struct frame_request *b)
{
    struct record_lighting light_a = a->light, light_b = b->light;
    light_a.clamp = frame_request_radiance_limit(a);
    light_b.clamp = frame_request_radiance_limit(b);
    return record_same_lighting(&light_a, &light_b) && a->picture.wireframe == b->picture.wireframe &&
           memcmp(&a->ground, &b->ground, sizeof(a->ground)) == 0;
}

bool frame_request_hides_environment(const struct frame_request *request)
{
    return request->picture.background != BACKGROUND_ENVIRONMENT;
}

bool frame_request_same_radiance(const struct frame_request *a, const struct frame_request *b)
{
    return a->sampling.seed == b->sampling.seed && same_light(a, b) && same_tracer(a, b) &&
           frame_request_hides_environment(a) == frame_request_hides_environment(b);
}

bool frame_request_is_open_ended(const struct frame_request *request)
{
    return request->sampling.accumulate || request->sampling.noise > 0.0f;
}

/* The members that the sum of the samples depends on: not those for its display. */
static struct record_picture summed_picture(const struct frame_request *request)
{
    struct record_picture picture = request->picture;
    picture.layers = frame_request_planes(request);
    picture.background = frame_request_hides_environment(request);
    memset(picture.background_colour, 0, sizeof(picture.background_colour));
    picture.format = picture.tone_map = picture.upsample = 0;
    picture.exposure_stops = 0.0f;
    picture.ground = 0; /* request->ground counts */
    picture.ground_up_x = picture.ground_up_y = picture.ground_up_z = 0.0f;
    return picture;
}

static struct record_sampling summed_sampling(const struct frame_request *request)
{
    struct record_sampling sampling = request->sampling;
    sampling.samples = sampling.accumulate = 0;
    return sampling;
}

bool frame_request_adds_to(const struct frame_request *a, const struct frame_request *b)
{
    const struct record_picture picture_a = summed_picture(a), picture_b = summed_picture(b);
    const struct record_sampling sampling_a = summed_sampling(a), sampling_b = summed_sampling(b);
    return a->sampling.accumulate && b->sampling.accumulate && !b->starts_anew &&
           record_same_picture(&picture_a, &picture_b) && record_same_sampling(&sampling_a, &sampling_b) &&
           same_key(a, b) && frame_request_same_radiance(a, b) && a->aperture == b->aperture &&
           a->focus == b->focus && same_camera(&a->camera, &b->camera) && same_neighbours(a, b);
}
