/* SPDX-License-Identifier: MIT */
/* Frames whose eyes are made from a key view's layers (key.h): the choice of the picture that is rendered
 * next. If the kept layers are outdated, each layer is rendered first by the frame's tracer and integrator;
 * then the eyes. */
#include "render/frame/key.h"

#include "render/context/camera.h"
#include "render/frame/check.h"
#include "render/frame/renderer.h"
#include "render/frame/work.h"
#include "render/waves/compact.h"
#include "render/context/request.h"
#include "render/waves/integrator.h"
#include "shared/layers.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define UNKNOWN_WARNED 0.5f /* share of a picture; 50 cm aside in a room, 0.2 to 0.3 are not known */

bool frame_is_from_layers(const struct frame_request *request)
{
    return request->picture.view_source == VIEW_SOURCE_LAYERS;
}

struct frame_camera frame_key_camera(const struct frame_request *request)
{
    return frame_is_from_layers(request) && request->has_key ? request->key_camera : request->camera;
}

/* Only texels that the eyes of this frame see are rendered: other eyes that the layers could serve do not
 * follow. The picture has room for the intersection of one sample a pixel; other points of a lens see other
 * texels. */
static bool is_for_these_eyes(const struct frame_request *request)
{
    return request->sampling.samples == 1 && !request->sampling.accumulate && !request->has_key &&
           request->aperture == 0.0f && frame_request_planes(request) == 1u << LAYER_BEAUTY;
}

static float distance_between(const struct frame_camera *a, const struct frame_camera *b)
{
    float squared = 0.0f;
    for (int i = 0; i < 3; i++) {
        const float way = a->world_from_view[4 * i + 3] - b->world_from_view[4 * i + 3];
        squared += way * way;
    }
    return sqrtf(squared);
}

/* The maximum distance of an eye of the picture from that of the key view. */
static float farthest_eye(const struct frame_request *request)
{
    float eye[2];
    frame_view_eye(request, 0, 0, eye); /* in a corner of the grid */
    const float lens = request->aperture > 0.0f ? request->aperture / 2.0f : 0.0f;
    const float apart = request->has_key ? distance_between(&request->camera, &request->key_camera) : 0.0f;
    return sqrtf(eye[0] * eye[0] + eye[1] * eye[1]) + lens + apart;
}

/* The bound holds for all eyes of the picture. Doubled, so that those of the pictures that follow rarely need
 * another structure. */
static float radius_for(const struct frame_request *request)
{
    const float asked = request->tracer_options.quadtree.radius, farthest = farthest_eye(request) * 1.001f;
    if (!(asked < farthest))
        return asked;
    return asked > 0.0f ? ldexpf(asked, (int)ceilf(log2f(farthest / asked))) : farthest;
}

/* The structure has a texel a pixel, of the picture's own eye. */
static void set_hidden(const struct frame_request *request, struct tracer_options *options)
{
    struct quadtree_settings *settings = &options->quadtree;
    options->quadtree_leaves = 1;
    settings->layers = KEY_LAYERS_MAX;
    settings->radius = request->hidden_radius;
    settings->resolution = 0;
    settings->margin = 0.001f; /* the least that there is */
}

static void set_layers(const struct frame_request *request, struct quadtree_settings *settings)
{
    settings->radius = radius_for(request);
    if (settings->layers == 0 && !is_for_these_eyes(request))
        settings->layers = 1; /* another layer shows little, and would be rendered as a whole */
}

bool frame_key_take(struct frame_renderer *renderer, struct error *error)
{
    const struct frame_request *request = &renderer->request;
    const struct tracer_impl *impl = frame_find_tracer(renderer, TRACER_QUADTREE, "view_source", error);
    struct tracer_options options = request->tracer_options;
    options.quadtree.faces = QUADTREE_FACES_VIEW;
    if (request->hidden_layer)
        set_hidden(request, &options);
    else
        set_layers(request, &options.quadtree);
    if (options.quadtree.hits == QUADTREE_HITS_AUTO)
        options.quadtree.hits = QUADTREE_HITS_PLANE; /* planes also show objects thinner than a texel */
    if (!impl || !tracer_check_motion(impl, &renderer->shared->copy, error))
        return false;
    if (!impl->texel_view || !impl->layer_hits)
        return error_set(error, ERROR_UNSUPPORTED, "view_source", "the tracer %s has no layers to make views of",
                         impl->name);
    struct tracer_set *set = frame_tracers(renderer, impl);
    renderer->key_tracer =
        renderer->tracer->impl == impl && tracer_options_same(&request->tracer_options, &options)
            ? tracer_set_take_again(set, renderer->tracer)
            : tracer_set_take(set, renderer->device, impl, &options, error);
    return renderer->key_tracer &&
           frame_work_trace_by(renderer->work, &renderer->work->key_trace_state, renderer->key_tracer, error);
}

static bool begin_layers(struct frame_renderer *renderer, const struct trace_view *texels, uint32_t layer_count,
                         struct error *error)
{
    struct key_view *key = &renderer->key;
    key->is_made = false;
    picture_restart(&key->sums);
    if (!key_view_reserve(key, renderer->device, texels, layer_count, error))
        return false; /* memory may have been put off: the choice is made again */
    key->is_marked = is_for_these_eyes(&renderer->request);
    if (key->is_marked && !key_view_mark_anew(key, renderer->device, error))
        return false;
    renderer->pass = key->is_marked ? PASS_MARK : 0;
    return true;
}

/* Frames that add to one another have layers with noise of their own each, or that of the first would stay. */
static bool is_noise_new(const struct frame_renderer *renderer)
{
    return !integrator_by_number(renderer->request.light.integrator)->random ||
           renderer->key.first_sample == renderer->eyes_samples_before;
}

/* Chooses which picture the frame needs first. */
static bool choose_first(struct frame_renderer *renderer, struct error *error)
{
    struct key_view *key = &renderer->key;
    struct trace_view texels;
    uint32_t layer_count = 0;
    if (!renderer->key_tracer->impl->texel_view(renderer->key_tracer, &texels, &layer_count))
        return error_set(error, ERROR_INTERNAL, NULL, "%s: the structure of a view tells no layers",
                         renderer->key_tracer->impl->name);
    renderer->eyes_samples_before = renderer->samples_before;
    if (!key_view_count_anew(key, renderer->device, error))
        return false;
    if (!key_view_is_of(key, &renderer->view, &renderer->request, renderer->shared->showing) ||
        !is_noise_new(renderer))
        return begin_layers(renderer, &texels, layer_count, error);
    key->is_marked = false;
    renderer->pass = key->layer_count;
    return true;
}

bool frame_is_layer_pass(const struct frame_renderer *renderer)
{
    return frame_is_from_layers(&renderer->request) && renderer->key_tracer &&
           renderer->pass < renderer->key.layer_count;
}

bool frame_is_mark_pass(const struct frame_renderer *renderer)
{
    return frame_is_from_layers(&renderer->request) && renderer->pass == PASS_MARK;
}

bool frame_is_eyes_pass(const struct frame_renderer *renderer)
{
    return frame_is_from_layers(&renderer->request) && !frame_is_layer_pass(renderer);
}

/* Where only tiles of a layer are rendered. */
static struct frame_tiles tiles_of(struct key_view *key, uint32_t layer)
{
    if (!key->is_marked)
        return (struct frame_tiles){0};
    return (struct frame_tiles){
        .list = &key->tiles,
        .marks = &key->marks,
        .first_tile = key->first_tile[layer],
        .first_mark = layer * key->texels.width * key->texels.height,
    };
}

bool frame_key_set_pass(struct frame_renderer *renderer, struct error *error)
{
    struct frame_work *work = renderer->work;
    if (renderer->request.hidden_layer) { /* the frame's only picture */
        work->frame.trace_state = work->trace_state;
        work->frame.layer_tracer = renderer->key_tracer;
        work->frame.layer = renderer->request.hidden_layer;
        return true;
    }
    if (renderer->pass == PASS_UNKNOWN && !choose_first(renderer, error))
        return false;
    const bool is_layer = frame_is_layer_pass(renderer);
    work->frame.request =
        is_layer ? key_view_layer_request(&renderer->key, &renderer->request) : renderer->request;
    work->frame.tracer = is_layer ? renderer->tracer : renderer->key_tracer;
    work->frame.trace_state = is_layer ? work->trace_state : work->key_trace_state;
    work->frame.layer_tracer = is_layer ? renderer->key_tracer : NULL;
    work->frame.layer = is_layer ? renderer->pass : 0;
    work->frame.tiles = is_layer ? tiles_of(&renderer->key, renderer->pass) : (struct frame_tiles){0};
    work->eyes = (struct key_eyes){
        .key = &renderer->key,
        .layers = &work->layers,
        .picture = &renderer->picture,
        .what = frame_is_mark_pass(renderer) ? KEY_GATHER_MARK
                : renderer->key.is_marked    ? KEY_GATHER_KEPT
                                             : KEY_GATHER,
    };
    renderer->target = is_layer ? &renderer->key.sums : &renderer->picture;
    renderer->samples_before = is_layer ? 0 : renderer->eyes_samples_before;
    slices_ahead_forget(&work->ahead); /* rays of another pass have another cost */
    return true;
}

static uint32_t next_layer(const struct key_view *key, uint32_t layer)
{
    while (layer < key->layer_count && key->is_marked && key->tile_rows[layer] == 0)
        layer++;
    return layer;
}

bool frame_key_end_marks(struct frame_renderer *renderer, struct error *error)
{
    if (!key_view_list_tiles(&renderer->key, renderer->device, error))
        return false;
    renderer->pass = next_layer(&renderer->key, 0);
    return true;
}

void frame_key_limit_rows(const struct frame_renderer *renderer, struct frame_request *request)
{
    if (frame_is_layer_pass(renderer) && renderer->key.is_marked)
        request->picture.height = renderer->key.tile_rows[renderer->pass] * 8;
}

/* Keeps a layer whose samples are all in its sums. */
static enum pass_progress keep(struct frame_renderer *renderer, struct error *error)
{
    struct key_view *key = &renderer->key;
    struct frame_work *work = renderer->work;
    if (!key_view_keep_band(key, &work->frame, renderer->pass, renderer->band, error))
        return PASS_FAILED;
    if (++renderer->band < key->sums.band_count)
        return PASS_MORE;
    renderer->result.primary_rays += (uint64_t)work->frame.request.picture.width *
                                     work->frame.request.picture.height * work->frame.request.sampling.samples;
    picture_restart(&key->sums);
    renderer->pass = next_layer(key, renderer->pass + 1);
    if (renderer->pass < key->layer_count)
        return PASS_REPEAT;
    key->view = renderer->view;
    key->request = renderer->request;
    key->showing = renderer->shared->showing;
    key->is_made = !key->is_marked;
    key->first_sample = renderer->eyes_samples_before;
    return PASS_REPEAT;
}

static bool wants_keep(const void *self, const struct render_wave *wave)
{
    return frame_is_layer_pass(self) && wave->frame->request.sampling.samples > 0;
}

static enum pass_progress run_keep(void *self, struct render_wave *wave, struct error *error)
{
    (void)wave;
    return keep(self, error);
}

const struct pass keep_pass = {.name = "keep", .wants = wants_keep, .run = run_keep};

/* Warns if most of a picture is filled from the background: such a request is hardly meant. */
static void warn_of_unknown(struct structure_row *row, const struct frame_request *request)
{
    if (row->measure < UNKNOWN_WARNED)
        return;
    snprintf(
        row->warning, sizeof(row->warning),
        "no depth layer shows %.0f %% of the picture, whose eyes are up to %.3g m from the view that is rendered "
        "(%s)",
        (double)row->measure * 100.0, (double)farthest_eye(request),
        request->has_key           ? "choose a smaller --upsample"
        : frame_has_views(request) ? "bring the eyes nearer together, or choose --views rays"
                                   : "choose a smaller --aperture, or --lens rays");
}

bool frame_key_report(struct frame_renderer *renderer, struct error *error)
{
    const struct frame_request *request = &renderer->request;
    struct structure_rows *rows = &renderer->result.structure;
    uint32_t unknown = 0;
    if (!trace_state_report(renderer->work->key_trace_state, rows, error))
        return false;
    /* A picture that had all its samples has asked for none. */
    if (renderer->work->frame.request.sampling.samples == 0)
        return true;
    if (!key_view_take_count(&renderer->key, renderer->device, &unknown, error))
        return false;
    const uint64_t samples = (uint64_t)request->picture.width * request->picture.height *
                             renderer->work->frame.request.sampling.samples;
    rows->part = 0;
    rows->part_name = NULL;
    warn_of_unknown(structure_per_ray(rows, "views/unknown", (float)unknown / (float)samples), request);
    return true;
}
