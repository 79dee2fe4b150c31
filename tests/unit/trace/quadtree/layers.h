/* SPDX-License-Identifier: MIT */
/* A scene, what an eye sees of it layer by layer in double precision, and the nodes that the device makes of it.
 */
#ifndef FARLIGHT_TESTS_QUADTREE_LAYERS_H
#define FARLIGHT_TESTS_QUADTREE_LAYERS_H

#include "tests/accuracy/test_scenes.h"
#include "tests/fixtures/waves.h"
#include "tests/unit/trace/quadtree/tree.h"

#include "gpu_scene/scene.h"
#include "shared/path.h"
#include "trace/quadtree/nodes.h"

#include <epoxy/gl.h>

/* The surface at the centre of a texel: z below 0: none. Its plane, relative to the eye, along the world's axes.
 */
struct surface {
    double z, normal[3], point[3];
    uint32_t what[2];
    bool is_sphere;
};

struct layers {
    struct scene *scene;
    struct gpu_scene gpu;
    struct quadtree_store store;
    struct quadtree_node_build build;
    struct surface *surfaces; /* slice after slice, padded */
    uint32_t (*nodes)[2];     /* read back */
    uint64_t memory_before_bytes;
};

static inline double dot3(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline void cross3(double out[3], const double a[3], const double b[3])
{
    for (int k = 0; k < 3; k++)
        out[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

static inline bool is_orthographic(const struct quadtree_uniforms *u)
{
    return u->depths[2] != 0;
}

/* The line of a texel coordinate, relative to the eye, in the world: begin + z step. */
static inline void sight_line(const struct quadtree_uniforms *u, uint32_t face, double x, double y,
                              double begin[3], double step[3])
{
    const double across[2] = {(x - (double)u->scale_centre[2]) / (double)u->scale_centre[0],
                              (y - (double)u->scale_centre[3]) / (double)u->scale_centre[1]};
    for (int k = 0; k < 3; k++) {
        const double side = across[0] * (double)u->face_from_world[3 * face][k] +
                            across[1] * (double)u->face_from_world[3 * face + 1][k];
        begin[k] = is_orthographic(u) ? side : 0;
        step[k] = (double)u->face_from_world[3 * face + 2][k] + (is_orthographic(u) ? 0 : side);
    }
}

static inline double w_of_depth(const struct quadtree_uniforms *u, double z)
{
    const double near = (double)u->depths[0], far = (double)u->depths[1];
    return is_orthographic(u) ? (far - z) / (far - near) : near / z;
}

static inline double depth_of_w(const struct quadtree_uniforms *u, double w)
{
    const double near = (double)u->depths[0], far = (double)u->depths[1];
    return is_orthographic(u) ? far - w * (far - near) : near / w;
}

/* The exact plane of a surface at texel coordinates. */
static inline double surface_w(const struct quadtree_uniforms *u, uint32_t face, const struct surface *surface,
                               double x, double y)
{
    double begin[3], step[3];
    if (surface->z < 0)
        return 0;
    sight_line(u, face, x, y, begin, step);
    const double ahead = dot3(surface->normal, surface->point) - dot3(surface->normal, begin);
    const double slope = dot3(surface->normal, step);
    return is_orthographic(u) ? w_of_depth(u, ahead / slope) : (double)u->depths[0] * slope / ahead;
}

/* ---- what is seen ---- */

/* Nearest first; what is behind the last layer is dropped. */
static inline void insert_surface(struct layers *layers, uint32_t face, uint32_t texel, struct surface surface)
{
    const struct quadtree_uniforms *u = &layers->store.uniforms;
    const size_t slice = (size_t)u->padded_width * u->padded_height;
    struct surface *at = layers->surfaces + face * u->layers * slice + texel;
    const bool is_beyond = surface.z > (double)u->depths[1] && surface.what[0] != VISIBLE_DISC;
    if (!(surface.z >= (double)u->depths[3]) || is_beyond)
        return;
    for (uint32_t layer = 0; layer < u->layers; layer++, at += slice)
        if (at->z < 0 || surface.z < at->z) {
            const struct surface behind = *at;
            *at = surface;
            surface = behind;
            if (surface.z < 0)
                return;
        }
}

static inline void place_point(const struct layers *layers, const struct instance *instance, const float point[3],
                               double placed[3])
{
    for (int row = 0; row < 3; row++) {
        const float *m = instance->world_from_object[row];
        placed[row] = (double)m[3] - (double)layers->store.uniforms.eye_world[row];
        for (int k = 0; k < 3; k++)
            placed[row] += (double)m[k] * (double)point[k];
    }
}

/* The texels that a triangle may cover: all where only a part of it is before the eye. */
static inline void texels_of_triangle(const struct quadtree_uniforms *u, uint32_t face, double corners[3][3],
                                      uint32_t lower[2], uint32_t upper[2])
{
    const uint32_t size[2] = {u->width, u->height};
    double least[2] = {1e30, 1e30}, greatest[2] = {-1e30, -1e30};
    int before = 0;
    for (int c = 0; c < 3; c++) {
        double local[3];
        for (int k = 0; k < 3; k++) {
            const float *row = u->face_from_world[3 * face + (uint32_t)k];
            local[k] = dot3(corners[c], (double[3]){(double)row[0], (double)row[1], (double)row[2]});
        }
        before += local[2] > 1e-3;
        for (int k = 0; k < 2; k++) {
            const double across = is_orthographic(u) ? local[k] : local[k] / local[2];
            const double at = (double)u->scale_centre[2 + k] + (double)u->scale_centre[k] * across;
            least[k] = fmin(least[k], at);
            greatest[k] = fmax(greatest[k], at);
        }
    }
    for (int k = 0; k < 2; k++) {
        lower[k] = before == 3 ? (uint32_t)fmin(fmax(least[k] - 1, 0), size[k]) : 0;
        upper[k] = before == 3 ? (uint32_t)fmin(fmax(greatest[k] + 1, 0), size[k]) : before ? size[k] : 0;
    }
}

static inline void see_triangle(struct layers *layers, uint32_t face, double corners[3][3], const uint32_t what[2])
{
    const struct quadtree_uniforms *u = &layers->store.uniforms;
    uint32_t lower[2], upper[2];
    double edges[3][3], normal[3];
    for (int k = 0; k < 3; k++)
        for (int axis = 0; axis < 3; axis++)
            edges[k][axis] = corners[(k + 1) % 3][axis] - corners[k][axis];
    cross3(normal, edges[0], edges[1]);
    texels_of_triangle(u, face, corners, lower, upper);
    for (uint32_t y = lower[1]; y < upper[1]; y++)
        for (uint32_t x = lower[0]; x < upper[0]; x++) {
            double begin[3], step[3], point[3];
            sight_line(u, face, x + 0.5, y + 0.5, begin, step);
            const double z = (dot3(normal, corners[0]) - dot3(normal, begin)) / dot3(normal, step);
            int inside = 0;
            for (int k = 0; k < 3; k++)
                point[k] = begin[k] + z * step[k];
            for (int k = 0; k < 3 && inside == k; k++) {
                double from[3], side[3];
                for (int axis = 0; axis < 3; axis++)
                    from[axis] = point[axis] - corners[k][axis];
                cross3(side, edges[k], from);
                inside += dot3(side, normal) >= 0;
            }
            struct surface surface = {.z = z, .what = {what[0], what[1]}};
            memcpy(surface.normal, normal, sizeof(normal));
            memcpy(surface.point, corners[0], sizeof(surface.point));
            if (inside == 3)
                insert_surface(layers, face, y * u->padded_width + x, surface);
        }
}

/* Both intersections with an instance, with the tangent planes there. */
static inline void see_sphere(struct layers *layers, uint32_t face, const struct instance *instance,
                              const float sphere[4], const uint32_t what[2])
{
    const struct quadtree_uniforms *u = &layers->store.uniforms;
    for (uint32_t texel = 0; texel < u->padded_width * u->height; texel++) {
        const uint32_t x = texel % u->padded_width, y = texel / u->padded_width;
        double begin[3], step[3], from[3], along[3];
        if (x >= u->width)
            continue;
        sight_line(u, face, x + 0.5, y + 0.5, begin, step);
        for (int row = 0; row < 3; row++) {
            const float *m = instance->object_from_world[row];
            from[row] = (double)m[3] - (double)sphere[row];
            along[row] = 0;
            for (int k = 0; k < 3; k++) {
                from[row] += (double)m[k] * (begin[k] + (double)u->eye_world[k]);
                along[row] += (double)m[k] * step[k];
            }
        }
        const double a = dot3(along, along), b = dot3(from, along);
        const double discriminant = b * b - a * (dot3(from, from) - (double)sphere[3] * (double)sphere[3]);
        for (int side = 0; side < 2 && discriminant >= 0; side++) {
            struct surface surface = {.z = (-b + (side ? 1 : -1) * sqrt(discriminant)) / a,
                                      .what = {what[0], what[1]},
                                      .is_sphere = true};
            for (int k = 0; k < 3; k++) {
                surface.point[k] = begin[k] + surface.z * step[k];
                for (int row = 0; row < 3; row++)
                    surface.normal[k] +=
                        (double)instance->object_from_world[row][k] * (from[row] + surface.z * along[row]);
            }
            insert_surface(layers, face, texel, surface);
        }
    }
}

static inline void see_disc(struct layers *layers, uint32_t face, const struct disc *disc, uint32_t index)
{
    const struct quadtree_uniforms *u = &layers->store.uniforms;
    struct surface surface = {.what = {VISIBLE_DISC, index}};
    for (int k = 0; k < 3; k++) {
        surface.normal[k] = (double)disc->normal[k];
        surface.point[k] = (double)disc->centre_radius[k] - (double)u->eye_world[k];
    }
    for (uint32_t texel = 0; texel < u->padded_width * u->height; texel++) {
        const uint32_t x = texel % u->padded_width, y = texel / u->padded_width;
        double begin[3], step[3], from[3];
        sight_line(u, face, x + 0.5, y + 0.5, begin, step);
        surface.z =
            (dot3(surface.normal, surface.point) - dot3(surface.normal, begin)) / dot3(surface.normal, step);
        for (int k = 0; k < 3; k++)
            from[k] = begin[k] + surface.z * step[k] - surface.point[k];
        const double radius = (double)disc->centre_radius[3];
        if (x < u->width && dot3(from, from) <= radius * radius)
            insert_surface(layers, face, texel, surface);
    }
}

static inline void see_instance(struct layers *layers, uint32_t face, uint32_t index)
{
    const struct instance *instance = &layers->gpu.instances[index];
    const struct gpu_scene_geometry *geometry = &layers->gpu.geometries[instance->geometry];
    for (uint32_t i = 0; i < geometry->device.primitive_count; i++) {
        const uint32_t what[2] = {index + 1, geometry->device.first_primitive + i};
        if (geometry->mesh) {
            const float(*positions)[3] = (const void *)geometry->mesh->arrays[MESH_POSITIONS]->data;
            const uint32_t *indices = (const void *)geometry->mesh->arrays[MESH_INDICES]->data;
            double corners[3][3];
            for (uint32_t c = 0; c < 3; c++)
                place_point(layers, instance, positions[indices[3 * i + c]], corners[c]);
            see_triangle(layers, face, corners, what);
        } else {
            const float(*spheres)[4] = (const void *)geometry->spheres->centres_radii->data;
            see_sphere(layers, face, instance, spheres[i], what);
        }
    }
}

/* Fills all slices, also for the device. */
static inline void see_all(struct layers *layers)
{
    struct error error = {0};
    struct quadtree_store *store = &layers->store;
    const struct quadtree_uniforms *u = &store->uniforms;
    const size_t texels = (size_t)u->padded_width * u->padded_height * u->faces * u->layers;
    uint32_t(*visible)[2] = malloc(texels * sizeof(*visible));
    layers->surfaces = malloc(texels * sizeof(*layers->surfaces));
    for (size_t i = 0; i < texels; i++)
        layers->surfaces[i] = (struct surface){.z = -1};
    for (uint32_t face = 0; face < u->faces; face++) {
        for (uint32_t i = 0; i < layers->gpu.instance_count; i++)
            see_instance(layers, face, i);
        for (uint32_t i = 0; i < layers->gpu.disc_count; i++)
            see_disc(layers, face, &layers->gpu.discs[i], i);
    }
    for (size_t i = 0; i < texels; i++)
        memcpy(visible[i], layers->surfaces[i].what, sizeof(*visible));
    expect_ok(gpu_texture_reserve_array(device, &store->visible, GL_RG32UI, u->padded_width, u->padded_height,
                                        u->faces * u->layers, &error),
              &error);
    glBindTexture(GL_TEXTURE_2D_ARRAY, store->visible.name);
    glTexSubImage3D(GL_TEXTURE_2D_ARRAY, 0, 0, 0, 0, (GLsizei)u->padded_width, (GLsizei)u->padded_height,
                    (GLsizei)(u->faces * u->layers), GL_RG_INTEGER, GL_UNSIGNED_INT, visible);
    free(visible);
}

/* ---- the structure ---- */

/* Choices of a test for a view; all else is derived. */
struct layers_view {
    uint32_t width, height, faces, layers;
    double focal;          /* texels; of an orthographic view texels a metre */
    double near, far;      /* metres */
    double pixels, radius; /* parameters of the bound */
    double turn;           /* radians about y */
    float eye[3];          /* looks along -z where there is no turn */
    bool orthographic;
};

static inline uint32_t padded(uint32_t size)
{
    return (size + QUADTREE_SIDE - 1) / QUADTREE_SIDE * QUADTREE_SIDE;
}

/* Right, down, forward of the faces of a cube: forward is -z, +x, +z, -x, +y, -y of a world turned about y. */
static inline void place_faces(struct quadtree_uniforms *u, double turn)
{
    static const float faces[QUADTREE_FACES_MAX][3][3] = {
        {{1, 0, 0}, {0, -1, 0}, {0, 0, -1}}, {{0, 0, 1}, {0, -1, 0}, {1, 0, 0}},
        {{-1, 0, 0}, {0, -1, 0}, {0, 0, 1}}, {{0, 0, -1}, {0, -1, 0}, {-1, 0, 0}},
        {{1, 0, 0}, {0, 0, -1}, {0, 1, 0}},  {{1, 0, 0}, {0, 0, 1}, {0, -1, 0}}};
    const double c = cos(turn), s = sin(turn);
    for (uint32_t i = 0; i < 3 * u->faces; i++) {
        const float *axis = faces[i / 3][i % 3];
        u->face_from_world[i][0] = (float)(c * (double)axis[0] + s * (double)axis[2]);
        u->face_from_world[i][1] = axis[1];
        u->face_from_world[i][2] = (float)(c * (double)axis[2] - s * (double)axis[0]);
    }
}

static inline struct quadtree_uniforms uniforms_of(const struct layers_view *view)
{
    struct quadtree_uniforms u = {
        .eye_world = {view->eye[0], view->eye[1], view->eye[2], 0},
        .scale_centre = {(float)view->focal, (float)view->focal, 0.5f * (float)view->width,
                         0.5f * (float)view->height},
        .depths = {(float)view->near, (float)view->far, view->orthographic ? 1 : 0, (float)view->near},
        .bounds = {(float)(view->near * view->pixels / (view->focal * view->radius)), 0, 0,
                   (float)(view->radius / view->near)},
        .width = view->width,
        .height = view->height,
        .padded_width = padded(view->width),
        .padded_height = padded(view->height),
        .faces = view->faces,
        .layers = view->layers,
    };
    if (view->orthographic) {
        u.bounds[0] = (float)(view->pixels / (view->far - view->near));
        u.bounds[3] = 0;
    }
    for (uint32_t level = 0; level <= QUADTREE_TOP; level++)
        u.slice_nodes += (u.padded_width >> level) * (u.padded_height >> level);
    place_faces(&u, view->turn);
    return u;
}

/* Builds the nodes and reads them back. */
static inline void layers_build(struct layers *layers)
{
    struct error error = {0};
    struct quadtree_store *store = &layers->store;
    const size_t bytes = quadtree_nodes_count(&store->uniforms) * sizeof(*layers->nodes);
    expect_ok(gpu_buffer_upload(device, &store->uniform_buffer, &store->uniforms, sizeof(store->uniforms), &error),
              &error);
    expect_ok(quadtree_nodes_begin(&layers->build, store, &error), &error);
    gpu_buffer_clear(device, &store->nodes, 0x7fc00000); /* not a number where nothing is written */
    enum tracer_progress progress;
    do
        progress = quadtree_nodes_step(&layers->build, store, &layers->gpu, &error);
    while (progress == TRACER_MORE);
    expect_ok(progress == TRACER_DONE && gpu_check(device, "nodes", &error), &error);
    free(layers->nodes);
    layers->nodes = malloc(bytes);
    gpu_buffer_read(device, &store->nodes, 0, layers->nodes, bytes);
}

/* Owns the scene. */
static inline void layers_init(struct layers *layers, struct scene *scene, const struct layers_view *view)
{
    struct error error = {0};
    struct scene_changes changes;
    *layers = (struct layers){.scene = scene, .memory_before_bytes = device->memory_used_bytes};
    layers->store = (struct quadtree_store){.device = device, .uniforms = uniforms_of(view)};
    gpu_scene_init(&layers->gpu, device);
    expect_ok(gpu_scene_update(&layers->gpu, scene, NULL, &changes, NULL, &error), &error);
    see_all(layers);
    layers_build(layers);
}

/* Nothing of it is left on the device. */
static inline void layers_finish(struct layers *layers)
{
    quadtree_nodes_finish(&layers->build, device);
    gpu_buffer_finish(device, &layers->store.nodes);
    gpu_buffer_finish(device, &layers->store.uniform_buffer);
    gpu_texture_finish(device, &layers->store.visible);
    gpu_scene_finish(&layers->gpu);
    scene_destroy(layers->scene);
    free(layers->surfaces);
    free(layers->nodes);
    assert_int_equal(device->memory_used_bytes, layers->memory_before_bytes);
}

static inline const struct surface *surface_at(const struct layers *layers, uint32_t slice, uint32_t x, uint32_t y)
{
    const struct quadtree_uniforms *u = &layers->store.uniforms;
    return &layers->surfaces[((size_t)slice * u->padded_height + y) * u->padded_width + x];
}

static inline const uint32_t *node_at(const struct layers *layers, uint32_t slice, uint32_t level, uint32_t x,
                                      uint32_t y)
{
    return layers->nodes[tree_index(&layers->store.uniforms, slice, level, x, y)];
}

#endif
