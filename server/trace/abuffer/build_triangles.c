/* SPDX-License-Identifier: MIT */
/* Draws triangles that nothing cuts out, by the host, as raster/draw.geom, a rasteriser and abuffer/build.frag do
 * it on a GPU. Software GL shares its memory with the host, and stores and counts a fragment's samples one lane
 * after the other. The arithmetic is that of the shaders and of llvmpipe, so that samples are the same. */
#include "trace/abuffer/build_marks.h"

#include "base/parallel.h"
#include "gpu_scene/unit_vector.h"

#include <math.h>
#include <string.h>

/* Corners are rounded to places, of which a texel has so many along a side: llvmpipe's eight bits. */
#define PLACES 256
/* Rows whose spans are known, and columns of a row whose depths are, before the first of them is stored. */
#define ROWS_TOGETHER 64
#define COLUMNS_TOGETHER 256
/* Primitives that one thread draws at once, at most; of fewer, so many parts for each thread. */
#define PART_MAX 256u
#define PARTS_EACH 16u
/* As in raster/draw.geom. */
#define SLOPE_MAX 65536.0f

struct drawing {
    struct abuffer_task *task;
    struct abuffer_marks marks;
    const uint32_t (*triangles)[4];
    const float (*positions)[4];
    _Atomic uint32_t *heads, *node_count, *wraps;
    struct abuffer_node *nodes;
    uint32_t first, end; /* ids */
    uint32_t part;       /* of them, what one thread draws at once */
    int32_t first_row, end_row;
};

struct triangle {
    float corners[3][3]; /* cells */
    float normal[3], lower[3], upper[3];
    uint32_t id, face; /* raster/layout.h */
    int dominant;      /* axis */
};

/* One in one image. */
struct projected {
    struct abuffer_surface surface;
    uint32_t id;
    int64_t corners[3][2]; /* places from the middle of the first texel, counterclockwise */
    float origin[3];       /* u, v and depth of a point of it, cells */
};

struct span {
    int32_t from, end;
};

/* ---- coverage ---- */

static int64_t floor_quotient(int64_t a, int64_t b)
{
    return a / b - (a % b < 0);
}

/* The texels of a row between the three edges. A centre on an edge belongs to one of the two that share it: to the
 * one on the right of it, or above. */
static struct span span_of(const struct projected *p, int32_t row, int64_t columns)
{
    int64_t from = 0, end = columns;
    for (int i = 0; i < 3; i++) {
        const int64_t *a = p->corners[i], *b = p->corners[(i + 1) % 3];
        const int64_t du = b[0] - a[0], dv = b[1] - a[1];
        const int64_t own = dv < 0 || (dv == 0 && du > 0) ? 0 : 1;
        /* At column x, inside: edge - PLACES dv x >= 0 */
        const int64_t edge = du * (PLACES * (int64_t)row - a[1]) + dv * a[0] - own;
        if (dv > 0) {
            const int64_t last = floor_quotient(edge, PLACES * dv);
            end = last + 1 < end ? last + 1 : end;
        } else if (dv < 0) {
            const int64_t before = floor_quotient(-edge - 1, PLACES * -dv);
            from = before + 1 > from ? before + 1 : from;
        } else if (edge < 0) {
            return (struct span){0, 0};
        }
    }
    return from < end ? (struct span){(int32_t)from, (int32_t)end} : (struct span){0, 0};
}

/* ---- fragments ---- */

static uint32_t bits_of(float f)
{
    uint32_t bits;
    memcpy(&bits, &f, sizeof(bits));
    return bits;
}

/* Nodes of so many fragments, or false, if there is no room: then they are only counted. */
static bool reserve_nodes(struct drawing *drawing, uint32_t count, uint32_t *first)
{
    const uint32_t maximum = drawing->task->builder->nodes_max;
    *first = atomic_fetch_add_explicit(drawing->node_count, count, memory_order_relaxed);
    if (*first > UINT32_MAX - count)
        atomic_fetch_add_explicit(drawing->wraps, 1, memory_order_relaxed);
    return count <= maximum && *first <= maximum - count;
}

/* In the triangle's range, as the plane of a thin one is uncertain, and in the cube. */
static void find_depths(float depths[COLUMNS_TOGETHER], const struct drawing *drawing, const struct projected *p,
                        const struct abuffer_row *row)
{
    const float cube_upper = (float)drawing->task->store->resolution, lower = p->surface.lower;
    const float upper = p->surface.upper;
    const float along_v = ((float)row->number + 0.5f - p->origin[1]) * p->surface.slopes[1];
    for (int32_t i = 0; i < row->count; i++) {
        const float along_u = ((float)(row->first + i) + 0.5f - p->origin[0]) * p->surface.slopes[0];
        float depth = p->origin[2] + along_u + along_v;
        depth = depth < lower ? lower : depth;
        depth = depth > upper ? upper : depth;
        depth = depth < 0 ? 0 : depth;
        depths[i] = depth > cube_upper ? cube_upper : depth;
    }
}

static void store_row(struct drawing *drawing, const struct projected *p, const struct abuffer_row *row,
                      uint32_t node)
{
    const uint32_t tiles = ABUFFER_TILES_ALONG(drawing->task->store->resolution);
    const uint32_t bits =
        (p->surface.face & (FACE_NORMAL_MASK | FACE_CLOSED)) | (p->surface.leaves ? ABUFFER_NODE_LEAVES : 0);
    uint32_t before[COLUMNS_TOGETHER];
    /* All of them first: an atomic operation waits for what was stored before it. */
    for (int32_t i = 0; i < row->count; i++) {
        const uint32_t texel =
            ABUFFER_TEXEL(tiles, (uint32_t)p->surface.axis, (uint32_t)(row->first + i), (uint32_t)row->number);
        before[i] = atomic_exchange_explicit(&drawing->heads[texel], node + (uint32_t)i + 1, memory_order_relaxed);
    }
    for (int32_t i = 0; i < row->count; i++)
        drawing->nodes[node + (uint32_t)i] =
            (struct abuffer_node){before[i], bits_of(row->depths[i]), bits, p->id};
}

static void draw_span(struct drawing *drawing, const struct projected *p, int32_t number, struct span span,
                      uint32_t node)
{
    float depths[COLUMNS_TOGETHER];
    for (int32_t first = span.from; first < span.end; first += COLUMNS_TOGETHER) {
        const int32_t left = span.end - first, count = left < COLUMNS_TOGETHER ? left : COLUMNS_TOGETHER;
        const struct abuffer_row row = {.number = number, .first = first, .count = count, .depths = depths};
        find_depths(depths, drawing, p, &row);
        store_row(drawing, p, &row, node + (uint32_t)(first - span.from));
        abuffer_mark_row(&drawing->marks, &p->surface, &row);
    }
}

static void draw_rows(struct drawing *drawing, const struct projected *p, int32_t first, int32_t end)
{
    struct span spans[ROWS_TOGETHER];
    uint32_t count = 0, node;
    for (int32_t row = first; row < end; row++) {
        spans[row - first] = span_of(p, row, drawing->task->store->resolution);
        count += (uint32_t)(spans[row - first].end - spans[row - first].from);
    }
    if (count == 0 || !reserve_nodes(drawing, count, &node))
        return;
    for (int32_t row = first; row < end; row++) {
        const struct span span = spans[row - first];
        draw_span(drawing, p, row, span, node);
        node += (uint32_t)(span.end - span.from);
    }
}

/* ---- triangles ---- */

static uint32_t face_of(const float normal[3])
{
    const float lean[3] = {fabsf(normal[0]), fabsf(normal[1]), fabsf(normal[2])};
    const float maximum = fmaxf(lean[0], fmaxf(lean[1], lean[2]));
    if (!(maximum > 0))
        return FACE_NEEDLE;
    const float scaled[3] = {normal[0] / maximum, normal[1] / maximum, normal[2] / maximum};
    const float length = sqrtf(scaled[0] * scaled[0] + scaled[1] * scaled[1] + scaled[2] * scaled[2]);
    const float unit[3] = {scaled[0] / length, scaled[1] / length, scaled[2] / length};
    const float unit_maximum = fmaxf(fabsf(unit[0]), fmaxf(fabsf(unit[1]), fabsf(unit[2])));
    uint32_t face = unit_vector_pack_24(unit);
    for (int axis = 0; axis < 3; axis++) {
        face |= fabsf(unit[axis]) >= AXES_OVERLAP * unit_maximum ? FACE_LEANS << axis : 0;
        face |= fabsf(unit[axis]) < FACE_STEEP_BELOW ? FACE_STEEP << axis : 0;
    }
    return face;
}

static void place_triangle(const struct drawing *drawing, const struct instance *instance, uint32_t number,
                           struct triangle *t)
{
    const struct abuffer_store *store = drawing->task->store;
    const bool mirrored = (instance->flags & INSTANCE_MIRRORED) != 0; /* the outside is to the left of its edges */
    float ab[3], ac[3];
    for (int i = 0; i < 3; i++) {
        const float *at = drawing->positions[drawing->triangles[number][i > 0 && mirrored ? 3 - i : i]];
        for (int k = 0; k < 3; k++) {
            const float *m = instance->world_from_object[k];
            const float world = m[3] + m[2] * at[2] + m[1] * at[1] + m[0] * at[0]; /* as dot() adds */
            t->corners[i][k] = (world - store->lower_world[k]) / store->cell_world;
        }
    }
    for (int k = 0; k < 3; k++) {
        ab[k] = t->corners[1][k] - t->corners[0][k];
        ac[k] = t->corners[2][k] - t->corners[0][k];
        t->lower[k] = fminf(t->corners[0][k], fminf(t->corners[1][k], t->corners[2][k]));
        t->upper[k] = fmaxf(t->corners[0][k], fmaxf(t->corners[1][k], t->corners[2][k]));
    }
    for (int k = 0; k < 3; k++)
        t->normal[k] = ab[(k + 1) % 3] * ac[(k + 2) % 3] - ab[(k + 2) % 3] * ac[(k + 1) % 3];
    const float lean[3] = {fabsf(t->normal[0]), fabsf(t->normal[1]), fabsf(t->normal[2])};
    t->dominant = lean[0] >= lean[1] && lean[0] >= lean[2] ? 0 : lean[1] >= lean[2] ? 1 : 2;
    t->face = face_of(t->normal);
}

/* As GL's transforms round it on the way. */
static int64_t place_of(float cells, float resolution)
{
    const float clip = 2.0f * cells / resolution - 1.0f, half = 0.5f * resolution;
    return lrintf((clip * half + half - 0.5f) * PLACES);
}

/* False where it covers nothing, also where a corner is no number, or so far out of the cube as none is. */
static bool project(const struct triangle *t, int axis, float resolution, struct projected *p)
{
    const int sides[2] = {(axis + 1) % 3, (axis + 2) % 3};
    const float across = t->normal[axis];
    *p = (struct projected){.id = t->id,
                            .surface = {.axis = axis,
                                        .lower = t->lower[axis],
                                        .upper = t->upper[axis],
                                        .face = t->face | (axis == t->dominant ? FACE_DOMINANT : 0)}};
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            if (!(t->corners[i][k] > -resolution && t->corners[i][k] < 2 * resolution))
                return false;
    for (int k = 0; k < 2; k++) {
        const float slope = across != 0 ? -t->normal[sides[k]] / across : 0;
        p->surface.slopes[k] = fminf(fmaxf(slope, -SLOPE_MAX), SLOPE_MAX);
        p->origin[k] = t->corners[0][sides[k]];
        for (int i = 0; i < 3; i++)
            p->corners[i][k] = place_of(t->corners[i][sides[k]], resolution);
    }
    p->origin[2] = t->corners[0][axis];
    int64_t *b = p->corners[1], *c = p->corners[2];
    const int64_t *a = p->corners[0], area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    p->surface.leaves = area > 0;
    for (int k = 0; k < 2 && area < 0; k++) {
        const int64_t second = b[k];
        b[k] = c[k];
        c[k] = second;
    }
    return area != 0;
}

static void draw_image(struct drawing *drawing, const struct triangle *t, int axis)
{
    struct projected p;
    if (!project(t, axis, (float)drawing->task->store->resolution, &p))
        return;
    int64_t lower = p.corners[0][1], upper = lower;
    for (int i = 1; i < 3; i++) {
        lower = p.corners[i][1] < lower ? p.corners[i][1] : lower;
        upper = p.corners[i][1] > upper ? p.corners[i][1] : upper;
    }
    int64_t first = floor_quotient(lower + PLACES - 1, PLACES), end = floor_quotient(upper, PLACES) + 1;
    first = first > drawing->first_row ? first : drawing->first_row;
    end = end < drawing->end_row ? end : drawing->end_row;
    for (; first < end; first += ROWS_TOGETHER)
        draw_rows(drawing, &p, (int32_t)first,
                  (int32_t)(end - first < ROWS_TOGETHER ? end : first + ROWS_TOGETHER));
}

static void draw_triangle(struct drawing *drawing, const struct instance *instance, uint32_t number, uint32_t id,
                          uint32_t closed)
{
    struct triangle t = {.id = id};
    place_triangle(drawing, instance, number, &t);
    t.face |= closed;
    for (int axis = 0; axis < 3; axis++)
        if (!drawing->task->store->without_steep || (t.face & FACE_STEEP << axis) == 0 ||
            (t.face & FACE_LEANS << axis) != 0)
            draw_image(drawing, &t, axis);
}

/* Ids from the first on, of one instance; returns where it ends, or the part. */
static uint32_t draw_instance(struct drawing *drawing, uint32_t first, uint32_t end)
{
    const struct axes_draw *draw = &drawing->task->builder->draw;
    const struct gpu_scene *scene = drawing->task->scene;
    const struct axes_command *command = &draw->listed[axes_draw_command_of(draw, first)];
    const uint32_t before = (first - command->first_id) / command->vertex_count;
    const uint32_t start = command->first_id + before * command->vertex_count;
    const uint32_t left = end - start,
                   inner_end = left < command->vertex_count ? end : start + command->vertex_count;
    const struct instance *instance = &scene->instances[draw->instances[command->base_instance + before]];
    const struct geometry *geometry = &scene->geometries[instance->geometry].device;
    const uint32_t closed = geometry->flags & GEOMETRY_CLOSED ? FACE_CLOSED : 0;
    for (uint32_t id = first; axes_sort_of(geometry) == AXES_TRIANGLES && id < inner_end; id++)
        draw_triangle(drawing, instance, command->first_vertex + (id - start), id, closed);
    return inner_end;
}

static void draw_part(void *context, uint32_t i)
{
    struct drawing *drawing = context;
    const uint32_t first = drawing->first + i * drawing->part, left = drawing->end - first;
    const uint32_t end = first + (left < drawing->part ? left : drawing->part);
    for (uint32_t id = first; id < end;)
        id = draw_instance(drawing, id, end);
}

/* ---- buffers ---- */

enum { OPENED_BUFFERS = 7 };

static void list_opened(struct abuffer_task *task, struct gpu_buffer *buffers[OPENED_BUFFERS])
{
    struct abuffer_builder *builder = task->builder;
    struct gpu_buffer *all[OPENED_BUFFERS] = {
        &task->scene->triangles, &task->scene->positions, &builder->heads,         &builder->nodes,
        &builder->build,         &task->store->sums,      &task->store->subvoxels,
    };
    memcpy(buffers, all, sizeof(all));
}

static void draw_parts(struct abuffer_task *task, void *opened[OPENED_BUFFERS], const struct axes_pass *pass,
                       uint32_t first, uint32_t end)
{
    const struct abuffer_store *store = task->store;
    const unsigned threads = parallel_processors();
    const uint32_t part = (end - first) / (threads * PARTS_EACH) + 1;
    struct abuffer_build_counts *counts = opened[4];
    struct drawing drawing = {
        .task = task,
        .triangles = opened[0],
        .positions = opened[1],
        .heads = opened[2],
        .nodes = opened[3],
        .node_count = (void *)&counts->nodes,
        .wraps = (void *)&counts->wraps,
        .first = first,
        .end = end,
        .part = part < PART_MAX ? part : PART_MAX,
        .first_row = (int32_t)pass->first_row,
        .end_row = (int32_t)(pass->end_row > 0 ? pass->end_row : store->resolution),
    };
    abuffer_marks_init(&drawing.marks, store, opened[5], opened[6]);
    parallel_run(threads, (end - first + drawing.part - 1) / drawing.part, draw_part, &drawing);
}

static bool has_any(const struct axes_draw *draw)
{
    for (uint32_t i = 0; i < draw->run_count; i++)
        if (draw->runs[i].sort == AXES_TRIANGLES)
            return true;
    return false;
}

bool abuffer_host_draws(struct abuffer_task *task, const struct axes_pass *pass, uint32_t first, uint32_t end,
                        struct error *error)
{
    struct gpu_buffer *buffers[OPENED_BUFFERS];
    void *opened[OPENED_BUFFERS] = {0};
    if (!has_any(&task->builder->draw)) /* perhaps the scene has no triangles, and no buffer of them */
        return true;
    list_opened(task, buffers);
    if (!gpu_buffers_open(task->builder->device, buffers, OPENED_BUFFERS, opened, error))
        return false;
    draw_parts(task, opened, pass, first, end);
    gpu_buffers_close(task->builder->device, buffers, OPENED_BUFFERS);
    return true;
}
