/* SPDX-License-Identifier: MIT */
/* Ear clipping (G. H. Meisters. Polygons Have Ears. 1975), in the plane in which the polygon is widest. */
#include "grouping.h"

#include <math.h>
#include <stdlib.h>

struct corner {
    double x, y;
    uint32_t next, previous;
};

/* Twice the signed area of a triangle; positive: counter-clockwise. */
static double area(const struct corner *a, const struct corner *b, const struct corner *c)
{
    return (b->x - a->x) * (c->y - a->y) - (b->y - a->y) * (c->x - a->x);
}

/* Newell's normal: its largest component says which coordinate to drop. */
static void flatten(const float *positions, uint32_t count, struct corner *corners)
{
    double normal[3] = {0};
    int drop = 2;

    for (uint32_t i = 0; i < count; i++) {
        const float *a = positions + (size_t)i * 3, *b = positions + (size_t)((i + 1) % count) * 3;

        for (int c = 0; c < 3; c++) {
            int u = (c + 1) % 3, v = (c + 2) % 3;

            normal[c] += ((double)a[u] - (double)b[u]) * ((double)a[v] + (double)b[v]);
        }
    }
    for (int c = 0; c < 2; c++)
        if (fabs(normal[c]) > fabs(normal[drop]))
            drop = c;
    for (uint32_t i = 0; i < count; i++) {
        double u = (double)positions[(size_t)i * 3 + (size_t)(drop + 1) % 3];
        double v = (double)positions[(size_t)i * 3 + (size_t)(drop + 2) % 3];

        /* Seen so that the corners run counter-clockwise. */
        corners[i] = (struct corner){u, normal[drop] < 0 ? -v : v, (i + 1) % count, (i + count - 1) % count};
    }
}

static void fan(uint32_t count, uint32_t *triangles)
{
    for (uint32_t i = 1; i + 1 < count; i++, triangles += 3) {
        triangles[0] = 0;
        triangles[1] = i;
        triangles[2] = i + 1;
    }
}

static bool is_convex(const struct corner *corners, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++)
        if (area(&corners[corners[i].previous], &corners[i], &corners[corners[i].next]) < 0)
            return false;
    return true;
}

static bool holds(const struct corner *a, const struct corner *b, const struct corner *c, const struct corner *p)
{
    return area(a, b, p) >= 0 && area(b, c, p) >= 0 && area(c, a, p) >= 0;
}

/* The tip of a spike without width, where the outline goes back on itself, or a corner that is given twice. */
static bool is_tip(const struct corner *corners, uint32_t at)
{
    const struct corner *b = &corners[at], *a = &corners[b->previous], *c = &corners[b->next];
    const double turned = (b->x - a->x) * (c->x - b->x) + (b->y - a->y) * (c->y - b->y), twice = area(a, b, c);

    return turned <= 0 && !(twice < 0) && !(twice > 0);
}

/* An ear: a convex corner whose triangle holds no other corner, but for those at the same places as its own, or a
 * tip, whose triangle is nothing. */
static bool is_ear(const struct corner *corners, uint32_t at, uint64_t *budget)
{
    const struct corner *b = &corners[at], *a = &corners[b->previous], *c = &corners[b->next];

    if (area(a, b, c) <= 0)
        return false;
    for (uint32_t i = c->next; i != b->previous; i = corners[i].next) {
        const struct corner *p = &corners[i];
        bool same =
            (p->x == a->x && p->y == a->y) || (p->x == b->x && p->y == b->y) || (p->x == c->x && p->y == c->y);

        if (*budget > 0)
            --*budget;
        if (!same && holds(a, b, c, p))
            return false;
    }
    return true;
}

/* Returns the corner before. */
static uint32_t cut_off(struct corner *corners, uint32_t at, uint32_t **triangles)
{
    const uint32_t before = corners[at].previous, behind = corners[at].next;

    (*triangles)[0] = before;
    (*triangles)[1] = at;
    (*triangles)[2] = behind;
    *triangles += 3;
    corners[before].next = behind;
    corners[behind].previous = before;
    return before;
}

/* Spikes first: beside them, triangles out to their tips would be ears. */
static bool clip(struct corner *corners, uint32_t count, uint32_t *triangles, uint64_t *budget)
{
    uint32_t at = 0, left = count;

    for (uint32_t missed = 0; left > 3 && missed <= left;) {
        const bool tip = is_tip(corners, at);

        at = tip ? cut_off(corners, at, &triangles) : corners[at].next;
        missed = tip ? 0 : missed + 1;
        left -= tip;
    }
    for (uint32_t missed = 0; left > 3;) {
        if (*budget == 0 || missed > left)
            return false;
        const bool ear = is_ear(corners, at, budget);

        at = ear ? cut_off(corners, at, &triangles) : corners[at].next;
        missed = ear ? 0 : missed + 1;
        left -= ear;
    }
    cut_off(corners, at, &triangles);
    return true;
}

bool polygon_triangulate(const float *positions, uint32_t count, uint32_t *triangles, uint64_t *budget)
{
    struct corner few[64];
    struct corner *corners = few;
    bool done = true;

    if (count == 3) {
        fan(count, triangles);
        return true;
    }
    if (count > sizeof(few) / sizeof(few[0]))
        corners = malloc(count * sizeof(*corners));
    if (!corners) {
        fan(count, triangles);
        return false;
    }
    flatten(positions, count, corners);
    if (is_convex(corners, count)) {
        fan(count, triangles);
    } else if (!clip(corners, count, triangles, budget)) {
        fan(count, triangles);
        done = false;
    }
    if (corners != few)
        free(corners);
    return done;
}
