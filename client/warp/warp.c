/* SPDX-License-Identifier: MIT */
#include "warp/warp.h"

#include "warp/pool.h"
#include "warp/trace.h"
#include "warp/tree.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define RIGID_SLACK 1e-3f /* of products of the camera's axes: what comes as floats is rounded */
#define PLACE_MAX 1e9f    /* metres */
#define LENGTH_MIN 1e-9f  /* metres */
#define FOV_MAX 3.0f      /* radians */
#define W_MAX 1e9f

struct fl_warp {
    struct warp_pool *pool;
    struct warp_layer layers[FL_WARP_LAYERS_MAX];
    uint32_t layer_count; /* 0: there is no key view */
    struct fl_warp_camera camera;
    float unit, radius, pixels, off_pixels; /* off_pixels: of w_error, from an eye at the radius */
    float *scratch;                         /* of each thread */
    uint64_t build_ns;
};

/* ---- errors ---- */

static bool fail(struct fl_warp_error *error, enum fl_warp_error_code code, const char *field, const char *format,
                 ...) __attribute__((format(printf, 4, 5)));

static bool fail(struct fl_warp_error *error, enum fl_warp_error_code code, const char *field, const char *format,
                 ...)
{
    if (!error)
        return false;
    va_list arguments;
    va_start(arguments, format);
    error->code = code;
    snprintf(error->field, sizeof(error->field), "%s", field);
    vsnprintf(error->text, sizeof(error->text), format, arguments);
    va_end(arguments);
    return false;
}

/* ---- checks ---- */

static bool check_size(uint32_t width, uint32_t height, struct fl_warp_error *error)
{
    if (width >= 1 && height >= 1 && width <= FL_WARP_SIDE_MAX && height <= FL_WARP_SIDE_MAX)
        return true;
    return fail(error, FL_WARP_ERROR_ARGUMENT, "size", "%ux%u is not between 1x1 and %ux%u", width, height,
                FL_WARP_SIDE_MAX, FL_WARP_SIDE_MAX);
}

static bool check_number(float value, float least, float greatest, const char *field, struct fl_warp_error *error)
{
    if (value >= least && value <= greatest)
        return true;
    return fail(error, FL_WARP_ERROR_ARGUMENT, field, "%g is not between %g and %g", (double)value, (double)least,
                (double)greatest);
}

static bool check_camera(const struct fl_warp_camera *camera, struct fl_warp_error *error)
{
    const float *m = camera->world_from_view;
    for (int i = 0; i < 12; i++)
        if (!check_number(m[i], -PLACE_MAX, PLACE_MAX, "camera.world_from_view", error))
            return false;
    for (int a = 0; a < 3; a++)
        for (int b = a; b < 3; b++) {
            const float product = m[a] * m[b] + m[4 + a] * m[4 + b] + m[8 + a] * m[8 + b];
            if (!(fabsf(product - (a == b ? 1.0f : 0.0f)) <= RIGID_SLACK))
                return fail(
                    error, FL_WARP_ERROR_ARGUMENT, "camera.world_from_view",
                    "axes %d and %d have the product %g; a rigid camera has axes of length 1 at right angles", a,
                    b, (double)product);
        }
    return check_number(camera->fov_y, 1e-3f, FOV_MAX, "camera.fov_y", error);
}

static bool check_w(const float *w, size_t count, uint32_t width, struct fl_warp_error *error)
{
    uint32_t wrong = 0;
    for (size_t i = 0; i < count; i++)
        wrong |= !(w[i] >= 0 && w[i] <= W_MAX);
    for (size_t i = 0; wrong && i < count; i++)
        if (!(w[i] >= 0 && w[i] <= W_MAX))
            return fail(error, FL_WARP_ERROR_ARGUMENT, "w", "%g at column %zu of row %zu is not between 0 and %g",
                        (double)w[i], i % width, i / width, (double)W_MAX);
    return true;
}

static bool check_key(const struct fl_warp_key *key, struct fl_warp_error *error)
{
    if (!check_size(key->width, key->height, error) || !check_camera(&key->camera, error) ||
        (key->unit != 0 && !check_number(key->unit, LENGTH_MIN, PLACE_MAX, "unit", error)) ||
        !check_number(key->w_error, 0, W_MAX, "w_error", error) ||
        !check_number(key->radius, LENGTH_MIN, PLACE_MAX, "radius", error) ||
        !check_number(key->pixels, 1e-3f, (float)FL_WARP_SIDE_MAX, "pixels", error))
        return false;
    if (key->layer_count < 1 || key->layer_count > FL_WARP_LAYERS_MAX)
        return fail(error, FL_WARP_ERROR_ARGUMENT, "layer_count", "%u is not between 1 and %u", key->layer_count,
                    FL_WARP_LAYERS_MAX);
    for (uint32_t l = 0; l < key->layer_count; l++) {
        if (!key->layers[l].colours || !key->layers[l].w)
            return fail(error, FL_WARP_ERROR_ARGUMENT, "layers", "layer %u has no colours, or no depths", l);
        if (!check_w(key->layers[l].w, (size_t)key->width * key->height, key->width, error))
            return false;
    }
    return true;
}

/* ---- contexts ---- */

struct fl_warp *fl_warp_create(unsigned threads, struct fl_warp_error *error)
{
    if (threads < 1 || threads > FL_WARP_THREADS_MAX) {
        fail(error, FL_WARP_ERROR_ARGUMENT, "threads", "%u is not between 1 and %u", threads, FL_WARP_THREADS_MAX);
        return NULL;
    }
    struct fl_warp *warp = calloc(1, sizeof(*warp));
    if (!warp) {
        fail(error, FL_WARP_ERROR_MEMORY, "threads", "there is no memory for a context");
        return NULL;
    }
    warp->pool = warp_pool_create(threads);
    if (!warp->pool) {
        fail(error, FL_WARP_ERROR_SYSTEM, "threads", "%u threads cannot be started", threads);
        fl_warp_destroy(warp);
        return NULL;
    }
    return warp;
}

/* From the first on. */
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

/* Rows of parts of one layer, or of several. */
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

static void copy_texels(struct warp_layer *layer, const struct fl_warp_layer *texels,
                        const struct warp_rectangle *rectangle)
{
    const size_t width = rectangle->right - rectangle->left;
    for (uint32_t y = rectangle->top; y < rectangle->bottom; y++) {
        const size_t to = (size_t)y * layer->padded_width + rectangle->left, from = (y - rectangle->top) * width;
        memcpy(layer->colours + to, texels->colours + from, width * sizeof(*layer->colours));
        memcpy(layer->w + to, texels->w + from, width * sizeof(*layer->w));
    }
}

static float focal_of(const struct fl_warp_camera *camera, uint32_t height)
{
    return 0.5f * (float)height / tanf(0.5f * camera->fov_y);
}

/* As many as the key view needs, of its size; those that there are stay where they are. */
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
        return fail(error, FL_WARP_ERROR_MEMORY, "size", "there is no memory for %u layers of %ux%u texels",
                    key->layer_count, key->width, key->height);
    }
    if (!fits) {
        forget_layers(warp->layers, 0);
        free(warp->scratch);
        warp->scratch = scratch;
    }
    for (uint32_t l = first; l < key->layer_count; l++)
        warp->layers[l] = layers[l];
    forget_layers(warp->layers, key->layer_count);
    warp->layer_count = key->layer_count;
    return true;
}

bool fl_warp_set_key(struct fl_warp *warp, const struct fl_warp_key *key, struct fl_warp_error *error)
{
    if (!check_key(key, error) || !have_layers(warp, key, error))
        return false;
    const float focal = focal_of(&key->camera, key->height);
    const struct warp_rectangle all = {0, 0, key->width, key->height};
    warp->camera = key->camera;
    warp->unit = key->unit != 0 ? key->unit : 1;
    warp->radius = key->radius;
    warp->pixels = key->pixels;
    warp->off_pixels = key->w_error * key->radius / warp->unit * focal;
    for (uint32_t l = 0; l < key->layer_count; l++) {
        warp->layers[l].tolerance = warp->unit * key->pixels / (focal * key->radius);
        warp->layers[l].nearness = key->radius / warp->unit;
        warp->layers[l].noise = key->w_error;
        copy_texels(&warp->layers[l], &key->layers[l], &all);
    }
    struct build build = {.warp = warp, .parts = warp_layer_parts(&warp->layers[0], &all)};
    warp->build_ns = warp_pool_run(warp->pool, build_row, &build, key->layer_count * build.parts.bottom);
    return true;
}

bool fl_warp_update(struct fl_warp *warp, const struct fl_warp_part *part, struct fl_warp_error *error)
{
    if (warp->layer_count == 0)
        return fail(error, FL_WARP_ERROR_ARGUMENT, "part", "there is no key view; set one first");
    if (part->layer >= warp->layer_count)
        return fail(error, FL_WARP_ERROR_ARGUMENT, "layer", "%u is not below %u", part->layer, warp->layer_count);
    struct warp_layer *layer = &warp->layers[part->layer];
    if (part->width < 1 || part->height < 1 || part->x >= layer->width || part->y >= layer->height ||
        part->width > layer->width - part->x || part->height > layer->height - part->y)
        return fail(error, FL_WARP_ERROR_ARGUMENT, "part", "%ux%u texels at %u, %u are not some of %ux%u",
                    part->width, part->height, part->x, part->y, layer->width, layer->height);
    if (!part->texels.colours || !part->texels.w)
        return fail(error, FL_WARP_ERROR_ARGUMENT, "texels", "the part has no colours, or no depths");
    if (!check_w(part->texels.w, (size_t)part->width * part->height, part->width, error))
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

/* Right, down and forward in world space. */
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

/* Of the picture's (x, y, 1), and of the eye; in doubles, as places far from the world's origin may lie close
 * together. */
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
    enum fl_warp_quality quality;
    struct warp_tally tallies[FL_WARP_THREADS_MAX];
};

static void make_row(void *context, unsigned item, unsigned worker)
{
    struct view_work *work = context;
    struct warp_tally tally = {.by_mask = {0}};
    (work->quality == FL_WARP_TREE ? warp_trace_row : warp_iterate_row)(&work->task, item, &tally);
    struct warp_tally *sum = &work->tallies[worker];
    for (int i = 0; i <= FL_WARP_OUTSIDE; i++)
        sum->by_mask[i] += tally.by_mask[i];
    sum->deeper += tally.deeper;
    sum->walked += tally.walked;
}

static struct fl_warp_counts counts_of(const struct fl_warp *warp, const struct fl_warp_view *view,
                                       const struct view_work *work)
{
    struct warp_tally sum = {.by_mask = {0}};
    for (int w = 0; w < (int)FL_WARP_THREADS_MAX; w++) {
        for (int i = 0; i <= FL_WARP_OUTSIDE; i++)
            sum.by_mask[i] += work->tallies[w].by_mask[i];
        sum.deeper += work->tallies[w].deeper;
        sum.walked += work->tallies[w].walked;
    }
    const float *a = warp->camera.world_from_view, *b = view->camera.world_from_view;
    const float away = hypotf(hypotf(a[3] - b[3], a[7] - b[7]), a[11] - b[11]);
    const double pixels = (double)view->width * view->height;
    return (struct fl_warp_counts){
        .known = (float)((double)sum.by_mask[FL_WARP_KNOWN] / pixels),
        .behind = (float)((double)sum.by_mask[FL_WARP_BEHIND] / pixels),
        .outside = (float)((double)sum.by_mask[FL_WARP_OUTSIDE] / pixels),
        .deeper = (float)((double)sum.deeper / pixels),
        .walked = (float)((double)sum.walked / pixels),
        .bound_pixels =
            view->quality == FL_WARP_TREE && away <= warp->radius ? warp->pixels + warp->off_pixels : INFINITY,
    };
}

bool fl_warp_make(struct fl_warp *warp, const struct fl_warp_view *view, struct fl_warp_picture *picture,
                  struct fl_warp_error *error)
{
    if (warp->layer_count == 0)
        return fail(error, FL_WARP_ERROR_ARGUMENT, "view", "there is no key view; set one first");
    if (!check_size(view->width, view->height, error) || !check_camera(&view->camera, error))
        return false;
    if (view->quality > FL_WARP_ITERATIVE)
        return fail(error, FL_WARP_ERROR_ARGUMENT, "quality", "%d is none", (int)view->quality);
    if (view->holes > FL_WARP_PATTERN)
        return fail(error, FL_WARP_ERROR_ARGUMENT, "holes", "%d is no way to show them", (int)view->holes);
    if (!picture->colours || !picture->mask)
        return fail(error, FL_WARP_ERROR_ARGUMENT, "picture", "it has no colours, or no mask");
    struct view_work work = {.task = {.layers = warp->layers,
                                      .layer_count = warp->layer_count,
                                      .rays = rays_of(warp, view),
                                      .width = view->width,
                                      .height = view->height,
                                      .holes = view->holes,
                                      .colours = picture->colours,
                                      .mask = picture->mask},
                             .quality = view->quality};
    warp_task_find_ranges(&work.task);
    const uint64_t time_ns =
        warp_pool_run(warp->pool, make_row, &work, (view->height + WARP_TILE - 1) / WARP_TILE);
    picture->counts = counts_of(warp, view, &work);
    picture->counts.processor_ns = time_ns;
    return true;
}
