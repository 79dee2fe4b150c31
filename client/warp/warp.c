/* SPDX-License-Identifier: MIT */
/* Contexts: key views, and warping them to other views. */
#include "warp/warp.h"

#include "warp/check.h"
#include "warp/pool.h"
#include "warp/trace.h"
#include "warp/tree.h"

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

/* Distance in texels that avoids smeared colours at edges; it helps most where the background is plain, and
 * costs nothing elsewhere. */
#define SMEARED_BACK 0.5f

struct fl_warp {
    struct warp_pool *pool;
    struct warp_layer layers[FL_WARP_LAYERS_MAX];
    uint32_t layer_count; /* 0: there is no key view */
    struct fl_warp_camera camera;
    float unit, radius, pixels, off_pixels; /* off_pixels: effect of w_error for an eye at the radius */
    float w_error;
    bool is_smeared;
    float *scratch; /* an array for each thread */
    uint64_t build_ns;
};

/* ---- contexts ---- */

struct fl_warp *fl_warp_create(unsigned threads, struct fl_warp_error *error)
{
    if (threads < 1 || threads > FL_WARP_THREADS_MAX) {
        warp_error_set(error, FL_WARP_ERROR_ARGUMENT, "threads", "%u is not between 1 and %u", threads,
                       FL_WARP_THREADS_MAX);
        return NULL;
    }
    struct fl_warp *warp = calloc(1, sizeof(*warp));
    if (!warp) {
        warp_error_set(error, FL_WARP_ERROR_MEMORY, "threads", "there is no memory for a context");
        return NULL;
    }
    warp->pool = warp_pool_create(threads);
    if (!warp->pool) {
        warp_error_set(error, FL_WARP_ERROR_SYSTEM, "threads", "%u threads cannot be started", threads);
        fl_warp_destroy(warp);
        return NULL;
    }
    return warp;
}

/* Frees the layers from `first` on. */
static void forget_layers(struct warp_layer layers[FL_WARP_LAYERS_MAX], uint32_t first)
{
    for (uint32_t l = first; l < FL_WARP_LAYERS_MAX; l++)
        warp_layer_finish(&layers[l]);
}

void fl_warp_destroy(struct fl_warp *warp)
{
    if (!warp)
        return;
    warp_pool_destroy(warp->pool);
    forget_layers(warp->layers, 0);
    free(warp->scratch);
    free(warp);
}

/* ---- key views ---- */

/* A row of parts of one layer, or of several. */
struct build {
    struct fl_warp *warp;
    uint32_t layer;
    struct warp_rectangle parts;
};

static void build_row(void *context, unsigned item, unsigned worker)
{
    const struct build *build = context;
    const uint32_t rows = build->parts.bottom - build->parts.top;
    struct warp_layer *layer = &build->warp->layers[build->layer + item / rows];
    warp_layer_build(layer, build->parts.top + item % rows, build->parts.left, build->parts.right,
                     build->warp->scratch + worker * warp_layer_scratch(layer));
}

/* Copies shares of sticking; texels without them get 0. */
static void copy_sticking(struct warp_layer *layer, const uint8_t *sticking,
                          const struct warp_rectangle *rectangle)
{
    const size_t width = rectangle->right - rectangle->left;
    if (!sticking && !layer->sticks)
        return;
    if (!layer->sticks)
        memset(layer->sticking, 0, (size_t)layer->padded_width * layer->padded_height);
    layer->sticks = true;
    for (uint32_t y = rectangle->top; y < rectangle->bottom; y++) {
        uint8_t *row = layer->sticking + (size_t)y * layer->padded_width + rectangle->left;
        if (sticking)
            memcpy(row, sticking + (y - rectangle->top) * width, width);
        else
            memset(row, 0, width);
    }
}

static void copy_texels(struct warp_layer *layer, const struct fl_warp_layer *texels,
                        const struct warp_rectangle *rectangle)
{
    const size_t width = rectangle->right - rectangle->left;
    for (uint32_t y = rectangle->top; y < rectangle->bottom; y++) {
        const size_t to = (size_t)y * layer->padded_width + rectangle->left, from = (y - rectangle->top) * width;
        memcpy(layer->colours + to, texels->colours + from, width * sizeof(*layer->colours));
        memcpy(layer->w + to, texels->w + from, width * sizeof(*layer->w));
    }
    copy_sticking(layer, texels->sticking, rectangle);
}

static float focal_of(const struct fl_warp_camera *camera, uint32_t height)
{
    return 0.5f * (float)height / tanf(0.5f * camera->fov_y);
}

/* Allocates missing layers of the key view's size; existing ones of this size are kept. */
static bool have_layers(struct fl_warp *warp, const struct fl_warp_key *key, struct fl_warp_error *error)
{
    struct warp_layer layers[FL_WARP_LAYERS_MAX] = {{0}};
    const bool fits = warp->layers[0].width == key->width && warp->layers[0].height == key->height;
    uint32_t first = 0;
    while (fits && first < key->layer_count && warp->layers[first].w)
        first++;
    bool done = true;
    for (uint32_t l = first; l < key->layer_count && done; l++)
        done = warp_layer_init(&layers[l], key->width, key->height);
    float *scratch = fits ? warp->scratch : NULL;
    if (done && !fits)
        scratch = calloc(warp_pool_threads(warp->pool) * warp_layer_scratch(&layers[0]), sizeof(*scratch));
    if (!done || !scratch) {
        forget_layers(layers, 0);
        if (!fits)
            free(scratch);
        return warp_error_set(error, FL_WARP_ERROR_MEMORY, "size",
                              "there is no memory for %u layers of %ux%u texels", key->layer_count, key->width,
                              key->height);
    }
    if (!fits) {
        forget_layers(warp->layers, 0);
        free(warp->scratch);
        warp->scratch = scratch;
    }
    for (uint32_t l = first; l < key->layer_count; l++)
        warp->layers[l] = layers[l];
    warp->layer_count = key->layer_count;
    return true;
}

/* Copies a whole layer and sets its bounds from the key view. */
static void fill_layer(const struct fl_warp *warp, struct warp_layer *layer, const struct fl_warp_layer *texels)
{
    const struct warp_rectangle all = {0, 0, layer->width, layer->height};
    layer->tolerance = warp->unit * warp->pixels / (focal_of(&warp->camera, layer->height) * warp->radius);
    layer->nearness = warp->radius / warp->unit;
    layer->noise = warp->w_error;
    layer->sticks = false;
    copy_texels(layer, texels, &all);
}

bool fl_warp_set_key(struct fl_warp *warp, const struct fl_warp_key *key, struct fl_warp_error *error)
{
    if (!warp_check_key(key, error) || !have_layers(warp, key, error))
        return false;
    const struct warp_rectangle all = {0, 0, key->width, key->height};
    warp->camera = key->camera;
    warp->unit = key->unit != 0 ? key->unit : 1;
    warp->radius = key->radius;
    warp->pixels = key->pixels;
    warp->w_error = key->w_error;
    warp->is_smeared = key->is_smeared;
    warp->off_pixels = key->w_error * key->radius / warp->unit * focal_of(&key->camera, key->height);
    for (uint32_t l = 0; l < key->layer_count; l++)
        fill_layer(warp, &warp->layers[l], &key->layers[l]);
    struct build build = {.warp = warp, .parts = warp_layer_parts(&warp->layers[0], &all)};
    warp->build_ns = warp_pool_run(warp->pool, build_row, &build, key->layer_count * build.parts.bottom);
    return true;
}

bool fl_warp_add_layer(struct fl_warp *warp, const struct fl_warp_layer *texels, struct fl_warp_error *error)
{
    const uint32_t number = warp->layer_count;
    if (number == 0)
        return warp_error_set(error, FL_WARP_ERROR_ARGUMENT, "layer", "there is no key view; set one first");
    if (number == FL_WARP_LAYERS_MAX)
        return warp_error_set(error, FL_WARP_ERROR_ARGUMENT, "layer", "there are %u layers, the limit", number);
    struct warp_layer *layer = &warp->layers[number];
    const uint32_t width = warp->layers[0].width, height = warp->layers[0].height;
    if (!warp_check_layer(texels, width, height, error))
        return false;
    if (!layer->w && !warp_layer_init(layer, width, height))
        return warp_error_set(error, FL_WARP_ERROR_MEMORY, "size",
                              "there is no memory for a layer of %ux%u texels", width, height);
    fill_layer(warp, layer, texels);
    warp->layer_count = number + 1;
    const struct warp_rectangle all = {0, 0, width, height};
    struct build build = {.warp = warp, .layer = number, .parts = warp_layer_parts(layer, &all)};
    warp->build_ns = warp_pool_run(warp->pool, build_row, &build, build.parts.bottom);
    return true;
}

bool fl_warp_update(struct fl_warp *warp, const struct fl_warp_part *part, struct fl_warp_error *error)
{
    if (warp->layer_count == 0)
        return warp_error_set(error, FL_WARP_ERROR_ARGUMENT, "part", "there is no key view; set one first");
    if (part->layer >= warp->layer_count)
        return warp_error_set(error, FL_WARP_ERROR_ARGUMENT, "layer", "%u is not below %u", part->layer,
                              warp->layer_count);
    struct warp_layer *layer = &warp->layers[part->layer];
    if (!warp_check_part(part, layer->width, layer->height, error))
        return false;
    const struct warp_rectangle texels = {part->x, part->y, part->x + part->width, part->y + part->height};
    copy_texels(layer, &part->texels, &texels);
    struct build build = {.warp = warp, .layer = part->layer, .parts = warp_layer_parts(layer, &texels)};
    warp->build_ns = warp_pool_run(warp->pool, build_row, &build, build.parts.bottom - build.parts.top);
    return true;
}

uint64_t fl_warp_build_ns(const struct fl_warp *warp)
{
    return warp->build_ns;
}

const uint32_t *fl_warp_nodes(const struct fl_warp *warp, uint32_t layer, uint32_t *count)
{
    if (layer >= warp->layer_count)
        return NULL;
    *count = warp_layer_nodes(&warp->layers[layer]);
    return warp->layers[layer].nodes;
}

/* ---- views ---- */

/* Axes of a camera in world space: right, down and forward. */
static void axes_of(const struct fl_warp_camera *camera, double axes[3][3])
{
    for (int k = 0; k < 3; k++) {
        axes[0][k] = camera->world_from_view[4 * k];
        axes[1][k] = -camera->world_from_view[4 * k + 1];
        axes[2][k] = -camera->world_from_view[4 * k + 2];
    }
}

static double dot3(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Computes the rays' matrix for (x, y, 1) of the picture, and the eye, in doubles, since places far from the
 * world's origin may be close together. */
static struct warp_rays rays_of(const struct fl_warp *warp, const struct fl_warp_view *view)
{
    const struct fl_warp_camera *from = &warp->camera, *to = &view->camera;
    const double half_from[2] = {warp->layers[0].width / 2.0, warp->layers[0].height / 2.0};
    const double half_to[2] = {view->width / 2.0, view->height / 2.0};
    const double focal_from = half_from[1] / tan(0.5 * from->fov_y), focal_to = half_to[1] / tan(0.5 * to->fov_y);
    double axes_from[3][3], axes_to[3][3], columns[4][3];
    axes_of(from, axes_from);
    axes_of(to, axes_to);
    for (int k = 0; k < 3; k++) {
        columns[0][k] = axes_to[0][k] / focal_to;
        columns[1][k] = axes_to[1][k] / focal_to;
        columns[2][k] = axes_to[2][k] - half_to[0] * columns[0][k] - half_to[1] * columns[1][k];
        columns[3][k] = ((double)to->world_from_view[4 * k + 3] - from->world_from_view[4 * k + 3]) / warp->unit;
    }
    struct warp_rays rays;
    for (int c = 0; c < 4; c++) {
        const double forward = dot3(axes_from[2], columns[c]);
        const double row[3] = {focal_from * dot3(axes_from[0], columns[c]) + half_from[0] * forward,
                               focal_from * dot3(axes_from[1], columns[c]) + half_from[1] * forward, forward};
        for (int r = 0; r < 3; r++)
            *(c < 3 ? &rays.rows[r][c] : &rays.origin[r]) = (float)row[r];
    }
    rays.w_limit = rays.origin[2] > 0 ? 1 / rays.origin[2] : INFINITY;
    return rays;
}

struct view_work {
    struct warp_task task;
    const struct fl_warp_view *view;
    atomic_bool given_up;
    struct warp_tally tallies[FL_WARP_THREADS_MAX];
};

static void make_row(void *context, unsigned item, unsigned worker)
{
    struct view_work *work = context;
    const struct fl_warp_view *view = work->view;
    struct warp_tally tally = {.by_mask = {0}};
    if (atomic_load(&work->given_up))
        return;
    if (view->is_given_up && view->is_given_up(view->given_up_context)) {
        atomic_store(&work->given_up, true);
        return;
    }
    (view->quality == FL_WARP_TREE ? warp_trace_row : warp_iterate_row)(&work->task, item, &tally);
    struct warp_tally *sum = &work->tallies[worker];
    for (int i = 0; i <= FL_WARP_OUTSIDE; i++)
        sum->by_mask[i] += tally.by_mask[i];
    sum->deeper += tally.deeper;
    sum->marched += tally.marched;
    sum->sticking += tally.sticking;
}

static struct fl_warp_counts counts_of(const struct fl_warp *warp, const struct fl_warp_view *view,
                                       const struct view_work *work)
{
    struct warp_tally sum = {.by_mask = {0}};
    for (int w = 0; w < (int)FL_WARP_THREADS_MAX; w++) {
        for (int i = 0; i <= FL_WARP_OUTSIDE; i++)
            sum.by_mask[i] += work->tallies[w].by_mask[i];
        sum.deeper += work->tallies[w].deeper;
        sum.marched += work->tallies[w].marched;
        sum.sticking += work->tallies[w].sticking;
    }
    const float *a = warp->camera.world_from_view, *b = view->camera.world_from_view;
    const float away = hypotf(hypotf(a[3] - b[3], a[7] - b[7]), a[11] - b[11]);
    const double pixels = (double)view->width * view->height;
    return (struct fl_warp_counts){
        .known = (float)((double)sum.by_mask[FL_WARP_KNOWN] / pixels),
        .behind = (float)((double)sum.by_mask[FL_WARP_BEHIND] / pixels),
        .outside = (float)((double)sum.by_mask[FL_WARP_OUTSIDE] / pixels),
        .deeper = (float)((double)sum.deeper / pixels),
        .marched = (float)((double)sum.marched / pixels),
        .sticking = (float)((double)sum.sticking / (255 * pixels)),
        .bound_pixels =
            view->quality == FL_WARP_TREE && away <= warp->radius ? warp->pixels + warp->off_pixels : INFINITY,
    };
}

bool fl_warp_make(struct fl_warp *warp, const struct fl_warp_view *view, struct fl_warp_picture *picture,
                  struct fl_warp_error *error)
{
    if (warp->layer_count == 0)
        return warp_error_set(error, FL_WARP_ERROR_ARGUMENT, "view", "there is no key view; set one first");
    if (!warp_check_view(view, picture, error))
        return false;
    struct view_work work = {.task = {.layers = warp->layers,
                                      .layer_count = warp->layer_count,
                                      .rays = rays_of(warp, view),
                                      .width = view->width,
                                      .height = view->height,
                                      .stride = picture->stride > 0 ? picture->stride : view->width,
                                      .holes = view->holes,
                                      .fill_back = warp->is_smeared ? SMEARED_BACK : 0,
                                      .colours = picture->colours,
                                      .mask = picture->mask,
                                      .sticking = picture->sticking},
                             .view = view};
    for (uint32_t l = 0; l < warp->layer_count; l++)
        work.task.sticks |= warp->layers[l].sticks;
    for (uint32_t y = 0; y < view->height && picture->sticking && !work.task.sticks; y++)
        memset(picture->sticking + (size_t)y * work.task.stride, 0, view->width);
    warp_task_find_ranges(&work.task);
    const uint64_t time_ns =
        warp_pool_run(warp->pool, make_row, &work, (view->height + WARP_TILE - 1) / WARP_TILE);
    if (atomic_load(&work.given_up))
        return warp_error_set(error, FL_WARP_ERROR_GIVEN_UP, "view", "it was given up");
    picture->counts = counts_of(warp, view, &work);
    picture->counts.processor_ns = time_ns;
    return true;
}
