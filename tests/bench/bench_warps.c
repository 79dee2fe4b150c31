/* SPDX-License-Identifier: MIT */
/* Mesh: W. Mark, L. McMillan, G. Bishop. Post-Rendering 3D Warping. 1997. */
#include "tests/bench/bench_warps.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* Of the greatest w of four neighbours: what differs by more is not one surface. Less cuts floors that are seen at
 * a grazing angle, more draws skins between near and far. */
#define CUT_SHARE 0.04f
/* Eyes of client/warp that are within the radius see surfaces within so many pixels. */
#define PIXELS 0.25f
/* Of a barycentric, or in pixels: a pixel's centre on an edge is in the triangle, however this is rounded. Where
 * the eye moves aside, the centres of whole rows are on edges. */
#define EDGE 1e-3f
#define BLACK 0xff000000u

const char *const warp_method_names[WARP_METHODS] = {
    "as it is", "rotation", "iterative", "quadtree, client", "splat", "splat, both ways", "mesh"};

/* ---- the map ---- */

/* Of (x, y, 1, w) of the first picture: the second's (x, y, 1) and its w, times `rows[2]`. */
struct map {
    float rows[3][4];
};

static float dot3(const float a[3], const float b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Right, down and forward in world space. */
static void axes_of(const struct frame_camera *camera, float axes[3][3])
{
    for (int k = 0; k < 3; k++) {
        axes[0][k] = camera->world_from_view[4 * k];
        axes[1][k] = -camera->world_from_view[4 * k + 1];
        axes[2][k] = -camera->world_from_view[4 * k + 2];
    }
}

static struct map map_of(const struct warp_view *view)
{
    const float half_from[2] = {(float)view->key_width / 2, (float)view->key_height / 2};
    const float half_to[2] = {(float)view->width / 2, (float)view->height / 2};
    const float focal_from = half_from[1] / tanf(view->from.fov_y / 2);
    const float focal_to = half_to[1] / tanf(view->to.fov_y / 2);
    float from[3][3], to[3][3], columns[4][3];
    axes_of(&view->from, from);
    axes_of(&view->to, to);
    for (int k = 0; k < 3; k++) {
        columns[0][k] = from[0][k] / focal_from;
        columns[1][k] = from[1][k] / focal_from;
        columns[2][k] = from[2][k] - half_from[0] * columns[0][k] - half_from[1] * columns[1][k];
        columns[3][k] = view->from.world_from_view[4 * k + 3] - view->to.world_from_view[4 * k + 3];
    }
    struct map map;
    for (int c = 0; c < 4; c++) {
        map.rows[2][c] = dot3(to[2], columns[c]);
        for (int r = 0; r < 2; r++)
            map.rows[r][c] = focal_to * dot3(to[r], columns[c]) + half_to[r] * map.rows[2][c];
    }
    return map;
}

static bool map_point(const struct map *map, float x, float y, float w, float to[3])
{
    float q[3];
    for (int r = 0; r < 3; r++)
        q[r] = map->rows[r][0] * x + map->rows[r][1] * y + map->rows[r][2] + map->rows[r][3] * w;
    if (q[2] <= 0)
        return false;
    const float scale = 1 / q[2];
    to[0] = q[0] * scale;
    to[1] = q[1] * scale;
    to[2] = w * scale;
    return true;
}

bool warp_point(const struct warp_view *view, const float from[3], float to[3])
{
    const struct map map = map_of(view);
    return map_point(&map, from[0], from[1], from[2], to);
}

/* ---- filling ---- */

static void clear(const struct warp_view *view, struct warp_picture *picture)
{
    const uint32_t count = view->width * view->height;
    memset(picture->seen, 0, count);
    for (uint32_t i = 0; i < count; i++) {
        picture->colours[i] = BLACK;
        picture->w[i] = -1;
    }
}

/* What lies between two neighbours that are seen takes the nearer one's place: it is a crack in a surface, so that
 * it counts as seen. */
static void close_cracks_of_columns(const struct warp_view *view, struct warp_picture *picture)
{
    const uint32_t width = view->width;
    for (uint32_t i = width; i < width * (view->height - 1); i++) {
        if (picture->seen[i] || !picture->seen[i - width] || !picture->seen[i + width])
            continue;
        const uint32_t nearer = picture->w[i - width] > picture->w[i + width] ? i - width : i + width;
        picture->colours[i] = picture->colours[nearer];
        picture->w[i] = picture->w[nearer];
        picture->seen[i] = 1;
    }
}

/* Each hole of a row is filled from its farther end; holes of at most `crack` pixels count as seen. */
static void fill_row(struct warp_picture *picture, uint32_t first, uint32_t width, uint32_t crack)
{
    uint32_t *colours = picture->colours + first;
    uint8_t *seen = picture->seen + first;
    const float *w = picture->w + first;
    for (uint32_t x = 0, end; x < width; x = end + 1) {
        for (end = x; end < width && !seen[end]; end++)
            continue;
        if (end == x || end - x == width)
            continue;
        const uint32_t far = x == 0 ? end : end == width ? x - 1 : w[x - 1] < w[end] ? x - 1 : end;
        for (uint32_t k = x; k < end; k++)
            colours[k] = colours[far];
        if (end - x <= crack)
            memset(seen + x, 1, end - x);
    }
}

static void fill(const struct warp_view *view, struct warp_picture *picture, uint32_t crack)
{
    for (uint32_t y = 0; y < view->height; y++)
        fill_row(picture, y * view->width, view->width, crack);
}

/* ---- the methods ---- */

static struct fl_warp_camera client_camera(const struct frame_camera *camera)
{
    struct fl_warp_camera client = {.fov_y = camera->fov_y};
    memcpy(client.world_from_view, camera->world_from_view, sizeof(client.world_from_view));
    return client;
}

static bool make_by_client(const struct warp_view *view, struct warp_picture *picture,
                           enum fl_warp_quality quality)
{
    struct fl_warp_key key = {.width = view->key_width,
                              .height = view->key_height,
                              .camera = client_camera(&view->from),
                              .radius = view->radius,
                              .pixels = PIXELS,
                              .layer_count = view->layer_count};
    for (uint32_t l = 0; l < view->layer_count; l++)
        key.layers[l] =
            (struct fl_warp_layer){view->layers[l].colours, view->layers[l].w, view->layers[l].sticking};
    const struct fl_warp_view wanted = {
        .width = view->width, .height = view->height, .camera = client_camera(&view->to), .quality = quality};
    struct fl_warp_picture made = {
        .colours = picture->colours, .mask = picture->seen, .sticking = picture->sticking};
    struct fl_warp_error error = {0};
    if (!fl_warp_set_key(picture->client, &key, &error) ||
        !fl_warp_make(picture->client, &wanted, &made, &error)) {
        fprintf(stderr, "%s: %s\n", error.field, error.text);
        return false;
    }
    for (uint32_t i = 0; i < view->width * view->height; i++)
        picture->seen[i] = picture->seen[i] == FL_WARP_KNOWN;
    picture->build_ns = fl_warp_build_ns(picture->client);
    picture->processor_ns = made.counts.processor_ns;
    return true;
}

static void splat(const struct warp_view *view, const struct warp_layer *layer, struct warp_picture *picture)
{
    const struct map map = map_of(view);
    const float width = (float)view->width, height = (float)view->height;
    float to[3];
    for (uint32_t y = 0, i = 0; y < view->key_height; y++)
        for (uint32_t x = 0; x < view->key_width; x++, i++) {
            if (!map_point(&map, (float)x + 0.5f, (float)y + 0.5f, layer->w[i], to) || to[0] < 0 || to[1] < 0 ||
                to[0] >= width || to[1] >= height)
                continue;
            const uint32_t at = (uint32_t)to[1] * view->width + (uint32_t)to[0];
            if (to[2] > picture->w[at]) {
                picture->w[at] = to[2];
                picture->colours[at] = layer->colours[i];
                picture->seen[at] = 1;
            }
        }
}

struct corner {
    float x, y, w;
    uint32_t colour;
};

static struct corner corner_of(const struct warp_picture *picture, const struct warp_layer *layer, uint32_t i)
{
    const float *v = picture->vertices + 3 * (size_t)i;
    return (struct corner){v[0], v[1], v[2], layer->colours[i]};
}

static uint32_t mixed(const struct corner c[3], float b1, float b2)
{
    uint32_t colour = BLACK;
    for (int shift = 0; shift < 24; shift += 8)
        colour |=
            (uint32_t)((float)(c[0].colour >> shift & 255) * (1 - b1 - b2) +
                       (float)(c[1].colour >> shift & 255) * b1 + (float)(c[2].colour >> shift & 255) * b2 + 0.5f)
            << shift;
    return colour;
}

/* The pixels whose centres lie between three values: the first and the one after the last. */
static void range_of(float a, float b, float c, uint32_t size, uint32_t range[2])
{
    const float first = ceilf(fminf(a, fminf(b, c)) - 0.5f - EDGE),
                last = floorf(fmaxf(a, fmaxf(b, c)) - 0.5f + EDGE);
    range[0] = first > 0 ? (uint32_t)fminf(first, (float)size) : 0;
    range[1] = last < 0 ? 0 : (uint32_t)fminf(last, (float)(size - 1)) + 1;
}

/* In the space (x, y, w) a triangle is linear, and so are its barycentrics. */
static void draw(const struct warp_view *view, const struct corner c[3], struct warp_picture *picture)
{
    const float ux = c[1].x - c[0].x, uy = c[1].y - c[0].y, vx = c[2].x - c[0].x, vy = c[2].y - c[0].y;
    const float area = ux * vy - vx * uy;
    uint32_t columns[2], rows[2];
    if (c[0].w < 0 || c[1].w < 0 || c[2].w < 0 || fabsf(area) < 1e-9f)
        return;
    range_of(c[0].x, c[1].x, c[2].x, view->width, columns);
    range_of(c[0].y, c[1].y, c[2].y, view->height, rows);
    for (uint32_t y = rows[0]; y < rows[1]; y++)
        for (uint32_t x = columns[0]; x < columns[1]; x++) {
            const float px = (float)x + 0.5f - c[0].x, py = (float)y + 0.5f - c[0].y;
            const float b1 = (px * vy - py * vx) / area, b2 = (py * ux - px * uy) / area;
            const float w = c[0].w + b1 * (c[1].w - c[0].w) + b2 * (c[2].w - c[0].w);
            const uint32_t at = y * view->width + x;
            if (b1 < -EDGE || b2 < -EDGE || b1 + b2 > 1 + EDGE || w <= picture->w[at])
                continue;
            picture->w[at] = w;
            picture->colours[at] = mixed(c, b1, b2);
            picture->seen[at] = 1;
        }
}

static void place_vertices(const struct warp_view *view, const struct warp_layer *layer,
                           struct warp_picture *picture)
{
    const struct map map = map_of(view);
    float *to = picture->vertices;
    for (uint32_t y = 0, i = 0; y < view->key_height; y++)
        for (uint32_t x = 0; x < view->key_width; x++, i++, to += 3)
            if (!map_point(&map, (float)x + 0.5f, (float)y + 0.5f, layer->w[i], to))
                to[2] = -1;
}

static void draw_mesh(const struct warp_view *view, const struct warp_layer *layer, struct warp_picture *picture)
{
    const uint32_t width = view->key_width;
    place_vertices(view, layer, picture);
    for (uint32_t y = 0; y + 1 < view->key_height; y++)
        for (uint32_t x = 0; x + 1 < width; x++) {
            const uint32_t i = y * width + x, at[4] = {i, i + 1, i + width, i + width + 1};
            const float *w = layer->w;
            const float least = fminf(fminf(w[at[0]], w[at[1]]), fminf(w[at[2]], w[at[3]]));
            const float greatest = fmaxf(fmaxf(w[at[0]], w[at[1]]), fmaxf(w[at[2]], w[at[3]]));
            if (greatest - least > CUT_SHARE * greatest)
                continue;
            const struct corner c[4] = {corner_of(picture, layer, at[0]), corner_of(picture, layer, at[1]),
                                        corner_of(picture, layer, at[2]), corner_of(picture, layer, at[3])};
            draw(view, (struct corner[3]){c[0], c[1], c[2]}, picture);
            draw(view, (struct corner[3]){c[1], c[3], c[2]}, picture);
        }
}

static void crop(const struct warp_view *view, struct warp_picture *picture)
{
    const uint32_t left = (view->key_width - view->width) / 2, top = (view->key_height - view->height) / 2;
    for (uint32_t y = 0; y < view->height; y++)
        memcpy(picture->colours + y * view->width, view->layers[0].colours + (top + y) * view->key_width + left,
               view->width * sizeof(*picture->colours));
    memset(picture->seen, 1, view->width * view->height);
}

/* Between the centres of four texels; beyond the border it is as at it. */
static uint32_t between_texels(const struct warp_view *view, float x, float y)
{
    const float last_x = (float)(view->key_width - 1), last_y = (float)(view->key_height - 1);
    const float left = fminf(fmaxf(x - 0.5f, 0), last_x), top = fminf(fmaxf(y - 0.5f, 0), last_y);
    const uint32_t i = (uint32_t)top * view->key_width + (uint32_t)left;
    const uint32_t right = left < last_x, below = top < last_y ? view->key_width : 0;
    const float share_x = left - floorf(left), share_y = top - floorf(top);
    const uint32_t *at = view->layers[0].colours + i;
    uint32_t colour = BLACK;
    for (int shift = 0; shift < 24; shift += 8) {
        const float above =
            (float)(at[0] >> shift & 255) * (1 - share_x) + (float)(at[right] >> shift & 255) * share_x;
        const float under = (float)(at[below] >> shift & 255) * (1 - share_x) +
                            (float)(at[below + right] >> shift & 255) * share_x;
        colour |= (uint32_t)(above * (1 - share_y) + under * share_y + 0.5f) << shift;
    }
    return colour;
}

/* From each pixel back to the key, whose w is 0 everywhere. */
static void turn(const struct warp_view *view, struct warp_picture *picture)
{
    const struct warp_view back = {.width = view->key_width,
                                   .height = view->key_height,
                                   .key_width = view->width,
                                   .key_height = view->height,
                                   .from = view->to,
                                   .to = view->from};
    const struct map map = map_of(&back);
    const float width = (float)view->key_width, height = (float)view->key_height;
    float place[3];
    for (uint32_t y = 0, i = 0; y < view->height; y++)
        for (uint32_t x = 0; x < view->width; x++, i++) {
            if (!map_point(&map, (float)x + 0.5f, (float)y + 0.5f, 0, place))
                continue;
            picture->colours[i] = between_texels(view, place[0], place[1]);
            picture->seen[i] = place[0] >= 0 && place[1] >= 0 && place[0] < width && place[1] < height;
        }
}

static void make(struct warp_picture *picture, const struct warp_view *view, enum warp_method method)
{
    if (method == WARP_NONE) {
        crop(view, picture);
        return;
    }
    clear(view, picture);
    if (method == WARP_ROTATION) {
        turn(view, picture);
        return;
    }
    for (uint32_t l = 0; l < view->layer_count; l++)
        (method == WARP_MESH ? draw_mesh : splat)(view, &view->layers[l], picture);
    if (method == WARP_SPLAT_BOTH)
        close_cracks_of_columns(view, picture);
    fill(view, picture, method == WARP_MESH ? 0 : 1);
}

/* ---- the interface ---- */

bool warp_picture_init(struct warp_picture *picture, uint32_t width, uint32_t height, uint32_t key_texels)
{
    const size_t count = (size_t)width * height;
    *picture = (struct warp_picture){.colours = calloc(count, sizeof(*picture->colours)),
                                     .seen = calloc(count, sizeof(*picture->seen)),
                                     .sticking = calloc(count, sizeof(*picture->sticking)),
                                     .w = calloc(count, sizeof(*picture->w)),
                                     .vertices = calloc(key_texels, 3 * sizeof(*picture->vertices)),
                                     .client = fl_warp_create(1, NULL)};
    if (picture->colours && picture->seen && picture->sticking && picture->w && picture->vertices &&
        picture->client)
        return true;
    warp_picture_finish(picture);
    return false;
}

void warp_picture_finish(struct warp_picture *picture)
{
    free(picture->colours);
    free(picture->seen);
    free(picture->sticking);
    free(picture->w);
    free(picture->vertices);
    fl_warp_destroy(picture->client);
    *picture = (struct warp_picture){0};
}

static uint64_t thread_ns(void)
{
    struct timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return (uint64_t)now.tv_sec * 1000000000u + (uint64_t)now.tv_nsec;
}

bool warp_picture_make(struct warp_picture *picture, const struct warp_view *view, enum warp_method method)
{
    picture->build_ns = 0;
    if (method == WARP_ITERATIVE || method == WARP_QUADTREE)
        return make_by_client(view, picture, method == WARP_QUADTREE ? FL_WARP_TREE : FL_WARP_ITERATIVE);
    const uint64_t start_ns = thread_ns();
    make(picture, view, method);
    picture->processor_ns = thread_ns() - start_ns;
    return true;
}

double warp_psnr_db(const uint32_t *a, const uint32_t *b, const uint8_t *seen, uint32_t count)
{
    uint64_t squares = 0, values = 0;
    for (uint32_t i = 0; i < count; i++) {
        if (seen && !seen[i])
            continue;
        for (int shift = 0; shift < 24; shift += 8) {
            const int difference = (int)(a[i] >> shift & 255) - (int)(b[i] >> shift & 255);
            squares += (uint64_t)(difference * difference);
        }
        values += 3;
    }
    return squares == 0 ? (double)INFINITY : 10 * log10(255.0 * 255.0 * (double)values / (double)squares);
}

bool warp_write(const char *path, uint32_t width, uint32_t height, const uint32_t *colours, const uint8_t *seen)
{
    FILE *file = fopen(path, "wb");
    if (!file)
        return false;
    fprintf(file, "P6\n%u %u\n255\n", width, height);
    for (uint32_t i = 0; i < width * height; i++) {
        uint8_t rgb[3] = {(uint8_t)colours[i], (uint8_t)(colours[i] >> 8), (uint8_t)(colours[i] >> 16)};
        if (seen && !seen[i]) {
            rgb[0] = 255;
            rgb[1] /= 2;
            rgb[2] /= 2;
        }
        fwrite(rgb, 1, 3, file);
    }
    const bool is_whole = !ferror(file);
    return fclose(file) == 0 && is_whole;
}
