/* SPDX-License-Identifier: MIT */
/* The C twin of what abuffer/build.frag does to voxels. Neighbouring fragments of a triangle mostly touch the same
 * ones, which are written once. */
#include "trace/abuffer/build_marks.h"

#include <math.h>

/* As in abuffer/build.frag. */
#define DEPTH_MARGIN_CELLS (1.0f / 64)
#define HALF_TEXEL (0.5f - 1.0f / 1024)

void abuffer_marks_init(struct abuffer_marks *marks, const struct abuffer_store *store, void *sums,
                        void *subvoxels)
{
    *marks = (struct abuffer_marks){
        .sums = sums,
        .subvoxels = subvoxels,
        .along = (int32_t)store->voxels_along,
        .voxels_per_cell = (float)store->voxels_along / (float)store->resolution,
        .has_subvoxels = abuffer_has_subvoxels(store),
        .without_steep = store->without_steep,
    };
}

static int32_t clamped(float place, int32_t maximum)
{
    const int32_t whole = (int32_t)place;
    return whole < 0 ? 0 : whole > maximum ? maximum : whole;
}

/* A load is cheaper than an atomic operation, and the bits are usually set already. */
static void set_bits(_Atomic uint32_t *word, uint32_t bits)
{
    if ((atomic_load_explicit(word, memory_order_relaxed) & bits) != bits)
        atomic_fetch_or_explicit(word, bits, memory_order_relaxed);
}

/* ---- the voxels that a patch touches ---- */

/* The subvoxels first .. last along x, y and z. */
struct box {
    int32_t first[3], last[3];
};

/* Of first .. last, those among the `count` from `lower` on, as ones of `width` bits each. */
static uint32_t ones_between(int32_t first, int32_t last, int32_t lower, int32_t count, unsigned width)
{
    const unsigned from = first > lower ? (unsigned)(first - lower) : 0;
    const unsigned end = last < lower + count ? (unsigned)(last - lower + 1) : (unsigned)count;
    return (uint32_t)((UINT64_C(1) << width * end) - (UINT64_C(1) << width * from));
}

/* Word by word: a half of a voxel's subvoxels; halves are stacked along z. */
static void mark(const struct abuffer_marks *marks, const struct box *box, uint32_t bits, uint32_t looks_along)
{
    const int32_t *first = box->first, *last = box->last;
    const size_t along = (size_t)marks->along;
    for (int32_t z = first[2] >> 1; z <= last[2] >> 1; z++) {
        const uint32_t in_z = ones_between(first[2], last[2], 2 * z, 2, 16);
        for (int32_t y = first[1] >> 2; y <= last[1] >> 2; y++) {
            const uint32_t in_yz = in_z & ones_between(first[1], last[1], 4 * y, 4, 4) * 0x10001u;
            const size_t row = ((size_t)(z >> 1) * along + (size_t)y) * along;
            for (int32_t x = first[0] >> 2; x <= last[0] >> 2; x++) {
                const size_t voxel = row + (size_t)x;
                const uint32_t inner = in_yz & ones_between(first[0], last[0], 4 * x, 4, 1) * 0x11111111u;
                set_bits(&marks->sums[4 * voxel + 3], bits);
                if (marks->has_subvoxels)
                    set_bits(&marks->subvoxels[2 * (ABUFFER_SUBVOXELS_TEXELS * voxel + looks_along) + (z & 1)],
                             inner);
            }
        }
    }
}

static uint32_t axis_of_plane(const struct abuffer_surface *surface)
{
    const float u = fabsf(surface->slopes[0]), v = fabsf(surface->slopes[1]);
    return (uint32_t)(surface->axis + (u <= 1 && v <= 1 ? 0 : u >= v ? 1 : 2)) % 3;
}

/* The subvoxels that a texel's side touches. */
static void find_sides(const struct abuffer_marks *marks, int32_t texel, int32_t *first, int32_t *last)
{
    const float per_cell = 4 * marks->voxels_per_cell, middle = (float)texel + 0.5f;
    *first = clamped((middle - HALF_TEXEL) * per_cell, 4 * marks->along - 1);
    *last = clamped((middle + HALF_TEXEL) * per_cell, 4 * marks->along - 1);
}

/* The subvoxels that a patch touches along its depth. */
static void find_depths(const struct abuffer_marks *marks, const struct abuffer_surface *surface, float depth,
                        int32_t *first, int32_t *last)
{
    const float per_cell = 4 * marks->voxels_per_cell;
    const float reach = 0.5f * (fabsf(surface->slopes[0]) + fabsf(surface->slopes[1]));
    const bool steep = (surface->face & FACE_STEEP << surface->axis) != 0;
    const float minimum = steep ? fmaxf(depth - reach, surface->lower) : depth - reach;
    const float maximum = steep ? fminf(depth + reach, surface->upper) : depth + reach;
    *first = clamped((minimum - DEPTH_MARGIN_CELLS) * per_cell, 4 * marks->along - 1);
    *last = clamped((maximum + DEPTH_MARGIN_CELLS) * per_cell, 4 * marks->along - 1);
}

/* Texels whose sides touch the same subvoxels are marked together: their depths ascend or descend, and each one's
 * begin where those of the one before end. */
static void mark_patches(const struct abuffer_marks *marks, const struct abuffer_surface *surface,
                         const struct abuffer_row *row)
{
    const int axis = surface->axis, u = (axis + 1) % 3, v = (axis + 2) % 3;
    const uint32_t looks = (surface->leaves ? ABUFFER_SUM_UP : ABUFFER_SUM_DOWN) << axis;
    const uint32_t bits =
        (surface->face >> 24 & 63u) | looks | (surface->face & FACE_CLOSED ? 0 : ABUFFER_SUM_OPEN);
    const uint32_t looks_along = axis_of_plane(surface);
    struct box box;
    int32_t first_u, last_u, end, other_first, other_last;
    find_sides(marks, row->number, &box.first[v], &box.last[v]);
    find_sides(marks, row->first, &first_u, &last_u);
    for (int32_t i = 0; i < row->count; i = end) {
        box.first[u] = first_u;
        box.last[u] = last_u;
        for (end = i + 1; end < row->count; end++) {
            find_sides(marks, row->first + end, &first_u, &last_u);
            if (first_u != box.first[u] || last_u != box.last[u])
                break;
        }
        find_depths(marks, surface, row->depths[i], &box.first[axis], &box.last[axis]);
        find_depths(marks, surface, row->depths[end - 1], &other_first, &other_last);
        box.first[axis] = other_first < box.first[axis] ? other_first : box.first[axis];
        box.last[axis] = other_last > box.last[axis] ? other_last : box.last[axis];
        mark(marks, &box, bits, looks_along);
    }
}

/* ---- sums of normals ---- */

static void add_times(const struct abuffer_marks *marks, size_t voxel, const int32_t units[3], int32_t times)
{
    for (size_t k = 0; k < 3; k++)
        if (units[k] * times != 0)
            atomic_fetch_add_explicit(&marks->sums[4 * voxel + k], (uint32_t)(units[k] * times),
                                      memory_order_relaxed);
}

static void add_normals(const struct abuffer_marks *marks, const struct abuffer_surface *surface,
                        const struct abuffer_row *row)
{
    const int axis = surface->axis, u = (axis + 1) % 3, v = (axis + 2) % 3;
    const float *slopes = surface->slopes, facing = surface->leaves ? 1 : -1;
    const float scale = facing * ABUFFER_NORMAL_UNIT / sqrtf(1 + slopes[0] * slopes[0] + slopes[1] * slopes[1]);
    const int32_t end = marks->along - 1;
    int32_t units[3], place[3], times = 0;
    size_t last = 0;
    units[axis] = (int32_t)lrintf(scale);
    units[u] = (int32_t)lrintf(-slopes[0] * scale);
    units[v] = (int32_t)lrintf(-slopes[1] * scale);
    place[v] = clamped(((float)row->number + 0.5f) * marks->voxels_per_cell, end);
    for (int32_t i = 0; i < row->count; i++) {
        place[u] = clamped(((float)(row->first + i) + 0.5f) * marks->voxels_per_cell, end);
        place[axis] = clamped(row->depths[i] * marks->voxels_per_cell, end);
        const size_t voxel = (size_t)((place[2] * marks->along + place[1]) * marks->along + place[0]);
        if (voxel != last) {
            add_times(marks, last, units, times);
            times = 0;
            last = voxel;
        }
        times++;
    }
    add_times(marks, last, units, times);
}

void abuffer_mark_row(const struct abuffer_marks *marks, const struct abuffer_surface *surface,
                      const struct abuffer_row *row)
{
    if (surface->face & FACE_LEANS << surface->axis)
        mark_patches(marks, surface, row);
    if (!marks->without_steep && surface->face & FACE_DOMINANT)
        add_normals(marks, surface, row);
}
