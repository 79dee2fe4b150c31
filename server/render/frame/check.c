/* SPDX-License-Identifier: MIT */
/* Refuses frames that cannot be rendered, with the reason and the remedy. */
#include "render/frame/check.h"

#include "render/context/camera.h"
#include "render/waves/integrator.h"
#include "shared/key_view.h"
#include "shared/layers.h"

#include <math.h>

#define SIZE_MAX_PIXELS 16384u /* width and height; keeps the number of a pixel in 32 bits */

/* ---- the request alone: what the ranges of its records, which the protocol holds, leave open ---- */

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
    return true;
}

/* Surfaces of pictures made from layers are those of the key view. */
static bool check_rendered(const struct frame_request *request, const char *what, struct error *error)
{
    if (request->picture.view_source != VIEW_SOURCE_LAYERS)
        return true;
    error_set(error, ERROR_UNSUPPORTED, "layers", "pictures that are made of depth layers have no %s", what);
    return error_remedy(error, "render all views and frames as they are, or leave out %s", what);
}

static bool check_light_layers(const struct frame_request *request, struct error *error)
{
    if (!integrator_by_number(request->light.integrator)
             ->scatters) { /* else a sample has several paths, or no light */
        error_set(error, ERROR_UNSUPPORTED, "layers",
                  "the integrator %s does not tell the parts of its light apart",
                  integrator_by_number(request->light.integrator)->name);
        return error_remedy(error, "choose distributed or path, or leave out layers of light");
    }
    return check_rendered(request, "layers of light", error);
}

static bool check_layers(const struct frame_request *request, struct error *error)
{
    if (request->picture.layers & ~LAYER_BITS_ALL) {
        error_set(error, ERROR_UNSUPPORTED, "layers", "there is no layer number %d",
                  __builtin_ctz(request->picture.layers & ~LAYER_BITS_ALL));
        return error_remedy(error, "leave it out, or ask a newer daemon");
    }
    if (frame_request_layers(request) != 1u << LAYER_BEAUTY && request->picture.format != PIXEL_FORMAT_RGBA32F) {
        error_set(error, ERROR_UNSUPPORTED, "layers", "layers beside the beauty need the format rgba32f");
        return error_remedy(error, "ask for rgba32f, or leave out layers");
    }
    if (request->picture.layers & LAYER_BITS_LIGHT && !check_light_layers(request, error))
        return false;
    if (request->picture.layers & LAYER_BIT_MOTION && !check_rendered(request, "motion", error))
        return false;
    if (request->attachments >= 1u << ATTACHMENT_COUNT)
        return error_set(error, ERROR_UNSUPPORTED, "attachments", "there is no such set of attachments: %#x",
                         request->attachments);
    if (request->attachments && frame_request_layers(request) != 1u << LAYER_BEAUTY)
        return error_set(error, ERROR_UNSUPPORTED, "attachments", "they go with the beauty alone");
    if (request->ycbcr != YCBCR_NONE &&
        (request->picture.format != PIXEL_FORMAT_RGBA8 || frame_request_layers(request) != 1u << LAYER_BEAUTY))
        return error_set(error, ERROR_UNSUPPORTED, "format", "Y'CbCr is made of the beauty alone, as rgba8");
    return true;
}

/* Checks the views, and where they come from. */
static bool check_views(const struct frame_request *request, struct error *error)
{
    const uint32_t across = request->picture.views_across ? request->picture.views_across : 1;
    const uint32_t down = request->picture.views_down ? request->picture.views_down : 1;
    if (request->picture.width % across || request->picture.height % down)
        return error_set(error, ERROR_INVALID, request->picture.width % across ? "views_across" : "views_down",
                         "%u x %u views do not fill %ux%u pixels", across, down, request->picture.width,
                         request->picture.height);
    if (request->picture.view_source == VIEW_SOURCE_LAYERS && request->comparison.compare)
        return error_set(error, ERROR_UNSUPPORTED, "compare",
                         "views made from layers are not traced by a second tracer; compare rendered ones");
    if (request->hidden_layer >= KEY_LAYERS_MAX)
        return error_set(error, ERROR_INVALID, "hidden_layers", "layer %u; there are %u", request->hidden_layer,
                         KEY_LAYERS_MAX - 1);
    if (request->hidden_layer &&
        (request->picture.view_source == VIEW_SOURCE_LAYERS || request->comparison.compare ||
         request->sampling.accumulate || request->aperture > 0.0f || frame_has_views(request)))
        return error_set(error, ERROR_UNSUPPORTED, "hidden_layers",
                         "what is hidden is a picture of its own, through the middle of pixels, of one eye");
    return true;
}

static bool check_noise(const struct frame_request *request, struct error *error)
{
    if (request->sampling.noise > 0.0f && request->comparison.compare)
        return error_set(error, ERROR_UNSUPPORTED, "noise", "all waves are compared; give a number of samples");
    if (request->sampling.noise > 0.0f && request->picture.view_source == VIEW_SOURCE_LAYERS)
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
    if (ground->radius > 0.0f && request->picture.view_source == VIEW_SOURCE_LAYERS)
        return error_set(error, ERROR_UNSUPPORTED, "ground",
                         "pictures made from layers have none; render them as they are");
    return true;
}

static bool check_crop(const struct frame_request *request, struct error *error)
{
    const struct record_picture *p = &request->picture;
    if (p->crop_width == 0 && p->crop_height == 0)
        return true;
    if (p->crop_width == 0 || p->crop_height == 0 || p->crop_x >= p->width || p->crop_y >= p->height ||
        p->crop_width > p->width - p->crop_x || p->crop_height > p->height - p->crop_y)
        return error_set(error, ERROR_INVALID, "crop", "%ux%u pixels from (%u, %u) on are not in %ux%u pixels",
                         p->crop_width, p->crop_height, p->crop_x, p->crop_y, p->width, p->height);
    if (request->sampling.noise > 0.0f || request->picture.denoise != DENOISE_OFF || request->attachments ||
        request->ycbcr != YCBCR_NONE || frame_has_views(request) ||
        request->picture.view_source == VIEW_SOURCE_LAYERS)
        return error_set(error, ERROR_UNSUPPORTED, "crop",
                         "a part of a picture has one view, a number of samples, and no filter for noise");
    return true;
}

static bool check_alone(const struct frame_request *request, struct error *error)
{
    if (request->picture.width == 0 || request->picture.height == 0 || request->picture.width > SIZE_MAX_PIXELS ||
        request->picture.height > SIZE_MAX_PIXELS)
        return error_set(error, ERROR_INVALID, "width", "a picture of %ux%u pixels; 1 to %u are possible",
                         request->picture.width, request->picture.height, SIZE_MAX_PIXELS);
    return check_noise(request, error) && check_crop(request, error) && check_ground(request, error) &&
           check_views(request, error) && check_layers(request, error) && check_camera(request, error);
}

/* ---- with tracers and scene ---- */

const struct tracer_impl *frame_find_tracer(const struct frame_renderer *renderer, unsigned number,
                                            const char *field, struct error *error)
{
    bool stands_in = renderer->stand_in && renderer->stand_in_number == number;
    return stands_in ? renderer->stand_in : tracer_find(number, field, error);
}

bool frame_check_request(const struct frame_renderer *renderer, const struct frame_request *request,
                         struct error *error)
{
    return check_alone(request, error) && frame_find_tracer(renderer, request->tracing.tracer, "tracer", error) &&
           (!request->comparison.compare ||
            frame_find_tracer(renderer, request->comparison.compare_with, "compare_with", error));
}

/* Whether a node of surfaces is in a light group. */
static bool has_grouped_surfaces(const struct gpu_scene *copy)
{
    for (uint32_t i = 0; i < copy->instance_count; i++)
        if (copy->instances[i].flags >> INSTANCE_LIGHT_GROUP_SHIFT & INSTANCE_LIGHT_GROUP_MASK)
            return true;
    return false;
}

/* A surface that glows is in the group of its node, which stored samples do not hold. */
bool frame_check_groups(const struct frame_renderer *renderer, struct error *error)
{
    struct frame_work *work = renderer->work;
    if (!(work->frame.request.picture.layers & LAYER_BITS_LIGHT_GROUPS) || !work->frame.tracer->impl->sampled ||
        !has_grouped_surfaces(work->frame.scene))
        return true;
    error_set(error, ERROR_UNSUPPORTED, "layers",
              "the samples of the tracer %s do not tell which node glows, and surfaces are in light groups",
              work->frame.tracer->impl->name);
    return error_remedy(error,
                        "choose bvh or another tracer of triangles, or put lights and the environment alone "
                        "into groups");
}

/* A display's values are no light that adds up. */
bool frame_check_light(const struct scene *scene, const struct frame_request *request, struct error *error)
{
    if (!(request->picture.layers & LAYER_BITS_LIGHT) || !scene->environment.value.display_values)
        return true;
    error_set(error, ERROR_UNSUPPORTED, "layers",
              "the light of this scene is a display's values, which do not add up");
    return error_remedy(error, "leave out layers of light");
}

bool frame_has_motion_layer(const struct frame_renderer *renderer)
{
    return frame_request_layers(&renderer->request) & LAYER_BIT_MOTION;
}

/* Stored samples do not know the object that they are part of. */
bool frame_check_moves(const struct frame_renderer *renderer, struct error *error)
{
    const struct tracer_impl *impl = renderer->tracer->impl;
    if (!frame_has_motion_layer(renderer) || !renderer->work->layers.moves.has_any ||
        renderer->work->primary.rasterises || !impl->sampled)
        return true;
    error_set(error, ERROR_UNSUPPORTED, "layers", "the samples that %s holds do not say what moves them",
              impl->name);
    return error_remedy(error, "rasterise first hits, take another tracer, or leave out motion");
}
