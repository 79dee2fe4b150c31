/* SPDX-License-Identifier: MIT */
/* The naive tracer a second time, in C and in double, from the scene and not from its copy on the device.
 * As simple as can be: what it says is what the tracers are compared with. Small scenes only. */
#ifndef FARLIGHT_TESTS_TRACERS_NAIVE_TWIN_H
#define FARLIGHT_TESTS_TRACERS_NAIVE_TWIN_H

#include "scene/affine.h"
#include "scene/pose.h"
#include "scene/scene.h"
#include "shared/ray.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#define TWIN_PI 3.14159265358979323846

struct twin_hit {
    double distance; /* < 0: a miss */
    double normal_geometric[3], normal_shading[3];
    double uv[2];
    double colour[4];  /* colour of the vertices */
    uint32_t material; /* id; 0: the default */
    uint32_t node;     /* 0: a disc */
    bool back_face;
    double bend; /* maximum curvature of a ball's surface, 1 / metres in the world */
};

/* A surface that the ray's line intersects. */
struct twin_intersection {
    struct twin_hit hit;
    double alpha; /* alpha of base colour, texture and vertices */
    double transmittance[3];
    bool cut_out;
};

/* The vertices of an instance as the shutter opens and as it closes; NULL: those of its mesh. */
struct twin_shape {
    float *positions[2], *normals[2];
    bool changes; /* between the two */
};

/* Uncertainty of a tracer that samples: all 0 for an exact one. */
struct twin_blur {
    double near_world; /* metres: edges, the ends of rays and surfaces one behind the other are a close call so
                          near */
    double slope;      /* cosine of ray and normal below which a surface is seen edge-on */
    double alpha;      /* how far alpha is from the cutoff */
};

struct twin {
    const struct scene *scene;
    struct twin_blur blur;
    struct scene_instance *instances[2]; /* instances of meshes, of spheres */
    size_t instance_counts[2];
    struct twin_shape *shapes; /* by mesh instance */
    /* Where the instances are in each pose; the same are shown in all. */
    uint32_t pose_count;
    struct scene_instance *posed[2][MOTION_POSES_MAX];
};

#define TWIN_SURFACES_MAX 128

/* Result of everything on a ray. */
struct twin_answer {
    const struct twin *twin;
    double origin[3], direction[3], length, t_min, t_max, time;
    const struct twin_shape *shape; /* shape of the current instance */
    struct twin_hit closest;
    double second_distance; /* distance of the next surface behind (or just before) the closest */
    double transmittance[3];
    /* Some test was so close (to an edge, to the ray's ends, to the cutoff) that a float, or a cell, may decide it
     * the other way: for the closest hit, and for transmittance, where what is behind the closest hit counts as
     * well. */
    bool close_call, close_any;
    double close_distance;              /* distance of the nearest such test that a cell may decide */
    bool is_close;                      /* the surface in hand is such a test */
    bool is_opaque;                     /* some surface surely stops all light */
    double opaque_distance;             /* distance of the first opaque surface; INFINITY: there is none */
    double surfaces[TWIN_SURFACES_MAX]; /* distances; with blur only */
    uint32_t surface_count;
};

static inline const struct scene_pose *twin_pose(const struct scene_motion *motion, uint32_t pose)
{
    return motion ? &motion->poses[pose] : NULL;
}

static inline void twin_init_shapes(struct twin *twin, const struct scene_motion *motion)
{
    struct error error = {0};
    twin->shapes = calloc(twin->instance_counts[0] + 1, sizeof(*twin->shapes));
    for (size_t i = 0; i < twin->instance_counts[0]; i++) {
        const struct scene_node *node = twin->instances[0][i].node;
        const struct scene_mesh *mesh = scene_mesh(twin->scene, node->value.object);
        for (uint32_t end = 0; scene_node_deforms(node, mesh) && end < 2; end++) {
            float *positions = malloc(mesh->value.vertex_count * 3 * sizeof(float));
            float *normals = malloc(mesh->value.vertex_count * 3 * sizeof(float));
            if (!scene_deform(twin->scene, twin_pose(motion, end * (twin->pose_count - 1)), node, positions,
                              normals, &error))
                exit(1);
            twin->shapes[i].positions[end] = positions;
            twin->shapes[i].normals[end] = normals;
        }
        float *const *ends = twin->shapes[i].positions;
        twin->shapes[i].changes =
            ends[0] && memcmp(ends[0], ends[1], mesh->value.vertex_count * 3 * sizeof(float)) != 0;
    }
}

/* `motion` as for gpu_scene_update; not needed afterwards. */
static inline void twin_init_moving(struct twin *twin, const struct scene *scene,
                                    const struct scene_motion *motion)
{
    *twin = (struct twin){.scene = scene, .pose_count = motion ? motion->pose_count : 1};
    for (int kind = 0; kind < 2; kind++) {
        enum node_kind node_kind = kind == 0 ? NODE_MESH : NODE_SPHERES;
        for (uint32_t p = 0; p < twin->pose_count; p++)
            if (!scene_flatten(scene, twin_pose(motion, p), node_kind, &twin->posed[kind][p],
                               &twin->instance_counts[kind]))
                exit(1);
        twin->instances[kind] = twin->posed[kind][0];
    }
    twin_init_shapes(twin, motion);
}

static inline void twin_init(struct twin *twin, const struct scene *scene)
{
    twin_init_moving(twin, scene, NULL);
}

static inline void twin_finish(struct twin *twin)
{
    for (size_t i = 0; i < twin->instance_counts[0]; i++)
        for (int end = 0; end < 2; end++) {
            free(twin->shapes[i].positions[end]);
            free(twin->shapes[i].normals[end]);
        }
    free(twin->shapes);
    for (int kind = 0; kind < 2; kind++)
        for (uint32_t p = 0; p < twin->pose_count; p++)
            free(twin->posed[kind][p]);
}

/* Where an instance is at the time: entry by entry between the poses before and after it. */
static inline struct scene_instance twin_instance_at(const struct twin *twin, int kind, size_t i, double time)
{
    struct scene_instance instance = twin->instances[kind][i];
    if (twin->pose_count == 1)
        return instance;
    double place = time * (twin->pose_count - 1);
    uint32_t before = (uint32_t)fmin(floor(place), twin->pose_count - 2);
    const float *a = twin->posed[kind][before][i].world_from_object;
    const float *b = twin->posed[kind][before + 1][i].world_from_object;
    for (int k = 0; k < 12; k++)
        instance.world_from_object[k] = (float)(a[k] + (place - before) * ((double)b[k] - a[k]));
    instance.singular = !affine_invert(instance.object_from_world, instance.world_from_object);
    return instance;
}

static inline double twin_dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline void twin_cross(double out[3], const double a[3], const double b[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static inline void twin_normalize(double v[3])
{
    double length = sqrt(twin_dot(v, v));
    for (int k = 0; k < 3; k++)
        v[k] /= length;
}

static inline void twin_transform(double out[3], const float m[12], const double v[3], double w)
{
    for (int row = 0; row < 3; row++)
        out[row] = m[4 * row] * v[0] + m[4 * row + 1] * v[1] + m[4 * row + 2] * v[2] + m[4 * row + 3] * w;
}

/* Normals go by the transposed inverse. */
static inline void twin_normal_to_world(double normal[3], const float object_from_world[12])
{
    double out[3];
    for (int k = 0; k < 3; k++)
        out[k] = object_from_world[k] * normal[0] + object_from_world[4 + k] * normal[1] +
                 object_from_world[8 + k] * normal[2];
    twin_normalize(out);
    memcpy(normal, out, sizeof(out));
}

static inline int twin_wrap(long i, int size, enum wrap wrap)
{
    if (wrap == WRAP_CLAMP)
        return i < 0 ? 0 : i >= size ? size - 1 : (int)i;
    long period = wrap == WRAP_MIRROR ? 2 * size : size;
    i = ((i % period) + period) % period;
    return (int)(i < size ? i : period - 1 - i);
}

static inline void twin_texel(const struct scene_texture *texture, long x, long y, double out[4])
{
    size_t column = (size_t)twin_wrap(x, (int)texture->value.width, texture->value.wrap_u);
    size_t row = (size_t)twin_wrap(y, (int)texture->value.height, texture->value.wrap_v);
    const uint8_t *texel = texture->texels->data + 4 * (row * texture->value.width + column);
    for (int k = 0; k < 4; k++) {
        double c = texel[k] / 255.0;
        if (texture->value.format == TEXTURE_RGBA8_SRGB && k < 3)
            c = c <= 0.04045 ? c / 12.92 : pow((c + 0.055) / 1.055, 2.4);
        out[k] = c;
    }
}

static inline bool twin_sample(const struct scene *scene, const struct record_texture_use *use, const double uv[2],
                               double out[4])
{
    const struct scene_texture *texture = use->texture ? scene_texture(scene, use->texture) : NULL;
    if (!texture)
        return false;
    const float *m = use->uv_transform;
    double x = (m[0] * uv[0] + m[1] * uv[1] + m[2]) * texture->value.width - 0.5;
    double y = (m[3] * uv[0] + m[4] * uv[1] + m[5]) * texture->value.height - 0.5;
    double wx = x - floor(x), wy = y - floor(y);
    memset(out, 0, 4 * sizeof(*out));
    for (int corner = 0; corner < 4; corner++) {
        double texel[4];
        double weight = (corner & 1 ? wx : 1 - wx) * (corner & 2 ? wy : 1 - wy);
        twin_texel(texture, (long)floor(x) + (corner & 1), (long)floor(y) + (corner >> 1), texel);
        for (int k = 0; k < 4; k++)
            out[k] += weight * texel[k];
    }
    return true;
}

/* A cell may decide a test at this distance the other way. */
static inline void twin_is_close(struct twin_answer *answer, double distance)
{
    double near = answer->twin->blur.near_world / answer->length;
    if (distance > answer->t_min - near && distance < answer->t_max + near) {
        answer->close_distance = fmin(answer->close_distance, distance);
        answer->is_close = true;
    }
}

/* Alpha, tint and cutout of a surface, from its material. */
static inline void twin_material(struct twin_answer *answer, struct twin_intersection *intersection)
{
    const struct scene *scene = answer->twin->scene;
    const struct scene_material *material = scene_material(scene, intersection->hit.material);
    memset(intersection->transmittance, 0, sizeof(intersection->transmittance));
    intersection->cut_out = false;
    if (!material)
        return;
    double colour[4], texel[4];
    for (int k = 0; k < 4; k++)
        colour[k] = material->value.base_colour[k] * intersection->hit.colour[k];
    if (twin_sample(scene, &material->textures[MATERIAL_BASE_COLOUR], intersection->hit.uv, texel))
        for (int k = 0; k < 4; k++)
            colour[k] *= texel[k];
    intersection->alpha = colour[3];
    if (material->value.alpha_mode == ALPHA_MASK) {
        intersection->cut_out = colour[3] < material->value.alpha_cutoff;
        answer->close_call |= fabs(colour[3] - material->value.alpha_cutoff) < 1e-3;
        if (fabs(colour[3] - material->value.alpha_cutoff) < answer->twin->blur.alpha)
            twin_is_close(answer, intersection->hit.distance);
    }
    double transmission = material->value.transmission * (1 - material->value.metallic);
    if (twin_sample(scene, &material->textures[MATERIAL_TRANSMISSION], intersection->hit.uv, texel))
        transmission *= texel[0];
    for (int k = 0; k < 3; k++) {
        double through = transmission * colour[k];
        intersection->transmittance[k] =
            material->value.alpha_mode == ALPHA_BLEND ? 1 - colour[3] + colour[3] * through : through;
        if (intersection->cut_out)
            intersection->transmittance[k] = 1;
    }
}

static inline void twin_add_intersection(struct twin_answer *answer, struct twin_intersection *intersection)
{
    struct twin_hit *hit = &intersection->hit;
    /* Around the ray's ends a float may fall on either side. */
    answer->close_call |= fabs(hit->distance - answer->t_min) < 1e-4 * (1 + fabs(answer->t_min));
    answer->close_call |= fabs(hit->distance - answer->t_max) < 1e-4 * (1 + fabs(answer->t_max));
    double near = answer->twin->blur.near_world / answer->length;
    if (fabs(hit->distance - answer->t_min) < near || fabs(hit->distance - answer->t_max) < near)
        twin_is_close(answer, hit->distance);
    if (!(hit->distance > answer->t_min && hit->distance < answer->t_max))
        return;
    twin_material(answer, intersection);
    for (int k = 0; k < 3; k++)
        answer->transmittance[k] *= intersection->transmittance[k];
    if (near > 0 && answer->surface_count < TWIN_SURFACES_MAX)
        answer->surfaces[answer->surface_count++] = hit->distance;
    if (intersection->cut_out)
        return;
    if (!answer->is_close && intersection->transmittance[0] == 0 && intersection->transmittance[1] == 0 &&
        intersection->transmittance[2] == 0) {
        answer->is_opaque = true;
        answer->opaque_distance = fmin(answer->opaque_distance, hit->distance);
    }
    hit->back_face = twin_dot(answer->direction, hit->normal_geometric) > 0;
    if (answer->closest.distance < 0 || hit->distance < answer->closest.distance) {
        if (answer->closest.distance >= 0)
            answer->second_distance = answer->closest.distance;
        answer->closest = *hit;
    } else if (hit->distance < answer->second_distance) {
        answer->second_distance = hit->distance;
    }
}

static inline uint32_t twin_range_material(const struct record_material_range *ranges, uint32_t count,
                                           uint32_t primitive)
{
    for (uint32_t i = 0; i < count; i++)
        if (primitive >= ranges[i].first && primitive - ranges[i].first < ranges[i].count)
            return ranges[i].material;
    return 0;
}

static inline void twin_vertex(const struct scene_mesh *mesh, enum mesh_array array, uint32_t vertex,
                               int components, double *out)
{
    const float *data = (const float *)(const void *)mesh->arrays[array]->data;
    for (int k = 0; k < components; k++)
        out[k] = (double)data[(size_t)vertex * (size_t)components + (size_t)k];
}

/* A position or a normal at the ray's time. */
static inline void twin_moving_vertex(const struct twin_answer *answer, const struct scene_mesh *mesh,
                                      enum mesh_array array, uint32_t vertex, double out[3])
{
    float *const *ends = array == MESH_POSITIONS ? answer->shape->positions : answer->shape->normals;
    if (!ends[0]) {
        twin_vertex(mesh, array, vertex, 3, out);
        return;
    }
    for (size_t k = 0; k < 3; k++) {
        size_t at = (size_t)vertex * 3 + k;
        out[k] = ends[0][at] + answer->time * ((double)ends[1][at] - ends[0][at]);
    }
    if (array == MESH_NORMALS && answer->shape->changes)
        twin_normalize(out);
}

/* Attributes of a point in a triangle. */
static inline void twin_attributes(const struct twin_answer *answer, const struct scene_mesh *mesh,
                                   const uint32_t index[3], const double weight[3],
                                   const float object_from_world[12], struct twin_hit *hit)
{
    memcpy(hit->normal_shading, hit->normal_geometric, sizeof(hit->normal_shading));
    for (int k = 0; k < 4; k++)
        hit->colour[k] = mesh->arrays[MESH_COLOURS] ? 0 : 1;
    if (mesh->arrays[MESH_NORMALS]) {
        double normal[3] = {0}, one[3];
        for (int v = 0; v < 3; v++) {
            twin_moving_vertex(answer, mesh, MESH_NORMALS, index[v], one);
            for (int k = 0; k < 3; k++)
                normal[k] += weight[v] * one[k];
        }
        twin_normal_to_world(normal, object_from_world);
        double cosine = twin_dot(normal, hit->normal_geometric);
        for (int k = 0; k < 3; k++)
            hit->normal_shading[k] = normal[k] - (cosine < 0 ? 2 * cosine * hit->normal_geometric[k] : 0);
    }
    for (int v = 0; v < 3; v++) {
        double one[2] = {0};
        if (mesh->arrays[MESH_TEXCOORDS_0])
            twin_vertex(mesh, MESH_TEXCOORDS_0, index[v], 2, one);
        for (int k = 0; k < 2; k++)
            hit->uv[k] += weight[v] * one[k];
        for (int k = 0; k < 4 && mesh->arrays[MESH_COLOURS]; k++)
            hit->colour[k] +=
                weight[v] * mesh->arrays[MESH_COLOURS]->data[4 * (size_t)index[v] + (size_t)k] / 255.0;
    }
}

static inline void twin_triangle(struct twin_answer *answer, const struct scene_instance *instance,
                                 const struct scene_mesh *mesh, uint32_t primitive)
{
    const uint32_t *indices = (const uint32_t *)(const void *)mesh->arrays[MESH_INDICES]->data;
    uint32_t index[3] = {indices[3 * (size_t)primitive], indices[3 * (size_t)primitive + 1],
                         indices[3 * (size_t)primitive + 2]};
    double corner[3][3], corner_world[3][3], e1[3], e2[3], from[3], p[3], q[3];
    for (int v = 0; v < 3; v++) {
        twin_moving_vertex(answer, mesh, MESH_POSITIONS, index[v], corner[v]);
        twin_transform(corner_world[v], instance->world_from_object, corner[v], 1);
    }
    /* In world space, and by another method than the shaders': Moeller and Trumbore's. */
    for (int k = 0; k < 3; k++) {
        e1[k] = corner_world[1][k] - corner_world[0][k];
        e2[k] = corner_world[2][k] - corner_world[0][k];
        from[k] = answer->origin[k] - corner_world[0][k];
    }
    twin_cross(p, answer->direction, e2);
    twin_cross(q, from, e1);
    double determinant = twin_dot(e1, p);
    if (determinant == 0)
        return;
    double u = twin_dot(from, p) / determinant, v = twin_dot(answer->direction, q) / determinant;
    double inside = fmin(fmin(u, v), 1 - u - v);
    double slope = fabs(determinant) /
                   sqrt(twin_dot(e1, e1) * twin_dot(e2, e2) * twin_dot(answer->direction, answer->direction));
    double distance = twin_dot(e2, q) / determinant;
    /* Nearly on edge, everything is a close call. */
    answer->close_call |= fabs(inside) < 1e-4 || (slope < 1e-3 && inside > -1);
    if (answer->twin->blur.near_world > 0) {
        double e3[3] = {e2[0] - e1[0], e2[1] - e1[1], e2[2] - e1[2]}, area[3];
        twin_cross(area, e1, e2);
        double height = sqrt(twin_dot(area, area)), beside = INFINITY;
        beside = fmin(beside, v * height / sqrt(twin_dot(e1, e1)));
        beside = fmin(beside, u * height / sqrt(twin_dot(e2, e2)));
        beside = fmin(beside, (1 - u - v) * height / sqrt(twin_dot(e3, e3)));
        if (fabs(beside) < answer->twin->blur.near_world || (slope < answer->twin->blur.slope && inside > -1))
            twin_is_close(answer, distance);
    }
    if (inside < 0)
        return;
    struct twin_intersection intersection = {.hit = {.distance = distance, .node = instance->node->base.id}};
    double a[3], b[3];
    for (int k = 0; k < 3; k++) {
        a[k] = corner[1][k] - corner[0][k];
        b[k] = corner[2][k] - corner[0][k];
    }
    twin_cross(intersection.hit.normal_geometric, a, b);
    twin_normal_to_world(intersection.hit.normal_geometric, instance->object_from_world);
    twin_attributes(answer, mesh, index, (const double[3]){1 - u - v, u, v}, instance->object_from_world,
                    &intersection.hit);
    intersection.hit.material = twin_range_material(mesh->ranges, mesh->range_count, primitive);
    twin_add_intersection(answer, &intersection);
}

/* The most by which a transform lengthens: the greatest singular value. */
static inline double twin_stretch(const float m[12])
{
    double v[3] = {0.61, 0.53, 0.59}, length = 1;
    for (int i = 0; i < 40; i++) {
        double image[3], back[3];
        twin_transform(image, m, v, 0);
        for (int k = 0; k < 3; k++)
            back[k] = (double)m[k] * image[0] + (double)m[4 + k] * image[1] + (double)m[8 + k] * image[2];
        length = sqrt(twin_dot(back, back));
        for (int k = 0; k < 3 && length > 0; k++)
            v[k] = back[k] / length;
    }
    return sqrt(length);
}

static inline void twin_sphere(struct twin_answer *answer, const struct scene_instance *instance,
                               const struct scene_spheres *set, uint32_t primitive)
{
    const float *sphere = (const float *)(const void *)set->centres_radii->data + 4 * (size_t)primitive;
    double origin[3], direction[3], from[3];
    twin_transform(origin, instance->object_from_world, answer->origin, 1);
    twin_transform(direction, instance->object_from_world, answer->direction, 0);
    for (int k = 0; k < 3; k++)
        from[k] = origin[k] - sphere[k];
    double a = twin_dot(direction, direction), b = twin_dot(from, direction);
    double c = twin_dot(from, from) - (double)sphere[3] * sphere[3];
    double discriminant = b * b - a * c;
    answer->close_call |= fabs(discriminant) < 1e-3 * a * sphere[3] * sphere[3];
    double shrink = 0; /* shrinking of the shape nearest to the silhouette, from world to object */
    for (int k = 0; k < 3; k++) {
        const float *m = instance->object_from_world;
        shrink =
            fmax(shrink, sqrt((double)m[k] * m[k] + (double)m[4 + k] * m[4 + k] + (double)m[8 + k] * m[8 + k]));
    }
    double beside = sqrt(fmax(twin_dot(from, from) - b * b / a, 0)) - sphere[3];
    if (fabs(beside) < answer->twin->blur.near_world * shrink)
        twin_is_close(answer, fmin(fmax(-b / a, answer->t_min), answer->t_max));
    if (discriminant < 0)
        return;
    /* The longest half axis of the ellipsoid by the square of the shortest. */
    const double bend = twin_stretch(instance->world_from_object) *
                        pow(twin_stretch(instance->object_from_world), 2) / (double)sphere[3];
    for (int side = -1; side <= 1; side += 2) {
        struct twin_intersection intersection = {.hit = {.node = instance->node->base.id, .colour = {1, 1, 1, 1}}};
        struct twin_hit *hit = &intersection.hit;
        hit->distance = (-b + side * sqrt(discriminant)) / a;
        for (int k = 0; k < 3; k++)
            hit->normal_geometric[k] = (from[k] + hit->distance * direction[k]) / sphere[3];
        hit->bend = bend;
        hit->uv[0] = 0.5 + atan2(hit->normal_geometric[0], hit->normal_geometric[2]) / (2 * TWIN_PI);
        hit->uv[1] = acos(fmax(-1, fmin(1, hit->normal_geometric[1]))) / TWIN_PI;
        twin_normal_to_world(hit->normal_geometric, instance->object_from_world);
        memcpy(hit->normal_shading, hit->normal_geometric, sizeof(hit->normal_shading));
        hit->material = twin_range_material(set->ranges, set->range_count, primitive);
        twin_add_intersection(answer, &intersection);
    }
}

static inline void twin_discs(struct twin_answer *answer)
{
    size_t cursor = 0;
    uint64_t id;
    void *value;
    while (hashmap_next(&answer->twin->scene->objects[OBJECT_DISC], &cursor, &id, &value)) {
        const struct scene_disc *disc = value;
        struct twin_intersection intersection = {
            .hit = {.material = disc->value.material, .colour = {1, 1, 1, 1}}};
        double slope = 0, height = 0, squared = 0;
        for (int k = 0; k < 3; k++) {
            intersection.hit.normal_geometric[k] = intersection.hit.normal_shading[k] =
                disc->value.normal_world[k];
            slope += disc->value.normal_world[k] * answer->direction[k];
            height += disc->value.normal_world[k] * (disc->value.centre_world[k] - answer->origin[k]);
        }
        intersection.hit.distance = height / slope;
        answer->is_close = false;
        for (int k = 0; k < 3; k++) {
            double d =
                answer->origin[k] + intersection.hit.distance * answer->direction[k] - disc->value.centre_world[k];
            squared += d * d;
        }
        double radius = sqrt(squared) / disc->value.radius;
        answer->close_call |= fabs(radius - 1) < 1e-3;
        if (slope != 0 && radius <= 1)
            twin_add_intersection(answer, &intersection);
    }
}

static inline int twin_by_size(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

/* Where a cell decides: what is near an edge, and surfaces so close that it cannot tell which comes first. */
static inline void twin_judge_blur(struct twin_answer *answer)
{
    double near = answer->twin->blur.near_world / answer->length;
    qsort(answer->surfaces, answer->surface_count, sizeof(answer->surfaces[0]), twin_by_size);
    for (uint32_t i = 1; i < answer->surface_count; i++)
        if (answer->surfaces[i] - answer->surfaces[i - 1] < near)
            answer->close_distance = fmin(answer->close_distance, answer->surfaces[i]);
    double closest = answer->closest.distance;
    answer->close_call |= answer->close_distance < (closest < 0 ? INFINITY : closest + near);
    answer->close_any |= answer->close_distance < INFINITY && !answer->is_opaque;
}

/* Tests everything on the ray. A dead ray (t_max <= t_min) finds nothing. */
static inline void twin_trace_at(struct twin_answer *answer, const struct twin *twin, const struct ray *ray,
                                 double time)
{
    *answer = (struct twin_answer){.twin = twin,
                                   .time = time,
                                   .t_min = ray->origin_t_min[3],
                                   .t_max = ray->direction_t_max[3],
                                   .closest = {.distance = -1},
                                   .second_distance = INFINITY,
                                   .close_distance = INFINITY,
                                   .opaque_distance = INFINITY,
                                   .transmittance = {1, 1, 1}};
    for (int k = 0; k < 3; k++) {
        answer->origin[k] = ray->origin_t_min[k];
        answer->direction[k] = ray->direction_t_max[k];
    }
    answer->length = sqrt(twin_dot(answer->direction, answer->direction));
    if (answer->t_max <= answer->t_min)
        return;
    for (int kind = 0; kind < 2; kind++) {
        for (size_t i = 0; i < twin->instance_counts[kind]; i++) {
            const struct scene_instance instance = twin_instance_at(twin, kind, i, time);
            const struct scene_mesh *mesh =
                kind == 0 ? scene_mesh(twin->scene, instance.node->value.object) : NULL;
            const struct scene_spheres *set =
                kind == 1 ? scene_spheres(twin->scene, instance.node->value.object) : NULL;
            if (instance.singular)
                continue;
            answer->shape = kind == 0 ? &twin->shapes[i] : NULL;
            for (uint32_t p = 0; mesh && p < mesh->value.triangle_count; p++) {
                answer->is_close = false;
                twin_triangle(answer, &instance, mesh, p);
            }
            for (uint32_t p = 0; set && p < set->value.sphere_count; p++) {
                answer->is_close = false;
                twin_sphere(answer, &instance, set, p);
            }
        }
    }
    twin_discs(answer);
    /* Two surfaces in one place: either may win. */
    if (answer->closest.distance >= 0)
        answer->close_call |=
            answer->second_distance - answer->closest.distance < 1e-4 * (1 + answer->closest.distance);
    if (twin->blur.near_world > 0)
        twin_judge_blur(answer);
    else
        answer->close_any = answer->close_call;
}

static inline void twin_trace(struct twin_answer *answer, const struct twin *twin, const struct ray *ray)
{
    twin_trace_at(answer, twin, ray, 0);
}

#endif
