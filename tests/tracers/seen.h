/* SPDX-License-Identifier: MIT */
/* Visibility from an eye, in double precision and from the scene alone: along a ray, the number of surfaces
 * between each of its points and the eye. A tracer that keeps so many layers knows the points that fewer
 * hide, and no others.  From an eye a convex surface hides a convex body, its shadow, which a ray meets in
 * one interval (a ball in three); so the result is exact, up to the size of a texel. A texel shows the
 * surface at its centre, which is at most sqrt(1/2) of a texel from the ray: each shadow is computed twice,
 * wider and narrower by that. Points within the narrow ones are surely hidden; points outside the wide ones
 * surely are not. */
#ifndef FARLIGHT_TESTS_TRACERS_SEEN_H
#define FARLIGHT_TESTS_TRACERS_SEEN_H

#include "tests/tracers/naive_twin.h"

#include <stdio.h>

#define SEEN_TEXELS 0.75 /* sqrt(1/2), and what floats round */
#define SEEN_RUN 3.0     /* texels: what is hidden for longer surely is; 1.5 and their diagonals */
#define SEEN_EVENTS_MAX 16384

struct seen_view {
    double eye[3];
    double axes[6][3][3]; /* axes of each face: right, down, forward */
    uint32_t faces, layers;
    double half;  /* half the side of a face at distance 1 */
    double texel; /* side of a texel at distance 1 */
    double blind; /* texels: what a ray meets within them may be taken for what it begins on */
    /* Bounds of the scene: beyond its farthest point from the eye, space is known to be empty. */
    bool is_bounded;
    double lower[3], upper[3];
};

/* Faces of a cube of so many texels. */
static inline void seen_view_of_cube(struct seen_view *view, const double eye[3], uint32_t resolution)
{
    static const double axes[6][3][3] = {{{1, 0, 0}, {0, -1, 0}, {0, 0, -1}}, {{-1, 0, 0}, {0, -1, 0}, {0, 0, 1}},
                                         {{0, 0, 1}, {0, -1, 0}, {1, 0, 0}},  {{0, 0, -1}, {0, -1, 0}, {-1, 0, 0}},
                                         {{1, 0, 0}, {0, 0, 1}, {0, 1, 0}},   {{1, 0, 0}, {0, 0, -1}, {0, -1, 0}}};
    memcpy(view->axes, axes, sizeof(axes));
    memcpy(view->eye, eye, sizeof(view->eye));
    view->faces = 6;
    view->half = 1;
    view->texel = resolution > 0 ? 2.0 / resolution : 0;
}

struct seen_answer {
    /* Distances from where on a point of the ray may be hidden by all layers, or outside the view, and from where
     * on a tracer must know that it is; INFINITY: nowhere. */
    double maybe_unknown, unknown;
    /* Distance of the nearest surface that the ray meets within a texel of its outline. */
    double edge;
    double end; /* end of the ray */
};

struct seen_interval {
    double from, to;
};

/* Where the ray meets a triangle: the point, and the triangle's plane, normal * p = height. */
struct seen_meeting {
    double at, point[3], normal[3], height;
    size_t triangle;
    const double (*axes)[3];
};
#define SEEN_MEETINGS_MAX 256

struct seen_event {
    double at;
    int wide, narrow; /* how many more hide what follows */
};

struct seen {
    const struct twin *twin;
    const struct seen_view *view;
    double (*triangles)[3][3]; /* in the world */
    bool *is_whole;            /* by triangle: no part may be cut out */
    size_t triangle_count;
    /* The current ray. */
    double origin[3], direction[3], t_min, t_max; /* the origin from the eye */
    const double (*axes)[3];                      /* axes of the current face */
    struct seen_interval inside;                  /* part of the ray in the current face */
    struct seen_event events[SEEN_EVENTS_MAX];
    uint32_t event_count;
    struct seen_meeting meetings[SEEN_MEETINGS_MAX];
    uint32_t meeting_count;
    double edge;
    double surely_within, maybe_within; /* distances, up to which something may be there */
};

static inline bool seen_is_whole(const struct seen *seen, uint32_t material)
{
    const struct scene_material *found = scene_material(seen->twin->scene, material);
    return !found || found->value.alpha_mode != ALPHA_MASK;
}

static inline void seen_add_mesh(struct seen *seen, size_t i)
{
    const struct scene_instance instance = twin_instance_at(seen->twin, 0, i, 0);
    const struct scene_mesh *mesh = scene_mesh(seen->twin->scene, instance.node->value.object);
    const struct twin_answer start = {.twin = seen->twin, .shape = &seen->twin->shapes[i]};
    if (instance.singular || !mesh)
        return;
    const size_t first = seen->triangle_count, count = first + mesh->value.triangle_count;
    const uint32_t *indices = (const uint32_t *)(const void *)mesh->arrays[MESH_INDICES]->data;
    seen->triangles = realloc(seen->triangles, count * sizeof(*seen->triangles));
    seen->is_whole = realloc(seen->is_whole, count * sizeof(*seen->is_whole));
    for (uint32_t p = 0; p < mesh->value.triangle_count; p++) {
        for (uint32_t v = 0; v < 3; v++) {
            double corner[3], *world = seen->triangles[first + p][v];
            twin_moving_vertex(&start, mesh, MESH_POSITIONS, indices[3 * p + v], corner);
            twin_transform(world, instance.world_from_object, corner, 1);
            for (int k = 0; k < 3; k++)
                world[k] -= seen->view->eye[k];
        }
        seen->is_whole[first + p] = seen_is_whole(seen, twin_range_material(mesh->ranges, mesh->range_count, p));
    }
    seen->triangle_count = count;
}

/* Creates it for the time at which the shutter opens. Both must outlive it. */
static inline struct seen *seen_create(const struct twin *twin, const struct seen_view *view)
{
    struct seen *seen = calloc(1, sizeof(*seen));
    if (!seen)
        exit(1);
    seen->twin = twin;
    seen->view = view;
    for (size_t i = 0; i < twin->instance_counts[0]; i++)
        seen_add_mesh(seen, i);
    return seen;
}

static inline void seen_destroy(struct seen *seen)
{
    free(seen->triangles);
    free(seen->is_whole);
    free(seen);
}

/* ---- intervals ---- */

/* Keeps the part with at + t * slope >= 0. */
static inline void seen_clip(struct seen_interval *of, double at, double slope)
{
    if (slope > 0)
        of->from = fmax(of->from, -at / slope);
    else if (slope < 0)
        of->to = fmin(of->to, -at / slope);
    else if (at < 0)
        of->to = -INFINITY;
}

/* Where a * t^2 + 2 * b * t + c <= 0 for a > 0; empty: from > to. */
static inline struct seen_interval seen_roots(double a, double b, double c)
{
    const double under = b * b - a * c;
    if (!(under > 0))
        return (struct seen_interval){INFINITY, -INFINITY};
    return (struct seen_interval){(-b - sqrt(under)) / a, (-b + sqrt(under)) / a};
}

static inline struct seen_interval seen_both(struct seen_interval a, struct seen_interval b)
{
    return (struct seen_interval){fmax(a.from, b.from), fmin(a.to, b.to)};
}

static inline void seen_hide(struct seen *seen, struct seen_interval of, int wide, int narrow)
{
    of = seen_both(of, seen->inside);
    if (!(of.from < of.to) || (wide == 0 && narrow == 0))
        return;
    if (seen->event_count + 2 > SEEN_EVENTS_MAX) {
        fprintf(stderr, "a ray passes more than %d shadows\n", SEEN_EVENTS_MAX / 2);
        exit(1);
    }
    seen->events[seen->event_count++] = (struct seen_event){of.from, wide, narrow};
    seen->events[seen->event_count++] = (struct seen_event){of.to, -wide, -narrow};
}

static inline void seen_edge(struct seen *seen, double at)
{
    if (at >= seen->inside.from && at <= seen->inside.to && at > seen->t_min && at < seen->t_max)
        seen->edge = fmin(seen->edge, at);
}

/* How far apart two points of the ray are to the eye, in texels at least. */
static inline double seen_texels_between(const struct seen *seen, double from, double to)
{
    double a[3], b[3], across[3];
    to = fmin(to, 1e9 * (1 + fabs(from))); /* the end of a ray may be at infinity */
    for (int k = 0; k < 3; k++) {
        a[k] = seen->origin[k] + from * seen->direction[k];
        b[k] = seen->origin[k] + to * seen->direction[k];
    }
    twin_cross(across, a, b);
    return atan2(sqrt(twin_dot(across, across)), twin_dot(a, b)) / seen->view->texel;
}

/* ---- surfaces ---- */

/* hypot() guards against squares beyond a double's range, which no scene's are, and costs a tenth of the time.
 */
static inline double seen_length(double x, double y)
{
    return sqrt(x * x + y * y);
}

static inline void seen_triangle(struct seen *seen, size_t i)
{
    const double(*corner)[3] = (const double(*)[3])seen->triangles[i];
    const double *o = seen->origin, *d = seen->direction;
    struct seen_interval wide = seen->inside, narrow = wide;
    double e1[3], e2[3], normal[3];
    for (int k = 0; k < 3; k++) {
        e1[k] = corner[1][k] - corner[0][k];
        e2[k] = corner[2][k] - corner[0][k];
    }
    twin_cross(normal, e1, e2);
    const double height = twin_dot(normal, corner[0]), side = height > 0 ? 1 : -1;
    if (height == 0)
        return; /* the eye sees its edge */
    /* Where the ray meets its plane; behind it, seen from the eye, is its shadow. */
    const double slope = twin_dot(normal, d), at = (height - twin_dot(normal, o)) / slope;
    seen_clip(&wide, side * (twin_dot(normal, o) - height), side * slope);
    seen_clip(&narrow, side * (twin_dot(normal, o) - height), side * slope);
    bool is_wide = true, is_narrow = true;
    for (int v = 0; v < 3; v++) {
        double n[3];
        twin_cross(n, corner[v], corner[(v + 1) % 3]);
        const double length = sqrt(twin_dot(n, n)) * side;
        for (int k = 0; k < 3; k++)
            n[k] /= length;
        /* By how much a texel may be off across it, a unit of depth. */
        const double off =
            SEEN_TEXELS * seen->view->texel * seen_length(twin_dot(n, seen->axes[0]), twin_dot(n, seen->axes[1]));
        const double z = off * twin_dot(seen->axes[2], o), dz = off * twin_dot(seen->axes[2], d);
        seen_clip(&wide, twin_dot(n, o) + z, twin_dot(n, d) + dz);
        seen_clip(&narrow, twin_dot(n, o) - z, twin_dot(n, d) - dz);
        is_wide = is_wide && twin_dot(n, o) + z + at * (twin_dot(n, d) + dz) >= 0;
        is_narrow = is_narrow && twin_dot(n, o) - z + at * (twin_dot(n, d) - dz) >= 0;
    }
    seen_hide(seen, wide, 1, 0);
    if (seen->is_whole[i])
        seen_hide(seen, narrow, 0, 1);
    if (is_wide && !is_narrow)
        seen_edge(seen, at);
    if (is_narrow && at >= seen->inside.from && at <= seen->inside.to && seen->meeting_count < SEEN_MEETINGS_MAX) {
        struct seen_meeting *meeting = &seen->meetings[seen->meeting_count++];
        *meeting = (struct seen_meeting){.at = at, .height = height, .triangle = i, .axes = seen->axes};
        memcpy(meeting->normal, normal, sizeof(normal));
        for (int k = 0; k < 3; k++)
            meeting->point[k] = o[k] + at * d[k];
    }
}

/* Whether another triangle crosses the one that the ray meets within a texel of there: which of them is the first
 * is decided for the texel. 1 / depth of each is linear in a texel's place; its slope is that of normal / height.
 */
static inline bool seen_crosses(const struct seen *seen, const struct seen_meeting *meeting, size_t i)
{
    const double(*corner)[3] = (const double(*)[3])seen->triangles[i];
    const double *p = meeting->point, off = SEEN_TEXELS * seen->view->texel;
    double e1[3], e2[3], normal[3], apart[3];
    for (int k = 0; k < 3; k++) {
        e1[k] = corner[1][k] - corner[0][k];
        e2[k] = corner[2][k] - corner[0][k];
    }
    twin_cross(normal, e1, e2);
    const double height = twin_dot(normal, corner[0]), side = height > 0 ? 1 : -1,
                 z = twin_dot(meeting->axes[2], p);
    if (height == 0 || twin_dot(normal, p) / height <= 0)
        return false;
    for (int v = 0; v < 3; v++) {
        double n[3];
        twin_cross(n, corner[v], corner[(v + 1) % 3]);
        const double across = seen_length(twin_dot(n, meeting->axes[0]), twin_dot(n, meeting->axes[1]));
        if (side * twin_dot(n, p) + off * across * z < 0)
            return false;
    }
    for (int k = 0; k < 3; k++)
        apart[k] = meeting->normal[k] / meeting->height - normal[k] / height;
    const double slope = seen_length(twin_dot(apart, meeting->axes[0]), twin_dot(apart, meeting->axes[1]));
    return fabs(twin_dot(apart, p) / z) < off * slope;
}

/* A ball round `c` as the eye at `e` sees it along o + t * d: what it hides, with an outline of another radius. */
struct seen_ball {
    double c[3], o[3], d[3]; /* from the eye, in the space of the object */
    double radius;
    struct seen_interval within;
};

static inline void seen_shadow_of_ball(struct seen *seen, const struct seen_ball *ball, double outline, int wide,
                                       int narrow)
{
    const double apart = twin_dot(ball->c, ball->c), tangent = apart - outline * outline;
    struct seen_interval cone = {-INFINITY, INFINITY};
    if (outline <= 0)
        return;
    if (tangent > 0) {
        /* (p c)^2 >= (1 - (outline / |c|)^2) p^2 c^2 and p c > 0: outside between the roots, or inside them. */
        const double oc = twin_dot(ball->o, ball->c), dc = twin_dot(ball->d, ball->c);
        const double a = tangent * twin_dot(ball->d, ball->d) - dc * dc,
                     b = tangent * twin_dot(ball->o, ball->d) - oc * dc,
                     c = tangent * twin_dot(ball->o, ball->o) - oc * oc;
        seen_clip(&cone, oc, dc);
        if (a > 0) {
            cone = seen_both(cone, seen_roots(a, b, c));
        } else {
            const struct seen_interval outside = seen_roots(-a, -b, -c);
            struct seen_interval after = cone;
            after.from = fmax(after.from, outside.to);
            cone.to = fmin(cone.to, outside.from);
            /* Only one of the two is of the half that looks from the eye. */
            if (!(cone.from < cone.to) && outside.from <= outside.to)
                cone = after;
        }
    }
    const struct seen_interval within = seen_both(ball->within, cone);
    const bool is_met = within.from < within.to;
    seen_hide(seen, within, wide, narrow);
    const struct seen_interval parts[2] = {{cone.from, is_met ? within.from : cone.to},
                                           {is_met ? within.to : INFINITY, cone.to}};
    for (int i = 0; i < 2; i++) {
        const double from = fmax(parts[i].from, seen->inside.from), to = fmin(parts[i].to, seen->inside.to);
        if (!(from < to))
            continue;
        const double middle = isinf(to) ? from + 1 : (from + to) / 2;
        double p[3];
        for (int k = 0; k < 3; k++)
            p[k] = ball->o[k] + middle * ball->d[k];
        if (twin_dot(p, p) > fmax(tangent, 0)) /* behind where the cone touches it */
            seen_hide(seen, (struct seen_interval){from, to}, 2 * wide, 2 * narrow);
    }
}

static inline void seen_sphere(struct seen *seen, const struct scene_instance *instance, const float sphere[4],
                               bool is_whole)
{
    const float *m = instance->object_from_world;
    struct seen_ball ball = {.radius = sphere[3]};
    double eye[3], shrink = 0, apart = 0, from[3];
    twin_transform(eye, m, seen->view->eye, 1);
    twin_transform(ball.o, m, seen->origin, 0);
    twin_transform(ball.d, m, seen->direction, 0);
    for (int k = 0; k < 3; k++) {
        ball.c[k] = sphere[k] - eye[k];
        from[k] = ball.o[k] - ball.c[k];
        shrink =
            fmax(shrink, sqrt((double)m[k] * m[k] + (double)m[4 + k] * m[4 + k] + (double)m[8 + k] * m[8 + k]));
    }
    double centre[3];
    twin_transform(centre, instance->world_from_object, (const double[3]){sphere[0], sphere[1], sphere[2]}, 1);
    for (int k = 0; k < 3; k++)
        apart += (centre[k] - seen->view->eye[k]) * (centre[k] - seen->view->eye[k]);
    const double a = twin_dot(ball.d, ball.d), b = twin_dot(from, ball.d), r = ball.radius,
                 c = twin_dot(from, from) - r * r;
    ball.within = seen_roots(a, b, c);
    if (twin_dot(ball.c, ball.c) < r * r) { /* seen from within */
        seen_hide(seen, (struct seen_interval){-INFINITY, fmin(ball.within.from, INFINITY)}, 1, is_whole);
        if (ball.within.from < ball.within.to)
            seen_hide(seen, (struct seen_interval){ball.within.to, INFINITY}, 1, is_whole);
    } else {
        const double off = SEEN_TEXELS * seen->view->texel * sqrt(apart) * shrink;
        seen_shadow_of_ball(seen, &ball, r + off, 1, 0);
        seen_shadow_of_ball(seen, &ball, r - off, 0, is_whole);
        /* Where a tangent plane stands for it: near the outline of the eye, and of the ray. */
        const double ends[2] = {ball.within.from, ball.within.to};
        for (int i = 0; i < 2 && ball.within.from < ball.within.to; i++) {
            double p[3], normal[3];
            for (int k = 0; k < 3; k++) {
                p[k] = ball.o[k] + ends[i] * ball.d[k];
                normal[k] = (p[k] - ball.c[k]) / r;
            }
            /* The outline is where the way from the eye is tangent; so far inside it lies a texel. */
            const double cosine = fabs(twin_dot(p, normal)) / sqrt(twin_dot(p, p)),
                         inside = r * (1 - sqrt(fmax(1 - cosine * cosine, 0)));
            const bool is_own =
                ends[i] > seen->t_min && seen_texels_between(seen, seen->t_min, ends[i]) < seen->view->blind;
            if (inside < 2 * off || is_own)
                seen_edge(seen, ends[i]);
        }
    }
    const double beside = sqrt(fmax(twin_dot(from, from) - b * b / a, 0)) - r;
    if (fabs(beside) < SEEN_TEXELS * seen->view->texel * sqrt(apart) * shrink)
        seen_edge(seen, -b / a);
}

static inline void seen_disc(struct seen *seen, const struct scene_disc *disc)
{
    double n[3], c[3], u[3], v[3], height, apart;
    for (int k = 0; k < 3; k++) {
        n[k] = disc->value.normal_world[k];
        c[k] = disc->value.centre_world[k] - seen->view->eye[k];
    }
    height = twin_dot(n, c);
    if (height == 0)
        return;
    apart = sqrt(twin_dot(c, c)) + disc->value.radius;
    const double off = SEEN_TEXELS * seen->view->texel * apart * apart / fabs(height);
    const double on = twin_dot(n, seen->origin), dn = twin_dot(n, seen->direction), side = height > 0 ? 1 : -1;
    for (int k = 0; k < 3; k++) { /* p height - c (n p), across the way from the eye to its centre */
        u[k] = seen->origin[k] * height - c[k] * on;
        v[k] = seen->direction[k] * height - c[k] * dn;
    }
    const bool is_whole = seen_is_whole(seen, disc->value.material);
    for (int i = 0; i < 2; i++) {
        const double radius = disc->value.radius + (i == 0 ? off : -off);
        struct seen_interval beyond = seen->inside;
        seen_clip(&beyond, side * (on - height), side * dn);
        if (radius <= 0)
            continue;
        const double a = twin_dot(v, v) - radius * radius * dn * dn,
                     b = twin_dot(u, v) - radius * radius * on * dn,
                     q = twin_dot(u, u) - radius * radius * on * on;
        if (a > 0) {
            seen_hide(seen, seen_both(beyond, seen_roots(a, b, q)), i == 0, i == 1 && is_whole);
            continue;
        }
        /* The ray stays inside for good: outside between the roots. */
        const struct seen_interval outside = seen_roots(-a, -b, -q);
        struct seen_interval before = beyond, after = beyond;
        before.to = fmin(before.to, outside.from);
        after.from = fmax(after.from, outside.to);
        seen_hide(seen, before, i == 0, i == 1 && is_whole);
        if (outside.from < outside.to)
            seen_hide(seen, after, i == 0, i == 1 && is_whole);
    }
    const double at = (height - on) / dn;
    double squared = 0;
    for (int k = 0; k < 3; k++) {
        const double away = seen->origin[k] + at * seen->direction[k] - c[k];
        squared += away * away;
    }
    if (fabs(sqrt(squared) - disc->value.radius) < off)
        seen_edge(seen, at);
}

/* ---- along a ray ---- */

static inline int seen_by_place(const void *a, const void *b)
{
    const double x = ((const struct seen_event *)a)->at, y = ((const struct seen_event *)b)->at;
    return x < y ? -1 : x > y;
}

/* Where the ray, hidden since `from`, has been so for as long as a tracer may take to see that; after `to`: it
 * comes out before. */
static inline double seen_surely_hidden(const struct seen *seen, double from, double to)
{
    double low = from, high = fmin(to, 1e9 * (1 + fabs(from)));
    if (!(seen_texels_between(seen, from, to) > SEEN_RUN))
        return INFINITY;
    for (int i = 0; i < 50; i++) {
        const double middle = (low + high) / 2;
        if (seen_texels_between(seen, from, middle) > SEEN_RUN)
            high = middle;
        else
            low = middle;
    }
    return high;
}

static inline void seen_meet_all(struct seen *seen)
{
    for (uint32_t m = 0; m < seen->meeting_count; m++) {
        const struct seen_meeting *meeting = &seen->meetings[m];
        if (meeting->at > seen->t_min && meeting->at < fmin(seen->t_max, seen->edge) &&
            seen_texels_between(seen, seen->t_min, meeting->at) < seen->view->blind)
            seen->edge = meeting->at;
        for (size_t i = 0; i < seen->triangle_count; i++)
            if (i != meeting->triangle && meeting->at > seen->t_min &&
                meeting->at < fmin(seen->t_max, seen->edge) && seen_crosses(seen, meeting, i))
                seen->edge = meeting->at;
    }
}

/* From where on as many hide it as there are layers, for longer than rounding: two faces meet in a place that each
 * computes. Surely hidden is what is so for longer than a tracer may take a ray for one beside the surface that it
 * began on, or to the end of the ray. */
static inline void seen_sweep(const struct seen *seen, struct seen_answer *answer)
{
    const int layers = (int)seen->view->layers;
    int wide = 0, narrow = 0;
    double since = INFINITY;
    for (uint32_t i = 0; i < seen->event_count; i++) {
        const double at = seen->events[i].at, next = i + 1 < seen->event_count ? seen->events[i + 1].at : INFINITY;
        wide += seen->events[i].wide;
        narrow += seen->events[i].narrow;
        if (!(next - at > 1e-7 * (1 + fabs(at))))
            continue;
        if (wide >= layers && at < seen->maybe_within)
            answer->maybe_unknown = fmin(answer->maybe_unknown, at);
        since = narrow >= layers ? fmin(since, at) : INFINITY;
        const double end = fmin(next, seen->surely_within);
        if (since < fmin(answer->unknown, end))
            answer->unknown = fmin(answer->unknown, seen_surely_hidden(seen, since, end));
    }
}

static inline void seen_surfaces(struct seen *seen)
{
    size_t cursor = 0;
    uint64_t id;
    void *value;
    for (size_t i = 0; i < seen->triangle_count; i++)
        seen_triangle(seen, i);
    for (size_t i = 0; i < seen->twin->instance_counts[1]; i++) {
        const struct scene_instance instance = twin_instance_at(seen->twin, 1, i, 0);
        const struct scene_spheres *set = scene_spheres(seen->twin->scene, instance.node->value.object);
        for (uint32_t p = 0; set && !instance.singular && p < set->value.sphere_count; p++)
            seen_sphere(seen, &instance, (const float *)(const void *)set->centres_radii->data + 4 * (size_t)p,
                        seen_is_whole(seen, twin_range_material(set->ranges, set->range_count, p)));
    }
    while (hashmap_next(&seen->twin->scene->objects[OBJECT_DISC], &cursor, &id, &value))
        seen_disc(seen, value);
}

/* Where the ray is in a face of so much more, or less, than it is. */
static inline struct seen_interval seen_in_face(const struct seen *seen, double half)
{
    struct seen_interval in = {seen->t_min, seen->t_max};
    const double z = twin_dot(seen->axes[2], seen->origin), dz = twin_dot(seen->axes[2], seen->direction);
    for (int k = 0; k < 4; k++) {
        const double sign = k % 2 ? 1 : -1, *axis = seen->axes[k / 2];
        seen_clip(&in, half * z + sign * twin_dot(axis, seen->origin),
                  half * dz + sign * twin_dot(axis, seen->direction));
    }
    return in;
}

/* A single face sees no more than itself. */
static inline void seen_leave(const struct seen *seen, struct seen_answer *answer)
{
    const double off = SEEN_TEXELS * seen->view->texel;
    const struct seen_interval surely = seen_in_face(seen, seen->view->half - off),
                               maybe = seen_in_face(seen, seen->view->half + off);
    const bool is_in = surely.from <= seen->t_min && surely.from < surely.to,
               may_be_in = maybe.from <= seen->t_min && maybe.from < maybe.to;
    const double surely_out = !may_be_in ? seen->t_min : maybe.to, maybe_out = !is_in ? seen->t_min : surely.to;
    if (surely_out < fmin(seen->t_max, seen->surely_within))
        answer->unknown = fmin(answer->unknown, surely_out);
    if (maybe_out < fmin(seen->t_max, seen->maybe_within))
        answer->maybe_unknown = fmin(answer->maybe_unknown, maybe_out);
}

/* Surely something may be there in the box that bounds the scene; a tracer may look as far from the eye as its
 * farthest corner is. */
static inline void seen_bound(struct seen *seen)
{
    const struct seen_view *view = seen->view;
    struct seen_interval box = {-INFINITY, INFINITY};
    double far = 0;
    seen->surely_within = seen->maybe_within = INFINITY;
    if (!view->is_bounded)
        return;
    for (int k = 0; k < 3; k++) {
        const double low = view->lower[k] - view->eye[k], high = view->upper[k] - view->eye[k];
        seen_clip(&box, seen->origin[k] - low, seen->direction[k]);
        seen_clip(&box, high - seen->origin[k], -seen->direction[k]);
        far += fmax(low * low, high * high);
    }
    seen->surely_within = box.from < box.to ? box.to : -INFINITY;
    seen->maybe_within = 1.01 * (sqrt(twin_dot(seen->origin, seen->origin)) + sqrt(far)) /
                         sqrt(twin_dot(seen->direction, seen->direction));
}

static inline void seen_trace(struct seen_answer *answer, struct seen *seen, const struct ray *ray)
{
    *answer = (struct seen_answer){INFINITY, INFINITY, INFINITY, (double)ray->direction_t_max[3]};
    seen->t_min = ray->origin_t_min[3];
    seen->t_max = ray->direction_t_max[3];
    seen->event_count = seen->meeting_count = 0;
    seen->edge = INFINITY;
    for (int k = 0; k < 3; k++) {
        seen->origin[k] = ray->origin_t_min[k] - seen->view->eye[k];
        seen->direction[k] = ray->direction_t_max[k];
    }
    if (!(seen->t_max > seen->t_min) || !isfinite(twin_dot(seen->origin, seen->direction)))
        return;
    seen_bound(seen);
    for (uint32_t face = 0; face < seen->view->faces; face++) {
        seen->axes = seen->view->axes[face];
        seen->inside = seen_in_face(seen, seen->view->half);
        if (seen->inside.from < seen->inside.to)
            seen_surfaces(seen);
        if (seen->view->faces == 1)
            seen_leave(seen, answer);
    }
    seen_meet_all(seen);
    qsort(seen->events, seen->event_count, sizeof(seen->events[0]), seen_by_place);
    seen_sweep(seen, answer);
    answer->edge = seen->edge;
}

#endif
