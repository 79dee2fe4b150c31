/* SPDX-License-Identifier: MIT */
#include "render/context/request.h"

#include "render/waves/integrator.h"
#include "render/picture/picture.h"
#include "shared/key_view.h"
#include "shared/layers.h"

#include <math.h>
#include <string.h>

#define SIZE_MAX_PIXELS 16384u /* width and height; keeps the number of a pixel in 32 bits */
#define AO_RAYS_MAX 65536u     /* keeps the number of a sample's rays in 32 bits */

/* `fields`: of its transform, its angle and its height. */
static bool check_view(const struct frame_camera *camera, const char *const fields[3], struct error *error)
{
    for (int i = 0; i < 12; i++)
        if (!isfinite(camera->world_from_view[i]))
            return error_set(error, ERROR_INVALID, fields[0], "its transform is not finite");
    if (!(camera->fov_y >= 0.0f && camera->fov_y < 3.14159f))
        return error_set(error, ERROR_INVALID, fields[1], "%g radians; 0 to below pi are possible",
                         (double)camera->fov_y);
    if (camera->fov_y == 0.0f && !(camera->ortho_height > 0.0f && isfinite(camera->ortho_height)))
        return error_set(error, ERROR_INVALID, fields[2], "an orthographic camera of height %g",
                         (double)camera->ortho_height);
    return true;
}

static bool check_camera(const struct frame_request *request, struct error *error)
{
    static const char *const own[3] = {"camera", "camera.fov_y", "camera.height"};
    static const char *const key[3] = {"key_camera", "key_camera.fov_y", "key_camera.height"};
    if (!check_view(&request->camera, own, error) ||
        (request->has_key && !check_view(&request->key_camera, key, error)))
        return false;
    if (!(request->aperture >= 0.0f && isfinite(request->aperture)))
        return error_set(error, ERROR_INVALID, "aperture", "a lens of %g metres", (double)request->aperture);
    if (!(request->focus >= 0.0f && isfinite(request->focus)))
        return error_set(error, ERROR_INVALID, "focus", "%g metres; 0 and more are possible",
                         (double)request->focus);
    return true;
}

static bool check_background(const struct frame_request *request, struct error *error)
{
    if (request->background >= BACKGROUND_COUNT)
        return error_set(error, ERROR_UNSUPPORTED, "background", "there is no background number %u",
                         (unsigned)request->background);
    for (int c = 0; c < 3; c++)
        if (!(request->background_colour[c] >= 0.0f && request->background_colour[c] <= 1.0f))
            return error_set(error, ERROR_INVALID, "background_colour", "%g; 0 to 1 are possible",
                             (double)request->background_colour[c]);
    return true;
}

static bool check_integrator(const struct frame_request *request, struct error *error)
{
    if (!integrator_by_number(request->integrator))
        return error_set(error, ERROR_UNSUPPORTED, "integrator", "there is no integrator number %u",
                         (unsigned)request->integrator);
    if (request->brdf > BRDF_WARD)
        return error_set(error, ERROR_UNSUPPORTED, "brdf", "there is no reflection model number %u",
                         (unsigned)request->brdf);
    if (!(request->clamp >= 0.0f && isfinite(request->clamp)))
        return error_set(error, ERROR_INVALID, "clamp", "%g; 0 and more are possible", (double)request->clamp);
    if (!(request->ao_distance >= 0.0f && isfinite(request->ao_distance)))
        return error_set(error, ERROR_INVALID, "ao_distance", "%g metres; 0 and more are possible",
                         (double)request->ao_distance);
    if (!(request->ao_falloff >= 0.0f && isfinite(request->ao_falloff)))
        return error_set(error, ERROR_INVALID, "ao_falloff", "a power of %g; 0 and more are possible",
                         (double)request->ao_falloff);
    if (request->ao_rays > AO_RAYS_MAX)
        return error_set(error, ERROR_INVALID, "ao_rays", "%u rays a sample; up to %u are possible",
                         request->ao_rays, AO_RAYS_MAX);
    if (!(request->layer_opacity >= 0.0f && request->layer_opacity <= 1.0f))
        return error_set(error, ERROR_INVALID, "layer_opacity", "%g; 0 to 1 are possible",
                         (double)request->layer_opacity);
    return true;
}

uint32_t frame_request_layers(const struct frame_request *request)
{
    return request->layers ? request->layers : 1u << LAYER_BEAUTY;
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

/* Their surfaces are those of the key view. */
static bool check_rendered(const struct frame_request *request, const char *what, struct error *error)
{
    if (request->view_source != VIEW_SOURCE_LAYERS)
        return true;
    error_set(error, ERROR_UNSUPPORTED, "layers", "pictures that are made of depth layers have no %s", what);
    return error_remedy(error, "render all views and frames as they are, or leave out %s", what);
}

static bool check_light_layers(const struct frame_request *request, struct error *error)
{
    if (!integrator_by_number(request->integrator)->scatters) { /* else a sample has several paths, or no light */
        error_set(error, ERROR_UNSUPPORTED, "layers",
                  "the integrator %s does not tell the parts of its light apart",
                  integrator_by_number(request->integrator)->name);
        return error_remedy(error, "choose distributed or path, or leave out layers of light");
    }
    return check_rendered(request, "layers of light", error);
}

static bool check_layers(const struct frame_request *request, struct error *error)
{
    if (request->layers & ~LAYER_BITS_ALL) {
        error_set(error, ERROR_UNSUPPORTED, "layers", "there is no layer number %d",
                  __builtin_ctz(request->layers & ~LAYER_BITS_ALL));
        return error_remedy(error, "leave it out, or ask a newer daemon");
    }
    if (frame_request_layers(request) != 1u << LAYER_BEAUTY && request->format != PIXEL_FORMAT_RGBA32F) {
        error_set(error, ERROR_UNSUPPORTED, "layers", "layers beside the beauty need the format rgba32f");
        return error_remedy(error, "ask for rgba32f, or leave out layers");
    }
    if (request->layers & LAYER_BITS_LIGHT && !check_light_layers(request, error))
        return false;
    if (request->layers & LAYER_BIT_MOTION && !check_rendered(request, "motion", error))
        return false;
    if (request->attachments >= 1u << ATTACHMENT_COUNT)
        return error_set(error, ERROR_UNSUPPORTED, "attachments", "there is no such set of attachments: %#x",
                         request->attachments);
    if (request->attachments && frame_request_layers(request) != 1u << LAYER_BEAUTY)
        return error_set(error, ERROR_UNSUPPORTED, "attachments", "they go with the beauty alone");
    if (request->ycbcr != YCBCR_NONE &&
        (request->format != PIXEL_FORMAT_RGBA8 || frame_request_layers(request) != 1u << LAYER_BEAUTY))
        return error_set(error, ERROR_UNSUPPORTED, "format", "Y'CbCr is made of the beauty alone, as rgba8");
    return true;
}

/* Of views and of where they come from. */
static bool check_views(const struct frame_request *request, struct error *error)
{
    const uint32_t across = request->views_across ? request->views_across : 1;
    const uint32_t down = request->views_down ? request->views_down : 1;
    if (request->width % across || request->height % down)
        return error_set(error, ERROR_INVALID, request->width % across ? "views_across" : "views_down",
                         "%u x %u views do not fill %ux%u pixels", across, down, request->width, request->height);
    if (!(request->baseline >= 0.0f && isfinite(request->baseline)))
        return error_set(error, ERROR_INVALID, "baseline", "%g metres; 0 and more are possible",
                         (double)request->baseline);
    if (request->view_source == VIEW_SOURCE_LAYERS && request->compare)
        return error_set(error, ERROR_UNSUPPORTED, "compare",
                         "views made from layers are not traced by a second tracer; compare rendered ones");
    if (request->hidden_layer >= KEY_LAYERS_MAX)
        return error_set(error, ERROR_INVALID, "hidden_layers", "layer %u; there are %u", request->hidden_layer,
                         KEY_LAYERS_MAX - 1);
    if (request->hidden_layer && (request->view_source == VIEW_SOURCE_LAYERS || request->compare ||
                                  request->accumulate || request->aperture > 0.0f || frame_has_views(request)))
        return error_set(error, ERROR_UNSUPPORTED, "hidden_layers",
                         "what is hidden is a picture of its own, through the middle of pixels, of one eye");
    return true;
}

static bool check_noise(const struct frame_request *request, struct error *error)
{
    if (!(request->noise >= 0.0f && request->noise <= 1.0f))
        return error_set(error, ERROR_INVALID, "noise", "an error of %g; 0 to 1 are possible",
                         (double)request->noise);
    if (request->noise > 0.0f && request->compare)
        return error_set(error, ERROR_UNSUPPORTED, "noise", "all waves are compared; give a number of samples");
    if (request->noise > 0.0f && request->view_source == VIEW_SOURCE_LAYERS)
        return error_set(error, ERROR_UNSUPPORTED, "noise",
                         "pictures made from layers have a number of samples; render them as they are");
    return true;
}

static bool check_ground(const struct frame_request *request, struct error *error)
{
    const struct frame_ground *ground = &request->ground;
    for (int i = 0; i < 3; i++)
        if (!isfinite(ground->centre_world[i]) || !isfinite(ground->normal_world[i]))
            return error_set(error, ERROR_INVALID, "ground", "its centre or its normal is not finite");
    if (!(ground->radius >= 0.0f && isfinite(ground->radius)))
        return error_set(error, ERROR_INVALID, "ground", "a radius of %g metres", (double)ground->radius);
    if (ground->radius > 0.0f && request->view_source == VIEW_SOURCE_LAYERS)
        return error_set(error, ERROR_UNSUPPORTED, "ground",
                         "pictures made from layers have none; render them as they are");
    return true;
}

static bool check_crop(const struct frame_request *request, struct error *error)
{
    const struct frame_crop *crop = &request->crop;
    if (crop->width == 0 && crop->height == 0)
        return true;
    if (crop->width == 0 || crop->height == 0 || crop->x >= request->width || crop->y >= request->height ||
        crop->width > request->width - crop->x || crop->height > request->height - crop->y)
        return error_set(error, ERROR_INVALID, "crop", "%ux%u pixels from (%u, %u) on are not in %ux%u pixels",
                         crop->width, crop->height, crop->x, crop->y, request->width, request->height);
    if (request->noise > 0.0f || request->denoise != DENOISE_OFF || request->attachments ||
        request->ycbcr != YCBCR_NONE || frame_has_views(request) || request->view_source == VIEW_SOURCE_LAYERS)
        return error_set(error, ERROR_UNSUPPORTED, "crop",
                         "a part of a picture has one view, a number of samples, and no filter for noise");
    return true;
}

bool frame_request_check(const struct frame_request *request, struct error *error)
{
    if (request->width == 0 || request->height == 0 || request->width > SIZE_MAX_PIXELS ||
        request->height > SIZE_MAX_PIXELS)
        return error_set(error, ERROR_INVALID, "width", "a picture of %ux%u pixels; 1 to %u are possible",
                         request->width, request->height, SIZE_MAX_PIXELS);
    if (request->samples == 0)
        return error_set(error, ERROR_INVALID, "samples", "a picture of no samples");
    if (request->filter > FILTER_BOX)
        return error_set(error, ERROR_UNSUPPORTED, "pixel_filter", "there is no pixel filter number %u",
                         (unsigned)request->filter);
    if (request->format > PIXEL_FORMAT_RGBA32F)
        return error_set(error, ERROR_UNSUPPORTED, "format", "there is no pixel format number %u",
                         (unsigned)request->format);
    return check_noise(request, error) && check_crop(request, error) && check_ground(request, error) &&
           check_views(request, error) && check_background(request, error) && check_integrator(request, error) &&
           check_layers(request, error) && check_camera(request, error);
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
